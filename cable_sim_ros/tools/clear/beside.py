"""`cable-sim clear` beside a running node: a process of its own, of low priority, that hears and is heard.

What the tow answers to each action is simulated by a thread where scope, speed or heading have changed; a look at the
ground uses what is known by then, so that it takes no simulation. Times are from the tick output it looks from.
"""

from __future__ import annotations

import json
import os
import threading
import time
from math import exp, hypot
from typing import Any, NamedTuple

import numpy as np
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import String
from std_srvs.srv import Trigger

from ...cli.options import json_of
from ...errors import CODE_OK, CableSimError
from ...processes import Alive
from ...ros.parts import ERROR, OK, WARN, Status
from ...ros.topics import diagnostic_array
from ...ros.watcher import Watcher, watching
from ...sim.scene import Scene
from ...sim.tables.attitude import angles_of
from ...terminal import say
from ..ensemble.beside import NICE
from .advice import Allowances, Passage, Wanted, actions_of, advise, deeper_than_the_wire, told
from .profile import ProfileError, ahead_of, values_of
from .towed import Copy, Tow, copies_of

from diagnostic_msgs.msg import DiagnosticArray  # isort: skip

NODE = "cable_sim_clear"
PROFILE, ADVICE, ASK = "clear/profile", "clear/advice", "clear/ask"
LARGEST = 4_000_000  # bytes of a profile
CALM = 20.0  # s, over which speed, depth and heading are averaged
OTHER_SCOPE, OTHER_SPEED, OTHER_HEADING = 2.0, 0.05, 0.1  # m, m/s, rad: another tow
SILENT = 3.0  # s without a tick output
EVERY = 1.0  # s from one advice to the next
MOVES = 0.02  # m/s of the winch
LEVELS = {"clear": OK, "act": WARN, "cannot": ERROR, "unknown": WARN}


class Here(NamedTuple):
    """The tow of a tick output: time [ns], ship's x y [m], scope [m], rate of pay-out [m/s], averages: of the ship's
    velocity [m/s], heading as a vector, depth of the towbody [m]; first: time [ns] that they begin at."""

    time: int
    ship: np.ndarray
    scope: float
    rate: float
    velocity: np.ndarray
    heading: np.ndarray
    depth: float
    first: int

    def then(self, frame: Any) -> Here:
        """The same after another tick output."""
        new, gone = here_of(frame), (int(frame["time"]) - self.time) * 1e-9
        if not 0.0 <= gone < 10.0 * CALM:
            return new
        span = min((new.time - self.first) * 1e-9, CALM)  # up to CALM all count alike: one moment is no course
        old = exp(-gone / CALM) if span == CALM else 1.0 - gone / span if span > 0.0 else 0.0
        mean = {name: old * getattr(self, name) + (1.0 - old) * getattr(new, name) for name in ("velocity", "heading")}
        return new._replace(**mean, depth=old * self.depth + (1.0 - old) * new.depth, first=self.first)


def here_of(frame: Any) -> Here:
    """Of one tick output."""
    yaw = angles_of(*frame["ship_quaternion"].tolist())[2]
    return Here(
        int(frame["time"]),
        np.array(frame["ship_position"][:2]),
        float(frame["scope"]),
        float(frame["payout_rate"]),
        np.array(frame["ship_velocity"][:2]),
        np.array([np.cos(yaw), np.sin(yaw)]),
        -float(frame["body_position"][2]),
        int(frame["time"]),
    )


class Lookout:
    """A tow, its answers, and the newest profile. `look` may be called from any thread."""

    def __init__(self, scene: Scene, wanted: Wanted, known: Allowances) -> None:
        self.scene, self.wanted, self.known = scene, wanted, known
        self.here: Here | None = None
        self.heard = 0.0  # s, CLOCK_MONOTONIC, of the newest tick output
        self.points: tuple[int, np.ndarray] | None = None  # stamp [ns]; x, y, z in odom
        self.refused = ""  # why the newest profile was
        self.copies: dict[str, Copy] | None = None
        self.heading = 0.0  # rad, of the copies
        self.problem = ""  # why the newest copies could not be made
        self._making: threading.Thread | None = None
        self._ended = False
        self._lock = threading.Lock()

    def tick(self, frame: Any, now: float) -> None:
        """Take a tick output; now: CLOCK_MONOTONIC, s."""
        self.here = here_of(frame) if self.here is None else self.here.then(frame)
        self.heard = now

    def profile(self, data: bytes) -> None:
        """Take a message of clear/profile; one that cannot be used leaves the last."""
        try:
            if len(data) > LARGEST:
                raise ProfileError(
                    f"{PROFILE}: {len(data)} bytes, most are {LARGEST}; nothing was taken. Send less of it"
                )
            message = deserialize_message(data, PointCloud2)
            if message.header.frame_id not in ("", "odom"):
                raise ProfileError(
                    f"{PROFILE}: is in '{message.header.frame_id[:40]}'; nothing was taken. Give points in odom, z up"
                )
            stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            self.points, self.refused = (stamp or (self.here.time if self.here else 0), values_of(message)), ""
        except (ProfileError, ValueError, RuntimeError) as error:
            self.refused = str(error)

    # ---- the answers of the tow

    def renew(self) -> None:
        """Begin to simulate the answers of the tow where it has become another; one at a time."""
        here = self.here
        if here is None or (self._making is not None and self._making.is_alive()) or not self._other(here):
            return
        heading = float(np.arctan2(here.heading[1], here.heading[0]))
        ship = self.scene.ship.model_copy(update={"heading_deg": float(np.degrees(heading))})
        tow = self.wanted.tow(self.scene.model_copy(update={"ship": ship}), here.scope, float(hypot(*here.velocity)))
        self._making = threading.Thread(target=self._make, args=(tow, heading), name="clear", daemon=True)
        self._making.start()

    def _other(self, here: Here) -> bool:
        if self.copies is None:
            return True
        tow = self.copies["itself"].tow
        turned = abs(float(np.angle(complex(*here.heading) * np.exp(-1j * self.heading))))
        return (
            abs(here.scope - tow.scope) > OTHER_SCOPE
            or abs(hypot(*here.velocity) - tow.speed) > OTHER_SPEED
            or turned > OTHER_HEADING
        )

    def _make(self, tow: Tow, heading: float) -> None:
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), NICE)  # a look at the ground comes first
        actions = actions_of(tow, self.wanted.least(tow.scope), self.wanted.max_speed)
        try:
            self.copies, self.heading = copies_of(tow, actions, self.known.drag, self.known.speed, self._go_on), heading
            self.problem = ""
        except (CableSimError, ValueError) as error:
            self.problem = str(error)

    def _go_on(self, *_: Any) -> None:
        if self._ended:
            raise CableSimError("ended")

    def close(self) -> None:
        """End the thread."""
        self._ended = True
        if self._making is not None:
            self._making.join()

    # ---- what it says

    def look(self, now: float) -> dict[str, Any]:
        """The answer as of now (CLOCK_MONOTONIC, s); state "unknown" with the reason where there is none."""
        with self._lock:
            begun, used = time.perf_counter(), time.thread_time()
            report = self._look(now)
            report["took_s"], report["cpu_s"] = time.perf_counter() - begun, time.thread_time() - used
        return report

    def _look(self, now: float) -> dict[str, Any]:
        here, points, copies = self.here, self.points, self.copies
        why = self._not_yet(now)
        if why or here is None or points is None:
            return {"state": "unknown", "answer": f"unknown: {why}", "notes": []}
        course = float(np.arctan2(here.velocity[1], here.velocity[0]))
        wanted, known = self.wanted, self.known
        try:
            ground = ahead_of(points[1], here.ship, course, wanted.corridor, wanted.hole, PROFILE)
        except ProfileError as error:
            return {"state": "unknown", "answer": f"unknown: {error}", "notes": []}
        report = deeper_than_the_wire(wanted.tow(self.scene, here.scope, 0.0), ground, wanted.margin, known)
        if report is None:
            changed = copies is not None and self._other(here)
            if copies is None or (changed and self.problem):  # what it has become cannot be judged
                why = self.problem or "the answers of the tow are being simulated"
                return {"state": "unknown", "answer": f"unknown: {why}", "notes": []}
            report = advise(Passage(copies, ground, wanted.margin, known, wanted.deeper(copies, here.depth)))
            if changed:
                report["notes"].append(
                    f"the tow has changed from {copies['itself'].tow.scope:.1f} m at {copies['itself'].tow.speed:.2f} "
                    f"m/s: its new answers are being simulated"
                )
        if self.refused:
            report["notes"].append(f"the newest profile is not used: {self.refused}")
        if abs(here.rate) > MOVES:
            report["notes"].append(f"the winch moves at {here.rate:+.2f} m/s: judged as if it stood from now on")
        answer = "; ".join([told(report), *report["notes"]])
        return {"time_ns": here.time, "profile_age_s": (here.time - points[0]) * 1e-9, "answer": answer, **report}

    def _not_yet(self, now: float) -> str:
        """ "" or why nothing can be judged."""
        if self.here is None or now - self.heard > SILENT:
            return f"no tick output of the node for {SILENT:g} s"
        if self.points is None:
            return self.refused or f"no profile has come on {PROFILE}"
        age = (self.here.time - self.points[0]) * 1e-9
        if not -1.0 <= age <= self.wanted.age:
            return f"the profile is {age:.0f} s old, fresh up to {self.wanted.age:g} s. Send one, or raise --age"
        return ""


def status_of(report: dict[str, Any]) -> Status:
    """The task of /diagnostics."""
    values = {"state": report["state"], "took_s": f"{report['took_s']:.4f}", "cpu_s": f"{report['cpu_s']:.4f}"}
    values["notes"] = "; ".join(report["notes"])[:1000]
    level = max(LEVELS[report["state"]], WARN if report["notes"] else OK)  # clear as far as judged
    return Status("clear", level, report["answer"], values)


def beside(wanted: Wanted, known: Allowances, scene: str | None, namespace: str, wait: float, open_: bool) -> int:
    """Until a signal; returns the exit code. Raises WatchError where there is no node."""
    os.nice(NICE // 2)
    alive = Alive()
    with watching(namespace, wait, alive, open_, Watcher, NODE) as watcher:
        one = Lookout(watcher.scene(scene), wanted, known)
        try:
            _watch(one, watcher, alive)
        finally:
            one.close()
    return CODE_OK


def _watch(one: Lookout, watcher: Watcher, alive: Alive) -> None:
    node, client = watcher.client.node, watcher.client
    profile = QoSProfile(depth=10)
    advice = node.create_publisher(String, watcher.topic(ADVICE), profile)
    diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", profile)

    def ask(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        report = one.look(time.monotonic())
        response.success, response.message = report["state"] != "unknown", report["answer"]
        return response

    node.create_service(Trigger, watcher.topic(ASK), ask)
    client.hear(PointCloud2, watcher.topic(PROFILE), one.profile, reliable=False)
    say(f"{one.scene.name}: hears {watcher.topic(PROFILE)}, says {watcher.topic(ADVICE)}, answers {watcher.topic(ASK)}")
    said, state, points = 0.0, "", one.points
    while alive():
        client.check()
        frames, _ = watcher.take()
        now = time.monotonic()
        if len(frames):
            one.tick(frames[-1], now)
        one.renew()
        if now - said >= EVERY or one.points is not points:
            report, said, points = one.look(now), now, one.points
            advice.publish(String(data=json.dumps(json.loads(json_of(report)))))
            stamp = one.here.time if one.here else 0
            diagnostics.publish(diagnostic_array(NODE, [status_of(report)], stamp))
            if report["state"] != state:
                state = report["state"]
                say(report["answer"])
        time.sleep(0.05)
