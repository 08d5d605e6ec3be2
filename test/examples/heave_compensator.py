"""A heave compensator as its own ROS 2 node, to copy: python3 heave_compensator.py RATE

Beside a node in lockstep: python3 heave_compensator.py RATE --ros-args -p use_sim_time:=true

PD on the length of cable: what the sheave moves along the cable is paid out (D: its speed; P: what the winch is short
of it). Knows the ship's odometry, the winch's state and the clock, and nothing of the simulator.

It decides by stamps, never by what happens to have arrived: the step at time t takes the newest sample up to t and the
newest winch state up to t - STATE_AGE, and waits for them where they are still on their way. So in lockstep the same
motion gives the same commands to the last bit, and in real time nearly the same.
"""

import math
import sys
from collections import deque

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import JointState

SHEAVE = (-36.8, 0.0, 3.7)  # m from base_link, axes of the ship
ANGLE = math.radians(78.0)  # of the departing cable from the vertical
TOW_SPEED = 2.2  # m/s, what the mean speed begins with
MEAN_TIME, LEAK_TIME = 60.0, 100.0  # s: mean speed of the ship; length that is forgotten, so that it does not drift
KP, KD = 0.5, 1.0  # 1/s, 1
SETTLE, RAMP = 1.0, 5.0  # s with the winch at rest; s until the whole gain, where parameter `ramp` does not say
SAMPLE = 0.02  # s from one odometry to the next
STATE_AGE = 0.04  # s: the simulation is 30 ms behind its clock, and the tick of this moment is still to come
SECOND = 1_000_000_000
STREAM = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)


def stamp_of(message):
    """Stamp of a message, ns."""
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def sheave_velocity(odometry):
    """Speed of the sheave ahead and up, m/s."""
    q, v, w = odometry.pose.pose.orientation, odometry.twist.twist.linear, odometry.twist.twist.angular
    x, y, z = SHEAVE
    vx, vy, vz = v.x + w.y * z - w.z * y, v.y + w.z * x - w.x * z, v.z + w.x * y - w.y * x  # v + w x r, ship's axes
    up = 2 * (q.x * q.z - q.w * q.y) * vx + 2 * (q.y * q.z + q.w * q.x) * vy + (1 - 2 * (q.x**2 + q.y**2)) * vz
    pitch = math.asin(max(-1.0, min(1.0, 2 * (q.w * q.y - q.z * q.x))))
    roll = math.atan2(2 * (q.w * q.x + q.y * q.z), 1 - 2 * (q.x**2 + q.y**2))
    ahead = math.cos(pitch) * vx + math.sin(pitch) * (math.sin(roll) * vy + math.cos(roll) * vz)
    return ahead, up


class HeaveCompensator(Node):
    """Commands the winch RATE times a second."""

    def __init__(self, rate):
        super().__init__("heave_compensator", namespace="/tow_sim")
        self.period = round(SECOND / rate)  # ns
        self.ramp = self.declare_parameter("ramp", RAMP).value  # s
        self.samples = deque(maxlen=50)  # (stamp, speed along the cable)
        self.states = deque(maxlen=50)  # (stamp, pay-out)
        self.lengths = deque(maxlen=50)  # (stamp, length wanted), of our own steps
        self.due = self.last = self.begun = self.datum = None
        self.mean, self.length = TOW_SPEED, 0.0
        self.create_subscription(Odometry, "odom", self.on_odometry, STREAM)
        self.create_subscription(JointState, "winch/state", self.on_state, STREAM)
        self.winch = self.create_publisher(JointState, "winch/command", 10)
        self.create_timer(1.0 / rate, self.on_time)  # of the ROS clock: /clock where use_sim_time is set

    def on_odometry(self, message):
        self.samples.append((stamp_of(message), *sheave_velocity(message)))
        self.step()

    def on_state(self, message):
        self.states.append((stamp_of(message), message.position[message.name.index("payout")]))
        self.step()

    def on_time(self):
        if self.due is not None:
            self.step(late=True)  # what was waited for has not come: go on with what there is
        now = self.get_clock().now().nanoseconds
        self.due = now - now % self.period
        self.step()

    def step(self, late=False):
        """The step that is due, as soon as its sample and its state are there."""
        if self.due is None or not self.samples or self.due == self.last:
            return
        t = self.due
        ready = self.samples[-1][0] > t - SAMPLE * SECOND
        if self.begun is not None and t - self.begun > SETTLE * SECOND:
            ready = ready and self.states and self.states[-1][0] > t - STATE_AGE * SECOND - SECOND // 100
        if not (ready or late):
            return
        self.due, self.last = None, t
        self.command(t, self.rate(t))

    def rate(self, t):
        """Rate of pay-out at time t, m/s."""
        past = [sample for sample in self.samples if sample[0] <= t][-2:]
        if not past:
            return 0.0
        if self.begun is None:
            self.begun = t
        stamp, ahead, up = past[-1]
        if len(past) == 2 and stamp > past[0][0]:  # carry the sample on to t
            fraction = (t - stamp) / (stamp - past[0][0])
            ahead, up = ahead + fraction * (ahead - past[0][1]), up + fraction * (up - past[0][2])
        h = self.period / SECOND
        self.mean += (ahead - self.mean) * h / MEAN_TIME
        speed = (ahead - self.mean) * math.sin(ANGLE) + up * math.cos(ANGLE)
        gain = min(1.0, max(0.0, (t - self.begun) / SECOND - SETTLE) / self.ramp)
        self.length += h * gain * (speed - self.length / LEAK_TIME)
        self.lengths.append((t, self.length))
        then = t - STATE_AGE * SECOND
        states = [state for state in self.states if state[0] <= then]
        if gain == 0.0 or not states:
            return 0.0
        seen, payout = states[-1]
        wanted = [length for stamp, length in self.lengths if stamp <= seen] or [self.length]
        if self.datum is None:
            self.datum = payout - wanted[-1]
        return KD * gain * speed + KP * (wanted[-1] - (payout - self.datum))

    def command(self, t, rate):
        message = JointState(name=["payout"], velocity=[rate])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(t, SECOND)
        self.winch.publish(message)


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(HeaveCompensator(float(sys.argv[1])))
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
