"""The current of a scene in the world, whatever it was written in."""

from __future__ import annotations

from math import atan2, cos, degrees, remainder, sin

import numpy as np

from ..physics.water import CurrentFrame
from .scene import Scene

HEADING_WITHIN = 5.0  # deg; a ship in waves yaws as much


def current_of(scene: Scene, yaw: float) -> np.ndarray:
    """Current at the surface [m/s] and its growth per metre of depth [1/s], each east and north: [4].

    yaw: heading of the start [rad]; with water.current_frame = heading the scene counts along it and to port of it.
    """
    water = scene.water
    given = np.array([water.current, water.current_gradient])
    if water.current_frame is CurrentFrame.HEADING:
        given = given @ np.array([[cos(yaw), sin(yaw)], [-sin(yaw), cos(yaw)]])
    return given.ravel()


def turned_current(scene: Scene, yaw: float) -> str:
    """What a start at heading ``yaw`` [rad] makes of a current that the scene has along another heading; "" if nothing.

    One in the world stays there: a current abeam of ship.heading_deg is not abeam of another heading.
    """
    given, ship = scene.water.current, degrees(yaw)
    if scene.water.current_frame is not CurrentFrame.WORLD or not any((*given, *scene.water.current_gradient)):
        return ""
    if abs(remainder(ship - scene.ship.heading_deg, 360.0)) <= HEADING_WITHIN:
        return ""
    sets = degrees(atan2(given[1], given[0])) if any(given) else degrees(atan2(*scene.water.current_gradient[::-1]))
    was, now = _from_the_bow(sets - scene.ship.heading_deg), _from_the_bow(sets - ship)
    return (
        f"the heading of the motion is {ship:.4g} deg, ship.heading_deg is {scene.ship.heading_deg:.4g} "
        f"deg: that of the motion is used, and the current stays as it is in the world: it sets {now}, where the scene "
        f"alone has it {was}. Set ship.heading_deg to {ship:.4g} deg if that is meant, or water.current_frame: heading "
        "to keep the current as it was along the ship"
    )


def _from_the_bow(angle: float) -> str:
    """Direction [deg, to port of the bow] in words."""
    angle = remainder(angle, 360.0)
    if abs(angle) < 0.5:
        return "ahead"
    if abs(angle) > 179.5:
        return "astern"
    return f"{abs(angle):.0f} deg to {'port' if angle > 0.0 else 'starboard'} of the bow"
