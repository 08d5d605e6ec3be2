"""Waves: step force on a bar, winch stopped dead, plucked string."""

from __future__ import annotations

import numpy as np

from ..rig import Rig, cable_of
from .family import Case, Level, Values, family
from .measure import crossings

PER_TRANSIT = 128       # steps while an axial wave runs along the cable, coarsest verification level


def mean_over(times: np.ndarray, values: np.ndarray, low: float, high: float) -> float:
    """Mean of samples with low <= t <= high; of none, the value between the samples."""
    inside = (times >= low - 1e-12) & (times <= high + 1e-12)
    return float(values[inside].mean()) if inside.any() else float(np.interp(0.5 * (low + high), times, values))


@family("bar, step force", "EA_N", "mass_per_length_kg_m", "length_m", "step_force_N",
        how="along x, no gravity, pinned at the origin, dead force on the free end from t = 0")
def bar(case: Case, level: Level) -> Values:
    """Free end and support of a bar under a step force; times in units of L/c, c = sqrt(EA/mu)."""
    ea, mass, length, force = (case.number(k) for k in ("EA_N", "mass_per_length_kg_m", "length_m", "step_force_N"))
    transit, n = length / np.sqrt(ea / mass), level.mesh(32)
    step = level.step(transit / PER_TRANSIT)
    rig = Rig(cable_of([{"length": length, "elements": n}], mass_per_length=mass, axial_stiffness=ea), held={0: "r"},
              tension=abs(force), gravity=0.0, loads=[(n, force, 0.0, 0.0, 0.0, 0.0, 0.0)])
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rig.balance()
    told = rig.run(4.5 * transit, step)
    t = told.time / transit
    moved, speed, pull = told.q[:, -1, 0] - length, told.v[:, -1, 0], -told.reaction[:, 0, 0]
    plateau = mean_over(t, pull, 1.2, 1.8)
    arrival = float(crossings(told.time, pull, 0.5 * plateau)[0])
    of = {"wave speed": length / arrival, "free-end velocity before first reflection": mean_over(t, speed, 0.5, 1.5),
          "arrival time at the support (half-amplitude)": arrival}
    for name, m in case.asked(r"free-end displacement at t=([\d.]*)\s?L/c.*"):
        of[name] = float(np.interp(float(m[1] or 1.0), t, moved))
    for name, m in case.asked(r"support reaction, mean over ([\d.]+)\.\.([\d.]+) L/c"):
        of[name] = mean_over(t, pull, float(m[1]), float(m[2]))
    return Values(of, n, told.time[0])


@family("winch stopped dead", "EA_N", "mass_per_length_kg_m", "length_m", "end_mass_kg", "payout_speed_m_s",
        "constant_force_on_end_mass_N",
        how="along x, no gravity, stretched by the constant force, all at pay-out speed, upper end at rest from t = 0")
def emergency_stop(case: Case, level: Level) -> Values:
    """Dynamic tension at the winch after a dead stop; times in units of L/c."""
    ea, mass, length, end, speed, force = (case.number(k) for k in (
        "EA_N", "mass_per_length_kg_m", "length_m", "end_mass_kg", "payout_speed_m_s", "constant_force_on_end_mass_N"))
    transit, n = length / np.sqrt(ea / mass), level.mesh(64) if not level.realtime else 32
    step = level.step(transit / PER_TRANSIT)
    rig = Rig(cable_of([{"length": length, "elements": n}], mass_per_length=mass, axial_stiffness=ea), held={0: "r"},
              tension=force, gravity=0.0, bodies={-1: end}, loads=[(n, force, 0.0, 0.0, 0.0, 0.0, 0.0)])
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0 + force / ea)
    rig.line.v[1:, 0] = speed
    rig.line.v[:, 3:] = 0.0
    rig.balance()
    told = rig.run(8.0 * transit, step)
    t, rise = told.time / transit, -told.reaction[:, 0, 0] - force
    top = int(np.argmax(rise))
    of = {"immediate tension rise at the winch": mean_over(t, rise, 0.2, 0.8)}
    for name, m in case.asked(r"dynamic tension at the winch at t=([\d.]+) L/c"):
        of[name] = float(np.interp(float(m[1]), t, rise))
    for name, m in case.asked(r"end-mass speed at t=([\d.]+) L/c"):
        of[name] = float(np.interp(float(m[1]), t, told.v[:, -1, 0]))
    for name, _ in case.asked(r"largest dynamic tension at the winch.*"):
        of[name] = float(rise[top])
    of["time of that maximum"] = float(told.time[top])
    return Values(of, n, told.time[0])


@family("plucked string", "length_m", "mass_per_length_kg_m", "tension_N", "pluck_at_m", "pluck_height_m", "EA_N",
        how="both ends held, stretched to the tension, released from the triangle; P = 2 L sqrt(mu/T)")
def pluck(case: Case, level: Level) -> Values:
    """Midpoint of a plucked taut string."""
    length, mass, tension, at, height, ea = (case.number(k) for k in (
        "length_m", "mass_per_length_kg_m", "tension_N", "pluck_at_m", "pluck_height_m", "EA_N"))
    stretch = 1.0 + tension / ea
    coarsest, share = 32, at / length
    n = level.mesh(coarsest)
    left = min(max(round(n * share), 1), n - 1)
    free = length / stretch
    rig = Rig(cable_of([{"length": share * free, "elements": left}, {"length": (1.0 - share) * free,
                                                                     "elements": n - left}],
                       mass_per_length=mass * stretch, axial_stiffness=ea), held={0: "r", -1: "r"}, tension=tension,
              gravity=0.0)
    x = rig.arc * stretch
    up, down = height / at, -height / (length - at)
    rig.place(np.column_stack((x, 0 * x, np.where(x <= at, up * x, height + down * (x - at)))),
              stretch * np.column_stack((1.0 + 0 * x, 0 * x, np.where(x < at - 1e-9, up, down))))
    rig.line.q[left, 5] = 0.5 * stretch * (up + down)
    rig.balance()
    period = 2.0 * length * np.sqrt(mass / tension)
    told = rig.run(2.5 * period, level.step(period / 256))
    middle = np.array([np.interp(0.5 * length, row[:, 0], row[:, 2]) for row in told.q])
    times, values = np.concatenate(([0.0], told.time)), np.concatenate((
        [height * min(0.5 * length / at, 0.5 * length / (length - at))], middle))
    falls = crossings(times, values, rising=False)
    measured = float(np.diff(falls).mean()) if len(falls) > 1 else None
    of = {"period P": measured, "wave speed": 2.0 * length / measured if measured else None}
    for name, m in case.asked(r"midpoint displacement at t=(?:([\d.]+) ?\*? ?)?P(?:/([\d.]+))?"):
        of[name] = float(np.interp(float(m[1] or 1.0) * period / float(m[2] or 1.0), times, values))
    return Values(of, n, told.time[0])
