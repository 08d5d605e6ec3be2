"""Signals of a ship to its motion: six coordinates through the curves of motion tables, at 50 Hz or more.

What a log does not tell is put in and said: a height without attitude has a level ship, motion without position a mean
track.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.signal import butter, sosfiltfilt

from ....io.sources.motion_curves import Curve, Given, Rounding, through
from ....io.sources.motion_table import STEP, Samples
from ....runs.make_bags import CUTOFF
from ....sim.inputs import MAX_POSITION
from ..log import SECOND, LogError
from ..mapping.mapping_file import ANGLES
from ..own_signals import Signal
from .regular import Regular, regular
from .track import EDGE, Choice, Track, around_mean, measured

DEGREE = np.pi / 180.0
USED = ("x", "y", "z", "heave", "roll", "pitch", "yaw", "latitude", "longitude", "speed", "course", "surge", "sway")
PLACES = ("x", "y", "latitude", "longitude", "surge", "sway")
LEAST = 2.0  # s of common time
MAX_SAMPLES = 10_000_000  # of a bag: 55 hours at 50 Hz


@dataclass
class ShipMotion:
    """Samples of the motion; assumed and said: a line each; rounded: what was smoothed, by coordinate."""

    samples: Samples
    assumed: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    rounded: dict[int, Rounding] = field(default_factory=dict)
    given: list[str] = field(default_factory=list)
    along: dict[str, float | None] | None = None  # as of `track.Found`


def motion_of_signals(signals: Mapping[str, Signal], choice: Choice) -> ShipMotion | None:
    """Motion of a ship; None where no signal tells of it. LogError where they have no time in common."""
    made = {}
    if "heave_rate" in signals and not {"heave", "z"} & signals.keys() and len(signals["heave_rate"].time):
        made["heave"] = _heave_of_rate(signals["heave_rate"])
    signals = {**signals, **made}
    used = {name: signals[name] for name in USED if name in signals and len(signals[name].time)}
    height = "heave" if "heave" in used else "z" if "z" in used else ""
    if not height and not any(name in used for name in ("roll", "pitch", "x", "latitude", "surge")):
        return None
    origin = min(int(one.time[0]) for one in used.values())
    out = ShipMotion(Samples(np.zeros(0, np.int64), np.zeros((0, 6)), np.zeros((0, 6))))
    lines: dict[str, Regular] = {name: regular(one, origin) for name, one in used.items()}
    begin, end = _common(used, lines, height)
    for one in lines.values():
        out.said += one.said
    curves: dict[int, tuple[list[Curve], Regular]] = {}
    for k, name in ((2, height), (3, "roll"), (4, "pitch"), (5, "yaw")):
        if name in lines:
            curves[k] = _curves(out, k, name, lines[name])
            out.given.append(name)
    within = [line for _, line in curves.values()] or [lines[name] for name in PLACES if name in lines]
    stamps = _stamps(origin, begin, end, lines, within)
    if not len(stamps):
        raise LogError("height and attitude have no time in common: nothing was imported. Align their clocks")
    at = (stamps - origin) / SECOND
    value, rate = np.zeros((len(at), 6)), np.zeros((len(at), 6))
    for k, (parts, line) in curves.items():
        value[:, k], rate[:, k] = _evaluate(at, parts, line)
    out.assumed += made["heave"].assumed if made else []
    _height(out, height, value, choice)
    for k, name in enumerate(ANGLES, 3):
        if k not in curves and name != "yaw":
            out.assumed.append(
                f"{name}: not in the log, the ship is level; a degree of it moves a point 50 m off by 0.9 m"
            )
    track = Track(lines, at, value, rate, 5 in curves)
    find = around_mean if choice.track == "mean" else measured
    found = find(track, choice)
    out.assumed += found.assumed
    out.given += found.given
    out.along = found.along
    out.rounded |= found.rounded
    value[:, :2], rate[:, :2] = found.place, found.velocity
    value[:, 5], rate[:, 5] = found.yaw, found.yaw_rate
    keep = np.ones(len(at), bool) if found.inside is None else found.inside
    if not keep.any():
        mean = choice.track == "mean"
        names = [*found.given, *(["yaw"] if mean and "yaw" in used else [])]
        less = f" less {EDGE:g} s at each end" if mean else ""
        raise LogError(
            f"{used[names[0]].source}: {' and '.join(names)}{less}, and height and attitude have no time "
            f"in common: nothing was imported. Give a longer log, or align their clocks"
        )
    if choice.track == "mean" and found.inside is not None:
        value[:, :2] -= value[np.argmax(keep), :2]
    _check_place(used, at[keep], value[keep, :2])
    out.samples = Samples(stamps[keep], value[keep], rate[keep])
    return out


def _heave_of_rate(rate: Signal) -> Signal:
    """Heave [m] from a measured vertical speed: its integral above 1/30 Hz, as that has no datum and drifts."""
    line = regular(rate, int(rate.time[0]))
    times, values = [], []
    for part in line.parts:
        t = np.arange(line.t[part.start], line.t[part.stop - 1] + 1e-9, line.period)
        speed = np.interp(t, line.t[part], line.value[part])
        speed -= speed.mean()
        height = np.concatenate([[0.0], np.cumsum(0.5 * line.period * (speed[1:] + speed[:-1]))])
        sos = butter(4, min(CUTOFF * line.period * 2.0, 0.99), "highpass", output="sos")
        times.append(t)
        values.append(sosfiltfilt(sos, height, padlen=min(27, len(height) - 1)))
    text = (
        f"heave: not in the log, made of its measured vertical speed: the integral above 1/30 Hz; {EDGE:g} s at each "
        "end and beside gaps are less exact"
    )
    time = rate.time[0] + np.round(np.concatenate(times) * SECOND).astype(np.int64)
    return Signal("heave", time, np.concatenate(values), rate.source, [*rate.assumed, text])


def _check_place(used: Mapping[str, Signal], at: np.ndarray, place: np.ndarray) -> None:
    """LogError where the ship goes further than any message may say."""
    far = float(np.abs(place).max())
    if far > MAX_POSITION:
        gap = float(np.diff(at).max()) if len(at) > 1 else 0.0
        raise LogError(
            f"{next(iter(used.values())).source}: the ship goes {far:.3g} m far, above {MAX_POSITION:g} m, and the log "
            f"has a gap of {gap:.4g} s: nothing was imported. Was its clock set? Give `after` or `until` in the mapping"
        )


def _common(used: Mapping[str, Signal], lines: Mapping[str, Regular], height: str) -> tuple[float, float]:
    """Interval [s] in which height and attitude are all there."""
    names = [name for name in (height, *ANGLES) if name in lines] or list(lines)
    begin, end = max(lines[n].t[0] for n in names), min(lines[n].t[-1] for n in names)
    if end - begin < LEAST:
        spans = ", ".join(f"{n} {lines[n].t[0]:.6g} to {lines[n].t[-1]:.6g} s" for n in names)
        raise LogError(
            f"{used[names[0]].source}: the clocks cannot be aligned, {' and '.join(names)} have less than {LEAST:g} s "
            f"in common ({spans}): nothing was imported. Give time or clock_offset in the mapping"
        )
    return begin, end


def _stamps(origin: int, begin: float, end: float, lines: Mapping[str, Regular], within: list[Regular]) -> np.ndarray:
    """Even stamps [ns] where none of the lines `within` has a gap: those in gaps are never made."""
    period = min(STEP, max(1, round(min(one.period for one in lines.values()) * SECOND)))
    first, last = origin + round(begin * SECOND), origin + round(end * SECOND)
    stretches = [(begin, end)]
    for line in within:
        parts = [(line.t[part.start], line.t[part.stop - 1]) for part in line.parts]
        stretches = _both(stretches, parts)
    counts = [
        (
            max(0, (origin + round(a * SECOND) - first) // period - 1),
            (min(last, origin + round(b * SECOND)) - first) // period + 2,
        )
        for a, b in stretches
    ]
    many = sum(b - a for a, b in counts)
    if many > MAX_SAMPLES:
        raise LogError(
            f"the motion would be {many} samples, {period / SECOND:.3g} s apart, above {MAX_SAMPLES}: nothing was "
            f"imported. Give a part of the log, or `after` and `until` in the mapping"
        )
    stamps = [first + period * np.arange(a, b) for a, b in counts]
    made = np.unique(np.concatenate(stamps)) if stamps else np.zeros(0, np.int64)
    made = made[made <= last]
    at, inside = (made - origin) / SECOND, np.ones(len(made), bool)
    for line in within:
        inside &= _inside(at, line)
    return made[inside]


def _both(some: list[tuple[float, float]], others: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Intervals that are in one of each list; both ascend."""
    out, j = [], 0
    for a, b in some:
        while j and others[j - 1][1] >= a:
            j -= 1
        while j < len(others) and others[j][0] <= b:
            low, high = max(a, others[j][0]), min(b, others[j][1])
            if low <= high:
                out.append((low, high))
            j += 1
    return out


def _curves(out: ShipMotion, k: int, name: str, line: Regular) -> tuple[list[Curve], Regular]:
    unit, scale = ("m", 1.0) if k < 3 else ("deg", DEGREE)
    found, report = through(
        Given(name, unit, scale, k > 2), [(line.t[part], line.value[part], None) for part in line.parts]
    )
    if report is not None:
        out.rounded[k] = report
    return found, line


def _inside(at: np.ndarray, line: Regular) -> np.ndarray:
    inside = np.zeros(len(at), bool)
    for part in line.parts:
        inside |= (at >= line.t[part.start] - 1e-9) & (at <= line.t[part.stop - 1] + 1e-9)
    return inside


def _evaluate(at: np.ndarray, curves: list[Curve], line: Regular) -> tuple[np.ndarray, np.ndarray]:
    value, rate = np.zeros(len(at)), np.zeros(len(at))
    for part, curve in zip(line.parts, curves):
        here = (at >= line.t[part.start] - 1e-9) & (at <= line.t[part.stop - 1] + 1e-9)
        when = np.clip(at[here], line.t[part.start], line.t[part.stop - 1])
        value[here], rate[here] = curve(when), curve(when, 1)
    return value, rate


def _height(out: ShipMotion, name: str, value: np.ndarray, choice: Choice) -> None:
    if not name:
        out.assumed.append("heave: not in the log, base_link keeps its height")
        value[:, 2] = choice.height
        return
    mean = float(value[:, 2].mean())
    value[:, 2] += choice.height - mean
    out.assumed.append(
        f"height of base_link: mean put at {choice.height:g} m above the water, that of {name} was {mean:.3g} m"
    )
