"""Winch commands: bytes of sensor_msgs/JointState to the command ring, the same for topic and bag.

A command counts from its stamp where that is of the clock of the motion, else from its arrival on that clock
(`io.clock`). What cannot be right is refused and counted by cause, in the words of `messages.CAUSES`.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from ..physics.inputs import Inputs, push_command
from .messages import JOINT, KINDS, Command, Refused, decode_command
from .typestore import STORE

FOREIGN_STAMP = 1_000_000_000  # ns; a stamp further off the data's clock is of another clock: arrival counts
NEVER = -(2**62)


def encode_command(stamp: int, payout: float | None, rate: float | None) -> bytes:
    """CDR bytes of a command as a sensor_msgs/JointState; stamp: ns; payout: m, rate: m/s, None: not commanded."""
    types = STORE.types
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](*divmod(stamp, 1_000_000_000)), "")
    arrays = (np.array([] if value is None else [value], float) for value in (payout, rate, None))
    kind = KINDS["command"][0]
    return bytes(STORE.serialize_cdr(types[kind](header, [JOINT], *arrays), kind))


class CommandIngest:
    """Writes commands to the ring. One writer: call it from one thread.

    `refused` has the refusals by cause, `accepted` the others, `last_arrival` the arrival of the newest of those, ns.
    """

    def __init__(self, inputs: Inputs) -> None:
        self.inputs = inputs
        self.accepted = 0
        self.refused: Counter[str] = Counter()
        self.last_arrival: int | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the last stamp, after a jump of the clock."""
        self._last_stamp = NEVER

    def take(self, data: bytes, arrival: int, data_now: int | None) -> str:
        """CDR bytes of one JointState. Returns "" or the cause of refusal, a key of `messages.CAUSES`.

        arrival: ns; data_now: the same on the clock of the motion data, None before the first motion.
        """
        try:
            command = decode_command(data)
            stamp = self._stamp(command, data_now)
        except Refused as refusal:
            self.refused[refusal.cause] += 1
            return refusal.cause
        self._last_stamp, self.last_arrival = stamp, arrival
        self.accepted += 1
        push_command(self.inputs, stamp, command.payout, command.rate)
        return ""

    def _stamp(self, command: Command, data_now: int | None) -> int:
        """Time from which the command counts, ns; Refused before the first motion, or if it does not advance."""
        if data_now is None:
            raise Refused("before_motion")
        foreign = command.stamp == 0 or abs(command.stamp - data_now) > FOREIGN_STAMP
        stamp = data_now if foreign else command.stamp
        if stamp <= self._last_stamp:
            raise Refused("stamp_not_advancing")
        return stamp
