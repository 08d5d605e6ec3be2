"""sensor_msgs/Imu of signals: attitude, rates and accelerations at the stamps of the rates."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from ....io.bags.typestore import STORE
from ....sim.tables.attitude import quaternion
from ..log import SECOND, LogError
from ..signals import Signal
from .attitude import FORCES, RATES


def imu_messages(signals: Mapping[str, Signal]) -> Iterator[tuple[int, bytes]]:
    """(stamp ns, CDR bytes) in order of time. LogError where attitude, rates and accelerations have none in common."""
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
    kinds = STORE.types
    header, stamp, imu, vector, rotor = (
        kinds[name]
        for name in (
            "std_msgs/msg/Header",
            "builtin_interfaces/msg/Time",
            "sensor_msgs/msg/Imu",
            "geometry_msgs/msg/Vector3",
            "geometry_msgs/msg/Quaternion",
        )
    )
    unknown = np.zeros(9)
    for now, turn, rate, force in zip(time.tolist(), turned, rates, forces):
        at_ = header(stamp(now // SECOND, now % SECOND), "base_link")
        message = imu(at_, rotor(*turn), unknown, vector(*rate), unknown, vector(*force), unknown)
        yield now, bytes(STORE.serialize_cdr(message, imu.__msgtype__))
