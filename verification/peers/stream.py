"""Load of P5 and P6 on planar cubic (ANCF) elements, with its derivatives: for a code that takes it from outside.

Nodes carry four coordinates, displacement and slope less those of a line along x. Drag is integrated along the element
and is in the Jacobian, as lumped or lagged drag costs per cents of heave.
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from numba import njit

TINY = 1e-200  # in place of zeros, which sparse matrices may not contain


@njit(error_model="numpy", cache=True)
def _wet(q, v, arc, gauss, shapes, slopes, stream, rise, across, along, force, blocks, by_q, by_v):
    """Adds the drag of a stream (stream, -rise) [m/s] to force [4 nodes] (N, N m) and subtracts its derivatives by q
    and v, times by_q and by_v, from blocks [elements, 8, 8], where there are any. shapes, slopes [points, 4]: Hermite
    on an element of unit length."""
    for e in range(len(arc) - 1):
        length = arc[e + 1] - arc[e]
        for k in range(len(gauss)):
            n = (shapes[k, 0], length * shapes[k, 1], shapes[k, 2], length * shapes[k, 3])
            d = (slopes[k, 0] / length, slopes[k, 1], slopes[k, 2] / length, slopes[k, 3])
            gx, gz, ux, uz = 1.0, 0.0, stream, -rise
            for a in range(4):
                i = 4 * e + 2 * a
                gx, gz = gx + d[a] * q[i], gz + d[a] * q[i + 1]
                ux, uz = ux - n[a] * v[i], uz - n[a] * v[i + 1]
            g = sqrt(gx * gx + gz * gz)
            tx, tz = gx / g, gz / g
            # components along the cable and across it, (-tz, tx)
            s, c = ux * tx + uz * tz, uz * tx - ux * tz
            w = gauss[k] * length
            fs, fc = w * along * abs(s) * s, w * across * abs(c) * c
            fx, fz = fs * tx - fc * tz, fs * tz + fc * tx
            for a in range(4):
                force[4 * e + 2 * a] += n[a] * fx
                force[4 * e + 2 * a + 1] += n[a] * fz
            if len(blocks) == 0:
                continue
            ks, kc = 2.0 * w * along * abs(s), 2.0 * w * across * abs(c)
            # by the velocity of the water; by the angle of the cable, which turns s by c and c by -s
            xx, xz, zz = ks * tx * tx + kc * tz * tz, (ks - kc) * tx * tz, ks * tz * tz + kc * tx * tx
            turn_x, turn_z = ks * c * tx + kc * s * tz - fz, ks * c * tz - kc * s * tx + fx
            for a in range(4):
                for b in range(4):
                    m, t = by_v * n[a] * n[b], by_q * n[a] * d[b] / g
                    blocks[e, 2 * a, 2 * b] += m * xx + t * turn_x * tz
                    blocks[e, 2 * a, 2 * b + 1] += m * xz - t * turn_x * tx
                    blocks[e, 2 * a + 1, 2 * b] += m * xz + t * turn_z * tz
                    blocks[e, 2 * a + 1, 2 * b + 1] += m * zz - t * turn_z * tx


def hermite(points: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gauss weights [points], cubic shape functions and their slopes [points, 4] on an element of unit length."""
    x, weight = np.polynomial.legendre.leggauss(points)
    x, one = 0.5 * (x + 1.0), np.ones(points)
    cubic = np.array(((1, 0, -3, 2), (0, 1, -2, 1), (0, 0, 3, -2), (0, 0, -1, 1)), float)
    return (
        0.5 * weight,
        np.stack((one, x, x**2, x**3), 1) @ cubic.T,
        np.stack((0 * one, one, 2 * x, 3 * x**2), 1) @ cubic.T,
    )


class Stream:
    """Load of the cable in the stream, seen from a frame that heaves as ``motion`` [instants, 2] (velocity,
    acceleration) at ``times``: drag, wet weight, inertia of the frame; the towbody on the last node."""

    def __init__(self, arc: np.ndarray, points: int, p: dict, times: np.ndarray, motion: np.ndarray) -> None:
        self.arc, self.p, self.times, self.motion, size = arc, p, times, motion, 4 * len(arc)
        self.rule = hermite(points)
        self.drag = 0.5 * p["rho"] * p["d"] * p["Cdn"], 0.5 * p["rho"] * p["d"] * pi * p["Cdt"]
        length = np.diff(arc)
        spread = np.zeros((len(arc), 4))  # of a unit load down the cable
        for k, at in ((0, slice(None, -1)), (1, slice(1, None))):
            spread[at, 1] += 0.5 * length
            spread[at, 3] += (1.0, -1.0)[k] * length**2 / 12.0
        self.mass, self.weight = p["mu"] * spread.ravel(), p["w"] * spread.ravel()
        self.mass[size - 3] += p["M"]
        self.weight[size - 3] += p["Wnet"]
        self.blocks = np.zeros((len(length), 8, 8))
        mine = 4 * np.arange(len(length))[:, None] + np.arange(8)
        # row, column, value of the blocks; shared places are summed
        self.triplets = np.column_stack(
            (np.repeat(mine, 8, axis=1).ravel(), np.tile(mine, 8).ravel(), self.blocks.ravel())
        )

    def _state(self, t: float) -> tuple[float, float]:
        return np.interp(t, self.times, self.motion[:, 0]), np.interp(t, self.times, self.motion[:, 1])

    def force(self, t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Generalised load at displacements q and velocities v of the nodes."""
        rise, lift = self._state(t)
        force = -self.weight - lift * self.mass
        _wet(q, v, self.arc, *self.rule, self.p["U"], rise, *self.drag, force, self.blocks[:0], 0.0, 0.0)
        return force

    def jacobian(self, t: float, q: np.ndarray, v: np.ndarray, by_q: float, by_v: float) -> np.ndarray:
        """Derivative of the left-hand side, by_q and by_v its factors, as [entries, 3]: row, column, value."""
        rise, unused = self._state(t)[0], np.zeros(len(q))
        self.blocks[:] = TINY
        _wet(q, v, self.arc, *self.rule, self.p["U"], rise, *self.drag, unused, self.blocks, by_q, by_v)
        self.triplets[:, 2] = self.blocks.ravel()
        return self.triplets
