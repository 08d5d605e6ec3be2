"""What an ensemble says beside a node: band, towbody, look-ahead, and its state in /diagnostics."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState, PointCloud2, PointField

from ...ros.client import Client
from ...ros.status import Status
from ...ros.topics import diagnostic_array

BAND, TOWBODY, AHEAD = "ensemble/band", "ensemble/towbody", "ensemble/ahead"
NODE = "cable_sim_ensemble"
DEPTH = 10


class Voice:
    """Publishers of an ensemble, all reliable, of depth DEPTH."""

    def __init__(self, client: Client, namespace: str, odom: str) -> None:
        """odom: name of the frame."""
        made = client.node.create_publisher
        profile = QoSProfile(depth=DEPTH)
        self.odom = odom
        self._band = made(JointState, f"{namespace}/{BAND}", profile)
        self._towbody = made(PoseWithCovarianceStamped, f"{namespace}/{TOWBODY}", profile)
        self._ahead = made(PointCloud2, f"{namespace}/{AHEAD}", profile)
        self._diagnostics = made(DiagnosticArray, "/diagnostics", profile)

    def band(self, time_ns: int, names: Sequence[str], values: Sequence[float]) -> None:
        """Ends and middle of the band, and the state of the ensemble, by name."""
        message = JointState(name=list(names), position=[float(value) for value in values])
        _stamp(message, time_ns)
        self._band.publish(message)

    def towbody(self, time_ns: int, places: np.ndarray) -> None:
        """Mean and covariance of the towbody's places [copies, 3] in odom."""
        message: Any = PoseWithCovarianceStamped()
        _stamp(message, time_ns, self.odom)
        where = message.pose.pose.position
        where.x, where.y, where.z = places.mean(axis=0).tolist()
        message.pose.pose.orientation.w = 1.0
        covariance = np.zeros((6, 6))
        covariance[:3, :3] = np.cov(places.T)
        message.pose.covariance = covariance.ravel().tolist()
        self._towbody.publish(message)

    def ahead(self, time_ns: int, names: Sequence[str], table: np.ndarray) -> None:
        """Rows of a look-ahead that begins at time_ns; names of the columns [rows, names]."""
        data = np.ascontiguousarray(table, "<f4")
        message = PointCloud2(height=1, width=len(data), is_dense=True, point_step=4 * len(names))
        message.fields = [
            PointField(name=name, offset=4 * k, datatype=PointField.FLOAT32, count=1) for k, name in enumerate(names)
        ]
        message.row_step = message.point_step * message.width
        message.data = data.tobytes()
        _stamp(message, time_ns, self.odom)
        self._ahead.publish(message)

    def say(self, status: Status, stamp: int) -> None:
        """The state of the ensemble into /diagnostics; stamp: ns."""
        self._diagnostics.publish(diagnostic_array(NODE, [status], stamp))


def _stamp(message: Any, time_ns: int, frame: str = "") -> None:
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(time_ns, 1_000_000_000)
    message.header.frame_id = frame
