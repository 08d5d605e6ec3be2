"""Foreign logs and a mapping to a bag: motion as odometry or IMU, what was measured, where it comes from."""

from __future__ import annotations

import hashlib
import heapq
import json
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ....files import open_file, read_text
from ....io.bags.bag_writer import BagError, BagWriter
from ....io.messages.cdr import header
from ....io.messages.message_classes import (
    JointState,
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Vector3,
    Wrench,
    WrenchStamped,
    imu_bytes,
    serialized,
)
from ....io.sources.motion_table import MotionError, stream_odometry
from ....io.sources.recorded_tow import ALONG
from ....sim.tables.attitude import quaternion
from ....version import __version__
from ..log import SECOND, LogError
from ..mapping.mapping_file import find_mapping
from ..own_signals import IMPORT, QUANTITIES, SIGNALS_TOPIC, Signal
from ..read_signals import Reading, read
from ..several import Paths
from . import attitude
from .attitude import FORCES, RATES
from .motion import ShipMotion, motion_of_signals
from .track import Choice

JOINT = "sensor_msgs/msg/JointState"
WRENCH = "geometry_msgs/msg/WrenchStamped"
POSE = "geometry_msgs/msg/PoseStamped"
WINCH = ("payout", "payout_rate", "tension_drum")
BODY = ("body_x", "body_y", "body_depth")
MEASURED = (*WINCH, "tension", *BODY, "departure_angle", "layback", "body_latitude", "body_longitude")
Message = tuple[int, str, str, bytes]


def write_measured(bag: BagWriter, signals: Mapping[str, Signal]) -> list[Iterator[Message]]:
    """Declares the topics; messages of each in order of time, made as they are asked for. A quantity that a message has
    and the log lacks is NaN there; `import/signals` has each record of each signal by name, none resampled."""
    bag.declare(SIGNALS_TOPIC, JOINT, "reliable")
    out = [_as_it_is(one) for one in signals.values()]
    for names, topic, kind, make in (
        (WINCH, "/tow_sim/winch/state", JOINT, _winch),
        (("tension",), "/tow_sim/sheave/tension", WRENCH, _tension),
        (BODY, "/tow_sim/towbody/pose", POSE, _body),
    ):
        there = [name for name in names if name in signals]
        if not there:
            continue
        bag.declare(topic, kind, "reliable")
        time = signals[there[0]].time
        table = np.column_stack([_at(signals.get(name), time) for name in names])
        out.append(_made(time, table, topic, kind, make))
    return out


def _made(time: np.ndarray, table: np.ndarray, topic: str, kind: str, make: Callable[..., bytes]) -> Iterator[Message]:
    for now, row in zip(time.tolist(), table.tolist()):
        if now > 0:
            yield now, topic, kind, make(now, *row)


def _at(one: Signal | None, time: np.ndarray) -> np.ndarray:
    """Values at times, NaN where there are none."""
    if one is None or not len(one.time):
        return np.full(len(time), np.nan)
    origin = time[0]
    return np.interp(
        (time - origin).astype(float), (one.time - origin).astype(float), one.value, left=np.nan, right=np.nan
    )


def _joint(now: int, names: list[str], *arrays: list[float]) -> bytes:
    full = [np.array(array, float) for array in arrays] + [np.zeros(0)] * (3 - len(arrays))
    return serialized(JointState(header(now, ""), names, *full))


def _as_it_is(one: Signal) -> Iterator[Message]:
    for now, value in zip(one.time.tolist(), one.value.tolist()):
        if now > 0:
            yield now, SIGNALS_TOPIC, JOINT, _joint(now, [one.quantity], [value])


def _winch(now: int, payout: float, rate: float, tension: float) -> bytes:
    nan = float("nan")
    return _joint(now, ["payout", "drum"], [payout, nan], [rate, nan], [tension, nan])


def _tension(now: int, tension: float) -> bytes:
    pull = Wrench(Vector3(tension, 0.0, 0.0), Vector3(0.0, 0.0, 0.0))  # along x: a log tells no direction
    return serialized(WrenchStamped(header(now, "sheave_link"), pull))


def _body(now: int, x: float, y: float, depth: float) -> bytes:
    pose = Pose(Point(x, y, -depth), Quaternion(0.0, 0.0, 0.0, 1.0))
    return serialized(PoseStamped(header(now, "odom"), pose))


ODOMETRY = "/tow_sim/odom"
IMU = "/tow_sim/imu/data"
LISTED = 1000  # files in the provenance


@dataclass
class Imported:
    """What an import made: figures for the JSON, and lines for a user."""

    path: Path
    figures: dict[str, Any]
    assumed: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)


def import_logs(
    files: Paths,
    out: str | os.PathLike,
    mapping: str | os.PathLike | None = None,
    *,
    format: str | None = None,
    choice: Choice | None = None,
    force: bool = False,
) -> Imported:
    """Write the bag `out` of foreign logs. Raises LogError, MappingError, MotionError or BagError; then nothing is
    written."""
    choice, path = choice or Choice(), Path(out)
    if path.exists() and not force:
        raise BagError(f"'{path}' exists already: nothing was imported; give --force to replace it, or another --out")
    if path.exists() and not _only_a_bag(path):
        raise BagError(
            f"'{path}' is no bag, or has other files in it: --force replaces bags only; nothing was imported. Give "
            f"another --out"
        )
    reading = read(files, mapping, format)
    signals = {one.quantity: one for one in reading.signals}
    assumed = [line for one in reading.signals for line in one.assumed]
    vertical = {"heave", "z", "heave_rate"} & signals.keys()
    if not vertical:
        assumed += attitude.add_rates(signals)
    assumed += attitude.upright(signals, mapping is None)
    assumed += _attitude(signals)
    imu = attitude.can(signals) and not vertical
    motion = None if imu else motion_of_signals(signals, choice)
    if motion is not None:
        assumed += motion.assumed
        reading.said += motion.said
    if imu:
        assumed.append(
            "heave: not in the log; a run makes it of the accelerations by its heave filter, about its own mean track"
        )
    tow = [name for name in MEASURED if name in signals]
    if motion is None and not imu and not tow:
        known = ", ".join(signals)
        raise LogError(
            f"{reading.files[0]}: has neither ship motion nor anything of the tow (there is {known}): nothing was "
            f"imported. Map heave, roll, pitch, or payout, tension, body_depth"
        )
    if motion is None and not imu:
        assumed.append("ship motion: not in the log; a run under this bag needs --motion of another one")
    for line, doubtful in _unused(signals, motion, imu):
        (assumed if doubtful else reading.said).append(line)
    figures = _figures(reading, signals, motion, imu, choice)
    lines = grouped(assumed)
    about = figures | {
        "version": __version__,
        "assumed": lines,
        "signals_assumed": {one.quantity: one.assumed for one in reading.signals},
        "said": reading.said,
        "missing": reading.missing,
        "mapping": {name: read_text(find_mapping(name)) for name in reading.mappings},
        "sources": _hashes(reading.files),
        ALONG: motion.along if motion else None,
        # as io.sources.recorded_tow reads them again
        "rounding": {str(k): [*one.column, *one[1:]] for k, one in (motion.rounded if motion else {}).items()},
    }
    with _in_place_of(path):
        _write(path, about, signals, motion, imu)
    return Imported(path, figures, lines, reading.said, reading.missing)


def _only_a_bag(path: Path) -> bool:
    names = [one.name for one in path.iterdir()] if path.is_dir() else []
    return "metadata.yaml" in names and all(name == "metadata.yaml" or name.endswith(".mcap") for name in names)


@contextmanager
def _in_place_of(path: Path) -> Iterator[None]:
    """The bag that is there goes when the new one is whole, and comes back where it does not get so far."""
    if not path.exists():
        yield
        return
    old = path.with_name(f".{path.name}.{os.getpid()}")
    path.rename(old)
    try:
        yield
    except BaseException:
        shutil.rmtree(path, ignore_errors=True)
        old.rename(path)
        raise
    shutil.rmtree(old)


def grouped(lines: list[str]) -> list[str]:
    """Lines "name: text", those of the same text as one."""
    names: dict[str, list[str]] = {}
    for line in dict.fromkeys(lines):
        name, _, text = line.partition(": ")
        names.setdefault(text, []).append(name)
    return [f"{', '.join(named)}: {text}" for text, named in names.items()]


def _attitude(signals: dict[str, Signal]) -> list[str]:
    """Put attitude made of rates and accelerations beside signals that have none; what is assumed of it."""
    if "roll" in signals or "pitch" in signals or not attitude.can(signals):
        return []
    found, assumed = attitude.attitude(signals)
    if "yaw" in signals:
        del found["yaw"]
    else:
        assumed.append("yaw: relative, of the filter; its origin is where the record began")
    signals.update(found)
    return assumed


INSTEAD = {  # signals that one of these makes needless
    **dict.fromkeys(("speed", "course"), ("x", "latitude")),
    **dict.fromkeys(("z", "heave_rate", *attitude.FORCES), ("heave", "z", "heave_rate")),
    "roll_rate": ("roll",), "pitch_rate": ("pitch",), "yaw_rate": ("yaw",),
}  # fmt: skip


def _unused(signals: Mapping[str, Signal], motion: ShipMotion | None, imu: bool) -> Iterator[tuple[str, bool]]:
    """A line for each signal without effect, and whether it is to stand in the verdict: nothing takes its place."""
    used = set(motion.given if motion is not None else ()) | set(MEASURED)
    by_filter = [one for one in signals.values() if one.source.endswith(attitude.FILTER)]
    if imu or by_filter:
        used |= {*attitude.RATES, *attitude.FORCES}
    if imu:
        used |= {"roll", "pitch", "yaw"}
    if not {"heave", "z"} & signals.keys():
        used.add("heave_rate")
    for name in signals:
        if name in used:
            continue
        better = next((one for one in INSTEAD.get(name, ()) if one in used and one != name), "")
        why = f"{better} is there" if better else "nothing of the motion is made of it"
        if name in attitude.FORCES and not better:
            why = "a heave is made of all three with rates, or with roll and pitch"
        yield f"{name}: read and kept, without effect on the motion: {why}", not better


def _figures(
    reading: Reading, signals: Mapping[str, Signal], motion: ShipMotion | None, imu: bool, choice: Choice
) -> dict[str, Any]:
    span = motion.samples.time if motion is not None else next(iter(signals.values())).time
    return {
        "files": len(reading.files),
        "records": reading.records,
        "lost": sum(one.total for one in reading.losses),
        "without_value": reading.empty,
        "losses": [str(one) for one in reading.losses],
        "mappings": reading.mappings,
        "signals": {name: len(one.time) for name, one in signals.items()},
        "motion": "odometry" if motion is not None else "imu" if imu else "none",
        "given": motion.given if motion is not None else [],
        "track": choice.track,
        "start_ns": int(span[0]),
        "seconds": float((span[-1] - span[0]) * 1e-9),
        "rounded": [one.as_dict() for one in motion.rounded.values()] if motion is not None else [],
    }


def _hashes(files: list[str]) -> list[dict[str, object]]:
    """Name, bytes and SHA-256 of each file; of a bag those of its files."""
    found: list[dict[str, object]] = []
    for name in files:
        path = Path(name)
        for one in sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]:
            if len(found) == LISTED:
                return [*found, {"name": f"and others of {len(files)} files"}]
            with open_file(one, "rb") as file:
                digest = hashlib.file_digest(file, "sha256")
            found.append({"name": one.name, "bytes": one.stat().st_size, "sha256": digest.hexdigest()})
    return found


def _write(
    path: Path, about: dict[str, Any], signals: Mapping[str, Signal], motion: ShipMotion | None, imu: bool
) -> None:
    text = json.dumps(about, ensure_ascii=False)
    try:
        with BagWriter(path, custom_data={IMPORT: text}, chunk_size=2**20) as bag:
            streams: list[Iterable[Message]] = []  # each in order of time: no list of all messages is made
            if motion is not None:
                bag.declare(ODOMETRY, "nav_msgs/msg/Odometry", "sensor")
                events = stream_odometry(motion.samples, about["sources"][0]["name"] if about["sources"] else "log")
                streams.append((event.arrival, ODOMETRY, "nav_msgs/msg/Odometry", event.data) for event in events)
            if imu:
                bag.declare(IMU, "sensor_msgs/msg/Imu", "sensor")
                streams.append((time, IMU, "sensor_msgs/msg/Imu", data) for time, data in imu_messages(signals))
            streams += write_measured(bag, {n: s for n, s in signals.items() if n in QUANTITIES})
            for time, topic, msgtype, data in heapq.merge(*streams, key=lambda row: row[0]):
                bag.add(topic, msgtype, time, data)
    except (MotionError, ValueError, np.linalg.LinAlgError):
        shutil.rmtree(path, ignore_errors=True)
        raise


def imu_messages(signals: Mapping[str, Signal]) -> Iterator[tuple[int, bytes]]:
    """(stamp ns, CDR bytes of sensor_msgs/Imu) at the stamps of the rates, in order of time.

    LogError where attitude, rates and accelerations have no time in common.
    """
    names = (*RATES, *FORCES, *(name for name in ("roll", "pitch", "yaw") if name in signals))
    begin = max(int(signals[name].time[0]) for name in names)
    end = min(int(signals[name].time[-1]) for name in names)
    time = signals[RATES[0]].time
    time = time[(time >= begin) & (time <= end) & (time > 0)]
    if len(time) < 2:
        raise LogError(
            f"the clocks cannot be aligned, {', '.join(names)} have no time in common: nothing was imported. "
            f"Give time or clock_offset in the mapping"
        )
    origin = int(time[0])

    def at(name: str) -> np.ndarray:
        if name not in signals:
            return np.zeros(len(time))
        one = signals[name]
        return np.interp((time - origin) / SECOND, (one.time - origin) / SECOND, one.value)

    turned = quaternion(np.column_stack([at(name) for name in ("roll", "pitch", "yaw")])).tolist()
    rates = np.column_stack([at(name) for name in RATES]).tolist()
    forces = np.column_stack([at(name) for name in FORCES]).tolist()
    for now, turn, rate, force in zip(time.tolist(), turned, rates, forces):
        yield now, imu_bytes(now, turn, rate, force)
