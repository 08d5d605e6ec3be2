"""Random cables in every state the kernels know: dry, wet, crossing the surface, touching drum and groove."""

from __future__ import annotations

import numpy as np
import pytest

from cable_sim_ros.physics import ancf, drag, surface
from cable_sim_ros.physics.cable import assemble, make_work
from cable_sim_ros.physics.drag import DragLaw
from cable_sim_ros.physics.jit import LANES, NO, YES


class Bench:
    """A cable of n elements with everything the assembly needs, and its dense residual and tangent."""

    def __init__(
        self,
        n: int = 20,
        seed: int = 1,
        *,
        ea=1e4,
        ei=1.4,
        ca=20.0,
        tau=0.01,
        mass=0.389,
        gravity=9.81,
        compression=1.0,
        law=None,
        amplification=1.7,
        density=1026.0,
        surfaces=(),
        current=(0.0, 0.0, 0.0, 0.0),
        lengths=None,
    ):
        rng = np.random.default_rng(seed)
        self.n, self.rng = n, rng
        groups = -(-n // LANES)
        self.elements = np.zeros((groups, ancf.ROWS, LANES))
        laws = [x for x in DragLaw if x is not DragLaw.OFF]
        for lane in range(groups * LANES):
            e = min(lane, n - 1)
            row = self.elements[lane // LANES, :, lane % LANES]
            rows = drag.element_rows(
                law or laws[e % len(laws)], None if e % 3 else 1.2, amplification, 0.01, density, 1.2e-3, 1.0, gravity
            )
            for index, value in rows.items():
                row[index] = value
            row[ancf.MASS_PER_LENGTH], row[ancf.EA], row[ancf.EI] = mass, ea, ei
            row[ancf.COMPRESSION] = compression
            row[ancf.AXIAL_DAMPING], row[ancf.BENDING_TIME], row[ancf.WEIGHT_PER_LENGTH] = ca, tau, mass * gravity
        self.elements.setflags(write=False)
        lengths = rng.uniform(0.1, 0.3, n) if lengths is None else np.full(n, lengths)
        self.arc = np.concatenate(([0.0], np.cumsum(lengths)))
        self.current = np.array(current, float)
        self.surfaces = np.array(surfaces, float).reshape(-1, surface.SURFACE_COLUMNS)
        self.work, self.tension = make_work(n + 1), np.zeros(n)
        self.q, self.v, self.a = (np.zeros((n + 1, 6)) for _ in range(3))

    def wander(self, slope: float = 0.35, top: float = 0.6) -> None:
        """A wavy line that begins at height ``top`` and falls by ``slope``; random velocities and accelerations."""
        rng, n = self.rng, self.n + 1
        self.q[:, 0], self.q[:, 2] = -self.arc, top - slope * self.arc
        self.q[:, :3] += 0.02 * rng.normal(size=(n, 3))
        tangent = np.gradient(self.q[:, :3], self.arc, axis=0)
        self.q[:, 3:] = tangent / np.linalg.norm(tangent, axis=1)[:, None] + 0.1 * rng.normal(size=(n, 3))
        # slow against the stream: where the flow turns round inside the element that crosses the surface, the
        # moving bound is exact for the integral, not for its quadrature
        self.v, self.a = 0.2 * rng.normal(size=(n, 6)), rng.normal(size=(n, 6))

    def residual(self, q=None, v=None, a=None, sigma=0.0) -> np.ndarray:
        """R [nodes, 6]."""
        self.energy = assemble(
            self.elements,
            self.arc,
            self.q if q is None else q,
            self.v if v is None else v,
            self.a if a is None else a,
            self.current,
            self.surfaces,
            0.0,
            0.0,
            sigma,
            NO,
            self.work,
            self.tension,
        )
        return -self.work.band[:, :, 12].copy()

    def tangent(self, c1: float, c2: float, sigma: float = 0.0) -> np.ndarray:
        """dR/dq with v and a following by c1 and c2 [6 nodes, 6 nodes]."""
        assemble(
            self.elements,
            self.arc,
            self.q,
            self.v,
            self.a,
            self.current,
            self.surfaces,
            c1,
            c2,
            sigma,
            YES,
            self.work,
            self.tension,
        )
        n = self.n + 1
        k = np.zeros((6 * n, 6 * n))
        for i in range(n):
            k[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = self.work.band[i, :, :6]
            if i < n - 1:
                k[6 * i : 6 * i + 6, 6 * i + 6 : 6 * i + 12] = self.work.band[i, :, 6:12]
            if i > 0:
                k[6 * i : 6 * i + 6, 6 * i - 6 : 6 * i] = self.work.lower[i]
        return k

    def difference(self, c1: float, c2: float, sigma: float = 0.0, step: float = 1e-7) -> np.ndarray:
        """The same by central differences."""
        n = self.n + 1
        k = np.zeros((6 * n, 6 * n))
        for i in range(n):
            for c in range(6):
                r = []
                for s in (step, -step):
                    q, v, a = self.q.copy(), self.v.copy(), self.a.copy()
                    q[i, c] += s
                    v[i, c] += c1 * s
                    a[i, c] += c2 * s
                    r.append(self.residual(q, v, a, sigma))
                k[:, 6 * i + c] = ((r[0] - r[1]) / (2 * step)).ravel()
        return k


@pytest.fixture
def bench():
    """Factory of Bench."""
    return Bench


def touching(bench: Bench, node: int, throat: float | None, radius: float = 0.3, depth: float = 0.007) -> np.ndarray:
    """A moving, turning surface that the cable presses by ``depth`` at ``node``."""
    row = surface.surface_row((0.0, 0.0, 0.0), radius, throat, 0.05, 0.03, 1e6, 0.2)
    row[surface.CENTRE : surface.CENTRE + 3] = bench.q[node, :3] + np.array([0.01, 0.003, depth - radius])
    row[surface.SPEED : surface.SPEED + 3] = (0.1, -0.2, 0.15)
    row[surface.SPIN : surface.SPIN + 3] = (0.1, 0.2, 0.3)
    row[surface.AXIS : surface.AXIS + 3] = (0.0, 1.0, 0.0)
    return row
