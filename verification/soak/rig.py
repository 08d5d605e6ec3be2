"""The node, a ship's sensors and a listener, each in a process of its own (the listener in this one), on a domain of
their own."""

from __future__ import annotations

import json
import math
import os
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from cable_sim_ros.errors import RunError
from cable_sim_ros.ros.child import Process
from cable_sim_ros.ros.play.live import STOP, environment, failed, read_state

READY_WITHIN = 300.0  # s; compiling everything from nothing takes minutes on a slow machine
SETTLED = 3.0  # s after the start that are not judged
NODE = [sys.executable, "-m", "cable_sim_ros.ros.node"]


class RigError(RunError):
    """A process of the test that did not do what the test needs; the text has its last lines."""


def until(condition: Callable, within: float, what: str, step: float = 0.01):
    """The first true value of condition(); RigError after `within` seconds."""
    end = time.monotonic() + within
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end:
            raise RigError(f"not within {within:g} s: {what}")
        time.sleep(step)


class Rig:
    """What a test holds: `node` and `probe` are up, `sensors` after `sail`."""

    def __init__(self, folder: Path, domain: int, node: Process) -> None:
        self.folder, self.domain, self.node = folder, domain, node
        self.metrics = folder / "node.json"
        self.sensors: Process | None = None
        self.children: list[Process] = [node]
        from .probe import Probe  # imports rclpy

        self.probe = Probe(domain, "probe")
        self.probe.watch()

    @property
    def pid(self) -> int:
        return self.node.pid

    def start(self, name: str, module: str, *arguments: str, **extra: str) -> Process:
        """Another process on the same domain; extra: environment."""
        log = self.folder / f"{name}{len(self.children)}.log"
        child = Process(name, [sys.executable, "-m", module, *arguments], log, environment(self.domain) | extra)
        self.children.append(child)
        return child

    def state(self, *wanted: str, within: float = READY_WITHIN) -> str:
        """Wait for one of some states of the node."""

        def there():
            if self.node.code is not None:
                raise failed(self.node, f"ended with code {self.node.code}")
            state = read_state(self.metrics).get("state", "")
            return state if state in wanted else ""

        return until(there, within, f"state {' or '.join(wanted)}", 0.05)

    def sail(self, imu: float = 50.0, odometry: float = 50.0, heave: str = "1,8") -> None:
        """Start the sensors at rates [Hz]; returns once ticks are heard."""
        self.sensors = self.start(
            "sensors", "verification.soak.sender", "--imu", str(imu), "--odometry", str(odometry), "--heave", heave
        )
        self.state("running", "overloaded", within=60.0)
        until(lambda: self.probe.received["sim/health"], 10.0, "the first tick")

    def mark(self) -> int:
        """Number of the next tick output, for `probe.frames`."""
        return len(self.probe.received["sim/health"])

    def resident(self) -> float:
        """Memory of the node in use [MB]."""
        pages = int(Path(f"/proc/{self.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") * 1e-6

    def finish(self) -> dict:
        """Stop everything; the node's final figures."""
        for child in reversed(self.children[1:]):
            child.stop(STOP)
        if self.node.stop(STOP) != 0:
            raise RigError(str(failed(self.node, f"ended with code {self.node.code}")))
        return read_state(self.metrics)

    def close(self) -> None:
        """Stop everything, whatever state it is in."""
        for child in reversed(self.children):
            child.stop(STOP)
        self.probe.close()


@contextmanager
def rig(command: list[str] | None = None, extra: dict[str, str] | None = None, **parameters) -> Iterator[Rig]:
    """A node that waits for motion, everything is ended at the end.

    command: in place of the node's; extra: environment; parameters: of the node, `__` for the dot.
    """
    with tempfile.TemporaryDirectory(prefix="soak_") as name:
        folder = Path(name)
        settings = {"statistics_file": str(folder / "node.json")}
        settings |= {key.replace("__", "."): value for key, value in parameters.items()}
        line = [*(command or NODE), "--ros-args"]
        for key, value in settings.items():
            line += ["-p", f"{key}:={json.dumps(value)}"]
        domain = 1 + (os.getpid() + int(time.monotonic() * 10)) % 100
        os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        own = environment(domain) | (extra or {}) | {"SOAK_REPORT": str(folder / "report.json")}
        it = Rig(folder, domain, Process("node", line, folder / "node.log", own))
        try:
            it.state("waiting")
            yield it
        finally:
            it.close()


@contextmanager
def sailing(*, settled: float = SETTLED, **how) -> Iterator[Rig]:
    """The same under way, ``settled`` [s] after its first tick."""
    with rig(**how) as it:
        it.sail()
        time.sleep(settled)
        yield it


def percentile(values, rank: float) -> float:
    """NaN while there are none."""
    return float(np.percentile(values, rank)) if len(values) else math.nan
