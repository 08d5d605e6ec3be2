"""A drive and instruments between the node and a controller, as its own ROS 2 node, to copy: python3 winch_relay.py

    odom -> mru/odom, winch/state -> encoder/state, sheave/tension -> load_pin/tension, drive/command -> winch/command

The scene can do the same (docs/drive.md); this is for what it cannot. The controller beside it is remapped:
--ros-args -r odom:=mru/odom -r winch/state:=encoder/state -r winch/command:=drive/command

It answers every message once, with its stamp, and never looks at a clock: so a chain of such nodes repeats in lockstep
to the last bit (docs/lockstep.md). What is late is an older content under a stamp of now, as a driver stamps by
arrival; a dead time waits for the newest command and uses an older one. Subscriptions are reliable.
"""

import random
from collections import deque

import rclpy
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import JointState

BANDWIDTH, DAMPING = 6.0, 0.7  # rad/s, 1: v'' = w^2 (v_r - v) - 2 zeta w v'
MAX_RATE, MAX_ACCELERATION = 1.5, 2.0  # m/s, m/s^2
DEAD_TIME = 0.08  # s from a command to the drive
SUBSTEP = 1e-3  # s of the drive
ENCODER = 0.002  # m
LATENCY = 0.06  # s of the MRU
OFFSET, NOISE, FILTER = 40.0, 15.0, 0.02  # N, N, s of the load pin
SECOND = 1_000_000_000


def stamp_of(message):
    """Stamp of a message, ns."""
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


def clip(value, maximum):
    return max(-maximum, min(maximum, value))


class WinchRelay(Node):
    def __init__(self):
        super().__init__("winch_relay", namespace="/tow_sim")
        self.samples, self.commands = deque(maxlen=100), deque(maxlen=1000)  # (stamp, message), (stamp, rate)
        self.length, self.rate, self.acceleration = 0.0, 0.0, 0.0  # of the drive: m, m/s, m/s^2
        self.pulled = None  # (stamp, N) behind the filter of the load pin
        self.chance = random.Random(1)
        self.mru = self.create_publisher(Odometry, "mru/odom", 50)
        self.encoder = self.create_publisher(JointState, "encoder/state", 50)
        self.pin = self.create_publisher(WrenchStamped, "load_pin/tension", 50)
        self.winch = self.create_publisher(JointState, "winch/command", 50)
        self.create_subscription(Odometry, "odom", self.on_odometry, 50)
        self.create_subscription(JointState, "winch/state", self.on_state, 50)
        self.create_subscription(WrenchStamped, "sheave/tension", self.on_tension, 50)
        self.create_subscription(JointState, "drive/command", self.on_command, 50)

    def on_odometry(self, message):
        now = stamp_of(message)
        self.samples.append((now, message))
        past = [sample for stamp, sample in self.samples if stamp <= now - LATENCY * SECOND]
        older = past[-1] if past else self.samples[0][1]
        self.mru.publish(Odometry(header=message.header, pose=older.pose, twist=older.twist))

    def on_state(self, message):
        at = message.name.index("payout")
        message.position[at] = ENCODER * round(message.position[at] / ENCODER)
        self.encoder.publish(message)

    def on_tension(self, message):
        now, force = stamp_of(message), message.wrench.force
        pull = (force.x**2 + force.y**2 + force.z**2) ** 0.5 + OFFSET + self.chance.gauss(0.0, NOISE)
        if self.pulled is not None:
            then, before = self.pulled
            h = (now - then) / SECOND
            pull = before + (pull - before) * h / (h + FILTER)
        self.pulled = now, pull
        message.wrench.force.x, message.wrench.force.y, message.wrench.force.z = pull, 0.0, 0.0
        self.pin.publish(message)

    def on_command(self, message):
        """One command a tick: the mean rate of the drive until the next."""
        now = stamp_of(message)
        period = (now - self.commands[-1][0]) / SECOND if self.commands else 0.01
        self.commands.append((now, message.velocity[0]))
        wanted = [rate for stamp, rate in self.commands if stamp <= now - DEAD_TIME * SECOND]
        before = self.length
        self.drive(clip(wanted[-1] if wanted else 0.0, MAX_RATE), period)
        message.velocity[0] = (self.length - before) / period
        self.winch.publish(message)

    def drive(self, wanted, period):
        for _ in range(round(period / SUBSTEP)):
            jerk = BANDWIDTH**2 * (wanted - self.rate) - 2.0 * DAMPING * BANDWIDTH * self.acceleration
            self.acceleration = clip(self.acceleration + SUBSTEP * jerk, MAX_ACCELERATION)
            self.rate = clip(self.rate + SUBSTEP * self.acceleration, MAX_RATE)
            self.length += SUBSTEP * self.rate


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(WinchRelay())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
