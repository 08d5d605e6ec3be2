"""Starts and stops nodes under test and counts what is left of them: python -m cable_sim_ros.testing.endurance [COUNT]

Every other tow is in lockstep; every fifth node is killed in place of stopped, every seventh has a controller that is
deaf to SIGINT. Leaves with code 1 where a process, a file in shared memory of ours or a descriptor is left.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import threading
import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..ros import watchdog
from ..ros.child import MARK
from ..terminal import say
from . import shared_memory
from .tow_sim import tow

DEAF = "import signal, time; signal.signal(signal.SIGINT, signal.SIG_IGN); time.sleep(600)"
WITHIN = 20.0  # s for a stop; a longer one counts as hung


def endure(count: int, scene: str = "full_scale", kill_every: int = 5, say: Any = lambda text: None) -> dict[str, Any]:
    """Figures of so many starts and stops: what was left, times in s (median, longest), descriptors gained."""
    starts, stops, left, files, domains = [], [], 0, 0, set()
    descriptors = None
    for k in range(count):
        begun = time.monotonic()
        sim = tow(scene, mode="lockstep" if k % 2 else "realtime")
        try:
            starts.append(time.monotonic() - begun)
            domains.add(sim.domain)
            # not the ports: their names come again, and may by now be another program's
            segments = {name for name in shared_memory.mapped(sim.node.pid) if "port" not in name}
            sim.feed(heave=(1.0, 8.0), duration=5.0)
            sim.advance(0.2)
            if k % 7 == 6:
                sim.run((sys.executable, "-c", DEAF), within=0.0, may_end=True)
            if k % kill_every == kill_every - 1:
                sim.node.kill()
        finally:
            begun = time.monotonic()
            sim.close()
            stops.append(time.monotonic() - begun)
        left += len(watchdog.marked(MARK))
        files += len(shared_memory.remove(segments))
        if descriptors is None:
            descriptors = len(os.listdir("/proc/self/fd"))  # after the first, which has loaded everything
        say(f"{k + 1} of {count}: ready after {starts[-1]:.1f} s, ended within {stops[-1]:.1f} s, left {left}")
    return {
        "starts": count,
        "leftover_processes": left,
        "shared_memory_left": files,
        "descriptors_gained": len(os.listdir("/proc/self/fd")) - (descriptors or 0),
        "threads_left": sum(thread.name.startswith("cable_sim") for thread in threading.enumerate()),
        "hung": sum(stop > WITHIN for stop in stops),
        "domains": len(domains),
        "start_s": [float(np.median(starts)), float(np.max(starts))],
        "stop_s": [float(np.median(stops)), float(np.max(stops))],
    }


def failed(metrics: dict[str, Any]) -> list[str]:
    """Names of the figures that are not 0 and should be."""
    wanted = ("leftover_processes", "shared_memory_left", "threads_left", "hung")
    return [name for name in wanted if metrics[name]] + ["descriptors_gained"] * (metrics["descriptors_gained"] > 0)


def main(arguments: Sequence[str]) -> int:
    """Entry point: 0, or 1 where something is left."""
    parser = argparse.ArgumentParser(prog="endurance", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("count", type=int, nargs="?", default=100)
    parser.add_argument("--scene", default="full_scale")
    given = parser.parse_args(list(arguments))
    metrics = endure(given.count, given.scene, say=lambda text: say(text, err=True))
    say(json.dumps(metrics, indent=1), lines=True)
    return 1 if failed(metrics) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
