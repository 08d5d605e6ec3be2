"""Commands of winch and flaps: bytes of a JointState or a JointCommand to their rings, the same for topic and bag.

One rule: a command counts from its arrival, put on the clock of the motion, and the newest arrival wins;
its stamp decides nothing and gives a lag figure. What cannot be right is refused and counted by cause, in the words of
`messages.CAUSES`; what asks for more than the winch can do is carried out as far as that, and counted.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Mapping
from math import isnan, nan

import numpy as np

from ...physics.inputs import MAX_WINGS, Inputs, push_command, push_flaps
from ...physics.winch_command import ASKED_WITHIN
from .cdr import header
from .message_classes import JointState, serialized
from .messages import CAUSES, COMMANDS, JOINT, Command, Event, Refused, decode_flaps

SECOND = 1_000_000_000
OF_A_CLOCK = 60 * SECOND  # ns; a stamp further off a clock is not of that clock
MOVES = SECOND // 10  # ns; the map of the clocks moves back by less; a larger step is followed, or a stop would wait
NEVER = -(2**62)


def encode_command(stamp: int, payout: float | None, rate: float | None) -> bytes:
    """CDR bytes of a command as a sensor_msgs/JointState; stamp: ns; payout: m, rate: m/s, None: not commanded."""
    arrays = (np.array([] if value is None else [value], float) for value in (payout, rate, None))
    return serialized(JointState(header(stamp, ""), [JOINT], *arrays))


def as_joint_state(event: Event) -> Event:
    """A command of any kind as one of `winch/command`; motion, and a message that is no command, as they are."""
    if event.kind not in COMMANDS or event.kind == "command":
        return event
    try:
        command = COMMANDS[event.kind](event.data)
    except Refused:
        return event._replace(kind="command")
    return event._replace(kind="command", data=encode_command(command.stamp, command.payout, command.rate))


def encode_flaps(stamp: int, angles: Mapping[str, float]) -> bytes:
    """CDR bytes of angles [rad] of flaps by name as a sensor_msgs/JointState; stamp: ns."""
    none = np.zeros(0)
    return serialized(JointState(header(stamp, ""), list(angles), np.array([*angles.values()], float), none, none))


def _after(last: int, now: int) -> int:
    """Time on the clock of the motion [ns] at which a command counts that came at ``now``, behind the one before."""
    return max(now, last + 1) if last - now < MOVES else now


class CommandIngest:
    """Writes commands to the ring. One writer: call it from one thread.

    `accepted` counts what was taken for the winch, `flaps_accepted` for flaps, `refused` what was not, by cause,
    `no_command` the messages that are neither: they have no number for the winch, and the command before them goes on.
    `clamped` counts what asked for more than the winch can do, "rate" or "length"; `last` is the newest command taken,
    `last_arrival` its arrival [ns], `last_clamp` what was made of the newest that was clamped, in words, `last_refusal`
    why the newest refused was. `lag` [s] is arrival less stamp of the newest, on the clock that the stamp is of,
    `lag_clock`: "motion", "wall", or "" where it is of neither (`lag` is NaN then).
    """

    def __init__(
        self, inputs: Inputs, drum: np.record | None = None, wall: int = 0, flaps: Mapping[str, int] | None = None
    ) -> None:
        """drum: DRUM record, None: nothing is counted as clamped; wall: what to add to arrivals for wall time, ns;
        flaps: columns of their ring by name."""
        self.inputs, self.drum, self.wall, self.columns = inputs, drum, wall, dict(flaps or {})
        self.accepted = self.flaps_accepted = self.no_command = 0
        self.refused: Counter[str] = Counter()
        self.clamped: Counter[str] = Counter()
        self.last_clamp = self.last_refusal = ""
        self._lags: deque[tuple[int, float]] = deque(maxlen=2000)  # arrival ns, lag s, of the last second
        self.reset()

    def reset(self) -> None:
        """Forget the newest command: after a jump of the clock and before a start."""
        self._last_time = self._last_flaps = NEVER
        self.last: Command | None = None
        self.last_arrival: int | None = None
        self.lag, self.lag_clock = nan, ""
        self._lags.clear()

    def take(self, data: bytes, arrival: int, data_now: int | None, kind: str = "command") -> str:
        """CDR bytes of one message. Returns "" or the cause of refusal, a key of `messages.CAUSES`.

        What commands nothing is counted and changes nothing, before the first motion too.

        arrival: ns; data_now: the same on the clock of the motion data, None before the first motion; kind: of
        COMMANDED.
        """
        try:
            if kind == "flaps":
                return self._take_flaps(data, data_now)
            command = COMMANDS[kind](data)
            if command.is_none:
                self.no_command += 1
                return ""
            if data_now is None:
                raise Refused("before_motion")
        except Refused as refusal:
            return self.refuse(refusal.cause)
        time = _after(self._last_time, data_now)
        self._last_time, self.last_arrival, self.last = time, arrival, command
        self.accepted += 1
        self._note_lag(command.stamp, arrival, data_now)
        if self.drum is not None:
            self._note_clamp(command, self.drum)
        push_command(self.inputs, time, command.payout, command.rate)
        return ""

    def _take_flaps(self, data: bytes, data_now: int | None) -> str:
        row = np.full(MAX_WINGS, nan)
        for name, angle in decode_flaps(data).items():
            if name not in self.columns:
                raise Refused("flap_name")
            row[self.columns[name]] = angle
        if np.isnan(row).all():
            self.no_command += 1
            return ""
        if data_now is None:
            raise Refused("before_motion")
        self._last_flaps = _after(self._last_flaps, data_now)
        self.flaps_accepted += 1
        push_flaps(self.inputs, self._last_flaps, row)
        return ""

    def refuse(self, cause: str) -> str:
        """Count a refusal; returns its cause, a key of `messages.CAUSES`."""
        self.refused[cause] += 1
        self.last_refusal = CAUSES[cause]
        return cause

    @property
    def largest_lag(self) -> float:
        """Lag of the largest magnitude within a second of the newest command, s; NaN: no stamp of a known clock."""
        return max((lag for _, lag in self._lags), key=abs, default=nan)

    def travel(self, payout: float) -> tuple[float, float]:
        """How much may still be commanded out and in [m] from a pay-out [m]."""
        if self.drum is None:
            return nan, nan
        low, high = (float(self.drum.payout_0 + end) for end in (self.drum.min_reach, self.drum.max_reach))
        return max(high - payout, 0.0), max(payout - low, 0.0)

    def _note_lag(self, stamp: int, arrival: int, data_now: int) -> None:
        clocks = (("motion", data_now - stamp), ("wall", arrival + self.wall - stamp))
        self.lag_clock, ns = next(((name, ns) for name, ns in clocks if abs(ns) <= OF_A_CLOCK), ("", 0))
        self.lag = ns * 1e-9 if self.lag_clock else nan
        while self._lags and arrival - self._lags[0][0] > SECOND:
            self._lags.popleft()
        if self.lag_clock:
            self._lags.append((arrival, self.lag))

    def _note_clamp(self, command: Command, drum: np.record) -> None:
        low, high = (float(drum.payout_0 + end) for end in (drum.min_reach, drum.max_reach))
        if not isnan(command.payout):
            if not low - ASKED_WITHIN <= command.payout <= high + ASKED_WITHIN:
                self.clamped["length"] += 1
                end = min(max(command.payout, low), high)
                self.last_clamp = (
                    f"a length of {command.payout:g} m is outside the travel, {low:.2f} to {high:.2f} m of pay-out: "
                    f"the winch goes to {end:.2f} m"
                )
        elif abs(command.rate) > drum.max_rate * (1.0 + ASKED_WITHIN):
            self.clamped["rate"] += 1
            self.last_clamp = (
                f"a rate of {command.rate:g} m/s is beyond winch.max_rate = {drum.max_rate:g} m/s: carried out at that"
            )
