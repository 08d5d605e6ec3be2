"""Channels of the instruments aboard: what they show, beside the truth, a message for each reading.

The header has the time at which a reading came out, not that of what it shows: an instrument does not know its latency.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, sin

import numpy as np

from ...physics.sensor_models import ALTIMETER, DEPTH, DEVICES, ENCODER, FISH, LOAD_PIN, METERING, MRU, USBL
from ...sim.scene import Scene
from ...sim.tables.attitude import angles_of
from .cdr import JointTemplate, header
from .channel import Channel
from .message_classes import (
    Imu,
    Odometry,
    Point,
    PointStamped,
    Pose,
    PoseWithCovariance,
    Quaternion,
    Twist,
    TwistWithCovariance,
    Vector3,
    Wrench,
    WrenchStamped,
)
from .rotation import inverse, rotate

UNKNOWN = np.zeros(36)  # covariance
NOT_GIVEN = np.array([-1.0, *np.zeros(8)])  # covariance of what a message has not
MRU_LINK = "mru_link"


def mru(f, shape, contact, context):
    """Surge, sway, heave as position, roll and pitch as attitude without heading; their rates in base_link, as
    nav_msgs/Odometry has its twist, without the ship's mean velocity, as the fields; the rate of the heading, which no
    device shows, is left out."""
    hr, hp = 0.5 * f.mru_roll, 0.5 * f.mru_pitch
    turn = (sin(hr) * cos(hp), cos(hr) * sin(hp), -sin(hr) * sin(hp), cos(hr) * cos(hp))
    speed = rotate(inverse(turn), (f.mru_surge_rate, f.mru_sway_rate, f.mru_heave_rate))
    rates = (f.mru_roll_rate, f.mru_pitch_rate * cos(f.mru_roll), -f.mru_pitch_rate * sin(f.mru_roll))
    return Odometry(
        header(f.time, MRU_LINK),
        context.base_link,
        PoseWithCovariance(Pose(Point(f.mru_surge, f.mru_sway, f.mru_heave), Quaternion(*turn)), UNKNOWN),
        TwistWithCovariance(Twist(Vector3(*speed), Vector3(*rates)), UNKNOWN),
    )


def read_mru(m) -> dict:
    """Back to tick output fields."""
    p, q, twist = m.pose.pose.position, m.pose.pose.orientation, m.twist.twist
    roll, pitch, _ = angles_of(q.x, q.y, q.z, q.w)
    surge, sway, heave = rotate((q.x, q.y, q.z, q.w), (twist.linear.x, twist.linear.y, twist.linear.z))
    return {
        "mru_surge": p.x,
        "mru_sway": p.y,
        "mru_heave": p.z,
        "mru_surge_rate": surge,
        "mru_sway_rate": sway,
        "mru_heave_rate": heave,
        "mru_roll": roll,
        "mru_pitch": pitch,
        "mru_roll_rate": twist.angular.x,
        "mru_pitch_rate": twist.angular.y * cos(roll) - twist.angular.z * sin(roll),
    }


def _joint(payout: str, rate: str) -> tuple[None, Callable, Callable]:
    """Joint payout: m, m/s."""

    def read(m) -> dict:
        """Back to tick output fields."""
        return {payout: m.position[0], rate: m.velocity[0]}

    def template() -> Callable[..., bytes]:
        joints = JointTemplate(("payout",), arrays=2)
        return lambda f, *_: joints.write(f.time, getattr(f, payout), getattr(f, rate))

    return None, read, template


def load_pin(f, shape, contact, context):
    """Force x: what is on the pin in its direction, N; z: the tension that is taken from it, N."""
    return WrenchStamped(
        header(f.time, context.sheave_link),
        Wrench(Vector3(f.load_pin, 0.0, f.load_pin_tension), Vector3(0.0, 0.0, 0.0)),
    )


def read_load_pin(m) -> dict:
    """Back to tick output fields."""
    return {"load_pin": m.wrench.force.x, "load_pin_tension": m.wrench.force.z}


def usbl(f, shape, contact, context):
    """Fix of the towbody in odom, m."""
    return PointStamped(header(f.time, context.odom), Point(*f.usbl_position))


def read_usbl(m) -> dict:
    """Back to tick output fields."""
    return {"usbl_position": (m.point.x, m.point.y, m.point.z)}


def _height(field: str, frame: str, sign: float) -> tuple[Callable, Callable]:
    """A depth or an altitude as z in a frame of the context, m up."""

    def write(f, shape, contact, context):
        return PointStamped(header(f.time, getattr(context, frame)), Point(0.0, 0.0, sign * getattr(f, field)))

    def read(m) -> dict:
        """Back to tick output fields."""
        return {field: sign * m.point.z}

    return write, read


def fish_attitude(f, shape, contact, context):
    """Attitude of the towbody in odom; no rates, no accelerations (REP-145: -1)."""
    hr, hp, hy = 0.5 * f.fish_roll, 0.5 * f.fish_pitch, 0.5 * f.fish_heading
    level = (sin(hr) * cos(hp), cos(hr) * sin(hp), -sin(hr) * sin(hp), cos(hr) * cos(hp))
    x, y, z, w = level
    c, s = cos(hy), sin(hy)
    turn = Quaternion(c * x - s * y, c * y + s * x, c * z + s * w, c * w - s * z)
    none = Vector3(0.0, 0.0, 0.0)
    return Imu(header(f.time, context.towbody_link), turn, np.zeros(9), none, NOT_GIVEN, none, NOT_GIVEN)


def read_fish_attitude(m) -> dict:
    """Back to tick output fields."""
    q = m.orientation
    return dict(zip(("fish_roll", "fish_pitch", "fish_heading"), angles_of(q.x, q.y, q.z, q.w)))


def _row(
    device: int, topic: str, msgtype: str, write: Callable | None, read: Callable, template: Callable | None = None
) -> tuple[Channel, Callable[[Scene], bool]]:
    """The channel of an instrument, on a topic of instruments/, and which scenes have it."""
    name, topic = DEVICES[device], f"instruments/{topic}"
    channel = Channel(f"instrument_{name}", topic, msgtype, write, read, template=template, new=1 << device)
    return channel, lambda scene: getattr(scene.instruments, name).on


INSTRUMENTS = (
    _row(MRU, "mru", "nav_msgs/msg/Odometry", mru, read_mru),
    _row(ENCODER, "encoder", "sensor_msgs/msg/JointState", *_joint("encoder_payout", "encoder_rate")),
    _row(METERING, "metering_sheave", "sensor_msgs/msg/JointState", *_joint("metering_payout", "metering_rate")),
    _row(LOAD_PIN, "load_pin", "geometry_msgs/msg/WrenchStamped", load_pin, read_load_pin),
    _row(USBL, "usbl", "geometry_msgs/msg/PointStamped", usbl, read_usbl),
    # of the towbody, below the mean water surface and above the seabed
    _row(DEPTH, "depth", "geometry_msgs/msg/PointStamped", *_height("depth_reading", "odom", -1.0)),
    _row(FISH, "fish_attitude", "sensor_msgs/msg/Imu", fish_attitude, read_fish_attitude),
    _row(ALTIMETER, "altimeter", "geometry_msgs/msg/PointStamped", *_height("altitude_reading", "towbody_link", 1.0)),
)
