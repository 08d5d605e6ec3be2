"""Cameras of the page: what each follows and from where it looks."""

from __future__ import annotations

from math import pi, tan
from typing import NamedTuple

import numpy as np

from ...io.messages.rotation import rotate
from ...sim.scene import Scene
from .moment import Moment

WHOLE, SHEAVE, FISH, DRUM = "whole", "sheave", "fish", "drum"
CAMERAS = (WHOLE, SHEAVE, FISH, DRUM)
FIELD = 0.25 * pi  # rad, of view, from top to bottom
ASPECT = 1.2  # width over height of the picture beside the panel
LEVEL = 0.02  # of the scope: a shorter layback has no direction


class Camera(NamedTuple):
    """Eye, what it looks at [m from the point that is followed], and the distances between which things are drawn."""

    eye: np.ndarray
    at: np.ndarray
    near: float
    far: float


def ahead(moment: Moment) -> np.ndarray:
    """Level unit vector from the towbody to the sheave; the ship's heading where the cable hangs straight down."""
    f = moment.frame
    way = (f["sheave_position"] - f["body_position"]) * (1.0, 1.0, 0.0)
    if np.linalg.norm(way) < LEVEL * float(f["scope"]):
        way = np.array(rotate(f["ship_quaternion"], (1.0, 0.0, 0.0))) * (1.0, 1.0, 0.0)
    return way / max(float(np.linalg.norm(way)), 1e-9)


def followed(name: str, scene: Scene, moment: Moment) -> np.ndarray:
    """The point of odom that stands still in a picture. The whole tow is followed along, not up and down."""
    f = moment.frame
    if name == SHEAVE:
        return np.array(f["sheave_position"])
    if name == FISH:
        return np.array(f["body_position"])
    if name == DRUM:
        return np.array(f["ship_position"]) + rotate(f["ship_quaternion"], scene.winch.position)
    return np.array(f["ship_position"]) * (1.0, 1.0, 0.0)


def camera(
    name: str, scene: Scene, moment: Moment, body: tuple[float, float], hull: float, aspect: float = ASPECT
) -> Camera:
    """Where to look from. body: length and diameter of the towbody as drawn; hull: length of the ship [m]; aspect:
    width over height of the picture."""
    forward = ahead(moment)
    starboard = np.array([forward[1], -forward[0], 0.0])
    up = np.array([0.0, 0.0, 1.0])
    bow = np.array(rotate(moment.frame["ship_quaternion"], (1.0, 0.0, 0.0))) * (1.0, 1.0, 0.0)
    bow /= max(float(np.linalg.norm(bow)), 1e-9)
    beam = np.array([bow[1], -bow[0], 0.0])
    if name == SHEAVE:
        r = scene.sheave.radius + scene.sheave.groove_depth
        return _towards(0.35 * r * up, beam - 0.6 * bow + 0.5 * up, 6.0 * r, 30.0 * r)
    if name == DRUM:
        r = scene.winch.drum_radius
        return _towards(0.3 * r * up, beam + 0.9 * bow + 0.6 * up, 11.0 * r, 60.0 * r)
    if name == FISH:
        return _towards(np.zeros(3), starboard + 0.55 * forward + 0.35 * up, 3.2 * max(body[0], 3.0 * body[1]), 0.0)
    origin = followed(WHOLE, scene, moment)
    fish, sheave = (moment.frame[f"{name}_position"] - origin for name in ("body", "sheave"))
    points = np.concatenate((moment.shape[:, :3] - origin, [fish, 0.5 * hull * bow, 0.03 * hull * up, sheave]))
    along, high = points @ forward, points[:, 2]
    middle = 0.5 * (along.min() + along.max()) * forward + (0.5 * (high.min() + high.max())) * up
    wide, tall = np.ptp(along), np.ptp(high)
    away = 0.5 * max(1.2 * tall, 1.25 * wide / aspect, 0.5 * hull) / tan(0.5 * FIELD)
    return _towards(middle, starboard + 0.12 * forward + 0.13 * up, away, 0.0)


def _towards(at: np.ndarray, direction: np.ndarray, away: float, behind: float) -> Camera:
    unit = direction / np.linalg.norm(direction)
    return Camera(at + away * unit, at, away / 400.0, max(8.0 * away, behind, 4000.0))
