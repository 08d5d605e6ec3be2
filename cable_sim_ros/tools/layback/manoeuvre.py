"""Does a tow manoeuvre? The criterion by which an interval is that of copies, and not that of steady tows."""

from __future__ import annotations

from math import hypot

import numpy as np

from ...sim.scene import Scene
from ...sim.tables.current import at_start, flow_of

MOVING = 0.2  # m/s, under which the ship has no course of its own
PASSED = 2.0  # times its cable out that a ship has gone since a manoeuvre, until the tow is a steady one again
COURSE, SPEED, CABLE, CURRENT = 5.0, 0.05, 0.02, 0.05  # deg, shares, m/s: changes within that way that are none


def strength(scene: Scene) -> float:
    """Largest current of a scene over the depth, without its variation, m/s."""
    water = scene.water.model_copy(update={"current_variation": type(scene.water.current_variation)()})
    deep = sum(section.length for section in scene.cable.sections.values())
    return max(hypot(*flow_of(water, 0.0)(-part * deep)) for part in np.linspace(0.0, 1.0, 9).tolist())


def manoeuvres(
    seconds: np.ndarray,
    velocity: np.ndarray,
    yaw: np.ndarray,
    cable: np.ndarray,
    scene: Scene,
    since: float = 0.0,
    last: int = 0,
) -> np.ndarray:
    """Does the tow manoeuvre [n]: has course, speed or cable out changed by more than COURSE, SPEED, CABLE while the
    ship went the last PASSED times its cable out, or the current of the scene by more than CURRENT since the start?

    velocity [n, 2], m/s; yaw [n] rad; cable [n] m; since: s of the first sample since the start of the tow; last: only
    of so many samples at the end, 0: of all.
    """
    speed = np.hypot(*velocity.T)
    course = np.unwrap(np.where(speed >= MOVING, np.arctan2(velocity[:, 1], velocity[:, 0]), yaw))
    state = np.column_stack([course / np.radians(COURSE), speed, cable])
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(seconds))])
    first = np.searchsorted(way, way - PASSED * cable)
    asked = range(len(seconds))[-last:]
    found = np.zeros(len(asked), bool)
    for i, k in enumerate(asked):
        least, most = state[first[k] : k + 1].min(axis=0), state[first[k] : k + 1].max(axis=0)
        allowed = np.array([1.0, SPEED * max(most[1], MOVING), CABLE * max(most[2], 1.0)])
        found[i] = (most - least > allowed).any()
    current = strength(scene)
    if current > 0.0 and scene.water.current_variation.time is not None:
        turned = [
            factor * np.exp(1j * turn)
            for factor, turn in (at_start(scene.water, s) for s in (0.0, *since + seconds[asked]))
        ]
        found |= current * np.abs(np.array(turned[1:]) - turned[0]) > CURRENT
    return found
