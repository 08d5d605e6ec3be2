"""N1, N2: slack cables that fall and snap, the dead stop of a winch."""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_ivp

from ...physics.integrate import Solver
from ..rig import Rig, cable_of
from .registry import LEAST, WITHIN, Figure, Found, stress

GRAVITY = 9.81
# dropped mass: the numbers of the verification case of that kind
DROP = {"mass": 100.0, "length": 10.0, "ea": 1e5, "mu": 0.01, "fall": 0.5}
# falling chain: length [m], separation of its ends, mass per length
CHAIN = {"length": 1.0, "apart": 0.5, "mu": 0.02, "ea": 1e4}
# dead stop: a light load over 450 m, and the static tension it keeps
STOP = {"ea": 6.786e6, "mu": 0.389, "length": 450.0, "mass": 250.0, "speed": 1.0, "force": 6000.0}


def dropped(elements: int, step: float) -> dict[str, float]:
    """A mass falls freely beside the point its tether hangs from, until the tether snaps taut, and again."""
    p = DROP
    rig = Rig(cable_of([{"length": p["length"], "elements": elements}], mass_per_length=p["mu"],
                       axial_stiffness=p["ea"]), held={0: "r"}, tension=p["mass"] * GRAVITY,
              bodies={-1: p["mass"]})
    # a shallow bow of the right length between the point and the mass, which hangs ``fall`` too high
    s, drop = rig.arc, p["length"] - p["fall"]
    bow = bowed(p["length"], drop)
    angle = bow * np.cos(np.pi * s / p["length"])
    fine = np.linspace(0.0, p["length"], 20001)
    tilt = bow * np.cos(np.pi * fine / p["length"])
    x = np.concatenate(([0.0], np.cumsum(0.5 * (np.sin(tilt[1:]) + np.sin(tilt[:-1])) * np.diff(fine))))
    z = np.concatenate(([0.0], np.cumsum(0.5 * (np.cos(tilt[1:]) + np.cos(tilt[:-1])) * np.diff(fine))))
    rig.place(np.column_stack((np.interp(s, fine, x), 0.0 * s, -np.interp(s, fine, z))),
              np.column_stack((np.sin(angle), 0.0 * s, -np.cos(angle))))
    rig.balance()
    told = rig.run(2.2, step)
    tension = told.tension
    depth, top = -told.q[:, -1, 2], np.linalg.norm(told.reaction[:, 0, :3], axis=1)
    taut = depth > p["length"]
    begin = int(np.argmax(taut))
    end = begin + int(np.argmax(~taut[begin:]))
    again = end + int(np.argmax(taut[end:]))
    later = again + (int(np.argmax(~taut[again:])) if taut[again:].any() else 0)
    return {"speed": -told.v[begin, -1, 2], "peak": top[begin:end].max(), "taut": told.time[end] - told.time[begin],
            "rebound": (p["length"] - depth[end:again].min()), "period": told.time[again] - told.time[begin],
            "second": top[again:later if later > again else None].max(), "least": tension.min()}


def bowed(length: float, span: float) -> float:
    """Amplitude a of the tangent angle a cos(pi s / L) whose chord is ``span``."""
    fine = np.pi * np.linspace(0.0, 1.0, 2001)
    low, high = 0.0, 2.0
    for _ in range(60):
        mid = 0.5 * (low + high)
        low, high = (mid, high) if np.cos(mid * np.cos(fine)).mean() * length > span else (low, mid)
    return low


def drop_truth() -> dict[str, float]:
    """A massless unilateral spring: energy and the half sine of the taut phase."""
    p = DROP
    k, weight, speed = p["ea"] / p["length"], p["mass"] * GRAVITY, np.sqrt(2.0 * GRAVITY * p["fall"])
    w = np.sqrt(k / p["mass"])
    peak = weight + np.sqrt(weight**2 + 2.0 * k * weight * p["fall"])
    taut = 2.0 * (np.pi - np.arctan(speed * w / GRAVITY)) / w
    return {"speed": speed, "peak": peak, "taut": taut, "rebound": p["fall"], "period": taut + 2.0 * speed / GRAVITY,
            "second": peak}


def chain_times(links: int) -> np.ndarray:
    """Times at which the tip of a chain of rigid links has dropped by 1/4, 1/2, 3/4 of its length; independent code."""
    p = CHAIN
    l = p["length"] / links
    # inextensible catenary between level points: slope angle at the middle of each link
    a = _catenary(p["length"], p["apart"])
    s = (np.arange(links) + 0.5) * l - 0.5 * p["length"]
    theta = np.arctan2(s, a)                     # from the horizontal
    i = np.arange(links)
    after = links - np.maximum.outer(i, i) - 1.0
    inertia = after + 0.5 + (np.eye(links) * (1.0 / 3.0 - 0.5))      # rods of unit mass and length
    weight = links - i - 0.5

    def rate(_, y):
        t, d = y[:links], y[links:]
        c, sn = np.cos(t[:, None] - t), np.sin(t[:, None] - t)
        force = -(inertia * sn) @ (d * d) - GRAVITY / l * weight * np.cos(t)
        return np.concatenate((d, np.linalg.solve(inertia * c, force)))
    out = solve_ivp(rate, (0.0, 0.6), np.concatenate((theta, np.zeros(links))), rtol=1e-8, atol=1e-8,
                    dense_output=True)
    t = np.linspace(0.0, out.t[-1], 6001)
    drop = -(l * np.sin(out.sol(t)[:links])).sum(0)
    return np.array([np.interp(x * p["length"], drop[:int(drop.argmax()) + 1], t[:int(drop.argmax()) + 1])
                     for x in (0.25, 0.5, 0.75)])


def _catenary(length: float, span: float) -> float:
    """Parameter a [m]: 2 a sinh(span / 2a) = length."""
    low, high = 0.05 * span, 50.0 * span
    for _ in range(80):
        mid = 0.5 * (low + high)
        low, high = (mid, high) if 2.0 * mid * np.sinh(0.5 * span / mid) > length else (low, mid)
    return low


def fallen(elements: int, step: float) -> tuple[np.ndarray, float, float]:
    """Our chain released at one end: the times of chain_times, the least tension, the static top tension [N]."""
    p = CHAIN
    rig = Rig(cable_of([{"length": p["length"], "elements": elements}], mass_per_length=p["mu"],
                       axial_stiffness=p["ea"]), held={0: "r", -1: "r"}, tension=p["mu"] * GRAVITY * p["length"],
              solver=Solver(max_iterations=50))
    a = _catenary(p["length"], p["apart"])
    s = rig.arc - 0.5 * p["length"]
    stretch = np.sqrt(s**2 + a**2)
    rig.place(np.column_stack((a * np.arcsinh(s / a) + 0.5 * p["apart"], 0.0 * s, stretch - stretch[0])),
              np.column_stack((a / stretch, 0.0 * s, s / stretch)))
    rig.settle()
    top = float(np.linalg.norm(rig.line.reaction[0, :3]))
    rig.release(rig.nodes - 1)
    rig.balance()
    told = rig.run(0.45, step)
    drop = told.q[0, -1, 2] - told.q[:, -1, 2]
    times = np.array([np.interp(x * p["length"], drop[:int(drop.argmax()) + 1],
                                told.time[:int(drop.argmax()) + 1]) for x in (0.25, 0.5, 0.75)])
    return times, float(told.tension.min()), top


@stress("N1", "slack: dropped and falling cables, snap", "case tolerances; tension never below -0.001 T0")
def slack(quick: bool) -> Found:
    figures, notes = [], []
    truth = drop_truth()
    got = dropped(16, 1e-3 if quick else 2.5e-4)
    for name, what, allowed in (("speed", "speed at engagement", 0.005), ("peak", "largest tension", 0.01),
                                ("taut", "first taut phase", 0.01), ("rebound", "height of rebound", 0.03),
                                ("period", "time to the second engagement", 0.01),
                                ("second", "tension of the second snap", 0.03)):
        figures.append(Figure(f"dropped mass, {what}", float(got[name] / truth[name] - 1.0), "", allowed, WITHIN))
    figures.append(Figure("dropped mass, least tension over T0", float(got["least"] / (DROP["mass"] * GRAVITY)), "",
                          -1e-3, LEAST))
    times, least, top = fallen(16 if quick else 32, 1e-3 if quick else 2.5e-4)
    for share, ours, theirs, allowed in zip((0.25, 0.5, 0.75), times, chain_times(40 if quick else 80),
                                            (0.01, 0.01, 0.015)):
        figures.append(Figure(f"falling chain, time to drop {share:g} L", float(ours / theirs - 1.0), "", allowed,
                              WITHIN))
    figures.append(Figure("falling chain, least tension over T0", least / top, "", -1e-3, LEAST))
    notes.append("T0: weight of the dropped mass; tension of the hanging chain at the end that stays. Dropped mass "
                 "against a massless unilateral spring, chain against a chain of rigid links")
    return Found(figures, notes)


def stopped(elements: int, step: float) -> float:
    """Largest dynamic tension at the end of a cable that moved with its load and is stopped dead [N]."""
    p = STOP
    rig = Rig(cable_of([{"length": p["length"], "elements": elements}], mass_per_length=p["mu"],
                       axial_stiffness=p["ea"]), held={0: "r"}, tension=p["force"], gravity=0.0,
              bodies={-1: p["mass"]}, loads=[(elements, p["force"], 0.0, 0.0, 0.0, 0.0, 0.0)])
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 1.0 + p["force"] / p["ea"])
    rig.settle()
    rig.line.v[1:, 0] = p["speed"]
    rig.balance()
    wave = np.sqrt(p["ea"] / p["mu"])
    told = rig.run(8.0 * p["length"] / wave, step)
    return float(np.abs(told.reaction[:, 0, 0]).max()) - p["force"]


@stress("N2", "snap and winch dead stop (the first reflection from the body makes 3 rho c V)",
        "verification peak within 4 %, realtime within 15 % and not low by more than 10 %")
def dead_stop(quick: bool) -> Found:
    p = STOP
    peak = 3.0 * np.sqrt(p["ea"] * p["mu"]) * p["speed"]
    fine, step = (200, 5e-4) if quick else (800, 1.25e-4)
    found = {"verification": stopped(fine, step) / peak - 1.0, "realtime": stopped(28, 0.01) / peak - 1.0}
    drop = drop_truth()["peak"]
    snap = {"verification": dropped(16, 1e-3 if quick else 2.5e-4)["peak"] / drop - 1.0,
            "realtime": dropped(8, 0.01)["peak"] / drop - 1.0}
    figures = []
    for name, got in (("dead stop", found), ("snap", snap)):
        figures += [Figure(f"{name}, peak, verification", float(got["verification"]), "", 0.04, WITHIN),
                    Figure(f"{name}, peak, realtime", float(got["realtime"]), "", 0.15, WITHIN),
                    Figure(f"{name}, peak, realtime, not low by", float(got["realtime"]), "", -0.10, LEAST)]
    return Found(figures, [f"dead stop of {p['length']:g} m with {p['mass']:g} kg at {p['speed']:g} m/s: verification "
                           f"{fine} elements at {1e3 * step:g} ms, realtime 28 elements at 10 ms"])
