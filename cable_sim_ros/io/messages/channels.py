"""Channels: one row per published quantity. The live topic and the recording write the same bytes from the same row.

To add one: write a function (tick output, shape table, contact table, context) -> message, a reader back, and a row in
CHANNELS. Types and conventions: REP-103, REP-105, sensor_msgs, nav_msgs, geometry_msgs.

Headers carry the simulation time exactly. Clouds are float32: 10 km from the start x has steps of 1 mm.
``sim/health`` is a JointState, because every plotting tool shows one: name = field with the component
(``body_position.x``), position = its value; no velocity, no effort. ``time`` is in the header, where it is exact.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import cache
from math import hypot, isfinite
from types import SimpleNamespace
from typing import Any

import numpy as np

from ...physics.tick_output import (
    BODY_COLUMNS,
    CONTACT_COLUMNS,
    FIELDS,
    SHAPE_COLUMNS,
    STRUM_COLUMNS,
    TICK_OUTPUT,
    body_rows,
    strum_table,
)
from ...physics.towbody import BodyModel
from ...sim.scene import Scene
from ...sim.tables.rigid_tables import flaps_of
from ...sim.tables.viv_tables import on as strumming_on
from ..bags.typestore import STORE
from .cdr import JointTemplate, cloud, cloud_table, header, header_time
from .channel import Channel, Context
from .instrument_channels import INSTRUMENTS
from .message_classes import (
    JointState,
    Odometry,
    Point,
    Pose,
    PoseStamped,
    PoseWithCovariance,
    Quaternion,
    TFMessage,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
    Wrench,
    WrenchStamped,
    serialized,
)
from .rotation import inverse, rotate

EXACT = np.zeros(36)  # covariance: a simulated pose has none
# a tick output as plain Python numbers: reading a field of a numpy record costs 1 to 5 us and there are dozens,
# unpacking all of it at once costs 5 us
_CODES = {"i8": "q", "f8": "d"}
_WORDS = struct.Struct("<" + "".join(_CODES[kind] * int(np.prod(shape)) for _, shape, kind, *_ in FIELDS))
if _WORDS.size != TICK_OUTPUT.itemsize:
    raise TypeError(
        f"TICK_OUTPUT has {TICK_OUTPUT.itemsize} bytes and its 8-byte fields {_WORDS.size}: "
        f"no channel could be written; declare every field i8 or f8"
    )


def _components(name: str, shape: tuple[int, ...]) -> list[str]:
    if not shape:
        return [name]
    axes = "xyzw" if shape[0] <= 4 else range(shape[0])
    return [f"{name}.{axis}" for axis, _ in zip(axes, range(shape[0]))]


# every number of a tick output in order: "tension", "body_position.x", ...
NAMES = tuple(part for name, shape, *_ in FIELDS for part in _components(name, shape))

PLACES = []  # field -> its place among the numbers: an index, or a slice for a vector
for _name, _shape, *_ in FIELDS:
    _first = NAMES.index(_components(_name, _shape)[0])
    PLACES.append((_name, slice(_first, _first + _shape[0]) if _shape else _first))

CLOUD, JOINT_STATE = "sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/JointState"
WRENCH = "geometry_msgs/msg/WrenchStamped"
EMPTY = np.zeros(0)
JOINTS = ("payout", "drum")
HEALTH = NAMES[1:]  # all but time
HEALTH_PLACES = [
    (name, slice(at.start - 1, at.stop - 1) if isinstance(at, slice) else at - 1) for name, at in PLACES[1:]
]


def numbers_of(frame: np.void) -> SimpleNamespace:
    """Fields of one tick output (record of dtype TICK_OUTPUT) as attributes: int, float, or tuple of floats;
    ``numbers``: all of them in order of NAMES.

    ValueError names the first field that is not finite: such a frame must not be published or recorded.
    """
    numbers = _WORDS.unpack(frame.tobytes())
    if not isfinite(sum(numbers)):  # one pass; only then look for the culprit, the sum alone may have overflowed
        for name, number in zip(NAMES, numbers):
            if not isfinite(number):
                raise ValueError(
                    f"frame field '{name}' is {number} at time {numbers[0]} ns: nothing of this tick is "
                    f"published; the tick must roll back and set NOT_FINITE instead"
                )
    return SimpleNamespace(**{name: numbers[place] for name, place in PLACES}, numbers=numbers)


def _xyz(vector) -> tuple[float, float, float]:
    return (vector.x, vector.y, vector.z)


# ---- functions of the rows


def read_winch_state(m) -> dict:
    """Back to tick output fields."""
    payout, drum = m.name.index("payout"), m.name.index("drum")
    return {
        "payout": m.position[payout],
        "payout_rate": m.velocity[payout],
        "tension_drum": m.effort[payout],
        "drum_angle": m.position[drum],
        "drum_rate": m.velocity[drum],
        "drum_torque": m.effort[drum],
    }


def towbody_pose(f, shape, contact, context: Context):
    """Pose of the towbody in odom."""
    return PoseStamped(header(f.time, context.odom), Pose(Point(*f.body_position), Quaternion(*f.body_quaternion)))


def read_towbody_pose(m) -> dict:
    """Back to tick output fields."""
    q = m.pose.orientation
    return {"body_position": _xyz(m.pose.position), "body_quaternion": (q.x, q.y, q.z, q.w)}


def towbody_odom(f, shape, contact, context: Context):
    """Pose of the towbody in odom, its velocities in towbody_link (nav_msgs/Odometry: twist in the child frame)."""
    back = inverse(f.body_quaternion)
    return Odometry(
        header(f.time, context.odom),
        context.towbody_link,
        PoseWithCovariance(Pose(Point(*f.body_position), Quaternion(*f.body_quaternion)), EXACT),
        TwistWithCovariance(Twist(Vector3(*rotate(back, f.body_velocity)), Vector3(*rotate(back, f.body_rate))), EXACT),
    )


def read_towbody_odom(m) -> dict:
    """Back to tick output fields, velocities turned to odom."""
    fields = read_towbody_pose(m.pose)
    q, twist = fields["body_quaternion"], m.twist.twist
    return fields | {"body_velocity": rotate(q, _xyz(twist.linear)), "body_rate": rotate(q, _xyz(twist.angular))}


def sheave_tension(f, shape, contact, context: Context):
    """Pull of the outboard cable on the sheave; its norm is the tension, its direction the departure angle."""
    return WrenchStamped(
        header(f.time, context.sheave_link), Wrench(Vector3(*f.tension_vector), Vector3(0.0, 0.0, 0.0))
    )


def read_sheave_tension(m) -> dict:
    """Back to tick output fields; the tension is the norm of the force."""
    force = _xyz(m.wrench.force)
    return {"tension_vector": force, "tension": hypot(*force)}


def flap_angles(f, shape, contact, context: Context):
    """Angles of the flaps as they stand, rad, trailing edge down."""
    angles = np.array([shape[row, -1] for _, row in context.flaps], float)
    return JointState(header(f.time, ""), [name for name, _ in context.flaps], angles, EMPTY, EMPTY)


def read_flap_angles(m) -> dict:
    """Angles by the name of the flap."""
    return {"flaps": dict(zip(m.name, m.position.tolist()))}


def vehicle_wrench(f, shape, contact, context: Context):
    """Force of the cable on the vehicle and its moment about the vehicle's reference point, axes of the vehicle."""
    back = inverse(f.body_quaternion)
    force, moment = rotate(back, f.vehicle_force), rotate(back, f.vehicle_moment)
    return WrenchStamped(header(f.time, context.vehicle_link), Wrench(Vector3(*force), Vector3(*moment)))


def read_sim_health(m) -> dict:
    """Back to tick output fields, by name: a recording of another version may have others or lack some."""
    values = dict(zip(m.name, m.position.tolist()))
    fields: dict = {}
    for part in HEALTH:
        if part in values:
            name = part.partition(".")[0]
            fields[name] = (*fields.get(name, ()), values[part]) if "." in part else values[part]
    return {name: int(value) if TICK_OUTPUT[name].kind == "i" else value for name, value in fields.items()}


def transforms(f, shape, contact, context: Context):
    """odom -> base_link -> sheave_link, odom -> towbody_link."""
    back = inverse(f.ship_quaternion)
    arm = rotate(back, tuple(s - b for s, b in zip(f.sheave_position, f.ship_position)))
    poses = (
        (context.odom, context.base_link, f.ship_position, f.ship_quaternion),
        (context.base_link, context.sheave_link, arm, (0.0, 0.0, 0.0, 1.0)),
        (context.odom, context.towbody_link, f.body_position, f.body_quaternion),
    )
    return TFMessage(
        [
            TransformStamped(header(f.time, parent), child, Transform(Vector3(*place), Quaternion(*turn)))
            for parent, child, place, turn in poses
        ]
    )


def _winch_template() -> Callable[..., bytes]:
    """``payout``: m, m/s, tension at the drum N. ``drum``: rad, rad/s, N m, positive hauling in."""
    joints = JointTemplate(JOINTS, arrays=3)
    return lambda f, *_: joints.write(
        f.time, f.payout, f.drum_angle, f.payout_rate, f.drum_rate, f.tension_drum, f.drum_torque
    )


def _health_template() -> Callable[..., bytes]:
    """Every field of the tick output."""
    joints = JointTemplate(HEALTH, arrays=1)
    return lambda f, *_: joints.write(*f.numbers)


def _cloud(
    field: str, topic: str, columns: tuple, rate: float, qos: str, rows: Callable, frame: str = "odom"
) -> Channel:
    """A table as a point cloud: one point a row of what ``rows`` gives; frame: of the context."""

    def write(f, shape, contact, context: Context):
        return cloud(f.time, getattr(context, frame), columns, rows(f, shape, contact, context), topic)

    def read(m) -> dict:
        return {field: cloud_table(m, columns)}

    return Channel(topic.replace("/", "_"), topic, CLOUD, write, read, rate, qos)


CHANNELS = (
    Channel("winch_state", "winch/state", JOINT_STATE, None, read_winch_state, template=_winch_template),
    Channel("towbody_pose", "towbody/pose", "geometry_msgs/msg/PoseStamped", towbody_pose, read_towbody_pose),
    Channel("towbody_odom", "towbody/odom", "nav_msgs/msg/Odometry", towbody_odom, read_towbody_odom),
    Channel("sheave_tension", "sheave/tension", WRENCH, sheave_tension, read_sheave_tension),
    _cloud(  # contact points, inboard to outboard: the filled rows of the contact table
        "contact",
        "sheave/contact",
        CONTACT_COLUMNS,
        20.0,
        "sensor",
        lambda f, shape, contact, context: contact[: f.contact_stations],
        "sheave_link",
    ),
    _cloud("shape", "cable/shape", SHAPE_COLUMNS, 10.0, "sensor", lambda f, shape, *_: shape[:, : len(SHAPE_COLUMNS)]),
    Channel("sim_health", "sim/health", JOINT_STATE, None, read_sim_health, template=_health_template),
)

# how the element that begins at each node strums
STRUM = _cloud("strum", "cable/strum", STRUM_COLUMNS, 1.0, "sensor", lambda f, shape, *_: strum_table(shape))
BODIES = _cloud(  # on the line
    "bodies",
    "cable/bodies",
    BODY_COLUMNS,
    0.0,
    "reliable",
    lambda f, shape, contact, context: body_rows(shape, context.bodies),
)
FLAPS = Channel("flap_angles", "towbody/flap_angles", JOINT_STATE, flap_angles, read_flap_angles)
VEHICLE = Channel("vehicle_wrench", "vehicle/wrench", WRENCH, vehicle_wrench, None)
TRANSFORMS = Channel(  # /tf of tools: relative, as on the global /tf the simulated ship would stand beside the real one
    "transforms", "tf", "tf2_msgs/msg/TFMessage", transforms, None, 20.0, optional=True
)


SOMETIMES: tuple[tuple[Channel, Callable[[Scene], bool]], ...] = (
    (STRUM, strumming_on),
    (BODIES, lambda scene: bool(scene.bodies)),
    (FLAPS, lambda scene: bool(flaps_of(scene))),
    (VEHICLE, lambda scene: scene.towbody.model is BodyModel.VEHICLE),
    *INSTRUMENTS,
)  # and which scenes have it
EVERY = (*CHANNELS, TRANSFORMS, *(channel for channel, _ in SOMETIMES))  # of any scene: docs/topics.md, SROS2 policy


def channels_of(scene: Scene) -> tuple[Channel, ...]:
    """Channels that a scene has."""
    some = (channel for channel, has in SOMETIMES if has(scene))
    return (*CHANNELS[:-1], *some, TRANSFORMS, CHANNELS[-1])


class Encoder:
    """All channels of a tick, each at its rate. One per thread.

    context: names; tick_s: length of a tick [s]; channels: rows to write.
    """

    def __init__(self, context: Context, tick_s: float, channels: tuple[Channel, ...] = CHANNELS) -> None:
        self.context = context
        self._rows = [(c, context.topic(c), c.every(tick_s), c.template() if c.template else None) for c in channels]

    def declare(self, recording) -> None:
        """Register all topics with a `BagWriter` or `Recorder`, so that the bag has them in order and with QoS."""
        for channel, topic, *_ in self._rows:
            recording.declare(topic, channel.msgtype, channel.qos)

    def encode(
        self, frame, shape, contact, wanted: Callable[[str], bool] = lambda topic: True
    ) -> list[tuple[Channel, str, bytes]]:
        """Messages due at this tick as (channel, absolute topic, CDR bytes); ``frame.tick`` says which are due.

        wanted: is there anybody for a topic? ValueError names a number that is not finite, of whatever topic; then
        nothing of the tick is to be published.
        """
        f, due = numbers_of(frame), []
        for channel, topic, every, template in self._rows:
            if f.tick % every or (channel.new and not f.readings_new & channel.new) or not wanted(topic):
                continue
            if template is not None:
                data = template(f, shape, contact, self.context)
            else:
                assert channel.write is not None, f"{channel.name} has neither a message nor a template"
                data = serialized(channel.write(f, shape, contact, self.context))
            due.append((channel, topic, data))
        return due


@cache
def channel_of(topic: str, msgtype: str | None = None) -> Channel | None:
    """The channel a topic belongs to in whatever namespace, None if to none."""
    for channel in (*CHANNELS, *(channel for channel, _ in SOMETIMES)):
        if (topic == channel.topic or topic.endswith(f"/{channel.topic}")) and msgtype in (None, channel.msgtype):
            return channel
    return None


_HEALTH_READER = JointTemplate(HEALTH, arrays=1)


def decode(channel: Channel, data: bytes) -> dict:
    """CDR bytes -> dict of the fields the channel carries, ``time`` [ns] first; tables as float64 arrays."""
    message: Any = STORE.deserialize_cdr(data, channel.msgtype)
    assert channel.read is not None, f"{channel.name} is not read back"
    return {"time": header_time(message.header), **channel.read(message)}


def decode_frames(messages: list[bytes]) -> np.recarray:
    """Messages of ``sim/health`` in order -> recarray of TICK_OUTPUT [messages], bit by bit those written. Fields that
    the recording lacks are NaN, or 0 for integers."""
    frames = np.zeros(len(messages), TICK_OUTPUT)
    read = [_HEALTH_READER.read(data) for data in messages]
    ours = {k: numbers for k, numbers in enumerate(read) if numbers is not None}
    if ours:  # the names are ours: all frames at once, 40 times quicker than the general way
        rows = list(ours)
        frames["time"][rows] = [time for time, _ in ours.values()]
        values = np.array([numbers for _, numbers in ours.values()])
        for name, place in HEALTH_PLACES:
            frames[name][rows] = values[:, place]
    for k in (k for k in range(len(read)) if k not in ours):
        fields = decode(CHANNELS[-1], messages[k])
        for name in TICK_OUTPUT.names or ():
            frames[name][k] = fields.get(name, np.nan if TICK_OUTPUT[name].base.kind == "f" else 0)
    return frames.view(np.recarray)
