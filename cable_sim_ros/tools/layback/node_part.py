"""`towbody/fix`: latitude and longitude of the towbody as a survey takes them, with the covariance of its interval.

Off unless fix.latitude and fix.longitude say where `odom` begins. Published beside the ticks, of the newest one.
"""

from __future__ import annotations

import math
import time
from math import hypot, radians, remainder
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...io.geodesy import FARTHEST, on_earth
from ...physics.parameter import Block, quantity
from ...ros.parts import NodePart
from ...sim.scene import Scene
from ...sim.tables.attitude import angles_of
from ...sim.tables.current import flow_of
from ...terminal import clean
from .ranges import Ranges
from .static_place import COVERAGE, NoShape, Tow, band_of

if TYPE_CHECKING:
    from ...ros.node import CableSimNode

TOPIC, MSGTYPE = "towbody/fix", "sensor_msgs/msg/NavSatFix"
CALM = 20.0  # s, over which the ship's velocity is averaged
SHARES = (0.5, 1.0, 1.5)  # of the scene's cable out and speed
LEAST_SPEED, LEAST_CABLE = 0.5, 10.0  # m/s, m: of which shares are taken at least
TURNED = radians(15.0)  # of the heading, from which a current of the world makes another tow


class Spread(NamedTuple):
    """Standard deviations [m] of a towbody along its layback, across it, and of its depth."""

    along: float
    across: float
    depth: float


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

    def of(self, cable: float, speed: float, heading: float) -> Spread | None:
        """Of a cable out [m], a speed [m/s] and a heading [rad]; None where nothing is known of it."""
        inside = self.cables[0] <= cable <= self.cables[-1] and self.speeds[0] <= speed <= self.speeds[-1]
        if not inside or (self.flows and abs(remainder(heading - self.heading, 2.0 * np.pi)) > TURNED):
            return None
        found = [
            float(np.interp(cable, self.cables, [np.interp(speed, self.speeds, row) for row in self._rows[:, :, k]]))
            for k in range(3)
        ]
        return Spread(*found) if np.isfinite(found).all() else None


class Fix(Block):
    """Where `odom` begins, and what is not known of the tow."""

    latitude: float | None = quantity(
        None, "deg", -FARTHEST, FARTHEST, "of the origin of odom, WGS 84; none: no towbody/fix"
    )
    longitude: float | None = quantity(None, "deg", -180.0, 180.0, "of the origin of odom, WGS 84")
    surface: float | None = quantity(
        None, "m", -120.0, 120.0, "height of the mean water surface above the ellipsoid; none: the fix has no altitude"
    )
    rate: float = quantity(1.0, "Hz", 0.1, 20.0, "rate of towbody/fix, in wall time")
    ranges: Ranges = quantity(Ranges(), "", None, None, "half-widths of 95 % that its covariance comes from")


def fix_problem(fix: Fix) -> str:
    """ "" or why these parameters cannot be used."""
    given = {"latitude": fix.latitude, "longitude": fix.longitude}
    if sum(value is not None for value in given.values()) == 1:
        name, other = ("latitude", "longitude") if fix.longitude is None else ("longitude", "latitude")
        return (
            f"parameter 'fix.{name}' = {given[name]:g} deg has no fix.{other} beside it: where odom begins is not "
            f"known; nothing was started. Give both, or neither for no {TOPIC}"
        )
    return ""


class TowbodyFix(NodePart):
    """Publishes the fixes of a node."""

    block, doc = Fix, "latitude and longitude of the towbody"

    def __init__(self, node: CableSimNode, block: Fix) -> None:
        from rclpy.clock import Clock, ClockType
        from rclpy.qos import QoSProfile
        from sensor_msgs.msg import NavSatFix

        self.node, self.fix, self.origin = node, block, (block.latitude or 0.0, block.longitude or 0.0)  # asked for
        begun = time.monotonic()
        self.table = BandTable(node.settings.scene, self.fix.ranges)
        node.get_logger().info(
            clean(
                f"{TOPIC}: intervals of {self.table.cables[0]:.4g} to {self.table.cables[-1]:.4g} m of cable at "
                f"{self.table.speeds[0]:.3g} to {self.table.speeds[-1]:.3g} m/s "
                f"made in {time.monotonic() - begun:.1f} s"
            )
        )
        self.made = NavSatFix
        self.topic = node.resolve_topic_name(TOPIC)
        self._publisher = node.create_publisher(NavSatFix, TOPIC, QoSProfile(depth=10))
        self._velocity = np.full(2, math.nan)
        self._last = -1
        node.create_timer(1.0 / block.rate, self._on_timer, clock=Clock(clock_type=ClockType.STEADY_TIME))

    @staticmethod
    def asked(block: Fix) -> bool:
        """Is it said where odom begins?"""
        return block.latitude is not None

    @staticmethod
    def problem(block: Fix, scene: Scene) -> str:
        """As fix_problem."""
        return fix_problem(block)

    def _on_timer(self) -> None:
        publisher = self.node.publisher
        frame = None if publisher is None else publisher.latest
        if frame is None or int(frame["time"]) == self._last:
            return
        from rclpy.serialization import serialize_message

        data = serialize_message(self.message(frame))
        self._publisher.publish(data)
        self.node.record(self.topic, MSGTYPE, data)

    def message(self, frame: np.record) -> Any:
        """The fix of a tick output."""
        now = int(frame["time"])
        velocity = np.array(frame["ship_velocity"][:2])
        old = math.exp(-(now - self._last) * 1e-9 / CALM) if 0 <= self._last < now else 0.0
        self._velocity = velocity if not old else old * self._velocity + (1.0 - old) * velocity
        self._last = now
        message, body = self.made(), frame["body_position"]
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 1_000_000_000)
        message.header.frame_id = self.node.settings.node.frame.towbody_link
        latitude, longitude = on_earth(self.origin, body[None, :2])
        message.latitude, message.longitude = float(latitude[0]), float(longitude[0])
        message.altitude = math.nan if self.fix.surface is None else self.fix.surface + float(body[2])
        yaw = angles_of(*frame["ship_quaternion"].tolist())[2]
        spread = self.table.of(float(frame["scope"]), hypot(*self._velocity), yaw)
        if spread is None:
            message.position_covariance_type = self.made.COVARIANCE_TYPE_UNKNOWN
            return message
        east, north = (body - frame["sheave_position"])[:2].tolist()
        size = hypot(east, north) or 1.0
        c, s = east / size, north / size
        along, across = spread.along**2, spread.across**2
        ee, en, nn = along * c * c + across * s * s, (along - across) * c * s, along * s * s + across * c * c
        message.position_covariance = [ee, en, 0.0, en, nn, 0.0, 0.0, 0.0, spread.depth**2]
        message.position_covariance_type = self.made.COVARIANCE_TYPE_APPROXIMATED
        return message
