"""A winch controller by instruments as a ROS 2 node, to copy: python3 instrument_controller.py

It answers each reading of the MRU, under its stamp: what heaves up is paid out, and what the encoder is short of that
length is made good. Where the newest encoder reading is older than LOST it goes by the MRU alone; a MRU that is lost
is answered by nothing, and the winch stops by winch.command_timeout.
"""

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import JointState

ALONG = 0.21  # cosine of the departing cable from the vertical: of 1 m of heave so much is along it
KP, LEAK = 0.5, 100.0  # 1/s, s
LATE = 0.02  # s: of the encoder the newest reading up to so long before the MRU's counts, whichever came first
LOST = 0.2  # s
SECOND = 1_000_000_000


def stamp_of(message):
    """Stamp of a message, ns."""
    return message.header.stamp.sec * SECOND + message.header.stamp.nanosec


class InstrumentController(Node):
    def __init__(self):
        super().__init__("instrument_controller", namespace="/tow_sim")
        self.readings = []  # of the encoder: (stamp, pay-out)
        self.last = self.datum = None
        self.length, self.lost = 0.0, False
        self.create_subscription(Odometry, "instruments/mru", self.on_mru, 50)
        self.create_subscription(JointState, "instruments/encoder", self.on_encoder, 50)
        self.winch = self.create_publisher(JointState, "winch/command", 50)

    def on_encoder(self, message):
        self.readings = [*self.readings[-20:], (stamp_of(message), message.position[0])]

    def on_mru(self, message):
        stamp = stamp_of(message)
        rate = ALONG * message.twist.twist.linear.z
        h = 0.0 if self.last is None else (stamp - self.last) / SECOND
        self.last = stamp
        self.length += h * (rate - self.length / LEAK)
        past = [reading for reading in self.readings if reading[0] <= stamp - LATE * SECOND]
        fresh = past and stamp - past[-1][0] <= LOST * SECOND
        if fresh:
            self.datum = past[-1][1] - self.length if self.datum is None else self.datum
            rate += KP * (self.datum + self.length - past[-1][1])
        elif self.datum is not None and not self.lost:
            self.lost = True
            self.get_logger().error("the encoder is lost: going on by the MRU alone")
        answer = JointState(name=["payout"], velocity=[rate])
        answer.header.stamp = message.header.stamp
        self.winch.publish(answer)


if __name__ == "__main__":
    rclpy.init()
    try:
        rclpy.spin(InstrumentController())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
