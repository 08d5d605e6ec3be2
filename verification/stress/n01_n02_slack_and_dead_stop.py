"""N1, N2: slack cables that fall and snap, the dead stop of a winch; the runs are those of the verification cases."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from cable_sim_ros.sim.rig.rig import FOLDING, WHIPPING, Rig

from ..cables import uniform
from ..cases import Fidelity, run_case
from ..cases.family import Case, Output
from ..cases.slack import INEXTENSIBLE, LIMBER, bowed, hung_chain
from .verdict import MIN, WITHIN, Found, Metric, relative, stress

GRAVITY = 9.81
DROP = {
    "end_mass_kg": 100.0,
    "tether_length_m": 10.0,
    "EA_N": 1e5,
    "tether_mass_per_length_kg_m": 0.01,
    "free_fall_height_m": 0.5,
    "g": GRAVITY,
}
CHAIN = {"length_m": 1.0, "end_separation_m": 0.5, "mass_per_length_kg_m": 0.02, "g": GRAVITY}
# a light load over 450 m, and the static tension it keeps
STOP = {
    "EA_N": 6.786e6,
    "mass_per_length_kg_m": 0.389,
    "length_m": 450.0,
    "end_mass_kg": 250.0,
    "payout_speed_m_s": 1.0,
    "constant_force_on_end_mass_N": 6000.0,
}
TOP = "largest dynamic tension at the winch in 0..8 L/c"
FIDELITIES = (Fidelity.VERIFICATION, Fidelity.REALTIME)


def values(name: str, inputs: dict, outputs: dict[str, float], fidelity: Fidelity) -> tuple[dict, list[str]]:
    """Values and notes of a verification case with these outputs {name: relative tolerance}."""
    case = Case(name, inputs, [Output(o, "", tolerance, None) for o, tolerance in outputs.items()], [], "stress")
    report = run_case(case, fidelity)
    return {o["name"]: o["value"] for o in report.outputs}, report.notes


def min_of_drop(elements: int, step: float) -> float:
    """Least element tension of the dropped mass, from its fall over the snap to the next one, over T0."""
    p = DROP
    length, weight = p["tether_length_m"], p["end_mass_kg"] * GRAVITY
    cable = uniform(length, elements, p["tether_mass_per_length_kg_m"], p["EA_N"], compression_share=FOLDING)
    rig = Rig(cable, held={0: "r"}, tension=weight, bodies={elements: p["end_mass_kg"]})
    bowed(rig, length - p["free_fall_height_m"])
    return min_along(rig, step, 2.0) / weight


def min_along(rig: Rig, step: float, seconds: float) -> float:
    """Least tension of any element during a run [N]."""
    minimum = np.inf
    for _ in range(round(seconds / step)):
        rig.run(step, step, rules=WHIPPING)
        minimum = min(minimum, float(rig.state.tension.min()))
    return minimum


def min_of_chain(elements: int, step: float) -> float:
    """Least element tension of the falling chain until it hangs below its support, over T0 at that support."""
    length, apart, mass = CHAIN["length_m"], CHAIN["end_separation_m"], CHAIN["mass_per_length_kg_m"]
    weight = mass * GRAVITY * length
    rig = hung_chain(length, apart, elements, mass, GRAVITY, INEXTENSIBLE * weight, LIMBER * weight * length**2)
    top = float(np.linalg.norm(rig.state.reaction[0, :3]))
    rig.release(elements)
    return min_along(rig, step, 0.4) / top


def drop_truth() -> dict[str, float]:
    """A massless unilateral spring: energy, and the half sine of the taut phase."""
    k, mass = DROP["EA_N"] / DROP["tether_length_m"], DROP["end_mass_kg"]
    weight, height = mass * GRAVITY, DROP["free_fall_height_m"]
    w, speed = np.sqrt(k / mass), np.sqrt(2.0 * GRAVITY * height)
    peak = weight + np.sqrt(weight**2 + 2.0 * k * weight * height)
    taut = 2.0 * (np.pi - np.arctan(speed * w / GRAVITY)) / w
    return {
        "speed at engagement": speed,
        "largest tension": peak,
        "duration of the first taut phase": taut,
        "height of rebound above engagement": height,
        "time between first and second engagement": taut + 2.0 * speed / GRAVITY,
        "largest tension at second engagement": peak,
    }


def chain_times(links: int) -> np.ndarray:
    """Times at which the tip of a chain of rigid links has dropped by 1/4, 1/2, 3/4 of its length; independent code."""
    p = CHAIN
    l = p["length_m"] / links
    # inextensible catenary between level points: slope angle at the middle of each link; 2 a sinh(span / 2a) = length
    length, span = p["length_m"], p["end_separation_m"]
    a = brentq(lambda a: 2.0 * a * np.sinh(0.5 * span / a) - length, 0.05 * span, 50.0 * span)
    s = (np.arange(links) + 0.5) * l - 0.5 * p["length_m"]
    theta = np.arctan2(s, a)  # from the horizontal
    i = np.arange(links)
    after = links - np.maximum.outer(i, i) - 1.0
    inertia = after + 0.5 + (np.eye(links) * (1.0 / 3.0 - 0.5))  # rods of unit mass and length
    weight = links - i - 0.5

    def rate(_, y):
        t, d = y[:links], y[links:]
        c, sn = np.cos(t[:, None] - t), np.sin(t[:, None] - t)
        force = -(inertia * sn) @ (d * d) - GRAVITY / l * weight * np.cos(t)
        return np.concatenate((d, np.linalg.solve(inertia * c, force)))

    out = solve_ivp(rate, (0.0, 0.6), np.concatenate((theta, np.zeros(links))), rtol=1e-8, atol=1e-8, dense_output=True)
    t = np.linspace(0.0, out.t[-1], 6001)
    drop = -(l * np.sin(out.sol(t)[:links])).sum(0)
    return np.array(
        [
            np.interp(x * p["length_m"], drop[: int(drop.argmax()) + 1], t[: int(drop.argmax()) + 1])
            for x in (0.25, 0.5, 0.75)
        ]
    )


DROP_ALLOWED = dict(zip(drop_truth(), (0.005, 0.01, 0.01, 0.03, 0.01, 0.03)))
CHAIN_ALLOWED = {
    f"time for the tip to drop {fraction:.2f} L": allowed
    for fraction, allowed in zip((0.25, 0.5, 0.75), (0.01, 0.01, 0.015))
}


@stress("slack: dropped and falling cables, snap", "case tolerances; tension never below -0.001 T0")
def slack(quick: bool) -> Found:
    """N1: slack: dropped and falling cables, snap."""
    metrics, notes = [], []
    chain = dict(zip(CHAIN_ALLOWED, chain_times(40 if quick else 80)))
    fidelity = Fidelity.REALTIME if quick else Fidelity.VERIFICATION
    for name, inputs, truth, allowed in (
        ("dropped mass", DROP, drop_truth(), DROP_ALLOWED),
        ("falling chain", CHAIN, chain, CHAIN_ALLOWED),
    ):
        got, report = values(name, inputs, allowed, fidelity)
        metrics += [
            relative(f"{name}, {what}", got[what], truth[what], tolerance) for what, tolerance in allowed.items()
        ]
        notes += report[1:]
    # the mesh and step that a real-time run would carry, and finer ones: a push that is the mesh's goes with it
    for elements, step in ((16, 1e-3), (64, 2.5e-4))[: 1 if quick else 2]:
        mesh = f"{elements} elements, {1e3 * step:g} ms"
        metrics += [
            Metric(f"dropped mass, least tension over T0, {mesh}", min_of_drop(elements, step), "", -1e-3, MIN),
            Metric(f"falling chain, least tension over T0, {mesh}", min_of_chain(elements, step), "", -1e-3, MIN),
        ]
    notes.append(
        "T0: weight of the dropped mass; tension of the hanging chain at the end that stays. Dropped mass "
        "against a massless unilateral spring, chain against rigid links (an independent code)"
    )
    return Found(metrics, notes)


@stress(
    "snap and winch dead stop (the first reflection from the body makes 3 rho c V)",
    "verification peak within 4 %, realtime within 15 % and not low by more than 10 %",
)
def dead_stop(quick: bool) -> Found:
    """N2: snap and winch dead stop (the first reflection from the body makes 3 rho c V)."""
    wave = 3.0 * np.sqrt(STOP["EA_N"] * STOP["mass_per_length_kg_m"]) * STOP["payout_speed_m_s"]
    snap = "largest tension"
    metrics, notes = [], []
    for name, inputs, what, peak, allowed in (
        ("dead stop", STOP, TOP, wave, 0.01),
        ("snap", DROP, snap, drop_truth()[snap], 0.01),
    ):
        for fidelity in FIDELITIES[1 if quick else 0 :]:
            got, report = values(name, inputs, {what: allowed}, fidelity)
            off = None if got[what] is None else float(got[what] / peak - 1.0)
            real = fidelity is Fidelity.REALTIME
            metrics.append(Metric(f"{name}, peak, {fidelity.value}", off, "", 0.15 if real else 0.04, WITHIN))
            if real:
                metrics.append(Metric(f"{name}, peak, realtime, not low by more", off, "", -0.10, MIN))
            notes += [f"{name}, {fidelity.value}: {note}" for note in report[1:]]
    return Found(metrics, notes)
