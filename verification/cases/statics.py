"""Lines at rest: elastic catenary, cantilever elasticas, a very long cable hanging straight."""

from __future__ import annotations

from math import asinh, atanh, sinh

import numpy as np
from scipy.optimize import brentq

from cable_sim_ros.sim.rig.rig import Rig, load_of

from ..cables import uniform
from .family import Case, CaseError, Level, Values, family
from .measure import moment, nearest, numbers, point, stretched_length

INEXTENSIBLE = 1e7  # EA L^2 / EI of a cantilever meant to be inextensible; more only raises the round-off floor


def hanging_shape(arc: np.ndarray, span: float, rise: float) -> tuple[np.ndarray, np.ndarray]:
    """A start for settle(): inextensible catenary of length arc[-1] from the origin to (span, 0, rise), or the
    straight line where the length does not reach. Returns positions and unit tangents [nodes, 3]."""
    length, chord = arc[-1], float(np.hypot(span, rise))
    s = arc / length
    if length <= 1.00001 * chord:
        end = np.array((span, 0.0, rise))
        return s[:, None] * end, np.tile(end / length, (len(arc), 1))
    wide = max(abs(span), 1e-2 * length)  # ends above each other: a slim loop
    want = np.sqrt(length**2 - rise**2) / wide
    high = 1.0
    while sinh(high) / high < want:
        high *= 2.0
    half = brentq(lambda x: sinh(x) / x - want, 1e-6, high, xtol=1e-15)
    a = 0.5 * wide / half
    u0 = sinh(atanh(rise / length) - half)  # slope at the origin; it grows with arc length over a
    u = u0 + arc / a
    # not by numpy, whose last bit is the processor's: a chain that whips makes 4 % of its speed of it
    x = a * (np.array([asinh(float(k)) for k in u]) - asinh(u0)) * span / wide
    z = a * (np.sqrt(1.0 + u * u) - np.sqrt(1.0 + u0 * u0))
    tangent = np.stack((np.full_like(u, np.copysign(1.0, span)), 0.0 * u, u), 1) / np.sqrt(1.0 + u * u)[:, None]
    return np.stack((x, 0.0 * x, z), 1), tangent


@family(
    "elastic catenary",
    "span_x_m rise_z_m unstretched_length_m weight_per_length_N_m EA_N",
    how="both ends held, no bending stiffness, settled from an inextensible catenary; tensions at the ends are the "
    "reactions of the held nodes",
)
def catenary(case: Case, level: Level) -> Values:
    """Tensions, length and points of a cable between two held ends."""
    length, n = case.number("unstretched_length_m"), level.mesh(16)
    span, rise, weight = case.numbers("span_x_m rise_z_m weight_per_length_N_m")
    gravity = case.gravity
    cable = uniform(length, n, weight / gravity, case.number("EA_N"), bending_stiffness=case.number("EI_N_m2", 0.0))
    rig = Rig(cable, held={0: "r", n: "r"}, tension=weight * length, gravity=gravity)
    rig.place(*hanging_shape(rig.arc, span, rise))
    rig.state.q[-1, :3] = (span, 0.0, rise)
    rig.settle()
    first, last = rig.state.reaction[0, :3], rig.state.reaction[-1, :3]
    of = {
        "H horizontal tension": float(np.hypot(first[0], first[1])),
        "T at end A (origin)": float(np.linalg.norm(first)),
        "T at end B": float(np.linalg.norm(last)),
        "stretched length": stretched_length(rig),
    }
    for name, m in case.asked(r"([xyz]) at s=([\d.eE+-]+) L0"):
        of[name] = float(point(rig, float(m[2]) * length)["xyz".index(m[1])])
    return Values(of, n, 0.0)


def clamped(case: Case, n: int, mass: float, tension: float, **more) -> Rig:
    """A rod clamped level along +x, all but inextensible where no EA is given; mass [kg/m]; more: of Rig."""
    length, ei = case.numbers("length_m EI_N_m2")
    ea = case.number("EA_N", INEXTENSIBLE * ei / length**2)
    cable = uniform(length, n, mass, ea, bending_stiffness=ei, compression_share=1.0)
    rig = Rig(cable, held={0: "rg"}, tension=tension, **more)
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    return rig


def cantilever(case: Case, n: int, tension: float) -> Rig:
    """A weightless one, its tip to be loaded."""
    mass = case.number("EI_N_m2") / case.number("length_m") ** 4
    return clamped(case, n, mass, tension, gravity=0.0, loads=[load_of(n)])


def no_gravity(case: Case) -> None:
    """Raise CaseError where a weightless family is given gravity."""
    for key in ("gravity", "g"):
        if case.number(key, 0.0) != 0.0:
            raise CaseError(
                f"{case.path}: inputs.{key} is not zero, but this family gives no mass; the case was not run"
            )


@family(
    "cantilever under tip force",
    "length_m EI_N_m2 tip_force_N",
    how=f"clamped along +x, dead force along +z at the tip, EA = {INEXTENSIBLE:g} EI/L^2 where none is given; the "
    "loads one after another",
)
def tip_force(case: Case, level: Level) -> Values:
    """Deflection, abscissa and slope of the tip at every load asked for."""
    no_gravity(case)
    given, n = numbers(case.inputs["tip_force_N"]), level.mesh(10)
    asked = {
        name: (m[1], nearest(float(m[2]), given))
        for name, m in case.asked(r"(deflection|tip abscissa|tip slope)(?:, P=([-\d.eE+]+) N)?")
        if m[2]
    }
    rig = cantilever(case, n, max(map(abs, given), default=1.0))
    of = {}
    for force in sorted({p for _, p in asked.values()}):
        rig.model.loads["force"][0, 2] = force
        rig.settle()
        tip = rig.state.q[-1]
        found = {"deflection": tip[2], "tip abscissa": tip[0], "tip slope": np.arctan2(tip[5], tip[3])}
        of.update({name: float(found[what]) for name, (what, p) in asked.items() if p == force})
    return Values(of, n, 0.0)


@family(
    "cantilever under tip moment",
    "length_m EI_N_m2 tip_moment_N_m",
    how="clamped along +x, moment on the tip's tangent that turns it from +x to +z, raised by at most an eighth of "
    f"a turn at a time; EA = {INEXTENSIBLE:g} EI/L^2 where none is given",
)
def tip_moment(case: Case, level: Level) -> Values:
    """Tip of the rolled-up cantilever at every moment asked for."""
    no_gravity(case)
    given, n = numbers(case.inputs["tip_moment_N_m"]), level.mesh(20)
    length, ei = case.number("length_m"), case.number("EI_N_m2")
    asked = {
        name: ("xyz".index(m[1]), nearest(float(m[2]), given))
        for name, m in case.asked(r"tip ([xyz]), M=([-\d.eE+]+) N m.*")
    }
    rig = cantilever(case, n, ei / length**2)
    of, now, maximum = {}, 0.0, 0.25 * np.pi * ei / length
    for m in sorted({m for _, m in asked.values()}, key=abs):
        steps = max(int(np.ceil(abs(m - now) / maximum - 1e-9)), 1)
        for part in np.linspace(now, m, steps + 1)[1:]:
            rig.model.loads["moment"][0, 1] = -part
            rig.settle()
        now = m
        of.update({name: float(rig.state.q[-1, k]) for name, (k, p) in asked.items() if p == m})
    return Values(of, n, 0.0)


@family(
    "clamped line with tip mass",
    "length_m EI_N_m2 tip_mass_kg mass_per_length_kg_m",
    how=f"clamped level along +x, the line's own weight counted, EA = {INEXTENSIBLE:g} EI/L^2 where none is given; "
    "the moment is what holds the clamped tangent",
)
def flume_line(case: Case, level: Level) -> Values:
    """Tip and clamp moment of a line that bends under the mass at its end."""
    n, mass, gravity = level.mesh(10), case.number("tip_mass_kg"), case.gravity
    line_mass = case.number("mass_per_length_kg_m")
    tension = (mass + line_mass * case.number("length_m")) * gravity
    rig = clamped(case, n, line_mass, tension, gravity=gravity, bodies={n: mass})
    rig.settle()
    tip = rig.state.q[-1]
    of = {
        "tip x": float(tip[0]),
        "tip drop": float(-tip[2]),
        "tip slope below level": float(np.arctan2(-tip[5], tip[3])),
        "clamp moment": float(np.linalg.norm(moment(rig, 0))),
    }
    return Values(of, n, 0.0)


@family(
    "vertical cable",
    "length_m wet_weight_N_m body_wet_weight_N EA_N",
    how="hung straight from a held node, weight in water as dead weight, the body's as a dead force",
)
def vertical(case: Case, level: Level) -> Values:
    """Tensions and elongation of a cable that hangs straight."""
    length, n = case.number("length_m"), level.mesh(16)
    weight, body, gravity = case.number("wet_weight_N_m"), case.number("body_wet_weight_N"), case.gravity
    cable = uniform(length, n, weight / gravity, case.number("EA_N"))
    rig = Rig(
        cable, held={0: "r"}, tension=weight * length + body, gravity=gravity, loads=[load_of(n, (0.0, 0.0, -body))]
    )
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    of = {
        "top tension": float(np.linalg.norm(rig.state.reaction[0, :3])),
        "elongation": float(-rig.state.q[-1, 2] - length),
        "tension at mid length": rig.tension_at(0.5 * length),
    }
    return Values(of, n, 0.0)
