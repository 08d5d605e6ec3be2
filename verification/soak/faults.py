"""R4 to R6, R10, R11: a process that stands still, a wall clock that steps, floods, a model too big, silent inputs."""

from __future__ import annotations

import os
import shutil
import signal
import struct
import subprocess
import tempfile
import time
from functools import partial
from pathlib import Path

import numpy as np

from cable_sim_ros.ros.topics import message_class

from ..stress.verdict import IS, Found, Metric, stress
from .pace import counters, grown, missed_fraction, since
from .rig import SETTLED, Rig, percentile, rig, sailing, until

SOON = 0.1  # s from a time-out to its status on the wire


def first_status(it: Rig, task: str, level: int, since: float, within: float) -> float:
    """Arrival [s] of the first status of a task at a level or above."""
    until(lambda: any(t.level >= level for t in it.probe.tasks(task, since)), within, f"level {level} of {task}")
    return next(t.at for t in it.probe.tasks(task, since) if t.level >= level)


def said_at(it: Rig, text: str, since: float) -> float | None:
    """Arrival [s] of the first status of the loop that begins with a text."""
    return next((t.at for t in it.probe.tasks("loop", since) if t.message.startswith(text)), None)


@stress("SIGSTOP of 0.1 to 5 s", "flagged within 0.2 s of waking, with its length; no clock jump, no new start")
def stopped(quick: bool) -> Found:
    """Each stop during motion at 50 Hz; what was sent meanwhile waits in the queues."""
    lengths = (0.1, 1.0) if quick else (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
    metrics, resumed = [], []
    with sailing() as it:
        for seconds in lengths:
            os.kill(it.pid, signal.SIGSTOP)
            time.sleep(seconds)
            os.kill(it.pid, signal.SIGCONT)
            woken = time.monotonic()
            said = f"the process stood still for {seconds:.1f} s"
            at = until(partial(said_at, it, said, woken), 5.0, said)
            metrics.append(Metric(f"{seconds:g} s: said after", at - woken, "s", 0.2))
            time.sleep(2.3)
            resumed.append(max(t.level for t in it.probe.tasks("motion", woken + 1.0)))
        values = counters(it, time.monotonic())
        _, frames = it.probe.frames()
        final = it.finish()
    metrics += [
        Metric("standstills counted", values["standstills"], "", float(len(lengths)), IS),
        Metric("clock jumps", values["clock_jumps"], "", 0.0, IS),
        Metric("static starts", values["resets"], "", 0.0, IS),
        Metric("level of motion a second later", max(resumed), "", 1),
        Metric("largest change of tension in a tick", float(np.abs(np.diff(frames["tension"])).max()), "N"),
        Metric("taken to the present", final["skips_ahead"]),
    ]
    return Found(metrics)


@stress("wall clock of the process stepped by +1 h, -1 h, +0.4 s, -0.4 s", "no tick missed for it, no message refused")
def stepped(quick: bool) -> Found:
    """A library that adds to the wall clock of the node's process, rclpy and DDS included, while the sensors' stays."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        return Found([], missing="needs a C compiler")
    steps = (3600.0, -3600.0, 0.4, -0.4)
    with tempfile.TemporaryDirectory(prefix="shim_") as name:
        library, shift = Path(name, "shim.so"), Path(name, "shift")
        source = Path(__file__).with_name("clock_shim.c")
        subprocess.run([compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(source)], check=True)
        shift.write_bytes(struct.pack("<q", 0))
        with sailing(extra={"LD_PRELOAD": str(library), "CLOCK_SHIM": str(shift)}) as it:
            before, ahead = counters(it, time.monotonic()), 0.0
            for step in steps:
                ahead += step
                with shift.open("r+b") as page:  # in place: the node has it mapped
                    page.write(struct.pack("<q", round(ahead * 1e9)))
                time.sleep(1.0 if quick else 10.0)
            counts = since(it, before)
            final = it.finish()
    metrics = [
        Metric("ticks missed", missed_fraction(counts), "", 1e-2),
        Metric("clock jumps", counts["clock_jumps"], "", 0.0, IS),
        Metric("messages refused", sum(final["dropped"].values()), "", 0, IS),
        Metric("refused by cause", str(final["dropped"])),
        Metric("steps seen", final["wall_clock_steps"], "", len(steps), IS),
        Metric("samples taken in after, p99", final["sample_age_p99_ms"], "ms", 20.0),
    ]
    return Found(metrics)


@stress("IMU and odometry at 500 Hz each, and a flood of service calls", "sample age p99 <= 20 ms, missed <= 1 %")
def flooded(quick: bool) -> Found:
    """Age: from the stamp, on the clock of the data, to the sample being in the ring."""
    seconds, metrics = (5.0 if quick else 60.0), []
    for flood in ("", "services"):
        with rig() as it:
            it.sail(500.0, 500.0)
            time.sleep(SETTLED)
            if flood:
                it.start("flood", "verification.soak.flood", flood, "--seconds", str(seconds + 5.0))
                time.sleep(1.0)
            counts = grown(it, seconds)
            rates = it.probe.tasks("inputs")[-1].values
            final = it.finish()
        name = "with service calls" if flood else "alone"
        metrics += [
            Metric(f"{name}: sample age, p50", final["sample_age_p50_ms"], "ms"),
            Metric(f"{name}: sample age, p99", final["sample_age_p99_ms"], "ms", 20.0),
            Metric(f"{name}: ticks missed", missed_fraction(counts), "", 1e-2),
            Metric(f"{name}: IMU and odometry taken in", f"{rates['imu_rate_hz']}, {rates['odometry_rate_hz']} Hz"),
            Metric(f"{name}: messages refused", sum(final["dropped"].values())),
        ]
    return Found(metrics)


@stress("a model too big for real time", "overloaded within 1 s with the factor; no new start; ticks go on")
def too_big(quick: bool) -> Found:
    """The shipped scene on its sheave at ticks of 0.2 ms, in place of 10 ms."""
    with rig(scene="full_scale_contact", solver__tick=0.0002) as it:
        it.sail()
        begun = it.probe.received["sim/health"][0][0]
        at = first_status(it, "loop", 2, 0.0, 20.0)
        time.sleep(5.0 if quick else 60.0)
        status = it.probe.tasks("loop", time.monotonic() - 2.0)[-1]
        final = it.finish()
    metrics = [
        Metric("said after the first tick", at - begun, "s", 1.0),
        Metric("state", status.values["state"], "", "overloaded", IS),
        Metric("real-time factor", float(status.values["real_time_factor"]), "", 0.97),
        Metric("static starts", final["resets"], "", 0, IS),
        Metric("taken to the present", final["skips_ahead"]),
        Metric("ticks", final["ticks"]),
    ]
    return Found(metrics, [status.message])


@stress("an input falls silent", f"its status on the wire within {SOON:g} s of its time-out (0.5 s)")
def silent(quick: bool) -> Found:
    """The sensors' process is killed; the last message heard beside the node is where the time-out begins."""
    late = []
    with rig() as it:
        received = it.probe.listen(message_class("nav_msgs/msg/Odometry"), "odom", raw=True)
        for _ in range(2 if quick else 20):
            before = len(received)
            it.sail()
            until(lambda before=before: len(received) > before + 50, 10.0, "odometry")
            until(lambda: [s for s in it.probe.tasks("inputs")[-1:] if s.level == 0], 10.0, "fresh inputs")
            time.sleep(0.5)
            assert it.sensors is not None
            it.sensors.kill()
            time.sleep(0.1)
            last = received[-1][0]
            late.append(first_status(it, "inputs", 2, last, 5.0) - last - 0.5)
        it.finish()
    metrics = [
        Metric("after the time-out, p50", percentile(late, 50), "s"),
        Metric("after the time-out, longest", max(late), "s", SOON),
    ]
    return Found(metrics, [f"{len(late)} times"])
