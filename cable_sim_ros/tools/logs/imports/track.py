"""Where a ship goes: positions of a log, its speed and course, or a mean track that is put in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline

from ....io.geodesy import on_plane
from ....io.sources.motion_curves import Given, Rounding, through
from ....runs.make_bags import EDGE as EDGE
from ....runs.make_bags import derive
from ..log import LogError
from .regular import Regular

LONGEST_GAP = 10.0  # s, over which a mean track bridges positions
STRAIGHT = np.radians(30.0)  # a heading that turns over more goes no straight way
UNDER_WAY = 3.0  # times the deviation of the velocity: a mean above it has a direction


@dataclass(frozen=True)
class Choice:
    """track: measured, or mean: a straight one at `speed` [m/s, None: that of the scene of
    a run], measured deviations of 30 s and less about it;
    heading: from east to north [rad], None: that of the log; height: mean of base_link above the water [m]."""

    track: str = "measured"
    speed: float | None = None
    heading: float | None = None
    height: float = 0.0


@dataclass
class Track:
    """Signals on even times, the times of the motion [s], its coordinates and rates so far; is yaw among them?"""

    lines: Mapping[str, Regular]
    at: np.ndarray
    value: np.ndarray
    rate: np.ndarray
    yaw: bool


@dataclass
class Found:
    """place [n, 2] m, velocity, yaw and its rate at the times of a track; inside: those with a place, None: all.

    along: where a run adds the speed of its scene, as none is in the log: heading [rad] or None: along the yaw."""

    place: np.ndarray
    velocity: np.ndarray
    yaw: np.ndarray
    yaw_rate: np.ndarray
    assumed: list[str] = field(default_factory=list)
    given: list[str] = field(default_factory=list)
    rounded: dict[int, Rounding] = field(default_factory=dict)
    inside: np.ndarray | None = None
    along: dict[str, float | None] | None = None


def measured(track: Track, choice: Choice) -> Found:
    """The track of the log itself; without positions by speed and course, without these a mean one."""
    lines, at = track.lines, track.at
    places = _places(lines)
    if places is None:
        return _dead_reckoned(track, choice)
    names, (east, north) = places
    out = _with_yaw(track, choice)
    out.given += names
    for k, (line, values) in enumerate(((lines[names[0]], east), (lines[names[1]], north))):
        curves, report = through(
            Given(("x", "y")[k], "m", 1.0, False), [(line.t[part], values[part], None) for part in line.parts]
        )
        if report is not None:
            out.rounded[k] = report
        near = 2.0 * line.period  # beyond the ends of the log a place stays
        inside = np.zeros(len(at), bool)
        for part, curve in zip(line.parts, curves):
            begin, end = line.t[part.start], line.t[part.stop - 1]
            here = at >= begin - (near if part.start == 0 else 1e-9)
            here &= at <= end + (near if part.stop == len(line.t) else 1e-9)
            when = np.clip(at[here], begin, end)
            out.place[here, k], out.velocity[here, k] = curve(when), curve(when, 1)
            inside |= here
        out.inside = inside if out.inside is None else out.inside & inside
    lost = float((~out.inside).mean()) if out.inside is not None and len(at) else 0.0
    if lost > 0.001:
        out.assumed.append(f"position: it has gaps or ends early, {100.0 * lost:.3g} % of the motion is left out there")
    out.assumed.append("position: east and north of the first one, on a plane; of the sensor's own reference point")
    if not track.yaw and choice.heading is None:
        mean = out.velocity.mean(axis=0)
        if np.hypot(*mean) > UNDER_WAY * np.hypot(*out.velocity.std(axis=0)):
            out.yaw = np.unwrap(np.arctan2(out.velocity[:, 1], out.velocity[:, 0]))
            out.yaw_rate = np.gradient(out.yaw, at)
            out.assumed.append("yaw: not in the log, the ship points where it goes")
        else:
            out.assumed.append("yaw: not in the log, and the ship is not under way: it points east")
    return out


def around_mean(track: Track, choice: Choice) -> Found:
    """A straight track at a chosen speed, with surge, sway and yaw of waves about it as those of the shipped bags."""
    lines, at = track.lines, track.at
    speed = choice.speed or 0.0
    out = _with_yaw(track, choice)
    heading = _mean_heading(track, choice, out)
    places = _places(lines)
    ahead = np.array([np.cos(heading), np.sin(heading)])
    since = at - at[0]
    out.place, out.velocity = np.outer(speed * since, ahead), np.tile(speed * ahead, (len(at), 1))
    way = f"along {np.degrees(heading) % 360:.4g} deg from east"
    if choice.speed is None:
        out.along = {"heading": heading}
    out.assumed.append(_speed_of(choice, way, choice.track != "mean"))
    if places is None or not track.yaw:
        _add_waves(lines, at, heading, out)
        if track.yaw and choice.track == "mean":
            _fast_yaw(lines["yaw"], at, heading, out)
        return out
    names, (east, north) = places
    line = lines[names[0]]
    longest = max(float(np.diff(lines[name].t).max()) for name in (*names, "yaw"))
    if longest > LONGEST_GAP:
        _add_waves(lines, at, heading, out)
        out.assumed.append(
            f"surge and sway of position: left out, it or the heading has a gap of {longest:.4g} s, above "
            f"{LONGEST_GAP:g} s"
        )
        return out
    if len(line.parts) > 1 or abs(line.period - 1.0) > 0.5:
        step = np.arange(line.t[0], line.t[-1], 1.0)
        out.assumed.append("position: brought to 1 Hz by a cubic spline for the motion about the mean track")
    else:
        step = line.t
    other = lines[names[1]]
    east, north = CubicSpline(line.t, east)(step), CubicSpline(other.t, north)(step)
    yaw = np.interp(step, lines["yaw"].t, lines["yaw"].value)
    whole, curves = _fast(step, east, north, yaw)
    when = np.clip(at, whole[0], whole[-1])
    value, rate = curves(when), curves(when, 1)
    left = np.array([-ahead[1], ahead[0]])
    out.place += np.outer(value[:, 0], ahead) - np.outer(value[:, 1], left)
    out.velocity += np.outer(rate[:, 0], ahead) - np.outer(rate[:, 1], left)
    out.yaw, out.yaw_rate = heading - value[:, 2], -rate[:, 2]
    out.given += names
    out.inside = (at >= whole[0] + EDGE) & (at <= whole[-1] - EDGE)
    out.assumed.append(
        "surge, sway and yaw: those above 1/30 Hz of position and heading; 30 s are left out at each end"
    )
    return out


def _fast(t: np.ndarray, east: np.ndarray, north: np.ndarray, yaw: np.ndarray) -> tuple[np.ndarray, CubicSpline]:
    """Whole seconds [s], and a curve of surge, sway to starboard and clockwise yaw above 1/30 Hz."""
    if t[-1] - t[0] <= 2.0 * EDGE + 1.0:
        raise LogError(
            f"--track mean takes {EDGE:g} s off at each end, and position and heading last {t[-1] - t[0]:.3g} s: "
            f"nothing was imported. Give a longer log, or --track measured"
        )
    moved = derive(t, east, north, 0.5 * np.pi - yaw, np.zeros((len(t), 3)))
    whole = np.arange(len(moved)) + t[0]
    return whole, CubicSpline(whole, moved[:, [0, 1, 5]])


def _fast_yaw(line: Regular, at: np.ndarray, heading: float, out: Found) -> None:
    """The heading of a log without positions, for a straight track: what is above 1/30 Hz of it."""
    if float(np.diff(line.t).max()) > LONGEST_GAP:
        out.yaw[:], out.yaw_rate[:] = heading, 0.0
        out.assumed.append(f"yaw: put at the mean, the heading has a gap above {LONGEST_GAP:g} s")
        return
    step = np.arange(line.t[0], line.t[-1], 1.0)
    still = np.zeros(len(step))
    whole, curves = _fast(step, still, still, np.interp(step, line.t, line.value))
    when = np.clip(at, whole[0], whole[-1])
    out.yaw, out.yaw_rate = heading - curves(when)[:, 2], -curves(when, 1)[:, 2]
    out.inside = (at >= whole[0] + EDGE) & (at <= whole[-1] - EDGE)
    out.assumed.append(
        f"yaw: that above 1/30 Hz of the heading, which turns over {np.degrees(np.ptp(line.value)):.3g} deg in the "
        f"log; {EDGE:g} s are left out at each end"
    )


def _dead_reckoned(track: Track, choice: Choice) -> Found:
    lines, at = track.lines, track.at
    out = _with_yaw(track, choice)
    put_in = "speed" not in lines or choice.speed is not None
    if put_in and not (track.yaw and np.ptp(out.yaw) > STRAIGHT):
        return around_mean(track, choice)
    if put_in:
        speed, way = np.full(len(at), choice.speed or 0.0), out.yaw
        if choice.speed is None:
            out.along = {"heading": None}
        out.assumed.append(_speed_of(choice, "along the heading", True))
    else:
        speed = np.interp(at, lines["speed"].t, lines["speed"].value)
        way = np.interp(at, lines["course"].t, lines["course"].value) if "course" in lines else out.yaw
    out.velocity = np.column_stack([speed * np.cos(way), speed * np.sin(way)])
    steps = np.diff(at, prepend=at[0])
    middle = 0.5 * (out.velocity + np.vstack([out.velocity[:1], out.velocity[:-1]]))
    out.place = np.cumsum(middle * steps[:, None], axis=0)
    by = "course" if "course" in lines and not put_in else "heading"
    out.given += [] if put_in else ["speed", *(["course"] if by == "course" else [])]
    out.assumed.append(f"position: not in the log, reckoned from speed and {by}; surge and sway of waves are not in it")
    return out


def _speed_of(choice: Choice, way: str, lacks: bool) -> str:
    if choice.speed is not None:
        return f"speed: {choice.speed:g} m/s {way} put in for the ship's own"
    why = "not in the log, " if lacks else ""
    return f"speed: {why}a run takes ship.tow_speed of its scene {way}; the bag alone has none"


def _places(lines: Mapping[str, Regular]) -> tuple[list[str], tuple[np.ndarray, np.ndarray]] | None:
    if "x" in lines and "y" in lines:
        return ["x", "y"], (lines["x"].value, lines["y"].value)
    if "latitude" in lines and "longitude" in lines and len(lines["latitude"].t) == len(lines["longitude"].t):
        latitude, longitude = (np.degrees(lines[name].value) for name in ("latitude", "longitude"))
        east, north = on_plane((float(latitude[0]), float(longitude[0])), latitude, longitude).T
        return ["latitude", "longitude"], (east, north)
    return None


def _with_yaw(track: Track, choice: Choice) -> Found:
    n = len(track.at)
    out = Found(np.zeros((n, 2)), np.zeros((n, 2)), track.value[:, 5].copy(), track.rate[:, 5].copy())
    if not track.yaw and choice.heading is not None:
        out.yaw[:] = choice.heading
        out.assumed.append(f"yaw: not in the log, put at {np.degrees(choice.heading):.4g} deg from east")
    return out


def _mean_heading(track: Track, choice: Choice, out: Found) -> float:
    if choice.heading is not None:
        return choice.heading
    if track.yaw:
        return float(np.mean(track.value[:, 5]))
    if "course" in track.lines:
        out.assumed.append("yaw: not in the log, the ship points along its mean course")
        out.given.append("course")
        mean = float(np.mean(track.lines["course"].value))
        out.yaw[:] = mean
        return mean
    out.assumed.append("yaw: not in the log, the ship points and goes east")
    return 0.0


def _add_waves(lines: Mapping[str, Regular], at: np.ndarray, heading: float, out: Found) -> None:
    """Surge and sway where the log has them by themselves."""
    for name, way in (("surge", heading), ("sway", heading + 0.5 * np.pi)):
        if name in lines:
            line = lines[name]
            curves, _ = through(Given(name, "m", 1.0, False), [(line.t[p], line.value[p], None) for p in line.parts])
            for part, curve in zip(line.parts, curves):
                here = (at >= line.t[part.start]) & (at <= line.t[part.stop - 1])
                along = np.array([np.cos(way), np.sin(way)])
                out.place[here] += np.outer(curve(at[here]), along)
                out.velocity[here] += np.outer(curve(at[here], 1), along)
            out.given.append(name)
    if "surge" not in out.given:
        out.assumed.append("surge and sway: not in the log, the ship keeps to its track")
