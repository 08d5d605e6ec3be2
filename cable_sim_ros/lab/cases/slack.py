"""Slack and spin: a snapping tether, a falling chain, a spinning cable."""

from __future__ import annotations

import numpy as np

from ...physics.banded import solve
from ...physics.jit import NO, YES
from ...physics.line import residual
from ..rig import Rig, RigError, cable_of
from .family import Case, Level, Values, family
from .measure import crossings, kinetic_energy

FOLDS = 4     # in which a slack tether lies: many make its sideways motion small when it is pulled straight


@family("chain released at one end", "length_m", "end_separation_m", "mass_per_length_kg_m",
        how="settled between two level points (x = 0 held, x = separation let go at t = 0), EI = 0, no damping")
def falling_chain(case: Case, level: Level) -> Values:
    """Drop of the released end."""
    length, apart, mass, g = (case.number(k, 9.81) for k in (
        "length_m", "end_separation_m", "mass_per_length_kg_m", "g"))
    n = level.mesh(16)
    weight = mass * g * length
    rig = Rig(cable_of([{"length": length, "elements": n}], mass_per_length=mass,
                       axial_stiffness=max(1e4 * weight, 1.0)), held={0: "r", -1: "r"}, tension=weight, gravity=g)
    s = rig.arc / length
    sag = 0.75 * np.sqrt((length**2 - apart**2) / 3.0)
    rig.place(np.column_stack((apart * s, 0 * s, -4.0 * sag * s * (1.0 - s))),
              np.column_stack((apart + 0 * s, 0 * s, -4.0 * sag * (1.0 - 2.0 * s))) / length)
    rig.settle()
    rig.release(-1)
    rig.balance()
    step = level.step(5e-4 * np.sqrt(length))
    told = rig.run(0.45 * np.sqrt(2.0 * length / g) * 2.2, step)
    drop = -told.q[:, -1, 2] / length
    of = {}
    for name, m in case.asked(r"time for the tip to drop ([\d.]+) L"):
        of[name] = _first(told.time, drop, float(m[1]), told.time)
    for name, m in case.asked(r"tip x when it has dropped ([\d.]+) L"):
        of[name] = _first(told.time, drop, float(m[1]), told.q[:, -1, 0])
    for name, m in case.asked(r"tip speed when it has dropped ([\d.]+) L"):
        of[name] = _first(told.time, drop, float(m[1]), np.linalg.norm(told.v[:, -1, :3], axis=1))
    return Values(of, n, float(told.time[0]), ["EA = 1e4 weights: stands for inextensible"])


def _first(times: np.ndarray, drop: np.ndarray, share: float, values: np.ndarray) -> float | None:
    """A quantity at the first instant the drop reaches a share of the length; None where it never does."""
    hit = crossings(times, drop, share, rising=True)
    return float(np.interp(hit[0], times, values)) if len(hit) else None


@family("mass dropped on a tether", "end_mass_kg", "tether_length_m", "EA_N", "tether_mass_per_length_kg_m",
        "free_fall_height_m",
        how="upper end held, tether slack in flat folds; taut while the ends are farther apart than "
            "its unstretched length")
def drop_snap(case: Case, level: Level) -> Values:
    """Snap load, rebound and second engagement."""
    mass, length, ea, light, height, g = (case.number(k, 9.81) for k in (
        "end_mass_kg", "tether_length_m", "EA_N", "tether_mass_per_length_kg_m", "free_fall_height_m", "g"))
    n = level.mesh(2 * FOLDS)
    rig = Rig(cable_of([{"length": length, "elements": n}], mass_per_length=light, axial_stiffness=ea), held={0: "r"},
              tension=mass * g, gravity=g, bodies={-1: mass})
    # FOLDS circular arcs to either side, together of the full length over the shortened chord
    chord, half = length - height, 1.0
    for _ in range(60):      # sin(half)/half = chord/length
        half -= (np.sin(half) - half * chord / length) / (np.cos(half) - chord / length)
    share = rig.arc / length * FOLDS
    fold = np.minimum(share.astype(int), FOLDS - 1)
    side, turn = 1.0 - 2.0 * (fold % 2), half * (2.0 * (share - fold) - 1.0)
    radius = length / (2.0 * half * FOLDS)
    rig.place(np.column_stack((side * radius * (np.cos(turn) - np.cos(half)), 0 * turn,
                               -chord / FOLDS * fold - radius * (np.sin(turn) + np.sin(half)))),
              np.column_stack((-side * np.sin(turn), 0 * turn, -np.cos(turn))))
    rig.balance()
    frequency = np.sqrt(ea / length / mass)
    fall = np.sqrt(2.0 * height / g)
    told = rig.run(3.0 * fall + 3.0 * np.pi / frequency + 2.0 * fall, level.step(1e-3))
    away = np.linalg.norm(told.q[:, -1, :3] - told.q[:, 0, :3], axis=1)
    speed, pull = np.linalg.norm(told.v[:, -1, :3], axis=1), np.linalg.norm(told.reaction[:, 0, :3], axis=1)
    taut, loose = crossings(told.time, away, length, rising=True), crossings(told.time, away, length, rising=False)
    notes = [f"least element tension {told.tension.min():.3g} N"]
    if len(taut) < 2 or not len(loose):
        raise RigError("the mass did not engage twice")
    first, second = told.time <= loose[0] + 0.5 * fall, told.time > taut[1] - 1e-9
    between = (told.time > loose[0]) & (told.time < taut[1])
    return Values({
        "speed at engagement": float(np.interp(taut[0], told.time, speed)), "largest tension": float(pull[first].max()),
        "duration of the first taut phase": float(loose[0] - taut[0]),
        "height of rebound above engagement": float(length - away[between].min()),
        "time between first and second engagement": float(taut[1] - taut[0]),
        "largest tension at second engagement": float(pull[second].max())}, n, float(told.time[0]), notes)


@family("spinning cable", "length_m", "mass_per_length_kg_m", "tip_mass_kg", "spin_rad_s", "EA_N",
        how="hub held, no gravity, begun in the stretched equilibrium of the spin")
def spinning(case: Case, level: Level) -> Values:
    """Tensions, energy and the spin that is left after many turns."""
    length, mass, tip, spin, ea = (case.number(k) for k in (
        "length_m", "mass_per_length_kg_m", "tip_mass_kg", "spin_rad_s", "EA_N"))
    n = 4 if level.realtime else level.mesh(8)
    load = spin**2 * (0.5 * mass * length**2 + tip * length)
    rig = Rig(cable_of([{"length": length, "elements": n}], mass_per_length=mass, axial_stiffness=ea), held={0: "r"},
              tension=load, gravity=0.0, bodies={-1: tip})
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    line = rig.line
    for _ in range(20):      # equilibrium under the accelerations of the spin
        line.a[:] = -spin**2 * line.q
        left = residual(line, 0.0, 0.0, 0.0, YES)
        if left <= line.tolerance:
            break
        solve(line.work.band, line.work.lower, line.work.step)
        line.q[:] += line.work.step
    line.a[:] = -spin**2 * line.q
    if residual(line, 0.0, 0.0, 0.0, NO) > 10.0 * line.tolerance:
        raise RigError(f"no equilibrium of the spin: residual {left:.3g} N")
    line.v[:, 1], line.v[:, 4] = spin * line.q[:, 0], spin * line.q[:, 3]
    line.x[:] = line.a
    of = {"tension at the hub": float(np.linalg.norm(line.reaction[0, :3])),
          "tension at mid length": rig.tension_at(0.5 * length)}
    of["tension at the tip"] = float(ea * (np.linalg.norm(line.q[-1, 3:]) - 1.0))
    of["kinetic energy (constant)"] = kinetic_energy(rig)
    turns = [(name, float(m[1])) for name, m in case.asked(r"spin kept after ([\d.]+) turns")]
    step = level.step(4e-3 / spin * 6.0)
    period = 2.0 * np.pi / abs(spin)
    done = 0.0
    for name, count in sorted(turns, key=lambda x: x[1]):
        span = (count - done) * period
        rig.run(span, step, every=max(int(round(span / step)), 1))
        done = count
        r, v = line.q[-1, :3], line.v[-1, :3]
        of[name] = float(np.cross(r, v)[2] / (r @ r))
    return Values(of, n, step)
