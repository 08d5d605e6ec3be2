"""Message classes by name, and publishers of the channels whose messages are installed."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import Any

from ..io.bags.typestore import BESIDE
from ..io.messages.channels import SOMETIMES, TRANSFORMS, Channel, Context, channels_of
from ..io.messages.markers import markers_channel
from ..io.messages.messages import JOINT_COMMAND, KINDS
from ..sim.scene import Scene
from .blocks import Publish
from .parts import Status


def message_class(msgtype: str) -> type:
    """Class of "package/msg/Name"; ImportError when the package is not installed."""
    package, _, name = msgtype.split("/")
    return getattr(import_module(f"{package}.msg"), name)


def inputs_there() -> tuple[dict[str, type], str]:
    """Message class of each kind of input, and why some of the winch commands are not heard, "" where all are.

    control_msgs is optional, and in older distributions without JointCommand; its bytes are read as BESIDE says.
    """
    wanted = [name for name, _ in BESIDE[JOINT_COMMAND]]
    kinds = {kind: message_class(msgtype) for kind, (msgtype, _) in KINDS.items() if msgtype != JOINT_COMMAND}
    try:
        made: Any = message_class(JOINT_COMMAND)
        fields = list(made.get_fields_and_field_types())
        why = "" if fields == wanted else f"its fields are {', '.join(fields)}, not {', '.join(wanted)}"
    except ImportError:
        why = "the package control_msgs is not installed"
    except AttributeError:
        why = "the control_msgs installed has no JointCommand, that of Kilted and newer has"
    rest = [kind for kind in KINDS if kind not in kinds]
    if not why:
        return kinds | dict.fromkeys(rest, made), ""
    names = " and ".join(KINDS[kind][1] for kind in rest)
    return kinds, f"{names} are not heard: {why}; {KINDS['command'][1]} is"


def senders(node, kinds: Iterable[str], qos: Any) -> dict[str, Any]:
    """Publishers of inputs, by kind."""
    return {kind: node.create_publisher(message_class(KINDS[kind][0]), KINDS[kind][1], qos) for kind in kinds}


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


def rows_of(scene: Scene, publish: Publish) -> tuple[Channel, ...]:
    """Channels of the node, at its rates."""
    rates = {"sheave_contact": publish.contact_rate, "cable_shape": publish.shape_rate}
    rates |= {row.name: row.rate for row in (TRANSFORMS, *(row for row, _ in SOMETIMES))}
    rows = tuple(row._replace(rate=rates.get(row.name, publish.state_rate)) for row in channels_of(scene))
    if publish.marker_rate == 0.0:
        return rows
    return (*rows, markers_channel(scene, publish.marker_rate, publish.marker_tension))


def publishers_of(node, context: Context, channels: Iterable[Channel], qos: dict) -> tuple[dict, list[str]]:
    """Absolute topic -> publisher, and a line for every channel whose message package is not installed.

    What only drawing tools need may be missing (visualization_msgs; tf2_msgs is no part of the pip wheels): it is
    recorded all the same. ImportError when any other is.
    """
    publishers, missing = {}, []
    for row in channels:
        try:
            made = message_class(row.msgtype)
        except ImportError:
            if not row.optional:
                raise
            package = row.msgtype.partition("/")[0]
            missing.append(f"{context.topic(row)} is not published: the package {package} is not installed")
            continue
        publishers[context.topic(row)] = node.create_publisher(made, row.topic, qos[row.qos])
    return publishers, missing
