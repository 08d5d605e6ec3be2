"""Ropes that run over a fixed pulley without friction: Atwood's machine, lift-off, a pendulum that wraps."""

from __future__ import annotations

from math import cos, pi, radians, sin, sqrt

import numpy as np
from scipy.signal import butter, sosfiltfilt

from cable_sim_ros.sim.rig.rig import Rig, RigError

from ..bend import MOVING, Bend, Walk, distributed, laid, pulls
from ..contact_points import contact_points
from .family import Case, Level, Values, family

FINE = 0.2  # element on the pulley over its radius on the coarsest mesh: half the shipped one
COARSE = 20  # elements of a straight part beside it
CALM = 5  # samples over which a line load is averaged
LOOKS = 250  # at the line loads of a rope that lifts off
STRETCH = 1e-4  # of an inextensible rope at its first tension


def settle_moving(rig: Rig, bend: Bend, acceleration: float, mass: float, bodies: dict[int, float]) -> None:
    """Settle under the inertia of an acceleration along the rope [m/s^2]: the stretch of the first instant."""
    rig.place(*bend.nodes(rig.arc))
    _, g = bend.nodes(rig.arc)
    rows = distributed(rig.arc, -mass * acceleration * g)
    rows += pulls(*((n, -m * acceleration * g[n]) for n, m in bodies.items()))
    rig.reload(rows)
    rig.settle()
    rig.release_loads()


def level_of(rig: Rig, side: float) -> float:
    """Arc length [m] at which the rope passes the height of the axis on the side of x < 0 or x > 0."""
    r, arc = rig.state.q[:, :3], rig.arc
    for n in range(rig.nodes - 1):
        a, b = r[n, 2], r[n + 1, 2]
        if (a < 0.0) != (b < 0.0) and side * r[n, 0] > 0.0:
            return float(arc[n] + (arc[n + 1] - arc[n]) * a / (a - b))
    raise RigError("the rope does not pass the height of the axis")


@family(
    "Atwood machine",
    "m_right_kg m_left_kg rope_mass_per_length_kg_m right_hanging_m left_hanging_m radius_to_centreline_m",
    how="half wrap, no bending stiffness; settled under the inertia of the first instant, then released; averaged "
    "over one axial period of rope and masses",
)
def atwood(case: Case, level: Level) -> Values:
    """Travel, speed, tensions and contact force at the times asked for."""
    radius, mass = case.numbers("radius_to_centreline_m rope_mass_per_length_kg_m")
    gravity = case.gravity
    right, left = case.number("right_hanging_m"), case.number("left_hanging_m")
    heavy, light, ea = case.number("m_right_kg"), case.number("m_left_kg"), case.number("EA_N", 1e7)
    asked = case.asked(
        r"(travel|speed|tension at heavy-side tangent|tension at light-side tangent|"
        r"vertical contact force) at ([\d.eE+-]+) s"
    )
    times = sorted({float(m[2]) for _, m in asked})
    bend = Bend(radius, -0.5 * pi, 0.5 * pi, left)
    total = left + bend.contact + right
    first = gravity * (heavy + mass * right - light - mass * left) / (heavy + light + mass * total)
    side = 1.0 if first >= 0.0 else -1.0  # of the heavy mass
    way = radius + 0.75 * abs(first) * (times[-1] if times else 0.0) ** 2
    size = FINE * radius / level.mesh(1)
    before = max(left - (way if side > 0.0 else radius), 0.0)
    after = max(right - (way if side < 0.0 else radius), 0.0)
    coarse = COARSE // 2 << level.k
    parts = [(before, before / coarse), (total - before - after, size), (after, after / coarse)]
    bodies = {n: m for n, m in ((0, light), (-1, heavy)) if m > 0.0}
    tension = gravity * max(light + mass * left, heavy + mass * right)
    rope = [part for part in parts if part[0] > 1e-6]
    rig = laid(rope, mass, ea, radius, tension, MOVING, held={0: "r"}, gravity=gravity, bodies=bodies)
    settle_moving(rig, bend, first, mass, bodies)
    rig.hold({})
    rig.balance()
    step = level.step(2e-3)
    period = 2.0 * pi * sqrt(total / ea / (1.0 / (light + 0.5 * mass * total) + 1.0 / (heavy + 0.5 * mass * total)))
    node = -1 if side > 0.0 else 0
    start = rig.state.q[node, 2]
    walk = Walk(rig)

    def look(_: float) -> tuple[float, ...]:
        return (
            start - rig.state.q[node, 2],
            -rig.state.v[node, 2],
            rig.tension_at(level_of(rig, side)),
            rig.tension_at(level_of(rig, -side)),
            contact_points(rig).resultant[2],
        )

    seen = {}
    for t in times:
        half = 0.5 * max(period, step)
        if walk.time < t - half:
            walk.to(t - half, step)
        begin = look(walk.time)
        table = np.array([begin, *walk.to(t + half, min(step, 0.25 * half), look)])
        seen[t] = (table[1:-1].sum(0) + 0.5 * (table[0] + table[-1])) / (len(table) - 1)
    column = {
        "travel": 0,
        "speed": 1,
        "tension at heavy-side tangent": 2,
        "tension at light-side tangent": 3,
        "vertical contact force": 4,
    }
    of = {name: float(seen[float(m[2])][column[m[1]]]) for name, m in asked}
    return Values(of, rig.nodes - 1, step, walk.note(step))


@family(
    "lift-off",
    "radius_to_centreline_m rope_mass_per_length_kg_m free_length_below_tangent_m pull_acceleration_m_s2 wrap_deg",
    how="no bending stiffness; settled under the inertia of the first instant, the pulled end moved along its "
    "straight part; lift-off: the first line load round the pulley that a parabola in time takes to zero",
)
def lift_off(case: Case, level: Level) -> Values:
    """When and where a rope pulled over a pulley leaves it."""
    radius, mass = case.numbers("radius_to_centreline_m rope_mass_per_length_kg_m")
    gravity = case.gravity
    free, pull = case.numbers("free_length_below_tangent_m pull_acceleration_m_s2")
    wrap = radians(case.number("wrap_deg"))
    bend = Bend(radius, -0.5 * pi, wrap - 0.5 * pi, free)
    size, tail = (0.5 if level.realtime else 2.0) * FINE * radius / level.mesh(1), 2.0 * radius
    tension = mass * free * (gravity + pull)
    rope, loads = [(free + bend.contact + tail, size)], pulls((0, (0.0, 0.0, 0.0)))
    rig = laid(rope, mass, tension / STRETCH, radius, tension, MOVING, held={-1: "r"}, gravity=gravity, loads=loads)
    settle_moving(rig, bend, pull, mass, {})
    end, along = rig.state.q[-1, :3].copy(), bend.nodes(rig.arc)[1][-1]
    rig.state.a[-1, :3] = pull * along
    rig.balance()

    def motion(t: np.ndarray) -> np.ndarray:
        ramps = (end + 0.5 * pull * t[:, None] ** 2 * along, pull * t[:, None] * along, 0.0 * t[:, None] + pull * along)
        return np.concatenate(ramps, 1)[:, None, :]

    last = sqrt(2.0 * free / pull)
    # longer real-time steps, or elements twice as long, lift off up to 16 % early: the line loads swing
    step = 5e-4 * last if level.realtime else level.step(2e-3 * last)
    every = max(int(last / LOOKS / step), 1)
    places = np.linspace(0.0, wrap, max(int(round(wrap / radians(10.0))), 2) + 1)
    seen: list[tuple[float, list[float], float, float]] = []
    walk = Walk(rig, moved=(-1,), motion=motion)
    notes = [f"in steps of {step:.2g} s"] if level.realtime else []
    while walk.time < 0.95 * last:
        try:
            for _ in range(every):
                walk.step(step)
        except RigError as error:
            notes.append(f"stopped at {walk.time:.3g} s: {error}")
            break
        table = contact_points(rig)
        now = []
        for place in places - 0.5 * pi:
            low, high = max(place - 0.3, 0.1 - 0.5 * pi), min(place + 0.3, wrap - 0.5 * pi - 0.1)
            now.append(
                table.fit(
                    low - max(0.6 - high + low, 0.0) * (high < place + 0.29),
                    high + max(0.6 - high + low, 0.0) * (low > place - 0.29),
                    place,
                )
            )
        seen.append((walk.time, now, float(np.linalg.norm(rig.state.v[0, :3])), level_of(rig, -1.0)))
        if np.mean([loads for _, loads, *_ in seen[-CALM:]], 0).min() < 0.0:
            break
    notes += walk.note(step)
    of = _first_zero(seen, places, step)
    if of is None:
        notes.append("no line load came to zero")
    return Values(of or {}, rig.nodes - 1, step, notes)


def _first_zero(seen: list[tuple], places: np.ndarray, step: float) -> dict[str, float] | None:
    """Values of a lift-off from time, line loads by place, speed and free length; None: no load came to zero."""
    if not seen:
        return None
    times, loads, speeds, lengths = map(np.array, zip(*seen))
    found = []
    calm = np.ones(CALM) / CALM
    for i, place in enumerate(places):
        fraction = np.convolve(np.pad(loads[:, i] / loads[0, i], CALM // 2, mode="edge"), calm, "valid")
        below = np.flatnonzero(fraction < 0.1)
        stop = below[0] if len(below) else len(times)
        use = np.arange(stop)[(fraction[:stop] < 0.8)]
        if len(use) < 3 or not len(below):
            continue
        fit = np.polyfit(times[use], fraction[use], 2)
        roots = [r.real for r in np.roots(fit) if abs(r.imag) < 1e-9 and r.real > times[use[-1]] - 2.0 * step]
        if roots:
            found.append((min(roots), place))
    if not found:
        return None
    when, where = min(found)

    def then(series: np.ndarray) -> float:
        ahead = max(when - times[-1], 0.0)
        return np.interp(when, times, series) + ahead * (series[-1] - series[-2]) / (times[-1] - times[-2])

    report = {
        "lift-off time": when,
        "speed at lift-off": then(speeds),
        "free length left at lift-off": then(lengths),
        "angular position of first lift-off from the free-side tangent": np.degrees(where),
    }
    return {name: float(value) for name, value in report.items()}


@family(
    "wrapping pendulum",
    "rope_length_from_top_of_pulley_m radius_to_centreline_m mass_kg initial_angle_from_vertical_deg",
    how="held along itself on top of the pulley, no bending stiffness; a positive angle is outward, away from the "
    "pulley, so that wrap = 90 deg - angle; settled with the mass pulled along the rope only, then released; "
    "forces filtered above 10 times the swing",
)
def wrapping(case: Case, level: Level) -> Values:
    """Extremes, period and forces of a mass that swings on a rope which wraps on and off."""
    radius, length = case.number("radius_to_centreline_m"), case.number("rope_length_from_top_of_pulley_m")
    mass, gravity = case.number("mass_kg"), case.gravity
    start = radians(case.number("initial_angle_from_vertical_deg"))
    linear = case.number("rope_mass_per_length_kg_m", 1e-3 * mass / length)
    wrap = 0.5 * pi - start
    maximum = min(0.5 * pi + 1.3 * abs(start) + 0.3, 2.0 * pi)
    fine = min(radius * maximum + radius, 0.9 * length)
    size = FINE * radius / level.mesh(1)
    weight, rope = mass * gravity, [(fine, size), (length - fine, 4.0 * size)]
    ea = case.number("EA_N", weight / STRETCH)
    # held along the rope; across it the pulley bears it
    rig = laid(rope, linear, ea, radius, weight, MOVING, held={0: "xy"}, gravity=gravity, bodies={-1: mass})
    bend = Bend(radius, 0.0, wrap, 0.0)
    rig.place(*bend.nodes(rig.arc))
    along = np.array((sin(start), 0.0, -cos(start)))
    rig.load(-1, weight * cos(start) * along + np.array((0.0, 0.0, weight)))
    rig.settle()
    rig.release_loads()
    rig.balance()
    step = level.step(2e-3)
    walk, first = Walk(rig), int(np.searchsorted(rig.arc, fine))
    swing = 2.0 * pi * sqrt(length / gravity)  # only to know when to give up, and the steps between two looks

    def look(now: float) -> tuple[float, ...]:
        chord = rig.state.q[-1, :3] - rig.state.q[first, :3]
        return (
            now,
            float(np.arctan2(chord[0], -chord[2])),
            float(rig.state.tension[first:].mean()),
            float(np.linalg.norm(contact_points(rig).resultant)),
        )

    seen = [look(0.0)]
    period = None
    while period is None and walk.time < 4.0 * swing:
        seen += walk.to(walk.time + 0.1 * swing, step, look)
        table = np.array(seen)
        period = full_swing(table[:, 0], table[:, 1])
    if period is None:
        return Values({}, rig.nodes - 1, step, ["the mass did not come back", *walk.note(step)])
    table = np.array(seen)
    t, angle = table[:, 0], np.degrees(table[:, 1])
    low_pass = butter(4, 10.0 / period, output="sos", fs=1.0 / float(np.median(np.diff(t))))
    tension, contact = (sosfiltfilt(low_pass, table[:, k], padlen=len(t) // 4) for k in (2, 3))
    once = t <= period
    other = extreme(t[once], angle[once], -1.0 if start >= 0.0 else 1.0)
    report = {
        "full period": period,
        "other extreme angle from vertical": other,
        "smallest wrap": 90.0 - angle[once].max(),
        "largest wrap": 90.0 - extreme(t[once], angle[once], -1.0),
        "largest tension": tension[once].max(),
        "smallest tension": tension[once].min(),
    }
    of = {name: float(value) for name, value in report.items()}
    series = {"wrap": 90.0 - angle, "tension": tension, "total contact force": contact, "angle from vertical": angle}
    for name, m in case.asked(r"(wrap|tension|total contact force|angle from vertical) at ([\d.eE+-]+) period"):
        of[name] = float(np.interp(float(m[2]) * period, t, series[m[1]]))
    return Values(of, rig.nodes - 1, step, walk.note(step))


def full_swing(t: np.ndarray, angle: np.ndarray) -> float | None:
    """Time [s] of the second turn, back on the side of the start, once a tenth more has been seen; parabola."""
    if len(t) < 8:
        return None
    sign = 1.0 if angle[0] >= 0.0 else -1.0
    low = int(np.argmin(sign * angle))
    high = low + int(np.argmax(sign * angle[low:]))
    if low == 0 or t[-1] < 1.08 * t[high] or high <= low:
        return None
    near = np.abs(t - t[high]) <= max(0.03 * t[high], 2.5 * (t[1] - t[0]))
    fit = np.polyfit(t[near] - t[high], angle[near], 2)
    return float(t[high] - 0.5 * fit[1] / fit[0])


def extreme(t: np.ndarray, x: np.ndarray, sign: float) -> float:
    """Extreme of a smooth series by the parabola through the samples about it; sign 1: the largest, -1: the least."""
    i = int(np.argmax(sign * x))
    if not 0 < i < len(t) - 1:
        return float(x[i])
    fit = np.polyfit(t[i - 1 : i + 2] - t[i], x[i - 1 : i + 2], 2)
    return float(np.polyval(fit, -0.5 * fit[1] / fit[0]))
