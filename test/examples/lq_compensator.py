"""A linear-quadratic heave compensator as a ROS 2 node, to copy: python3 lq_compensator.py --ros-args ...

Feed-forward of the sheave's speed along the cable, and the state feedback that is best for

    e' = s - v,  i' = e,  v' = (u - v) / T        cost: sum of (i/I)^2 + (e/E)^2 + ((u - s)/U)^2 each sample

e: length that is short, v: rate of the winch, u: rate asked for, s: speed of the sheave. The gains come from the
discrete Riccati equation (scipy.linalg.solve_discrete_are) at the start.

Signs: pay-out, its rate and the speed of the sheave along the cable are positive out; e > 0 is still to be paid out.
Sampling: one command for each sample of odometry, under its stamp; gains are those of this period. The winch state is
STATE_AGE older, and is waited for: the state of now is predicted with the rates that were asked for since.
Wind-up: i stands still while u is beyond MAX_RATE.
"""

import math
from collections import deque

import numpy as np
import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from scipy.linalg import expm, solve_discrete_are
from sensor_msgs.msg import JointState

SHEAVE = (-36.8, 0.0, 3.7)  # m from base_link, axes of the ship
ANGLE = math.radians(78.0)  # of the departing cable from the vertical
TOW_SPEED = 2.2  # m/s, mean of the ship
PERIOD = 0.02  # s from one sample of odometry to the next
T = 0.02  # s of the winch; 0.2 for a drive of 6 rad/s
I, E, U = 1.0, 0.05, 0.1  # m s, m, m/s: what counts as much as each other
MAX_RATE = 2.0  # m/s
LEAK = 100.0  # s
REST, RAMP = 0.5, 1.0  # s with the winch at rest, s until the whole gain
STATE_AGE = 0.04  # s: the simulation is 30 ms behind its clock, and the tick of this moment is still to come
TICK = 0.01  # s from one winch state to the next
SECOND = 1_000_000_000
STREAM = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)


def speed_along(odometry):
    """Speed of the sheave along the cable beyond the mean of the ship, m/s; pitch and yaw are small."""
    v, w, (x, y, z) = odometry.twist.twist.linear, odometry.twist.twist.angular, SHEAVE
    q = odometry.pose.pose.orientation
    ahead, side, up = v.x + w.y * z - w.z * y, v.y + w.z * x - w.x * z, v.z + w.x * y - w.y * x  # v + w x r
    up += 2 * (q.x * q.z - q.w * q.y) * ahead + 2 * (q.y * q.z + q.w * q.x) * side
    return (ahead - TOW_SPEED) * math.sin(ANGLE) + up * math.cos(ANGLE)


def gains():
    """K of u = s - K (i, e, v - s)."""
    step = expm(PERIOD * np.array([[0, 1, 0, 0], [0, 0, -1, 0], [0, 0, -1 / T, 1 / T], [0, 0, 0, 0]]))
    a, b = step[:3, :3], step[:3, 3:]
    p = solve_discrete_are(a, b, np.diag([1 / I**2, 1 / E**2, 0.0]), np.array([[1 / U**2]]))
    return np.linalg.solve(1 / U**2 + b.T @ p @ b, b.T @ p @ a)[0]


class LqCompensator(Node):
    def __init__(self):
        super().__init__("lq_compensator", namespace="/tow_sim")
        self.gains = gains()
        self.samples, self.states = deque(maxlen=500), deque(maxlen=50)  # not answered yet; (stamp, pay-out)
        self.past = deque(maxlen=50)  # (stamp, pay-out of the model)
        self.begun = self.datum = None
        self.length = self.integral = self.rate = self.paid = self.asked = 0.0
        self.create_subscription(Odometry, "odom", self.on_odometry, STREAM)
        self.create_subscription(JointState, "winch/state", self.on_state, STREAM)
        self.winch = self.create_publisher(JointState, "winch/command", 10)

    def on_odometry(self, message):
        self.samples.append((Time.from_msg(message.header.stamp).nanoseconds, speed_along(message)))
        self.answer()

    def on_state(self, message):
        at = message.name.index("payout")
        self.states.append((Time.from_msg(message.header.stamp).nanoseconds, message.position[at]))
        self.answer()

    def answer(self):
        """Each sample, as soon as the winch state that belongs to it has come."""
        while self.samples:
            stamp, speed = self.samples[0]
            self.begun = self.begun or stamp
            seen, working = stamp - STATE_AGE * SECOND, stamp - self.begun >= REST * SECOND
            if working and not (self.states and self.states[-1][0] > seen - TICK * SECOND):
                return
            self.samples.popleft()
            past = [state for state in self.states if state[0] <= seen]
            asked = self.control(stamp, speed, *past[-1]) if working and past else 0.0
            message = JointState(name=["payout"], velocity=[float(asked)])
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
            self.winch.publish(message)

    def control(self, stamp, speed, seen, payout):
        """Rate asked for, m/s, from the pay-out at the stamp seen."""
        gain = min(1.0, max(0.0, (stamp - self.begun) / SECOND - REST) / RAMP)
        self.datum = payout if self.datum is None else self.datum
        self.length += PERIOD * (gain * speed - self.length / LEAK)
        before, self.rate = self.rate, self.asked + (self.rate - self.asked) * math.exp(-PERIOD / T)
        self.paid += PERIOD * self.asked - T * (self.rate - before)  # of the model, to now
        self.past.append((stamp, self.paid))
        since = self.paid - ([paid for at, paid in self.past if at <= seen] or [self.paid])[-1]
        error = self.length - (payout + since - self.datum)
        asked = gain * speed - self.gains @ (self.integral, error, self.rate - gain * speed)
        if abs(asked) < MAX_RATE:
            self.integral += PERIOD * error
        self.asked = max(-MAX_RATE, min(MAX_RATE, asked))
        return self.asked


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(LqCompensator())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
