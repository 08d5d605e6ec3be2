"""The current of a scene in the world, whatever it was written in."""

from __future__ import annotations

from math import atan2, cos, degrees, remainder, sin
from typing import Any, NamedTuple

import numpy as np

from ...compiler.jit import driver, inline, plain
from ...physics.sea import SEA
from ...physics.water import CurrentFrame, Water, WaveKind
from ...physics.wind import Air
from ..scene import Scene
from .elementary import product
from .sea_tables import profile_table, table_values, variation_table

STILL_AIR = Air()
HEADING_WITHIN = 5.0  # deg; a ship in waves yaws as much


def current_of(water: Water, yaw: float) -> np.ndarray:
    """The linear current before it varies: at the surface [m/s] and its growth per metre of depth [1/s], each east and
    north: [4]; zero where there is a table.

    yaw: heading of the start [rad]; with water.current_frame = heading the scene counts along it and to port of it.
    """
    given = np.array([water.current, water.current_gradient])
    if water.current_frame is CurrentFrame.HEADING:
        given = product(given, np.array([[cos(yaw), sin(yaw)], [-sin(yaw), cos(yaw)]]))
    return given.ravel()


def at_start(water: Water, seconds: float = 0.0) -> tuple[float, float]:
    """Factor and turn [rad] of the current at the start, or so many seconds after it."""
    pieces = variation_table(water.current_variation)
    if not len(pieces):
        return 1.0, 0.0
    return cubics_at(pieces, float(seconds))


@driver
def cubics_at(pieces, x):
    """Both values at x of a table of physics/sea.py, held beyond its ends."""
    i, high = 0, len(pieces) - 1
    while i < high:  # as np.searchsorted, which takes 0.8 s to compile
        middle = (i + high) // 2
        if pieces[middle, 1] >= x:
            high = middle
        else:
            i = middle + 1
    s = min(max(x, pieces[0, 0]), pieces[-1, 1]) - pieces[i, 0]
    u = ((pieces[i, 2] * s + pieces[i, 3]) * s + pieces[i, 4]) * s + pieces[i, 5]
    v = ((pieces[i, 6] * s + pieces[i, 7]) * s + pieces[i, 8]) * s + pieces[i, 9]
    return u, v


class Flow(NamedTuple):
    """The mean current of a start by height, relative to what moves: called with z [m] it says east and north [m/s]."""

    east: float  # at the surface
    north: float
    east_shear: float  # per m down
    north_shear: float
    c: float  # factor and turn of a table
    s: float
    pieces: np.ndarray  # of a table, no rows: none

    def __call__(self, z: float) -> tuple[float, float]:
        return plain(water_at)(self, z)


@inline
def water_at(flow, z):
    """The current at height z, east and north [m/s]; a table is held beyond its ends."""
    x, y, table = flow.east - flow.east_shear * z, flow.north - flow.north_shear * z, flow.pieces
    if len(table) == 0:
        return x, y
    u, v = cubics_at(table, z)
    return x + flow.c * u - flow.s * v, y + flow.s * u + flow.c * v


def flow_of(water: Water, yaw: float, velocity: tuple[float, float] = (0.0, 0.0)) -> Flow:
    """The mean current of the start, relative to what moves with ``velocity``.

    yaw: heading of the start [rad].
    """
    factor, turn = at_start(water)
    east, north, east_shear, north_shear = _turned(current_of(water, yaw), factor, turn).tolist()
    turn += yaw if water.current_frame is CurrentFrame.HEADING else 0.0
    pieces = np.ascontiguousarray(profile_table(water.current_table))
    east, north = float(east - velocity[0]), float(north - velocity[1])
    return Flow(east, north, east_shear, north_shear, factor * cos(turn), factor * sin(turn), pieces)


def declare_water(now: np.record, water: Water, yaw: float, air: Air = STILL_AIR) -> None:
    """The water and wind of the start into a MEMORY, relative to its tow frame; yaw: heading of the start [rad]."""
    steady = current_of(water, yaw)
    now.current[:] = _turned(steady, *at_start(water))
    now.current[:2] -= now.frame.velocity
    c, s = (cos(yaw), sin(yaw)) if air.frame is CurrentFrame.HEADING else (1.0, 0.0)
    x, y = air.wind
    now.wind[:] = c * x - s * y - now.frame.velocity[0], s * x + c * y - now.frame.velocity[1]
    now.sea = np.zeros((), SEA)
    sea: Any = now.sea
    sea.steady[:], sea.shift[:] = steady, now.frame.origin
    sea.current_yaw = yaw if water.current_frame is CurrentFrame.HEADING else 0.0
    sea.wave_yaw = yaw if water.waves.frame is CurrentFrame.HEADING else 0.0


def _turned(current: np.ndarray, factor: float, turn: float) -> np.ndarray:
    if factor == 1.0 and turn == 0.0:
        return current
    c, s = factor * cos(turn), factor * sin(turn)
    return product(current.reshape(2, 2), np.array([[c, s], [-s, c]])).ravel()


def strongest(water: Water) -> tuple[float, float]:
    """The current at the surface, or where it has none there, below: what says where it sets to."""
    if any(water.current) or water.current_table.depth is None:
        return water.current if any(water.current) else water.current_gradient
    u, v = table_values(water.current_table)
    row = 0 if u[0] or v[0] else int(np.argmax(np.hypot(u, v)))
    return float(u[row]), float(v[row])


def turned_current(scene: Scene, yaw: float) -> str:
    """What a start at heading ``yaw`` [rad] makes of current and waves that the scene has along another heading; "" if
    nothing.

    What is in the world stays there: a current abeam of ship.heading_deg is not abeam of another heading.
    """
    water, given, ship = scene.water, strongest(scene.water), degrees(yaw)
    if abs(remainder(ship - scene.ship.heading_deg, 360.0)) <= HEADING_WITHIN:
        return ""
    stay, keys, what = [], [], []

    def both(towards: float) -> str:
        now, was = _from_the_bow(towards - ship), _from_the_bow(towards - scene.ship.heading_deg)
        return f"{now}, where the scene alone has {{}} {was}"

    if water.current_frame is CurrentFrame.WORLD and any(given):
        sets = both(degrees(atan2(given[1], given[0]))).format("it")
        stay.append(f"the current stays as it is in the world: it sets {sets}")
        keys.append("water.current_frame: heading")
        what.append("the current as it was")
    if water.waves.frame is CurrentFrame.WORLD and water.waves.kind is not WaveKind.OFF:
        go = both(water.waves.towards_deg).format("them")
        stay.append(f"the waves stay as they are in the world: they travel {go}")
        keys.append("water.waves.frame: heading")
        what.append("the waves as they were")
    if not stay:
        return ""
    return (
        f"the heading of the motion is {ship:.4g} deg, ship.heading_deg is {scene.ship.heading_deg:.4g} "
        f"deg: that of the motion is used, and {'; '.join(stay)}. Set ship.heading_deg to {ship:.4g} deg if that is "
        f"meant, or {' and '.join(keys)} to keep {' and '.join(what)} along the ship"
    )


def _from_the_bow(angle: float) -> str:
    """Direction [deg, to port of the bow] in words."""
    angle = remainder(angle, 360.0)
    if abs(angle) < 0.5:
        return "ahead"
    if abs(angle) > 179.5:
        return "astern"
    return f"{abs(angle):.0f} deg to {'port' if angle > 0.0 else 'starboard'} of the bow"
