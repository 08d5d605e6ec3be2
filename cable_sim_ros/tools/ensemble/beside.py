"""An ensemble beside a running node: a process of its own, of low priority, that hears and is heard.

It never answers the node. Where it does not hold real time it lets copies go, the newest first, and says so; where the
fewest do not hold it either, it begins again at the present, and says that.
"""

from __future__ import annotations

import math
import os
import time
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState, PointCloud2, PointField
from std_msgs.msg import String

from ...errors import CODE_FAILED, CODE_OK
from ...io.messages.messages import COMMANDED
from ...io.messages.messages import KINDS as OF_MESSAGES
from ...processes import Alive
from ...ros.client import Client
from ...ros.parts import ERROR, OK, WARN, Status
from ...ros.topics import diagnostic_array, inputs_there
from ...ros.watcher import HEALTH as HEALTH_CHANNEL
from ...ros.watcher import Watcher, watching
from ...terminal import say
from .copies import BODY, FIGURES, Band, EnsembleEnded, Stopped, level_of
from .follow import HEALTH, Follower, Heard
from .limits import LEAST_COPIES
from .plan import load_plan

PLAN = "ensemble/plan"
KEPT = 20_000  # messages that may wait: 200 s of 100 Hz


class Ear(Watcher):
    """Of one namespace. `plan_text`: a plan of the winch that came, until it is taken."""

    def listen(self) -> None:
        """Subscribe; best effort holds no publisher up."""
        self._items: deque[Heard] = deque(maxlen=KEPT)
        self._overflowed = False
        self.plan_text: str | None = None
        kinds, _ = inputs_there()
        self.client.hear(JointState, self.topic(HEALTH_CHANNEL.topic), self._put_tick, reliable=False)
        for kind, made in kinds.items():
            if kind in COMMANDED:
                self.client.hear(made, self.topic(OF_MESSAGES[kind][1]), self._command(kind), reliable=False)
        self.client.hear(String, self.topic(PLAN), self._put_plan, reliable=False)

    def _put_tick(self, data: bytes) -> None:
        self._heard = time.monotonic()
        self._put(HEALTH, data)

    def _command(self, kind: str) -> Any:
        return lambda data: self._put(kind, data)

    def _put(self, kind: str, data: bytes) -> None:
        with self.lock:
            self._overflowed = self._overflowed or len(self._items) == KEPT
            self._items.append(Heard(time.monotonic_ns(), kind, bytes(data)))

    def _put_plan(self, data: bytes) -> None:
        from rclpy.serialization import deserialize_message

        with self.lock:
            self.plan_text = deserialize_message(data, String).data[:10_000]

    def items(self) -> list[Heard]:
        """Messages since the last call, in the order of their arrival."""
        with self.lock:
            found = list(self._items)
            self._items.clear()
        return found

    def overflowed(self) -> bool:
        """Were messages lost since the last call, because more than KEPT waited?"""
        with self.lock:
            found, self._overflowed = self._overflowed, False
        return found

    def ordered(self) -> str | None:
        """The newest plan of the winch since the last call."""
        with self.lock:
            text, self.plan_text = self.plan_text, None
        return text


BAND, TOWBODY, AHEAD = "ensemble/band", "ensemble/towbody", "ensemble/ahead"
NODE = "cable_sim_ensemble"
DEPTH = 10


class Voice:
    """Publishers of an ensemble, all reliable, of depth DEPTH."""

    def __init__(self, client: Client, namespace: str, odom: str) -> None:
        """odom: name of the frame."""
        made = client.node.create_publisher
        profile = QoSProfile(depth=DEPTH)
        self.odom = odom
        self._band = made(JointState, f"{namespace}/{BAND}", profile)
        self._towbody = made(PoseWithCovarianceStamped, f"{namespace}/{TOWBODY}", profile)
        self._ahead = made(PointCloud2, f"{namespace}/{AHEAD}", profile)
        self._diagnostics = made(DiagnosticArray, "/diagnostics", profile)

    def band(self, time_ns: int, names: Sequence[str], values: Sequence[float]) -> None:
        """Ends and middle of the band, and the state of the ensemble, by name."""
        message = JointState(name=list(names), position=[float(value) for value in values])
        _stamp(message, time_ns)
        self._band.publish(message)

    def towbody(self, time_ns: int, places: np.ndarray, yaws: np.ndarray) -> None:
        """Mean and covariance of the towbody's places [copies, 3] in odom and of its yaw [copies] rad."""
        message: Any = PoseWithCovarianceStamped()
        _stamp(message, time_ns, self.odom)
        where = message.pose.pose.position
        where.x, where.y, where.z = places.mean(axis=0).tolist()
        yaw = float(np.angle(np.exp(1j * yaws).mean()))
        message.pose.pose.orientation.z, message.pose.pose.orientation.w = math.sin(0.5 * yaw), math.cos(0.5 * yaw)
        away = np.angle(np.exp(1j * (yaws - yaw)))
        covariance = np.zeros((6, 6))
        rows = [0, 1, 2, 5]
        covariance[np.ix_(rows, rows)] = np.cov(np.vstack([places.T, away]))
        message.pose.covariance = covariance.ravel().tolist()
        self._towbody.publish(message)

    def ahead(self, time_ns: int, names: Sequence[str], table: np.ndarray) -> None:
        """Rows of a look-ahead that begins at time_ns; names of the columns [rows, names]."""
        data = np.ascontiguousarray(table, "<f4")
        message = PointCloud2(height=1, width=len(data), is_dense=True, point_step=4 * len(names))
        message.fields = [
            PointField(name=name, offset=4 * k, datatype=PointField.FLOAT32, count=1) for k, name in enumerate(names)
        ]
        message.row_step = message.point_step * message.width
        message.data = data.tobytes()
        _stamp(message, time_ns, self.odom)
        self._ahead.publish(message)

    def say(self, status: Status, stamp: int) -> None:
        """The state of the ensemble into /diagnostics; stamp: ns."""
        self._diagnostics.publish(diagnostic_array(NODE, [status], stamp))


def _stamp(message: Any, time_ns: int, frame: str = "") -> None:
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(time_ns, 1_000_000_000)
    message.header.frame_id = frame


NICE = 15
LATE = 5.0  # s behind the node from which the band is flagged, and copies are let go
GIVE_UP = 60.0  # s behind the node from which the copies begin again
WATCHED = 10.0  # s of wall time in which a lag has to shrink
LET_GO = 0.8  # of the copies are kept where it does not
SILENT = 3.0  # s without a tick output from which the node is said to be silent
SAY = 1.0  # s from one status to the next
APART, LEAST_APART = 0.5, 0.1  # of the width of the towbody's band, m: copy 0 that is further away does not follow
NOTES = 20  # that are kept
PAUSE = 0.02  # s between looks
OVER = object()  # of a look-ahead that gave no band
KINDS = ("low", "median", "high", "copy_0")
STATE = ("copies", "level", "lag", "behind", "settling", "copy_0_apart")
BAND_NAMES = (*(f"{name}.{kind}" for name in FIGURES for kind in KINDS), *STATE)
AHEAD_NAMES = ("x", "y", "z", "seconds", *(f"{name}_{kind}" for name in FIGURES for kind in KINDS[:3]))


class Beside:
    """One ensemble and its publishers; `step` is called again and again."""

    def __init__(self, follower: Follower, voice: Any) -> None:
        """voice: a Voice, or what stands for it in tests."""
        self.follower, self.voice = follower, voice
        self.problem = ""
        self._looking: Iterator[Band | None] | None = None
        self._looked = -1e9
        self._from = 0
        self._lags: list[tuple[float, float]] = []  # (wall time, lag), of the last WATCHED seconds
        self._said = 0.0
        self._heard: float | None = None  # wall time of the newest message
        self.silent = 0.0  # s since then
        self.let_go = 0
        self.blind = ""  # why the newest look-ahead gave no band
        self.width = math.inf  # m, of the widest band of the towbody

    def step(self, items: list[Heard], now: float) -> bool:
        """Take messages, run a block or a copy of the look-ahead; was there anything to do? now: wall time [s]."""
        follower = self.follower
        begun, busy = follower.begun, False
        follower.hear(items)
        if self._heard is None or any(item.kind == HEALTH for item in items):
            self._heard = now
        self.silent = now - self._heard
        try:
            band = follower.advance()
            if band is not None:
                busy, self.problem = True, ""
                self._tell(band)
            else:
                busy = self._looks_ahead(now)
        except EnsembleEnded as error:
            self.problem, self._looking = str(error), None
            follower.start_again(f"{error}; the copies begin again")
        if follower.begun != begun:
            self._looking, self._lags = None, []
        self._hold(now)
        if now - self._said >= SAY and follower.newest is not None:
            self._said = now
            self.voice.say(self.status(), int(follower.newest["time"]))
        return busy

    @property
    def behind(self) -> bool:
        """Out of real time."""
        return self.follower.lag > LATE

    def _hold(self, now: float) -> None:
        lag, follower = self.follower.lag, self.follower
        self._lags = [(t, one) for t, one in self._lags if now - t <= WATCHED] + [(now, lag)]
        if lag > GIVE_UP and follower.running and follower.begun and self._settled(now, lag):
            self._fewer(f"{lag:.0f} s behind the node")
            follower.start_again(f"{lag:.0f} s behind the node: the copies begin again at the present")
            self._lags = []
        elif lag > LATE and self._settled(now, lag):
            self._fewer(f"{lag:.1f} s behind the node and no nearer for {WATCHED:g} s")
            self._lags = []

    def _settled(self, now: float, lag: float) -> bool:
        """Has the lag been watched long enough, and not shrunk?"""
        return now - self._lags[0][0] > 0.9 * WATCHED and lag >= self._lags[0][1]

    def overrun(self) -> None:
        """Messages were lost while the copies did not take them, as a start of many does: they begin again, fewer."""
        self._fewer("not listened to for longer than messages are kept")
        self.follower.start_again("messages of the node were lost: the copies begin again")

    def _fewer(self, why: str) -> None:
        ensemble = self.follower.ensemble
        there = len(ensemble.draws) - 1
        kept = max(LEAST_COPIES, int(LET_GO * there))
        if kept < there:
            self._looking = None
            ensemble.let_go(kept)
            self.let_go += there - kept
            self.follower.notes.append(f"{why}: {there - kept} of {there} copies are let go")

    def _tell(self, band: Band) -> None:
        follower, stamp = self.follower, int(band.time[-1])
        ends = np.stack([band.low[-1], band.median[-1], band.high[-1], band.nominal[-1]], axis=1).ravel().tolist()
        members = band.members
        state = [members, level_of(members), follower.lag, self.behind, follower.settling, follower.apart[1]]
        self.voice.band(stamp, BAND_NAMES, [*ends, *map(float, state)])
        self.width = float((band.high[-1, BODY] - band.low[-1, BODY]).max())
        places = band.values[:, -1, BODY] * (1.0, 1.0, -1.0)
        self.voice.towbody(stamp, places, follower.ensemble.yaws())

    def _looks_ahead(self, now: float) -> bool:
        """As `_look_ahead`; one that gives no band leaves the copies as they are."""
        try:
            return self._look_ahead(now)
        except EnsembleEnded as error:
            self._looking, self.blind = None, str(error)
            return True

    def _look_ahead(self, now: float) -> bool:
        follower = self.follower
        if self._looking is None:
            plan = follower.plan.ahead
            if not follower.running or not plan.seconds or now - self._looked < plan.every or self.behind:
                return False
            self._looking, self._looked, self._from = follower.ahead(), now, follower.ensemble.now
        band = next(self._looking, OVER)
        if band is OVER:  # nothing to look from
            self._looking = None
        elif isinstance(band, Band):
            self._looking, self.blind = None, ""
            self.voice.ahead(self._from, AHEAD_NAMES, ahead_table(band, self._from))
        return True

    def status(self) -> Status:
        """One task of /diagnostics."""
        follower, ensemble = self.follower, self.follower.ensemble
        members = len(ensemble.draws) - 1 - len({lost.number for lost in ensemble.lost} - {0})
        apart = follower.apart[1]
        flags = ensemble.flagged(newest=True)
        if self.problem:
            level, text = ERROR, self.problem
        elif self.silent > SILENT:
            level, text = ERROR, f"the node says nothing for {self.silent:.0f} s: the band is of then"
        elif not follower.running:
            level, text = WARN, "hears the node and begins; there is no band yet"
        elif self.behind:
            level, text = ERROR, f"out of real time: the band is {follower.lag:.1f} s old, no look-ahead is made"
        elif follower.settling:
            level, text = WARN, f"joined under way: the copies settle for another {follower.settling:.0f} s"
        elif apart > max(APART * self.width, LEAST_APART):
            why = "another scene, a value that was changed under way, or a motion that was not heard"
            level, text = WARN, f"copy 0 is {apart:.3g} m from the towbody: the copies do not follow ({why})"
        elif flags or follower.doubts:
            level, text = WARN, next(iter([*flags.values(), *follower.doubts]))
        elif self.blind:
            level, text = WARN, f"no look-ahead: {self.blind}"
        elif self.let_go:
            level, text = WARN, f"{self.let_go} copies were let go to hold real time, {members} are left"
        else:
            level, text = OK, f"{members} copies in real time"
        values = {
            "copies": str(members),
            "let_go": str(self.let_go),
            "lost": "; ".join(f"{lost.number}: {lost.why}" for lost in ensemble.lost)[:500],
            "lag_s": f"{follower.lag:.2f}",
            "silent_s": f"{self.silent:.1f}",
            "doubts": "; ".join(follower.doubts)[:1000],
            "flags": ", ".join(flags),
            "flags_since_start": ", ".join(ensemble.flagged()),
            "starts": str(follower.begun),
            "seed": str(follower.plan.seed),
            "payout_apart_m": f"{follower.apart[0]:.3f}",
            "towbody_apart_m": f"{follower.apart[1]:.3f}",
            "assumed_ahead": "the ship goes on on its mean way, with the swing of the last minutes again",
            "winch_ahead": str(follower.orders) if follower.orders is not None else "the last command held",
            "note": follower.notes[-1] if follower.notes else "",
            "cpu_s": f"{time.process_time():.1f}",
        }
        return Status("ensemble", level, text, values)

    def order(self, text: str) -> None:
        """Take a plan of the winch for the look-ahead; one that cannot be is a note."""
        try:
            self.follower.order(text)
        except (ValueError, EnsembleEnded) as error:
            self.follower.notes.append(f"plan refused: {error}")


def ahead_table(band: Band, begin: int) -> np.ndarray:
    """Rows of AHEAD_NAMES: the median place in odom, seconds from ``begin`` [ns], and the ends of each figure."""
    x, y, depth = (band.median[:, k] for k in BODY)
    ends = np.stack([band.low, band.median, band.high], axis=2).reshape(len(band.time), -1)
    return np.column_stack([x, y, -depth, (band.time - begin) * 1e-9, ends])


def beside(file: Any, changed: Mapping[str, Any], scene: str | None, namespace: str, wait: float, open_: bool) -> int:
    """Until a signal; returns the exit code. Raises WatchError where there is no node."""
    os.nice(NICE)
    alive = Alive()
    with watching(namespace, wait, alive, open_, Ear, NODE) as ear:
        tow = ear.scene(scene)
        plan = load_plan(file, changed, tow)
        follower = Follower(tow, plan, alive=alive)
        one = Beside(follower, Voice(ear.client, ear.namespace, "odom"))
        say(
            f"{tow.name}: {plan.copies} copies, seed {plan.seed}, follow {ear.namespace}; their static starts take "
            "a second each or so"
        )
        with suppress(Stopped):
            _follow(one, ear, alive)
    return CODE_FAILED if one.problem else CODE_OK


def _follow(one: Beside, ear: Ear, alive: Alive) -> None:
    follower, said, order = one.follower, 0, None
    while alive():
        ear.client.check()
        items = ear.items()
        if ear.overflowed():
            one.overrun()
            items = []  # of before the present
        order = text if (text := ear.ordered()) is not None else order
        if order is not None and follower.running:  # before, there is no drum to check it with
            one.order(order)
            order = None
        if not one.step(items, time.monotonic()):
            time.sleep(PAUSE)
        for note in follower.notes[said:]:
            say(note)
        del follower.notes[:-NOTES]
        said = len(follower.notes)
