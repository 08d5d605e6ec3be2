"""Tables of ships as the tests write them, a mapping beside them, and what an import makes of both."""

from __future__ import annotations

import numpy as np

from cable_sim_ros.io.sources.recorded_tow import odometry_of, read_tow
from cable_sim_ros.tools.logs.imports.import_logs import Imported, import_logs
from cable_sim_ros.tools.logs.imports.track import Choice
from cable_sim_ros.tools.logs.own_signals import later_only

SECOND = 1_000_000_000
NOON = 1_406_894_400  # s: 2014-08-01 12:00 UTC


def ship(path, t, **columns):
    """CSV: unix_time [s] and columns of numbers."""
    lines = [",".join(("unix_time", *columns))]
    rows = zip(*(values.tolist() for values in columns.values()))
    lines += [f"{NOON + a:.6f}," + ",".join(f"{value:.9g}" for value in row) for a, row in zip(t.tolist(), rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def mapping(folder, *entries):
    """YAML of "word: field unit more"."""
    text = "mapping: test\nsignals:\n"
    for entry in entries:
        word, field, unit, *more = entry.split(" ", 3)
        rest = "".join(f", {one}" for one in more)
        text += f"  {word.rstrip(':')}: {{source: table, field: {field}, unit: {unit}{rest}}}\n"
    path = folder / "m.yaml"
    path.write_text(text)
    return path


def imported(log, *entries, **choice) -> tuple[Imported, np.ndarray, np.ndarray]:
    """Import; what it says, and of its odometry the stamps [s] since noon, and x y z roll pitch yaw [n, 6]."""
    out = log.parent / "bag"
    done = import_logs(log, out, mapping(log.parent, *entries), choice=Choice(**choice), force=True)
    time, values = odometry_of(read_tow(out))
    assert later_only(time).all()
    return done, (time - NOON * SECOND) / SECOND, values


def told(lines, *words) -> bool:
    """Does one line have all the words?"""
    return any(all(word in line for word in words) for line in lines)
