"""Holds the towbody at a depth: python3 hold_depth.py 102 (metres below the mean water surface)."""

import sys

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

GAIN, FASTEST, BLIND = 0.5, 1.0, 0.2  # 1/s; m/s; s without a pose, after which the winch is stopped


class HoldDepth(Node):
    def __init__(self, wanted):
        super().__init__("hold_depth", namespace="/tow_sim")
        self.wanted, self.depth, self.payout, self.seen = wanted, None, None, None
        self.create_subscription(PoseStamped, "towbody/pose", self.on_pose, qos_profile_sensor_data)
        self.create_subscription(JointState, "winch/state", self.on_winch, qos_profile_sensor_data)
        self.winch = self.create_publisher(JointState, "winch/command", 10)
        self.create_timer(0.05, self.control)  # 20 Hz; a rate lasts winch.command_timeout, 0.5 s

    def on_pose(self, pose):  # smoothed over half a second of ticks: the body bounces on its cable
        depth, self.seen = -pose.pose.position.z, self.get_clock().now()
        self.depth = depth if self.depth is None else self.depth + 0.02 * (depth - self.depth)

    def on_winch(self, state):
        self.payout = state.position[state.name.index("payout")]

    def control(self):
        now, rate = self.get_clock().now(), 0.0
        if self.seen is not None and (now - self.seen).nanoseconds < BLIND * 1e9:
            rate = max(-FASTEST, min(FASTEST, GAIN * (self.wanted - self.depth)))  # deeper: pay out
            self.get_logger().info(f"{self.depth:.2f} m deep, {self.payout} m out", throttle_duration_sec=2)
        command = JointState(name=["payout"], velocity=[rate])
        command.header.stamp = now.to_msg()  # for the lag figure alone
        self.winch.publish(command)


rclpy.init()
rclpy.spin(HoldDepth(float(sys.argv[1])))
