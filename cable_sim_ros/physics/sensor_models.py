"""Instruments aboard: what a user declares of them, and the records that sensors.py works on.

Defaults are those of an ideal instrument that shows the truth of every tick: each imperfection is chosen.
"""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np

from .parameter import Block, choice, quantity

# devices in the order of the bits of tick output readings_new
MRU, ENCODER, METERING, LOAD_PIN, USBL, DEPTH, FISH, ALTIMETER = range(8)
DEVICES = ("mru", "encoder", "metering_sheave", "load_pin", "usbl", "depth", "fish_attitude", "altimeter")
SIGNALS = (  # one number that a device shows: its device, and what its faults are set under
    ("mru_surge", MRU, ""),
    ("mru_sway", MRU, ""),
    ("mru_heave", MRU, "mru_heave"),
    ("mru_surge_rate", MRU, ""),
    ("mru_sway_rate", MRU, ""),
    ("mru_heave_rate", MRU, "mru_heave"),
    ("mru_roll", MRU, "mru_roll"),
    ("mru_pitch", MRU, "mru_pitch"),
    ("mru_roll_rate", MRU, "mru_roll"),
    ("mru_pitch_rate", MRU, "mru_pitch"),
    ("encoder_payout", ENCODER, "encoder"),
    ("encoder_rate", ENCODER, "encoder"),
    ("metering_payout", METERING, "metering_sheave"),
    ("metering_rate", METERING, "metering_sheave"),
    ("load_pin", LOAD_PIN, "load_pin"),
    ("usbl_x", USBL, "usbl"),
    ("usbl_y", USBL, "usbl"),
    ("usbl_z", USBL, "usbl"),
    ("depth_reading", DEPTH, "depth"),
    ("fish_roll", FISH, "fish_roll"),
    ("fish_pitch", FISH, "fish_pitch"),
    ("fish_heading", FISH, "fish_heading"),
    ("altitude_reading", ALTIMETER, "altimeter"),
)
COUNT = len(SIGNALS)
# rows of SIGNALS
HEAVE, ROLL, ENCODED, METERED, PIN, FIX, DEPTH_SHOWN, FISH_ROLL, ALTITUDE = 2, 6, 10, 12, 14, 15, 18, 19, 22
MAX_LATE = 5.0  # s, of a latency and of a fault that is late
PATHS = ("command", "drive", "flaps")  # of faults that are no instrument's
TARGETS = (*dict.fromkeys(fault for _, _, fault in SIGNALS if fault), *PATHS)


class FaultKind(str, Enum):
    """What is wrong with an instrument, the command path or the drive."""

    NONE = "none"
    FROZEN = "frozen"  # as it was when the fault came
    BIAS = "bias"
    DRIFT = "drift"
    NOISE = "noise"
    LATE = "late"
    LOST = "lost"
    STUCK = "stuck"  # at faults.*.size
    RUNAWAY = "runaway"
    RESET = "reset"  # counts from zero again


KINDS = tuple(FaultKind)
FAULT_NONE, FROZEN, BIAS, DRIFT, NOISE, LATE, LOST, STUCK, RUNAWAY, RESET = range(10)
FAULT = np.dtype([("kind", "i8"), ("amount", "f8"), ("since", "i8"), ("at", "f8")])  # since: ns; at: what it was then

SIGNAL = np.dtype(  # what the scene fixes of one
    [
        ("device", "i8"),
        ("on", "i8"),
        ("rate_of", "i8"),  # 1: the rate of the row that its fault is set for
        ("every", "i8"),  # ticks between readings
        ("latency", "i8"),  # ticks
        ("gain", "f8"),
        ("zero", "f8"),
        ("filter_time", "f8"),  # s
        ("noise", "f8"),  # deviation
        ("range_noise", "f8"),  # share of the slant range
        ("outlier", "f8"),  # probability of a reading, and its size
        ("outlier_size", "f8"),
        ("resolution", "f8"),
        ("maximum", "f8"),  # either way
    ],
    align=True,
)
SENSED = np.dtype(  # what changes of one
    [("filtered", "f8"), ("shown", "f8"), ("fault", FAULT)], align=True
)
SENSOR_RULES = np.dtype(
    [
        ("seed", "i8"),
        ("place", "f8", 3),  # m, base_link, where the MRU really is
        ("declared", "f8", 3),  # and where it is said to be
        ("sheave", "f8", 3),  # m, base_link
        ("period", "f8"),  # s, of the high-pass
        ("damping", "f8"),
        ("alignment", "i8"),  # ticks
        ("leak", "f8"),
        ("settling", "f8"),  # s
        ("slip", "f8"),
        ("wrong_layer", "f8"),  # m, radius that the encoder counts with less that of the layer
        ("metering_least", "f8"),  # N
        ("axis", "f8"),  # rad from the downward vertical, positive aft; nan: of the resultant at the start
        ("newtons", "f8"),  # of the pin per newton of tension; nan: as at the start
        ("seabed", "f8"),  # m below the mean water surface; 0: there is none
        ("transducer", "f8", 3),  # m, base_link, where that of the fix really is
        ("transducer_error", "f8", 3),  # m, that less where it is said to be
        ("transducer_turn", "f8", 6),  # rad, from the fourth: roll, pitch, heading by which it is turned unknown
    ],
    align=True,
)
SENSING = np.dtype(
    [
        ("begun", "i8"),
        ("track", "f8", 3),  # low-passed place of the MRU, and the state of its filter
        ("track_rate", "f8", 3),
        ("behind", "f8", 3),  # m, place less that track, at the last tick
        ("tilt", "f8"),  # rad, of the vertical that the MRU believes in
        ("axis", "f8"),  # rad
        ("newtons", "f8"),
        ("encoded", "f8"),  # m counted since the start, and the counter at the last tick
        ("encoded_at", "f8"),
        ("metered", "f8"),
        ("metered_at", "f8"),
        ("rest", "f8", 3),  # m, sheave at the start, tow frame
        ("arm", "f8", 3),  # m, from the MRU to the sheave at the start
    ],
    align=True,
)


class SensorModel(NamedTuple):
    """Instruments as numbers, read-only; no signals: none is on."""

    signals: np.ndarray  # SIGNAL [0 or COUNT]
    rules: np.ndarray  # SENSOR_RULES [0 or 1]


class Sensors(NamedTuple):
    """What instruments remember."""

    sensed: np.ndarray  # SENSED [0 or COUNT]
    sensing: np.ndarray  # SENSING [0 or 1]
    truth: np.ndarray  # [rows, COUNT] what was to be measured in the last ticks


def make_sensors(ticks: int) -> Sensors:
    """Instruments that remember so many ticks of the truth; 0: none is aboard."""
    return Sensors(
        np.zeros(COUNT if ticks else 0, SENSED).view(np.recarray),
        np.zeros(1 if ticks else 0, SENSING).view(np.recarray),
        np.zeros((ticks, COUNT)),
    )


class Feedback(str, Enum):
    """What set-point laws and a callback controller get."""

    TRUTH = "truth"
    INSTRUMENTS = "instruments"


class Device(Block):
    on: bool = choice(False, "is it aboard")
    rate: float | None = quantity(None, "Hz", 0.01, 1e3, "readings a second; none: every tick")
    latency: float = quantity(0.0, "s", 0.0, MAX_LATE, "between what was so and its reading")


class Mru(Device):
    position: tuple[float, float, float] = quantity((0.0, 0.0, 0.0), "m", -200.0, 200.0, "its place in base_link")
    lever_error: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "m", -50.0, 50.0, "place where it really is less position: what was measured wrong"
    )
    heave_period: float = quantity(
        0.0,
        "s",
        0.0,
        600.0,
        "period of the high-pass of surge, sway and heave, second order; 0: from the start's place",
    )
    heave_damping: float = quantity(0.7, "1", 0.1, 2.0, "damping ratio of that")
    alignment_time: float = quantity(0.0, "s", 0.0, 3600.0, "after the start, in which it gives no reading")
    turn_leak: float = quantity(
        0.0, "1", 0.0, 1.0, "share of the centripetal acceleration of a turn that it takes for gravity"
    )
    turn_settling: float = quantity(30.0, "s", 0.1, 600.0, "time constant with which its vertical follows that")
    heave_noise: float = quantity(0.0, "m", 0.0, 10.0, "deviation of surge, sway and heave, white")
    heave_resolution: float = quantity(0.0, "m", 0.0, 1.0, "step of surge, sway and heave")
    velocity_noise: float = quantity(0.0, "m/s", 0.0, 10.0, "deviation of their rates")
    angle_noise: float = quantity(0.0, "rad", 0.0, 0.1, "deviation of roll and pitch")
    angle_resolution: float = quantity(0.0, "rad", 0.0, 0.1, "step of roll and pitch")
    angle_zero: tuple[float, float] = quantity((0.0, 0.0), "rad", -0.2, 0.2, "reading of roll and pitch at zero")


class Encoder(Device):
    resolution: float = quantity(0.0, "m", 0.0, 10.0, "step of the reading")
    slip: float = quantity(0.0, "1", -0.5, 0.5, "share that it counts too much")
    layer_error: int = quantity(0, "1", -20, 20, "layers of cable that it counts too many under the one that runs off")


class MeteringSheave(Device):
    resolution: float = quantity(0.0, "m", 0.0, 10.0, "step of the reading")
    gain: float = quantity(1.0, "1", 0.5, 2.0, "metres shown per metre: of a groove worn deeper more than 1")
    min_tension: float = quantity(0.0, "N", 0.0, 1e6, "tension below which the cable slides over it uncounted")


class LoadPin(Device):
    axis_deg: float | None = quantity(
        None,
        "deg",
        -180.0,
        180.0,
        "direction in which it measures, from the downward vertical of the ship, positive aft; none: that of the "
        "resultant at the static start",
    )
    calibration: float | None = quantity(
        None, "1", 0.05, 2.0, "newtons on the pin per newton of tension; none: as at the static start"
    )
    zero: float = quantity(0.0, "N", -1e6, 1e6, "reading without load")
    gain: float = quantity(1.0, "1", 0.1, 10.0, "newtons shown per newton")
    filter_time: float = quantity(0.0, "s", 0.0, 60.0, "time constant of its filter, first order")
    noise: float = quantity(0.0, "N", 0.0, 1e6, "deviation, white")
    resolution: float = quantity(0.0, "N", 0.0, 1e5, "step of the reading")
    capacity: float | None = quantity(None, "N", 1.0, 1e8, "largest reading either way; none: no end")


class Usbl(Device):
    rate: float | None = quantity(1.0, "Hz", 0.01, 1e3, "fixes a second; none: every tick")
    range_noise: float = quantity(0.0, "1", 0.0, 0.5, "deviation of each coordinate over the slant range")
    noise: float = quantity(0.0, "m", 0.0, 100.0, "deviation of each coordinate beside that")
    outliers: float = quantity(0.0, "1", 0.0, 0.5, "share of fixes that are wrong")
    outlier_size: float = quantity(50.0, "m", 0.0, 1e4, "deviation of each coordinate of these")
    position: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0),
        "m",
        -200.0,
        200.0,
        "place of the ship's transducer in base_link; the slant range is from there",
    )
    lever_error: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "m", -50.0, 50.0, "place where it really is less position: what was measured wrong"
    )
    angle_error: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0),
        "rad",
        -0.2,
        0.2,
        "roll, pitch and heading by which it, or the attitude that its fix is reckoned with, is wrong; 0.01 is 1 % of "
        "the slant range",
    )


class DepthSensor(Device):
    zero: float = quantity(0.0, "m", -100.0, 100.0, "reading at the mean water surface")
    gain: float = quantity(1.0, "1", 0.5, 2.0, "metres shown per metre")
    noise: float = quantity(0.0, "m", 0.0, 100.0, "deviation, white")
    resolution: float = quantity(0.0, "m", 0.0, 10.0, "step of the reading")


class FishAttitude(Device):
    zero: tuple[float, float, float] = quantity(
        (0.0, 0.0, 0.0), "rad", -0.5, 0.5, "reading of roll, pitch and heading at zero: its mounting, and its compass"
    )
    noise: float = quantity(0.0, "rad", 0.0, 0.5, "deviation of each, white")
    resolution: float = quantity(0.0, "rad", 0.0, 0.1, "step of each")


class Altimeter(Device):
    noise: float = quantity(0.0, "m", 0.0, 10.0, "deviation, white")
    resolution: float = quantity(0.0, "m", 0.0, 10.0, "step of the reading")
    max_range: float | None = quantity(None, "m", 0.1, 1e4, "largest reading; none: no end")


class Instruments(Block):
    feed: Feedback = choice(Feedback.TRUTH, "what set-point laws and a callback controller get: truth, or instruments")
    seed: int = quantity(1, "1", 0, 2**31 - 1, "of all noise: the same seed, the same noise")
    mru: Mru = choice(Mru(), "motion reference unit")
    encoder: Encoder = choice(Encoder(), "encoder on the drum")
    metering_sheave: MeteringSheave = choice(MeteringSheave(), "metering sheave")
    load_pin: LoadPin = choice(LoadPin(), "load pin of the sheave")
    usbl: Usbl = choice(Usbl(), "acoustic fix of the towbody")
    depth: DepthSensor = choice(DepthSensor(), "pressure sensor of the towbody")
    fish_attitude: FishAttitude = choice(FishAttitude(), "roll, pitch and heading of the towbody")
    altimeter: Altimeter = choice(Altimeter(), "altimeter of the towbody")


class Fault(Block):
    kind: FaultKind = choice(FaultKind.NONE, "what is wrong; the words stand in docs/instruments.md", configure=False)
    size: float = quantity(
        0.0,
        "1",
        -1e7,
        1e7,
        "how much: of bias, noise and stuck in the unit of the reading, of drift and runaway that a second, of late s",
        configure=False,
    )


class Faults(Block):
    mru_heave: Fault = choice(Fault(), "heave of the MRU and its rate")
    mru_roll: Fault = choice(Fault(), "roll of the MRU and its rate")
    mru_pitch: Fault = choice(Fault(), "pitch of the MRU and its rate")
    encoder: Fault = choice(Fault(), "encoder")
    metering_sheave: Fault = choice(Fault(), "metering sheave")
    load_pin: Fault = choice(Fault(), "load pin")
    usbl: Fault = choice(Fault(), "acoustic fix")
    depth: Fault = choice(Fault(), "pressure sensor")
    fish_roll: Fault = choice(Fault(), "roll of the towbody")
    fish_pitch: Fault = choice(Fault(), "pitch of the towbody")
    fish_heading: Fault = choice(Fault(), "heading of the towbody")
    altimeter: Fault = choice(Fault(), "altimeter of the towbody")
    command: Fault = choice(Fault(), "way of a command to the winch: rates in m/s, lengths in m")
    drive: Fault = choice(Fault(), "set-point of the drive as it comes to it: lengths in m")
    flaps: Fault = choice(Fault(), "flaps of rigid bodies: angles in rad")
