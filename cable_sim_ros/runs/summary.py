"""Summary of a run: the figures a towing engineer asks for first, from its tick outputs.

One table declares every figure; the JSON, the printed table and docs/json.md are made from it. Statistics leave out
the first ``skip_s`` seconds, in which the tow finds its rhythm; counts and durations are of the whole run.

What a run gives, and its folder.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..files import write_text
from ..io.bags.bag import BagError
from ..io.bags.bag_writer import cannot_make
from ..io.scenes.document import RUN_BAG
from ..io.sources.recorded_tow import Residual
from ..physics.tick_output import Flag
from ..sim.checks.deviation_checks import SKIP
from ..sim.scene import Scene
from ..sim.tables.elementary import principal, product
from ..sim.verdict import Verdict
from .mean_track import angles_along
from .passage import HAUL_OVER, HAULED, TURNED, events, haul_of, turned, turns
from .passage import since_first as since_first
from .passage import tick_length as tick_length

if TYPE_CHECKING:
    from rich.table import Table

FRACTION = 0.95  # of the towbody positions inside the ellipsoid
CHI_SQUARE = 7.814727903251179  # its quantile of FRACTION, three degrees of freedom; scipy takes a sixth of a start
FLAT = 1e-6  # m; an ellipsoid whose least standard deviation is below this has no volume
NOTHING = 1e-9  # of the mean, or deg: what is below this is round-off
AT_REST = 0.05  # m/s; a slower ship has no track, its heading is taken instead

PASSAGE = {  # figure of the JSON: event
    "slam_max_n": "slam",
    "splash_tension_min_n": "splash_tension_least",
    "splash_tension_max_n": "splash_tension",
    "landing_speed_m_s": "landing_speed",
}
EXTREMES = (  # of a haul: name, meaning
    ("body_depth", "depth of the towbody"),
    ("payout", "pay-out"),
    ("scope", "scope"),
    ("layback", "layback, from the sheave"),
    ("cable_on_drum", "length of cable on the drum"),
)

WINCH_PEAKS = (  # name, unit, meaning, field of the tick output, which end of it
    ("winch_rate_max_m_s", "m/s", "largest speed of pay-out, either way", "payout_rate_tick_max", np.max),
    (
        "winch_acceleration_max_m_s2",
        "m/s^2",
        "largest acceleration of pay-out, either way",
        "payout_acceleration_tick_max",
        np.max,
    ),
    ("winch_pull_max_n", "N", "largest tension at the drum", "tension_drum_tick_max", np.max),
    ("winch_power_max_w", "W", "largest power of the winch on the cable", "winch_power_tick_max", np.max),
    (
        "winch_power_min_w",
        "W",
        "least power of the winch on the cable; negative: it paid out and braked",
        "winch_power_tick_min",
        np.min,
    ),
    ("motor_pull_max_n", "N", "largest pull of the motor at the drum; 0 without one", "motor_pull", np.max),
    ("motor_power_max_w", "W", "largest power of the motor on the drum; 0 without one", "motor_power", np.max),
    ("motor_limited_share", "", "share of the run in which the motor gave all it can", "motor_limited", np.mean),
    ("brake_slip_m", "m", "cable run off or on against the brake", "brake_slip", np.max),
    ("brake_heat_j", "J", "heat of the brake", "brake_heat", np.max),
)
WINCH_LIMITS = (  # name, and of the field of the tick output, what was held
    ("rate_limited", "`winch.max_rate` held the servo"),
    ("acceleration_limited", "`winch.max_acceleration` held the servo"),
    ("travel_limited", "an end stop or a soft limit held or braked the servo"),
    ("command_limited", "a command asked for more than rate or travel"),
    ("ramp_limited", "`winch.command_acceleration` held the commanded rate"),
)

# name, unit, meaning
SUMMARY = (
    ("tension_mean_n", "N", "mean tension where the cable leaves the sheave"),
    ("tension_std_n", "N", "its standard deviation; null of a haul"),
    ("tension_min_n", "N", "its least value, in any time step"),
    ("tension_max_n", "N", "its largest value, in any time step"),
    ("tension_min_at_s", "s", "time since the begin of the run at the end of the tick in which the least tension fell"),
    ("tension_max_at_s", "s", "that of the largest tension"),
    ("tension_max_payout_m", "m", "pay-out in that tick"),
    ("tension_max_scope_m", "m", "scope in that tick"),
    (
        "tension_damped_n",
        "N",
        "rms of the ringing of the tension that the time steps damped away, an estimate: tension_std_n is without it",
    ),
    ("body_depth_m", "m", "mean depth of the towbody below the mean water surface"),
    ("body_depth_std_m", "m", "its standard deviation; null of a haul"),
    (
        "body_position_m",
        "m",
        "mean towbody position: forward and to port of the sheave along the mean tow, height above the water; null of "
        "a haul or a turn",
    ),
    (
        "ellipsoid_volume_m3",
        "m^3",
        "volume of the ellipsoid of the covariance of the towbody positions, in the frame "
        "of the mean tow, that holds 95 % of normally distributed ones (chi-square, 3); null of a haul or a turn",
    ),
    (
        "ellipsoid_volume_points_m3",
        "m^3",
        "volume of the ellipsoid of the same shape that holds 95 % of the positions "
        "themselves (Westin 2018, section 4.3); null of a haul or a turn",
    ),
    (
        "body_pitch_mean_deg",
        "deg",
        "mean pitch of the towbody, nose up; null of one of `model: level`, as what follows",
    ),
    ("body_pitch_std_deg", "deg", "its standard deviation"),
    ("body_roll_mean_deg", "deg", "mean roll of the towbody, port side up"),
    ("body_roll_std_deg", "deg", "its standard deviation"),
    ("slam_max_n", "N", "largest `slam` of a tick output, whole run; null: no body was in the water surface"),
    ("splash_tension_min_n", "N", "least tension at the sheave while one was, in any time step; null as above"),
    ("splash_tension_max_n", "N", "largest tension then"),
    (
        "landing_speed_m_s",
        "m/s",
        "speed downward of the towbody in the tick before the flag SEABED, of body or cable, first rises; null: never",
    ),
    ("contact_resultant_mean_n", "N", "mean resultant of the cable on the sheave"),
    ("contact_resultant_max_n", "N", "its largest value, in any time step"),
    ("wrap_angle_mean_deg", "deg", "mean arc between the first and the last loaded contact point"),
    ("sheave_heave_std_m", "m", "standard deviation of the height of the sheave"),
    (
        "strum_amplification",
        "1",
        "mean computed drag factor of strumming over the cable in the water; null: viv is off, or nothing strums",
    ),
    (
        "strum_amplitude_max_diameters",
        "1",
        "largest amplitude of strumming along the cable, in its diameters; null: viv is off, or nothing strums",
    ),
    *(
        (f"{name}_{end}_m", "m", f"{which} {what}, whole run")
        for name, what in EXTREMES
        for end, which in (("min", "least"), ("max", "largest"))
    ),
    (
        "hauled_m",
        "m",
        f"range of the mean scope over {HAUL_OVER:g} s, whole run. Above {HAULED[0]:g} m and {100.0 * HAULED[1]:g} % "
        "of the largest scope the run is a haul: means are over all its scopes, what is about one place is null",
    ),
    (
        "turned_deg",
        "deg",
        f"range of the mean heading over {HAUL_OVER:g} s, whole run. Above {TURNED:g} deg the run is a turn: there is "
        "no mean tow, and what is about it is null",
    ),
    ("scope_start_m", "m", "scope in the first tick output"),
    ("scope_end_m", "m", "scope in the last tick output"),
    ("body_depth_start_m", "m", "depth of the towbody in the first tick output"),
    ("body_depth_end_m", "m", "depth of the towbody in the last tick output"),
    *((name, unit, f"{what}, whole run") for name, unit, what, *_ in WINCH_PEAKS),
    *((f"winch_{name}_share", "1", f"share of the whole run in which {what}") for name, what in WINCH_LIMITS),
    ("drum_end_s", "s", "time in which the winch stood at an end of its travel, whole run"),
    ("duration_s", "s", "simulated time, whole run"),
    (
        "skip_s",
        "s",
        "start-up left out of the statistics: 20 s with motion, `water.ramp` where that is longer and there are waves "
        "or turbulence, at most half the run",
    ),
    ("steps", "1", "time steps of the integrator, whole run"),
    ("iterations", "1", "Newton iterations, whole run"),
    ("flags", "1", "ticks with each health flag, whole run"),
    ("realtime_factor", "1", "simulated time over wall time"),
    ("missed_ticks", "1", "ticks that came more than a period late"),
    ("latency_p50_ms", "ms", "IMU stamp to tension on the wire, median"),
    ("latency_p99_ms", "ms", "IMU stamp to tension on the wire, 99 % quantile"),
    ("jitter_p99_ms", "ms", "start of a tick after its due time, 99 % quantile"),
)
DEPARTURE = (  # a run adds it from the free cable; not of the tick outputs alone
    "departure_angle_deg",
    "deg",
    "mean angle of the cable at the sheave from the downward vertical, read as in [fields](fields.md)",
)
OF_BODIES = (  # of each body on the line, after the start-up: name, unit, meaning
    ("depth_m", "m", "mean depth below the mean water surface"),
    ("depth_std_m", "m", "its standard deviation, at the ends of ticks as all of these"),
    ("layback_m", "m", "mean horizontal distance from the sheave"),
    ("tension_above_mean_n", "N", "mean tension of the cable on its inboard side"),
    ("tension_above_max_n", "N", "its largest value"),
    ("tension_below_min_n", "N", "least tension of the cable on its outboard side"),
    ("pitch_mean_deg", "deg", "mean pitch, nose up; 0 of one of `model: level`, as what follows"),
    ("pitch_std_deg", "deg", "its standard deviation"),
    ("roll_std_deg", "deg", "standard deviation of the roll"),
)
OUTSIDE = ("realtime_factor", "missed_ticks", "latency_p50_ms", "latency_p99_ms", "jitter_p99_ms")


@dataclass
class Run:
    """What a run gave: tick outputs, plain figures by JSON name, why it ended early ("" = it did not), files made."""

    frames: np.recarray
    metrics: dict[str, Any]
    problem: str = ""
    bag: Path | None = None
    residuals: list[Residual] = field(default_factory=list)
    verdict: Verdict = field(default_factory=Verdict)
    scene: Scene | None = None  # that was simulated
    run_verdict: Verdict | None = None  # on the run that a replay with a journal repeats; `verdict`: is it that run?


def bag_path(out: str | os.PathLike | None) -> Path | None:
    """The bag of a run in its folder, which is made; None without one. Raises BagError where that cannot be."""
    if out is None:
        return None
    bag = Path(out) / RUN_BAG
    try:  # said before the run, not after it
        if bag.exists():
            raise BagError(
                f"'{bag}' exists already: nothing was simulated, a recording is not overwritten; "
                "give another folder with --out, or remove it"
            )
        Path(out).mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=os.fspath(out)).close()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        raise BagError(f"{cannot_make(bag, error)} with --out; nothing was simulated") from None
    return bag


def write_summary(out: str | os.PathLike | None, result: Run) -> None:
    """Figures of a run into its folder."""
    if out is not None:
        write_text(Path(out) / "summary.json", json.dumps(result.metrics, indent=1) + "\n")


def tow_axes(frames: np.recarray) -> np.ndarray:
    """Unit vectors [2, 2] in the horizontal plane of odom: along the mean tow and to port of it."""
    track = frames["ship_velocity"][:, :2].mean(axis=0)
    if np.hypot(*track) < AT_REST:
        x, y, z, w = frames["ship_quaternion"].T
        track = np.array([np.mean(1 - 2 * (y * y + z * z)), np.mean(2 * (x * y + w * z))])
    along = track / np.hypot(*track)
    return np.array([along, [-along[1], along[0]]])


def after_start(frames: np.recarray, skip_s: float) -> tuple[np.recarray, float]:
    """Tick outputs without the start-up, and the seconds left out: ``skip_s``, but at most half the run."""
    time = since_first(frames) * 1e-9
    skip = min(skip_s, 0.5 * time[-1])
    return frames[time >= skip], float(skip)


def ellipsoid_volume(time: np.ndarray, positions: np.ndarray) -> tuple[float, float]:
    """Volumes [m^3] of the ellipsoid that holds 95 % of ``positions`` [n, 3] at ``time`` [n] s.

    The mean horizontal track, a straight line at constant speed, is taken off first. Both have the principal axes
    of the covariance and radii in proportion to the standard deviations; the first is scaled by the chi-square
    quantile for normally distributed positions, the second until 95 % of the positions are inside. Motion in
    a plane or a line, or a single position, has no volume: 0.
    """
    if len(positions) < 4:
        return 0.0, 0.0
    since = (time - time.mean())[:, None]
    rest = positions - positions.mean(axis=0)
    rest[:, :2] -= since * ((since * rest[:, :2]).sum(axis=0) / (since * since).sum())
    variance, axes = principal((rest[:, :, None] * rest[:, None, :]).sum(axis=0) / (len(rest) - 1))
    if variance[0] < FLAT**2:
        return 0.0, 0.0
    distance2 = np.sum(product(rest, axes) ** 2 / variance, axis=1)
    unit = 4.0 / 3.0 * np.pi * np.sqrt(np.prod(variance))
    normal, found = (float(unit * scale2**1.5) for scale2 in (CHI_SQUARE, np.quantile(distance2, FRACTION)))
    return normal, found


def summarize(frames: np.recarray, *, skip_s: float = SKIP, **outside: float | None) -> dict:
    """Summary of a run as a dict in the order of SUMMARY, JSON-ready.

    frames: recarray of TICK_OUTPUT [ticks], of `load_run` or `Simulator.run`; skip_s: start-up to leave out [s];
    outside: what the tick outputs do not know, by the names in OUTSIDE, None where unknown. ValueError for no tick
    outputs or a bad skip.
    """
    if unknown := set(outside) - set(OUTSIDE):
        raise TypeError(
            f"no summary field is called {', '.join(sorted(unknown))}: known from outside are {', '.join(OUTSIDE)}"
        )
    if not len(frames):
        raise ValueError("no frames: there is nothing to summarise; record at least one tick")
    if not skip_s >= 0:
        raise ValueError(f"skip_s is {skip_s} s: the summary was not made; it must be 0 or more")
    kept, skip = after_start(frames, skip_s)
    tension, depth = kept["tension"], -kept["body_position"][:, 2]
    offset = (kept["body_position"] - kept["sheave_position"])[:, :2].mean(axis=0)
    volume, volume_points = ellipsoid_volume(since_first(kept) * 1e-9, kept["body_position"])
    travel, hauls = haul_of(frames)
    moves = hauls or turns(frames)
    metrics = {
        "tension_mean_n": tension.mean(),
        "tension_std_n": None if hauls else _deviation(tension),
        **peaks(kept, frames),
        "body_depth_m": depth.mean(),
        "body_depth_std_m": None if hauls else _deviation(depth),
        "body_position_m": None if moves else [*map(float, product(tow_axes(kept), offset)), float(-depth.mean())],
        "ellipsoid_volume_m3": None if moves else volume,
        "ellipsoid_volume_points_m3": None if moves else volume_points,
        **attitude(kept),
        **passage(frames),
        "contact_resultant_mean_n": kept["contact_resultant"].mean(),
        "contact_resultant_max_n": np.fmax(kept["contact_resultant"], kept["contact_resultant_tick_max"]).max(),
        "wrap_angle_mean_deg": np.degrees(kept["wrap_angle"].mean()),
        "sheave_heave_std_m": _deviation(kept["sheave_position"][:, 2]),
        **strumming(kept),
        **extremes(frames),
        "hauled_m": travel,
        "turned_deg": turned(frames),
        **ends(frames),
        **winch_at_work(frames),
        "drum_end_s": float(np.sum(frames["status"] & Flag.DRUM_END != 0)) * tick_length(frames),
        "duration_s": since_first(frames)[-1] * 1e-9,
        "skip_s": skip,
        "steps": int(frames["substeps"].sum()),
        "iterations": int(frames["iterations"].sum()),
        "flags": {flag.name: count for flag in Flag if flag and (count := int(np.sum(frames["status"] & flag != 0)))},
        **{name: outside.get(name) for name in OUTSIDE},
    }
    return {
        name: float(metrics[name]) if isinstance(metrics[name], np.floating) else metrics[name] for name, *_ in SUMMARY
    }


def of_bodies(names: Iterable[str], rows: np.ndarray, frames: np.recarray) -> dict[str, dict[str, float]]:
    """OF_BODIES by the names of the bodies; rows [ticks, bodies, BODY_COLUMNS] and tick outputs of the same ticks."""
    found = {}
    for name, body in zip(names, rows.swapaxes(0, 1), strict=True):
        depth, above = -body[:, 2], body[:, 3]
        layback = np.hypot(*(body[:, :2] - frames["sheave_position"][:, :2]).T)
        roll, pitch = np.degrees(body[:, 6]), np.degrees(body[:, 7])
        values = [depth.mean(), _deviation(depth), layback.mean(), above.mean(), above.max(), body[:, 4].min()]
        values += [0.0 - pitch.mean(), _deviation(pitch), _deviation(roll)]
        found[name] = {key: float(value) for (key, *_), value in zip(OF_BODIES, values, strict=True)}
    return found


def pitch_and_roll(frames: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pitch of the towbody, nose up, and roll, port side up, at every tick [deg]."""
    roll, pitch, _ = angles_along(frames["body_quaternion"])
    return -np.degrees(pitch), np.degrees(roll)


def attitude(frames: np.recarray) -> dict[str, float | None]:
    """Mean and deviation of pitch and roll of the towbody; None of one that is always level."""
    level, found = not frames["body_quaternion"][:, :2].any(), dict[str, float | None]()
    for name, angle in zip(("pitch", "roll"), pitch_and_roll(frames), strict=True):
        angle = angle * (np.abs(angle).max() > NOTHING)  # without round-off
        found[f"body_{name}_mean_deg"] = None if level else float(angle.mean())
        found[f"body_{name}_std_deg"] = None if level else _deviation(angle)
    return found


def passage(frames: np.recarray) -> dict[str, float | None]:
    """What the water surface and the seabed did to the bodies, whole run."""
    found = events(frames)
    return {key: found[name].value if name in found else None for key, name in PASSAGE.items()}


def strumming(frames: np.recarray) -> dict[str, float | None]:
    """Figures of strumming; None where viv was off, nothing strummed, or the tick outputs are of a version without
    it."""
    factor, amplitude = frames["amplification_mean"], frames["strum_amplitude_most"]
    known = bool(np.isfinite(factor).all() and np.isfinite(amplitude).all() and (amplitude > 0.0).any())
    return {
        "strum_amplification": float(factor.mean()) if known else None,
        "strum_amplitude_max_diameters": float(amplitude.max()) if known else None,
    }


def peaks(kept: np.recarray, frames: np.recarray) -> dict[str, float | None]:
    """Least and largest tension at the sheave of ``kept``, by the steps of every tick, and when and at which length of
    cable it fell; ``frames``: of the whole run. An older recording has the ends of its ticks alone."""
    low = np.fmin(kept["tension"], kept["tension_tick_min"])
    high = np.fmax(kept["tension"], kept["tension_tick_max"])
    at_min, at_max = kept[int(low.argmin())], kept[int(high.argmax())]
    begun = int(frames["time"][0]) - round(tick_length(frames) * 1e9)  # a tick output is the end of its tick
    lost = kept["tension_damped"]
    return {
        "tension_min_n": low.min(),
        "tension_max_n": high.max(),
        "tension_min_at_s": (int(at_min["time"]) - begun) * 1e-9,
        "tension_max_at_s": (int(at_max["time"]) - begun) * 1e-9,
        "tension_max_payout_m": _or_none(at_max["payout"]),
        "tension_max_scope_m": _or_none(at_max["scope"]),
        "tension_damped_n": float(np.sqrt(0.5 * np.mean(lost**2))) if np.isfinite(lost).all() else None,
    }


def _or_none(value: float) -> float | None:
    return float(value) + 0.0 if np.isfinite(value) else None  # no minus zero


def winch_at_work(frames: np.recarray) -> dict[str, float | None]:
    """Peaks of the winch and the share of the time in which each of its limits held it; None as in extremes()."""
    found = {name: _or_none(of(frames[field])) for name, _, _, field, of in WINCH_PEAKS}
    return found | {f"winch_{name}_share": _or_none(frames[name].mean()) for name, _ in WINCH_LIMITS}


def extremes(frames: np.recarray) -> dict[str, float | None]:
    """Least and largest of EXTREMES; None where the tick outputs are of a version that did not have the field."""
    found: dict[str, float | None] = {}
    for name, _ in EXTREMES:
        values = -frames["body_position"][:, 2] if name == "body_depth" else frames[name]
        known = bool(np.isfinite(values).all())
        for end, of in (("min", np.min), ("max", np.max)):
            found[f"{name}_{end}_m"] = float(of(values)) if known else None
    return found


def _deviation(values: np.ndarray) -> float:
    """Standard deviation; 0 where it is round-off, as of a static tow."""
    found, size = float(values.std()), float(np.abs(values).max())
    return found if found > NOTHING * size else 0.0


def ends(frames: np.recarray) -> dict[str, float | None]:
    """Scope and depth of the towbody in the first and the last tick output; None where the tick outputs do not have
    them."""
    found: dict[str, float | None] = {}
    for name, values in (("scope", frames["scope"]), ("body_depth", -frames["body_position"][:, 2])):
        for end, k in (("start", 0), ("end", -1)):
            found[f"{name}_{end}_m"] = float(values[k]) if np.isfinite(values[k]) else None
    return found


def format_value(value: object) -> str:
    """Figure as text: counts in full, quantities to 5 digits."""
    if isinstance(value, dict):
        return ", ".join(f"{name} {count}" for name, count in value.items()) or "none"
    if isinstance(value, (list, tuple)):
        return "  ".join(format_value(part) for part in value)
    return str(value) if isinstance(value, int) else f"{value:.5g}"


def summary_table(summary: dict, title: str = "Summary") -> Table:
    """The summary as a `rich` table; figures that are not known are left out."""
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    table.add_column("figure")
    table.add_column("value", justify="right")
    table.add_column("unit")
    table.add_column("meaning", overflow="fold")
    for name, unit, meaning in (*SUMMARY, DEPARTURE):
        if summary.get(name) is not None:
            table.add_row(name, format_value(summary[name]), "" if unit == "1" else unit, meaning)
    for body, metrics in summary.get("bodies", {}).items():
        for name, unit, meaning in OF_BODIES:
            table.add_row(f"bodies.{body}.{name}", format_value(metrics[name]), unit, meaning)
    return table
