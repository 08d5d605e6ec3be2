"""Session in lockstep: the same tow, driven by simulation time instead of the clock of the machine (ros/lockstep.py).

The executor's thread calls `advance` between two callbacks; it does what can be done without waiting. A message
arrives when its stamp says, a command at the clock of its step, so wall time has no part in any number.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..io.messages.messages import KINDS, SHIPS, VEHICLES, Event, stamp_of
from ..io.motion.arrival_order import Took
from ..io.motion.checkpoint import check, set_back, taken
from ..io.motion.time_sequencer import CONFIRM, FAR
from ..sim.saved.savefile import damaged
from .blocks import TimeMode
from .lockstep import Do, Lockstep
from .loop import REACHED, Loop, StepLoop
from .parameters import Settings
from .session import SECOND, UNDER_WAY, Session

RATE_OVER = SECOND  # ns of wall time that the achieved rate is measured over


class SteppedSession(Session):
    """As Session; `publish_clock` and `publish_ticks` are set by the node, both publish at once."""

    lockstep = True

    def __init__(self, settings: Settings, log: Callable[[str, str], None]) -> None:
        super().__init__(settings, log)
        self.wall = 0  # arrivals are stamps
        self.period = round(self.scene.solver.tick * SECOND)
        self.steps = Lockstep(self.node.lockstep, self.period, self.delay, self.kinds)
        self.publish_clock: Callable[[int], None] = lambda clock: None
        self.publish_ticks: Callable[[], None] = lambda: None
        self.rate = math.nan  # simulated over wall time, achieved
        self._rates: deque[tuple[int, int]] = deque()
        self.spoken = False  # has any motion come?
        self._missed = 0  # commands, when it was last said
        # clock, bytes, kind of the newest command of winch and flaps before the motion
        self._early: dict[bool, tuple[int, bytes, str]] = {}
        self._recorded = self._ahead = 0  # ns: newest time in a recording, which is so far ahead of the clock

    def _new_loop(self, *parts, **settings) -> Loop:
        return StepLoop(*parts, **settings)

    # ---- time

    def now(self) -> int:
        return self.steps.clock

    def log_time(self) -> int:
        return self.steps.clock

    def record_time(self, arrival: int | None = None) -> int:
        if arrival is not None:
            return arrival + self._ahead
        at = self.steps.clock + self._ahead
        if at < self._recorded:  # the clock was taken back: readers go by these times, and would mix both parts
            self._ahead += self._recorded - at
            at = self._recorded
        self._recorded = at
        return at

    def offset(self) -> int | None:
        return None  # wall time says nothing of a stamp

    def lag(self) -> float:
        return 0.0

    def set_node(self, node) -> None:
        super().set_node(node)
        self.steps.settings = node.lockstep

    def advance(self, now: int) -> float:
        """Do what can be done; now: CLOCK_MONOTONIC, ns. Returns the seconds until something may be to be done."""
        if self.state not in ("waiting", "running"):
            return 0.1
        do, seconds = self.steps.next(now, not self.spoken, self._starts)
        if do is Do.CLOCK:
            self.publish_clock(self.steps.clock)
        elif do is Do.MOTION:
            self._hand_on()
        elif do is Do.TICK:
            self.steps.step_done(self._tick())
        return seconds

    @property
    def _starts(self) -> bool:
        """Is there motion, and the clock still on its way to the first tick?"""
        return self.spoken and (self.state == "waiting" or self.built_loop.count == self.first_tick)

    @property
    def awaits(self) -> bool:
        return self.state in ("waiting", "running") and self.steps.awaits

    def _tick(self) -> bool:
        """The tick of this step; False where the clock has not come to the first one yet."""
        if self.state != "running":
            return True
        loop = self.built_loop
        assert isinstance(loop, StepLoop)
        if self.steps.clock - self.delay <= int(loop.control[REACHED]):
            return False
        loop.step()
        self.publish_ticks()
        self.steps.flaps.expect(self.steps.clock - self.steps.flaps.delay)
        if loop.halted:
            self._halted()
        return True

    # ---- inputs

    def motion(self, event: Event) -> None:
        """One message of kind "imu" or "odometry"; its stamp is its arrival."""
        stamp, _, kind, data = event
        self.received[kind] += 1
        if stamp is None:
            self.refused["size"] += 1
            return
        self.arrivals[kind] = stamp or self.steps.clock
        if not self.spoken and stamp:
            self._first(stamp)
        self.spoken = True
        cause, count = self.steps.motion(kind, stamp, data)
        if cause:
            self.refused[cause] += count

    def vehicle(self, event: Event) -> None:
        """One message of a kind of VEHICLES; its stamp is its arrival."""
        stamp, _, kind, data = event
        self.vehicle_received(event)
        cause, count = ("size", 1) if stamp is None else self.steps.motion(kind, stamp, data)
        if cause and self.intake.vehicle is not None:
            self.intake.vehicle.counts[cause] += count

    def _first(self, stamp: int) -> None:
        """The first motion decides what the clock says."""
        off = stamp - self.steps.clock
        if abs(off) > FAR:
            self.log(
                "info", f"/clock goes to the stamp of the first motion, {stamp / SECOND:.3f} s: {off * 1e-9:+.3f} s"
            )
            self.steps.go_to(stamp)

    def _hand_on(self) -> None:
        messages = self.steps.gate.take(self.steps.clock)
        if self.state == "waiting":  # the pose of a vehicle before the motion that the tow starts with
            messages.sort(key=lambda message: message.kind in SHIPS)
        for message in messages:
            if message.kind in VEHICLES:
                self.take_vehicle(Event(stamp_of(message.data), message.stamp, message.kind, message.data))
                continue
            # the stamp of one that waited is the clock where its own is 0
            took = self.intake.motion(Event(stamp_of(message.data), message.stamp, message.kind, message.data))
            while self.intake.ingest.notices:
                self.log("warn", self.intake.ingest.notices.popleft())
            if took is Took.SAMPLE and self.state == "waiting":
                self._start()
                self.steps.commands.expect(self.steps.clock)
                self._take_early()

    def command(self, data: bytes, arrival: int, kind: str = "command") -> str:
        """One command as CDR bytes; it arrives at the clock, so that its own step's tick does not know it yet.

        One from before the motion is kept while the clock stands: the tow may start at this clock.
        """
        stamp = stamp_of(data) or 0
        cause = self.steps.command(stamp, kind)
        if cause:
            return self.intake.commands.refuse(cause)
        cause = self.intake.command(data, self.steps.clock + (self.delay == 0), kind)
        if cause in ("", "before_motion"):
            self.steps.took(stamp, kind)
        if cause == "before_motion":
            self._early[kind == "flaps"] = self.steps.clock, data, kind
        return cause

    def _take_early(self) -> None:
        """At the start: what came at this clock, but before the motion, came in time."""
        early, self._early = self._early, {}
        for clock, data, kind in early.values():
            if clock == self.steps.clock:
                self.intake.commands.refused["before_motion"] -= 1
                what = KINDS[kind][1]
                self.log("info", f"{what} came before the motion of the same /clock: it counts from the start")
                self.intake.command(data, self.steps.clock + (self.delay == 0), kind)

    # ---- start

    def _when(self, stamp: int) -> tuple[int, int]:
        """Start at the first tick time of the clock that is not before the first motion."""
        present, first = self.steps.clock - self.delay, self.intake.ingest.first_pose
        late = max(0, (stamp if first is None else first[0]) - present)
        return present + -(-late // self.period) * self.period, 0

    def fail(self, problem: str) -> None:
        super().fail(problem)
        self.steps.steps_left = 0

    def reset(self) -> tuple[bool, str]:
        """Static start again; where the motion has left the clock, its next stamp decides what the clock says."""
        self.steps.steps_left, self._early = 0, {}
        if self.loop is not None and self.steps.gate.refused_in_row >= CONFIRM:
            self.intake.jump()
            self.steps.gate.reset()
            self.spoken = False
        return super().reset()

    # ---- save and restore: ros/session.py

    def notes(self) -> dict[str, Any]:
        return {"lockstep": True, "spoken": self.spoken, "intake": taken(self.intake), "steps": taken(self.steps)}

    def go_back(self, path: Path, arrays: dict[str, np.ndarray], notes: Any) -> tuple[bool, str] | None:
        if not (isinstance(notes, dict) and notes.get("lockstep")):
            return None  # its motion came by another clock
        try:
            check(self.intake, notes["intake"])
            self.steps.check(notes["steps"])
            if not isinstance(notes["spoken"], bool):
                raise ValueError("spoken is neither true nor false")
        except (KeyError, ValueError) as error:
            return False, str(damaged(path, f"its notes of the node do not fit, {error}"))
        self.built_loop.stop()
        self._set_back(notes)
        self.put(arrays)
        start = self.here("restore")
        self._cause = "start"
        self._note_start(start)
        self.built_loop.start(start.time, 0)
        self.state, self.problem = "running", ""
        return True, ""

    def _set_back(self, notes: dict[str, Any]) -> None:
        set_back(self.intake, notes["intake"])
        self.steps.set_back(notes["steps"])
        self.spoken = notes["spoken"]

    def begin_anew(self) -> tuple[bool, str]:
        """As if the node had just been activated: /clock at lockstep.start, no motion yet."""
        if self.state not in UNDER_WAY:
            return False, f"the node is {self.state}: activate it first"
        self.built_loop.stop()
        self.resets += 1
        self.intake.jump()
        self.steps.go_to(round(self.node.lockstep.start * SECOND))
        self.steps.paused, self.steps.steps_left = self.node.lockstep.paused, 0
        self._early = {}
        self.spoken, self._cause = False, "start"
        self.activate()
        return True, f"/clock {self.steps.clock / SECOND:.3f} s; waiting for motion"

    # ---- control

    @property
    def paused(self) -> bool:
        return self.steps.paused

    @property
    def steps_left(self) -> int:
        return self.steps.steps_left

    def pause(self, on: bool) -> tuple[bool, str]:
        self.steps.paused = on
        self.steps.steps_left = 0
        return True, f"{'paused' if on else 'running'}, /clock {self.steps.clock / SECOND:.3f} s"

    def step(self, count: int) -> tuple[bool, str]:
        if self.state not in ("waiting", "running"):
            return False, f"the node is {self.state}: activate it first"
        if not self.paused:
            return False, "it runs; pause it first, by ~/pause with data: true"
        if self.steps_left:
            return False, f"{self.steps_left} ticks of the step before are still to be done"
        self.steps.steps_left = count
        return True, f"{count} ticks from /clock {self.steps.clock / SECOND:.3f} s on"

    def hold(self, why: str) -> None:
        """Hold the simulation, or let it go on with ""; said once."""
        if why and not self.steps.held:
            self.log("error", why)
        elif self.steps.held and not why:
            self.log("info", "/clock is this node's alone again: the simulation goes on")
        self.steps.held = why

    def poll(self) -> None:
        """Called twenty times a second: the achieved rate; a word while nothing comes."""
        now = time.monotonic_ns()
        self._rates.append((now, self.steps.steps))
        while len(self._rates) > 2 and now - self._rates[1][0] >= RATE_OVER:
            self._rates.popleft()
        then, before = self._rates[0]
        self.rate = (self.steps.steps - before) * self.period / (now - then) if now > then else math.nan
        self.pace.factor = self.rate
        self._say_missed()
        self._say_waiting()

    def _say_missed(self) -> None:
        """At the first command that a step has waited for in vain, and at ten times as many."""
        steps, node = self.steps, self.node.lockstep
        missed = steps.commands.missed + steps.flaps.missed
        if missed >= max(1, 10 * self._missed):
            self._missed = missed
            winch = steps.commands.missed >= steps.flaps.missed
            who, key = ("winch", "command_period") if winch else ("flap", "flap_period")
            period = getattr(node, key)
            ask = "" if period is None else f" is lockstep.{key} = {period:g} s that of the controller, and its first?"
            self.log(
                "warn",
                f"no {who} command came for the step of /clock {steps.clock / SECOND:.3f} s within lockstep.wait = "
                f"{node.wait:g} s of wall time; missed so far: {missed};{ask or ' the last one acts'}",
            )


def session_of(settings: Settings, log: Callable[[str, str], None]) -> Session:
    """The session that time_mode asks for."""
    return (SteppedSession if settings.node.time_mode is TimeMode.LOCKSTEP else Session)(settings, log)
