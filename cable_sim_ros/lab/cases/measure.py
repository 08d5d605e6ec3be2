"""What is read off a rig: points and lengths between the nodes, energies, its matrices."""

from __future__ import annotations

import numpy as np

from ...physics.jit import YES
from ...physics.line import residual
from ...physics.observe import energies
from ...physics.shape import W5, X5, shape, slope
from ...physics.towbody import BODY_ROWS
from ..rig import Rig

INEXTENSIBLE = 1e6     # EA over the largest tension, where a case asks for an inextensible cable


def inextensible(tension: float, ei: float = 0.0, length: float = 1.0) -> float:
    """EA [N] of a cable that shall not stretch: 1e6 tensions, and EA L^2/EI >= 1e8."""
    return max(INEXTENSIBLE * tension, 1e8 * ei / length**2)


def element_of(rig: Rig, s: float) -> tuple[int, float]:
    """Element and xi at unstretched arc length s [m]."""
    e = int(np.clip(np.searchsorted(rig.arc, s, side="right") - 1, 0, rig.nodes - 2))
    return e, (s - rig.arc[e]) / (rig.arc[e + 1] - rig.arc[e])


def point(rig: Rig, s: float) -> np.ndarray:
    """Position [3] at unstretched arc length s [m], by the element's own shape functions."""
    e, x = element_of(rig, s)
    return np.array(shape(x)) @ _unknowns(rig, e)


def stretched_length(rig: Rig) -> float:
    """Length [m] of the deformed cable, five Gauss points an element."""
    return float(sum(w * np.linalg.norm(np.array(slope(x)) @ _unknowns(rig, e))
                     for e in range(rig.nodes - 1) for w, x in zip(W5, X5, strict=True)))


def _unknowns(rig: Rig, e: int) -> np.ndarray:
    q, length = rig.line.q, rig.arc[e + 1] - rig.arc[e]
    return np.stack((q[e, :3], length * q[e, 3:], q[e + 1, :3], length * q[e + 1, 3:]))


def kinetic_energy(rig: Rig) -> float:
    """Kinetic energy [J] of the cable and a body at its last node."""
    line = rig.line
    body = line.bodies[0] if len(line.bodies) else np.zeros(BODY_ROWS)
    return float(energies(line.elements, body, line.gravity, rig.arc, line.q, line.v)[0])


def matrices(rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Tangent stiffness and mass [6 nodes, 6 nodes] of the product's own assembly at the present state."""
    def dense(c2):
        residual(rig.line, 0.0, c2, 0.0, YES)
        n, band, lower = rig.nodes, rig.line.work.band, rig.line.work.lower
        full = np.zeros((6 * n, 6 * n))
        for i in range(n):
            full[6 * i:6 * i + 6, 6 * i:6 * i + 6] = band[i, :, :6]
            if i + 1 < n:
                full[6 * i:6 * i + 6, 6 * i + 6:6 * i + 12] = band[i, :, 6:12]
                full[6 * i + 6:6 * i + 12, 6 * i:6 * i + 6] = lower[i + 1]
        return full
    big = 1e6
    stiffness = dense(0.0)
    return stiffness, (dense(big) - stiffness) / big


def frequencies(rig: Rig, axis: int, count: int) -> np.ndarray:
    """Lowest angular frequencies [rad/s] of small motion along one axis about the present state."""
    from scipy.linalg import eigh
    free = [6 * n + k for n in range(rig.nodes) for k in (axis, 3 + axis) if not rig.line.held[n, k]]
    stiffness, mass = (m[np.ix_(free, free)] for m in matrices(rig))
    mass = 0.5 * (mass + mass.T)
    values, shapes = eigh(0.5 * (stiffness + stiffness.T), mass)
    # without tension and EI the gradient of a free end has no stiffness: a mode of it alone is none of the cable
    own = shapes[-1] ** 2 * mass[-1, -1] < 0.5 * np.einsum("ij,ij->j", shapes, mass @ shapes)
    return np.sqrt(np.maximum(values[own][:count], 0.0))


def crossings(times: np.ndarray, values: np.ndarray, level: float = 0.0, rising: bool | None = None) -> np.ndarray:
    """Times at which a sampled quantity crosses a level, linear between samples."""
    x = values - level
    hit = (x[:-1] < 0.0) != (x[1:] < 0.0)
    if rising is not None:
        hit &= (x[1:] > x[:-1]) == rising
    i = np.flatnonzero(hit)
    return times[i] + (times[i + 1] - times[i]) * x[i] / (x[i] - x[i + 1])
