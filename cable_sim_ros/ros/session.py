"""One tow from the first motion sample to the end: simulator, loop, clock of the data, and what happens when.

No rclpy here: messages come in as bytes and stamps, so that the states can be tested without a network.

States: unconfigured -> ready -> waiting (for motion) -> running -> halted (solver gave up) or failed (no static start).
"""

from __future__ import annotations

import gc
import json
import math
import sys
import time
from collections import Counter
from collections.abc import Callable

import numpy as np

from ..io.clock import DataClock
from ..io.commands import CommandIngest
from ..io.messages import stamp_of
from ..io.motion import MotionIngest
from ..physics.frame import Source
from ..physics.inputs import MOTION_ROWS, SOURCE
from ..physics.setpoint import SetpointLaw
from ..physics.ship import NO_EPOCH
from ..sim.build import make_output
from ..sim.simulator import Simulator, StartError
from .loop import MAPPING, RESYNCS, SKIPPED, TARGET, Loop
from .params import Settings

RING_ROWS = 128  # ticks a slow publisher may be behind
REHEARSAL = 20  # ticks
START_MARGIN = 0.25  # s; messages that came during the static start must be in before the first tick
SECOND = 1_000_000_000


def carried_over(saved: dict, time_ns: int, position: tuple[float, float]) -> dict:
    """A snapshot() on another clock and with the ship elsewhere, the cable hanging from it as it did.

    The water is the same everywhere, so moving the tow frame moves everything. The motion so far is gone from the ring:
    it stands in the blend, as an offset from the mean track.
    """
    memory = saved["memory"].copy()
    time, frame, ship, events = memory.time, memory.frame, memory.ship, memory.events
    since, later = (time.now - time.start) * 1e-9, time_ns - time.now
    frame.origin += position - (frame.origin + frame.velocity * since + ship.motion.coord[:2])
    time.now += later
    time.start += later
    time.blend = time_ns
    if events.pressed_since >= 0:
        events.pressed_since += later
    ship.epoch = NO_EPOCH
    ship.offset[:] = ship.motion.coord - ship.mean_coord
    ship.offset_rate[:] = ship.motion.rate
    ship.blend_length = 1.0  # any: the first tick takes the offset whole
    return saved | {"memory": memory, "step_memory": memory}


class Session:
    """Settings to a running simulation. Every method is called from one thread (the executor's)."""

    def __init__(self, settings: Settings, log: Callable[[str, str], None]) -> None:
        """log(level, text): "info", "warn" or "error"."""
        self.settings, self.log = settings, log
        self.scene, self.node = settings.scene, settings.node
        self.delay = round(self.node.input_delay * SECOND)
        self.state = "unconfigured"
        self.problem = ""  # why it is halted or failed
        self.clock = DataClock()
        self.refused: Counter[str] = Counter()  # motion messages refused before the ingest, by cause
        self.restarts = self.resets = 0
        self.start_cost = 0.3  # s, of the last static start
        self.residual_start = math.nan
        self.wall = time.time_ns() - time.monotonic_ns()  # once: arrivals as wall time, for messages without a stamp
        self.arrivals: dict[str, int | None] = {"imu": None, "odometry": None}  # newest, CLOCK_MONOTONIC ns
        self.received = {"imu": 0, "odometry": 0}
        self.sim: Simulator | None = None
        self.loop: Loop | None = None
        self.started: dict[str, str] = {}  # time, place and heading of the static start, for the recording
        self.running_since = math.nan  # s, CLOCK_MONOTONIC
        self.ended = math.nan
        self._keep_cable = False  # the next start keeps the cable as it hangs
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

    # ---- configure

    def configure(self) -> None:
        """Build the model, compile, check the static start. Raises StartError."""
        begun = time.monotonic()
        self.log("info", "compiling (about a minute the first time, then from the cache)")
        self.sim = Simulator(self.scene)
        self._static_start(0, (0.0, 0.0), None)
        self.period = round(self.scene.solver.tick * SECOND)
        output = make_output(self.sim.model, self.sim.nodes, RING_ROWS)
        self.loop = Loop(
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
        self.ingest = MotionIngest(
            self.sim.inputs, self.scene.ship, self.node.heave, self.node.motion, self.scene.gravity
        )
        self.commands = CommandIngest(self.sim.inputs)
        gc.collect()
        gc.freeze()  # a full collection with all this loaded stops the process for a tenth of a second
        sys.setswitchinterval(5e-4)
        self.state = "ready"

    def _rehearse(self) -> None:
        """A few ticks without motion: the first ones otherwise overrun while memory is being mapped."""
        self.built_loop.start(0, time.monotonic_ns())
        while self.built_loop.count < REHEARSAL and not self.built_loop.halted:
            time.sleep(0.01)
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
        self._keep_cable = False

    def close(self) -> None:
        """Stop the loop for good."""
        self.state, self.ended = "closed", time.monotonic()
        if self.loop is not None:
            self.loop.stop()

    # ---- inputs

    def motion(self, kind: str, data: bytes, arrival: int) -> None:
        """One message of kind "imu" or "odometry" as CDR bytes; arrival: CLOCK_MONOTONIC, ns."""
        self.received[kind] += 1
        self.arrivals[kind] = arrival
        stamp = stamp_of(data)
        if stamp is None:
            self.refused["size"] += 1
            return
        if stamp and self.clock.suspicious(stamp, arrival):
            self.refused["stamp_off_clock"] += 1
            if self.clock.jumped(stamp, arrival):
                self._clock_jumped()
            return
        head = self.built_sim.inputs.motion_head
        before = int(head[0])
        self.ingest.take(kind, data, arrival + self.wall)
        if int(head[0]) != before:
            self.clock.update(self._newest_stamp(), arrival)
            if self.state == "running":
                self.built_loop.control[TARGET] = self._target()
            elif self.state == "waiting":
                self._start()

    def command(self, data: bytes, arrival: int) -> str:
        """One winch command as CDR bytes; arrival: CLOCK_MONOTONIC, ns. Returns "" or the cause of its refusal."""
        return self.commands.take(data, arrival, self.clock.now(arrival))

    def _newest_stamp(self) -> int:
        inputs = self.built_sim.inputs
        return int(inputs.motion_time[(int(inputs.motion_head[0]) - 1) % MOTION_ROWS])

    def _newest_sample(self) -> np.ndarray:
        inputs = self.built_sim.inputs
        return inputs.motion[(int(inputs.motion_head[0]) - 1) % MOTION_ROWS]

    def _target(self) -> int:
        """Mapping wanted of the loop [ns]: the clock's offset, known from the first sample on, and the delay."""
        assert self.clock.offset is not None, self.state
        return self.clock.offset + self.delay

    def _clock_jumped(self) -> None:
        """The stamps jumped: forget the motion, map the clock anew, keep the cable as it hangs."""
        self.log("warn", "the clock of the motion data has jumped by more than 1 s: waiting for motion on it")
        running = self.state == "running"
        self.built_loop.stop()
        self.clock.reset()
        self.ingest.reset()
        self.commands.reset()
        self.built_sim.inputs.command_head[0] = 0
        if running:
            self._keep_cable = True
            self.activate()

    # ---- start

    def _start(self) -> None:
        """Static start where the ship will be when it is solved, and the loop with it."""
        sample, stamp = self._newest_sample().copy(), self._newest_stamp()
        target = self._target()
        cost = START_MARGIN + (0.0 if self._keep_cable else 1.5 * self.start_cost)
        begin = max(stamp, time.monotonic_ns() - target + round(cost * SECOND))
        ahead = (begin - stamp) * 1e-9
        position = float(sample[0] + sample[6] * ahead), float(sample[1] + sample[7] * ahead)
        try:
            if self._keep_cable:
                self.built_sim.restore(carried_over(self.built_sim.snapshot(), begin, position))
            else:
                self._static_start(begin, position, float(sample[5]))
        except StartError as error:
            self.fail(f"no static start: {error}; nothing is simulated until ~/reset")
            return
        self._keep_cable = False
        self.started = self.started or {
            "start_time_ns": str(begin),
            "start_position_m": json.dumps(position),
            "start_heading_rad": repr(float(sample[5])),
        }
        self.built_loop.start(begin, target)
        self.running_since = time.monotonic()
        self.state, self.problem = "running", ""
        self.log(
            "info",
            f"running from stamp {begin / SECOND:.3f} s at ({position[0]:.1f}, {position[1]:.1f}) m, "
            f"motion from {str(Source(int(sample[SOURCE])).name).lower()}",
        )

    def fail(self, problem: str) -> None:
        self.state, self.problem = "failed", problem
        self.log("error", problem)

    def reset(self) -> tuple[bool, str]:
        """Static start again at the place of the newest motion: (done, text)."""
        if self.loop is None or self.state in ("unconfigured", "ready", "closed"):
            return False, f"the node is {self.state}: activate it first"
        self.loop.stop()
        self.resets += 1
        self._keep_cable = False
        self.activate()
        if self.clock.offset is None:
            return True, "waiting for motion"
        self._start()
        return self.state == "running", self.problem or "started again from the static equilibrium"

    def set_algorithm(self, name: str) -> None:
        """Change the set-point algorithm between two ticks."""
        if self.state != "running":
            self.built_sim.set_algorithm(SetpointLaw(name))
            return
        with self.built_loop.paused():
            self.built_sim.set_algorithm(SetpointLaw(name))

    # ---- watch

    def poll(self) -> None:
        """Called some ten times a second: notices a halt, a lag that cannot be made good, a silent start."""
        if self.state == "waiting" and time.monotonic() - self._waiting_since >= 5.0:
            self._waiting_since = time.monotonic()
            self.log("info", "waiting for motion on imu/data and odom")
        if self.state != "running":
            return
        if self.built_loop.halted:
            self.state = "halted"
            failure = self.built_loop.failure
            self.problem = (
                f"the stepping loop ended: {type(failure).__name__}: {failure}"
                if failure
                else "the solver gave up: the last tick was rolled back and nothing more is published; "
                "~/reset starts again"
            )
            self.log("error", self.problem)
        elif self.lag() > self.node.realtime.max_lag:
            self.log(
                "error",
                f"the simulation lags {self.lag():.1f} s behind the motion: this machine does not hold "
                f"real time; starting again from the static equilibrium",
            )
            self.restarts += 1
            self.reset()

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
            "restarts": self.restarts,
        }
