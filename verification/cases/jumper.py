"""A jumper between two ends under water, one of them moved."""

from __future__ import annotations

import re
from math import hypot, pi

import numpy as np

from cable_sim_ros.physics.water import Water
from cable_sim_ros.sim.rig.rig import Rig

from ..cables import uniform
from .family import Case, CaseError, Level, Values, family
from .wet import NUMBER, crossflow

REPEATS = 2e-3  # share of the working tension by which extremes may differ from one period to the next
MAX_PERIODS = 12


def sagging(arc: np.ndarray, first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A start for settle(): parabola of length arc[-1] hanging between two points; positions, unit tangents."""
    u = np.linspace(0.0, 1.0, 2001)

    def curve(sag: float) -> tuple[np.ndarray, np.ndarray]:
        r = first + u[:, None] * (last - first)
        r[:, 2] -= 4.0 * sag * u * (1.0 - u)
        return r, np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(r, axis=0), axis=1))))

    low, high = 0.0, arc[-1]
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if curve(middle)[1][-1] < arc[-1] else (low, middle)
    r, s = curve(low)
    s *= arc[-1] / s[-1]
    slope = np.gradient(r, s, axis=0)
    at = np.stack([np.interp(arc, s, r[:, k]) for k in range(3)], 1)
    tangent = np.stack([np.interp(arc, s, slope[:, k]) for k in range(3)], 1)
    return at, tangent / np.linalg.norm(tangent, axis=1)[:, None]


def vector(case: Case, key: str) -> np.ndarray:
    """A point of the inputs [m]. Raises CaseError."""
    try:
        point = np.array(case.inputs[key], float)
    except (TypeError, ValueError):
        point = np.zeros(0)
    if point.shape != (3,) or not np.isfinite(point).all():
        raise CaseError(f"{case.path}: inputs.{key} must be three numbers; the case was not run")
    return point


def oscillation(case: Case) -> tuple[float, float]:
    """Amplitude [m] and period [s] of the motion given in words. Raises CaseError."""
    text = str(case.inputs["motion"])
    found = [
        re.search(rf"{what}\s*=?\s*({NUMBER})\s*{unit}\b", text) for what, unit in (("amplitude", "m"), ("period", "s"))
    ]
    if not all(found):
        raise CaseError(
            f"{case.path}: inputs.motion = {text!r} gives no 'amplitude <A> m' and 'period <T> s'; the case was not run"
        )
    return float(found[0][1]), float(found[1][1])


def swaying(still: np.ndarray, axis: int, amplitude: float, period: float, since: float):
    """Motion table of an end that sways along an axis, its amplitude taken up C2 over the first period."""
    w = 2.0 * pi / period

    def motion(t: np.ndarray) -> np.ndarray:
        t = t + since
        u = np.minimum(t / period, 1.0)
        up, d, dd = (
            u**3 * (10.0 - 15.0 * u + 6.0 * u * u),
            30.0 * u * u * (1.0 - u) ** 2 / period,
            60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) / period**2,
        )
        s, c, rows = np.sin(w * t), np.cos(w * t), np.zeros((len(t), 1, 9))
        rows[:, 0, :3] = still
        rows[:, 0, axis] += amplitude * up * s
        rows[:, 0, 3 + axis] = amplitude * (d * s + up * w * c)
        rows[:, 0, 6 + axis] = amplitude * (dd * s + 2.0 * d * w * c - up * w * w * s)
        return rows

    return motion


@family(
    "swaying jumper",
    "end_fixed_m end_moved_m unstretched_length_m EA_N EI_N_m2 diameter_m mass_per_length_kg_m fluid_density motion",
    growth=4.0,
    how="pinned ends, settled, then the moved end sways; amplitude taken up over the first period; periods until "
    "the extremes repeat, at least three; the water's surface is z = 0: what rises out of it is in air; "
    "tension: the reaction at the end along the cable's tangent",
)
def jumper(case: Case, level: Level) -> Values:
    """A jumper whose upper end sways."""
    fixed, moved = vector(case, "end_fixed_m"), vector(case, "end_moved_m")
    gravity, length, n = case.gravity, case.number("unstretched_length_m"), level.mesh(16)
    density, diameter, mass, ea, ei = case.numbers("fluid_density diameter_m mass_per_length_kg_m EA_N EI_N_m2")
    wet = abs(mass - 0.25 * pi * diameter**2 * density) * gravity * length
    law = crossflow(case.number("Cd_normal"), pi * case.number("Cd_axial", 0.0))  # along: on the circumference
    ca = case.number("Ca_normal", 0.0)
    cable = uniform(length, n, mass, ea, law, diameter=diameter, bending_stiffness=ei, added_mass_coefficient=ca)
    rig = Rig(cable, held={0: "r", n: "r"}, tension=wet, gravity=gravity, water=Water(density=density))
    start, tangent = sagging(rig.arc, fixed, moved)
    start[0], start[-1] = fixed, moved
    rig.place(start, tangent)
    rig.settle()
    ends = {"top": n if moved[2] >= fixed[2] else 0, "bottom": 0 if moved[2] >= fixed[2] else n}
    of, notes = {}, []
    for end, node in ends.items():
        force = rig.state.reaction[node, :3]
        of[f"static force at the {end} end, horizontal"] = float(hypot(force[0], force[1]))
        of[f"static force at the {end} end, vertical"] = float(force[2])
    if case.number("Ca_axial", 0.0):
        notes.append("the product's cable has no added mass along itself; Ca_axial was left out")
    rest, step = rig.state.q.copy(), level.step(0.1)
    asked = case.asked(r"(largest|smallest) (top|bottom)-end tension .*motion along ([xyz])")
    for axis in sorted({m[3] for _, m in asked}):
        rig.place(rest[:, :3], rest[:, 3:])
        found, report = sway(case, rig, ends, "xyz".index(axis), moved, step, wet)
        notes.append(f"along {axis}: {report}")
        of.update({name: found[m[1], m[2]] for name, m in asked if m[3] == axis})
    return Values(of, n, step, notes)


def sway(case: Case, rig: Rig, ends: dict, axis: int, still: np.ndarray, step: float, working: float):
    """Extremes of the end tensions over the last two periods of a motion, by (largest or smallest, end); a note."""
    amplitude, period = oscillation(case)
    per, past = max(int(round(period / step)), 16), []
    for i in range(MAX_PERIODS):
        path = rig.run(period, period / per, moved=(-1,), motion=swaying(still, axis, amplitude, period, i * period))
        now = {}
        for end, node in ends.items():
            out = path.q[:, node, 3:] * (1.0 if node else -1.0)
            pull = np.sum(path.reaction[:, node, :3] * out, axis=1) / np.linalg.norm(out, axis=1)
            now["largest", end], now["smallest", end] = float(pull.max()), float(pull.min())
        past.append(now)
        change = max(abs(now[k] - past[-2][k]) for k in now) if i else np.inf
        if i >= 3 and change <= REPEATS * working:
            break
    last = {k: (max if k[0] == "largest" else min)(past[-1][k], past[-2][k]) for k in past[-1]}
    return last, f"{len(past)} periods, the last changed an extreme by {change:.2g} N"
