"""The node with something in its process: objects that the garbage collector must walk, a count of compilations.

SOAK_HOARD: objects to retain once ticks run; SOAK_REPORT: file for what was counted, written at the end.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from pathlib import Path

CHUNK = 20_000  # objects at a time, so that hoarding itself does not hold the interpreter lock
hoard: list = []


def ticking() -> bool:
    """True once the stepping loop runs."""
    return any(thread.name == "tick" for thread in threading.enumerate())


def keep(count: int) -> None:
    """Retain `count` objects a little after the first tick."""
    while not ticking():
        time.sleep(0.05)
    time.sleep(2.0)
    while len(hoard) * CHUNK < count:
        hoard.append([[k] for k in range(CHUNK)])
        time.sleep(0.01)


def main() -> int:
    """As the node's."""
    from numba.core import event

    from cable_sim_ros.ros.node import main as node_main

    late: list[str] = []

    class Compilations(event.Listener):
        def on_start(self, happened) -> None:
            if ticking():
                late.append(str(happened.data))

        def on_end(self, happened) -> None:
            pass

    event.register("numba:compile", Compilations())
    count = int(os.environ.get("SOAK_HOARD", "0"))
    if count:
        threading.Thread(target=keep, args=(count,), daemon=True).start()
    code = node_main()
    report = {"compiled_while_ticking": late, "objects": sum(map(len, hoard))}
    Path(os.environ["SOAK_REPORT"]).write_text(json.dumps(report), "utf-8")
    return code


if __name__ == "__main__":
    sys.exit(main())
