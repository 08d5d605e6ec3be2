"""N26: random scenes of a user, each in a child process with a time bound: how they end, in classes.

Scenes as a user might write them, drawn from a seed: both drums, soft and stiff cables, bodies, seabed, shear.
"""

from __future__ import annotations

import re
from collections import Counter
from math import cos, pi, radians, sin
from typing import NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.load import SceneError, scene_from_dict
from cable_sim_ros.physics.heave_compensation import LAWS
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator, SolverError, StartError

from ..shipped import quiet, started
from .apart import DiedError, apart
from .n27_starts import wrong_rest
from .tows import Sea, finite, held, reel, sail
from .verdict import Found, Metric, stress

SEED, SCENES, QUICK = 11, 170, 12
SEA, QUICK_SEA = 30.0, 3.0  # s
BOUND = 120.0  # s of wall time for one scene
PART, EVERY = 0.5, 5.0  # s between two commands of the winch, and two of its rates
STILL, STILL_SPEED, STILL_TENSION = 2.0, 0.05, 0.02  # s without motion: m/s of the body, share of the tension
DOUBT = Flag.SLACK | Flag.DETACHED | Flag.PENETRATION | Flag.COARSE_AT_SURFACE | Flag.SLACK_ENERGY
OK, DOUBTFUL, SCENE, START, HALTED = "ok", "doubtful by flags", "scene refused", "start refused", "halted"
CRASH, HANG, NOT_FINITE, FALSE, NO_CAUSE = "crash", "hang", "not finite", "rest that is none", "no cause named"
GOOD, BAD = (OK, DOUBTFUL, SCENE, START, HALTED), (CRASH, HANG, NOT_FINITE, FALSE, NO_CAUSE)
NAMED = re.compile(r"\b(ship|water|cable|winch|sheave|seabed|towbody|bodies|solver|mesh|accuracy|contact)\.\w+")
DENSITY, GRAVITY = 1026.0, 9.81
# name of the cable, density [kg/m^3] and Young's modulus [N/m^2] of its cross-section: steel, synthetic, umbilical
MATERIALS = (("steel", 6500.0, 8e10), ("fibre", 1300.0, 2e10), ("umbilical", 2200.0, 3e9), ("soft", 1400.0, 6e8))
LONGEST, SHORTEST = 600.0, 8.0  # m of scope
SPARE = 30.0  # m of cable on a drum that feeds
SEA_HEAVE, SEA_PERIOD = 3.0, (5.0, 14.0)  # m, s
MAX_RATE = 1.5  # m/s of a winch plan


class End(NamedTuple):
    """How a scene ended."""

    what: str
    text: str = ""  # of the refusal or the halt, or what is wrong
    flags: int = 0
    deepest: float = 0.0  # penetration over the diameter
    tension: float = 0.0  # largest, over contact.working_tension
    gained: float = 0.0  # energy gained in slack, of the work


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def rounded(value: float, digits: int = 3) -> float:
    """As a user writes it."""
    return float(f"{value:.{digits}g}")


def draw(rng: np.random.Generator) -> dict:
    """Plain data of a scene."""
    scope, speed = (
        rounded(between(rng, SHORTEST, LONGEST)),
        rounded(rng.choice((0.0, 1.0, 1.0)) * rng.uniform(0.3, 3.0)),
    )
    cable, drag = drawn_cable(rng), rounded(rng.uniform(1.0, 2.5))
    towbody = drawn_body(rng)
    feeds = rng.random() < 0.7
    sections = drawn_sections(rng, scope, feeds, drag)
    radius = rounded(max(rng.uniform(0.15, 0.6), 12.0 * cable["diameter"]))
    fall = rng.uniform(2.0, 6.0)
    heading = rounded(rng.uniform(-180.0, 180.0))
    current, gradient = drawn_current(rng, scope, heading)
    water = {"current": current, "current_gradient": gradient}
    push = 0.6 * DENSITY * cable["diameter"] * drag * scope * (speed + np.hypot(*current)) ** 2
    weight = towbody["net_weight"] + cable["mass_per_length"] * GRAVITY * scope
    scene = {
        "name": "drawn",
        "ship": {"tow_speed": speed, "heading_deg": heading},
        "water": water,
        "cable": cable | {"sections": sections},
        "winch": {"position": [-28.0, 0.0, 3.0], "drum_radius": rounded(rng.uniform(0.2, 0.8))},
        "setpoint": {"algorithm": LAWS[int(rng.choice(5, p=(0.6, 0.1, 0.1, 0.1, 0.1)))].value},
        "sheave": {
            "position": [-36.0, 0.0, rounded(fall)],
            "radius": radius,
            "groove_depth": rounded(cable["diameter"] * rng.uniform(1.5, 4.0)),
            "throat_angle_deg": rounded(rng.uniform(40.0, 70.0)),
        },
        "contact": {"working_tension": rounded(1.5 * (weight + 0.5 * push), 2)},
        "towbody": towbody,
        "solver": {"tick": float(rng.choice((0.01, 0.02)))},
    }
    if feeds:
        scene["winch"]["scope"] = scope
    else:
        scene["winch"] |= {"drum": "contact", "wrap": rounded(rng.uniform(5.0, 12.0))}
        length = scene["winch"]["wrap"] * scene["winch"]["drum_radius"] * 1.02
        sections["drum"] = {"length": rounded(length), "elements": 24}
        scene["cable"]["sections"] = {"drum": sections.pop("drum")} | sections
    if rng.random() < 0.2:
        scene["seabed"] = {"depth": rounded(scope * rng.uniform(0.3, 1.5))}
    if "faired" in sections and rng.random() < 0.3:
        scene["bodies"] = {"depressor": drawn_body(rng) | {"at": "bare"}}
    return scene


def drawn_cable(rng: np.random.Generator) -> dict:
    """Plain data of a cable without its sections."""
    _, density, modulus = MATERIALS[int(rng.choice(len(MATERIALS), p=(0.4, 0.25, 0.2, 0.15)))]
    diameter = rounded(between(rng, 0.006, 0.025))
    area = 0.25 * pi * diameter**2
    stiffness = rounded(modulus * area * between(rng, 0.5, 2.0))
    cable = {
        "diameter": diameter,
        "mass_per_length": rounded(density * area),
        "axial_stiffness": stiffness,
        "bending_stiffness": rounded(stiffness * diameter**2 / 16.0 * between(rng, 1e-3, 0.1)),
        "axial_damping": rounded(stiffness * rng.choice((0.0, 1e-4, 1e-3))),
    }
    if rng.random() < 0.15:
        cable["compression_share"] = float(rng.choice((0.0, 1e-7, 1e-3, 0.1)))
    return cable


def drawn_sections(rng: np.random.Generator, scope: float, feeds: bool, drag: float) -> dict:
    """Plain data of the sections outboard, and what is inboard of them."""
    faired = rounded(scope * rng.uniform(0.05, 0.5)) if rng.random() < 0.6 else 0.0
    plain, amplified = {"drag_amplification": drag, "drag_amplification_of": "both"}, {}
    if faired:
        amplified["faired"] = {"length": faired, "fairing": str(rng.choice(("ribbon", "airfoil", "hair")))}
    if feeds:
        return {"bare": {"length": rounded(scope - faired + SPARE, 4)} | plain} | amplified
    last = {name: section | {"elements": 12} for name, section in amplified.items()}
    span = {"span": {"length": 7.0, "elements": 3}, "sheave": {"length": 5.0, "elements": 80}}
    return span | {"bare": {"length": rounded(max(scope - faired, 4.0), 4), "elements": 16} | plain} | last


def drawn_body(rng: np.random.Generator) -> dict:
    """Plain data of a body that sinks."""
    mass = rounded(between(rng, 15.0, 1500.0))
    area = (mass / 1000.0) ** (2.0 / 3.0)
    return {
        "mass": mass,
        "net_weight": rounded(mass * GRAVITY * rng.uniform(0.1, 0.85)),
        "added_mass": [rounded(mass * fraction) for fraction in (0.1, 0.6, 0.8)],
        "drag_area": [rounded(area * fraction) for fraction in (0.1, 0.8, 1.0)],
        "lift_area": rounded(-0.3 * area * rng.choice((0.0, 0.0, 1.0))),
    }


def drawn_current(rng: np.random.Generator, scope: float, heading: float) -> tuple[list[float], list[float]]:
    """Current at the surface [m/s], within 60 deg of ahead or astern, and its gradient [1/s]: over the
    scope it grows by half of itself, by itself or not at all."""
    if rng.random() < 0.5:
        return [0.0, 0.0], [0.0, 0.0]
    speed, turn = rng.uniform(0.1, 0.8), radians(heading + rng.choice((0.0, 180.0)) + rng.uniform(-60.0, 60.0))
    east, north = speed * cos(turn), speed * sin(turn)
    fraction = rng.choice((0.0, 0.5, 1.0)) / scope
    return [rounded(east), rounded(north)], [rounded(east * fraction), rounded(north * fraction)]


def drawn_sea(rng: np.random.Generator) -> dict:
    """Heave, pitch and roll as `tows.Sea` takes them."""
    heave, period = rounded(rng.uniform(0.0, SEA_HEAVE)), rounded(rng.uniform(*SEA_PERIOD))
    return {
        "heave": (heave, period, 0.0),
        "pitch": (0.01 * heave, period, 1.0),
        "roll": (0.03 * heave, 1.1 * period, 0.5),
        "yaw": (0.01, 2.0 * period, 0.2),
    }


def drawn_winch(rng: np.random.Generator) -> list[float]:
    """Rates of pay-out [m/s], one for every five seconds; empty: no commands."""
    if rng.random() < 0.6:
        return []
    return [rounded(rate) for rate in rng.uniform(-MAX_RATE, MAX_RATE, 8)]


def scene_of(number: int, seed: int = SEED) -> tuple[Scene, dict, list[float]]:
    """Scene, sea and rates of the winch of one number. Raises SceneError."""
    rng = np.random.default_rng((seed, number))
    data, sea, rates = draw(rng), drawn_sea(rng), drawn_winch(rng)
    with quiet():
        return scene_from_dict(data, f"random scene {number}"), sea, rates


def refused(what: str, error: Exception) -> End:
    """A refusal that names a key, or one without a cause."""
    return End(what if NAMED.search(str(error)) else NO_CAUSE, str(error))


def moves(sim: Simulator) -> str:
    """What moves of a tow that is said to be at rest, in words; empty: nothing. The tow is as it was, after."""
    kept, tension = sim.snapshot(), float(sim.frame.tension)
    try:
        last = sim.run(round(STILL / sim.scene.solver.tick))[-1]
    except SolverError as error:
        return f"it halts without any motion: {error}"
    sim.restore(kept)
    speed = float(np.linalg.norm(last.body_velocity - last.ship_velocity))
    if speed > STILL_SPEED or abs(last.tension / tension - 1.0) > STILL_TENSION:
        return f"after {STILL:g} s the body moves with {speed:.3g} m/s, {tension:.5g} N have become {last.tension:.5g}"
    return ""


def sailed(number: int, seconds: float, seed: int = SEED) -> End:
    """Run one scene."""
    try:
        scene, waves, rates = scene_of(number, seed)
    except SceneError as error:
        return refused(SCENE, error)
    try:
        sim = started(scene)
    except StartError as error:
        return refused(START, error)
    wrong = wrong_rest(sim) or moves(sim)
    if wrong:
        return End(FALSE, wrong)
    yaw = np.radians(scene.ship.heading_deg)
    sea, flags, deepest, tension, halt = Sea(scene, heading=yaw, **waves), 0, 0.0, 0.0, None
    for part in range(round(seconds / PART)):
        rate = rates[int(part * PART / EVERY) % len(rates)] if rates else None
        try:
            frames = sail(sim, sea, PART) if rate is None else reel(sim, rate, PART, sea)
        except SolverError as error:
            halt = refused(HALTED, error)
            break
        if not finite(frames):
            return End(NOT_FINITE, f"in the {PART:g} s after {part * PART:g} s", flags)
        flags |= int(np.bitwise_or.reduce(frames.status))
        deepest, tension = max(deepest, frames.penetration.max()), max(tension, frames.tension_most.max())
    account, contact = sim.state.now.account, scene.contact
    end = End(
        DOUBTFUL if flags & DOUBT else OK,
        "",
        flags,
        float(deepest) / scene.cable.diameter,
        float(tension) / contact.working_tension,
        float(account.gained) / max(float(account.turned), 1e-9),
    )
    return end if halt is None else end._replace(what=halt.what, text=halt.text)


def ended(number: int, seconds: float) -> End:
    """How a scene ends in a process of its own: one that dies or raises is a crash, one that lasts too long a hang."""
    try:
        return apart(_sailed, number, seconds, timeout=BOUND, copy=True)
    except TimeoutError as error:
        return End(HANG, str(error))
    except DiedError as error:
        return End(CRASH, str(error))


def _sailed(number: int, seconds: float) -> End:
    try:
        return sailed(number, seconds)
    except Exception as error:  # it is what is looked for
        return End(CRASH, f"{type(error).__name__}: {error}")


@stress("170 random scenes in a random sea", "0 crash, hang, not finite, false rest; every refusal names its cause")
def scenes(quick: bool) -> Found:
    """Each scene started, held still for two seconds, then through its sea."""
    count, seconds = (QUICK, QUICK_SEA) if quick else (SCENES, SEA)
    started(held()).run(1)  # the kernels are there before the first fork
    ends = [ended(n, seconds) for n in range(count)]
    counts = Counter(end.what for end in ends)
    flags = Counter(flag.name for end in ends for flag in Flag if flag and end.flags & flag)
    deep = [end.deepest for end in ends if end.deepest > 0.5]
    metrics = [
        Metric("scenes", count),
        *(Metric(what, counts[what]) for what in GOOD),
        *(Metric(what, counts[what], "", 0) for what in BAD),
        *(Metric(f"with flag {name}", flags[name]) for name in sorted(flags)),
        Metric("deeper than half a diameter", len(deep)),
        Metric(
            "of these, tension above contact.working_tension by half",
            sum(end.deepest > 0.5 and end.tension > 1.5 for end in ends),
        ),
        Metric("deepest penetration over the diameter", max((end.deepest for end in ends), default=0.0)),
        Metric("most energy gained in slack, of the work", max((end.gained for end in ends), default=0.0)),
    ]
    notes = [f"scene {n}: {end.what}: {end.text}" for n, end in enumerate(ends) if end.what not in (OK, DOUBTFUL)]
    return Found(metrics, notes)
