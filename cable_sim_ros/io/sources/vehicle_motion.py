"""Motion of a vehicle for a run: a CSV table, a bag, a function of time or a simple motion, as messages on the clock of
the ship's motion.

Times of a table, of a function and of a simple motion count from the beginning of the ship's motion; the stamps of a
bag are on its clock.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from math import cos, nan, pi, radians, sin
from pathlib import Path

import numpy as np

from ...physics.ship import Ship
from ...physics.towbody import BodyModel
from ...sim.inputs import MAX_POSITION
from ...sim.scene import Scene
from ...sim.statics.vehicle_shape import pose_of
from ..bags.bag import BagReader
from ..messages.messages import KINDS, VEHICLES, Event, stamp_of
from ..scenes.document import find_bag
from .motion_table import CONSEQUENCE, SECOND, STEP, MotionError, Samples, made, mean_track, odometry_events, read_table
from .recorded_tow import RecordedTow, odometry_of

Pose = Callable[[float], Sequence[float] | np.ndarray]  # s -> x, y, z in odom [m], roll, pitch, yaw [rad]
SIMPLE = {  # axes of the vehicle at the start: x forward, y to port, z up
    "still": (),
    "circle": (0, 1),
    "surge": (0,),
    "sway": (1,),
    "heave": (2,),
}
KNOWN = "'still', 'circle RADIUS PERIOD', 'surge', 'sway' or 'heave AMPLITUDE PERIOD' (m, s), a .csv table or a bag"
DIFFERENCE = 1e-3  # s, for the rates of a function


def with_vehicle(tow: RecordedTow, given: Pose | str | os.PathLike, scene: Scene) -> RecordedTow:
    """The ship's motion with that of the vehicle beside it; what of a vehicle the tow has is left out.

    Raises MotionError, BagError.
    """
    if scene.towbody.model is not BodyModel.VEHICLE:
        raise MotionError(
            f"a motion of the vehicle was given, and {scene.name} has none (towbody.model = "
            f"{scene.towbody.model.value}); {CONSEQUENCE}. Give the scene towbody.model: vehicle, or leave it out"
        )
    offset = tow.events[0].arrival - tow.events[0].time if tow.events else 0
    moved = [event._replace(arrival=event.time + offset) for event in _events(given, scene, tow)]
    kept = [event for event in tow.events if event.kind not in VEHICLES]
    tow.events = sorted([*kept, *moved], key=lambda event: event.arrival)  # stable: the ship's first
    return tow


def at_rest(scene: Scene, duration: float) -> RecordedTow:
    """The mean track of the ship as messages, of a run whose vehicle alone moves; duration: s."""
    t = np.arange(-(-round(duration * SECOND) // STEP) + SECOND // STEP) * (STEP / SECOND)
    tow = made("mean track", *mean_track(t, scene.ship))
    tow.heading = radians(scene.ship.heading_deg)
    return tow


def _events(given: Pose | str | os.PathLike, scene: Scene, tow: RecordedTow) -> list[Event]:
    begin = tow.start
    if callable(given):
        path = given
    elif Path(given).suffix.lower() == ".csv":
        events = _table(given, scene, tow)
        return [event.moved(begin - events[0].time)._replace(kind="vehicle") for event in events]
    else:
        name, *words = os.fspath(given).replace(",", " ").split() or [""]
        if name and name not in SIMPLE:
            return _bag(given)
        path = _simple(name, words, scene, tow)
    seconds = tow.length / SECOND
    t = np.arange(int(seconds / (STEP / SECOND)) + 2) * (STEP / SECOND)
    value, rate = _differentiated(path, t)
    stamps = begin + np.round(t * SECOND).astype(np.int64)
    events = odometry_events(Samples(stamps, value, rate), "motion of the vehicle")
    return [event._replace(kind="vehicle") for event in events]


def _base(scene: Scene, tow: RecordedTow) -> list[float]:
    """Pose of the vehicle at the beginning of the ship's motion, by the scene."""
    time, rows = odometry_of(tow)
    x, y, yaw = rows[0, [0, 1, 5]].tolist() if len(time) else (0.0, 0.0, radians(scene.ship.heading_deg))
    pose = pose_of(scene, yaw if tow.heading is None else tow.heading)
    return [pose[0] + x, pose[1] + y, *pose[2:]]


def _table(path: str | os.PathLike, scene: Scene, tow: RecordedTow) -> list[Event]:
    """A table; columns that are missing stay with the ship's mean track, where the scene has the vehicle."""
    x, y, z, _, _, yaw = _base(scene, tow)
    track = Ship(tow_speed=scene.ship.tow_speed, heading_deg=scene.ship.heading_deg, max_gap=scene.vehicle.max_gap)
    beside = track.model_copy(update={"reference_height": z})
    return read_table(path, beside, at=(x, y, yaw), height=MAX_POSITION).events


def _bag(given: str | os.PathLike) -> list[Event]:
    try:
        path = find_bag(given)
    except Exception as error:
        raise MotionError(f"motion of the vehicle {os.fspath(given)!r} is neither {KNOWN}: {error}") from None
    events = []
    with BagReader(path) as reader:
        ends = {kind: KINDS[kind] for kind in VEHICLES}
        kinds = {
            name: kind
            for name, msgtype in reader.topics.items()
            for kind, (wanted, end) in ends.items()
            if msgtype == wanted and f"/{name}".endswith(f"/{end}")
        }
        if len(kinds) != 1:
            raise MotionError(
                f"bag '{path}' has {len(kinds)} topics of a vehicle ({' or '.join(end for _, end in ends.values())}), "
                f"one is needed; {CONSEQUENCE}. Record its pose on one of them"
            )
        for topic, _, time, data in reader.read(kinds):
            events.append(Event(stamp_of(data), time, kinds[topic], data))
    return events


def _simple(name: str, words: list[str], scene: Scene, tow: RecordedTow) -> Pose:
    axes, text = SIMPLE.get(name), " ".join([name, *words])
    try:
        size, period = map(float, words) if words or axes != () else (0.0, 1.0)
    except ValueError:
        size, period = nan, nan
    if (words and not axes) or not (0.0 <= size <= 1e4 and 1.0 <= period <= 1e5):
        raise MotionError(
            f"motion of the vehicle {text!r} is none of {KNOWN}; {CONSEQUENCE}. Give a size in [0, 1e4] m and a period "
            f"in [1, 1e5] s, for example 'circle 5 60'"
        )
    base, velocity = np.array(_base(scene, tow)), mean_track(np.zeros(1), scene.ship)[1][0, :2]
    yaw, omega = float(base[5]), 2.0 * pi / period

    def pose(t: float) -> np.ndarray:
        moved, out = [0.0, 0.0, 0.0], base.copy()
        for k, axis in enumerate(SIMPLE[name]):
            moved[axis] = size * sin(omega * t) if k == 0 else size * (1.0 - cos(omega * t))
        out[0] += velocity[0] * t + cos(yaw) * moved[0] - sin(yaw) * moved[1]
        out[1] += velocity[1] * t + sin(yaw) * moved[0] + cos(yaw) * moved[1]
        out[2] += moved[2]
        return out

    return pose


def _differentiated(path: Pose, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Poses [n, 6] at times, and their rates by central differences; at the beginning by one to the right."""
    table = []
    for seconds in t.tolist():
        row = []
        for at in (seconds, max(seconds - DIFFERENCE, 0.0), seconds + DIFFERENCE):
            try:
                pose = np.array(path(at), float)
            except Exception as error:
                raise MotionError(
                    f"the pose of the vehicle at {at:g} s: {type(error).__name__}: {error}; {CONSEQUENCE}. Return x, "
                    f"y, z [m, odom], roll, pitch, yaw [rad]"
                ) from error
            if pose.shape != (6,) or not np.isfinite(pose).all() or np.abs(pose).max() > MAX_POSITION:
                raise MotionError(
                    f"the pose of the vehicle at {at:g} s is {pose.tolist()!r:.120}, expected six finite numbers: x, "
                    f"y, z [m, odom], roll, pitch, yaw [rad]; {CONSEQUENCE}"
                )
            row.append(pose)
        table.append((row[0], (row[2] - row[1]) / (seconds + DIFFERENCE - max(seconds - DIFFERENCE, 0.0))))
    return np.array([row[0] for row in table]), np.array([row[1] for row in table])
