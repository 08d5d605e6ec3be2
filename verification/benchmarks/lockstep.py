"""How fast a test goes in lockstep, beside which controller, and who works meanwhile. ``cable-sim bench --lockstep``.

full_scale under the recorded motion, by the fixture of cable_sim_ros.testing: without a controller, and with one of ten
lines whose timer moves on /clock; heard by the test are the tick outputs only, or every topic too. All runs in turn.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from functools import partial
from pathlib import Path
from typing import NamedTuple

from cable_sim_ros.io.messages.channels import CHANNELS
from cable_sim_ros.ros.topics import message_class
from cable_sim_ros.runs.message_run import Progress, silent
from cable_sim_ros.terminal import markdown_table
from cable_sim_ros.testing import tow

from .turns import in_turn

SECONDS, BEFORE, ROUNDS = 20.0, 2.0, 3  # s that are measured, s before them; rounds
RATES, TOPICS = (0, 50, 100), ("few", "all")  # Hz of the controller, 0: none; topics that the test hears
CONTROLLER = """
import sys, rclpy
from sensor_msgs.msg import JointState
rclpy.init()
node = rclpy.create_node("ten_lines", namespace="/tow_sim")
winch = node.create_publisher(JointState, "winch/command", 10)
def command():
    message = JointState(name=["payout"], velocity=[0.1])
    message.header.stamp = node.get_clock().now().to_msg()
    winch.publish(message)
node.create_timer(1.0 / float(sys.argv[1]), command)
rclpy.spin(node)
"""


class Pace(NamedTuple):
    """Simulated over wall time; CPU time of node, test and controller, ms a tick."""

    factor: float
    node_ms: float
    test_ms: float
    controller_ms: float


def cpu(process) -> float:
    """CPU time of a process, s."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def run(rate: int, topics: str) -> tuple[Pace, None]:
    """One test."""
    with tow("full_scale", mode="lockstep", may_be_doubtful=True) as sim:
        if topics == "all":
            for channel in CHANNELS:
                sim.listen(message_class(channel.msgtype), channel.topic)
        watched = [sim.node]
        if rate:
            clock = ("--ros-args", "-p", "use_sim_time:=true")
            watched.append(sim.run([sys.executable, "-c", CONTROLLER, str(rate), *clock]))
        sim.feed("nbp1406", duration=BEFORE + SECONDS + 1.0)
        sim.advance(BEFORE)
        begun, before = time.monotonic(), [cpu(process) for process in watched] + [time.process_time()]
        ticks = len(sim.advance(SECONDS))
        wall = time.monotonic() - begun
        after = [cpu(process) for process in watched] + [time.process_time()]
        node, *controller, test = (1e3 * (b - a) / ticks for a, b in zip(before, after, strict=True))
    return Pace(SECONDS / wall, node, test, sum(controller)), None


def study(repeats: int | None, progress: Progress = silent) -> tuple[list[dict], str]:
    """Figures as data, and their table: medians."""
    cases = [(rate, topics) for rate in RATES for topics in TOPICS]
    names = [f"{rate} Hz, {topics}" for rate, topics in cases]
    costs, _ = in_turn([partial(run, *case) for case in cases], repeats or ROUNDS, progress, names)
    rows, lines = [], []
    for (rate, topics), paces in zip(cases, costs, strict=True):
        pace = Pace(*(statistics.median(column) for column in zip(*paces, strict=True)))
        rows.append({"controller_hz": rate, "topics": topics} | pace._asdict())
        work = (f"{ms:.2f}" for ms in pace[1:])
        lines.append((f"{rate} Hz" if rate else "none", topics, f"{pace.factor:.1f}", *work))
    head = ("controller", "topics heard", "times real time", "node, CPU ms a tick", "test", "its controller")
    return rows, markdown_table([head, *lines])
