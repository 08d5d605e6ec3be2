"""Simulator of an ROV in the convention of its field (NED, body axes forward-starboard-down) on a tether: pose in,
wrench out. Plain rclpy, beside the node with the scene rov_tether.

Usage: python3 rov_simulator.py [north east down] --ros-args -r __ns:=/tow_sim [-p use_sim_time:=true]
"""

import sys
from math import cos, sin

import numpy as np
import rclpy
from geometry_msgs.msg import WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node

RATE = 20.0  # Hz
MASS = 900.0  # kg, with added mass
DRAG = np.array([400.0, 600.0, 800.0])  # N s^2/m^2, forward, starboard, down
HOLD, DAMP = 200.0, 600.0  # N/m, N s/m of the station keeping
THRUST = 1500.0  # N, an axis


class Rov:
    """A point mass that keeps its station; its heading is held."""

    def __init__(self, place, heading=0.0):
        """place: north, east, down [m]; heading: from north to east [rad]."""
        self.place, self.station = np.array(place, float), np.array(place, float)
        self.velocity, self.heading = np.zeros(3), heading
        c, s = cos(heading), sin(heading)
        self.turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])  # body to NED

    def advance(self, h, cable):
        """One step of h [s] under the force of the cable [N, forward-starboard-down]."""
        own = self.turn.T @ self.velocity
        thrust = self.turn.T @ (HOLD * (self.station - self.place)) - DAMP * own
        force = np.clip(thrust, -THRUST, THRUST) - DRAG * np.abs(own) * own + cable
        self.velocity += h * (self.turn @ force) / MASS
        self.place += h * self.velocity


class RovNode(Node):
    """vehicle/wrench in, vehicle/odom out."""

    def __init__(self, place):
        super().__init__("rov_simulator")
        self.rov, self.cable, self.last = Rov(place), np.zeros(3), None
        self.pose = self.create_publisher(Odometry, "vehicle/odom", 10)
        self.create_subscription(WrenchStamped, "vehicle/wrench", self.on_wrench, 10)
        self.create_timer(1.0 / RATE, self.on_timer)

    def on_wrench(self, message):
        """Forward, to port, up -> forward, starboard, down. Its torque is about the reference point."""
        f = message.wrench.force
        self.cable = np.array([f.x, -f.y, -f.z])

    def on_timer(self):
        """Step, and send the pose in ENU, the twist in forward-port-up."""
        now = self.get_clock().now().nanoseconds
        if now == 0:  # /clock has not come
            return
        if self.last is not None and now > self.last:
            self.rov.advance((now - self.last) * 1e-9, self.cable)
        self.last = now
        (north, east, down), own = self.rov.place, self.rov.turn.T @ self.rov.velocity
        yaw = 0.5 * np.pi - self.rov.heading  # from east to north
        message = Odometry()
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 10**9)
        message.header.frame_id, message.child_frame_id = "odom", "vehicle_link"
        position, turn = message.pose.pose.position, message.pose.pose.orientation
        position.x, position.y, position.z = float(east), float(north), float(-down)
        turn.z, turn.w = sin(0.5 * yaw), cos(0.5 * yaw)
        linear = message.twist.twist.linear
        linear.x, linear.y, linear.z = float(own[0]), float(-own[1]), float(-own[2])
        self.pose.publish(message)


def main():
    """Until it is stopped."""
    rclpy.init()
    words = rclpy.utilities.remove_ros_args(sys.argv)[1:]
    node = RovNode([float(word) for word in words] or [0.0, -50.0, 32.0])
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, rclpy.executors.ExternalShutdownException):
        pass
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
