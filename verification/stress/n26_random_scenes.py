"""N26: random scenes of a user, each in a child process with a time bound: how they end, in classes."""

from __future__ import annotations

import re
from collections import Counter
from typing import NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.load import SceneError, scene_from_dict
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator, SolverError, StartError

from ..shipped import quiet, started
from .apart import DiedError, apart
from .n27_starts import wrong_rest
from .random_scenes import draw, drawn_sea, drawn_winch
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


class End(NamedTuple):
    """How a scene ended."""

    what: str
    text: str = ""  # of the refusal or the halt, or what is wrong
    flags: int = 0
    deepest: float = 0.0  # penetration over the diameter
    tension: float = 0.0  # largest, over contact.working_tension
    gained: float = 0.0  # energy gained in slack, of the work


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
