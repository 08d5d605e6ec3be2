"""Lockstep: who waits for whom, and for how long. Pure: told times and messages, says what to do next.

A step takes /clock one tick ahead and says so, waits for the motion that is due by then, hands it on, does the tick,
which lies `delay` behind the clock, and waits for the command that is due, once a controller has spoken or where the
period of its commands is given. So a command with the stamp of this clock is there before the clock goes on, whether
the controller answers /clock or the tick, and through how many nodes. Where these keep the stamp of an older sample,
the command that is waited for is that of the clock less `chain_delay`. Wall time enters in the bounded waits and in the
pacing only, as the time that passed between two calls; a hole in the calls (the process stood still) counts as one
LONGEST.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from enum import Enum
from typing import Any

from ..io.messages.messages import SHIPS
from ..io.motion import checkpoint
from ..io.motion.time_sequencer import FAR, Cadence, MotionGate
from .blocks import LockstepParameters

SECOND = 1_000_000_000
REPEAT = 20_000_000  # ns of wall time after which an unchanged clock is said again
LONGEST = 100_000_000  # ns of wall time that one call counts at most
CATCH_UP = 100_000_000  # ns of wall time that is made up for at a rate
OF_A_CLOCK = 60 * SECOND  # ns; a stamp further off is not of this clock
MIN_RATE = 0.1  # but 0: as fast as it goes
REMEMBERED = 64  # stamps of commands


def rate_problem(value: float, done: str = "changed") -> str:
    """What is wrong with a value of lockstep.rate, or ""; done: what was not done, for the text."""
    if value == 0.0 or value >= MIN_RATE:
        return ""
    return (
        f"parameter 'lockstep.rate' = {value:g} is neither 0 (as fast as it goes) nor {MIN_RATE:g} or more; nothing "
        f"was {done}: a slower clock looks like a dead one to whoever listens. Give 0 or {MIN_RATE:g} to 1000, or "
        f"pause and step"
    )


class Do(Enum):
    """What the caller of `Lockstep.next` does now."""

    WAIT = "wait"  # nothing, for so long or until a message comes
    CLOCK = "clock"  # publish the clock
    MOTION = "motion"  # hand on what the gate gives for the clock
    TICK = "tick"  # do the tick of this step, if there is one


class Phase(Enum):
    """Where in a step it is."""

    BETWEEN = "between steps"
    MOTION = "waiting for motion"
    TICK = "ticking"
    COMMAND = "waiting for a command"


class Lockstep:
    """The clock and the steps of one simulation. Times in ns; `clock` is what /clock says."""

    def __init__(self, settings: LockstepParameters, period: int, delay: int, kinds: Iterable[str] = SHIPS) -> None:
        self.settings, self.period, self.delay = settings, period, delay
        self.clock = round(settings.start * SECOND)
        self.paused = settings.paused
        self.held = ""  # why nothing may run, or ""
        self.steps_left = self.steps = 0
        self.gate = MotionGate(settings.silent_after, delay, kinds)
        chain = round(settings.chain_delay * SECOND)
        given = (settings.command_period, settings.flap_period)
        periods = (None if one is None else round(one * SECOND) for one in given)
        self.commands, self.flaps = (Cadence(settings.silent_after, one, True, chain) for one in periods)
        self.late = self.early = self.unstamped = 0
        self.phase = Phase.BETWEEN
        self._waited = 0
        self._called: int | None = None
        self._next_step = self._said = 0  # wall time
        self._stamps: deque[int] = deque(maxlen=REMEMBERED)
        self._flap_stamps: deque[int] = deque(maxlen=REMEMBERED)

    # ---- the order of things

    def next(self, now: int, free: bool, starts: bool = False) -> tuple[Do, float]:
        """What to do at wall time `now` [ns], and for WAIT how long at most [s]; free: no motion yet, at most at rate
        1; starts: no tick yet, at most at rate 1 also where steps are asked for: no command is waited for before the
        second, and a controller by /clock is to see every tick of it."""
        passed = 0 if self._called is None else min(max(now - self._called, 0), LONGEST)
        self._called = now
        if self.held:
            return Do.WAIT, 0.1
        if self.paused and not self.steps_left:
            return self._stand(now, REPEAT)
        self._waited += passed
        if self.phase is Phase.MOTION:
            if self.gate.awaited(self.clock):
                if not self._over:
                    return self._stand(now, REPEAT)
                self.gate.miss(self.clock)
            self.phase = Phase.TICK
            return Do.MOTION, 0.0
        if self.phase is Phase.TICK:
            self.phase, self._waited = Phase.COMMAND, 0
            self.steps += 1
            return Do.TICK, 0.0
        if self.phase is Phase.COMMAND:
            awaited = [sender for sender in (self.commands, self.flaps) if sender.due(self.clock)]
            if awaited and not self._over:
                return self._stand(now, REPEAT)
            for sender in awaited:
                sender.miss(self.clock)
            self.phase = Phase.BETWEEN
        if now < self._next_step and (starts or not self.steps_left):
            return self._stand(now, self._next_step - now)
        if starts:
            self._next_step = now  # the static start is not made up for
        return self._begin(now, free or starts)

    @property
    def _over(self) -> bool:
        return self._waited >= self.settings.wait * SECOND

    def _stand(self, now: int, maximum: int) -> tuple[Do, float]:
        """Say the clock again after a while: one that missed it would wait for ever."""
        left = self._said + REPEAT - now
        if left <= 0:
            self._said = now
            return Do.CLOCK, 0.0
        return Do.WAIT, min(left, maximum) * 1e-9

    def _begin(self, now: int, free: bool) -> tuple[Do, float]:
        rate = self.settings.rate
        if free:
            rate = min(rate or 1.0, 1.0)
        self.clock += self.period
        wall = round(self.period / rate) if rate else 0
        self._next_step = max(self._next_step + wall, now + wall - CATCH_UP) if wall else now
        self.phase, self._waited, self._said = Phase.MOTION, 0, now
        return Do.CLOCK, 0.0

    def step_done(self, counted: bool) -> None:
        """The tick is done; counted: it was one of those asked for."""
        if counted and self.steps_left:
            self.steps_left -= 1

    def go_to(self, clock: int) -> None:
        """The clock says this now; motion, commands and what was learnt of their senders are forgotten."""
        self.clock = clock
        self.phase = Phase.BETWEEN
        self.gate.reset()
        for sender, stamps in map(self._of, ("command", "flaps")):
            sender.reset()
            stamps.clear()

    def set_back(self, tree: Any) -> None:
        """As it was when it was taken, but for what is of the present: whether it stands, and its pace.

        Raises ValueError.
        """
        present = self.paused, self.held, self.steps
        checkpoint.set_back(self, tree)
        self.paused, self.held, self.steps = present
        self.steps_left, self._called, self._next_step, self._said = 0, None, 0, 0

    def check(self, tree: Any) -> None:
        """Raise the ValueError of `set_back` now."""
        checkpoint.check(self, tree)

    # ---- messages

    def motion(self, kind: str, stamp: int, data: bytes) -> tuple[str, int]:
        """Hold a message of motion; as `MotionGate.put`."""
        return self.gate.put(kind, stamp, data, self.clock)

    def _of(self, kind: str) -> tuple[Cadence, deque[int]]:
        """Who sends this kind of commands, and the stamps of what it sent."""
        return (self.flaps, self._flap_stamps) if kind == "flaps" else (self.commands, self._stamps)

    def command(self, stamp: int, kind: str = "command") -> str:
        """Judge a command by its stamp: "" or the cause of its refusal, which is counted with the others."""
        sender, stamps = self._of(kind)
        if not stamp or abs(stamp - self.clock) > OF_A_CLOCK:
            self.unstamped += 1
            return ""
        if stamp > self.clock:
            return "step_future"
        due = stamp + sender.delay  # the clock that it belongs to
        if self.clock - due > FAR:
            return "step_past"
        if stamp in stamps:
            return "step_twice"
        if due <= self.clock - self.period - sender.slack:
            self.late += 1
        elif due > self.clock:
            self.early += 1  # nothing waited for it: when it counts was up to the machine
        if stamps and stamp < stamps[-1]:
            return "step_past"
        return ""

    def took(self, stamp: int, kind: str = "command") -> None:
        """A command that was judged fit has been taken: its sender has spoken."""
        sender, stamps = self._of(kind)
        if stamp and abs(stamp - self.clock) <= OF_A_CLOCK:
            stamps.append(stamp)
        else:
            stamp = self.clock
        sender.received(stamp, self.clock)

    @property
    def awaits(self) -> bool:
        """Is it a message that the next step, or the end of this one, waits for?"""
        stands = self.held or (self.paused and not self.steps_left)
        return not stands and self.phase in (Phase.MOTION, Phase.COMMAND)

    @property
    def doing(self) -> str:
        """The state in words, for diagnostics."""
        if self.held:
            return "held: /clock taken"
        if self.paused and not self.steps_left:
            return "paused"
        return self.phase.value if self.phase is not Phase.BETWEEN else "running"
