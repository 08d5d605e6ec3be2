"""A ship's sensors in a process of their own, for load tests: IMU and odometry of a heaving ship at any rates.

    python -m verification.soak.sender --imu 500 --odometry 500 [--heave M,S] [--seconds S] [--ros-args ...]

Messages are patched into CDR templates, so that 1000 a second cost this process a twentieth of a core.
"""

from __future__ import annotations

import argparse
import math
import struct
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np
import rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions

from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.messages.cdr import header, store_type
from cable_sim_ros.io.messages.messages import KINDS
from cable_sim_ros.processes import Alive
from cable_sim_ros.ros.loop import raise_priority
from cable_sim_ros.ros.play.player import SECOND, sleep_until
from cable_sim_ros.ros.topics import senders

GRAVITY = 9.81  # m/s^2
_Vector3, _Point = store_type("geometry_msgs/msg/Vector3"), store_type("geometry_msgs/msg/Point")
_LEVEL = store_type("geometry_msgs/msg/Quaternion")(0.0, 0.0, 0.0, 1.0)


class Ship:
    """Heave of `amplitude` m in `period` s about a track ahead at `speed` m/s; messages as CDR bytes."""

    def __init__(self, amplitude: float = 1.0, period: float = 8.0, frame_id: str = "", speed: float = 2.0) -> None:
        self.amplitude, self.pulsation, self.speed = amplitude, 2.0 * math.pi / period, speed
        self.shift = 0  # ns added to the stamps
        none = np.zeros(9)
        imu = store_type("sensor_msgs/msg/Imu")(
            header(0, frame_id or "imu_link"), _LEVEL, none, _Vector3(0, 0, 0), none, _Vector3(0, 0, GRAVITY), none
        )
        pose = store_type("geometry_msgs/msg/PoseWithCovariance")(
            store_type("geometry_msgs/msg/Pose")(_Point(0, 0, 0), _LEVEL), np.zeros(36)
        )
        twist = store_type("geometry_msgs/msg/TwistWithCovariance")(
            store_type("geometry_msgs/msg/Twist")(_Vector3(0, 0, 0), _Vector3(0, 0, 0)), np.zeros(36)
        )
        odometry = store_type("nav_msgs/msg/Odometry")(header(0, frame_id or "odom"), "base_link", pose, twist)
        self._bytes = {
            kind: bytearray(STORE.serialize_cdr(message, KINDS[kind][0]))
            for kind, message in (("imu", imu), ("odometry", odometry))
        }

    def message(self, kind: str, stamp: int, t: float) -> bytes:
        """CDR bytes of "imu" or "odometry"; stamp: ns; t: s on the wave's own clock."""
        data, w = self._bytes[kind], self.pulsation
        z, up = self.amplitude * math.sin(w * t), self.amplitude * w * math.cos(w * t)
        struct.pack_into("<iI", data, 4, *divmod(stamp + self.shift, SECOND))
        end = len(data)  # both end in doubles: their places are counted from there
        if kind == "imu":
            struct.pack_into("<d", data, end - 8 * 10, GRAVITY - w * w * z)
        else:
            struct.pack_into("<3d", data, end - 8 * 85, self.speed * t, 0.0, z)
            struct.pack_into("<3d", data, end - 8 * 42, self.speed, 0.0, up)
        return bytes(data)


def send(publish: Callable[[str, bytes], None], ship: Ship, rates: dict[str, float], seconds: float, alive) -> int:
    """Call publish(kind, bytes) at rates [Hz] for some seconds (0: until alive() is false); returns how often."""
    begun, wall, sent = time.monotonic_ns(), time.time_ns(), 0
    due = {kind: 0 for kind, rate in rates.items() if rate > 0.0}
    while due:
        kind = min(due, key=lambda name: due[name] / rates[name])
        at = round(due[kind] * SECOND / rates[kind])
        if (seconds and at > seconds * SECOND) or not sleep_until(begun + at, alive):
            break
        publish(kind, ship.message(kind, wall + at, at / SECOND))
        due[kind] += 1
        sent += 1
    return sent


def main(arguments: Sequence[str]) -> int:
    """Entry point: 0 at the end of the time or after a signal."""
    parser = argparse.ArgumentParser(prog="sender", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--imu", type=float, default=50.0, metavar="HZ")
    parser.add_argument("--odometry", type=float, default=50.0, metavar="HZ")
    parser.add_argument("--heave", default="1,8", metavar="M,S")
    parser.add_argument("--seconds", type=float, default=0.0, metavar="S", help="0: until a signal")
    given, ros = parser.parse_known_args(list(arguments))
    amplitude, period = map(float, given.heave.split(","))
    running = Alive()
    rclpy.init(args=["sender", *ros], signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("sensors", namespace="/tow_sim")
    profile = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
    rates = {"imu": given.imu, "odometry": given.odometry}
    publishers = senders(node, (kind for kind, rate in rates.items() if rate > 0.0), profile)
    raise_priority()  # where it is allowed: a sensor does not wait for this machine's other work
    ship = Ship(amplitude, period)
    send(lambda kind, data: publishers[kind].publish(data), ship, rates, given.seconds, running)
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
