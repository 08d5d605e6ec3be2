"""P8 and P9: cable by the hundred metres. 250 m of full_scale hauled in and out, a deep tow hauled in under waves.

P8 is on the mean track, so that what moves in the tension is the mesh's or the winch's. After the haul it comes to rest
as slowly as the cable's mean flow does (`cable.mean_flow_time`), so it is looked at twice, and once with a short one.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.scenes.winch_plan import WinchPlan
from cable_sim_ros.io.sources.motion_table import read_table
from cable_sim_ros.io.sources.recorded_tow import RecordedTow
from cable_sim_ros.runs.message_run import Progress, silent
from cable_sim_ros.runs.offline import stepped
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator

from ..meshes.mesh_tows import armoured, one, tow
from ..shipped import started
from .row import Row
from .tow_bench import (
    compared,
    drive,
    errors,
    mesh_numbers,
    of_reference,
    refined,
    sampled,
    shown_setting,
    simulated,
    timed,
)
from .turns import in_turn

METRES, RATE = 250.0, 1.0  # m, m/s of P8
BEFORE = 20.0  # s held before a haul
STARTED = 60.0  # s of a haul until what its beginning struck has died away
MEAN = 2.0  # s, ripple of the tension is about a mean of this length
RESTS = (300.0, 900.0, 1800.0)  # s after a haul
SHORT_MEMORY = 1.0  # s, mean flow with which rest is reached at once
PIECE = 20.0  # s run at once


def go(sim: Simulator, seconds: float, plan: str = "0 hold") -> tuple[np.recarray, float]:
    """Tick outputs of so many seconds with a winch plan that begins now, and the CPU time [s] they took."""
    orders, drum, tick = WinchPlan(plan), sim.model.settings[0].drum, int(sim.model.settings[0].tick_ns)
    begin, cpu, parts = int(sim.frame.time), 0.0, []
    left = round(seconds * 1e9) // tick
    while left:
        now, count = int(sim.frame.time), min(left, round(PIECE * 1e9) // tick)
        for command in orders.commands(drum, begin, now, now + count * tick):
            sim.push(command)
        clock = time.process_time()
        parts.append(sim.run(count))
        cpu += time.process_time() - clock
        left -= count
    return np.concatenate(parts).view(np.recarray), cpu


class Haul(NamedTuple):
    """What a haul of METRES showed: CPU s per simulated s, corrections and steps, largest step of the tension from tick
    to tick and rms ripple [N] at constant speed, and after each of RESTS the distance [m] and tension [N] from the
    static start of that length."""

    cpu: float
    iterations: float
    steps: float
    jump: float
    ripple: float
    away: tuple[float, ...]
    off: tuple[float, ...]


def haul(sim: Simulator, rate: float, static: np.record) -> Haul:
    """Haul METRES at ``rate`` [m/s, out positive], then rest, against the tick output of a static start there."""
    frames, cpu = go(sim, METRES / RATE, f"0 rate {rate:g}")
    tick = sim.scene.solver.tick
    jump, ripple = smoothness(frames.tension[round(STARTED / tick) :], tick)
    away, off, done = [], [], 0.0
    for until in RESTS:
        go(sim, until - done)
        done = until
        frame = sim.frame
        away.append(float(np.linalg.norm(_hung(frame) - _hung(static))))
        off.append(float(frame.tension - static.tension))
    return Haul(
        cpu / (len(frames) * tick),
        float(frames.iterations.sum()),
        float(frames.substeps.sum()),
        jump,
        ripple,
        tuple(away),
        tuple(off),
    )


def smoothness(tension: np.ndarray, tick: float) -> tuple[float, float]:
    """Largest step [N] of a tension from tick to tick, rms ripple [N] about its running mean over MEAN."""
    width = 2 * round(0.5 * MEAN / tick) + 1
    mean = np.convolve(tension, np.full(width, 1.0 / width), "valid")
    inside = tension[width // 2 : len(tension) - width // 2]
    return float(np.abs(np.diff(tension)).max()), float(np.sqrt(((inside - mean) ** 2).mean()))


def _hung(frame: np.record) -> np.ndarray:
    """Towbody from the sheave [m]."""
    return np.array(frame.body_position) - np.array(frame.sheave_position)


HAULS = {  # rows of P8: what of the scene is changed
    "20 ms": {"solver.tick": 0.02},
    "50 ms": {"solver.tick": 0.05},
    f"50 ms, mean flow {SHORT_MEMORY:g} s": {"solver.tick": 0.05, "cable.mean_flow_time": SHORT_MEMORY},
}


def hauled(repeats: int, progress: Progress = silent) -> list[Row]:
    """P8: each setting once to its rests, then its hauls ``repeats`` times in turn for the speed."""
    base = override(load_scene("full_scale"), {"setpoint.algorithm": "hold"})
    scenes = [override(base, values) for values in HAULS.values()]
    names, found = [f"P8 {name}" for name in HAULS], []
    for k, scene in enumerate(scenes):
        progress(names[k], k, len(scenes))
        sim = started(scene)
        first = sim.frame.copy()
        go(sim, BEFORE)
        hauled_in = override(scene, {"winch.scope": float(first.scope) - METRES})
        short = started(hauled_in, layout_of(scene).mesh).frame
        inward = haul(sim, -RATE, short)
        outward = haul(sim, RATE, first)
        found.append((inward, outward, float(sim.frame.scope - first.scope)))
    times, _ = in_turn([partial(_both_ways, scene) for scene in scenes], repeats, progress, names)
    return [_haul_row(name, scene, statistics.median(t), *f) for name, scene, t, f in zip(HAULS, scenes, times, found)]


def _both_ways(scene: Scene) -> tuple[float, None]:
    """CPU time [s per simulated s] of a haul in and out again."""
    sim = started(scene)
    go(sim, BEFORE)
    frames, cpu = zip(*(go(sim, METRES / RATE, f"0 rate {rate:g}") for rate in (-RATE, RATE)))
    return sum(cpu) / sum(simulated(f, scene) for f in frames), None


def _haul_row(name: str, scene: Scene, cpu: float, inward: Haul, outward: Haul, missing: float) -> Row:
    numbers = mesh_numbers(scene)
    metrics = {"realtime_factor": 1.0 / cpu, "scope_missing_m": missing}
    for way, one_way in (("in", inward), ("out", outward)):
        metrics |= {f"{way}_step_n": one_way.jump, f"{way}_ripple_rms_n": one_way.ripple}
        for rest, away, off in zip(RESTS, one_way.away, one_way.off):
            metrics |= {f"{way}_{rest:g}_s_place_m": away, f"{way}_{rest:g}_s_tension_n": off}
    places = ", ".join(
        f"{way} {' / '.join(f'{1e3 * a:.1f}' for a in h.away)} mm, {' / '.join(f'{o:+.2f}' for o in h.off)} N"
        for way, h in (("in", inward), ("out", outward))
    )
    iterations = inward.iterations + outward.iterations
    elements, steps = sum(numbers), inward.steps + outward.steps
    return Row(
        "P8",
        "cable_sim_ros",
        f"hold, feed {'-'.join(map(str, numbers))}, {name}",
        elements,
        scene.solver.tick,
        max(abs(inward.off[-1]), abs(outward.off[-1])) / scene.contact.working_tension,
        max(inward.away[-1], outward.away[-1]),
        cpu,
        1e6 * cpu * 2.0 * METRES / RATE / (elements * max(iterations, 1.0)),
        iterations / steps,
        f"{1.0 / cpu:.0f} x real time while hauling; step {inward.jump:.2f} / {outward.jump:.2f} N, ripple "
        f"{inward.ripple:.3f} / {outward.ripple:.3f} N rms in / out; from a static start "
        f"{' / '.join(f'{r:g}' for r in RESTS)} s after: {places}",
        metrics,
    )


DEEP_SCOPE, DEEP_HAUL, DEEP_RATE = 6000.0, 300.0, 0.75  # m, m, m/s
DEEP_BEGIN, DEEP_SECONDS = 60.0, 520.0  # s
HEIGHT, PERIOD, PEAK = 2.5, 9.0, 3.3  # JONSWAP: significant height m, peak period s, peakedness
COMPONENTS, SEED, RISE = 96, 20251122, 20.0  # RISE s: over which the heave grows from nothing
DEEP_TICKS = (0.02, 0.05, None)  # s; None: chosen by error
DEEP_FINE = 0.01


def deep_scene() -> Scene:
    """6 km of 17.3 mm cable at 0.8 m/s.

    The diameter is that of the 0.68 inch armoured cable with conductors and fibres that deep tows use (WHOI, BIOMAPER);
    mass, EA and EI are those of Westin (2018) Table 8 scaled to it: 1.16 kg/m, 20.3 MN, 12.5 N m^2.
    """
    body = {"mass": 1000.0, "net_weight": 7000.0, "added_mass": (100.0, 800.0, 800.0), "drag_area": (0.4, 1.5, 1.5)}
    return tow(
        "deep_tow",
        one(DEEP_SCOPE + 400.0, drag_amplification=1.5),
        DEEP_SCOPE,
        speed=0.8,
        cable=armoured(0.0173),
        body=body,
        sheave=0.5,
        setpoint={"algorithm": "hold"},
    )


def jonswap(seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Time [s] and heave [m] of a sea of HEIGHT and PERIOD, the same every time."""
    frequency = np.linspace(0.6, 2.6, COMPONENTS + 1) / PERIOD
    step, frequency = frequency[1] - frequency[0], 0.5 * (frequency[1:] + frequency[:-1])
    fraction = frequency * PERIOD
    width = np.where(fraction <= 1.0, 0.07, 0.09)
    spectrum = fraction**-5.0 * np.exp(-1.25 * fraction**-4.0) * PEAK ** np.exp(-0.5 * ((fraction - 1.0) / width) ** 2)
    amplitude = np.sqrt(2.0 * spectrum * step)
    amplitude *= HEIGHT / 4.0 / np.sqrt(0.5 * (amplitude**2).sum())
    random = np.random.default_rng(SEED)
    frequency = frequency + step * (random.random(COMPONENTS) - 0.5)  # uneven, or the sea repeats itself
    phase = 2.0 * np.pi * random.random(COMPONENTS)
    t = np.arange(round(seconds / SAMPLED) + 1) * SAMPLED
    rise = np.where(t < RISE, 0.5 - 0.5 * np.cos(np.pi * np.minimum(t / RISE, 1.0)), 1.0)
    return t, rise * (np.cos(2.0 * np.pi * np.outer(t, frequency) + phase) @ amplitude)


SAMPLED = 0.1  # s between the rows of the sea


def sea(scene: Scene, seconds: float) -> RecordedTow:
    """The sea as the heave of the ship."""
    t, heave = jonswap(seconds + 2.0)
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / "sea.csv"
        np.savetxt(table, np.column_stack([t, heave]), "%.9g", ",", header="time_s,heave_m", comments="")
        return read_table(table, scene.ship)


def deep_tow(repeats: int, progress: Progress = silent) -> list[Row]:
    """P9: DEEP_HAUL hauled in under waves, every step in turn, against a refined mesh and step."""
    base = deep_scene()
    motion = sea(base, DEEP_SECONDS)
    begin, end = DEEP_BEGIN, DEEP_BEGIN + DEEP_HAUL / DEEP_RATE
    plan = WinchPlan(f"0 hold, {begin:g} rate {-DEEP_RATE:g}, {end:g} hold")
    scenes = [stepped(base, "chosen" if tick is None else "fixed", tick) for tick in DEEP_TICKS]
    jobs = [partial(timed, scene, motion, None, plan, DEEP_SECONDS) for scene in scenes]
    times, last = in_turn(jobs, repeats, progress, [f"P9 {scene.solver.tick:g} s" for scene in scenes])
    fine, check = refined(base, 1, DEEP_FINE), refined(base, 2, DEEP_FINE)
    driven, checked = (drive(by.scene, motion, by.mesh, plan, DEEP_SECONDS) for by in (fine, check))
    reference = sampled(driven.frames, fine.scene)
    rows = [
        _deep_row(scene, one_run.frames, statistics.median(t), reference)
        for scene, one_run, t in zip(scenes, last, times)
    ]
    wrong = errors(reference, sampled(checked.frames, check.scene))
    rows.append(of_reference("P9", "hold", fine, check, driven, wrong))
    return rows


def _deep_row(scene: Scene, frames: np.recarray, cost: float, fine: np.recarray) -> Row:
    row = compared("P9", shown_setting("hold", "feed", scene), scene, frames, cost, fine)
    tension = sampled(frames, scene).tension
    mean, deviation, rms = float(tension.mean()), float(tension.std()), row.metrics["rms_difference_n"]
    metrics = row.metrics | {
        "tension_mean_n": mean,
        "tension_std_n": deviation,
        "min_tension_n": float(tension.min()),
        "body_risen_m": float(frames.body_position[-1, 2] - frames.body_position[0, 2]),
    }
    note = f"tension {mean / 1e3:.1f} kN, std {deviation / 1e3:.2f} kN, rms difference {rms:.0f} N"
    return row._replace(note=f"{row.note}; {note}", metrics=metrics)
