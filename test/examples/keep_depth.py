"""Holds the towbody at a depth by the flap of its wing: python3 keep_depth.py 110 (metres below the mean surface).

For the scene depressor. Each pose is answered, under a stamp that hangs on it alone: so two runs in lockstep are the
same to the bit. The winch stands.
"""

import math
import sys

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

KP, KI, KD = 0.1, 0.008, 0.5  # rad/m, rad/(m s), rad s/m
LARGEST = math.radians(15.0)
PERIOD, DELAY = 0.01, 30_000_000  # s, from one tick to the next; ns, input_delay: /clock is so far ahead of a tick


class KeepDepth(Node):
    def __init__(self, wanted):
        super().__init__("keep_depth", namespace="/tow_sim")
        self.wanted, self.before, self.sum = wanted, None, 0.0
        self.create_subscription(PoseStamped, "towbody/pose", self.on_pose, qos_profile_sensor_data)
        self.flaps = self.create_publisher(JointState, "towbody/flaps", 10)

    def on_pose(self, pose):
        stamp = pose.header.stamp.sec * 1_000_000_000 + pose.header.stamp.nanosec
        h, error = PERIOD, self.wanted + pose.pose.position.z  # positive: too high
        sinks = 0.0 if self.before is None else (self.before - error) / h
        self.before = error
        angle = -KP * error - self.sum + KD * sinks  # trailing edge up: less lift, deeper
        if abs(angle) < LARGEST:  # no wind-up at the end of the range
            self.sum += KI * error * h
        self.send(stamp + DELAY, {"depressor": max(-LARGEST, min(LARGEST, angle))})

    def send(self, stamp, angles):
        message = JointState(name=list(angles), position=list(angles.values()))
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        self.flaps.publish(message)


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(KeepDepth(float(sys.argv[1])))
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
