"""Figures of the AHC benchmark: pure functions of tick outputs. One table declares every figure.

Sums are from left to right or numpy's own, so that they repeat where the tick outputs do; the band of the waves is cut
out by numpy's Fourier transform, which another machine repeats to round-off.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...physics.tick_output import Flag
from ...runs.summary import CHI_SQUARE, FLAT, after_start, since_first, tick_length, tow_axes
from ...sim.tables.elementary import principal, product

# name, unit, meaning
FIGURES = (
    ("decoupling", "1", "1 less rms of the residual over rms of the input, in the wave band"),
    ("input_rms_m", "m", "motion of the sheave along the departing cable, in the wave band"),
    ("residual_rms_m", "m", "the same less the pay-out: what is left to the cable"),
    ("depth_rms_m", "m", "depth of the towbody, in the wave band"),
    ("ellipsoid_volume_m3", "m^3", "ellipsoid of 95 % of the towbody's places, about its mean track"),
    ("ellipsoid_a_m", "m", "its longest semi-axis"),
    ("ellipsoid_b_m", "m", "its middle one"),
    ("ellipsoid_c_m", "m", "its shortest one"),
    ("tension_mean_n", "N", "tension where the cable leaves the sheave"),
    ("tension_std_n", "N", "its standard deviation"),
    ("tension_min_n", "N", "its least value, in any time step"),
    ("tension_max_n", "N", "its largest value, in any time step"),
    ("snaps", "1", "times that it went from slack back over the mean of the twin"),
    ("contact_least_n", "N", "least resultant of the cable on the sheave"),
    ("lifted_s", "s", "time off the sheave, or with less than a tenth of the twin's mean load on it"),
    ("travel_m", "m", "way of the cable over the drum, either way"),
    ("rate_max_m_s", "m/s", "largest speed of pay-out, either way"),
    ("torque_max_nm", "N m", "largest torque of motor or cable on the drum"),
    ("power_max_w", "W", "largest power of motor or winch, either way"),
    ("energy_j", "J", "energy that motor or winch gave, without what came back"),
    ("saturated_s", "s", "time in which rate, acceleration or motor were at their limit"),
    ("overshoot_n", "N", "excursion of the tension after a fault beyond that before it"),
    ("time_to_safe_s", "s", "from a fault to the last time outside the tensions of the twin"),
)
NAMES = tuple(name for name, _, _ in FIGURES)


class Rules(NamedTuple):
    """What figures are taken with: start-up left out [s], wave band [Hz], slack (of the twin's mean), fault [s]."""

    start_up: float
    band: tuple[float, float]
    slack: float
    fault: tuple[float, float] | None = None


class Twin(NamedTuple):
    """What is taken from the uncompensated run: mean departure angle [rad], tension and contact load [N], and the least
    and largest tension [N]."""

    angle: float
    mean: float
    contact: float
    least: float
    largest: float


def rms(x: np.ndarray) -> float:
    """Root of the mean of the squares."""
    return float(np.sqrt((x * x).mean()))


def in_band(x: np.ndarray, tick: float, band: tuple[float, float]) -> np.ndarray:
    """What of a series lies between two frequencies [Hz], both included; a straight line is taken off first."""
    t = np.arange(len(x)) - 0.5 * (len(x) - 1)
    level = x - x.mean()
    level -= t * ((t * level).sum() / (t * t).sum())
    spectrum = np.fft.rfft(level)
    frequency = np.arange(len(spectrum)) / (len(x) * tick)
    spectrum[(frequency < band[0]) | (frequency > band[1])] = 0.0
    return np.fft.irfft(spectrum, len(x))


def along_cable(frames: np.recarray, angle: float) -> np.ndarray:
    """Motion [m] of the sheave along a cable that departs at an angle [rad] from the vertical, in the plane of the
    mean tow: what a winch has to pay out."""
    ahead = product(frames["sheave_position"][:, :2], tow_axes(frames)[0])
    return np.sin(angle) * ahead + np.cos(angle) * frames["sheave_position"][:, 2]


def decoupling(moved: np.ndarray, left: np.ndarray) -> float:
    """1 less rms of what is left over rms of what moved; 0 where nothing moved."""
    whole = rms(moved)
    return 1.0 - rms(left) / whole if whole > 0.0 else 0.0


def ellipsoid(time: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Semi-axes [3, longest first, m] of the ellipsoid of 95 % of normally distributed places [n, 3] at times [n].

    The mean horizontal track is taken off, as in runs/summary.py, whose volume is that of these axes. An axis along
    which nothing moves (FLAT) is 0.
    """
    since = (time - time.mean())[:, None]
    rest = places - places.mean(axis=0)
    rest[:, :2] -= since * ((since * rest[:, :2]).sum(axis=0) / (since * since).sum())
    variance, _ = principal((rest[:, :, None] * rest[:, None, :]).sum(axis=0) / (len(rest) - 1))
    return np.sqrt(CHI_SQUARE * np.where(variance < FLAT**2, 0.0, variance)[::-1])


def volume(axes: np.ndarray) -> float:
    """Of an ellipsoid with these semi-axes [m^3]; 0 of a flat one."""
    return float(4.0 / 3.0 * np.pi * axes[0] * axes[1] * axes[2])


def snaps(least: np.ndarray, largest: np.ndarray, slack: float, taut: float) -> int:
    """Times that a tension falls below ``slack`` and then rises above ``taut`` [N]; least, largest: of each tick."""
    state = np.where(least < slack, -1, np.where(largest > taut, 1, 0))
    turns = state[state != 0]
    return int(((turns[:-1] < 0) & (turns[1:] > 0)).sum())


def overshoot(time: np.ndarray, least: np.ndarray, largest: np.ndarray, begin: float) -> float:
    """How much further [N] from the mean before a time [s] the tension goes after it than before it; 0: no further."""
    before = time < begin
    mean = 0.5 * (least[before] + largest[before]).mean()
    away = np.maximum(largest - mean, mean - least)
    return float(max(0.0, away[~before].max() - away[before].max()))


def time_to_safe(time: np.ndarray, outside: np.ndarray, begin: float) -> float:
    """Seconds from a time on to the end of the last tick that is outside; 0 where none is."""
    late = time[outside & (time >= begin)]
    return float(late[-1] - begin) if len(late) else 0.0


def twin_of(frames: np.recarray, start_up: float) -> Twin:
    """What the run with the winch held gives to those beside it."""
    kept = after_start(frames, start_up)[0]
    low, high = _extremes(kept)
    angle, tension, contact = (float(kept[name].mean()) for name in ("departure_angle", "tension", "contact_resultant"))
    return Twin(angle, tension, contact, float(low.min()), float(high.max()))


def figures(frames: np.recarray, rules: Rules, twin: Twin, motor: bool) -> dict[str, float | int | None]:
    """Every figure of FIGURES of a run; motor: a motor turns the drum. ``None`` of what needs a fault, without one."""
    kept, skipped = after_start(frames, rules.start_up)
    tick, time = tick_length(kept), skipped + since_first(kept) * 1e-9
    moved = along_cable(kept, twin.angle)
    whole, left = (in_band(x, tick, rules.band) for x in (moved, moved - kept["payout"]))
    low, high = _extremes(kept)
    axes = ellipsoid(time, kept["body_position"])
    power = kept["motor_power"] if motor else -kept["tension_drum"] * kept["payout_rate"]
    peaks = (power,) if motor else (kept["winch_power_tick_min"], kept["winch_power_tick_max"])
    torque = kept["motor_pull"] * kept["drum_lay_radius"] if motor else kept["drum_torque"]
    off = (kept["contact_resultant"] < rules.slack * twin.contact) | (kept["status"] & Flag.DETACHED != 0)
    held = np.maximum(np.maximum(kept["rate_limited"], kept["acceleration_limited"]), kept["motor_limited"])
    found: dict[str, float | int | None] = {
        "decoupling": round(decoupling(whole, left), 9) + 0.0,  # no -0
        "input_rms_m": rms(whole),
        "residual_rms_m": rms(left),
        "depth_rms_m": rms(in_band(-kept["body_position"][:, 2], tick, rules.band)),
        "ellipsoid_volume_m3": volume(axes),
        **dict(zip(("ellipsoid_a_m", "ellipsoid_b_m", "ellipsoid_c_m"), map(float, axes), strict=True)),
        "tension_mean_n": float(kept["tension"].mean()),
        "tension_std_n": float(kept["tension"].std()),
        "tension_min_n": float(low.min()),
        "tension_max_n": float(high.max()),
        "snaps": snaps(low, high, rules.slack * twin.mean, twin.mean),
        "contact_least_n": float(kept["contact_resultant"].min()),
        "lifted_s": float(off.sum()) * tick,
        "travel_m": float(np.abs(kept["payout_rate"]).sum()) * tick,
        "rate_max_m_s": float(kept["payout_rate_tick_max"].max()),
        "torque_max_nm": float(np.abs(torque).max()),
        "power_max_w": float(max(np.abs(peak).max() for peak in peaks)),
        "energy_j": float(np.maximum(power, 0.0).sum()) * tick,
        "saturated_s": float(held.sum()) * tick,
        "overshoot_n": None,
        "time_to_safe_s": None,
    }
    if rules.fault is not None:
        begin = rules.fault[0]
        outside = (low < twin.least) | (high > twin.largest)
        found["overshoot_n"] = overshoot(time, low, high, begin)
        found["time_to_safe_s"] = time_to_safe(time, outside, begin)
    return found


def _extremes(frames: np.recarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest tension where the cable leaves the sheave, of each tick [N]."""
    return (
        np.fmin(frames["tension"], frames["tension_tick_min"]),
        np.fmax(frames["tension"], frames["tension_tick_max"]),
    )
