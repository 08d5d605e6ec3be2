"""From a tick output to the values of a telegram: the one table of which field each value comes from.

A value comes from the first instrument of its row that the scene has and has on, else from the truth; either is said.
Readings have the signs of the truth: pay-out positive out, axes of REP 103, heave positive up. Instruments give no
heading and no accelerations: these are always the truth.

The telegrams of a recorded run as a log: each line the logger's stamp, a blank, and the telegram.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from math import hypot, lcm, nan
from typing import Any, NamedTuple

import numpy as np

from ...errors import told_as
from ...files import write_bytes
from ...io.recordings.recorded_run import load_run, scene_of_recording
from ...io.scenes.document import find_bag
from ...physics.sensor_models import DEVICES
from ...sim.scene import Scene
from ...sim.tables.attitude import angles_of
from . import lci90i, pashr, psxn, tss1
from .fields import SECOND, Motion, TelegramError, Withheld, moment
from .lci90i import Winch

TRUTH = "truth"
SILENT = 1.5  # intervals of readings without one, after which an instrument is silent
LONGEST = 1_000_000_000  # ns between two rows whose velocities make an acceleration
INSTRUMENTS: dict[str, tuple[tuple[str, str], ...]] = {  # value -> (block of `instruments`, field of its reading)
    "pay-out": (("metering_sheave", "metering_payout"), ("encoder", "encoder_payout")),
    "speed": (("metering_sheave", "metering_rate"), ("encoder", "encoder_rate")),
    "tension": (("load_pin", "load_pin_tension"),),
    "roll": (("mru", "mru_roll"),),
    "pitch": (("mru", "mru_pitch"),),
    "heave": (("mru", "mru_heave"),),
}
OF_TRUTH: dict[str, Callable[[Any, Scene], float]] = {
    "pay-out": lambda row, scene: row["payout"],
    "speed": lambda row, scene: row["payout_rate"],
    "tension": lambda row, scene: row["tension"],
    "roll": lambda row, scene: angles_of(*row["ship_quaternion"])[0],
    "pitch": lambda row, scene: angles_of(*row["ship_quaternion"])[1],
    "heave": lambda row, scene: row["ship_position"][2] - scene.ship.reference_height,
    "heading": lambda row, scene: angles_of(*row["ship_quaternion"])[2],
}
WINCH, MOTION = ("tension", "speed", "pay-out"), ("roll", "pitch", "heave")


class Format(NamedTuple):
    """A kind of telegram: values of INSTRUMENTS in it, a usual rate [Hz], does it tell accelerations?, its bytes."""

    values: tuple[str, ...]
    rate: float
    accelerations: bool
    encode: Callable[..., bytes]


FORMATS = {
    "lci90i": Format(WINCH, 20.0, False, lci90i.encode),  # rate of the logs of NBP1406
    "psxn": Format(MOTION, 10.0, False, lambda values, form: psxn.encode(values)),
    "pashr": Format(MOTION, 10.0, False, pashr.encode),
    "tss1": Format(MOTION, 10.0, True, lambda values, form: tss1.encode(values)),
}


class Reader:
    """Values of one kind of telegram out of the tick outputs of a scene."""

    def __init__(self, name: str, scene: Scene, rows: int = 1) -> None:
        """rows: ticks from one tick output to the next."""
        self.scene, self.format = scene, FORMATS[name]
        self.source = {value: self._find(value) for value in self.format.values}  # (instrument or TRUTH, field)
        tick = scene.solver.tick
        self._silence: dict[str, float] = {}  # ns without a reading, after which there is none
        self._read: dict[str, int] = {}  # ns, when the newest came
        for instrument in {name for name, _ in self.source.values()} - {TRUTH}:
            rate = getattr(scene.instruments, instrument).rate
            ticks = 1 if rate is None else max(round(1.0 / (rate * tick)), 1)
            self._silence[instrument] = SILENT * lcm(ticks, rows) * tick * 1e9

    def _find(self, value: str) -> tuple[str, str]:
        for instrument, field in INSTRUMENTS[value]:
            if getattr(self.scene.instruments, instrument).on:
                return instrument, field
        return TRUTH, ""

    @property
    def said(self) -> str:
        """Where the values come from, in words."""
        groups: dict[str, list[str]] = {}
        for value, (instrument, _) in self.source.items():
            groups.setdefault(instrument, []).append(value)
        return "; ".join(f"{', '.join(values)} of {instrument}" for instrument, values in groups.items())

    def notice(self, row) -> None:
        """Look at every tick output, whether a telegram is due or not: which instrument has a reading of it?"""
        for instrument in self._silence:
            if int(row["readings_new"]) >> DEVICES.index(instrument) & 1 or instrument not in self._read:
                self._read[instrument] = int(row["time"])

    def _refuse_silent(self, time: int) -> None:
        for instrument, longest in self._silence.items():
            silent = time - self._read.get(instrument, time)
            if silent > longest:
                raise Withheld(f"no reading of {instrument} for {silent * 1e-9:.2f} s")

    def value(self, value: str, row) -> float:
        """One value of a tick output."""
        field = self.source[value][1]
        return float(row[field] if field else OF_TRUTH[value](row, self.scene))

    def read(self, row, before=None) -> Winch | Motion:
        """Values of a tick output; before: the one before it, for accelerations. Raises Withheld for an instrument that
        gives no reading."""
        time = int(row["time"])
        self._refuse_silent(time)
        if self.format.values is WINCH:
            return Winch(time, *(self.value(value, row) for value in WINCH))
        roll, pitch, heave = (self.value(value, row) for value in MOTION)
        yaw = float(OF_TRUTH["heading"](row, self.scene))
        across, along = accelerations(row, before) if self.format.accelerations else (nan, nan)
        return Motion(time, roll, pitch, yaw, heave, across, along)


def accelerations(row, before) -> tuple[float, float]:
    """Acceleration of `base_link` [m/s^2] across the vertical and along it, up, mean since the row before; or nan."""
    step = 0 if before is None else int(row["time"]) - int(before["time"])
    if not 0 < step <= LONGEST:
        return nan, nan
    x, y, z = (1e9 / step * (a - b) for a, b in zip(row["ship_velocity"].tolist(), before["ship_velocity"].tolist()))
    return hypot(x, y), z


def due(time: int, since: int, period: int) -> int:
    """How many times k * period [ns] lie in (since, time]: telegrams go out on a grid of simulation time."""
    return time // period - since // period


class Log(NamedTuple):
    """A log: how many lines at what rate [Hz], how many were withheld and why the last one, where values come from."""

    lines: int
    rate: float
    withheld: int
    why: str
    said: str


def write_log(
    bag: str | os.PathLike,
    name: str,
    out: str | os.PathLike,
    form: Any = None,
    rate: float | None = None,
    scene: str | os.PathLike | None = None,
) -> Log:
    """Write the telegrams `name` of a run to a file; rate: none: the usual one, or that of the tick outputs.

    BagError for a bag without a run or a scene, TelegramError for a rate that the tick outputs do not give.
    """
    path = find_bag(bag)
    run = load_run(path)
    unknown = "it is not known which instruments it has: nothing was written"
    had = scene_of_recording(run.custom_data, path, scene, unknown)
    times = run.frames["time"].astype(np.int64)
    steps = np.diff(times)
    step = int(np.median(steps)) if len(steps) else SECOND
    rows = SECOND / step
    reader = Reader(name, had, max(round(1e-9 * step / had.solver.tick), 1))
    if rate is not None and rate > rows * (1.0 + 1e-9):
        raise TelegramError(
            f"--rate {rate:g} Hz is more than the {rows:g} tick outputs a second of '{path}'; nothing was written. "
            f"Give at most {rows:g}, or record more of them, as by cable-sim run --every {1.0 / rate:g}"
        )
    hertz = min(FORMATS[name].rate, rows) if rate is None else rate
    period = round(SECOND / hertz)
    lines: list[bytes] = []
    withheld, why = 0, ""
    for k, row in enumerate(run.frames):
        before = run.frames[k - 1] if k else None
        reader.notice(row)
        if not due(int(times[k]), int(times[k]) - step, period):
            continue
        try:
            telegram = reader.format.encode(reader.read(row, before), form)
        except Withheld as error:
            withheld, why = withheld + 1, str(error)
            continue
        lines.append(b"%s %s\n" % (stamp(int(times[k])), telegram.rstrip(b"\r\n")))
    after = "; nothing was written. Give a file in a folder that is there"
    with told_as(TelegramError, f"{os.fspath(out)}: cannot be written", after):
        write_bytes(out, b"".join(lines))
    return Log(len(lines), hertz, withheld, why, reader.said)


def stamp(time: int) -> bytes:
    """A logger's stamp of a time [ns since 1970], as in the logs of OpenRVDAS."""
    at = moment(time)
    return f"{at.year:04d}-{at:%m-%dT%H:%M:%S}.{time // 1000 % 1_000_000:06d}Z".encode()
