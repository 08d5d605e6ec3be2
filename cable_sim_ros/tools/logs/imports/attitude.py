"""Attitude of an IMU that tells none: from its rates and accelerations by VQF (Laidig and Seel 2023).

Its heading is relative: it starts anywhere and drifts. Roll and pitch are those of the filter with its own defaults.
"""

from __future__ import annotations

from importlib import import_module

import numpy as np
from scipy.interpolate import CubicSpline

from ....sim.tables.attitude import angles_of, body_rates
from ..log import SECOND, LogError
from ..mapping.mapping_file import ANGLES
from ..own_signals import Signal
from .regular import BRIDGED, PERIODS

RATES = ("roll_rate", "pitch_rate", "yaw_rate")
FILTER = ": VQF"  # behind the source of what it made
FORCES = ("acceleration_x", "acceleration_y", "acceleration_z")
SLOWEST = 5.0  # Hz, below it rates do not tell of the angles between them
SPARSE = 4.0  # steps between records in the mean: beyond it they are bursts, not a rate
FEWEST_ANGLES = 30  # of which rates are made
SHORTEST = 5.0  # s without a gap, for the filter


def can(signals: dict[str, Signal]) -> bool:
    """Are there rates and accelerations?"""
    return all(name in signals for name in (*RATES, *FORCES))


def upright(signals: dict[str, Signal], ready: bool) -> list[str]:
    """LogError where the accelerations say that z points down and the motion is made of them, or of a source whose axes
    a ready mapping takes for known; else what is said of it."""
    if FORCES[2] not in signals:
        return []
    one = signals[FORCES[2]]
    up = float(one.value.mean())
    if up >= 0.0:
        return []
    text = (
        f"{one.source}: the specific force along z of base_link is {up:.3g} m/s^2 in the mean, it is +9.8 in a ship at "
        "rest: the axes are turned (NED), or it is gravity, with the other sign"
    )
    if ready or can(signals):
        raise LogError(
            f"{text}; nothing was imported. Give a mapping (cable-sim inspect --mapping-out FILE) with `frame: frd` "
            "and, for an attitude to NED, `frame: ned`, or `sign: -1` of the acceleration"
        )
    return [f"{one.quantity}: {text}; it is not used"]


def attitude(signals: dict[str, Signal]) -> tuple[dict[str, Signal], list[str]]:
    """roll, pitch and a relative yaw, and what is assumed of them. LogError where it cannot be."""
    try:
        filtered = import_module("vqf").offlineVQF
    except ImportError:
        raise LogError(
            "the log has rates and accelerations without an orientation, and attitude is made of them with "
            "vqf, which is not installed; nothing was imported. pip install 'cable_sim_ros[import]', or map a second "
            "source"
        ) from None
    time = signals[RATES[0]].time
    origin = int(time[0])
    t = (time - origin) / SECOND
    steps = np.diff(t)
    step = float(np.median(steps)) if len(t) > 1 else np.inf
    if 1.0 / step < SLOWEST:
        raise LogError(
            f"{signals[RATES[0]].source}: rates come at {1.0 / step:.3g} Hz, below {SLOWEST:g} Hz no "
            f"attitude is made of them; nothing was imported. Map a source of roll and pitch"
        )
    cuts = [0, *(np.flatnonzero(steps > max(BRIDGED, PERIODS * step)) + 1).tolist(), len(t)]
    dense = [(i, j) for i, j in zip(cuts, cuts[1:]) if t[j - 1] - t[i] <= SPARSE * step * (j - i)]
    spans = [(float(t[i]), float(t[j - 1])) for i, j in dense if j - i >= SHORTEST / step]
    if not spans:
        raise LogError(
            f"{signals[RATES[0]].source}: rates have no {SHORTEST:g} s without a gap, no attitude is made of them; "
            f"nothing was imported. Map a source of roll and pitch"
        )

    def table(names: tuple[str, ...], at: np.ndarray) -> np.ndarray:
        columns = [np.interp(at, (signals[n].time - origin) / SECOND, signals[n].value) for n in names]
        return np.ascontiguousarray(np.stack(columns, axis=1))

    stamps, angles = [], []
    for begin, end in spans:  # of each a filter of its own: over a gap nothing is known
        at = begin + np.arange(0.0, end - begin + 1e-9, step)
        rotors = filtered(table(RATES, at), table(FORCES, at), None, step)["quat6D"]  # w x y z
        angles.append(np.unwrap(np.array([angles_of(*row) for row in rotors[:, [1, 2, 3, 0]]]), axis=0))
        stamps.append(origin + np.round(at * SECOND).astype(np.int64))
    time, turned = np.concatenate(stamps), np.concatenate(angles)
    found = {
        name: Signal(name, time, turned[:, k], f"{signals[RATES[0]].source}{FILTER}") for k, name in enumerate(ANGLES)
    }
    assumed = [
        "attitude: roll and pitch from rates and accelerations by the filter VQF, without a magnetometer; "
        f"accelerations of the ship bias them (rms of the horizontal specific force: {_horizontal(signals):.2g} m/s^2)"
    ]
    if len(spans) > 1:
        assumed.append(f"attitude: {len(spans) - 1} gaps, after each the filter begins anew, its yaw as well")
    return found, assumed


def add_rates(signals: dict[str, Signal]) -> list[str]:
    """Put rates made of roll, pitch and yaw beside accelerations that have none; what is assumed of them."""
    if not all(name in signals for name in ("roll", "pitch", *FORCES)) or can(signals):
        return []
    one = signals["roll"]
    t = (one.time - one.time[0]) / SECOND
    if len(t) < FEWEST_ANGLES or 1.0 / float(np.median(np.diff(t))) < SLOWEST:
        return []
    rate, value = np.zeros((3, len(t))), np.zeros((3, len(t)))
    for k, name in enumerate(ANGLES):
        if name in signals:
            other = signals[name]
            value[k] = np.interp(t, (other.time - one.time[0]) / SECOND, other.value)
            rate[k] = CubicSpline(t, value[k])(t, 1)
    for name, turned in zip(RATES, body_rates(value[0], value[1], rate)):
        signals.setdefault(name, Signal(name, one.time, turned, f"{one.source}: differentiated"))
    without = "" if "yaw" in signals else ", yaw as steady"
    return [f"rates: not in the log, made of the attitude for the accelerations{without}"]


def _horizontal(signals: dict[str, Signal]) -> float:
    """Deviation of the horizontal specific force [m/s^2], by the axes of the ship."""
    return float(np.sqrt(sum(np.var(signals[name].value) for name in FORCES[:2])))
