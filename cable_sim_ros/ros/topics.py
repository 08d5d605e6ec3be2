"""Message classes by name, and transforms where tf2_msgs is installed (it is no part of the pip wheels)."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import import_module

from ..io.channels import Context
from ..sim.scene import Scene
from .status import Status


def message_class(msgtype: str) -> type:
    """Class of "package/msg/Name"; ImportError when the package is not installed."""
    package, _, name = msgtype.split("/")
    return getattr(import_module(f"{package}.msg"), name)


def diagnostic_array(node: str, statuses: Iterable[Status], stamp: int):
    """Statuses of a node as a diagnostic_msgs/DiagnosticArray; stamp: ns."""
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

    array = DiagnosticArray()
    array.header.stamp.sec, array.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
    for status in statuses:
        array.status.append(
            DiagnosticStatus(
                level=bytes([status.level]),
                name=f"{node}: {status.name}",
                message=status.message,
                hardware_id="cable_sim_ros",
                values=[KeyValue(key=key, value=text) for key, text in status.values.items()],
            )
        )
    return array


def transform_publisher(node, context: Context, scene: Scene) -> Callable | None:
    """Function that publishes the transforms of a Frame on the relative topic `tf`, or None without tf2_msgs.

    Relative like all other topics: on the global /tf the simulated base_link would stand beside the ship's own.
    """
    try:
        from tf2_msgs.msg import TFMessage
    except ImportError:
        return None
    from geometry_msgs.msg import TransformStamped

    publisher = node.create_publisher(TFMessage, "tf", 10)
    message = TFMessage(transforms=[TransformStamped() for _ in range(3)])
    ship, sheave, body = message.transforms
    ship.header.frame_id, ship.child_frame_id = context.odom, context.base_link
    sheave.header.frame_id, sheave.child_frame_id = context.base_link, context.sheave_link
    body.header.frame_id, body.child_frame_id = context.odom, context.towbody_link

    def publish(frame) -> None:
        poses = (
            (ship, frame["ship_position"], frame["ship_quaternion"]),
            (sheave, scene.sheave.position, (0.0, 0.0, 0.0, 1.0)),
            (body, frame["body_position"], frame["body_quaternion"]),
        )
        for item, position, quaternion in poses:
            item.header.stamp.sec, item.header.stamp.nanosec = divmod(int(frame["time"]), 1_000_000_000)
            place, turn = item.transform.translation, item.transform.rotation
            place.x, place.y, place.z = map(float, position)
            turn.x, turn.y, turn.z, turn.w = map(float, quaternion)
        publisher.publish(message)

    return publish
