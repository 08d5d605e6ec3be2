"""N7, N11: ten kilometres of cable, a day of simulation."""

from __future__ import annotations

import gc
import os
import time
from pathlib import Path

import numpy as np

from cable_sim_ros.sim.simulator import Simulator

from ..shipped import started
from .tows import Sea, held, sail
from .verdict import Found, Metric, holds, relative, stress

DAY = 86400.0


@stress("10 km cable", "ready <= 60 s, tension 0.1 %")
def long_cable(quick: bool) -> Found:
    """Hanging in still water from the sheave, on the mesh that is made for it."""
    begin = time.perf_counter()
    scene = held(
        ship__tow_speed=0.0,
        cable__sections={"deep": {"length": 10100.0}},
        winch__scope=10000.0,
        contact__working_tension=40000.0,
        towbody__lift_area=0.0,
    )
    sim = started(scene)
    ready = time.perf_counter() - begin
    frame, cable, water = sim.frame, scene.cable, scene.water
    # wet weight below the surface, dry weight above it, of unstretched length; the weight is there stretched or not
    line = sim.shape[int(sim.shape[:, 2].argmax()) :]  # from the top of the sheave on
    at = float(np.interp(0.0, -line[:, 2], line[:, 4]))  # arc length at the waterline
    leaves = float(np.interp(0.0, -(line[:, 2] - frame.sheave_position[2]), line[:, 4]))
    dry = cable.mass_per_length * scene.gravity
    wet = dry - water.density * 0.25 * np.pi * cable.diameter**2 * scene.gravity
    want = scene.towbody.net_weight + wet * (line[-1, 4] - at) + dry * (at - leaves)
    strain = (scene.towbody.net_weight * 10000.0 + 0.5 * wet * 10000.0**2) / cable.axial_stiffness
    seconds, depth = 5.0 if quick else 60.0, line[-1, 4] - at + strain
    frames = sim.run(round(seconds / scene.solver.tick))
    change = float(np.abs(frames.tension / frame.tension - 1.0).max())
    metrics = [
        Metric("ready after", ready, "s", 60.0),
        relative("tension at the sheave against the weights below it", frame.tension, want, 1e-3),
        relative("depth of the body against unstretched length and stretch", -frame.body_position[2], depth, 1e-3),
        Metric(f"change of the tension in {seconds:g} s", change, "", 1e-3),
    ]
    return Found(
        metrics, [f"{frame.tension:.1f} N, want {want:.1f} N, {sim.nodes - 1} elements; kernels compiled before"]
    )


def resident() -> float:
    """Memory of this process that is in use [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@stress("24 h simulated", "drift <= 0.1 %, time exact in integer ns, memory +5 MB at most")
def day(quick: bool) -> Found:
    """The shipped tow at long ticks in a long swell: every whole period must be as the first settled one."""
    seconds, period, tick = (1200.0 if quick else DAY), 10.0, 0.05
    scene = held(solver__tick=tick)
    sim: Simulator = started(scene)
    sea = Sea(scene, heave=(0.5, period, 0.0))
    means, memory, done = [], [], 0.0
    start, settled = int(sim.state.now.time.now), 300.0
    while done < seconds:
        # five samples a second: exact at the samples, cubic between
        means += sail(
            sim,
            sea,
            100.0,
            rate=5.0,
            keep=lambda f: (float(f.tension.mean()), float(f.tension_body.mean()), float(f.body_position[:, 2].mean())),
        )
        done += 100.0
        if done >= settled and round(done) % 300 == 0:
            gc.collect()
            memory.append(resident())
    means = np.array(means)
    base = means[int(settled / 10.0) : int(settled / 10.0) + 10].mean(0)
    drift = np.abs(means[int(settled / 10.0) :] / base - 1.0).max(0)
    wanted = start + round(done / tick) * round(tick * 1e9)
    metrics = [
        Metric("drift of the mean tension of a period", float(drift[0]), "", 1e-3),
        Metric("drift of the mean tension at the body", float(drift[1]), "", 1e-3),
        Metric("drift of the mean depth", float(drift[2]), "", 1e-3),
        Metric("nanoseconds beside ticks times step", int(sim.frame.time) - wanted, "ns", 0),
        holds("stamp is an integer", sim.frame.time.dtype == np.dtype("i8")),
        Metric("memory gained after the first 300 s", (max(memory) - memory[0]) / 1e6, "MB", 5.0),
        Metric("memory gained at the end", (memory[-1] - memory[0]) / 1e6, "MB", 5.0),
    ]
    return Found(
        metrics,
        [
            f"{done:g} s in ticks of {1e3 * tick:g} ms, {len(sim.state.arc) - 1} elements, heave 0.5 m, {period:g} s; "
            "means over each period" + ("; shortened from 24 h" if quick else "")
        ],
    )
