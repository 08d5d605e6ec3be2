"""A PID heave compensator on length and tension, as a ROS 2 node to copy: python3 pid_compensator.py --ros-args ...

As winch packages offer it: the rate of the motion sensor is fed forward, a PID holds the length, a slow tension loop
trims what both leave. The operator's tension is parameter `tension`: -p tension:=3200.0

Signs: pay-out, its rate and the speed of the sheave along the cable are positive out; an error of length is what is
still to be paid out; tension above its set-point pays out.
Sampling: one command for each sample of odometry, under its stamp, from the newest winch state and tension that are
STATE_AGE older; where these are on their way, they are waited for. D is through a filter.
Wind-up: the integrals stand still while the rate asked for is beyond MAX_RATE, and the trim has a bound of its own.
"""

import math
from collections import deque

import rclpy
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.time import Time
from sensor_msgs.msg import JointState

SHEAVE = (-36.8, 0.0, 3.7)  # m from base_link, axes of the ship
ANGLE = math.radians(78.0)  # of the departing cable from the vertical
TOW_SPEED = 2.2  # m/s, mean of the ship
KP, KI, KD, FILTER = 0.8, 0.1, 0.05, 0.1  # 1/s, 1/s^2, 1, s: of the length
KT, KTI, TRIM = 1e-4, 2e-5, 0.2  # m/s per N, m/s per N s, m/s at most: of the tension
MAX_RATE, LEAK = 2.0, 100.0  # m/s, s
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


def clip(value, maximum):
    return max(-maximum, min(maximum, value))


class PidCompensator(Node):
    def __init__(self):
        super().__init__("pid_compensator", namespace="/tow_sim")
        self.samples = deque(maxlen=500)  # (stamp, speed along the cable), not answered yet
        self.states, self.pulls = deque(maxlen=50), deque(maxlen=50)  # (stamp, pay-out), (stamp, tension)
        self.lengths = deque(maxlen=50)  # (stamp, length wanted)
        self.tension = self.declare_parameter("tension", 3200.0).value  # N
        self.begun = self.datum = self.last = None
        self.length = self.integral = self.slope = self.error = self.trim = 0.0
        self.create_subscription(Odometry, "odom", self.on_odometry, STREAM)
        self.create_subscription(JointState, "winch/state", self.on_state, STREAM)
        self.create_subscription(WrenchStamped, "sheave/tension", self.on_tension, STREAM)
        self.winch = self.create_publisher(JointState, "winch/command", 10)

    def on_odometry(self, message):
        self.samples.append((Time.from_msg(message.header.stamp).nanoseconds, speed_along(message)))
        self.answer()

    def on_state(self, message):
        at = message.name.index("payout")
        self.states.append((Time.from_msg(message.header.stamp).nanoseconds, message.position[at]))
        self.answer()

    def on_tension(self, message):
        force = message.wrench.force
        self.pulls.append((Time.from_msg(message.header.stamp).nanoseconds, math.hypot(force.x, force.y, force.z)))
        self.answer()

    def answer(self):
        """Each sample, as soon as the winch state and the tension that belong to it have come."""
        while self.samples:
            stamp, speed = self.samples[0]
            self.begun = self.begun or stamp
            seen, working = stamp - STATE_AGE * SECOND, stamp - self.begun >= REST * SECOND
            newest = min(past[-1][0] if past else 0 for past in (self.states, self.pulls))
            if working and newest <= seen - TICK * SECOND:
                return
            self.samples.popleft()
            state, pull = ([row for row in past if row[0] <= seen][-1:] for past in (self.states, self.pulls))
            rate = self.rate(stamp, speed, *state[0], pull[0][1]) if working and state and pull else 0.0
            message = JointState(name=["payout"], velocity=[rate])
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, SECOND)
            self.winch.publish(message)

    def rate(self, stamp, speed, seen, payout, tension):
        """Rate asked for, m/s, from pay-out and tension at the stamp seen."""
        h, self.last = 0.0 if self.last is None else (stamp - self.last) / SECOND, stamp
        gain = min(1.0, max(0.0, (stamp - self.begun) / SECOND - REST) / RAMP)
        self.length += h * (gain * speed - self.length / LEAK)
        self.lengths.append((stamp, self.length))
        self.datum = payout if self.datum is None else self.datum
        before, self.error = (
            self.error,
            ([x for at, x in self.lengths if at <= seen] or [0.0])[-1] - payout + self.datum,
        )
        self.slope += ((self.error - before) / h - self.slope) * h / (h + FILTER) if h else 0.0
        over = tension - self.tension
        wanted = gain * (speed + clip(KT * over + self.trim, TRIM)) + KP * self.error + self.integral + KD * self.slope
        if abs(wanted) < MAX_RATE:
            self.integral += KI * h * self.error
            self.trim = clip(self.trim + KTI * h * gain * over, TRIM)
        return clip(wanted, MAX_RATE)


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(PidCompensator())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
