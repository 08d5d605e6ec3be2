"""Ends the children of a process that was killed. Run by its path; standard library only.

    python -I -S watchdog.py MARK

Its standard input is a pipe from that process, which the kernel closes however it ends. What then still carries
MARK in its environment, in whatever process group or session, is ended by its id: SIGINT, and SIGKILL 5 s later.
"""

from __future__ import annotations

import os
import signal
import sys
import time

VARIABLE = "CABLE_SIM_TESTING"  # in the environment of every process that `child.Process` starts
PATIENCE = 5.0  # s from SIGINT to SIGKILL


def marked(mark: str) -> list[int]:
    """Ids of living processes whose environment has a VARIABLE that begins with this mark; our own is left out."""
    wanted, found = f"{VARIABLE}={mark}".encode(), []
    for name in os.listdir("/proc"):
        if not name.isdigit() or int(name) == os.getpid():
            continue
        try:
            with open(f"/proc/{name}/environ", "rb") as stream:
                variables = stream.read().split(b"\0")
        except OSError:  # ended meanwhile, or of another user
            continue
        if any(variable.startswith(wanted) for variable in variables):
            found.append(int(name))
    return found


def end(mark: str, patience: float = PATIENCE) -> list[int]:
    """End what carries the mark; returns the ids that it found at first."""
    first = left = marked(mark)
    for number, wait in ((signal.SIGINT, patience), (signal.SIGKILL, 5.0)):
        for process in left:
            try:
                os.kill(process, number)
            except ProcessLookupError:
                pass
        deadline = time.monotonic() + wait
        while left and time.monotonic() < deadline:
            time.sleep(0.02)
            left = marked(mark)
    return first


if __name__ == "__main__":
    sys.stdin.buffer.read()
    end(sys.argv[1])
