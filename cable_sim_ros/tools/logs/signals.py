"""Measured or simulated quantities in SI units and the axes of the house: what a comparison takes.

QUANTITIES is the one declaration: name, unit, meaning with sign and datum, and the field of the tick output (with its
component) that simulates it, "" where none does.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np


class Quantity(NamedTuple):
    """A quantity: unit, meaning, field of the tick output, component of that field (-1: a number), factor to it."""

    unit: str
    meaning: str
    output: str = ""
    component: int = -1
    factor: float = 1.0


QUANTITIES: dict[str, Quantity] = {
    # ship, base_link: x forward, y to port, z up; world: east, north, up
    "x": Quantity("m", "east of the origin of the log", "ship_position", 0),
    "y": Quantity("m", "north of the origin of the log", "ship_position", 1),
    "z": Quantity("m", "height of the reference point above the mean water surface", "ship_position", 2),
    "latitude": Quantity("rad", "north positive, WGS 84"),
    "longitude": Quantity("rad", "east positive, WGS 84"),
    "roll": Quantity("rad", "port side up positive"),
    "pitch": Quantity("rad", "bow down positive"),
    "yaw": Quantity("rad", "of the bow, from east to north"),
    "heave": Quantity("m", "of the reference point, up positive"),
    "surge": Quantity("m", "of the reference point, forward positive"),
    "sway": Quantity("m", "of the reference point, to port positive"),
    "roll_rate": Quantity("rad/s", "about x of base_link"),
    "pitch_rate": Quantity("rad/s", "about y of base_link"),
    "yaw_rate": Quantity("rad/s", "about z of base_link"),
    "heave_rate": Quantity("m/s", "of the reference point, up positive"),
    "acceleration_x": Quantity("m/s^2", "specific force along x of base_link"),
    "acceleration_y": Quantity("m/s^2", "specific force along y of base_link"),
    "acceleration_z": Quantity("m/s^2", "specific force along z of base_link, +9.8 at rest"),
    "speed": Quantity("m/s", "over ground"),
    "course": Quantity("rad", "of the track over ground, from east to north"),
    "water_speed": Quantity("m/s", "through the water, ahead positive"),
    # winch and sheave
    "payout": Quantity("m", "pay-out: unstretched cable off the drum", "payout"),
    "payout_rate": Quantity("m/s", "paying out positive", "payout_rate"),
    "tension": Quantity("N", "where the cable leaves the sheave", "tension"),
    "tension_drum": Quantity("N", "at the drum", "tension_drum"),
    "departure_angle": Quantity("rad", "of the cable at the sheave, below the horizontal"),
    # towbody
    "body_x": Quantity("m", "east of the origin of the log", "body_position", 0),
    "body_y": Quantity("m", "north of the origin of the log", "body_position", 1),
    "body_depth": Quantity("m", "below the mean water surface", "body_position", 2, -1.0),
    "body_latitude": Quantity("rad", "north positive, WGS 84"),
    "body_longitude": Quantity("rad", "east positive, WGS 84"),
    "body_depth_rate": Quantity("m/s", "going down positive", "body_velocity", 2, -1.0),
    "body_roll": Quantity("rad", "of the towbody, port side up positive"),
    "body_pitch": Quantity("rad", "of the towbody, nose down positive"),
    "body_yaw": Quantity("rad", "of its nose, from east to north"),
    "layback": Quantity("m", "horizontal distance from the sheave to the towbody", "layback"),
}


@dataclass
class Signal:
    """A quantity over time: time int64 [n] ns, ascending; value float64 [n] in the unit of QUANTITIES.

    source: file and field, or run; assumed: what was taken without being told, each one line, for the verdict.
    """

    quantity: str
    time: np.ndarray
    value: np.ndarray
    source: str = ""
    assumed: list[str] = field(default_factory=list)

    @property
    def unit(self) -> str:
        """Of the values."""
        return QUANTITIES[self.quantity].unit
