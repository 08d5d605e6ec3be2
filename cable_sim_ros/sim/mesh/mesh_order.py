"""How far an element of length h leads the cable off its static shape, by its model: what a mesh goes by."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import sqrt
from typing import NamedTuple

import numpy as np

from ..statics.static_shape import TowShape, derivative

# sagitta L^2/8R of a link on drum or sheave over the penetration that contact allows; of 1.8 the full-scale tow has
# the contact force within 0.03 % and a penetration 1.1 times as large, of 4.4 the flag PENETRATION (docs/segments.md)
MAX_SAGITTA = 2.0


def longest_on(radius: float, allowed: float) -> float:
    """Longest link [m] whose sagitta on a ``radius`` [m] is MAX_SAGITTA of the penetration ``allowed`` [m]."""
    return sqrt(8.0 * radius * MAX_SAGITTA * allowed)


class Order(NamedTuple):
    """Error of the body's place [m]: per_shape h^power times the measure of the shape, summed over the elements, and
    per_kink h^2 times a jump of the curvature [1/m] inside one."""

    power: int
    per_shape: float
    per_kink: float
    what: str
    measure: Callable[[TowShape], np.ndarray]


def link_measure(shape: TowShape) -> np.ndarray:
    """kappa^2 / 24 + |d3r/ds3| / 12 [n], 1/m^2: a chord is shorter than its arc, and its ends share loads by halves."""
    bend = np.linalg.norm(shape.bend, axis=1)
    return np.asarray(bend * bend / 24.0 + derivative(shape, 3) / 12.0)


# factors: the largest found over 22 tows of 8 m to 6 km on 5 meshes each; most are a fifth of it (docs/mesh.md)
CUBICS = Order(4, 1.0 / 1500.0, 1.0 / 120.0, "static shape, |d4r/ds4|", partial(derivative, order=4))
# where both errors add up; the largest found for four shipped scenes on 4 meshes each is 0.75 of it (docs/segments.md)
LINKS = Order(3, 1.0, 1.0 / 12.0, "static shape, corners between links", link_measure)


def integral(y: np.ndarray, x: np.ndarray) -> float:
    """By the trapezoidal rule."""
    return float((np.diff(x) * (y[1:] + y[:-1]) / 2.0).sum())


def kinks(shape: TowShape) -> list[tuple[float, float]]:
    """Where the curvature jumps, at the water surface and between sections: m from the body, and jump [1/m]."""
    jump = np.linalg.norm(np.diff(shape.bend, axis=0), axis=1)
    where = np.flatnonzero((np.diff(shape.wet.astype(int)) != 0) | (np.diff(shape.section) != 0))
    return [(float(shape.s[i]), float(jump[i])) for i in where]
