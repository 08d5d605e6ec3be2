"""Waves along and across a cable: step force, winch stopped dead, pluck."""

from __future__ import annotations

import math

import numpy as np

from cable_sim_ros.sim.rig.rig import Rig, cable_of, load_of

from ..cables import uniform
from .family import Case, CaseError, Level, Values, family
from .measure import crossings, follow, mean_between, point

SAMPLES = 200  # least steps per transit L/c of a real-time run: a front cannot be timed with less
TAUT = 3.0  # static tension of a bar over its step force
FRONT = 1.0 / 32.0  # width of the start's front over the length: a jump of no width rings by a seventh of its height


def wave_step(level: Level, transit: float, coarsest: int) -> float:
    """Step [s]: verification transit / (coarsest 2^k); real time the shipped tick, or the even share of it that gives
    SAMPLES steps per transit, never below a twentieth."""
    if not level.realtime:
        return level.step(transit / coarsest)
    return level.tick / min(max(math.ceil(level.tick * SAMPLES / transit), 1), 20)


def bar(case: Case, n: int, tension: float, **extra) -> Rig:
    """A weightless cable along +x in air, held at the origin."""
    cable = uniform(case.number("length_m"), n, case.number("mass_per_length_kg_m"), case.number("EA_N"))
    rig = Rig(cable, held={0: "r"}, tension=tension, gravity=0.0, **extra)
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    return rig


def transit_time(case: Case) -> float:
    """L/c [s], the unit in which these cases give their instants; no value is made from it."""
    return case.number("length_m") * math.sqrt(case.number("mass_per_length_kg_m") / case.number("EA_N"))


@family(
    "bar under step force",
    "EA_N mass_per_length_kg_m length_m step_force_N",
    how=f"one end held, taut under {TAUT:g} times the force and that subtracted, for a cable cannot "
    "push; dead force on the other from t = 0, every step sampled; instants in the case's L/c; wave "
    "speed: two lengths over the time between rise and fall of the reaction; end velocity: mean over "
    "0.2..1.8 L/c",
)
def step_force(case: Case, level: Level) -> Values:
    """Fronts along a bar: speed, displacements, support reaction."""
    length, force, unit = case.number("length_m"), case.number("step_force_N"), transit_time(case)
    n = level.mesh(32)
    taut = TAUT * abs(force)
    rig = bar(case, n, taut, loads=[load_of(n, (taut, 0.0, 0.0))])
    rig.settle()
    end, still = float(rig.state.q[-1, 0]), -float(rig.state.reaction[0, 0])
    rig.model.loads["force"][0, 0] += force
    rig.balance()
    means = {
        name: (float(m[1]), float(m[2]))
        for name, m in case.asked(r"support reaction, mean over ([\d.]+)\.\.([\d.]+) L/c")
    }
    moments = {name: float(m[1] or 1.0) for name, m in case.asked(r"free-end displacement at t=([\d.]*)L/c.*")}
    last = max([3.3, *moments.values(), *(b for _, b in means.values())])
    step = wave_step(level, unit, 128)
    t, x, v, held = follow(
        rig,
        (last + 0.1) * unit,
        step,
        lambda run: [run.q[:, -1, 0], run.v[:, -1, 0], -run.reaction[:, 0, 0] - still],
        (end, 0.0, 0.0),
    )
    plateau = mean_between(t, held, 1.2 * unit, 2.8 * unit)
    arrival = crossings(t, held, 0.5 * plateau)
    of = {"free-end velocity before first reflection": mean_between(t, v, 0.2 * unit, 1.8 * unit)}
    if len(arrival):
        of["arrival time at the support (half-amplitude)"] = float(arrival[0])
    if len(arrival) > 1:
        of["wave speed"] = float(2.0 * length / (arrival[1] - arrival[0]))
    of.update({name: float(np.interp(at * unit, t, x) - end) for name, at in moments.items()})
    of.update({name: mean_between(t, held, a * unit, b * unit) for name, (a, b) in means.items()})
    return Values(of, n, step)


@family(
    "winch stopped dead",
    "EA_N mass_per_length_kg_m length_m end_mass_kg payout_speed_m_s",
    how="static under the constant force, then everything at the payout speed and the winch node held from t = 0, "
    f"the front {FRONT:g} L wide; every step sampled; dynamic tension = reaction less static one; immediate "
    "rise: mean over 0.1..0.5 L/c; end-mass speed positive along the payout",
)
def emergency_stop(case: Case, level: Level) -> Values:
    """Tension at a winch that stops dead while cable and end mass go on."""
    values = _emergency_stop(case, level, wave_step(level, transit_time(case), 128))
    if level.realtime and values.dt < level.tick:
        shipped = _emergency_stop(case, level, level.tick).of
        for name, value in shipped.items():
            if name.startswith("largest dynamic tension"):
                values.notes.append(
                    f"in steps of {values.dt:g} s; at {level.tick:g} s the front is smeared and "
                    f"'{name}' reads {value:.4g}"
                )
    return values


def _emergency_stop(case: Case, level: Level, step: float) -> Values:
    speed, unit, n = case.number("payout_speed_m_s"), transit_time(case), level.mesh(32)
    pull = case.number("constant_force_on_end_mass_N", 0.0)
    taut, loads = max(abs(pull), 1e-3 * case.number("EA_N")), [load_of(n, (pull, 0.0, 0.0))]
    rig = bar(case, n, taut, bodies={n: case.number("end_mass_kg")}, loads=loads)
    rig.settle()
    still = -float(rig.state.reaction[0, 0])
    turn = 0.5 * np.pi * np.minimum(rig.arc / (FRONT * rig.arc[-1]), 1.0)
    rig.state.v[:, 0] = speed * np.sin(turn)
    rig.state.v[:, 3] = speed * np.cos(turn) * np.gradient(turn, rig.arc)
    rig.balance()
    instants = {name: float(m[1]) for name, m in case.asked(r"dynamic tension at the winch at t=([\d.]+) L/c.*")}
    speeds = {name: float(m[1]) for name, m in case.asked(r"end-mass speed at t=([\d.]+) L/c.*")}
    tops = {
        name: (float(m[1]), float(m[2]))
        for name, m in case.asked(r"largest dynamic tension at the winch in ([\d.]+)\.\.([\d.]+) L/c.*")
    }
    last = max([1.0, *instants.values(), *speeds.values(), *(b for _, b in tops.values())])
    t, v, tension = follow(
        rig, (last + 0.05) * unit, step, lambda run: [run.v[:, -1, 0], -run.reaction[:, 0, 0] - still], (speed, 0.0)
    )
    of = {"immediate tension rise at the winch": mean_between(t, tension, 0.1 * unit, 0.5 * unit)}
    of.update({name: float(np.interp(at * unit, t, tension)) for name, at in instants.items()})
    of.update({name: float(np.interp(at * unit, t, v)) for name, at in speeds.items()})
    for name, (a, b) in tops.items():
        inside = np.flatnonzero((t >= a * unit) & (t <= b * unit))
        top = inside[np.argmax(tension[inside])]
        of[name], of["time of that maximum"] = float(tension[top]), float(t[top])
    return Values(of, n, step, [])


@family(
    "plucked string",
    "length_m mass_per_length_kg_m tension_N pluck_at_m pluck_height_m EA_N",
    how="stretched by the tension, held at both ends, the plucked node set at its height, settled and let go; "
    "period from the zero crossings of the middle, wave speed two lengths over it; instants in the case's P",
)
def pluck(case: Case, level: Level) -> Values:
    """Middle of a string let go from a triangle."""
    length, tension, ea = case.numbers("length_m tension_N EA_N")
    at, height, mass = case.numbers("pluck_at_m pluck_height_m mass_per_length_kg_m")
    if not 0.0 < at < length:
        raise CaseError(f"{case.path}: inputs.pluck_at_m = {at:g} lies outside the string; the case was not run")
    n = level.mesh(32)
    left = min(max(round(n * at / length), 1), n - 1)
    slack = 1.0 / (1.0 + tension / ea)  # unstretched over stretched length: the string is as long as the case says
    cable = cable_of(
        [{"length": at * slack, "elements": left}, {"length": (length - at) * slack, "elements": n - left}],
        mass_per_length=mass / slack,
        axial_stiffness=ea,
    )
    rig = Rig(cable, held={0: "r"}, tension=tension, gravity=0.0, loads=[load_of(n, (tension, 0.0, 0.0))])
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0 / slack)
    rig.settle()
    rig.hold({0: "r", left: "r", n: "r"})
    rig.state.q[left, 2] = height
    rig.settle()
    rig.hold({0: "r", n: "r"})
    rig.balance()
    middle = 0.5 * rig.arc[-1]
    start = point(rig, middle)[2]
    period = 2.0 * length * math.sqrt(mass / tension)  # only to place the instants asked for
    moments = {
        name: float(m[1] or 1.0) / float(m[2] or 1.0)
        for name, m in case.asked(r"midpoint displacement at t=([\d.]*)P(?:/([\d.]+))?")
    }
    step = wave_step(level, 0.5 * period, 64)
    t, z = follow(
        rig,
        max([3.0, *moments.values()]) * 1.05 * period,
        step,
        lambda run: [point(rig, middle, run.q)[:, 2]],
        (start,),
    )
    zeros = crossings(t, z, 0.0)
    of = {name: float(np.interp(fraction * period, t, z)) for name, fraction in moments.items()}
    if len(zeros) > 2:
        whole = (len(zeros) - 1) // 2 * 2
        of["period P"] = float(2.0 * (zeros[whole] - zeros[0]) / whole)
        of["wave speed"] = 2.0 * length / of["period P"]
    return Values(of, n, step)
