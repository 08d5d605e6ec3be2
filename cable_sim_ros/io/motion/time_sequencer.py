"""Motion in lockstep: held by topic until the clock has come to its stamp, then handed on in one order.

The order is that of the stamps, the IMU before odometry of the same one, however the messages came: all at once from a
bag, or one by one from sensors that move on /clock. No wall time decides anything here.
"""

from __future__ import annotations

from bisect import insort
from collections import deque
from collections.abc import Iterable
from statistics import median
from typing import NamedTuple

from ..messages.messages import SHIPS

SECOND = 1_000_000_000
FAR = SECOND  # ns off the clock, from which on a stamp is odd, as in real time
CONFIRM = 5  # stamps ahead that must agree before they are believed, as in real time
MAX = 100_000  # messages held of one topic: half an hour at 50 Hz
KEPT = 10  # gaps that a period is learnt from
ORDER = {"imu": 0, "odometry": 1, "vehicle": 2, "vehicle_pose": 3}


class Cadence:
    """When the next message of one sender is due on the clock [ns], learnt from its stamps; what was missed is counted.

    period: given, or None: learnt from the second message on; eager: the shortest gap counts, else the usual one;
    delay: by how much its stamps lie behind the clock at which they come, ns.
    A sender whose messages come regularly later than their stamps say (`slack`), or further apart, is believed after
    the second that is missed. One that misses `silent_after` in a row is silent: not due until it speaks again.
    """

    def __init__(self, silent_after: int, period: int | None = None, eager: bool = False, delay: int = 0) -> None:
        self.silent_after, self._given, self._shortest, self.delay = silent_after, period, eager, delay
        self.missed = 0
        self.reset()

    def reset(self) -> None:
        """Forget the sender; what was missed stays counted."""
        self.newest: int | None = None  # stamp, ns
        self.period = self._given
        self.slack = self.in_row = self.received_count = 0
        self._eager, self._widest = self._shortest, 1.5  # times the usual gap: a longer one is a lost message
        self._passed = 0  # periods since the newest that are not waited for any more
        self._gaps: deque[int] = deque(maxlen=KEPT)
        self._suspect = ("", 0)  # why the newest was missed, and which message that was

    @property
    def silent(self) -> bool:
        """Has it missed so many in a row that it is not waited for?"""
        return self.in_row >= self.silent_after

    def due(self, clock: int, minimum: int | None = None) -> bool:
        """Must the next message be there when the clock says this?

        minimum: stamp that is needed while there is no period; None: no message is waited for then.
        """
        if self.newest is None or self.silent:
            return False
        if self.period is None:
            return minimum is not None and self.newest < minimum and not self._passed
        return self.newest + self.period * (self._passed + 1) + self.delay + self.slack <= clock

    def expect(self, clock: int) -> None:
        """Where a period is given there is a sender: its first message is due by this clock."""
        if self._given is not None and self.newest is None:
            self.newest = clock - self._given

    def miss(self, clock: int) -> None:
        """What was due by this clock is not waited for any more."""
        assert self.newest is not None
        self.missed += 1
        self.in_row += 1
        if self.period is None:
            self._passed = 1
            return
        self._passed = max(self._passed + 1, (clock - self.delay - self.slack - self.newest) // self.period)

    def received(self, stamp: int, clock: int) -> None:
        """A message with this stamp came for the step of this clock."""
        self.received_count += 1
        if self.newest is not None and stamp > self.newest:
            gap = stamp - self.newest
            if self.in_row and self.period is not None:
                self._why(gap, clock)
            if self._given is None:
                self._learn(gap)
        self.newest = stamp if self.newest is None else max(stamp, self.newest)
        self.in_row = self._passed = 0

    def _why(self, gap: int, clock: int) -> None:
        assert self.period is not None and self.newest is not None
        ahead = max(1, round(gap / self.period))
        why = "late" if ahead <= self._passed else "slow"
        before, self._suspect = self._suspect, (why, self.received_count)
        since = self.received_count - before[1]
        if why == before[0] == "late" and since == 1:
            self.slack = min(FAR, max(self.slack, clock - self.delay - self.newest - ahead * self.period))
        elif why == before[0] == "slow" and since <= KEPT:
            self._eager, self._widest = False, 2.5

    def _learn(self, gap: int) -> None:
        self._gaps.append(gap)
        if self._eager:
            self.period = gap if self.period is None else min(gap, self.period)
        else:
            usual = median(self._gaps)
            self.period = max(other for other in self._gaps if other <= self._widest * usual)


class Held(NamedTuple):
    """One message that waits: its stamp [ns], place of its kind in the order, a running number, kind, CDR bytes."""

    stamp: int
    order: int
    number: int
    kind: str
    data: bytes


class MotionGate:
    """Holds the motion messages of these kinds. `refused_in_row`: off the clock, one after the other.

    delay: by how much the ticks lie behind the clock, ns: until its period is known, a topic is waited for where a tick
    would run without a sample at its end. The first tick else has one sample or two, as the machine likes, and the
    motion is taken up in another way.
    """

    def __init__(self, silent_after: int, delay: int = 0, kinds: Iterable[str] = SHIPS) -> None:
        self.delay = delay
        self.cadence = {kind: Cadence(silent_after) for kind in kinds}
        self.number = 0
        self.reset()

    def reset(self) -> None:
        """Forget what is held and learnt."""
        self._held: dict[str, list[Held]] = {kind: [] for kind in self.cadence}
        self._ahead: dict[str, list[Held]] = {kind: [] for kind in self.cadence}  # stamps that are not believed yet
        self.refused_in_row = 0
        for cadence in self.cadence.values():
            cadence.reset()

    @property
    def held(self) -> int:
        """Messages that wait."""
        return sum(len(held) for table in (self._held, self._ahead) for held in table.values())

    def put(self, kind: str, stamp: int, data: bytes, clock: int) -> tuple[str, int]:
        """Hold a message; stamp: ns, 0: none, the clock counts. Returns cause and number of what is refused by it."""
        stamp = stamp or clock
        held, ahead = self._held[kind], self._ahead[kind]
        if stamp < clock - FAR:
            self.refused_in_row += 1
            return "stamp_off_clock", 1
        if len(held) + len(ahead) >= MAX:
            return "held_full", 1
        self.refused_in_row = 0
        self.number += 1
        message = Held(stamp, ORDER[kind], self.number, kind, data)
        if stamp <= max(clock, held[-1].stamp if held else clock) + FAR:
            odd = len(ahead)
            ahead.clear()
            self._take_in(message, clock)
            return ("stamp_off_clock", odd) if odd else ("", 0)
        odd = 0
        if ahead and not 0 < stamp - ahead[-1].stamp <= FAR:
            odd = len(ahead)
            ahead.clear()
        ahead.append(message)
        if len(ahead) >= CONFIRM:
            self._believe(kind, clock)
        return ("stamp_off_clock", odd) if odd else ("", 0)

    def _believe(self, kind: str, clock: int) -> None:
        for message in self._ahead[kind]:
            self._take_in(message, clock)
        self._ahead[kind].clear()

    def _take_in(self, message: Held, clock: int) -> None:
        self.cadence[message.kind].received(message.stamp, clock)
        insort(self._held[message.kind], message)

    def awaited(self, clock: int) -> list[str]:
        """Kinds whose next message is due and has not come."""
        for kind, ahead in self._ahead.items():
            if ahead and ahead[0].stamp <= clock + FAR:  # nothing has spoken against them
                self._believe(kind, clock)
        return [kind for kind, cadence in self.cadence.items() if cadence.due(clock, clock - self.delay)]

    def miss(self, clock: int) -> None:
        """Wait no longer for what is due."""
        for kind in self.awaited(clock):
            self.cadence[kind].miss(clock)

    def take(self, clock: int) -> list[Held]:
        """What the clock has come to, in order; it is not held any more."""
        found: list[Held] = []
        for held in self._held.values():
            count = next((k for k, message in enumerate(held) if message.stamp > clock), len(held))
            found += held[:count]
            del held[:count]
        return sorted(found)
