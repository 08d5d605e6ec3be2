"""`towbody/fix` and `towbody/fix/pose`: the towbody as a survey takes it, with the covariance of its interval: that of
steady tows, or where the tow manoeuvres of the copies of a `cable-sim ensemble` beside the node.

Off unless fix.latitude and fix.longitude say where `odom` begins. Published beside the ticks, of the newest one.
"""

from __future__ import annotations

import math
import time
from collections import deque
from functools import partial
from math import hypot, radians, remainder
from typing import TYPE_CHECKING, Any

import numpy as np

from ...io.geodesy import on_earth
from ...ros.parts import OK, WARN, Status
from ...sim.scene import Scene
from ...sim.tables.attitude import angles_of
from ...sim.tables.current import flow_of
from ...terminal import clean
from ..ensemble.limits import Ranges
from .laid import COVERAGE, NoShape, Tow, band_of
from .towed import manoeuvres

if TYPE_CHECKING:
    from ...ros.node import CableSimNode

MSGTYPE = "sensor_msgs/msg/NavSatFix"
POSE, POSE_TYPE = "towbody/fix/pose", "geometry_msgs/msg/PoseWithCovarianceStamped"
COPIES, STATE = "ensemble/towbody", "ensemble/band"  # of `cable-sim ensemble`
LARGEST = 100_000  # bytes of a message of these
FRESH = 5 * 10**9  # ns, after which a covariance of copies is too old
REMEMBERED = 1800  # s of motion by which a manoeuvre is known
UNKNOWN = -1.0  # first number of a covariance that is not known, as of sensor_msgs
CALM = 20.0  # s, over which the ship's velocity is averaged
SHARES = (0.5, 1.0, 1.5)  # of the scene's cable out and speed
LEAST_SPEED, LEAST_CABLE = 0.5, 10.0  # m/s, m: of which shares are taken at least
TURNED = radians(15.0)  # of the heading, from which a current of the world makes another tow


class BandTable:
    """The interval of a tow's place for many cables and speeds of a scene at its heading, made once."""

    def __init__(self, scene: Scene, ranges: Ranges) -> None:
        self.heading = radians(scene.ship.heading_deg)
        held = sum(section.length for section in scene.cable.sections.values())
        middle = max(scene.winch.scope or 0.5 * held, LEAST_CABLE)
        self.cables = np.unique([min(share * middle, 0.95 * held) for share in SHARES])
        self.speeds = np.array([share * max(scene.ship.tow_speed, LEAST_SPEED) for share in SHARES])
        depths = np.linspace(0.0, float(self.cables[-1]), 5)
        self.flows = any(hypot(*flow_of(scene.water, self.heading)(-float(depth))) > 0.0 for depth in depths)
        east, north = np.cos(self.heading), np.sin(self.heading)
        self._rows = np.full((len(self.cables), len(self.speeds), 3), np.nan)
        for i, cable in enumerate(self.cables):
            for k, speed in enumerate(self.speeds):
                try:
                    band = band_of(scene, Tow(float(cable), speed * east, speed * north, self.heading), ranges)[1]
                except NoShape:
                    continue
                self._rows[i, k] = np.array([band.along, band.across, band.depth]) / COVERAGE

    def of(self, cable: float, speed: float, heading: float) -> tuple[float, ...] | None:
        """Standard deviations [m] along the layback, across it and of the depth, at a cable out [m], a speed [m/s] and
        a heading [rad]; None where nothing is known of it."""
        inside = self.cables[0] <= cable <= self.cables[-1] and self.speeds[0] <= speed <= self.speeds[-1]
        if not inside or (self.flows and abs(remainder(heading - self.heading, 2.0 * np.pi)) > TURNED):
            return None
        found = tuple(
            float(np.interp(cable, self.cables, [np.interp(speed, self.speeds, row) for row in self._rows[:, :, k]]))
            for k in range(3)
        )
        return found if np.isfinite(found).all() else None


class Fixes:
    """Publishes the fixes of a node."""

    def __init__(self, node: CableSimNode, block: Any, topic: str) -> None:
        """block: `Fix` of node_part.py, with a latitude."""
        from geometry_msgs.msg import PoseWithCovarianceStamped
        from rclpy.clock import Clock, ClockType
        from rclpy.qos import QoSProfile, ReliabilityPolicy
        from sensor_msgs.msg import JointState, NavSatFix

        self.node, self.fix, self.origin = node, block, (block.latitude or 0.0, block.longitude or 0.0)  # asked for
        begun = time.monotonic()
        self.table = BandTable(node.settings.scene, self.fix.ranges)
        node.get_logger().info(
            clean(
                f"{topic}: intervals of {self.table.cables[0]:.4g} to {self.table.cables[-1]:.4g} m of cable at "
                f"{self.table.speeds[0]:.3g} to {self.table.speeds[-1]:.3g} m/s "
                f"made in {time.monotonic() - begun:.1f} s"
            )
        )
        self.made, self.made_pose = NavSatFix, PoseWithCovarianceStamped
        profile, turned = QoSProfile(depth=10), node.resolve_topic_name
        self._publishers = [
            (node.create_publisher(made, name, profile), turned(name), kind)
            for made, name, kind in ((NavSatFix, topic, MSGTYPE), (PoseWithCovarianceStamped, POSE, POSE_TYPE))
        ]
        best = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
        for made, name in ((PoseWithCovarianceStamped, COPIES), (JointState, STATE)):
            node.create_subscription(made, name, partial(self._hear, made), best, raw=True)
        self.source, self._copies, self._ready = "none", (0, np.zeros((6, 6))), False
        self._velocity = np.full(2, math.nan)
        self._last = -1
        self._past: deque[tuple[float, ...]] = deque(maxlen=REMEMBERED)
        node.create_timer(1.0 / block.rate, self._on_timer, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _hear(self, made: type, data: bytes) -> None:
        """Covariance of the copies of an ensemble beside the node, and whether it can be taken as it is."""
        if len(data) > LARGEST:
            return
        from rclpy.serialization import deserialize_message

        message: Any = deserialize_message(data, made)
        if made is self.made_pose:
            covariance = np.array(message.pose.covariance).reshape(6, 6)
            if np.isfinite(covariance).all() and (np.diag(covariance) >= 0.0).all():
                stamp = message.header.stamp
                self._copies = stamp.sec * 10**9 + stamp.nanosec, covariance
            return
        state = dict(zip(message.name, message.position, strict=False))
        width = max(state.get(f"{k}.high", math.nan) - state.get(f"{k}.low", math.nan) for k in ("body_x", "body_y"))
        apart = state.get("copy_0_apart", math.nan) <= max(0.5 * width, 0.1)
        self._ready = apart and state.get("settling") == 0.0 and state.get("behind") == 0.0

    def _on_timer(self) -> None:
        publisher = self.node.publisher
        frame = None if publisher is None else publisher.latest
        if frame is None or int(frame["time"]) == self._last:
            return
        from rclpy.serialization import serialize_message

        for message, (publisher, topic, kind) in zip(self.messages(frame), self._publishers, strict=True):
            data = serialize_message(message)
            publisher.publish(data)
            self.node.record(topic, kind, data)

    def statuses(self) -> list[Status]:
        """The task fix: what the newest covariance comes from."""
        text = {
            "steady": "interval of steady tows",
            "copies": "the tow manoeuvres: interval of the copies of cable-sim ensemble",
            "manoeuvre": "the tow manoeuvres, and no settled cable-sim ensemble is heard: the fix has no covariance",
            "none": "no interval at this cable out, speed and heading: the fix has no covariance",
        }[self.source]
        return [Status("fix", OK if self.source in ("steady", "copies") else WARN, text, {"interval": self.source})]

    def messages(self, frame: np.record) -> tuple[Any, Any]:
        """The fix and the pose of a tick output."""
        now = int(frame["time"])
        velocity = np.array(frame["ship_velocity"][:2])
        old = math.exp(-(now - self._last) * 1e-9 / CALM) if 0 <= self._last < now else 0.0
        self._velocity = velocity if not old else old * self._velocity + (1.0 - old) * velocity
        if now < self._last:
            self._past.clear()
        self._last = now
        fix, pose, body = self.made(), self.made_pose(), frame["body_position"]
        for message in (fix, pose):
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 1_000_000_000)
        frames = self.node.settings.node.frame
        fix.header.frame_id, pose.header.frame_id = frames.towbody_link, frames.odom
        latitude, longitude = on_earth(self.origin, body[None, :2])
        fix.latitude, fix.longitude = float(latitude[0]), float(longitude[0])
        fix.altitude = math.nan if self.fix.surface is None else self.fix.surface + float(body[2])
        place, turn = pose.pose.pose.position, pose.pose.pose.orientation
        place.x, place.y, place.z = body.tolist()
        turn.x, turn.y, turn.z, turn.w = frame["body_quaternion"].tolist()
        covariance = self._covariance(frame)
        if covariance is None:
            fix.position_covariance_type = self.made.COVARIANCE_TYPE_UNKNOWN
            pose.pose.covariance = [UNKNOWN] + [0.0] * 35
            return fix, pose
        pose.pose.covariance = covariance.ravel().tolist()
        fix.position_covariance = covariance[:3, :3].ravel().tolist()
        fix.position_covariance_type = self.made.COVARIANCE_TYPE_APPROXIMATED
        return fix, pose

    def _covariance(self, frame: np.record) -> np.ndarray | None:
        """Of east, north, up [m], roll, pitch, yaw [rad], 6 x 6; None: not known. Roll and pitch have none: 0."""
        yaw = angles_of(*frame["ship_quaternion"].tolist())[2]
        if self._manoeuvres(frame, yaw):
            stamp, covariance = self._copies
            self.source = "copies" if self._ready and 0 <= self._last - stamp <= FRESH else "manoeuvre"
            return covariance if self.source == "copies" else None
        spread = self.table.of(float(frame["scope"]), hypot(*self._velocity), yaw)
        self.source = "none" if spread is None else "steady"
        if spread is None:
            return None
        east, north = (frame["body_position"] - frame["sheave_position"])[:2].tolist()
        size = hypot(east, north) or 1.0
        c, s = east / size, north / size
        along, across, deep = (deviation**2 for deviation in spread)
        made = np.diag([0.0, 0.0, deep, 0.0, 0.0, math.atan2(spread[1], size) ** 2])
        made[0, 0], made[1, 1] = along * c * c + across * s * s, along * s * s + across * c * c
        made[0, 1] = made[1, 0] = (along - across) * c * s
        return made

    def _manoeuvres(self, frame: np.record, yaw: float) -> bool:
        """Does the tow manoeuvre now, by its motion of the last REMEMBERED s?"""
        now = self._last * 1e-9
        if not self._past or now - self._past[-1][0] >= 1.0:
            self._past.append((now, *self._velocity.tolist(), yaw, float(frame["scope"])))
        rows, scene = np.array(self._past), self.node.settings.scene
        since = float(frame["tick"]) * scene.solver.tick - (now - rows[0, 0])
        return bool(manoeuvres(rows[:, 0] - rows[0, 0], rows[:, 1:3], rows[:, 3], rows[:, 4], scene, since, last=1)[0])
