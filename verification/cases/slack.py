"""Slack cables: a chain let go at one end, a weight that falls into its tether."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import trapezoid

from cable_sim_ros.sim.rig.rig import FOLDING, WHIPPING, Rig

from ..cables import uniform
from .family import Case, CaseError, Level, Values, family
from .measure import crossings
from .statics import hanging_shape

LIMBER = 5e-8  # EI over m g L^3 of a chain: in a coarse mesh the tangent of its free end needs some
INEXTENSIBLE = 1e4  # EA over the weight of a chain
EASE = 10  # parts of the first step, each twice the one before: what was held lets go with an elastic jolt
RINGS = 0.01  # of the length, either side, over which its speed is averaged: elastic jolts run through it
BIGHTS = 2  # half waves in which a slack tether is laid
FALL_STEPS = 400  # steps of a real-time run over the time of a free fall, at least


def integrate(
    rig: Rig,
    step: float,
    longest: float,
    look: Callable[[Rig], tuple[float, ...]],
    done: Callable[[float, tuple[float, ...]], bool],
) -> np.ndarray:
    """Run from rest until done(t, looked) or ``longest`` [s]; rows of time [s] and what ``look`` saw after every step.

    The first step goes in growing parts and starts without accelerations: those that balance a line cut free are of
    its elastic jolt, and a long step predicted with them ends in another state (trap T5).
    """
    rows = [(0.0, *look(rig))]
    parts = 2.0 ** np.arange(EASE)
    while rows[-1][0] < longest and not done(rows[-1][0], rows[-1][1:]):
        for part in parts / parts.sum() if len(rows) == 1 else (1.0,):
            rig.run(step * part, step * part, rules=WHIPPING)
        rows.append((len(rows) * step, *look(rig)))
    return np.array(rows).T


def fall_step(level: Level, fall: float, coarsest: int) -> float:
    """Step [s]: the tick or the even share of it that gives FALL_STEPS over the time of a fall; verification finer."""
    if not level.realtime:
        return level.step(fall / coarsest)
    return level.tick / max(int(np.ceil(level.tick * FALL_STEPS / fall)), 1)


def hung_chain(length: float, apart: float, n: int, mass: float, gravity: float, ea: float, ei: float) -> Rig:
    """A chain at rest between two level points."""
    cable = uniform(length, n, mass, ea, bending_stiffness=ei, compression_share=FOLDING)
    rig = Rig(cable, held={0: "r", n: "r"}, tension=mass * gravity * length, gravity=gravity)
    rig.place(*hanging_shape(rig.arc, apart, 0.0))
    rig.state.q[-1, :3] = (apart, 0.0, 0.0)
    rig.settle()
    return rig


@family(
    "chain let go",
    "length_m end_separation_m mass_per_length_kg_m",
    how=f"settled between two level points, the far end let go; no damping, EI = {LIMBER:g} m g L^3, "
    f"EA = {INEXTENSIBLE:g} m g L; at least {FALL_STEPS} steps over sqrt(2 L/g); x from the end that stays, "
    f"drop from the level of the ends, speed as the mean over {RINGS:g} L of drop to either side",
)
def falling_chain(case: Case, level: Level) -> Values:
    """When, where and how fast the tip of a chain passes the drops asked for."""
    length, apart, mass = case.numbers("length_m end_separation_m mass_per_length_kg_m")
    if not 0.0 < apart <= length:
        raise CaseError(
            f"{case.path}: inputs.end_separation_m = {apart:g} lies outside 0..{length:g}; the case was not run"
        )
    gravity, n = case.gravity, 128 if level.realtime else level.mesh(64)
    weight = mass * gravity * length
    ea, ei = case.number("EA_N", INEXTENSIBLE * weight), case.number("EI_N_m2", LIMBER * weight * length**2)
    rig = hung_chain(length, apart, n, mass, gravity, ea, ei)
    rig.release(n)
    drops = {
        name: (m[1], float(m[2]))
        for name, m in case.asked(
            r"(time for the tip to drop|tip x when it has dropped|tip speed when it has dropped) ([\d.]+) L"
        )
    }
    maximum, fall = max([0.1, *(d for _, d in drops.values())]), float(np.sqrt(2.0 * length / gravity))
    step = fall_step(level, fall, FALL_STEPS)
    t, x, drop, speed = integrate(
        rig,
        step,
        3.0 * fall,
        lambda rig: (rig.state.q[-1, 0], -rig.state.q[-1, 2], float(np.linalg.norm(rig.state.v[-1, :3]))),
        lambda t, seen: seen[1] > (maximum + RINGS) * length,
    )
    of = {}
    for name, (what, fraction) in drops.items():
        at = crossings(t, drop, fraction * length)
        if len(at):
            if what.startswith("tip speed"):
                of[name] = float(speed[np.abs(drop - fraction * length) <= RINGS * length].mean())
            else:
                of[name] = float(np.interp(at[0], t, t if what.startswith("time") else x))
    return Values(of, n, step)


def bowed(rig: Rig, chord: float) -> None:
    """Lay the line down from the origin in bights in x, its ends ``chord`` [m] apart, one above the other.

    One bight over the whole length would whip: it takes 1 % of the speed of a load of a thousand times its mass. Slack
    close to the load takes less, but then the snap sets the cable ringing, and its peak grows with the mesh.
    """
    s, length = rig.arc / rig.arc[-1], rig.arc[-1]
    fine = np.linspace(0.0, 1.0, 4001)

    def angle(top: float) -> np.ndarray:
        return top * np.cos(BIGHTS * np.pi * fine)

    low, high = 0.0, 2.4  # at 2.4 rad the ends meet
    for _ in range(60):
        top = 0.5 * (low + high)
        low, high = (top, high) if trapezoid(np.cos(angle(top)), fine) * length > chord else (low, top)
    g = np.stack((np.sin(angle(top)), np.zeros_like(fine), -np.cos(angle(top))), 1)
    r = np.concatenate((np.zeros((1, 3)), np.cumsum(0.5 * (g[1:] + g[:-1]) * np.diff(fine)[:, None], axis=0))) * length
    rig.place(*(np.stack([np.interp(s, fine, y[:, k]) for k in range(3)], 1) for y in (r, g)))


@family(
    "weight dropped on a tether",
    "end_mass_kg tether_length_m EA_N tether_mass_per_length_kg_m free_fall_height_m",
    how=f"a light cable let go from {BIGHTS} bights, without bending stiffness; it straightens, snaps and buckles "
    f"by itself; engaged where its ends are further apart than its length; tension: mean along it; at least "
    f"{FALL_STEPS} steps over the free fall",
)
def drop_snap(case: Case, level: Level) -> Values:
    """Engagements, tensions and rebound of a weight that falls into its tether."""
    mass, length, ea = case.numbers("end_mass_kg tether_length_m EA_N")
    height, light = case.number("free_fall_height_m"), case.number("tether_mass_per_length_kg_m")
    gravity, n = case.gravity, 16 if level.realtime else level.mesh(8)
    if not 0.0 < height < 0.5 * length:
        raise CaseError(
            f"{case.path}: inputs.free_fall_height_m = {height:g} lies outside 0..{0.5 * length:g}, half "
            "the tether; the case was not run"
        )
    cable = uniform(length, n, light, ea, compression_share=FOLDING)
    rig = Rig(cable, held={0: "r"}, tension=mass * gravity, gravity=gravity, bodies={n: mass})
    bowed(rig, length - height)
    fall, swing = float(np.sqrt(2.0 * height / gravity)), float(2.0 * np.pi * np.sqrt(mass * length / ea))
    step = fall_step(level, fall, 2 * FALL_STEPS)

    def look(rig: Rig) -> tuple[float, ...]:
        end = rig.state.q[-1, :3]
        return (
            float(np.linalg.norm(end)),
            float(end[2]),
            float(np.linalg.norm(rig.state.v[-1, :3])),
            float(rig.state.tension.mean()),
        )

    t, apart, z, speed, tension = integrate(rig, step, 3.2 * fall + 2.0 * swing, look, lambda t, seen: False)
    events = crossings(t, apart, length)
    of, notes = {}, []
    if len(events) < 4:
        notes.append(f"only {len(events)} of 4 events were seen: at {', '.join(f'{x:.4g} s' for x in events)}")
    if len(events) >= 2:
        taut = (t > events[0]) & (t < events[1])
        of = {
            "speed at engagement": float(np.interp(events[0], t, speed)),
            "largest tension": float(tension[taut].max()),
            "duration of the first taut phase": float(events[1] - events[0]),
        }
    if len(events) >= 4:
        loose, again = (t > events[1]) & (t < events[2]), (t > events[2]) & (t < events[3])
        of |= {
            "height of rebound above engagement": float(z[loose].max() + length),
            "time between first and second engagement": float(events[2] - events[0]),
            "largest tension at second engagement": float(tension[again].max()),
        }
        notes.append(
            f"while it buckled the tether pushed with up to {max(-tension[loose].min(), 0.0):.0f} N, "
            f"{-np.minimum(tension[loose], 0.0).sum() * step:.2g} N s in all: its own inertia sideways"
        )
    return Values(of, n, step, notes)
