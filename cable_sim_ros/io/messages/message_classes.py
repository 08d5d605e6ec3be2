"""Message classes that channels and motion are written with, and a ship's motion in them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..bags.typestore import STORE
from .cdr import header, store_type

Point = store_type("geometry_msgs/msg/Point")
Quaternion = store_type("geometry_msgs/msg/Quaternion")
Vector3 = store_type("geometry_msgs/msg/Vector3")
Pose = store_type("geometry_msgs/msg/Pose")
PoseStamped = store_type("geometry_msgs/msg/PoseStamped")
PoseWithCovariance = store_type("geometry_msgs/msg/PoseWithCovariance")
Twist = store_type("geometry_msgs/msg/Twist")
TwistWithCovariance = store_type("geometry_msgs/msg/TwistWithCovariance")
Wrench = store_type("geometry_msgs/msg/Wrench")
WrenchStamped = store_type("geometry_msgs/msg/WrenchStamped")
Odometry = store_type("nav_msgs/msg/Odometry")
Imu = store_type("sensor_msgs/msg/Imu")
JointState = store_type("sensor_msgs/msg/JointState")
Transform = store_type("geometry_msgs/msg/Transform")
TransformStamped = store_type("geometry_msgs/msg/TransformStamped")
PointStamped = store_type("geometry_msgs/msg/PointStamped")
TFMessage = store_type("tf2_msgs/msg/TFMessage")
UNKNOWN9, UNKNOWN36 = np.zeros(9), np.zeros(36)  # covariances: zero is REP-145 for not known


def serialized(message: Any) -> bytes:
    """CDR bytes of a message."""
    return bytes(STORE.serialize_cdr(message, message.__msgtype__))


def imu_bytes(time: int, turn: Sequence[float], rate: Sequence[float], force: Sequence[float]) -> bytes:
    """An Imu of base_link: stamp [ns], quaternion x y z w, angular rate [rad/s], specific force [m/s^2]."""
    turned, turning, pushed = Quaternion(*turn), Vector3(*rate), Vector3(*force)
    return serialized(Imu(header(time, "base_link"), turned, UNKNOWN9, turning, UNKNOWN9, pushed, UNKNOWN9))


def odometry_bytes(
    time: int, place: Sequence[float], turn: Sequence[float], velocity: Sequence[float], rate: Sequence[float]
) -> bytes:
    """Odometry of base_link in odom: stamp [ns], place [m], quaternion x y z w; velocity [m/s] and angular rate
    [rad/s] along the ship's axes."""
    pose = PoseWithCovariance(Pose(Point(*place), Quaternion(*turn)), UNKNOWN36)
    twist = TwistWithCovariance(Twist(Vector3(*velocity), Vector3(*rate)), UNKNOWN36)
    return serialized(Odometry(header(time, "odom"), "base_link", pose, twist))
