"""Reads files with libraries in C in processes of their own: a damaged file may take all memory, hang or crash them.

One process imports the library; files are read in a fork of it, each within memory, time and processor time that its
size accounts for, and come back as plain arrays. Modules of this kind have `prepare()` and `read_here(path) -> Log`.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, BinaryIO

import numpy as np

from ..log import Log, LogError, Losses, Source

MEMORY, PER_BYTE = 512_000_000, 100  # bytes beside those of the library, and for each byte of the file
SECONDS, PER_SECOND = 60, 1_000_000  # s for a file, and bytes of it that add another
START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from cable_sim_ros.tools.logs.containers.bounded import child; child(*sys.argv[2:])"
)


def read_bounded(module: str, path: Path) -> Log:
    """Read a file with a module of the kind above, by its full name. LogError where it is beyond its bounds."""
    (result,) = read_all(module, [path])
    if isinstance(result, LogError):
        raise result
    return result


def read_all(module: str, paths: Sequence[Path]) -> list[Log | LogError]:
    """Read many files with one start of the library."""
    with TemporaryDirectory() as folder:
        names = [os.path.abspath(path) for path in paths]
        Path(folder, "paths").write_text(json.dumps(names))
        places = [place for place in sys.path if place and isinstance(place, str)]  # import knows no others
        command = [sys.executable, "-P", "-W", "ignore", "-c", START, json.dumps([*places, os.getcwd()])]
        done = subprocess.run([*command, module, folder], capture_output=True, text=True, errors="replace")
        if done.returncode:
            why = (done.stderr.strip().splitlines() or ["no message"])[-1][:200]
            return [LogError(f"{path}: its reader did not start ({why}); nothing was read") for path in paths]
        return [_taken(Path(folder, str(k)), path) for k, path in enumerate(paths)]


def child(name: str, folder: str) -> None:
    """Of the process: read each file in a fork, and leave what came of it in the folder."""
    module = import_module(name)
    module.prepare()
    paths = [Path(path) for path in json.loads(Path(folder, "paths").read_text())]
    k = 0
    while k < len(paths):
        number = os.fork()
        if not number:
            try:
                for at in range(k, len(paths)):
                    _read_one(module, paths[at], Path(folder, str(at)))
            finally:
                os._exit(0)
        _, status = os.waitpid(number, 0)
        first, k = k, next((at for at in range(k, len(paths)) if not Path(folder, str(at)).exists()), len(paths))
        if k == first:  # else a file before it may be the cause: it is read again, in a fork of its own
            number = os.WTERMSIG(status) if os.WIFSIGNALED(status) else 0
            late = number in (signal.SIGALRM, signal.SIGXCPU)
            why = "takes longer than a file of its size can" if late else f"ends its reader with signal {number}"
            _leave(Path(folder, str(k)), {"error": why})
            k += 1


def _bound(kind: int, wanted: int) -> int:
    """Bound a resource of this process by what is wanted, or by what it inherited where that is less; which it was."""
    soft, hard = resource.getrlimit(kind)
    inherited = min((limit for limit in (soft, hard) if limit != resource.RLIM_INFINITY), default=wanted)
    resource.setrlimit(kind, (min(wanted, inherited), hard))
    return min(wanted, inherited)


def _read_one(module: Any, path: Path, out: Path) -> None:
    """In the fork."""
    size = path.stat().st_size if path.exists() else 0
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    most, seconds = MEMORY + PER_BYTE * size, SECONDS + size // PER_SECOND
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    room = _bound(resource.RLIMIT_AS, used + most) - used
    short = f", where a limit of this session (ulimit -v) leaves {max(room, 0) / 1e6:.0f} MB" if room < most else ""
    spent = resource.getrusage(resource.RUSAGE_SELF)
    cpu = int(spent.ru_utime + spent.ru_stime) + seconds
    _bound(resource.RLIMIT_CPU, cpu)
    signal.alarm(4 * seconds)
    try:
        log = module.read_here(path)
    except LogError as error:
        _leave(out, {"log_error": str(error)})
    except MemoryError:
        _leave(out, {"error": f"takes more than {room / 1e6:.0f} MB" + (short or ", far beyond its size")})
    except Exception as error:  # libraries raise what they like on damaged files
        text = " ".join(str(error).split())[:200].replace(str(path), path.name)
        _leave(out, {"error": f"{type(error).__name__}: {text}{short}"})
    else:
        sources, arrays = [], []
        for source in log.sources.values():
            clocks = source.logged, source.device
            arrays += [array for array in (*clocks, *source.columns.values()) if array is not None]
            entry = {"name": source.name, "kind": source.kind, "units": source.units, "columns": list(source.columns)}
            sources.append(entry | {"clocks": [clock is not None for clock in clocks]})
        head = {"format": log.format, "records": log.records, "notices": log.notices, "sources": sources}
        _leave(out, head | {"counts": log.losses.counts, "first": log.losses.first}, arrays)


def _leave(out: Path, head: dict[str, Any], arrays: Sequence[np.ndarray] = ()) -> None:
    part = out.with_suffix(".part")
    with part.open("wb") as file:
        file.write(json.dumps(head).encode() + b"\n")
        for array in arrays:
            np.lib.format.write_array(file, array, allow_pickle=False)
    part.rename(out)


def _taken(out: Path, path: Path) -> Log | LogError:
    try:
        with out.open("rb") as file:
            head = json.loads(file.readline())
            if "log_error" in head:
                return LogError(head["log_error"].replace(os.path.abspath(path), str(path)))
            if "error" in head:
                return LogError(f"{path}: cannot be read ({head['error']}); nothing was read. Give another copy")
            sources = {entry["name"]: _source(file, entry) for entry in head["sources"]}
    except (OSError, ValueError):
        return LogError(
            f"{path}: its reader ended without a result; nothing was read. Is there room for temporary files?"
        )
    losses = Losses(head["counts"], head["first"])
    return Log(str(path), head["format"], sources, head["records"], losses, head["notices"])


def _source(file: BinaryIO, entry: dict[str, Any]) -> Source:
    def array() -> np.ndarray:
        return np.lib.format.read_array(file, allow_pickle=False)

    logged, device = (array() if there else None for there in entry["clocks"])
    columns = {name: array() for name in entry["columns"]}
    return Source(entry["name"], entry["kind"], logged, device, columns, entry["units"])
