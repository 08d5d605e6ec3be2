"""The yardstick: a plain explicit lumped chain, the simplest honest code for these scenes.

Point masses joined by linear springs (no bending), drag per segment on its ends, semi-implicit Euler at the step the
axial wave allows. Axial damping of the springs as a small share of critical, so that the grid's own ringing dies out.
"""

from __future__ import annotations

import time
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
from numba import njit

from .ours import DEEP, Ours, _every, ramped_heave
from .scenes import reference, static_shape

FRACTION = 0.5  # of the largest stable step
DAMPING = 0.02  # of critical, of one segment's axial mode
SETTLE = 60.0  # s before the heave of P5 begins


class Chain(NamedTuple):
    """Segments; the step follows from them. ``soften`` divides EA (a longer step, a longer cable)."""

    segments: int
    soften: float = 1.0

    def __str__(self) -> str:
        return f"{self.segments} segments" + (f", EA / {self.soften:g}" if self.soften != 1.0 else "")


class Links(NamedTuple):
    """A chain as numbers: masses and weights [points], spring, damper, length, EI, stream, drag of a segment; SI."""

    mass: np.ndarray
    weight: np.ndarray
    k: float
    c: float
    length: float
    ei: float
    stream: float
    kn: float
    kt: float


@njit(error_model="numpy", cache=True)
def _forces(links, x, v, f):
    """Forces [N] on the masses: springs, weight, drag of each segment shared by its ends. Planar, x and z."""
    n = x.shape[0]
    weight, k, c, length, ei = links.weight, links.k, links.c, links.length, links.ei
    stream, kn, kt = links.stream, links.kn, links.kt
    for i in range(n):
        f[i, 0], f[i, 1] = 0.0, -weight[i]
    for i in range(n - 1):
        dx, dz = x[i + 1, 0] - x[i, 0], x[i + 1, 1] - x[i, 1]
        l = sqrt(dx * dx + dz * dz)
        tx, tz = dx / l, dz / l
        rate = (v[i + 1, 0] - v[i, 0]) * tx + (v[i + 1, 1] - v[i, 1]) * tz
        t = k * (l - length) + c * rate
        f[i, 0] += t * tx
        f[i, 1] += t * tz
        f[i + 1, 0] -= t * tx
        f[i + 1, 1] -= t * tz
        if kn > 0.0:
            ux = stream - 0.5 * (v[i, 0] + v[i + 1, 0])
            uz = -0.5 * (v[i, 1] + v[i + 1, 1])
            s = ux * tx + uz * tz
            nx, nz = ux - s * tx, uz - s * tz
            q = sqrt(nx * nx + nz * nz)
            hx, hz = 0.5 * (kn * q * nx + kt * abs(s) * s * tx), 0.5 * (kn * q * nz + kt * abs(s) * s * tz)
            f[i, 0] += hx
            f[i, 1] += hz
            f[i + 1, 0] += hx
            f[i + 1, 1] += hz
    if ei > 0.0:  # bending: moment EI (t1 - t0) / L at every inner mass, small angles between segments
        for i in range(1, n - 1):
            for d in range(2):
                b = ei / length**3 * (x[i - 1, d] - 2.0 * x[i, d] + x[i + 1, d])
                f[i - 1, d] -= b
                f[i, d] += 2.0 * b
                f[i + 1, d] -= b


@njit(error_model="numpy", cache=True)
def _integrate(links, x, v, h, steps, every, moved, out):
    """Semi-implicit Euler; the first mass is pinned or follows moved [steps, 2, 2] (position, velocity)."""
    n = x.shape[0]
    mass, weight, k, c, length = links.mass, links.weight, links.k, links.c, links.length
    f = np.empty((n, 2))
    for i in range(steps):
        _forces(links, x, v, f)
        for m in range(1, n):
            for d in range(2):
                v[m, d] += h * f[m, d] / mass[m]
                x[m, d] += h * v[m, d]
        if moved.shape[0] > 0:
            for d in range(2):
                x[0, d], v[0, d] = moved[i, 0, d], moved[i, 1, d]
        if (i + 1) % every == 0:
            s = (i + 1) // every - 1
            # reaction of the pin: spring of the first segment and the weight and inertia of its half
            dx, dz = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1]
            l = sqrt(dx * dx + dz * dz)
            rate = ((v[1, 0] - v[0, 0]) * dx + (v[1, 1] - v[0, 1]) * dz) / l
            t = k * (l - length) + c * rate
            out[s, 0], out[s, 1] = x[n - 1, 0], x[n - 1, 1]
            out[s, 2] = sqrt((t * dx / l) ** 2 + (t * dz / l + weight[0]) ** 2)


def released(setting: Chain) -> Ours:
    """P2 on the chain."""
    p = reference("P2").params
    n = setting.segments
    x, v, mass, k, c, length, h = _chain(p, setting)
    x[:, 0] = np.linspace(0.0, p["L"], n + 1)
    every = max(int(np.ceil(p["dt_out"] / h)), 1)
    h, steps = p["dt_out"] / every, every * int(round(p["T"] / p["dt_out"]))
    out = np.zeros((steps // every, 3))
    begin = time.process_time()
    links = Links(mass, mass * p["g"], k, c, length, float(p["EI"]), 0.0, 0.0, 0.0)
    _integrate(links, x, v, h, steps, every, np.zeros((0, 2, 2)), out)
    cpu = time.process_time() - begin
    history = np.vstack(
        ((0.0, p["L"], 0.0, mass[0] * p["g"]), np.column_stack((p["dt_out"] * np.arange(1, len(out) + 1), out)))
    )
    return Ours(str(setting), n, h, history, cpu, p["T"], 0, steps)


def towed(setting: Chain) -> Ours:
    """P5 and P6 on the chain: settled in the stream first (not timed), then heaved."""
    p = reference("P5").params
    n = setting.segments
    x, v, mass, k, c, length, h = _chain(p, setting)
    kn, kt = 0.5 * p["rho"] * p["d"] * p["Cdn"] * length, 0.5 * p["rho"] * pi * p["d"] * p["Cdt"] * length
    weight = mass * p["w"] / p["mu"]
    mass[-1] += p["M"]
    weight[-1] += p["Wnet"]
    start = reference("P5").data
    for d, column in enumerate((1, 2)):  # begin on the static shape of the reference, then settle on the chain's own
        x[:, d] = np.interp(np.linspace(0.0, p["L"], n + 1), static_shape()[:, 0], static_shape()[:, column])
    every = _every(p["dt_out"], h) + 1
    h = p["dt_out"] / every
    nothing, settle = np.zeros((0, 2, 2)), int(round(SETTLE / h))
    links = Links(mass, weight, k, c, length, 0.0, float(p["U"]), kn, kt)
    _integrate(links, x, v, h, settle, settle, nothing, np.zeros((1, 3)))
    steps = every * int(round(p["T"] / p["dt_out"]))
    path = ramped_heave(p, h * np.arange(1, steps + 1))[:, 0]
    moved = np.ascontiguousarray(np.stack((path[:, [0, 2]] - (0.0, DEEP), path[:, [3, 5]]), 1))
    out = np.zeros((steps // every, 3))
    begin = time.process_time()
    _integrate(links, x, v, h, steps, every, moved, out)
    cpu = time.process_time() - begin
    first = (0.0, start["params"]["L"], 0.0, out[0, 2])
    history = np.vstack((first, np.column_stack((p["dt_out"] * np.arange(1, len(out) + 1), out))))
    return Ours(str(setting), n, h, history, cpu, p["T"], 0, steps)


def _chain(p: dict, setting: Chain):
    """Arrays of a chain and its step: positions, velocities, masses, spring, damper, segment length, step."""
    n = setting.segments
    length, ea = p["L"] / n, p["EA"] / setting.soften
    mass = np.full(n + 1, p["mu"] * length)
    mass[[0, -1]] *= 0.5
    k = ea / length
    c = 2.0 * DAMPING * sqrt(k * mass[1])
    return np.zeros((n + 1, 2)), np.zeros((n + 1, 2)), mass, k, c, length, FRACTION * length / sqrt(ea / p["mu"])


CASES = {
    "P2": (released, (Chain(50), Chain(100), Chain(200))),
    "P5": (towed, (Chain(40, 10.0), Chain(80, 10.0), Chain(80), Chain(160, 10.0))),
    "P6": (towed, (Chain(69, 10.0), Chain(69))),
}
