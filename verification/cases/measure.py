"""What the families read off a line: points, tensions, reactions, crossings."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import trapezoid

from cable_sim_ros.physics.hermite import W4, X4, shape, slope
from cable_sim_ros.sim.rig.rig import History, Rig


def point(rig: Rig, s: float, q: np.ndarray | None = None) -> np.ndarray:
    """Position [.., 3] at unstretched arc length s [m] by the element's own shape functions; q [.., nodes, 6]."""
    q = rig.state.q if q is None else q
    e = int(np.clip(np.searchsorted(rig.arc, s, "right") - 1, 0, rig.nodes - 2))
    length = rig.arc[e + 1] - rig.arc[e]
    n = shape(float((s - rig.arc[e]) / length))
    return (
        n[0] * q[..., e, :3]
        + n[1] * length * q[..., e, 3:]
        + n[2] * q[..., e + 1, :3]
        + n[3] * length * q[..., e + 1, 3:]
    )


def stretched_length(rig: Rig) -> float:
    """Arc length of the deformed line [m], by the quadrature the element uses for its strain."""
    q, length = rig.state.q, np.diff(rig.arc)[:, None]
    total = 0.0
    for x, w in zip(X4, W4):
        d = slope(float(x))
        along = d[0] * q[:-1, :3] + d[1] * length * q[:-1, 3:] + d[2] * q[1:, :3] + d[3] * length * q[1:, 3:]
        total += w * np.linalg.norm(along, axis=1).sum()
    return float(total)


def tension_along(rig: Rig, tension: np.ndarray, s: float) -> float:
    """Element tensions [N] carried to arc length s [m]: the parabola through the three nearest element middles."""
    middle = 0.5 * (rig.arc[1:] + rig.arc[:-1])
    near = np.sort(np.argsort(np.abs(middle - s), kind="stable")[:3])
    scale = rig.arc[-1]
    return float(np.polyval(np.polyfit((middle[near] - s) / scale, tension[near], len(near) - 1), 0.0))


def moment(rig: Rig, node: int) -> np.ndarray:
    """Moment [N m] that holds a held tangent: g x Q_g, since Q_g does the work Q_g . (turn x g)."""
    return np.cross(rig.state.q[node, 3:], rig.state.reaction[node, 3:])


def follow(
    rig: Rig,
    duration: float,
    step: float,
    pick: Callable[[History], list[np.ndarray]],
    start: tuple[float, ...],
    chunk: int = 256,
) -> list[np.ndarray]:
    """Run and sample every step: time [s] from 0 on and what ``pick`` takes of a History, with its value at the start.

    In chunks, for the whole of a fine run would not fit into memory.
    """
    steps = max(int(round(duration / step)), 1)
    h, parts = duration / steps, []
    for done in range(0, steps, chunk):
        parts.append(pick(rig.run(h * min(chunk, steps - done), h)))
    return [h * np.arange(steps + 1)] + [np.concatenate(([a], *y)) for a, y in zip(start, zip(*parts))]


def crossings(t: np.ndarray, y: np.ndarray, level: float) -> np.ndarray:
    """Times [s] at which the samples y pass a level, by a straight line between samples."""
    d = np.asarray(y) - level
    i = np.flatnonzero((d[:-1] < 0.0) != (d[1:] < 0.0))
    return t[i] + (t[i + 1] - t[i]) * d[i] / (d[i] - d[i + 1])


def mean_between(t: np.ndarray, y: np.ndarray, low: float, high: float) -> float:
    """Mean over time of samples y between two instants [s], straight between samples."""
    inside = t[(t > low) & (t < high)]
    x = np.concatenate(([low], inside, [high]))
    return float(trapezoid(np.interp(x, t, y), x) / (high - low))


def numbers(value) -> list[float]:
    """A list of numbers from a list or one number."""
    return [float(v) for v in (value if isinstance(value, list) else [value])]


def nearest(asked: float, given: list[float]) -> float:
    """The given number an output's rounded one means; the asked itself where none is within 1e-3 of it."""
    best = min(given, key=lambda v: abs(v - asked), default=asked)
    return best if abs(best - asked) <= 1e-3 * max(abs(asked), abs(best)) else asked
