"""Natural frequencies of hanging cables and strings, a cable that spins, flexible pendulums.

Verification solves K x = omega^2 M x with the tangent and the mass of the product's own assembly at its own static
equilibrium; real time starts the line in each of these shapes and counts the zero crossings of a run.
"""

from __future__ import annotations

import re

import numpy as np

from cable_sim_ros.physics.state import Change
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.water import Water
from cable_sim_ros.sim.rig.rig import HALVED, Rig, RigError, load_of

from ..cables import uniform
from .family import Case, CaseError, Level, Values, family
from .measure import crossings, follow, tension_along

SWING = 1e-4  # largest displacement of mode k over length / k: small against the stretch it causes
PERIODS = 4  # of a real-time run of one mode
# EI over m g l^3. A free end hangs unstable in its tangent below 0.004: the element's strain is one parabola, so that
# the tension's fall over its length pulls -T/6 on the end's tangent, against the 2 T/15 of its mean
LIMBER = 0.02
PER_TURN = 500  # least steps of a spinning cable: a hundred lose 2 % of the spin in a hundred turns
MASS_SCALE = 1e6  # 1/s^2, share of mass in the second tangent
BOTH = (
    "verification: eigenvalues of the product's assembled tangent and mass; real time: free oscillation from each "
    "of these shapes in the shipped step, zero crossings"
)


def system(rig: Rig) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stiffness [N/m], mass [kg] and residual [N] of the line as it is, dense [6 nodes, 6 nodes] and [6 nodes].

    Rows of held unknowns are the identity.
    """
    n, found = rig.nodes, []
    for c2 in (0.0, MASS_SCALE):
        rig.residual(Change(0.0, c2, 0.0, 0.0), tangent=True)
        band, lower = rig.state.work.band, rig.state.work.lower
        full = np.zeros((n, 6, n, 6))
        for i in range(n):
            full[i, :, i] = band[i, :, :6]
            if i + 1 < n:
                full[i, :, i + 1] = band[i, :, 6:12]
                full[i + 1, :, i] = lower[i + 1]
        found.append(full.reshape(6 * n, 6 * n))
    return found[0], (found[1] - found[0]) / MASS_SCALE, -rig.state.work.band[:, :, 12].ravel().copy()


def free_of(rig: Rig, axis: int) -> np.ndarray:
    """Indices of the unknowns along one axis that are not held."""
    mask = np.zeros((rig.nodes, 6), bool)
    mask[:, [axis, 3 + axis]] = rig.model.held[:, [axis, 3 + axis]] == 0.0
    return np.flatnonzero(mask)


def transverse(rig: Rig, axis: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Frequencies [rad/s], shapes (columns, largest displacement 1) and weights M x of small motion along one axis, of
    a line at rest and straight along another. Raises RigError where the axes are not apart."""
    k, m, _ = system(rig)
    own = free_of(rig, axis)
    other = np.setdiff1d(np.flatnonzero(rig.model.held.ravel() == 0.0), own)
    k_own, m_own = k[np.ix_(own, own)], m[np.ix_(own, own)]
    if len(other) and np.abs(k[np.ix_(own, other)]).max() > 1e-9 * np.abs(k_own).max():
        raise RigError("the line is not straight: its transverse motion is coupled to the axial one")
    if max(np.abs(x - x.T).max() / np.abs(x).max() for x in (k_own, m_own)) > 1e-9:
        raise RigError("tangent or mass is not symmetric: no natural frequencies")
    root = np.linalg.cholesky(0.5 * (m_own + m_own.T))
    half = np.linalg.solve(root, 0.5 * (k_own + k_own.T))
    square, x = np.linalg.eigh(np.linalg.solve(root, half.T))
    x = np.linalg.solve(root.T, x)
    x /= np.abs(x[own % 6 < 3]).max(axis=0)
    return np.sqrt(np.maximum(square, 0.0)), x, m_own @ x


def frequencies(case: Case, rig: Rig, level: Level) -> dict[str, float]:
    """The outputs omega_k [rad/s] of a line at rest."""
    omega, shapes, weights = transverse(rig)
    asked = {name: int(m[1]) for name, m in case.asked(r"omega_(\d+)") if 1 <= int(m[1]) <= len(omega)}
    if not level.realtime:
        return {name: float(omega[k - 1]) for name, k in asked.items()}
    rest, own, of = rig.state.q.copy(), free_of(rig, 0), {}
    for name, k in asked.items():
        shape, duration = SWING / k * rig.arc[-1] * shapes[:, k - 1], PERIODS * 2.0 * np.pi / omega[k - 1]
        of[name] = swing(rig, rest, own, shape, weights[:, k - 1], level.tick, duration)
    return of


def swing(rig: Rig, rest, own, shape, weight, step: float, duration: float) -> float | None:
    """Frequency [rad/s] of the free oscillation let go from a shape, by the zero crossings of its modal coordinate."""
    rig.place(rest[:, :3], rest[:, 3:])
    rig.state.q.reshape(-1)[own] += shape
    rig.balance()
    t, y = follow(
        rig,
        duration,
        step,
        lambda run: [(run.q - rest).reshape(len(run.time), -1)[:, own] @ weight],
        (float(shape @ weight),),
    )
    zeros = crossings(t, y, 0.0)
    return float(np.pi * (len(zeros) - 1) / (zeros[-1] - zeros[0])) if len(zeros) > 1 else None


@family(
    "hanging chain",
    "length_m mass_per_length_kg_m modes",
    how=BOTH + f"; held at its upper end; EI = {LIMBER:g} m g l^3 of an element's length l, which vanishes with "
    "the mesh: where the tension falls to nothing within one element, its end tangent needs it",
)
def hanging_chain(case: Case, level: Level) -> Values:
    """Natural frequencies of a chain held at its upper end."""
    length, mass, gravity = case.number("length_m"), case.number("mass_per_length_kg_m"), case.gravity
    tip, n = case.number("tip_mass_kg", 0.0), level.mesh(24)
    weight, limber = (mass * length + tip) * gravity, LIMBER * mass * gravity * (length / n) ** 3
    cable = uniform(
        length, n, mass, case.number("EA_N", 1e5 * weight), bending_stiffness=case.number("EI_N_m2", limber)
    )
    rig = Rig(cable, held={0: "r"}, tension=weight, gravity=gravity, bodies={n: tip} if tip else {})
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    return Values(frequencies(case, rig, level), n, level.tick or 0.0)


@family(
    "submerged hanging cable",
    "length_m mass_per_length_kg_m diameter_m fluid_density Ca_normal body_wet_weight_N body_mass_kg "
    "body_transverse_added_mass_kg",
    how=BOTH + "; wholly under water, no drag, added mass normal to the cable and transverse of the body",
)
def submerged_cable(case: Case, level: Level) -> Values:
    """Natural frequencies of a cable and body hanging in still water."""
    length, mass, diameter, ca = case.numbers("length_m mass_per_length_kg_m diameter_m Ca_normal")
    weight, heavy, added = case.numbers("body_wet_weight_N body_mass_kg body_transverse_added_mass_kg")
    gravity, n = case.gravity, level.mesh(24)
    working = mass * gravity * length + weight
    ea = case.number("EA_N", 1e5 * working)
    cable = uniform(length, n, mass, ea, diameter=diameter, added_mass_coefficient=ca)
    water = Water(density=case.number("fluid_density"))
    body = Towbody(mass=heavy, net_weight=weight, added_mass=(added, added, 0.0))
    rig = Rig(cable, held={0: "r"}, tension=working, gravity=gravity, water=water, bodies={n: body})
    rig.straight((0.0, 0.0, -10.0 - 0.1 * length), (0.0, 0.0, -1.0))
    rig.settle()
    notes = [] if case.number("Cd", 0.0) == 0.0 else ["drag is left out: it changes no frequency of small motion"]
    return Values(frequencies(case, rig, level), n, level.tick or 0.0, notes)


@family(
    "string under linear tension",
    "length_m mass_per_length_kg_m T_low_N T_high_N",
    how=BOTH + "; hung vertically under the gravity that makes the difference of tensions, stretched by the lower "
    "one, then held at both ends",
)
def linear_tension(case: Case, level: Level) -> Values:
    """Natural frequencies of a string with weight along it."""
    length, mass, n = case.number("length_m"), case.number("mass_per_length_kg_m"), level.mesh(24)
    low, high = sorted((case.number("T_low_N"), case.number("T_high_N")))
    cable = uniform(length, n, mass, case.number("EA_N", 1e4 * high))
    rig = Rig(
        cable, held={0: "r"}, tension=high, gravity=(high - low) / (mass * length), loads=[load_of(n, (0.0, 0.0, -low))]
    )
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    rig.hold({0: "r", n: "r"})
    return Values(frequencies(case, rig, level), n, level.tick or 0.0)


@family(
    "spinning cable",
    "length_m mass_per_length_kg_m tip_mass_kg spin_rad_s EA_N",
    how="hub held, tangent free, in the plane, started in its stretched equilibrium at that spin; no damping; "
    f"tensions as means over the last turn, energy and spin at the end of the turns; at least {PER_TURN} steps "
    "a turn",
)
def spinning_cable(case: Case, level: Level) -> Values:
    """Tensions, energy and spin of a cable that turns about its end."""
    turn = 2.0 * np.pi / abs(case.number("spin_rad_s"))
    if not level.realtime:
        return _spin(case, level.mesh(4), turn, level.step(turn / PER_TURN))
    values = _spin(case, 8, turn, level.tick / max(int(np.ceil(level.tick * PER_TURN / turn)), 1))
    if values.dt < level.tick:
        values.notes.extend(
            f"in steps of {values.dt:.3g} s; at {level.tick:g} s the integrator's dissipation makes "
            f"'{name}' {value:.4g}"
            for name, value in _spin(case, 8, turn, level.tick).of.items()
            if name.startswith("spin kept")
        )
    return values


def _spin(case: Case, n: int, turn: float, step: float) -> Values:
    length, spin, ea = case.numbers("length_m spin_rad_s EA_N")
    mass, tip = case.number("mass_per_length_kg_m"), case.number("tip_mass_kg")
    cable = uniform(length, n, mass, ea)
    rig = Rig(cable, held={0: "r"}, tension=(tip + mass * length) * spin**2 * length, gravity=0.0, bodies={n: tip})
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    state, axial = rig.state, free_of(rig, 0)
    on = np.ix_(axial, axial)
    for _ in range(6):  # radial equilibrium: a = -spin^2 r
        state.a[:] = -(spin**2) * state.q
        k, m, r = system(rig)
        state.q.reshape(-1)[axial] -= np.linalg.solve(k[on] - spin**2 * m[on], r[axial])
    state.v[:, [1, 4]] = spin * state.q[:, [0, 3]]
    rig.balance()
    asked = case.asked(r"spin kept after ([\d.]+) turns?")
    turns = max([1.0, *(float(m[1]) for _, m in asked)])
    if turns > 1.0:
        rig.run((turns - 1.0) * turn, step, every=max(int(round((turns - 1.0) * turn / step)), 1), rules=HALVED)
    run = rig.run(turn, step, rules=HALVED)
    _, m, _ = system(rig)
    v, tip, tension = state.v.ravel(), state.q[-1], run.tension.mean(axis=0)
    around = float((tip[0] * state.v[-1, 1] - tip[1] * state.v[-1, 0]) / (tip[:3] @ tip[:3]))
    of = {
        "tension at the hub": float(np.linalg.norm(run.reaction[:, 0, :3], axis=1).mean()),
        "tension at mid length": tension_along(rig, tension, 0.5 * length),
        "tension at the tip": tension_along(rig, tension, length),
        "kinetic energy (constant)": float(0.5 * v @ m @ v),
    }
    return Values(of | {name: around for name, _ in asked}, n, step, [])


ANGULAR = re.compile(r"([-+.\deE]+) rad/s \* x along \+y")
SWING_STEPS = 50  # of a real-time run over sqrt(L/g), at least


@family(
    "flexible pendulum",
    "length_m mass_per_length_kg_m EA_N EI_N_m2",
    how="pinned at the origin, tangent free, no damping, a rod: full EA in compression",
)
def pendulum(case: Case, level: Level) -> Values:
    """Positions of tip and middle at the times asked for."""
    length, mass, ea, ei = case.numbers("length_m mass_per_length_kg_m EA_N EI_N_m2")
    gravity, n = case.gravity, level.mesh(8)
    asked = case.asked(r"(tip|middle) ([xyz]) at ([\d.eE+-]+) s")
    times = sorted({float(m[3]) for _, m in asked})
    cable = uniform(length, n, mass, ea, bending_stiffness=ei, compression_share=1.0)
    rig = Rig(cable, held={0: "r"}, tension=mass * length * gravity, gravity=gravity)
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    spin = np.zeros((rig.nodes, 3))
    if "initial_velocity" in case.inputs:
        found = ANGULAR.match(str(case.inputs["initial_velocity"]))
        if not found:
            raise CaseError(
                f"{case.path}: inputs.initial_velocity = {case.inputs['initial_velocity']!r} is not "
                "understood ('<w> rad/s * x along +y'); the case was not run"
            )
        spin[:, 1] = float(found[1])
    else:
        spin[:, 2] = -case.number("initial_spin_rad_s", 0.0)
    rig.state.v[:, :3], rig.state.v[:, 3:] = rig.arc[:, None] * spin, spin
    rig.balance()
    of, now, step = {}, 0.0, level.step(1e-3)
    if level.realtime:
        step /= max(int(np.ceil(step * SWING_STEPS / np.sqrt(length / gravity))), 1)
    for t in times:
        rig.run(t - now, step, every=max(int(round((t - now) / step)), 1))
        now = t
        for what, node in (("tip", -1), ("middle", n // 2)):
            for k, axis in enumerate("xyz"):
                of[f"{what} {axis} at {t} s"] = float(rig.state.q[node, k])
    named = {name: of[f"{m[1]} {m[2]} at {float(m[3])} s"] for name, m in asked}
    notes = [f"in steps of {step:.3g} s: {SWING_STEPS} over sqrt(L/g)"] if level.realtime and step < level.tick else []
    return Values(named, n, step, notes)
