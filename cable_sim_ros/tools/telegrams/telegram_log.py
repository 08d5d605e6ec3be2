"""The telegrams of a recorded run as a log: each line the logger's stamp, a blank, and the telegram."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np

from ...files import write_bytes
from ...io.recordings.recorded_run import load_run, scene_of_recording
from ...io.scenes.resources import find_bag
from .fields import SECOND, TelegramError, Withheld, moment
from .sources import FORMATS, Reader, due


class Log(NamedTuple):
    """A log: how many lines at what rate [Hz], how many were withheld and why the last one, where values come from."""

    lines: int
    rate: float
    withheld: int
    why: str
    said: str


def write_log(
    bag: str | os.PathLike,
    name: str,
    out: str | os.PathLike,
    form: Any = None,
    rate: float | None = None,
    scene: str | os.PathLike | None = None,
) -> Log:
    """Write the telegrams `name` of a run to a file; rate: none: the usual one, or that of the tick outputs.

    BagError for a bag without a run or a scene, TelegramError for a rate that the tick outputs do not give.
    """
    path = find_bag(bag)
    run = load_run(path)
    unknown = "it is not known which instruments it has"
    had = scene_of_recording(run.custom_data, path, scene, unknown, "nothing was written")
    times = run.frames["time"].astype(np.int64)
    steps = np.diff(times)
    step = int(np.median(steps)) if len(steps) else SECOND
    rows = SECOND / step
    reader = Reader(name, had, max(round(1e-9 * step / had.solver.tick), 1))
    if rate is not None and rate > rows * (1.0 + 1e-9):
        raise TelegramError(
            f"--rate {rate:g} Hz is more than the {rows:g} tick outputs a second of '{path}'; nothing was written. "
            f"Give at most {rows:g}, or record more of them, as by cable-sim run --every {1.0 / rate:g}"
        )
    hertz = min(FORMATS[name].rate, rows) if rate is None else rate
    period = round(SECOND / hertz)
    lines: list[bytes] = []
    withheld, why = 0, ""
    for k, row in enumerate(run.frames):
        before = run.frames[k - 1] if k else None
        reader.notice(row)
        if not due(int(times[k]), int(times[k]) - step, period):
            continue
        try:
            telegram = reader.format.encode(reader.read(row, before), form)
        except Withheld as error:
            withheld, why = withheld + 1, str(error)
            continue
        lines.append(b"%s %s\n" % (stamp(int(times[k])), telegram.rstrip(b"\r\n")))
    try:
        write_bytes(out, b"".join(lines))
    except OSError as error:
        raise TelegramError(
            f"{os.fspath(out)}: cannot be written ({error.strerror}); nothing was written. Give a file in "
            "a folder that is there"
        ) from None
    return Log(len(lines), hertz, withheld, why, reader.said)


def stamp(time: int) -> bytes:
    """A logger's stamp of a time [ns since 1970], as in the logs of OpenRVDAS."""
    at = moment(time)
    return f"{at.year:04d}-{at:%m-%dT%H:%M:%S}.{time // 1000 % 1_000_000:06d}Z".encode()
