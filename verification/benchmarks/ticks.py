"""Longest tick in real time with the winch at work. ``cable-sim bench --ticks``.

The real-time loop of the node (ros/loop.py), fed with a heave and a winch plan as they go, without topics: the work of
a tick is from its waking to its tick output, with caches as cold as the sleep left them.
"""

from __future__ import annotations

import time
from math import cos, pi, radians, sin
from typing import NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.scenes.winch_plan import WinchPlan
from cable_sim_ros.ros.loop import REACHED, SKIPPED, Loop
from cable_sim_ros.runs.message_run import Progress, silent
from cable_sim_ros.sim.build import make_output
from cable_sim_ros.sim.inputs import ShipMotion, WinchCommand
from cable_sim_ros.sim.inputs import push as push_to
from cable_sim_ros.sim.loop import DONE, WAKE
from cable_sim_ros.sim.simulator import Simulator
from cable_sim_ros.terminal import markdown_table

TICK = 0.01  # s
SECONDS, RATE = 60.0, 2.0  # s, m/s: in for half the time, then out again
HEAVE, PERIOD_S = 1.0, 8.0  # m, s
ROWS, POLL = 128, 0.2  # rows of the ring, s between looks at it
AHEAD, SAMPLE = 1.0, 0.02  # s that inputs are pushed ahead; s between samples of motion
REHEARSED = 20  # ticks before the loop, as in the node
PRIORITY = 60  # of SCHED_FIFO where it is allowed
SECOND = 1_000_000_000
SHARES = (0.5, 0.99, 0.999, 1.0)


class Ticks(NamedTuple):
    """Elements, metres moved, scheduler, ticks, missed ones, and the work of a tick [ms]: median, 99 %, 99.9 %,
    longest."""

    elements: int
    travel: float
    scheduler: str
    ticks: int
    missed: int
    p50: float
    p99: float
    p999: float
    longest: float


def ticks(seconds: float | None = None, progress: Progress = silent) -> Ticks:
    """full_scale at 100 Hz with compensation, so many seconds, SECONDS by default. Raises RuntimeError at a halt."""
    seconds = SECONDS if seconds is None else seconds
    scene = override(load_scene("full_scale"), {"solver.tick": TICK})
    sim = Simulator(scene)
    sim.warm_up()
    sim.start()
    plan = WinchPlan(f"0 rate {-RATE:g}, {0.5 * seconds:g} rate {RATE:g}, {seconds:g} hold")
    drum, speed, yaw = sim.model.settings[0].drum, scene.ship.tow_speed, radians(scene.ship.heading_deg)
    pushed = 0

    def give(item: ShipMotion | WinchCommand, now: int) -> None:
        push_to(sim.inputs, item, now, scene.ship.max_gap)

    def push(now: int) -> None:
        """Motion and commands from where they end to AHEAD of now [ns]."""
        nonlocal pushed
        until, every = max(pushed, now + round(AHEAD * SECOND)), round(SAMPLE * SECOND)
        for command in plan.commands(drum, 0, pushed, until):
            give(command, now)
        for k in range(-(-pushed // every), -(-until // every)):
            t, omega = k * SAMPLE, 2.0 * pi / PERIOD_S
            height = scene.ship.reference_height + HEAVE * sin(omega * t)
            sample = ShipMotion(
                time_ns=k * every + 1,
                position=(speed * t * cos(yaw), speed * t * sin(yaw), height),
                velocity=(speed * cos(yaw), speed * sin(yaw), HEAVE * omega * cos(omega * t)),
                rate=(0.0, 0.0, 0.0),
                attitude=(0.0, 0.0, yaw),
            )
            give(sample, now)
        pushed = until

    push(0)
    minimum = maximum = float(sim.run(REHEARSED).payout[-1])
    now, period = int(sim.frame.time), int(sim.model.settings[0].tick_ns)
    output = make_output(sim.model, sim.nodes, ROWS)
    loop = Loop(sim.model, sim.state, sim.inputs, output, period_ns=period, priority=PRIORITY)
    loop.start(now, time.monotonic_ns() - now + SECOND // 10)
    work, seen, wanted = [], 0, round(seconds * SECOND) // period
    try:
        while seen < wanted and loop.running:
            time.sleep(POLL)
            count = loop.count
            rows = [k % ROWS for k in range(seen, count)]
            work += list(loop.stats[rows, DONE] - loop.stats[rows, WAKE])
            payout = output.frame["payout"][rows]
            minimum, maximum = min(minimum, *payout, maximum), max(maximum, *payout, minimum)
            seen = count
            push(int(loop.control[REACHED]))
            progress("ticks", seen * period / SECOND, seconds)
    finally:
        loop.close()
    if loop.halted:
        raise RuntimeError(f"the solver gave up after {seen * period / SECOND:.2f} s")
    shown = np.quantile(np.array(work) * 1e-6, SHARES).tolist()
    missed = loop.overruns + int(loop.control[SKIPPED])
    return Ticks(sim.nodes - 1, maximum - minimum, loop.scheduler, len(work), missed, *shown)


def study(repeats: None, progress: Progress) -> tuple[dict, str]:
    """Figures as data, and the line of docs/realtime.md."""
    found = ticks(progress=progress)
    work = " / ".join(f"{x:.2f}" for x in found[-4:])
    head = ("elements", "cable moved [m]", "scheduler", "ticks", "missed", "work p50 / p99 / p99.9 / longest [ms]")
    line = (str(found.elements), f"{found.travel:.0f}", found.scheduler, str(found.ticks), str(found.missed), work)
    return found._asdict(), markdown_table([head, line])
