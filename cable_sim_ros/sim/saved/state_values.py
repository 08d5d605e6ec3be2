"""Values of a snapshot that comes from a file: what a tick cannot be handed, whoever wrote it.

Kernels check no index and end no loop that runs away, so every number is bounded before one sees it. What is bounded
may still be no tow: `Simulator.taken` tries one tick of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ...physics.block_tridiagonal import SWAP
from ...physics.heave_compensation import LAWS
from ...physics.inputs import COMMAND_ROWS, FLAP_ROWS, MOTION_ROWS
from ...physics.setpoint_prediction import SAMPLES
from ...physics.state import ARC, LEVELS, Q
from ..inputs import MAX_POSITION

MAX = 1e12  # of any number; its square and cube are still numbers
MAX_ENERGY = 1e18  # J, W: sums since the start
MAX_STIFFNESS = 1e24  # N m: the largest inertia over the square of the shortest step; and in a tangent
NO_PEAK = 1e300  # of a step before the first: physics/output.no_peaks; each tick begins with it
UNIT = 1e-6  # of the square of a quaternion, off 1
MAX_TIME = 2**62  # ns; the difference of two still is an int64
MAX_COUNT = 2**53
STAMPS = (
    *("time.now", "time.start", "frame.time", "ship.blend_at", "ship.mean_at", "vehicle.blend_at", "vehicle.mean_at"),
    *("measured.departure_stamp", "winch.line_end", "winch.line_command", "events.pressed_since"),
    *("since", "heard"),  # of attitudes
)
# integers by name: least, most
WHOLE = dict.fromkeys(STAMPS, (-MAX_TIME, MAX_TIME)) | {
    "setpoint.algorithm": (0, len(LAWS) - 1),
    "setpoint.engaged": (-1, len(LAWS) - 1),
    "setpoint.prediction.next": (0, SAMPLES - 1),
    "control.level": (0, LEVELS - 1),
    "control.wait": (0, MAX_COUNT),
    "halted": (0, 0),
}
FAULT_SINCE = "fault.since"  # the end of a name: ns, of every device and way
COUNTED = (-1, MAX_COUNT)  # all others
# name, rows, NaN: not commanded
RINGS = (
    ("motion", MOTION_ROWS, False),
    ("command", COMMAND_ROWS, True),
    ("vehicle", MOTION_ROWS, False),
    ("flap", FLAP_ROWS, True),
)


def problem(arrays: Mapping[str, np.ndarray]) -> str:
    """ "" or what is wrong with the numbers of a snapshot whose dtypes and shapes are right, as a clause."""
    return next((text for text in _problems(arrays) if text), "")


def _problems(arrays: Mapping[str, np.ndarray]) -> Iterator[str]:
    for name, array in arrays.items():
        if array.dtype.names:
            prefix = "frame." if name.startswith("frame_") else ""
            for field, values in _fields(array, prefix):
                yield _out_of_bounds(name, field, values)
        elif not name.startswith("inputs_"):
            yield _out_of_bounds(name, "", array)
    for name in ("attitude", "step_attitude"):
        sizes = (arrays[name]["quaternion"] ** 2).sum(axis=-1)
        yield "" if (np.abs(sizes - 1.0) < UNIT).all() else f"{name}: a quaternion is no unit quaternion"
    rows = arrays["tangent_factor"][:, :, SWAP]
    yield "" if np.isin(rows, range(6)).all() else "tangent_factor: a row that no block has"
    yield _mesh(arrays["nodes"])  # before the first tick there has been no step
    yield rings_problem(arrays)


def _fields(record: np.ndarray, prefix: str) -> Iterator[tuple[str, np.ndarray]]:
    for name in record.dtype.names or ():
        values = np.asarray(record[name])
        if values.dtype.names:
            yield from _fields(values, f"{prefix}{name}.")
        else:
            yield prefix + name, values


def _out_of_bounds(name: str, field: str, values: np.ndarray) -> str:
    if not values.size:
        return ""
    where = f"{name}: {field}" if field else name
    if values.dtype.kind == "i":
        other = (-MAX_TIME, MAX_TIME) if field.endswith(FAULT_SINCE) else COUNTED
        minimum, maximum = WHOLE.get(field, other)
        low, high = int(values.min()), int(values.max())
        return "" if minimum <= low and high <= maximum else f"{where} is {low if low < minimum else high}"
    if not np.isfinite(values).all():
        return f"{where} is not finite"
    largest, max_is = float(np.abs(values).max()), MAX_ENERGY if field.startswith("account.") else MAX
    if (name.endswith("attitude") and field == "stiffness") or name.startswith("tangent_"):
        max_is = MAX_STIFFNESS
    if field.startswith("health.") and field.endswith(("_min", "_max")) and (np.abs(values) == NO_PEAK).all():
        return ""
    return "" if largest <= max_is else f"{where} is {largest:.3g}"


def _mesh(nodes: np.ndarray) -> str:
    if not (np.diff(nodes[ARC, :, 0]) > 0.0).all():
        return "nodes: the arc lengths of the nodes do not go up"
    if not np.abs(nodes[Q, :, :3]).max() <= MAX_POSITION:
        return f"nodes: a node is further than {MAX_POSITION:g} m away"
    return ""


def rings_problem(arrays: Mapping[str, np.ndarray]) -> str:
    """As `problem`, of the rings of inputs alone."""
    for name, rows, may_lack in RINGS:
        time, values = arrays[f"inputs_{name}_time"], arrays[f"inputs_{name}"]
        head, seen = int(arrays[f"inputs_{name}_head"][0]), int(arrays[f"inputs_{name}_seen"][0])
        if not (0 <= head <= MAX_COUNT and 0 <= seen <= MAX_COUNT):
            return f"inputs_{name}: {head} were written and {seen} seen"
        if not np.abs(time.astype(float)).max() <= MAX_TIME:
            return f"inputs_{name}: a time is out of range"
        if not ((np.abs(values) <= MAX) | (may_lack & np.isnan(values))).all():
            return f"inputs_{name} is not finite"
        used = [k % rows for k in range(max(0, head - rows), head)]
        if name != "command" and not (np.diff(time[used]) > 0).all():
            return f"inputs_{name}: the stamps do not go up"
    return ""
