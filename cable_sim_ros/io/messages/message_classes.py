"""Message classes that channels are written with."""

from __future__ import annotations

from .cdr import store_type

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
JointState = store_type("sensor_msgs/msg/JointState")
Transform = store_type("geometry_msgs/msg/Transform")
TransformStamped = store_type("geometry_msgs/msg/TransformStamped")
PointStamped = store_type("geometry_msgs/msg/PointStamped")
TFMessage = store_type("tf2_msgs/msg/TFMessage")
