"""One tow from the first motion sample to the end: simulator, loop, clock of the data, and what happens when.

No rclpy here: messages come in as bytes and stamps, so that the states can be tested without a network.

States: unconfigured -> ready -> waiting (for motion) -> running -> halted (solver gave up) or failed (no static start);
running is shown as overloaded while it does not hold real time (ros/overload.py).
"""

from __future__ import annotations

import math
import time
from collections import Counter, deque
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from ..compiler.packaged import packaged
from ..io.messages.messages import SHIPS, VEHICLES, Event
from ..io.motion.arrival_order import DataClock, Intake, Took
from ..io.motion.motion import TOPICS
from ..io.recordings.journal import STATIC, Journal, Start
from ..physics.inputs import MOTION_ROWS, SOURCE, make_inputs
from ..physics.state import NOW
from ..physics.tick_output import Source
from ..physics.towbody import BodyModel
from ..sim.build import make_output
from ..sim.live_parameters import changed, put_live, value_of, ways
from ..sim.rebase import carried_over, heading_problem, place
from ..sim.saved import savefile
from ..sim.saved.savefile import SaveError, differences
from ..sim.simulator import Simulator, StartError
from ..sim.tables.current import turned_current
from .blocks import NodeBlock
from .loop import MAPPING, RESYNCS, SKIPPED, TARGET, Loop, quiet
from .overload import Pace
from .parameters import Settings
from .timing import NOT_IN_REAL_TIME, Distance

RING_ROWS = 128  # ticks a slow publisher may be behind
REHEARSAL = 20  # ticks
NODE = "node"  # key of the notes in the file of a saved tow
UNDER_WAY = ("waiting", "running", "halted", "failed")
START_MARGIN = 0.25  # s; messages that came during the static start must be in before the first tick
SECOND = 1_000_000_000
NO_POSE = "no pose has come on vehicle/odom or vehicle/pose: the vehicle is where the scene has it, along with the ship"


class Session:
    """Settings to a running simulation. Every method is called from one thread (the executor's).

    What it says of time, and pause and step, are those of real time; ros/stepped.py has lockstep.
    """

    lockstep = False

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
        self.timetable, self.unshown = settings.faults, deque[str]()  # unshown: set by it, not yet shown by the node
        self.skips_ahead = self.resets = 0
        self.pace = Pace(round(self.scene.solver.tick * SECOND))
        self.start_cost = 0.3  # s, of the last static start
        self.wall = time.time_ns() - time.monotonic_ns()  # once: arrivals as wall time, for messages without a stamp
        self.arrivals: dict[str, int | None] = {"imu": None, "odometry": None}  # newest, CLOCK_MONOTONIC ns
        self.received = {"imu": 0, "odometry": 0}
        self.sim: Simulator | None = None
        self.loop: Loop | None = None
        self.running_since, self.first_tick = math.nan, 0  # s, CLOCK_MONOTONIC; of the newest start
        self.ended = math.nan
        self._cause = "start"  # of the next start, as in the journal; the cable is kept after a jump or a lag
        self._waiting_since = 0.0
        self.driven = self.scene.towbody.model is BodyModel.VEHICLE
        self.kinds = (*SHIPS, *VEHICLES) if self.driven else SHIPS  # of motion
        self.early: Event | None = None  # newest pose of the vehicle before the clock of the motion is known
        self.vehicle_arrival: int | None = None  # of the newest, CLOCK_MONOTONIC ns
        self.poses = 0  # messages of the vehicle

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
        self.log("info", packaged.ahead())
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
        self.log("warn" if packaged.complaint() else "info", f"kernels: {packaged.told()}")
        took = time.monotonic() - begun
        self.log("info", f"static start solved in {self.start_cost:.2f} s; configured after {took:.1f} s")
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
            frame.vehicle_link,
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
        self.built_loop.meet = self._meet

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
        while self.intake.ingest.notices:
            self.log("warn", self.intake.ingest.notices.popleft())
        if took is Took.JUMPED:
            self._clock_jumped()
        elif took is Took.SAMPLE:
            self.distance.took(self._newest_stamp(), time.monotonic_ns() - self._offset())
            if self.state == "running":
                self.built_loop.control[TARGET] = self._target()
            elif self.state == "waiting":
                self._start()

    def vehicle(self, event: Event) -> None:
        """One message of a kind of VEHICLES; its arrival is on CLOCK_MONOTONIC."""
        self.vehicle_received(event)
        self.take_vehicle(event)

    def vehicle_received(self, event: Event) -> None:
        """Count a message of the vehicle."""
        self.poses += 1
        self.vehicle_arrival = event.arrival

    def take_vehicle(self, event: Event) -> None:
        """Take a pose in, or keep it until the clock of the motion is known."""
        if self.clock.offset is None:
            self.early = event
            return
        self.intake.of_vehicle(event)
        while self.intake.vehicle is not None and self.intake.vehicle.notices:
            self.log("warn", self.intake.vehicle.notices.popleft())

    def command(self, data: bytes, arrival: int, kind: str = "command") -> str:
        """One command as CDR bytes; arrival: CLOCK_MONOTONIC, ns; kind: of COMMANDED. Returns "" or the cause of
        its refusal."""
        return self.intake.command(data, arrival, kind)

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
        if self.early is not None:
            early, self.early = self.early, None
            self.take_vehicle(early)
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
                self._go_to(0)
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
        if self.driven and not int(self.built_sim.inputs.vehicle_head[0]):
            self.log("warn", NO_POSE)
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
        with self.between_ticks():
            self._put_live(name, value, self.state == "running")

    def _put_live(self, name: str, value: Any, under_way: bool) -> None:
        self.scene = changed(self.scene, name, value)
        self.live[name] = value
        if self.sim is None:
            return  # the simulator is made from the scene
        put_live(self.sim, name, value)
        if self.journal is not None and under_way:
            self.journal.set(self.built_loop.count, name, value)

    def _meet(self) -> int:
        """Set what the timetable has before the next tick, in its thread; returns the ticks to the next time."""
        done = int(self.built_sim.state.memory[NOW].time.ticks)
        for one in self.timetable.due(done):
            self._put_live(one.key, one.value, True)
            self.unshown.append(one.key)
        return self.timetable.left(done)

    def _go_to(self, done: int) -> None:
        """The timetable, and the scene with it, to where a tow has done so many ticks; it is put there next."""
        for key, value in self.timetable.go_to(done).items():
            if getattr(now := value_of(self.scene, key), "value", now) != value:
                self.scene, self.live[key] = changed(self.scene, key, value), value
                self.built_sim.scene = changed(self.built_sim.scene, key, value)
                self.unshown.append(key)

    # ---- recording

    def record(self, journal: Journal) -> None:
        """Keep a recording's journal, which the publisher has; of a tow that is running it begins with its state."""
        with self.between_ticks():
            self.journal = journal
            if self.state == "running":
                self._note_start(self.here("recording"))

    def _note_start(self, start: Start) -> None:
        if self.journal is not None:
            self.journal.start(self.built_loop.count, start, self.live, self.built_sim.snapshot())

    # ---- save and restore, as files of sim/saved/savefile.py

    # In real time a restored tow is taken to the present, the cable as it hangs, like one whose clock has jumped: the
    # motion and the commands of then are over. In lockstep the clock goes back to the saved time with everything that
    # simulation, intake and steps remember, so that the same inputs give the same bits as without the interruption.

    def save(self, path: Path) -> tuple[bool, str]:
        """Write the tow as it is between two ticks to a file: (done, text)."""
        if self.state != "running":
            return False, f"the node is {self.state}: there is no tow under way; nothing was saved"
        sim = self.built_sim
        with self.between_ticks():
            self._take_frame()
            snapshot, notes, now = sim.snapshot(), self.notes(), int(sim.state.memory[NOW].time.now)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            savefile.write(path, sim.scene, snapshot, {NODE: notes})
        except SaveError as error:
            return False, str(error)
        except OSError as error:
            return False, f"{path.parent}: cannot be made ({error.strerror}); nothing was saved"
        return True, f"saved at {now / SECOND:.3f} s to {path}"

    def restore(self, path: Path) -> tuple[bool, str]:
        """Go on with the tow of a file: (done, text). What cannot be restored leaves everything as it was."""
        if self.state not in UNDER_WAY:
            return False, f"the node is {self.state}: activate it first; nothing was restored"
        sim = self.built_sim
        live = set(ways(sim.scene))
        try:
            saved = savefile.read(path)
            savefile.same_scene(path, saved.scene, sim.scene, but=live)
            arrays = sim.taken(path, saved)
        except SaveError as error:
            return False, str(error)
        text = f"restored the tow of {int(arrays['memory'].time.now) / SECOND:.3f} s from {path}"
        kept = "; ".join(words for key, words in differences(saved.scene, sim.scene) if key in live)
        if kept:
            text += f"; live parameters stay as they are here: {kept}"
        back = self.go_back(path, arrays, saved.notes.get(NODE))
        if back is not None:
            if back[0]:
                self.log("info", text)
            return back[0], back[1] or f"{text}; the clock goes back to it"
        turned = heading_problem(arrays["memory"], self.heading())
        if turned:
            return False, f"{path}: {turned}; nothing was restored. Turn the ship, or use ~/reset"
        self.built_loop.stop()
        rings = sim.inputs if self.motion_known else make_inputs()
        self.put(arrays | {f"inputs_{name}": array.copy() for name, array in rings._asdict().items()})
        self.intake.forget_commands()
        self._cause = "restore"
        self.log("info", text)
        return self._begin_again(f"{text}; it goes on at the present, and the winch holds until it is commanded")

    def notes(self) -> dict[str, Any]:
        """What a file says beside the state of the simulation, as JSON."""
        return {"lockstep": False}

    def go_back(self, path: Path, arrays: dict[str, np.ndarray], notes: Any) -> tuple[bool, str] | None:
        """Take everything back to the time of a file: (done, problem); None where that cannot be done: real time."""
        return None

    def put(self, arrays: dict[str, np.ndarray]) -> None:
        """The state of a file into the simulator, under the live parameters of this node; no tick runs."""
        sim = self.built_sim
        self._go_to(int(arrays["memory"]["time"]["ticks"]))
        sim.restore(arrays)
        for name in ways(sim.scene):
            if name.startswith("setpoint."):  # these stand in the state, the others in the model
                put_live(sim, name, value_of(sim.scene, name))

    @property
    def motion_known(self) -> bool:
        """Has motion come, on the clock as it is?"""
        return self.clock.offset is not None

    def heading(self) -> float | None:
        """Yaw of the newest motion, rad; None before the first."""
        return float(self._newest_sample()[5]) if self.motion_known else None

    def between_ticks(self) -> AbstractContextManager[None]:
        """No tick runs meanwhile."""
        return self.built_loop.paused() if self.state == "running" else nullcontext()

    def here(self, cause: str) -> Start:
        """The tow as it is, of a loop that stands."""
        now = self.built_sim.state.memory[NOW]
        return Start(int(now.time.now), place(now), float(now.ship.motion.coord[5]), cause)

    def not_restored(self, heading: float) -> str:
        """ "" or why the tow that was put into the simulator cannot take up motion of this heading [rad]."""
        turned = heading_problem(self.built_sim.state.memory[NOW], heading) if self._cause == "restore" else ""
        return turned and f"not restored: {turned}; nothing is simulated until ~/reset"

    def _take_frame(self) -> None:
        """The newest tick output into the simulator's own output, where a file has it from: the loop writes to a
        ring."""
        sim, loop = self.built_sim, self.built_loop
        slot = (loop.count - 1) % loop.rows
        if loop.count and int(loop.output.frame[slot]["time"]) == int(sim.state.memory[NOW].time.now):
            for name, array in sim.output._asdict().items():
                array[0] = getattr(loop.output, name)[slot]

    # ---- time and its control

    def now(self) -> int:
        """The present on the clock of the arrivals, ns: what ages count to."""
        return time.monotonic_ns()

    def log_time(self) -> int:
        """The present for messages that this node stamps, ns."""
        return time.time_ns()

    def record_time(self, arrival: int | None = None) -> int:
        """Time at which a recording has what is said now, ns, it never goes back; arrival: of a message instead."""
        return self.log_time() if arrival is None else arrival + self.wall

    def offset(self) -> int | None:
        """CLOCK_MONOTONIC less the clock of the motion, ns; None: not known."""
        return self.clock.offset

    def advance(self, now: int) -> float:
        """Called between two callbacks, now: CLOCK_MONOTONIC [ns]; returns in how many seconds to call it again."""
        return 0.1

    @property
    def awaits(self) -> bool:
        """Has `advance` to be called again as soon as an input comes?"""
        return False

    def hold(self, why: str) -> None:
        """Hold the simulation because of this, or let it go on with ""; real time does not stand."""

    @property
    def paused(self) -> bool:
        """Does simulation time stand because it was asked to?"""
        return False

    @property
    def steps_left(self) -> int:
        """Ticks that a step still has to do."""
        return 0

    def pause(self, on: bool) -> tuple[bool, str]:
        """Let simulation time stand, or go on: (done, text)."""
        return False, NOT_IN_REAL_TIME

    def step(self, count: int) -> tuple[bool, str]:
        """Begin `count` ticks, while paused: (begun, text)."""
        return False, NOT_IN_REAL_TIME

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
            intake = getattr(self, "intake", None)  # made by `configure`
            why = [f"{TOPICS[k]}: {w}" for k in TOPICS if intake and (w := intake.ingest.refused.why(k))]
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
