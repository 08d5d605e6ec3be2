"""Files in shared memory that a killed process of a test leaves behind: Fast DDS removes its own only where it ends.

With discovery on this host alone rmw_fastrtps always adds the shared memory transport, whatever its settings say.
"""

from __future__ import annotations

import os
import re
import time
from pathlib import Path

SHARED = Path("/dev/shm")
_NAME = re.compile(rf"{SHARED}/(fastdds_\w+)$", re.M)


def mapped(process: int) -> set[str]:
    """Names of the files of Fast DDS that a process has mapped; none where it has ended or is another user's."""
    try:
        return set(_NAME.findall(Path(f"/proc/{process}/maps").read_text("utf-8", errors="replace")))
    except OSError:
        return set()


def remove(names: set[str], within: float = 1.0) -> set[str]:
    """Remove those that no living process has mapped, with their locks; returns what was removed.

    within: s that are waited for those of this process, which lets go of them soon after it has left the domain.
    """
    there = {name for name in names if (SHARED / name).exists()}
    if not there:
        return set()
    deadline = time.monotonic() + within
    while there & mapped(os.getpid()) and time.monotonic() < deadline:
        time.sleep(0.02)
    for process in os.listdir("/proc"):
        if process.isdigit():
            there -= mapped(int(process))
    for name in there:
        for file in (name, f"{name}_el", f"sem.{name}_mutex"):
            (SHARED / file).unlink(missing_ok=True)
    return there
