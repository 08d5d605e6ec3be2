"""Motion for a node under test, as messages with stamps: of a bag, a CSV table, a sinusoidal heave, or samples."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TowError
from ..io.messages.commands import as_joint_state
from ..io.messages.messages import Event
from ..io.scenes.document import find_bag
from ..io.sources.motion_table import MotionWarning, Samples, odometry_events, read_table, sine_heave
from ..io.sources.recorded_tow import at_speed, read_tow
from ..sim.inputs import ShipMotion
from ..sim.scene import Ship
from .arguments import number, refused

SECOND = 1_000_000_000
INPUTS = ("imu", "odometry", "command", "flaps")  # in this order at one stamp
Source = str | os.PathLike | Sequence[ShipMotion]


def messages(
    source: Source | None,
    ship: Ship,
    *,
    heave: tuple[float, float] | None = None,
    start: float = 0.0,
    duration: float | None = None,
    imu_only: bool = False,
    commands: bool = False,
) -> list[Event]:
    """Messages in order of their stamps. TowError when there are none, or for what cannot be used.

    source: bag (path or name of a shipped one), CSV file, or samples; heave: (m, s) in place of it; ship: of the scene;
    start, duration: part of it, s; commands: those of the bag too.
    """
    if (source is None) == (heave is None):
        raise TowError("give one source of motion: a bag, a CSV file, samples, or heave=(m, s); nothing was sent")
    start = number("start", start, "s", "nothing was sent", "leave it out to begin with the first message", minimum=0.0)
    if duration is not None:
        duration = number("duration", duration, "s", "nothing was sent", "leave it out for all the motion of a source")
    with refused():
        events = _events(source, ship, heave, start, duration, imu_only)
    kept = [as_joint_state(event) for event in events if commands or not event.is_command]
    kept = [event for event in kept if not (imu_only and event.kind == "odometry")]
    kept.sort(key=lambda event: (event.time, INPUTS.index(event.kind)))
    motion = [event.time for event in kept if not event.is_command]
    first = (motion[0] if motion else 0) + round(start * SECOND)
    last = first + round(duration * SECOND) if duration is not None else 2**63 - 1
    found = [event._replace(stamp=event.time) for event in kept if first <= event.time <= last]
    if all(message.is_command for message in found):
        raise TowError(f"no motion in the part asked for (from {start:g} s on): nothing was sent")
    return found


def _events(source: Any, ship: Ship, heave: Any, start: float, duration: float | None, imu_only: bool) -> list[Event]:
    if heave is not None:
        try:
            amplitude, period = (float(part) for part in heave)
        except (TypeError, ValueError):
            raise TowError(
                f"heave = {heave!r} is no pair of numbers: nothing was sent; give heave=(amplitude in m, period in s)"
            ) from None
        if duration is None:
            raise TowError("heave needs duration=... in s: nothing was sent")
        return sine_heave(amplitude, period, start + duration, ship).events
    if isinstance(source, (str, os.PathLike)):
        if Path(source).suffix.lower() == ".csv":
            table = read_table(source, ship)
            for doubt in table.doubts:
                warnings.warn(doubt.text, MotionWarning, stacklevel=4)
            return table.events
        tow = read_tow(find_bag(os.fspath(source)), imu_only=imu_only)
        return at_speed(tow.events, tow.about, ship.tow_speed)
    return _of_samples(source)


def _of_samples(source: Any) -> list[Event]:
    try:
        samples = list(source)
    except TypeError:
        raise TowError(
            f"source = {source!r} is no motion: nothing was sent; give a bag or a CSV file by its path, the name of a "
            f"shipped bag, or a sequence of cable_sim_ros.ShipMotion"
        ) from None
    for k, sample in enumerate(samples):
        if not isinstance(sample, ShipMotion):
            raise TowError(
                f"source[{k}] = {sample!r} is no ShipMotion: nothing was sent; give a sequence of "
                f"cable_sim_ros.ShipMotion, each with its time_ns"
            )
        if k and sample.time_ns <= samples[k - 1].time_ns:
            raise TowError(
                f"source[{k}].time_ns = {sample.time_ns} ns is not behind that of the sample before: nothing was sent; "
                f"give the samples in order of their time_ns, each time once"
            )
    if not samples:
        return []
    rows = np.array([sample.row(1.0) for sample in samples])
    times = np.array([sample.time_ns for sample in samples], np.int64)
    return odometry_events(Samples(times, rows[:, :6], rows[:, 6:12]), "samples of motion")
