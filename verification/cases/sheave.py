"""Cables over a fixed sheave without friction: at rest, stiff, heavy, running."""

from __future__ import annotations

from math import pi, radians, sqrt

import numpy as np

from cable_sim_ros.sim.rig.rig import Rig, cable_of

from ..bend import MOVING, PENETRATION, Bend, Walk, drum, far_pulls, harden, laid, pieces
from ..contact_points import ContactPoints, contact_points
from .family import Case, Level, Values, family

FINE = 0.1  # element at the sheave over its radius on the coarsest mesh: the shipped mesh is at 0.4
MASS = 0.389  # kg/m where a case at rest gives none: it only carries the way to rest
STRETCH = 1e-5  # of an inextensible cable at its working tension
TRACE = 1e-6  # penetration over radius where the ends of the contact are looked for
FINEST = 48  # elements over the bending length; more only meets the round-off of EA


def symmetric(
    tension: float, radius: float, wrap: float, leg: float, size: float, surface: np.ndarray, fine: float, **numbers
) -> Rig:
    """Weightless cable over the top of a sheave, both ends pulled; elements of ``size`` to ``fine`` [m] beyond.

    numbers: of the cable, where it is not to be limp and all but inextensible.
    """
    bend = Bend(radius, -0.5 * wrap, 0.5 * wrap, leg)
    parts = [(2.0 * fine + bend.contact, size)]
    if leg > fine:
        parts = [(leg - fine, 4.0 * size), *parts, (leg - fine, 4.0 * size)]
    cable = cable_of(pieces(*parts), **{"mass_per_length": MASS, "axial_stiffness": tension / STRETCH} | numbers)
    loads = far_pulls(bend, 2.0 * leg + bend.contact, tension)
    rig = Rig(cable, held={}, tension=tension, gravity=0.0, surfaces=[surface], loads=loads)
    rig.place(*bend.nodes(rig.arc))
    return rig


@family(
    "static wrap",
    "tension_N wraps_deg sheave_root_radius_m cable_diameter_m",
    how="no bending stiffness, both ends pulled by dead forces along the far lines, nothing held; contact "
    "stiffness of the case; a cylinder, and a groove for the load of a flank",
)
def static_wrap(case: Case, level: Level) -> Values:
    """Resultants for each wrap, line load and penetration in the middle of the widest, load of a groove's flank."""
    tension = case.number("tension_N")
    radius = case.number("sheave_root_radius_m") + 0.5 * case.number("cable_diameter_m")
    size = radius * FINE / level.mesh(1)
    totals = {float(m[1]): name for name, m in case.asked(r"total contact force, wrap ([-+\d.eE]+) deg")}
    widest = max([*totals, *(float(w) for w in case.inputs["wraps_deg"])])
    of, elements = {}, 0
    groove = [o.name for o in case.outputs if "each flank" in o.name]

    def solved(wrap: float, half: float | None) -> ContactPoints:
        nonlocal elements
        surface = drum(radius, tension, half_angle=half, depth=radius)
        if "contact_stiffness_kN" in case.inputs:
            surface["stiffness"] = case.number("contact_stiffness_kN")
        rig = symmetric(tension, radius, radians(wrap), 2.0 * radius, size, surface, 2.0 * radius)
        elements = rig.nodes - 1
        rig.settle()
        return contact_points(rig)

    if case.number("exponent", 1.5) != 1.5:
        return Values({}, 0, 0.0, ["the product's contact law has the exponent 1.5 only"])
    for wrap, name in totals.items():
        of[name] = float(np.linalg.norm(solved(wrap, None).resultant))
    middle = 0.25 * radians(widest)
    table = solved(widest, None)
    deep = -table.mean(-middle, middle, table.gap)
    of |= case.beginning({"contact line load": table.mean(-middle, middle), "penetration": deep})
    if groove and "groove_half_angle_deg" in case.inputs:
        table = solved(widest, radians(case.number("groove_half_angle_deg")))
        for name in groove:
            of[name] = table.mean(-middle, middle, table.flanks.mean(1))
    return Values(of, elements, 0.0)


@family(
    "bending boundary",
    "far_tension_N EI_N_m2 radius_to_centreline_m angle_between_far_lines_deg",
    how="no weight, both ends pulled by dead forces along the far lines 25 sqrt(EI/T) from the sheave; penalty of "
    "1e-6 radius; ends of the contact: the rigid load with the force and moment of the computed one over "
    "3 sqrt(EI/T)",
    growth=3.0,
)
def bending_boundary(case: Case, level: Level) -> Values:
    """Ends of the contact of a stiff cable, load inside, resultant."""
    tension, radius = case.number("far_tension_N"), case.number("radius_to_centreline_m")
    stiff, wrap = case.number("EI_N_m2"), radians(case.number("angle_between_far_lines_deg"))
    scale = sqrt(stiff / tension)
    size = min(scale / min(level.mesh(2), FINEST), FINE * radius)
    surface = drum(radius, tension, penetration=TRACE)
    rig = symmetric(tension, radius, wrap, 25.0 * scale, size, surface, 6.0 * scale, bending_stiffness=stiff)
    harden(rig, tension, (1e-4, 1e-5, TRACE))
    table = contact_points(rig)
    report, notes = table.boundary(wrap, 3.0 * scale), []
    of = case.beginning(
        {
            "angle by which contact stops short": report["lost"],
            "concentrated reaction": report["end"],
            "line load inside": report["inside"],
            "total contact force": float(np.linalg.norm(table.resultant)),
        }
    )
    if report["gap"] is not None:
        notes.append(f"the gap of the penalty closes {report['gap']:.3g} deg short of the geometric tangent")
    if report["end"] is None:
        notes.append(
            "the contact has no stretch of constant load between two end reactions: too little wrap, or too "
            "coarse a mesh for sqrt(EI/T)"
        )
    return Values(of, rig.nodes - 1, 0.0, notes)


@family(
    "heavy rope at rest",
    "hanging_left_m hanging_right_m end_mass_right_kg radius_to_centreline_m",
    how="no bending stiffness, half wrap; the end of the lighter side is held, its force is the answer",
    growth=3.0,
)
def heavy_static(case: Case, level: Level) -> Values:
    """Tensions and line loads of a heavy rope over a sheave, both sides hanging."""
    radius, gravity, mass = case.number("radius_to_centreline_m"), case.gravity, case.number("mass_per_length_kg_m")
    left, right = case.number("hanging_left_m"), case.number("hanging_right_m")
    size = FINE * radius / level.mesh(1)
    bend = Bend(radius, -0.5 * pi, 0.5 * pi, left)
    near = min(radius, left, right)
    parts = [(left - near, 8.0 * size), (2.0 * near + bend.contact, size), (right - near, 8.0 * size)]
    heavy = gravity * max(
        mass * left + case.number("end_mass_left_kg", 0.0), mass * right + case.number("end_mass_right_kg")
    )
    ends = {0: case.number("end_mass_left_kg", 0.0), -1: case.number("end_mass_right_kg")}
    light = 0 if mass * left + ends[0] < mass * right + ends[-1] else -1  # held there the rope stays taut
    rope, bodies = [part for part in parts if part[0] > 0.0], {n: m for n, m in ends.items() if m > 0.0}
    how = {"held": {light: "r"}, "gravity": gravity, "bodies": bodies}
    rig = laid(rope, mass, heavy / STRETCH, radius, heavy, PENETRATION, **how)
    rig.place(*bend.nodes(rig.arc))
    rig.settle()
    table = contact_points(rig)
    places = {"left tangent point": left, "top": left + 0.5 * bend.contact, "right tangent point": left + bend.contact}
    of = {f"tension at the {where}": rig.tension_at(s) for where, s in places.items()}
    # the load ends at the tangent points: there it is read off a parabola through the contact points inside of them
    of["line load at the top"] = table.fit(-0.25, 0.25, 0.0)
    of["line load at the tangent points"] = 0.5 * (
        table.fit(-0.5 * pi + 0.1, -0.5 * pi + 1.1, -0.5 * pi) + table.fit(0.5 * pi - 1.1, 0.5 * pi - 0.1, 0.5 * pi)
    )
    of["total vertical contact force"] = float(table.resultant[2])
    hold = -float(rig.state.reaction[light, 2])
    which = "left" if light == 0 else "right"
    note = f"the hand that holds the {which} end pulls down with {hold:.3g} N (0: the rope is balanced)"
    return Values(of, rig.nodes - 1, 0.0, [note])


@family(
    "running cable",
    "tension_N mass_per_length_kg_m radius_to_centreline_m speed_m_s wrap_deg",
    how="no weight, both ends pulled by dead forces; settled at rest, then given the speed along itself everywhere;"
    " lift-off: the speed squared to which the resultants of several runs extrapolate as zero",
)
def running(case: Case, level: Level) -> Values:
    """Line load and resultant of a cable that runs over a sheave, and the speed that lifts it off."""
    tension, mass, radius = case.numbers("tension_N mass_per_length_kg_m radius_to_centreline_m")
    speed, wrap = case.number("speed_m_s"), radians(case.number("wrap_deg"))
    elements, step, notes = 0, 0.0, []
    size, way = 2.0 * FINE * radius / level.mesh(1), 1.5 * radius
    leg = way + 2.0 * radius
    bend = Bend(radius, -0.5 * wrap, 0.5 * wrap, leg)

    def run(v: float) -> tuple[float, float]:
        """Mean line load of the inner half and resultant over the last third of a way of 1.5 radii."""
        nonlocal elements, step
        surface = drum(radius, tension, penetration=MOVING)
        cable = {"mass_per_length": mass, "axial_stiffness": 0.1 * tension / STRETCH}
        rig = symmetric(tension, radius, wrap, leg, size, surface, leg, **cable)
        # at rest the whole tension presses, running only what is left of it: settled on a stiffer surface the cable
        # begins at its running depth
        surface = rig.state.surfaces[0]
        k = float(surface["stiffness"])
        surface["stiffness"] = k * tension / max(tension - mass * v * v, 0.02 * tension)
        rig.settle()
        surface["stiffness"] = k
        rig.state.v[:, :3], rig.state.v[:, 3:] = v * bend.nodes(rig.arc)[1], v * bend.turning(rig.arc)
        rig.balance()
        walk, elements = Walk(rig), rig.nodes - 1
        # in real time the way is sampled by 20 steps at least, whatever the shipped step
        h = min(level.step(0.05 * size / v), 0.05 * way / v)
        walk.to(way / 1.5 / v, h)
        seen = walk.to(way / v, h, lambda t: contact_points(rig))
        if v == speed:
            step = h
            notes.extend(walk.note(h))
        return (
            float(np.mean([t.mean(-0.25 * wrap, 0.25 * wrap) for t in seen])),
            float(np.linalg.norm(np.mean([t.resultant for t in seen], 0))),
        )

    load, total = run(speed)
    of = case.beginning({"contact line load": load, "total contact force": total})
    for name, _ in case.asked("lift-off speed.*"):
        _, rest = run(0.5 * speed)
        squares, forces = [0.25 * speed**2, speed**2], [rest, total]
        zero = line_to_zero(squares, forces)
        if squares[-1] < 0.4 * zero:  # a far way to go: once more from half way
            squares.append(0.5 * zero)
            forces.append(run(sqrt(squares[-1]))[1])
            zero = line_to_zero(squares, forces)
        of[name] = sqrt(zero) if zero > 0.0 else None
    return Values(of, elements, step, notes)


def line_to_zero(x: list[float], y: list[float]) -> float:
    """Where the straight line through the last two points comes to zero; 0 where it does not fall."""
    fall = y[-2] - y[-1]
    return x[-1] + y[-1] * (x[-1] - x[-2]) / fall if fall > 0.0 else 0.0
