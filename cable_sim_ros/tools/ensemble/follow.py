"""The copies follow a tow: its tick outputs give the ship's motion, messages heard beside them the winch's commands.

Only tick outputs and commands count, in blocks that end at whole multiples of `every` ticks: a recording heard again
gives the same bits, however its messages came in parts.
"""

from __future__ import annotations

import itertools
import math
import re
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...io.messages.channels import decode_frames
from ...io.messages.messages import COMMANDS, Command, Refused
from ...io.messages.rotation import inverse, rotate
from ...io.scenes.winch_plan import REPEAT as PLAN_REPEAT
from ...io.scenes.winch_plan import PlanError, WinchPlan
from ...sim.inputs import InputError, ShipMotion, WinchCommand
from ...sim.scene import Scene
from ...sim.tables.attitude import angles_of, body_rates
from .copies import Band, Ensemble, EnsembleEnded, Seen
from .plan import EnsemblePlan, doubts_when_joined

MEAN_OVER = 60.0  # s of the past that say speed and heading
LEAST_STEP, ROWS = 0.1, 800  # s from one sample to the next; samples at most
BLEND = 2.0  # s over which the step from the present to the piece of the past dies out
MATCH = 5.0  # s of the past that are compared with the newest
SECOND = 1_000_000_000
HEALTH = "health"  # kind of a tick output among the commands of COMMANDS
HOLD = 0.2  # s of tick outputs past a block before it is run: a command may be heard after the tick that carries it out
JOIN = 5.0  # s of tick outputs over which heading and speed of a joined tow are taken
FROM_START = 5  # ticks: a tow first heard by then is followed from its static start
SETTLE = 3.0  # times the way of its cable that a joined tow goes until the copies have settled
PAIRED = SECOND // 20  # ns; an arrival within so much of one that the tow tells of is that one
HISTORY = 180.0  # s of motion kept for the look-ahead
APART = 1.0  # m of pay-out between the tow and copy 0 from which the copies begin again
QUIET = 30.0  # s between two of these
REPEAT = 0.9  # of winch.command_timeout: how often a command ahead is given again
NEEDED = ("ship_position", "ship_velocity", "ship_quaternion", "ship_rate", "body_position", "payout", "scope")
LOOKED_AT = 10  # tick outputs by which their spacing is known
LATELY = 2 * SECOND  # ns, of which the way of a tick output to here is known
TIMES = re.compile(r"\d[\d.]*")
EARLY = 2000  # commands that are kept before there is a tick output: 40 s of 50 Hz, what is older has run out
MISSED = 1.0  # s of tick outputs that may be missing in one go: the motion is taken across


class Heard(NamedTuple):
    """A message: arrival on one clock [ns], HEALTH or a kind of COMMANDED, CDR bytes."""

    arrival: int
    kind: str
    data: bytes


class Follower:
    """An ensemble beside a tow. `begun`: starts so far; `notes`: what happened, newest last; `apart`: newest pay-out
    [m] and towbody [m] of copy 0 from the tow's; `settling`: s until the copies have settled; `tow`: the tow's own tick
    output at the newest band; `seen`: of its tick outputs; `doubts`: why bands cannot be taken as they are, each once;
    `heard`: tick outputs so far."""

    def __init__(
        self,
        scene: Scene,
        plan: EnsemblePlan,
        ensemble: Ensemble | None = None,
        alive: Callable[[], bool] = lambda: True,
    ) -> None:
        """ensemble: in place of the plan's; alive: of an Ensemble."""
        gap = max(scene.ship.max_gap, 1.5)  # of motion ahead, which has fewer samples
        self.base = scene.model_copy(update={"ship": scene.ship.model_copy(update={"max_gap": gap})})
        self.plan = plan
        self.ensemble = ensemble or Ensemble(self.base, plan, alive=alive)
        self.tick = round(scene.solver.tick * SECOND)
        self.every = max(1, round(plan.every / scene.solver.tick))
        self.delay = round(scene.winch.command_delay * SECOND)
        self.notes: list[str] = []
        self.begun = 0
        self.running = False
        self.frames: deque[np.record] = deque()  # heard and not run yet
        self.newest: np.record | None = None
        self.tow: np.record | None = None
        self.seen = Seen(self.base)
        self.doubts: list[str] = []
        self.heard = 0
        self.settling, self.apart = 0.0, (math.nan, math.nan)
        self.orders: WinchPlan | None = None
        self.orders_begin = 0
        if plan.ahead.winch is not None:
            self.orders = WinchPlan.of(plan.ahead.winch)
        self._forget()

    def _forget(self, keep: bool = False) -> None:
        """Begin anew; keep: with what was heard and not run yet."""
        if not keep:
            self.frames.clear()
            self.offsets: deque[tuple[int, int]] = deque()  # (arrival, arrival less time) of tick outputs of late
            self.early: deque[tuple[int, Command]] = deque(maxlen=EARLY)  # (arrival, command) before any tick output
            self.pending: deque[tuple[int, Command]] = deque()  # (estimated time, command) that no block has had
            self.told: deque[int] = deque(maxlen=2000)  # times of the commands that the tow carried out
        self.past: deque[ShipMotion] = deque(maxlen=max(2, round(HISTORY * SECOND / self.tick)))
        self.running, self.last_stamp, self.length_shift = False, -1, 0.0
        self.held: WinchCommand | None = None

    def hear(self, items: Iterable[Heard]) -> None:
        """Take messages in the order of their arrival."""
        batch: list[Heard] = []
        for item in items:
            if item.kind == HEALTH:
                batch.append(item)
                continue
            self._frames(batch)
            batch = []
            self._command(item)
        self._frames(batch)

    def _frames(self, batch: list[Heard]) -> None:
        if not batch:
            return
        for item, frame in self._read(batch):
            last, time = self.newest, int(frame["time"])
            if last is not None and (time <= int(last["time"]) or int(frame["tick"]) <= int(last["tick"])):
                self.notes.append("the tow began again, or its clock jumped: so did the copies")
                self._forget()
            self.newest = frame
            while self.offsets and item.arrival - self.offsets[0][0] > LATELY:  # a clock may stand still, or drift
                self.offsets.popleft()
            self.offsets.append((item.arrival, item.arrival - time))
            for arrival, command in self.early:
                self.pending.append((arrival - self.offset, command))
            self.early.clear()
            self.frames.append(frame)
            self.heard += 1
            if frame["command_age"] >= 0.0:
                stamp = time - round(float(frame["command_age"]) * 1e9)
                if not self.told or stamp > self.told[-1]:
                    self.told.append(stamp)

    def _read(self, batch: list[Heard]) -> list[tuple[Heard, np.record]]:
        """Tick outputs of messages; one that lacks a number is left out, with a note."""
        try:
            frames = decode_frames([item.data for item in batch])
        except Exception as error:  # damaged, or of another version: no end for the copies
            return self._left_out(f"{type(error).__name__}: {error}")
        whole = np.ones(len(frames), bool)
        for name in NEEDED:
            whole &= np.isfinite(frames[name]).reshape(len(frames), -1).all(axis=1)
        if not whole.all():
            self._left_out("a number is missing or not finite")
        return [(item, frame) for item, frame, good in zip(batch, frames, whole, strict=True) if good]

    def _left_out(self, why: str) -> list:
        note = f"tick outputs cannot be read ({why}) and are left out; is the node of another version?"
        if note not in self.notes:
            self.notes.append(note)
        return []

    def _command(self, item: Heard) -> None:
        if item.kind == "flaps":
            self.doubt("the tow's flaps were commanded, and the copies leave theirs where the scene has them")
            return
        try:
            command = COMMANDS[item.kind](item.data)
        except Refused:
            return  # by the tow too
        if command.is_none:
            return
        if not self.offsets:
            self.early.append((item.arrival, command))
            return
        self.pending.append((item.arrival - self.offset, command))

    @property
    def offset(self) -> int:
        """Least arrival less time of the tick outputs of late, ns."""
        return min(offset for _, offset in self.offsets)

    def doubt(self, text: str) -> None:
        """Say once why bands cannot be taken as they are."""
        if text not in self.doubts:
            self.doubts.append(text)

    @property
    def lag(self) -> float:
        """s of the tow that are heard and not run yet."""
        if not self.running or not self.frames:
            return 0.0
        return (int(self.frames[-1]["tick"]) - self.at) * self.tick * 1e-9

    def start_again(self, why: str, keep: bool = False) -> None:
        """Leave what was heard and begin with what comes; keep: begin with what was heard and not run yet."""
        self.notes.append(why)
        self._forget(keep)

    def advance(self, over: bool = False) -> Band | None:
        """Run the next block, where all of it is heard; its band. over: nothing more comes. Raises EnsembleEnded."""
        if not self.running and not self._start(over):
            return None
        return self._run(self._end()) if self.ready(over) else None

    def ready(self, over: bool = False) -> bool:
        """Is there a block to run? over: nothing more comes."""
        hold = 0 if over else round(HOLD * SECOND / self.tick)
        return self.running and bool(self.frames) and int(self.frames[-1]["tick"]) >= self._end() + hold

    def _end(self) -> int:
        """Number of the tick at which the block ends: a multiple of `every`."""
        return self.at + self.every - self.at % self.every

    def _start(self, over: bool = False) -> bool:
        self._same_tick()
        if not self.frames or (len(self.frames) * self.tick < JOIN * SECOND and not over):
            return False
        first, ship = self.frames[0], self.base.ship
        whole = int(first["tick"]) <= FROM_START
        frames = [self.frames[k] for k in range(min(len(self.frames), round(JOIN * SECOND / self.tick)))]
        yaw = [angles_of(*frame["ship_quaternion"].tolist())[2] for frame in frames]
        heading = math.atan2(sum(map(math.sin, yaw)), sum(map(math.cos, yaw)))
        scope = None
        if whole:  # what the tow took up is in its motion: once is enough
            heading, ship = yaw[0], ship.model_copy(update={"start_blend": 0.1})
        else:
            speed = np.mean([frame["ship_velocity"][:2] for frame in frames], axis=0)
            ahead = float(speed @ (math.cos(heading), math.sin(heading)))
            ship = ship.model_copy(update={"tow_speed": max(ahead, 0.0)})
            scope = float(first["scope"])
        self.ensemble.scene = self.base.model_copy(update={"ship": ship})
        begin = int(first["time"]) - self.tick
        place = first["ship_position"][:2] - first["ship_velocity"][:2] * self.tick * 1e-9
        self.ensemble.start(begin, (float(place[0]), float(place[1])), heading, scope)
        self.length_shift = 0.0 if whole else float(self.ensemble.nominal.frame["payout"]) - float(first["payout"])
        self.begun += 1
        self.began, self.settling = begin, 0.0
        self.at = self.first = int(first["tick"]) - 1
        if not whole:
            way = float(first["scope"]) / max(float(np.hypot(*first["ship_velocity"][:2])), 0.1)
            self.settling = SETTLE * way
            self.notes.append(f"joined under way: the copies settle for {self.settling:.0f} s")
            for text in doubts_when_joined(self.base, self.plan):
                self.doubt(text)
        if self.orders is not None and self.begun == 1:  # now there is a drum to check it with
            try:
                self.orders.check(self.ensemble.nominal.model.settings[0].drum, self.base)
            except PlanError as error:
                self.notes.append(f"ahead.winch is refused, the last command is held: {error}")
                self.orders = None
        self.running = True
        return True

    def _run(self, last: int) -> Band | None:
        count, frames = last - self.at, []
        end = self.began + (last - self.first) * self.tick
        while self.frames and int(self.frames[0]["tick"]) <= last:
            frames.append(self.frames.popleft())
        seen = [*frames, *([self.frames[0]] if self.frames else [])]  # one past the end, where that tick was not heard
        numbers = [self.at, *(int(frame["tick"]) for frame in seen)]
        lost = max(b - a for a, b in itertools.pairwise(numbers)) * self.tick * 1e-9
        on_time = all(int(f["time"]) == self.began + (int(f["tick"]) - self.first) * self.tick for f in seen)
        if not frames or not on_time or lost > MISSED:
            why = "the clock of the tow jumped, or a second of it was not heard: the copies begin again"
            self.start_again(why, keep=True)
            return None
        for frame in frames if numbers[len(frames)] == last else seen:
            sample = motion_of(frame)
            if not self.past or sample.time_ns > self.past[-1].time_ns:
                self.past.append(sample)
                self.ensemble.push(sample)
        for command in self._due(end):
            self._give(command)
        self.seen.take(np.array(frames))
        band = self.ensemble.run(count, count, judged=not self.settling)
        self.at = last
        copy, tow = self.ensemble.nominal.frame, frames[-1]
        self.tow = tow
        out = float(copy["payout"]) - float(tow["payout"]) - self.length_shift
        self.apart = out, float(np.linalg.norm(copy["body_position"] - tow["body_position"]))
        self.settling = max(self.settling - count * self.tick * 1e-9, 0.0)
        if abs(out) > APART and (end - self.began) * 1e-9 > QUIET:
            self.start_again(f"the tow has {-out:+.2f} m more cable out than its commands give: the copies begin again")
        return band

    def _give(self, command: WinchCommand) -> None:
        varies = bool(self.plan.half_widths.payout) or "winch.scope" in self.plan.ranges
        if command.payout is not None and varies:
            self.doubt(
                "a length was commanded while half_widths.payout or winch.scope varies: every copy goes to that "
                "length, and the band loses what varies. Leave the one out, or read the band before"
            )
        try:
            self.ensemble.push(command)
            self.held = command
        except InputError as error:
            self.doubt(f"a winch command could not be given to the copies: {re.sub(TIMES, 'N', str(error))}")

    def _same_tick(self) -> None:
        """Raise EnsembleEnded where the tick outputs are those of another tick length."""
        some = list(itertools.islice(self.frames, LOOKED_AT))
        if len(some) < LOOKED_AT:
            return
        time, tick = (np.array([int(frame[name]) for frame in some]) for name in ("time", "tick"))
        apart = float(np.median(np.diff(time) / np.maximum(np.diff(tick), 1)))  # one jump of the clock is none
        if abs(apart - self.tick) > 0.01 * self.tick:
            raise EnsembleEnded(
                f"the tow ticks each {apart * 1e-9:g} s, solver.tick of {self.base.name} is {self.tick * 1e-9:g} s: "
                "that is another scene; there is no band. Give --scene the scene of the tow"
            )

    def _due(self, end: int) -> Iterable[WinchCommand]:
        """Commands that count by the end of a block, at the times that the tow tells of them."""
        while self.pending and self.pending[0][0] + self.delay <= end + PAIRED:
            guess, command = self.pending[0]
            near = [time for time in self.told if abs(time - guess) <= PAIRED and time > self.last_stamp]
            stamp = min(near, key=lambda time: abs(time - guess)) if near else guess
            stamp = max(stamp, self.last_stamp + 1)
            if stamp + self.delay > end:
                return
            self.pending.popleft()
            self.last_stamp = stamp
            yield self._command_of(command, stamp)

    def _command_of(self, command: Command, stamp: int) -> WinchCommand:
        if math.isnan(command.payout):
            return WinchCommand(rate=command.rate, time_ns=stamp)
        return WinchCommand(payout=command.payout + self.length_shift, time_ns=stamp)

    # ---- look-ahead

    def order(self, text: str) -> None:
        """Take a winch plan that begins at the newest tick output; "": none. Raises PlanError."""
        if not text.strip():
            self.orders = None
            return
        plan = WinchPlan(text)
        plan.check(self.ensemble.nominal.model.settings[0].drum, self.base)
        self.orders, self.orders_begin = plan, int(self.newest["time"]) if self.newest is not None else 0

    def ahead(self) -> Iterator[Band | None]:
        """The band of the seconds ahead, of the copies where they are, last; None after each copy before.

        Raises EnsembleEnded.
        """
        seconds = self.plan.ahead.seconds
        if not self.running or not seconds or len(self.past) < 2:
            return
        now, count = self.ensemble.now, round(seconds * SECOND / self.tick)
        end = now + count * self.tick
        commands = [self._command_of(command, max(time, now + 1)) for time, command in self.pending]
        commands += self._planned(max([now, *(c.time_ns or 0 for c in commands)]), end)
        last, ordered = self.last_stamp, []
        for command in commands:
            last = max(int(command.time_ns or 0), last + 1)
            ordered.append(WinchCommand(payout=command.payout, rate=command.rate, time_ns=last))
        motion = motion_ahead(list(self.past), end)
        yield from self.ensemble.ahead(count, motion, ordered, min(self.every, count))

    def _planned(self, now: int, end: int) -> list[WinchCommand]:
        drum = self.ensemble.nominal.model.settings[0].drum.copy()
        step = int(REPEAT * drum.timeout * SECOND)
        if self.orders is not None:
            drum.timeout *= REPEAT / PLAN_REPEAT
            made = list(self.orders.commands(drum, self.orders_begin or self.began, now, end))
            shift = self.length_shift
            return [c if c.payout is None else WinchCommand(payout=c.payout + shift, time_ns=c.time_ns) for c in made]
        held = self.held
        if held is None or held.rate is None or (now - int(held.time_ns or 0)) * 1e-9 > drum.timeout:
            return []  # a length is gone to and held, and a rate that ran out holds
        return [WinchCommand(rate=held.rate, time_ns=time) for time in range(now + 1, end, step)]


def motion_of(frame: np.record) -> ShipMotion:
    """The ship's motion of a tick output."""
    turn = tuple(frame["ship_quaternion"].tolist())
    return ShipMotion(
        time_ns=int(frame["time"]),
        position=tuple(frame["ship_position"].tolist()),
        velocity=tuple(frame["ship_velocity"].tolist()),
        rate=rotate(inverse(turn), tuple(frame["ship_rate"].tolist())),
        quaternion=turn,
    )


def motion_ahead(past: Sequence[ShipMotion], end: int) -> list[ShipMotion]:
    """The ship's motion ahead: samples after the newest of ``past`` (evenly apart) to ``end`` [ns], a step past it.

    Its mean way goes on, and what swung about a line fitted to each coordinate of the last MEAN_OVER seconds repeats:
    the piece of the past that fits best to what the ship does now. An assumption, no forecast of the sea.
    """
    times = np.array([one.time_ns for one in past], np.int64)
    now = int(times[-1])
    t = (times - now) * 1e-9
    angles = np.unwrap(np.array([one.angles for one in past]), axis=0)
    pose = np.hstack((np.array([one.position for one in past]), angles))
    near = t >= -MEAN_OVER
    line = np.polyfit(t[near], pose[near], 1) if near.sum() > 2 else np.vstack((np.zeros(6), pose[-1]))
    line[0, 2:] = 0.0  # the ship neither sinks nor turns on the mean
    line[1, 2:] = pose[near][:, 2:].mean(axis=0)
    swing = pose - (line[1] + np.outer(t, line[0]))
    swing[:, :2] -= swing[near][:, :2].mean(axis=0)
    step = max(LEAST_STEP, (end - now) * 1e-9 / ROWS)
    ahead = np.arange(1, int(np.ceil((end - now) * 1e-9 / step)) + 2) * step
    back = _repeat(t, swing, (end - now) * 1e-9)
    where = (ahead % back) - back
    columns = [np.interp(where, t, swing[:, k]) for k in range(6)]
    offset = swing[-1] - np.array([np.interp(-back, t, swing[:, k]) for k in range(6)])
    poses = line[1] + np.outer(ahead, line[0]) + np.array(columns).T + np.outer(np.exp(-ahead / BLEND), offset)
    all_times, all_poses = np.concatenate(([0.0], ahead)), np.vstack((pose[-1], poses))
    rates = np.gradient(all_poses, all_times, axis=0)[1:]
    return [_sample(now + round(s * SECOND), p, r) for s, p, r in zip(ahead.tolist(), poses, rates, strict=True)]


def _repeat(t: np.ndarray, swing: np.ndarray, seconds: float) -> float:
    """How far back [s] the piece begins: where heave and pitch were most like the last MATCH seconds, as long as what
    is needed where the past is."""
    longest = -float(t[0])
    if longest <= 2.0 * MATCH:
        return longest or 1.0
    dt = longest / (len(t) - 1)
    width = max(2, round(MATCH / dt))
    shape = swing[:, [2, 4]] / np.maximum(swing[:, [2, 4]].std(axis=0), 1e-9)
    newest = shape[-width:]
    least = min(seconds, 0.5 * longest)
    ends = range(width, len(t) - max(round(least / dt), 1), max(1, round(0.1 / dt)))
    best = min(ends, key=lambda k: float(((shape[k - width : k] - newest) ** 2).sum()), default=1)
    return -float(t[best - 1])


def _sample(time: int, pose: np.ndarray, rates: np.ndarray) -> ShipMotion:
    x = [float(value) for value in pose]
    turn = body_rates(x[3], x[4], rates[3:])
    return ShipMotion(
        time_ns=time,
        position=(x[0], x[1], x[2]),
        velocity=(float(rates[0]), float(rates[1]), float(rates[2])),
        rate=(float(turn[0]), float(turn[1]), float(turn[2])),
        attitude=(x[3], x[4], x[5]),
    )
