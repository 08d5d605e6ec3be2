"""Signals of what this product wrote: tick outputs of a run, channels and odometry of an imported bag.

Measured or simulated quantities in SI units and the axes of the house: what a comparison takes.

QUANTITIES is the one declaration: name, unit, meaning with sign and datum, and the field of the tick output (with its
component) that simulates it, "" where none does.
"""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ...io.bags.bag import BagError, BagReader
from ...io.bags.typestore import STORE
from ...io.messages.cdr import header_time
from ...io.sources.recorded_tow import (
    CHANNEL_NAMES,
    COMPARED,
    RecordedTow,
    odometry_of,
    read_tow,
    recorded_frames,
    recorded_values,
)
from ...sim.tables.attitude import angles_of

ODOMETRY = ("x", "y", "z", "roll", "pitch", "yaw")
SIGNALS_TOPIC = "/tow_sim/import/signals"  # of an imported bag: every record of every signal
JOINT_STATE = "sensor_msgs/msg/JointState"
IMPORT = "import"  # of the custom data of an imported bag


class Quantity(NamedTuple):
    """A quantity: unit, meaning, field of the tick output, component of that field (None: a number), factor to it."""

    unit: str
    meaning: str
    output: str = ""
    component: int | None = None
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


def signals_of_bag(path: str | os.PathLike) -> list[Signal]:
    """Signals of a bag in the channels of this product: of a run, or of an import; empty where it has none of them."""
    imported = _of_import(path)
    if imported:
        return imported
    try:
        tow = read_tow(path)
    except BagError:
        return []
    frames = recorded_frames(tow)
    if frames is not None and len(frames):
        return signals_of_frames(frames, os.fspath(path))
    found = _of_channels(tow)
    return [*found, *_of_odometry(tow)] if found or IMPORT in tow.about else []


def _of_import(path: str | os.PathLike) -> list[Signal]:
    """Signals that an import kept as they were, with what it assumed of each."""
    rows: dict[str, list[tuple[int, float]]] = {}
    try:
        with BagReader(path) as bag:
            if bag.topics.get(SIGNALS_TOPIC) != JOINT_STATE:
                return []
            about = bag.custom_data.get(IMPORT, "{}")
            for message in bag.read([SIGNALS_TOPIC]):
                read: Any = STORE.deserialize_cdr(message.data, JOINT_STATE)
                if len(read.name) == len(read.position) == 1 and read.name[0] in QUANTITIES:
                    rows.setdefault(read.name[0], []).append((header_time(read.header), float(read.position[0])))
    except (BagError, ValueError, KeyError, IndexError):
        if not rows:
            return []
        about = "{}"
    assumed = _assumed(about)
    out = []
    for name, pairs in rows.items():
        time = np.array([time for time, _ in pairs], np.int64)
        value = np.array([value for _, value in pairs], float)
        good = later_only(time) & np.isfinite(value)
        if good.any():
            out.append(Signal(name, time[good], value[good], os.fspath(path), assumed.get(name, [])))
    return out


def _assumed(about: str) -> dict[str, list[str]]:
    """What an import assumed of each signal, by what it kept of itself."""
    try:
        found = json.loads(about)["signals_assumed"]
        return {str(name): [str(line) for line in lines] for name, lines in found.items()}
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return {}


def signals_of_frames(frames: np.recarray, source: str) -> list[Signal]:
    """Every quantity that the tick outputs simulate, and the attitude of the ship and of a towbody that has one."""
    time = np.asarray(frames["time"], np.int64)
    kept = later_only(time)
    values = {}
    for name, one in QUANTITIES.items():
        if one.output:
            value = np.asarray(frames[one.output], float)
            values[name] = one.factor * (value if one.component is None else value[:, one.component])
    values["departure_angle"] = 0.5 * np.pi - np.asarray(frames["departure_angle"], float)
    level = not np.nan_to_num(frames["body_quaternion"])[:, :2].any()  # such a towbody has no roll, pitch and heading
    for prefix, of in (("", "ship"), *([] if level else [("body_", "body")])):
        turns = np.array([angles_of(*row) for row in np.asarray(frames[f"{of}_quaternion"], float)]).reshape(-1, 3)
        for k, name in enumerate(("roll", "pitch", "yaw")):
            values[prefix + name] = np.unwrap(turns[:, k]) if len(turns) else turns[:, k]
    values["speed"] = np.hypot(*np.asarray(frames["ship_velocity"], float)[:, :2].T)
    out = []
    for name, value in values.items():
        good = kept & np.isfinite(value)  # a field that an older recording lacks is NaN
        if good.any():
            out.append(Signal(name, time[good], value[good], source))
    return out


def later_only(time: np.ndarray) -> np.ndarray:
    """Which stamps are later than all before them: what a clock that jumps back repeats is left out."""
    if not len(time):
        return np.zeros(0, bool)
    before = np.concatenate(([np.iinfo(np.int64).min], np.maximum.accumulate(time)[:-1]))
    return time > before


def _of_channels(tow: RecordedTow) -> list[Signal]:
    names = {(one.output, one.component): name for name, one in QUANTITIES.items()}
    recorded = recorded_values(tow, [(CHANNEL_NAMES[topic], output, part) for topic, _, _, output, part in COMPARED])
    out = []
    for (topic, _, _, output, part), had in zip(COMPARED, recorded):
        if had is None:
            continue
        time, value = had
        good = later_only(time) & np.isfinite(value)
        if good.any():
            factor = QUANTITIES[name := names[output, part]].factor
            out.append(Signal(name, time[good], factor * value[good], f"{tow.path}: {topic}"))
    return out


def _of_odometry(tow: RecordedTow) -> list[Signal]:
    time, values = odometry_of(tow)
    if not len(time):
        return []
    kept = later_only(time)
    return [Signal(name, time[kept], values[kept, k], f"{tow.path}: odometry") for k, name in enumerate(ODOMETRY)]
