"""A PD heave compensator as a ROS 2 node, to copy: python3 pd_compensator.py --ros-args -p use_sim_time:=true

What the sheave moves along the cable is paid out: D is its speed, P what the winch is short of that length.

Signs: pay-out, its rate and the speed of the sheave along the cable are positive out. A sheave that rises or runs ahead
of the mean draws cable, so the winch pays out by as much.
Sampling: one command for each sample of odometry, under its stamp, from the newest winch state that is STATE_AGE older;
where that is on its way, it is waited for. Nothing hangs on a clock or on what has come first.
Wind-up: there is no integral. The length wanted leaks, or an error of the mean speed would add up to metres.
"""

import math
from collections import deque

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

SHEAVE = (-36.8, 0.0, 3.7)  # m from base_link, axes of the ship
ANGLE = math.radians(78.0)  # of the departing cable from the vertical
TOW_SPEED = 2.2  # m/s, mean of the ship
KP, KD = 0.5, 1.0  # 1/s, 1
LEAK = 100.0  # s
REST, RAMP = 0.5, 1.0  # s with the winch at rest, s until the whole gain
STATE_AGE = 0.04  # s: the simulation is 30 ms behind its clock, and the tick of this moment is still to come
TICK = 0.01  # s from one winch state to the next
SECOND = 1_000_000_000
STREAM = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)


def stamp_of(message):
    """Stamp of a message, ns."""
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def speed_along(odometry):
    """Speed of the sheave along the cable beyond the mean of the ship, m/s, positive where it draws cable."""
    q, v, w = odometry.pose.pose.orientation, odometry.twist.twist.linear, odometry.twist.twist.angular
    x, y, z = SHEAVE
    vx, vy, vz = v.x + w.y * z - w.z * y, v.y + w.z * x - w.x * z, v.z + w.x * y - w.y * x  # v + w x r, ship's axes
    up = 2 * (q.x * q.z - q.w * q.y) * vx + 2 * (q.y * q.z + q.w * q.x) * vy + (1 - 2 * (q.x**2 + q.y**2)) * vz
    ahead = vx  # to second order of pitch and yaw
    return (ahead - TOW_SPEED) * math.sin(ANGLE) + up * math.cos(ANGLE)


class PdCompensator(Node):
    def __init__(self):
        super().__init__("pd_compensator", namespace="/tow_sim")
        self.samples = deque(maxlen=500)  # (stamp, speed along the cable), not answered yet
        self.states = deque(maxlen=50)  # (stamp, pay-out)
        self.lengths = deque(maxlen=50)  # (stamp, length wanted)
        self.begun = self.datum = self.last = None
        self.length = 0.0
        self.create_subscription(Odometry, "odom", self.on_odometry, STREAM)
        self.create_subscription(JointState, "winch/state", self.on_state, STREAM)
        self.winch = self.create_publisher(JointState, "winch/command", 10)

    def on_odometry(self, message):
        self.samples.append((stamp_of(message), speed_along(message)))
        self.answer()

    def on_state(self, message):
        self.states.append((stamp_of(message), message.position[message.name.index("payout")]))
        self.answer()

    def answer(self):
        """Each sample, as soon as the winch state that belongs to it has come."""
        while self.samples:
            stamp, speed = self.samples[0]
            self.begun = self.begun or stamp
            seen = stamp - STATE_AGE * SECOND
            working = stamp - self.begun >= REST * SECOND
            if working and not (self.states and self.states[-1][0] > seen - TICK * SECOND):
                return
            self.samples.popleft()
            past = [state for state in self.states if state[0] <= seen]
            rate = self.rate(stamp, speed, *past[-1]) if working and past else 0.0
            message = JointState(name=["payout"], velocity=[rate])
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
            self.winch.publish(message)

    def rate(self, stamp, speed, seen, payout):
        """Rate of pay-out at a stamp, m/s, from the pay-out that was seen then."""
        h = 0.0 if self.last is None else (stamp - self.last) / SECOND
        self.last = stamp
        gain = min(1.0, max(0.0, (stamp - self.begun) / SECOND - REST) / RAMP)
        self.length += h * (gain * speed - self.length / LEAK)
        self.lengths.append((stamp, self.length))
        then = [length for at, length in self.lengths if at <= seen] or [0.0]
        if self.datum is None:
            self.datum = payout
        return KD * gain * speed + KP * (then[-1] - (payout - self.datum))


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(PdCompensator())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
