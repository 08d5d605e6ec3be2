"""One tow from the first motion sample to the end: simulator, loop, clock of the data, and what happens when.

No rclpy here: messages come in as bytes and stamps, so that the states can be tested without a network.

States: unconfigured -> ready -> waiting (for motion) -> running -> halted (solver gave up) or failed (no static start);
running is shown as overloaded while it does not hold real time (ros/overload.py).
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from ..io.messages.commands import CommandIngest
from ..io.messages.messages import Event
from ..io.motion.arrival_order import Intake, Took
from ..io.motion.clock import DataClock
from ..io.motion.motion import MotionIngest
from ..io.motion.refusals import TOPICS
from ..io.recordings.journal import STATIC, Journal, Start
from ..physics.inputs import MOTION_ROWS, SOURCE
from ..physics.tick_output import Source
from ..sim.build import make_output
from ..sim.live_parameters import changed, put_live
from ..sim.rebase import carried_over
from ..sim.simulator import Simulator, StartError
from ..sim.tables.current import turned_current
from .blocks import NodeBlock
from .gc_tuning import quiet
from .loop import MAPPING, RESYNCS, SKIPPED, TARGET, Loop
from .overload import Pace
from .parameters import Settings
from .saving import Saving
from .timing import Distance, Timing

RING_ROWS = 128  # ticks a slow publisher may be behind
REHEARSAL = 20  # ticks
START_MARGIN = 0.25  # s; messages that came during the static start must be in before the first tick
SECOND = 1_000_000_000


class Session(Timing, Saving):
    """Settings to a running simulation. Every method is called from one thread (the executor's)."""

    def __init__(self, settings: Settings, log: Callable[[str, str], None]) -> None:
        """log(level, text): "info", "warn" or "error"."""
        self.settings, self.log = settings, log
        self.scene, self.node = settings.scene, settings.node
        self.delay = round(self.node.input_delay * SECOND)
        self.distance = Distance(self.delay, round(self.scene.ship.stale_after * SECOND))
        self.state = "unconfigured"
        self.problem = ""  # why it is halted or failed
        self.clock = DataClock()
        self.journal: Journal | None = None  # of a recording
        self.live: dict[str, Any] = {}  # parameters changed since the node began
        self.skips_ahead = self.resets = 0
        self.pace = Pace(round(self.scene.solver.tick * SECOND))
        self.start_cost = 0.3  # s, of the last static start
        self.residual_start = math.nan
        self.wall = time.time_ns() - time.monotonic_ns()  # once: arrivals as wall time, for messages without a stamp
        self.arrivals: dict[str, int | None] = {"imu": None, "odometry": None}  # newest, CLOCK_MONOTONIC ns
        self.received = {"imu": 0, "odometry": 0}
        self.sim: Simulator | None = None
        self.loop: Loop | None = None
        self.running_since, self.first_tick = math.nan, 0  # s, CLOCK_MONOTONIC; of the newest start
        self.ended = math.nan
        self._cause = "start"  # of the next start, as in the journal; the cable is kept after a jump or a lag
        self._waiting_since = 0.0

    @property
    def built_sim(self) -> Simulator:
        """The simulator, which `configure` has made."""
        assert self.sim is not None, self.state
        return self.sim

    @property
    def built_loop(self) -> Loop:
        """The loop, which `configure` has made."""
        assert self.loop is not None, self.state
        return self.loop

    def set_node(self, node: NodeBlock) -> None:
        """Other values of the node's own live parameters."""
        self.node = node

    # ---- configure

    def configure(self) -> None:
        """Build the model, compile, check the static start. Raises StartError."""
        begun = time.monotonic()
        self.log("info", "compiling (about a minute the first time, then from the cache)")
        self.sim = Simulator(self.scene)
        self._static_start(0, (0.0, 0.0), None)
        self.period = round(self.scene.solver.tick * SECOND)
        output = make_output(self.sim.model, self.sim.nodes, RING_ROWS)
        self.loop = self._new_loop(
            self.sim.model,
            self.sim.state,
            self.sim.inputs,
            output,
            period_ns=self.period,
            priority=self.node.realtime.priority,
            max_catchup=self.node.realtime.max_catchup,
        )
        self.loop.warm_up()
        self._rehearse()
        self.log(
            "info", f"static start solved in {self.start_cost:.2f} s; configured after {time.monotonic() - begun:.1f} s"
        )
        drum, frame = self.sim.model.settings[0].drum, self.node.frame
        self.intake = Intake(
            self.sim.inputs,
            self.scene,
            self.node.motion,
            self.node.heave,
            self.clock,
            self.wall,
            drum,
            (frame.odom, frame.base_link),
        )
        quiet()
        self.state = "ready"

    def _new_loop(self, *parts, **settings) -> Loop:
        return Loop(*parts, **settings)

    def _rehearse(self) -> None:
        """A few ticks without motion: the first ones otherwise overrun while memory is being mapped."""
        self.built_loop.start(0, time.monotonic_ns())
        self.built_loop.run_to(REHEARSAL)
        self.built_loop.stop()
        halted = self.built_loop.halted
        self.built_loop.clear()
        if halted:
            raise StartError("the first ticks after the static start cannot be solved", math.nan)
        self._static_start(0, (0.0, 0.0), None)

    def _static_start(self, time_ns: int, position: tuple[float, float], heading: float | None) -> None:
        begun = time.monotonic()
        self.built_sim.start(time_ns=time_ns, position=position, heading=heading, keep_inputs=True)
        self.start_cost = time.monotonic() - begun

    # ---- activate, deactivate

    def activate(self) -> None:
        """Wait for motion; the loop starts with it."""
        self.state, self.problem = "waiting", ""
        self._waiting_since = time.monotonic()

    def deactivate(self) -> None:
        """Stop the loop; the motion is still listened to."""
        self.built_loop.stop()
        self.state = "ready"
        self._cause = "start"

    def close(self) -> None:
        """Stop the loop for good."""
        self.state, self.ended = "closed", time.monotonic()
        if self.loop is not None:
            self.loop.stop()

    # ---- inputs

    def motion(self, event: Event) -> None:
        """One message of kind "imu" or "odometry"; its arrival is on CLOCK_MONOTONIC."""
        self.received[event.kind] += 1
        self.arrivals[event.kind] = event.arrival
        took = self.intake.motion(event)
        while self.ingest.notices:
            self.log("warn", self.ingest.notices.popleft())
        if took is Took.JUMPED:
            self._clock_jumped()
        elif took is Took.SAMPLE:
            self.distance.took(self._newest_stamp(), time.monotonic_ns() - self._offset())
            if self.state == "running":
                self.built_loop.control[TARGET] = self._target()
            elif self.state == "waiting":
                self._start()

    def command(self, data: bytes, arrival: int, kind: str = "command") -> str:
        """One winch command as CDR bytes; arrival: CLOCK_MONOTONIC, ns; kind: of COMMANDS. Returns "" or the cause of
        its refusal."""
        return self.intake.command(data, arrival, kind)

    @property
    def ingest(self) -> MotionIngest:
        """Of the motion."""
        return self.intake.ingest

    @property
    def commands(self) -> CommandIngest:
        """Of the winch commands."""
        return self.intake.commands

    @property
    def refused(self) -> Counter[str]:
        """Motion that did not come as far as the ingest, by cause."""
        intake = getattr(self, "intake", None)  # made by `configure`
        return Counter() if intake is None else intake.refused

    def _newest_stamp(self) -> int:
        inputs = self.built_sim.inputs
        return int(inputs.motion_time[(int(inputs.motion_head[0]) - 1) % MOTION_ROWS])

    def _newest_sample(self) -> np.ndarray:
        inputs = self.built_sim.inputs
        return inputs.motion[(int(inputs.motion_head[0]) - 1) % MOTION_ROWS]

    def _offset(self) -> int:
        """The clock's offset [ns], known from the first sample on."""
        assert self.clock.offset is not None, self.state
        return self.clock.offset

    def _target(self) -> int:
        """Mapping wanted of the loop [ns]."""
        return self._offset() + self.distance.delay

    def _clock_jumped(self) -> None:
        """The stamps jumped: forget the motion, map the clock anew, keep the cable as it hangs."""
        self.log(
            "warn",
            f"the clock of the motion data has jumped by {self.clock.jump / SECOND:+.3f} s: the tow goes on as it "
            f"hangs, with the first motion on the new clock",
        )
        running = self.state == "running"
        self.built_loop.stop()
        self.intake.jump()
        self.distance.reset()
        if running:
            self._cause = "jump"
            self.activate()

    # ---- start

    def _start(self) -> None:
        """Static start where the ship will be when it is solved, and the loop with it."""
        sample, stamp = self._newest_sample().copy(), self._newest_stamp()
        begin, target = self._when(stamp)
        kept = self._cause not in STATIC
        if problem := self.not_restored(float(sample[5])):
            self.fail(problem)
            return
        ahead = (begin - stamp) * 1e-9
        position = float(sample[0] + sample[6] * ahead), float(sample[1] + sample[7] * ahead)
        try:
            if kept:
                self.built_sim.restore(carried_over(self.built_sim.snapshot(), begin, position))
            else:
                self._static_start(begin, position, float(sample[5]))
        except StartError as error:
            self.fail(f"no static start: {error}; nothing is simulated until ~/reset")
            return
        start = Start(begin, position, float(sample[5]), self._cause)
        self._cause = "start"
        self._note_start(start)
        self.built_loop.start(begin, target)
        self.pace.begin(begin + self.period + target, self.built_loop.count)
        self.running_since, self.first_tick = time.monotonic(), self.built_loop.count
        self.state, self.problem = "running", ""
        turned = turned_current(self.scene, float(sample[5]))
        if turned:
            self.log("warn", turned)
        self.log(
            "info",
            f"running from stamp {begin / SECOND:.3f} s at ({position[0]:.1f}, {position[1]:.1f}) m, "
            f"motion from {str(Source(int(sample[SOURCE])).name).lower()}",
        )

    def _when(self, stamp: int) -> tuple[int, int]:
        """Time of a start that is due now, and the mapping of the loop [ns]; stamp: of the newest motion."""
        target = self._target()
        cost = START_MARGIN + (1.5 * self.start_cost if self._cause in STATIC else 0.0)
        return max(stamp, time.monotonic_ns() - target + round(cost * SECOND)), target

    def fail(self, problem: str) -> None:
        self.state, self.problem = "failed", problem
        self.log("error", problem)

    def reset(self) -> tuple[bool, str]:
        """Static start again at the place of the newest motion: (done, text)."""
        if self.loop is None or self.state in ("unconfigured", "ready", "closed"):
            return False, f"the node is {self.state}: activate it first"
        self.loop.stop()
        self.resets += 1
        self.intake.forget_commands()
        self._cause = "reset"
        return self._begin_again("started again from the static equilibrium")

    def _begin_again(self, text: str) -> tuple[bool, str]:
        self.activate()
        if not self.motion_known:
            return True, f"{text}; waiting for motion" if self._cause == "restore" else "waiting for motion"
        self._start()
        return self.state == "running", self.problem or text

    def set_live(self, name: str, value: Any) -> None:
        """Give a live parameter of the scene (sim/live_parameters.py) another value, between two ticks of the loop."""
        self.scene = changed(self.scene, name, value)
        self.live[name] = value
        if self.sim is None:
            return  # the simulator is made from the scene
        with self.between_ticks():
            put_live(self.sim, name, value)
            if self.journal is not None and self.state == "running":
                self.journal.set(self.built_loop.count, name, value)

    # ---- recording

    def new_journal(self, put: Callable[[bytes], None]) -> Journal:
        """A journal of what this session's simulator is given; put: records one message."""
        return Journal(put, self.built_sim.inputs)

    def record(self, journal: Journal) -> None:
        """Keep a recording's journal, which the publisher has; of a tow that is running it begins with its state."""
        with self.between_ticks():
            self.journal = journal
            if self.state == "running":
                self._note_start(self.here("recording"))

    def _note_start(self, start: Start) -> None:
        if self.journal is not None:
            self.journal.start(self.built_loop.count, start, self.live, self.built_sim.snapshot())

    # ---- watch

    def poll(self) -> None:
        """Called twenty times a second: notices a halt, a standstill, an overload, a lag, a silent start."""
        self._say_waiting()
        if self.state != "running":
            return
        loop, now = self.built_loop, time.monotonic_ns()
        for level, text in self.pace.look(now, loop.count, loop.rows, loop.row, int(loop.control[SKIPPED])):
            self.log(level, text)
        if self.built_loop.halted:
            self._halted()
        elif self.lag() > self.node.realtime.max_lag:
            self._skip_ahead(now)

    def _say_waiting(self) -> None:
        if self.state == "waiting" and time.monotonic() - self._waiting_since >= 5.0:
            self._waiting_since = time.monotonic()
            ingest = getattr(self, "ingest", None)
            why = [] if ingest is None else [f"{TOPICS[k]}: {w}" for k in TOPICS if (w := ingest.refused.why(k))]
            if why:
                self.log("error", f"motion comes, but none can be used, so the tow does not begin. {'; '.join(why)}")
            else:
                self.log("info", "waiting for motion on imu/data and odom")

    def _halted(self) -> None:
        self.state = "halted"
        failure = self.built_loop.failure
        self.problem = (
            f"the stepping loop ended: {type(failure).__name__}: {failure}"
            if failure
            else "the solver gave up: the last tick was rolled back and nothing more is published; ~/reset starts again"
        )
        self.log("error", self.problem)

    def _skip_ahead(self, now: int) -> None:
        """Take the simulation to the present, the cable as it hangs; now: CLOCK_MONOTONIC, ns."""
        lag = self.lag()
        if not self.pace.stopped_lately(now, lag):
            for level, text in self.pace.overload(now):
                self.log(level, text)
        self.log("warn", f"{lag:.1f} s behind the motion: going on at the present with the cable as it hangs")
        self.skips_ahead += 1
        self.built_loop.stop()
        self._cause = "behind"
        self.activate()
        self._start()

    @property
    def shown_state(self) -> str:
        """The state as reported: "overloaded" is a running simulation that does not hold real time."""
        return "overloaded" if self.state == "running" and self.pace.overloaded else self.state

    def lag(self) -> float:
        """How far the simulation is behind where it should be, s (0 in step)."""
        control = self.built_loop.control
        return max(0.0, int(control[MAPPING] - control[TARGET]) * 1e-9)

    def counters(self) -> dict[str, int]:
        control = self.built_loop.control
        return {
            "ticks": self.built_loop.count,
            "overruns": self.built_loop.overruns,
            "skipped": int(control[SKIPPED]),
            "resyncs": int(control[RESYNCS]),
            "clock_jumps": self.clock.jumps,
            "resets": self.resets,
            "skips_ahead": self.skips_ahead,
            "overloads": self.pace.overloads,
            "standstills": self.pace.stops,
        }
