"""From a tick output to the values of a telegram: the one table of which field each value comes from.

A value comes from the first instrument of its row that the scene has and has on, else from the truth; either is said.
Readings have the signs of the truth: pay-out positive out, axes of REP 103, heave positive up. Instruments give no
heading and no accelerations: these are always the truth.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot, lcm, nan
from typing import Any, NamedTuple

from ...physics.sensor_models import DEVICES
from ...sim.scene import Scene
from ...sim.tables.attitude import angles_of
from . import lci90i, pashr, psxn, tss1
from .fields import Motion, Withheld
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
    "tss1": Format(MOTION, 10.0, True, tss1.encode),
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
