"""Keeps roll and pitch of the towbody at zero by two flaps of its tail: python3 keep_level.py

For the scene side_scan_fish: both flaps together turn it in pitch, one against the other in roll. Each odometry
is answered, under a stamp that hangs on it alone.
"""

import math

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState

ROLL, PITCH = (4.0, 2.0, 0.5), (2.0, 0.2, 1.0)  # gains of angle, integral and rate: 1, 1/s, s
LARGEST = math.radians(20.0)
PERIOD, DELAY = 0.01, 30_000_000  # s, from one tick to the next; ns, input_delay: /clock is so far ahead of a tick


class KeepLevel(Node):
    def __init__(self):
        super().__init__("keep_level", namespace="/tow_sim")
        self.sums = {ROLL: 0.0, PITCH: 0.0}
        self.create_subscription(Odometry, "towbody/odom", self.on_odometry, qos_profile_sensor_data)
        self.flaps = self.create_publisher(JointState, "towbody/flaps", 10)

    def on_odometry(self, odometry):
        stamp = odometry.header.stamp.sec * 1_000_000_000 + odometry.header.stamp.nanosec
        q, rate = odometry.pose.pose.orientation, odometry.twist.twist.angular  # axes of the body: x ahead, y to port
        roll = math.atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x**2 + q.y**2))  # port side up
        pitch = math.asin(max(-1.0, min(1.0, 2 * (q.w * q.y - q.z * q.x))))  # nose down
        both, apart = self.angle(PITCH, -pitch, -rate.y), self.angle(ROLL, roll, rate.x)
        self.send(stamp + DELAY, {"tail_port": both - apart, "tail_starboard": both + apart})

    def angle(self, gains, error, slope):
        kp, ki, kd = gains
        angle = kp * error + self.sums[gains] + kd * slope
        if abs(angle) < LARGEST:  # no wind-up at the end of the range
            self.sums[gains] += ki * error * PERIOD
        return max(-LARGEST, min(LARGEST, angle))

    def send(self, stamp, angles):
        message = JointState(name=list(angles), position=list(angles.values()))
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        self.flaps.publish(message)


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(KeepLevel())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
