"""Static families: catenaries, elastica, a long vertical cable."""

from __future__ import annotations

import numpy as np

from ..rig import Rig, cable_of
from .family import Case, CaseError, Level, Values, family
from .measure import inextensible, point, stretched_length

TURN = np.radians(15.0)     # of the tip, at most, between two static solutions of a roll-up


def load_named(case: Case, pattern: str, key: str) -> list[tuple[str, str, float]]:
    """(output name, quantity, load) of outputs named after a load of the list inputs[key]; the nearest one is meant."""
    given = case.inputs[key]
    if not isinstance(given, list) or not given or not all(isinstance(x, (int, float)) for x in given):
        raise CaseError(f"{case.path}: inputs.{key} = {given!r} is no list of numbers; the case was not run")
    return [(name, m[1], min(given, key=lambda x, m=m: abs(x - float(m[2])))) for name, m in case.asked(pattern)]


@family("elastic catenary", "span_x_m", "rise_z_m", "unstretched_length_m", "weight_per_length_N_m", "EA_N",
        how="both ends held, gradients free, EI = 0; static start of the product", growth=2.0)
def catenary(case: Case, level: Level) -> Values:
    """H, end tensions, stretched length and positions."""
    span, rise = case.number("span_x_m"), case.number("rise_z_m")
    length, weight, g = case.number("unstretched_length_m"), case.number("weight_per_length_N_m"), 9.81
    n = level.mesh(16)
    rig = Rig(cable_of([{"length": length, "elements": n}], mass_per_length=weight / g,
                       axial_stiffness=case.number("EA_N")),
              held={0: "r", -1: "r"}, tension=weight * length, gravity=g)
    s = rig.arc / length
    sag = 0.75 * np.sqrt(max(length**2 - span**2 - rise**2, 1e-4 * length**2) / 3.0)
    rig.place(np.column_stack((span * s, 0 * s, rise * s - 4.0 * sag * s * (1.0 - s))),
              np.column_stack((span + 0 * s, 0 * s, rise - 4.0 * sag * (1.0 - 2.0 * s))) / length)
    rig.settle()
    force = rig.line.reaction[[0, -1], :3]
    of = {"H horizontal tension": abs(force[0, 0]), "T at end A (origin)": np.linalg.norm(force[0]),
          "T at end B": np.linalg.norm(force[1]), "stretched length": stretched_length(rig)}
    for name, m in case.asked(r"([xz]) at s=([\d.]+) L0"):
        of[name] = point(rig, float(m[2]) * length)["xz".index(m[1]) * 2]
    return Values({k: float(v) for k, v in of.items()}, n, 0.0)


def _cantilever(case: Case, level: Level, tension: float, coarsest: int = 8, **more) -> tuple[Rig, int]:
    """Clamped at the origin along +x; mass only where the case gives one (else 1 kg/m that never moves)."""
    length, ei, n = case.number("length_m"), case.number("EI_N_m2"), level.mesh(coarsest)
    rig = Rig(cable_of([{"length": length, "elements": n}], mass_per_length=case.number("mass_per_length_kg_m", 1.0),
                       axial_stiffness=max(inextensible(tension, ei, length), 1.0), bending_stiffness=ei,
                       compression_share=1.0),
              held={0: "rg"}, tension=tension, **more)
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    return rig, n


@family("elastica, tip force", "length_m", "EI_N_m2", "tip_force_N",
        how="clamped along +x, dead tip force along -z in rising order, EA L^2/EI = 1e8", growth=2.0)
def tip_force(case: Case, level: Level) -> Values:
    """Deflection, abscissa and slope of the tip for each force."""
    asked = load_named(case, r"(deflection|tip abscissa|tip slope), P=([\d.eE+-]+) N", "tip_force_N")
    rig, n = _cantilever(case, level, max(map(abs, case.inputs["tip_force_N"])), gravity=0.0,
                         loads=[(0.0,) * 7])
    line, of = rig.line, {}
    line.loads[0, 0] = n
    for load in sorted({p for _, _, p in asked}, key=abs):
        line.loads[0, 3] = -load
        rig.settle()
        tip = line.q[-1]
        told = {"deflection": -tip[2], "tip abscissa": tip[0], "tip slope": np.arctan2(-tip[5], tip[3])}
        of.update({name: float(told[what]) for name, what, p in asked if p == load})
    return Values(of, n, 0.0)


@family("elastica, tip moment", "length_m", "EI_N_m2", "tip_moment_N_m",
        how="clamped along +x, moment on the tip's tangent raised in steps of 15 degrees of tip rotation", growth=2.0)
def tip_moment(case: Case, level: Level) -> Values:
    """Tip of a cantilever rolled up by an end moment towards +z."""
    asked = load_named(case, r"tip ([xz]), M=([\d.eE+-]+) N m.*", "tip_moment_N_m")
    length, ei = case.number("length_m"), case.number("EI_N_m2")
    most = max(map(abs, case.inputs["tip_moment_N_m"]))
    rig, n = _cantilever(case, level, most / length, coarsest=16, gravity=0.0, loads=[(0.0,) * 7])
    line, of, now = rig.line, {}, 0.0
    line.loads[0, 0] = n
    for load in sorted({m for _, _, m in asked}, key=abs):
        for part in np.linspace(now, load, 1 + int(np.ceil(abs(load - now) * length / ei / TURN)))[1:]:
            line.loads[0, 5] = -part     # about -y: turns +x towards +z
            rig.settle()
        now = load
        of.update({name: float(line.q[-1, "xz".index(axis) * 2]) for name, axis, m in asked if m == load})
    return Values(of, n, 0.0)


@family("elastica, tip mass", "length_m", "EI_N_m2", "tip_mass_kg", "mass_per_length_kg_m",
        how="clamped level, in air, point mass at the tip, EA 1e6 times the weight", growth=2.0)
def tip_mass(case: Case, level: Level) -> Values:
    """Tip and clamp moment of a heavy line clamped level."""
    g, mass = case.number("g", 9.81), case.number("tip_mass_kg")
    weight = g * (mass + case.number("mass_per_length_kg_m") * case.number("length_m"))
    rig, n = _cantilever(case, level, weight, coarsest=16, gravity=g, bodies={-1: mass})
    rig.settle()
    tip, clamp = rig.line.q[-1], rig.line.reaction[0]
    moment = np.cross(rig.line.q[0, 3:], clamp[3:]) + np.cross(rig.line.q[0, :3], clamp[:3])
    return Values({"tip x": float(tip[0]), "tip drop": float(-tip[2]),
                   "tip slope below level": float(np.arctan2(-tip[5], tip[3])),
                   "clamp moment": float(np.linalg.norm(moment))}, n, 0.0)


@family("vertical cable", "length_m", "wet_weight_N_m", "body_wet_weight_N", "EA_N",
        how="hung from its upper end, weights as told, static start of the product", growth=2.0)
def vertical(case: Case, level: Level) -> Values:
    """Top and middle tension and elongation of a vertical cable."""
    length, weight, body = (case.number(k) for k in ("length_m", "wet_weight_N_m", "body_wet_weight_N"))
    n, g = level.mesh(8), 9.81
    rig = Rig(cable_of([{"length": length, "elements": n}], mass_per_length=weight / g,
                       axial_stiffness=case.number("EA_N")), held={0: "r"}, tension=weight * length + body, gravity=g,
              bodies={-1: body / g})
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    return Values({"top tension": float(rig.line.reaction[0, 2]), "elongation": float(-rig.line.q[-1, 2] - length),
                   "tension at mid length": rig.tension_at(0.5 * length)}, n, 0.0)
