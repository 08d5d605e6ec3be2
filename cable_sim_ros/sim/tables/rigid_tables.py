"""Bodies with an attitude of their own -> the tables of physics/rigid_model.py."""

from __future__ import annotations

from collections.abc import Sequence
from math import log, pi, sqrt
from typing import NamedTuple

import numpy as np

from ...physics.rigid_model import RIGID, STRIP, Rigid
from ...physics.towbody import BodyModel, Towbody
from ...physics.wing import WING, Wing, wing_record
from ..scene import Scene
from .elementary import product
from .material import bodies_of

STRIPS = 12  # of a hull
SLOPE_OF_A_TAIL = 2.603  # 1/rad, of aspect ratio 2 (Helmbold 1942)


def displaced_volume(body: Towbody, gravity: float, density: float) -> float:
    """Volume [m^3] of water that the body displaces."""
    return max(body.mass * gravity - body.net_weight, 0.0) / (density * max(gravity, 1e-9))


def extent(body: Towbody, gravity: float, density: float) -> tuple[float, float]:
    """Length and diameter of a body [m]: a cylinder of the displaced volume, ten times as long as it is wide."""
    volume = max(displaced_volume(body, gravity, density), 1e-9)
    if body.diameter is None and body.length is None:
        diameter = (4.0 * volume / (10.0 * pi)) ** (1.0 / 3.0)
        return 10.0 * diameter, diameter
    if body.diameter is None:
        assert body.length is not None
        return body.length, sqrt(4.0 * volume / (pi * body.length))
    return (10.0 * body.diameter if body.length is None else body.length), body.diameter


def spheroid(length: float, diameter: float) -> tuple[float, float, float]:
    """Added mass over displaced mass along and across a prolate spheroid, and added inertia across over the displaced
    mass times (l^2 + b^2)/5, l and b its half-axes: Lamb (1932), art. 114-115. Of a sphere: 1/2, 1/2, 0."""
    if length <= 1.0001 * diameter:
        return 0.5, 0.5, 0.0
    e = sqrt(1.0 - (diameter / length) ** 2)
    grow = log((1.0 + e) / (1.0 - e))
    a = 2.0 * (1.0 - e**2) / e**3 * (0.5 * grow - e)
    b = 1.0 / e**2 - (1.0 - e**2) / (2.0 * e**3) * grow
    turned = e**4 * (b - a) / ((2.0 - e**2) * (2.0 * e**2 - (2.0 - e**2) * (b - a)))
    return a / (2.0 - a), b / (2.0 - b), turned


def hat(a: Sequence[float] | np.ndarray) -> np.ndarray:
    """Matrix of the cross product, hat(a) b = a x b."""
    return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])


def inertia_of(body: Towbody) -> np.ndarray:
    """Inertia about the centre of gravity [3, 3], kg m^2."""
    assert body.inertia is not None
    xx, yy, zz = body.inertia
    xy, xz, yz = body.products_of_inertia
    return np.array([[xx, -xy, -xz], [-xy, yy, -yz], [-xz, -yz, zz]])


def hull_centre(body: Towbody) -> tuple[float, float, float]:
    """Where added mass and drag of the hull are given [m]: the centre of buoyancy where the scene does not say."""
    assert body.centre_of_buoyancy is not None
    return body.centre_of_buoyancy if body.hull_centre is None else body.hull_centre


def added_point(body: Towbody) -> tuple[float, float, float]:
    """Point about which added_of() is [m]."""
    return hull_centre(body) if body.added_matrix_point is None else body.added_matrix_point


def added_of(body: Towbody, gravity: float, density: float) -> np.ndarray:
    """Added mass [6, 6] about added_point(): that of the scene, its matrix made symmetric, else that of a spheroid."""
    if body.added_matrix is not None:
        matrix = np.array(body.added_matrix, float).reshape(6, 6)
        return 0.5 * (matrix + matrix.T)
    length, diameter = extent(body, gravity, density)
    water = displaced_volume(body, gravity, density) * density
    along, across, turned = spheroid(length, diameter)
    mass = body.added_mass if any(body.added_mass) else (along * water, across * water, across * water)
    about = turned * water * (0.25 * length**2 + 0.25 * diameter**2) / 5.0
    inertia = (0.0, about, about) if body.added_inertia is None else body.added_inertia
    return np.diag([*mass, *inertia])


class FittedWing(NamedTuple):
    """A wing of a scene: row of its rigid body, the key of that, its own name, its numbers."""

    body: int
    key: str
    name: str
    wing: Wing

    @property
    def joint(self) -> str:
        """Name of its flap in messages: that of the wing, of a body on the line with the body's name before it."""
        return self.name if self.key == "towbody" else f"{self.key.partition('.')[2]}/{self.name}"


def wings_of(scene: Scene) -> list[FittedWing]:
    """Wings of the rigid bodies, in the order of the tables."""
    rigid = [(key, body) for key, body in bodies_of(scene).items() if body.model is BodyModel.RIGID]
    return [FittedWing(k, key, name, wing) for k, (key, body) in enumerate(rigid) for name, wing in body.wings.items()]


def flaps_of(scene: Scene) -> dict[str, int]:
    """Row of the wing of each flap, by its name in messages."""
    return {one.joint: row for row, one in enumerate(wings_of(scene)) if one.wing.flap_share > 0.0}


def moved(matrix: np.ndarray, point: Sequence[float] | np.ndarray) -> np.ndarray:
    """A matrix of inertia [6, 6] about a point, about the origin: H^T M H, H of the velocities there."""
    move = np.eye(6)
    move[:3, 3:] = -hat(point)
    return product(move.T, product(matrix, move))


def rigid_tables(bodies: Sequence[tuple[int, Towbody]], gravity: float, density: float) -> Rigid:
    """The bodies with an attitude of their own, each with its node: see Rigid."""
    rows = np.zeros(len(bodies), RIGID)
    strips, wings = list[np.ndarray](), list[np.ndarray]()
    for row, (node, body) in zip(rows, bodies, strict=True):
        assert body.centre_of_gravity is not None and body.centre_of_buoyancy is not None
        row["node"], row["mass"], row["gravity"] = node, body.mass, gravity
        row["buoyancy"] = body.mass * gravity - body.net_weight
        row["displaced"] = displaced_volume(body, gravity, density) * density
        row["gravity_centre"], row["buoyancy_centre"] = body.centre_of_gravity, body.centre_of_buoyancy
        row["hull_centre"] = hull_centre(body)
        about = hat(body.centre_of_gravity)
        row["inertia"] = inertia_of(body) - body.mass * product(about, about)
        row["added"] = moved(added_of(body, gravity, density), added_point(body))
        row["drag"] = 0.5 * density * body.drag_area[0]
        row["length"], diameter = extent(body, gravity, density)
        row["radius"] = 0.5 * min(diameter, row["length"])
        row["strips"] = len(strips), len(strips) + STRIPS
        row["wings"] = len(wings), len(wings) + len(body.wings)
        own = diameter * row["length"] * body.crossflow_coefficient
        for k in range(STRIPS):
            strip = np.zeros((), STRIP)
            strip["along"] = ((k + 0.5) / STRIPS - 0.5) * row["length"]
            strip["share"], strip["half_height"] = 1.0 / STRIPS, 0.5 * diameter
            strip["across"] = 0.5 * density / STRIPS * np.array([area or own for area in body.drag_area[1:]])
            strips.append(strip)
        wings += [wing_record(wing, density) for wing in body.wings.values()]
    return Rigid(rows, np.array(strips, STRIP), np.array(wings, WING))
