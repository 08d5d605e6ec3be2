"""Values that a device sends where it has none: an attitude of identity, zeros, 9.999.

Such a value is legal by itself. It stands still to the bit while signals move that it must follow: a ship that rolls
also pitches and heaves, a gyro that turns has an attitude that turns. Where it does so for the whole log, or for a
stretch that its own movement elsewhere rules out, it is no measurement.
"""

from __future__ import annotations

import numpy as np

from ..log import SECOND
from ..signals import Signal
from .mapping_file import Entry

FEWEST, SHORTEST = 30, 5.0  # records and s that stand still
AS_USUAL = 0.3  # of its deviation in the whole log: a signal that keeps to less is at rest itself
FINE = 0.1  # of its own deviation: a coarser resolution may stand still in a seaway
STEPS = 8  # values that a signal takes, at least, where it moves
_WAVES, _RATES = ("roll", "pitch", "heave"), ("roll_rate", "pitch_rate", "yaw_rate")
_FORCES = ("acceleration_x", "acceleration_y", "acceleration_z")
FOLLOWS: dict[str, tuple[str, ...]] = {  # signal -> signals that do not move without it
    "roll": ("pitch", "heave", "roll_rate"),
    "pitch": ("roll", "heave", "pitch_rate"),
    "heave": ("roll", "pitch", "heave_rate"),
    "surge": _WAVES,
    "sway": _WAVES,
    "heave_rate": _WAVES,
    **dict.fromkeys(_RATES, ("roll", "pitch")),
    **dict.fromkeys(_FORCES, (*_WAVES, *_RATES)),
    "latitude": ("speed",), "longitude": ("speed",), "x": ("speed",), "y": ("speed",),
}  # fmt: skip
PLACES = {"latitude": "longitude", "longitude": "latitude", "x": "y", "y": "x"}  # one alone may stand: due east
UNDER_WAY = 0.5  # m/s, that a place cannot stand still


def without_placeholders(signals: dict[str, tuple[Signal, Entry]], missing: list[str]) -> None:
    """Take them out of the signals in place, each named in `missing` with its count; whole signals go."""
    still = {name: _still(signal, name in PLACES) for name, (signal, _) in signals.items() if name in FOLLOWS}
    found: dict[str, np.ndarray] = {}
    for name, stretches in still.items():
        signal = signals[name][0]
        bad = np.zeros(len(signal.time), bool)
        moving: list[str] = []
        for a, b in stretches:
            others = [one for one in FOLLOWS[name] if one in signals and _moves(signals[one][0], signal, a, b)]
            twin = PLACES.get(name)
            if twin and not (twin in still and any(_overlap(signal, a, b, signals[twin][0], *s) for s in still[twin])):
                others = []
            if others:
                bad[a:b] = True
                moving += others
        if bad.any():
            found[name] = bad
            values = ", ".join(f"{value:.6g}" for value in np.unique(signal.value[bad])[:3])
            missing.append(
                f"{name}: {values} {signal.unit} to the bit in {int(bad.sum())} of {len(bad)} records while "
                f"{' and '.join(dict.fromkeys(moving))} moves: no measurement, left out"
            )
    yaw = signals.get("yaw")
    if yaw and all(name in found and found[name].all() and signals[name][1] is yaw[1] for name in ("roll", "pitch")):
        if not np.ptp(yaw[0].value):
            found["yaw"] = np.ones(len(yaw[0].time), bool)  # of the same attitude
            missing.append("yaw: of the same attitude, left out")
    for name, bad in found.items():
        signal = signals[name][0]
        if bad.all():
            del signals[name]
        else:
            signal.time, signal.value = signal.time[~bad], signal.value[~bad]


def _still(signal: Signal, coarse: bool) -> list[tuple[int, int]]:
    """Stretches [a, b) in which a signal stands still to the bit longer than its movement elsewhere allows."""
    value, n = signal.value, len(signal.value)
    steps = np.diff(value)
    if n < FEWEST:
        return []
    if not steps.any():
        return [(0, n)]
    ends = np.concatenate(([0], np.flatnonzero(steps) + 1, [n]))
    runs = [
        (a, b)
        for a, b in zip(ends[:-1].tolist(), ends[1:].tolist())
        if b - a >= FEWEST and (signal.time[b - 1] - signal.time[a]) / SECOND >= SHORTEST
    ]
    if not runs or coarse:
        return runs
    rest = np.ones(n, bool)
    for a, b in runs:
        rest[a:b] = False
    if rest.sum() < FEWEST or float(np.abs(steps[steps != 0.0]).min()) > FINE * float(value[rest].std()):
        return []
    return runs


def _moves(other: Signal, signal: Signal, a: int, b: int) -> bool:
    """Does another signal move as usual while this one stands?"""
    inside = (other.time >= signal.time[a]) & (other.time <= signal.time[b - 1])
    part = other.value[inside]
    if other.quantity == "speed":
        return len(part) > 0 and float(np.median(part)) > UNDER_WAY
    if len(part) < FEWEST or len(np.unique(part)) < STEPS:
        return False
    return float(part.std()) >= AS_USUAL * float(other.value.std())


def _overlap(one: Signal, a: int, b: int, other: Signal, c: int, d: int) -> bool:
    return bool(one.time[a] < other.time[d - 1] and other.time[c] < one.time[b - 1])
