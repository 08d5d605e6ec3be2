"""Winch commands: sensor_msgs/JointState of the joint `payout` to the command ring, faults counted by cause."""

from __future__ import annotations

import math
from collections import Counter

from ..physics.inputs import Inputs, push_command

JOINT = "payout"
FOREIGN_STAMP = 1_000_000_000  # ns; a stamp further off the data's clock is of another clock: arrival counts
LIMIT = 1e5  # m, m/s: a number beyond this is no command


class CommandIngest:
    """Writes commands to the ring. Velocity or position alone may be commanded; NaN or an empty array = not."""

    def __init__(self, inputs: Inputs) -> None:
        self.inputs = inputs
        self.accepted = 0
        self.dropped: Counter[str] = Counter()
        self.last_arrival: int | None = None  # ns, CLOCK_MONOTONIC
        self._last_stamp = -(2**62)

    def reset(self) -> None:
        """Forget the last stamp, after a jump of the clock."""
        self._last_stamp = -(2**62)

    def take(self, message, data_now: int | None, arrival: int) -> str:
        """One JointState; data_now: time of arrival on the data's clock [ns]. Returns "" or the cause of refusal."""
        cause = self._take(message, data_now)
        if cause:
            self.dropped[cause] += 1
        else:
            self.accepted += 1
            self.last_arrival = arrival
        return cause

    def _take(self, message, data_now: int | None) -> str:
        if data_now is None:
            return "before the first motion"
        names = list(message.name)
        if names.count(JOINT) != 1:
            return "joint name"
        arrays = message.position, message.velocity
        if any(len(array) not in (0, len(names)) for array in arrays):
            return "array length"
        index = names.index(JOINT)
        payout, rate = (float(array[index]) if len(array) else math.nan for array in arrays)
        if math.isinf(payout) or math.isinf(rate):
            return "infinite"
        if math.isnan(payout) and math.isnan(rate):
            return "nothing commanded"
        if abs(payout) > LIMIT or abs(rate) > LIMIT:
            return "absurd"
        stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        if stamp == 0 or abs(stamp - data_now) > FOREIGN_STAMP:
            stamp = data_now
        if stamp <= self._last_stamp:
            return "stamp does not advance"
        self._last_stamp = stamp
        push_command(self.inputs, stamp, payout, rate)
        return ""
