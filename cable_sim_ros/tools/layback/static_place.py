"""Where the towbody of a static tow is, and the 95 % interval of that place from what is not known of the tow.

The interval is that of independent contributions: the square root of the sum of the squares of half the differences
between the static tows at both ends of each range (law of propagation, JCGM 100:2008, 5.1.2, by central differences).
At most 1 + 2 x 5 static tows a place.
"""

from __future__ import annotations

from math import atan2, cos, hypot, radians, sin, sqrt
from typing import NamedTuple

import numpy as np

from ...sim.layout import layout_of
from ...sim.scene import Scene
from ...sim.statics.static_shape import tow_shape
from ...sim.tables.current import flow_of
from ..ensemble.plan import Ranges, with_drag

STILL = 1e-6  # m/s
OTHERWISE = (0.0, 1e-3, -1e-3)  # of the cable out
DEEP = 0.5  # of the scope: the depth whose current is turned


class Tow(NamedTuple):
    """Of a steady tow: cable out [m], velocity of the ship over ground, east and north [m/s], yaw of the ship [rad]."""

    cable: float
    east: float
    north: float
    yaw: float


class Place(NamedTuple):
    """Of a towbody: east and north of the sheave's centre, and below the mean water surface, m."""

    east: float
    north: float
    depth: float

    @property
    def layback(self) -> float:
        """Horizontal distance from the sheave."""
        return hypot(self.east, self.north)


class Band(NamedTuple):
    """Half-widths of the 95 % intervals [m]: of the layback, the place along and across its mean direction, the depth;
    covariance: of east and north [m^2], of one standard deviation."""

    layback: float
    along: float
    across: float
    depth: float
    covariance: tuple[float, float, float]  # east east, east north, north north


COVERAGE = 1.96  # standard deviations of a 95 % interval


class NoShape(ValueError):
    """A tow that has no static shape."""


def static_place(scene: Scene, tow: Tow, drag: float = 1.0) -> Place:
    """Of the towbody of a steady tow with ``drag`` times the drag of the scene. Raises NoShape.

    Where the integration does not close with this cable, one a thousandth longer or shorter stands for it.
    """
    route = layout_of(scene).route
    speed = hypot(tow.east, tow.north)
    course = atan2(tow.north, tow.east) if speed > STILL else tow.yaw
    ship = scene.ship.model_copy(update={"tow_speed": speed})
    towed = with_drag(scene, drag).model_copy(update={"ship": ship})
    for other in OTHERWISE:
        shape = tow_shape(towed, route, (1.0 + other) * tow.cable, course)
        if shape.closed and np.isfinite(shape.place).all():
            break
    else:
        raise NoShape(f"{scene.name}: {tow.cable:.4g} m of cable at {speed:.3g} m/s has no static shape")
    pull = shape.force[-1]
    flat = hypot(pull[0], pull[1])
    leaves = route.sheave * cos(shape.angle)  # from the sheave's centre to where the cable leaves it
    over = [leaves * (-pull[k] / flat if flat > 0.0 else 0.0) for k in (0, 1)]
    away = shape.place[0] - shape.place[-1]
    return Place(float(away[0] + over[0]), float(away[1] + over[1]), float(-shape.place[0, 2]))


def band_of(scene: Scene, tow: Tow, ranges: Ranges, drag: float = 1.0) -> tuple[Place, Band]:
    """The place of the towbody of a steady tow, and its interval. Raises NoShape."""
    middle = static_place(scene, tow, drag)
    speed = hypot(tow.east, tow.north)
    course = atan2(tow.north, tow.east) if speed > STILL else tow.yaw
    ahead, port = (cos(course), sin(course)), (-sin(course), cos(course))
    ends: list[tuple[Place, Place]] = []

    def sailed(way: tuple[float, float], by: float) -> Tow:
        return tow._replace(east=tow.east + by * way[0], north=tow.north + by * way[1])

    def both(way: tuple[float, float], by: float) -> None:
        if by > 0.0:
            ends.append((static_place(scene, sailed(way, by), drag), static_place(scene, sailed(way, -by), drag)))

    if ranges.drag > 0.0:
        ends.append(
            (static_place(scene, tow, drag * (1.0 + ranges.drag)), static_place(scene, tow, drag * (1.0 - ranges.drag)))
        )
    both(ahead, hypot(ranges.speed, ranges.current))  # water past the ship by its speed and by a current: the same
    both(port, ranges.current)
    flow = flow_of(scene.water, tow.yaw)(-DEEP * tow.cable)
    current = hypot(*flow)
    if current > STILL:
        both((-flow[1] / current, flow[0] / current), current * sin(radians(min(ranges.current_turn_deg, 90.0))))
    if ranges.payout > 0.0:
        more, less = (tow._replace(cable=max(tow.cable + by, 0.1)) for by in (ranges.payout, -ranges.payout))
        ends.append((static_place(scene, more, drag), static_place(scene, less, drag)))
    return middle, _combined(middle, ends, ahead)


def _combined(middle: Place, ends: list[tuple[Place, Place]], ahead: tuple[float, float]) -> Band:
    """Root of the sum of squares; along and across are of the layback, where there is one, else of the course."""
    size = middle.layback
    way = (middle.east / size, middle.north / size) if size > STILL else (-ahead[0], -ahead[1])
    total = [0.0] * 4
    spread = np.zeros((2, 2))
    for high, low in ends:
        east, north = 0.5 * (high.east - low.east), 0.5 * (high.north - low.north)
        along, across = east * way[0] + north * way[1], -east * way[1] + north * way[0]
        parts = (0.5 * (high.layback - low.layback), along, across, 0.5 * (high.depth - low.depth))
        total = [a + b * b for a, b in zip(total, parts, strict=True)]
        spread += np.outer((east, north), (east, north))
    covariance = spread / COVERAGE**2
    layback, along, across, depth = map(sqrt, total)
    return Band(
        layback, along, across, depth, (float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1]))
    )
