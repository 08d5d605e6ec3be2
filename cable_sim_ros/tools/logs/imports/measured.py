"""What a log measured of the tow as messages of the product's topics, and every signal as it is.

A quantity that a message has and the log lacks is NaN there. `import/signals` (JointState) has each record of each
signal by name: what reads an imported bag takes these, so that no record is resampled.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping

import numpy as np

from ....io.bags.bag_writer import BagWriter
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
    serialized,
)
from ..own_signals import SIGNALS_TOPIC
from ..signals import Signal

JOINT = "sensor_msgs/msg/JointState"
WRENCH = "geometry_msgs/msg/WrenchStamped"
POSE = "geometry_msgs/msg/PoseStamped"
WINCH = ("payout", "payout_rate", "tension_drum")
BODY = ("body_x", "body_y", "body_depth")
MEASURED = (*WINCH, "tension", *BODY, "departure_angle", "layback", "body_latitude", "body_longitude")
Message = tuple[int, str, str, bytes]


def write_measured(bag: BagWriter, signals: Mapping[str, Signal]) -> list[Iterator[Message]]:
    """Declares the topics; messages of each in order of time, made as they are asked for."""
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
