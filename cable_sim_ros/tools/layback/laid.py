"""Places of a towbody over a run: simulated, by the ways of the trade and by a static tow, with the interval.

Where the towbody of a static tow is, and the 95 % interval of that place from what is not known of the tow.

The interval is that of independent contributions: the square root of the sum of the squares of half the differences
between the static tows at both ends of each range (law of propagation, JCGM 100:2008, 5.1.2, by central differences).
At most 1 + 2 x 5 static tows a place.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from math import atan2, cos, hypot, pi, radians, sin, sqrt
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from ...physics.section import material_of
from ...sim.layout import layout_of
from ...sim.scene import Scene
from ...sim.statics.static_shape import tow_shape
from ...sim.tables.current import flow_of
from ..ensemble.copies import EnsembleEnded
from ..ensemble.plan import EnsembleError, Ranges, with_drag
from . import ways
from .towed import MOVING, NO_LEVER, SIZE, Copied, body_places, manoeuvres, turned, yaw_of

STILL = 1e-6  # m, m/s
OTHERWISE = (0.0, 1e-3, -1e-3)  # of the cable out
DEEP = 0.5  # of the scope: the depth whose current is turned

POINTS = 8  # static tows with an interval over a run, at most
CALM = 15.0  # s, over which velocity and height of the sheave are averaged
SAME = 0.02  # change of the state of a tow over which one of them holds
WAYS = ("pythagoras", "factor", "follow_dog", "along_track", "catenary", "catenary_of_depth", "table", "static")


class Tow(NamedTuple):
    """Of a steady tow: cable out [m], velocity of the ship over ground, east and north [m/s], yaw of the ship [rad]."""

    cable: float
    east: float
    north: float
    yaw: float


class Place(NamedTuple):
    """Of a towbody: east and north of the sheave's centre, and below the mean water surface, m."""

    east: float
    north: float
    depth: float

    @property
    def layback(self) -> float:
        """Horizontal distance from the sheave."""
        return hypot(self.east, self.north)


class Band(NamedTuple):
    """Half-widths of the 95 % intervals [m]: of the layback, the place along and across its mean direction, the
    depth."""

    layback: float
    along: float
    across: float
    depth: float


COVERAGE = 1.96  # standard deviations of a 95 % interval


class NoShape(ValueError):
    """A tow that has no static shape."""


def static_place(scene: Scene, tow: Tow, drag: float = 1.0) -> Place:
    """Of the towbody of a steady tow with ``drag`` times the drag of the scene. Raises NoShape.

    Where the integration does not close with this cable, one a thousandth longer or shorter stands for it.
    """
    route = layout_of(scene).route
    speed = hypot(tow.east, tow.north)
    course = atan2(tow.north, tow.east) if speed > STILL else tow.yaw
    ship = scene.ship.model_copy(update={"tow_speed": speed})
    towed = with_drag(scene, drag).model_copy(update={"ship": ship})
    for other in OTHERWISE:
        shape = tow_shape(towed, route, (1.0 + other) * tow.cable, course)
        if shape.closed and np.isfinite(shape.place).all():
            break
    else:
        raise NoShape(f"{scene.name}: {tow.cable:.4g} m of cable at {speed:.3g} m/s has no static shape")
    pull = shape.force[-1]
    flat = hypot(pull[0], pull[1])
    leaves = route.sheave * cos(shape.angle)  # from the sheave's centre to where the cable leaves it
    over = [leaves * (-pull[k] / flat if flat > 0.0 else 0.0) for k in (0, 1)]
    away = shape.place[0] - shape.place[-1]
    return Place(float(away[0] + over[0]), float(away[1] + over[1]), float(-shape.place[0, 2]))


def band_of(scene: Scene, tow: Tow, ranges: Ranges, drag: float = 1.0) -> tuple[Place, Band]:
    """The place of the towbody of a steady tow, and its interval. Raises NoShape."""
    middle = static_place(scene, tow, drag)
    speed = hypot(tow.east, tow.north)
    course = atan2(tow.north, tow.east) if speed > STILL else tow.yaw
    ahead, port = (cos(course), sin(course)), (-sin(course), cos(course))
    ends: list[tuple[Place, Place]] = []

    def sailed(way: tuple[float, float], by: float) -> Tow:
        return tow._replace(east=tow.east + by * way[0], north=tow.north + by * way[1])

    def both(way: tuple[float, float], by: float) -> None:
        if by > 0.0:
            ends.append((static_place(scene, sailed(way, by), drag), static_place(scene, sailed(way, -by), drag)))

    if ranges.drag > 0.0:
        ends.append(
            (static_place(scene, tow, drag * (1.0 + ranges.drag)), static_place(scene, tow, drag * (1.0 - ranges.drag)))
        )
    both(ahead, hypot(ranges.speed, ranges.current))  # water past the ship by its speed and by a current: the same
    both(port, ranges.current)
    flow = flow_of(scene.water, tow.yaw)(-DEEP * tow.cable)
    current = hypot(*flow)
    if current > STILL:
        both((-flow[1] / current, flow[0] / current), current * sin(radians(min(ranges.current_turn_deg, 90.0))))
    if ranges.payout > 0.0:
        more, less = (tow._replace(cable=max(tow.cable + by, 0.1)) for by in (ranges.payout, -ranges.payout))
        ends.append((static_place(scene, more, drag), static_place(scene, less, drag)))
    return middle, _combined(middle, ends, ahead)


def _combined(middle: Place, ends: list[tuple[Place, Place]], ahead: tuple[float, float]) -> Band:
    """Root of the sum of squares; along and across are of the layback, where there is one, else of the course."""
    size = middle.layback
    way = (middle.east / size, middle.north / size) if size > STILL else (-ahead[0], -ahead[1])
    total = [0.0] * 4
    for high, low in ends:
        east, north = 0.5 * (high.east - low.east), 0.5 * (high.north - low.north)
        along, across = east * way[0] + north * way[1], -east * way[1] + north * way[0]
        parts = (0.5 * (high.layback - low.layback), along, across, 0.5 * (high.depth - low.depth))
        total = [a + b * b for a, b in zip(total, parts, strict=True)]
    return Band(*map(sqrt, total))


class Samples(NamedTuple):
    """What a survey has at each time: seconds [n]; antenna, sheave [n, 2] m east and north; velocity of the sheave over
    ground [n, 2], smoothed of the waves; yaw [n]; height of the sheave [n]; cable out from the sheave, depth [n] as
    measured or simulated; fish [n, 2] as simulated, its depth and yaw."""

    seconds: np.ndarray
    antenna: np.ndarray
    sheave: np.ndarray
    velocity: np.ndarray
    yaw: np.ndarray
    height: np.ndarray
    cable: np.ndarray
    depth: np.ndarray
    fish: np.ndarray
    fish_depth: np.ndarray
    fish_yaw: np.ndarray


@dataclass
class Laid:
    """places: of each of WAYS [n, 2], NaN where it has no solution; band: half-widths of 95 % [n, SIZE], NaN where a
    steady tow has no static shape; course [n] rad; cpu: s of the static tows; moves, by_copies [n]: does the tow
    manoeuvre, and is the interval that of copies? copies: so many, and their CPU time [s]."""

    samples: Samples
    course: np.ndarray
    places: dict[str, np.ndarray]
    band: np.ndarray
    notes: list[str] = field(default_factory=list)
    cpu: float = 0.0
    statics: int = 0
    moves: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    by_copies: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))
    copies: tuple[int, float] = (0, 0.0)


def courses(velocity: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Course made good [n]; where the ship hardly moves its heading."""
    moves = np.hypot(*velocity.T) >= MOVING
    return np.where(moves, np.arctan2(velocity[:, 1], velocity[:, 0]), yaw)


def laid(
    scene: Scene,
    samples: Samples,
    ranges: Ranges,
    factor: float = ways.FACTOR,
    drag: float = 1.0,
    by_heading: bool = False,
    *,
    copied: Callable[[], Copied] | None = None,
    table: ways.Table | None = None,
) -> Laid:
    """Every way over the samples. by_heading: "astern" is against the heading, in place of the course made good.

    copied: makes the interval of copies, called where the tow manoeuvres; table: of laybacks by cable and speed.
    """
    begun = time.process_time()
    one = samples
    course = courses(one.velocity, one.yaw)
    against = one.yaw if by_heading else course
    straight = ways.pythagoras(one.cable, one.depth, one.height)
    fast = np.hypot(*one.velocity.T)
    weight, body, pull = of_scene(scene, fast)
    plain, _ = ways.catenary(one.cable, weight, body, pull)
    behind = -np.array([np.cos(against[0]), np.sin(against[0])])
    middle, steady, count, notes = static_along(scene, one, ranges, drag, POINTS)
    steady = of_track(one, middle[:, :2], steady, ranges.speed)
    away = np.hypot(*(one.fish - one.sheave).T)
    band = np.column_stack([steady, np.arctan2(steady[:, 2], away)])  # it points along the cable
    moves = manoeuvres(one.seconds, one.velocity, one.yaw, one.cable, scene)
    copies, by_copies, made = 0, np.zeros(len(moves), bool), time.process_time()
    if copied is not None and moves.any():
        band, by_copies, copies = with_copies(one.seconds, band, moves, copied, notes)
    towed = time.process_time() - made
    places = {
        "pythagoras": ways.astern(one.sheave, straight, against),
        "factor": ways.astern(one.sheave, ways.cable_factor(one.cable, factor), against),
        "follow_dog": ways.follow_the_dog(one.sheave, straight, behind),
        "along_track": ways.along_the_track(one.sheave, straight, behind),
        "catenary": ways.astern(one.sheave, plain, against),
        "catenary_of_depth": ways.astern(one.sheave, ways.catenary_of_depth(one.cable, one.depth, one.height), against),
        "table": ways.astern(one.sheave, ways.looked_up(table, one.cable, fast), against),
        "static": one.sheave + middle[:, :2],
    }
    short = int(np.sum(~np.isfinite(straight)))
    if short:
        k = int(np.argmax(~np.isfinite(straight)))
        notes.append(
            f"Pythagoras has no solution at {short} of {len(straight)} samples, first at {one.seconds[k]:.6g} s: the "
            f"cable out of {one.cable[k]:.4g} m is shorter than depth and sheave height, {one.depth[k]:.4g} + "
            f"{one.height[k]:.4g} m; left empty. Check the zero of the counter (--counter-offset) and the depth"
        )
    return Laid(
        one, course, places, band, notes, time.process_time() - begun - towed, count, moves, by_copies, (copies, towed)
    )


def with_copies(
    seconds: np.ndarray, band: np.ndarray, moves: np.ndarray, copied: Callable[[], Copied], notes: list[str]
) -> tuple[np.ndarray, np.ndarray, int]:
    """Intervals [n, SIZE] of copies where the tow manoeuvres and they reach, where they do [n], and their number."""
    share = f"the tow manoeuvres for {100.0 * moves.mean():.3g} % of the time"
    try:
        made = copied()
    except (EnsembleEnded, EnsembleError) as error:
        notes.append(f"{share}, and copies of it cannot be towed: the interval there is that of steady tows ({error})")
        return band, np.zeros(len(moves), bool), 0
    notes += made.notes
    notes.append(f"{share}: the interval there is that of {made.copies} copies of the tow")
    there = moves & (seconds >= made.seconds[0] - 1.0) & (seconds <= made.seconds[-1] + 1.0)
    new = np.column_stack([np.interp(seconds, made.seconds, made.band[:, k]) for k in range(SIZE)])
    return np.where(there[:, None], new, band), there, made.copies


def of_scene(scene: Scene, speed: np.ndarray) -> tuple[float, float, np.ndarray]:
    """What the plain catenary takes: weight of the outermost cable in water [N/m] and of the towbody [N], and the drag
    of the towbody ahead at a speed [n], N."""
    section = list(scene.cable.sections.values())[-1]
    own = material_of(scene.cable, section)
    lift = scene.water.density * 0.25 * pi * own.diameter**2
    weight = (own.mass_per_length - lift) * scene.gravity
    pull = 0.5 * scene.water.density * scene.towbody.drag_area[0] * np.asarray(speed, float) ** 2
    return weight, scene.towbody.net_weight, pull


def static_along(
    scene: Scene, one: Samples, ranges: Ranges, drag: float, points: int
) -> tuple[np.ndarray, np.ndarray, int, list[str]]:
    """Static places [n, 3] (east, north of the sheave, depth) and intervals [n, 4] at the samples, interpolated between
    at most ``points`` of them, in the axes of the course."""
    course = np.unwrap(courses(one.velocity, one.yaw))
    turns = any(
        flow_of(scene.water, 0.0)(-part * float(one.cable.max())) != (0.0, 0.0) for part in (0.0, 0.25, 0.5, 1.0)
    )
    chosen = spread(one, course if turns else np.zeros_like(course), points)
    rows, notes = [], []
    for k in chosen:
        east, north = one.velocity[k].tolist()
        try:
            place, band = band_of(scene, Tow(float(one.cable[k]), east, north, float(one.yaw[k])), ranges, drag)
        except NoShape as error:
            notes.append(f"no interval near {one.seconds[k]:.6g} s: {error}")
            rows.append([np.nan] * 7)
            continue
        c, s = np.cos(course[k]), np.sin(course[k])
        row = (place.east * c + place.north * s, place.north * c - place.east * s, place.depth + one.height[k])
        rows.append([part / one.cable[k] for part in (*row, *band)])
    table = np.array(rows)
    # shares of the cable out change less than lengths
    at = np.column_stack([np.interp(one.seconds, one.seconds[chosen], table[:, k]) for k in range(7)])
    at *= one.cable[:, None]
    world = np.column_stack([turned(course, at[:, 0], at[:, 1]), at[:, 2] - one.height])
    return world, at[:, 3:], len(chosen), notes


def of_track(one: Samples, steady: np.ndarray, band: np.ndarray, speed: float) -> np.ndarray:
    """The intervals [n, 4] of a steady tow as those of the way that the sheave came; steady [n, 2]: its place, m east
    and north of the sheave; speed: half-width of that of the ship [m/s].

    The cable lies along the way of the sheave through the water, as long as the layback of the steady tow. A current c
    that is not known moves what lies at its end by c t, t: the time since the sheave passed there, and ends it earlier
    or later by the way along that current: E c t, E = I - u m^T, u: direction of the way there, m: its mean since.
    On a straight way E c is the part of c across it, and t |c| the ``across`` of the steady tow; in a turn it has a
    part along the line from the sheave to the towbody, and a speed that is wrong by s shifts it by (u - m) s t.
    """
    away, course = one.fish - one.sheave, courses(one.velocity, one.yaw)
    known = np.isfinite(steady).all(axis=1)[:, None]
    behind = np.where(known, steady, -np.column_stack([np.cos(course), np.sin(course)]))
    size = np.maximum(np.where(known[:, 0], np.hypot(*behind.T), np.hypot(*away.T)), STILL)
    heads = -behind / np.maximum(np.hypot(*behind.T), STILL)[:, None]
    step = np.hypot(*np.diff(one.sheave, axis=0, prepend=one.sheave[:1]).T)
    chain, way = np.cumsum(step), np.cumsum(heads * step[:, None], axis=0)
    reach = float(size.max()) + 1.0  # straight before its beginning
    marks = np.concatenate([[-reach], chain])
    way = np.vstack([way[0] - reach * heads[0], way])
    ends = np.column_stack([np.interp(chain - size, marks, way[:, k]) for k in (0, 1)])
    first = heads[np.clip(np.searchsorted(marks, chain - size) - 1, 0, len(heads) - 1)]
    mean = (way[1:] - ends) / size[:, None]
    along = away / np.maximum(np.hypot(*away.T), STILL)[:, None]
    wrong = speed * size / np.maximum(np.hypot(*one.velocity.T), MOVING)
    parts = []
    for axis in (along, np.column_stack([-along[:, 1], along[:, 0]])):
        shifted = band[:, 2] * np.hypot(*(axis - (axis * first).sum(1)[:, None] * mean).T)  # E^T axis
        parts.append(np.hypot(shifted, wrong * (axis * (first - mean)).sum(1)))
    return np.column_stack([np.hypot(band[:, 0], parts[0]), np.hypot(band[:, 1], parts[0]), parts[1], band[:, 3]])


def spread(one: Samples, course: np.ndarray, points: int) -> np.ndarray:
    """Indices of at most ``points`` samples between which the state of the tow changes evenly; one where it stays.

    course: rad, as far as the tow is another one along it: of a current.
    """
    speed = np.hypot(*one.velocity.T)
    state = np.column_stack(
        [one.cable / max(float(np.max(one.cable)), 1.0), speed / max(float(np.max(speed)), MOVING), course]
    )
    way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(state, axis=0)).max(axis=1))])
    if np.ptp(state, axis=0).max() < SAME:
        return np.array([len(speed) // 2])
    found = np.searchsorted(way, np.linspace(0.0, way[-1], points))
    return np.unique(np.clip(found, 0, len(speed) - 1))


def samples_of(
    frames: np.recarray,
    every: float,
    antenna: tuple[float, float] = (0.0, 0.0),
    lever: tuple[float, float, float] = NO_LEVER,
) -> Samples:
    """Samples of tick outputs, one each ``every`` s; velocity and height without the waves; antenna in base_link, lever
    of what lies on the towbody in towbody_link, m."""
    begin = (frames["time"] - frames["time"][0]) * 1e-9
    tick = float(np.median(np.diff(begin))) if len(begin) > 1 else every
    pick = np.arange(0, len(frames), max(1, round(every / max(tick, 1e-9))))
    yaw = yaw_of(frames["ship_quaternion"])
    at = frames["ship_position"][:, :2] + turned(yaw, *antenna)
    sheave, body = frames["sheave_position"], body_places(frames, lever)
    velocity = np.column_stack([_calm(frames["sheave_velocity"][:, k], tick) for k in (0, 1)])
    return Samples(
        begin[pick],
        at[pick],
        sheave[pick, :2].copy(),
        velocity[pick],
        yaw[pick],
        _calm(sheave[:, 2], tick)[pick],
        frames["scope"][pick].copy(),
        -body[pick, 2],
        body[pick, :2].copy(),
        -body[pick, 2],
        yaw_of(frames["body_quaternion"])[pick],
    )


def _calm(values: np.ndarray, tick: float) -> np.ndarray:
    """Without the waves: the mean of CALM s, twice."""
    width = max(1, round(CALM / max(tick, 1e-9)))
    return uniform_filter1d(uniform_filter1d(np.asarray(values, float), width, mode="nearest"), width, mode="nearest")
