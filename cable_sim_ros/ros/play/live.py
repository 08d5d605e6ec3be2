"""A live run: the node in one process, the player in another, real topics between them.

live("nbp1406", "full_scale", duration=60.0, out="run") -> {"node": {...}, "bag": "run/tow", ...}
"""

from __future__ import annotations

import json
import os
import signal
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

from ...compiler.packaged import packaged
from ...errors import CODE_INPUT, RunError
from ...io.scenes.document import RUN_BAG
from ...terminal import plain_console, say
from ..child import Process, failure

READY_WITHIN = 300.0  # s; compiling everything from nothing takes up to a minute on a slow machine
START_WITHIN = 60.0  # s from the first message to the first tick
# s from each signal to the end
STOP = ((signal.SIGINT, 10.0), (signal.SIGTERM, 2.0), (signal.SIGKILL, 5.0))
TAIL = 40  # lines shown in errors
POLL = 0.1  # s


class LiveError(RunError):
    """A child process that failed; the text has its last lines."""

    lines = True


class LiveInputError(LiveError):
    """What was asked for cannot be done: nothing was started."""

    exit_code = CODE_INPUT


def failed(child: Process, what: str) -> LiveError:
    """The error of a child, with its last lines."""
    lines = child.tail(TAIL) if child.text else "  (none)"
    return LiveError(f"the {child.name} {what}; its last lines:\n{lines}")


def environment(domain: int | None) -> dict[str, str]:
    """Our environment, alone on its own domain: neither heard by the ship nor hearing it."""
    # 1 to 100: the ports of higher domains may be those of other programs
    number = 1 + os.getpid() % 100 if domain is None else domain
    return os.environ | {"ROS_DOMAIN_ID": str(number), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}


def live(
    bag,
    scene,
    duration: float,
    out,
    *,
    domain: int | None = None,
    parameters: dict | None = None,
    imu_only: bool = False,
    speed: float | None = None,
    progress: Callable[[str, float, float | None], None] | None = None,
    node_command: list[str] | None = None,
) -> dict:
    """Play a bag into the node in real time, recorded to `out`/tow, with node.log and player.log beside.

    bag, scene: paths or names of shipped ones; duration: s of the bag; out: directory to make; domain: ROS domain,
    derived from the process id by default; parameters: further node parameters; speed: of the ship [m/s], for an
    imported bag whose log has none; progress(phase, done, total): called as
    it goes, a progress bar on a terminal by default. Returns {"bag", "node" (figures of ros/report/diagnostics.py),
    "node_exit", "player_exit", "played_s", "wall_s"}. Raises LiveError.
    """
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    tow, metrics = out / RUN_BAG, out / "node.json"
    if tow.exists():
        raise LiveInputError(f"'{tow}' exists already: a recording is not overwritten; give another directory")
    metrics.unlink(missing_ok=True)
    settings = {
        "scene": str(scene),
        "recording.enabled": True,
        "recording.root": str(out.absolute()),
        "recording.path": tow.name,
        "statistics_file": str(metrics),
    } | (parameters or {})
    command = (node_command or [sys.executable, "-m", "cable_sim_ros.ros.node"]) + ["--ros-args"]
    for name, value in settings.items():
        command += ["-p", f"{name}:={json.dumps(value)}"]
    own = environment(domain)
    begun = time.monotonic()
    children: list[Process] = []
    context, report = (nullcontext(), progress) if progress else _bar()
    try:
        with context:
            node = Process("node", command, out / "node.log", own)
            children.append(node)
            _await(
                node,
                metrics,
                ("waiting",),
                READY_WITHIN,
                lambda waited: report(f"{packaged.ahead()}; solving the start", waited, None),
            )
            play = [sys.executable, "-m", "cable_sim_ros.cli", "play", str(bag), "--duration", str(duration)]
            play += ["--imu-only"] * imu_only + ([] if speed is None else ["--speed", str(speed)])
            player = Process("player", play, out / "player.log", own)
            children.append(player)
            _follow(node, player, metrics, duration, report)
            player_exit = player.stop(STOP)
            if player_exit != 0:
                raise failed(player, f"ended with code {player_exit}")
            node_exit = node.stop(STOP)
            if node_exit != 0:
                raise failed(node, f"ended with code {node_exit}")
    finally:
        for child in reversed(children):
            child.stop(STOP)
    result = read_state(metrics)
    if result.get("state") != "stopped":
        raise failed(node, "left no final figures")
    return {
        "bag": str(tow),
        "node": result,
        "node_exit": node_exit,
        "player_exit": player_exit,
        "played_s": float(duration),
        "wall_s": time.monotonic() - begun,
    }


def read_state(path: Path) -> dict:
    """What the node wrote last; {} before it wrote anything."""
    try:
        return json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        return {}


def _state(node: Process, metrics: Path, when: str) -> str:
    """What the node wrote of its state last. Raises LiveError where it failed, halted or ended ``when``."""
    code = node.code  # first: what a node says last it writes before it ends
    last = read_state(metrics)
    if why := failure(last):
        raise failed(node, why)
    if code is not None:
        raise failed(node, f"ended with code {code} {when}")
    return last.get("state", "unknown")


def _await(
    node: Process, metrics: Path, states: tuple[str, ...], within: float, report: Callable[[float], None]
) -> None:
    begun = time.monotonic()
    while True:
        waited = time.monotonic() - begun
        state = _state(node, metrics, "before it was ready")
        if state in states:
            return
        if waited > within:
            raise failed(node, f"was not ready within {within:g} s (state {state})")
        report(waited)
        time.sleep(POLL)


def _follow(node: Process, player: Process, metrics: Path, duration: float, report) -> None:
    """Until the player has ended by itself."""
    running = None
    begun = time.monotonic()
    while player.code is None:
        state = _state(node, metrics, "while the motion was playing")
        if state in ("running", "overloaded") and running is None:
            running = time.monotonic()
        if running is None and time.monotonic() - begun > START_WITHIN:
            raise failed(node, f"did not start within {START_WITHIN:g} s of the first motion message")
        report("running in real time", 0.0 if running is None else min(duration, time.monotonic() - running), duration)
        time.sleep(POLL)
    if running is None and player.code == 0:
        raise failed(node, "never started: the motion ended before it did")


def _bar():
    """Progress bar on a terminal; elsewhere a line a phase."""
    if sys.stderr.isatty():
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

        bar = Progress(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TimeElapsedColumn(),
            console=plain_console(err=True),
        )
        task = bar.add_task("starting", total=None)
        return bar, lambda phase, done, total: bar.update(task, description=phase, completed=done, total=total)
    reported: list[str] = []

    def line(phase: str, done: float, total: float | None) -> None:
        if phase not in reported:
            reported.append(phase)
            say(phase + (f", {total:g} s" if total else "") + " ...", err=True)

    return nullcontext(), line
