"""Ship motion of the AHC benchmark: a recorded ship about its mean track, put on the track of a scene, at its scale."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from math import cos, radians, sin
from pathlib import Path

import numpy as np

from ...io.messages.messages import Event, decode_odometry
from ...io.sources.motion_table import SECOND, Samples, mean_track, odometry_events
from ...io.sources.recorded_tow import RecordedTow, read_tow
from ...io.sources.sea_motion import sea_motion
from ...sim.scene import Scene
from ...sim.tables.attitude import angle_rates, to_world
from .definition import HULL, Motion, Place, bag_of

MORE = 2.0  # s of motion beyond the run


@lru_cache(maxsize=2)
def _odometry(bag: Path) -> list[Event]:
    return [event for event in read_tow(bag).events if event.kind == "odometry"]


def about_track(bag: Path, begin: float, seconds: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [n, s], coordinates [n, 6] and rates [n, 6] of a recorded ship about its mean track: ahead, to port, up,
    roll, pitch, yaw."""
    events = _odometry(bag)
    first = events[0].time + round(begin * SECOND)
    rows = [decode_odometry(event.data) for event in events if 0 <= event.time - first <= round(seconds * SECOND)]
    time = np.array([row.stamp - first for row in rows]) / SECOND
    value = np.array([(*row.position, *row.angles) for row in rows])
    rate = np.array(
        [(*to_world(row.angles, row.velocity), *angle_rates(row.angles[0], row.angles[1], row.rate)) for row in rows]
    )
    value[:, 5] = np.unwrap(value[:, 5])
    heading = float(value[:, 5].mean())
    value[:, 5] -= heading
    since = time - time.mean()
    for k in range(3):
        value[:, k] -= value[:, k].mean()
    for k in range(2):
        slope = (since * value[:, k]).sum() / (since * since).sum()
        value[:, k] -= since * slope
        rate[:, k] -= slope
    for array in (value, rate):
        array[:, :2] = _turned(array[:, :2], -heading)
    return time, value, rate


def _turned(pairs: np.ndarray, angle: float) -> np.ndarray:
    c, s = cos(angle), sin(angle)
    return np.column_stack((c * pairs[:, 0] - s * pairs[:, 1], s * pairs[:, 0] + c * pairs[:, 1]))


def recorded(moved: Motion, at: Place, scene: Scene, seconds: float) -> RecordedTow:
    """A recorded ship on the mean track of a scene; seconds: of the run, in the scene's own time."""
    pace = at.scale**0.5
    time, value, rate = about_track(bag_of(moved), moved.begin, seconds / pace + MORE)
    lengths = np.array([at.scale] * 3 + [1.0] * 3)
    moved_by, going = lengths * value, lengths / pace * rate
    own = pace * time
    where, track = mean_track(own, scene.ship)
    yaw = radians(scene.ship.heading_deg)
    for to, of in ((where, moved_by), (track, going)):
        to[:, :2] += _turned(of[:, :2], yaw)
        to[:, 2:] += of[:, 2:]
    title = f"{moved.name} on the track of {scene.name}"
    stamps = SECOND + np.round(own * SECOND).astype(np.int64)
    tow = RecordedTow(title, odometry_events(Samples(stamps, where, track), title))
    tow.heading = yaw
    return tow


def motion_for(moved: Motion, at: Place, scene: Scene, seconds: float) -> RecordedTow:
    """The motion of a cell without gaps. Raises MotionError, BagError."""
    if moved.bag:
        return recorded(moved, at, scene, seconds)
    hull = ",".join(f"{key}={at.scale * value:g}" for key, value in HULL.items())
    return sea_motion(f"simple:{hull}", scene, seconds)


def with_gaps(tow: RecordedTow, gaps: tuple[tuple[float, float], ...]) -> RecordedTow:
    """The motion without the messages between these seconds since its first."""
    first = tow.events[0].time
    kept = [
        event
        for event in tow.events
        if not any(round(a * SECOND) < event.time - first < round(b * SECOND) for a, b in gaps)
    ]
    return replace(tow, events=kept)
