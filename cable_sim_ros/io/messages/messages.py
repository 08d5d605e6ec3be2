"""Input messages: CDR bytes of sensor_msgs/Imu, nav_msgs/Odometry and of winch commands -> checked numbers.

Read with `struct` at fixed places after the strings, and checked on the way: whatever leaves here is finite, has a
unit quaternion in ENU axes, and is what a ship can do, or is what a winch may be commanded. Live topics and bags give
the same bytes, so both are read by the same decoder. Source: OMG DDSI-RTPS 10 (plain CDR), REP-103, REP-145.
io/sources/recorded_tow.py reads the bytes from a bag of any kind.
"""

from __future__ import annotations

from math import degrees, isfinite, isinf, isnan, nan, pi, sqrt
from struct import Struct
from typing import Any, NamedTuple

from ...physics.heave_filter import Convention
from ...sim.inputs import MAX_COMMAND, MAX_FLAP, MAX_PITCH, MAX_POSITION, MAX_RATE, MAX_SPEED, NORM_WITHIN
from ...sim.tables.attitude import angles_of, to_world
from ..bags.bag_writer import BagError
from .fault_hypotheses import DOUBTS
from .mounting import Mounting, Rotor

MAX_FORCE = 50.0  # m/s^2
MAX_BYTES = 65536  # of a message of motion or a command; they have some hundred
JOINT = "payout"  # of a winch command
DRUM = "drum"  # the other joint of winch/state; it takes no commands
INTERFACES = ("position", "velocity", "effort")  # of a JointCommand; effort is refused by a cause of its own

# the one vocabulary of refusals, live and replayed: cause -> what to say ("" = an event, nothing was refused)
CAUSES = {
    "size": f"the bytes are not a message of this type, or more than {MAX_BYTES}: dropped; check type and sender of "
    "the topic",
    "encoding": "the bytes are not plain CDR: dropped; use a driver or bag with CDR messages",
    "not_finite": "a number is NaN or infinite (in a winch command: infinite): dropped; check the sender",
    "quaternion": "the orientation is not a unit quaternion: dropped; check the driver",
    "no_orientation": "orientation_covariance[0] is -1, so there is no attitude, and none is estimated here: dropped; "
    "use a sensor with attitude, or odometry",
    "out_of_range": "a number is beyond what a ship does "
    f"({MAX_FORCE:g} m/s^2, {MAX_RATE:g} rad/s, {MAX_SPEED:g} m/s, {degrees(MAX_PITCH):g} deg pitch, "
    f"{MAX_POSITION:g} m), a winch is commanded ({MAX_COMMAND:g} m or m/s) or a flap ({MAX_FLAP:.3g} rad): dropped; "
    "check sender and units, and "
    "heave.imu_rotation_deg of an IMU whose axes are not the ship's",
    "height": "odometry z is further from ship.reference_height than heave.max_displacement: dropped; z must be the "
    "height of base_link above the mean water surface",
    "no_stamp": "the stamp is zero: dropped; if it stays zero, arrival times are used",
    "stamp_not_advancing": "the stamp does not advance: dropped",
    "stamp_backwards": "the stamp went back by more than 1 s: dropped; after a restart of the sender's clock, reset",
    "stamp_off_clock": "the stamp is more than 1 s off the clock of the motion: dropped; check the sender's clock "
    "(five such stamps that agree are a jump of the clock, which is followed)",
    **DOUBTS,
    "behind": "the stamp is behind the other source's newest: dropped",
    "before_motion": "no motion has come before it, so its time on the clock of the motion is not known: dropped; send "
    "it again once there is motion",
    "step_past": "in lockstep: its stamp is more than 1 s behind /clock, or behind a command already taken: dropped; "
    "stamp a command with the /clock that it answers",
    "step_future": "in lockstep: its stamp is ahead of /clock: dropped; stamp a command with the /clock that it "
    "answers",
    "step_twice": "in lockstep: a command with this stamp has been taken: dropped; send one command a step",
    "held_full": "in lockstep: too many messages wait for /clock to come to their stamps: dropped; send motion as "
    "/clock goes on",
    "joint_name": f"the joint '{JOINT}' is not named exactly once: dropped; other joints may stand beside it",
    "array_length": "position, velocity or values has some entries, but not one for each joint that is named, so it "
    f"cannot be known which is that of '{JOINT}' (only '{DRUM}', which takes no commands, may go without in a "
    "JointState): dropped; give NaN for what is not commanded, in ros2_control give the winch a system of its own",
    "interface": f"interface_name of the JointCommand is none of {', '.join(INTERFACES)}: dropped; name the one that "
    "its values are of",
    "flap_name": "a name is that of no flap of this tow, or stands twice: dropped; give names of wings with a "
    "flap_share, of a body on the line BODY/WING",
    "flap_array": "position has some entries, but not one for each flap that is named: dropped; give NaN for what is "
    "not commanded",
    "effort_only": f"of the joint '{JOINT}' only effort is a number, and the winch takes none: dropped; command "
    "position [m] or velocity [m/s]",
    "imu_gap": "",
    "gap": "",
    "source_change": "",
    "no_vehicle": "the scene has no vehicle at the far end of its cable: dropped; give it towbody.model: vehicle",
    "too_fast": "the vehicle is faster than vehicle.max_speed: dropped; check unit and axes of its twist, or give a "
    "larger vehicle.max_speed",
    "position_jump": "",
    "heave_diverged": "",
}


class Refused(ValueError):
    """A message that is not used; cause is a key of CAUSES."""

    def __init__(self, cause: str) -> None:
        super().__init__(CAUSES[cause])
        self.cause = cause


class Imu(NamedTuple):
    stamp: int  # ns
    angles: tuple[float, float, float]  # roll pitch yaw, rad, of Rz Ry Rx in ENU
    rate: tuple[float, float, float]  # rad/s in base_link
    force: tuple[float, float, float]  # m/s^2 in base_link, +g upwards at rest
    norm: float = 1.0  # of the quaternion as it was sent
    frames: tuple[bytes, ...] = ()  # header.frame_id


class Odometry(NamedTuple):
    stamp: int  # ns
    position: tuple[float, float, float]  # m, ENU
    angles: tuple[float, float, float]  # roll pitch yaw, rad
    velocity: tuple[float, float, float]  # m/s in base_link
    rate: tuple[float, float, float]  # rad/s in base_link
    twist: bool  # False: the message has none (six exact zeros)
    norm: float = 1.0  # of the quaternion as it was sent
    frames: tuple[bytes, ...] = ()  # header.frame_id, child_frame_id


class Command(NamedTuple):
    stamp: int  # ns; 0: none
    payout: float  # m, positive out; NaN: not commanded
    rate: float  # m/s, positive out; NaN: not commanded

    @property
    def is_none(self) -> bool:
        """Does it command nothing? So does every message of ros2_control while no controller is active."""
        return isnan(self.payout) and isnan(self.rate)


_STAMP = {order: Struct(order + "iI") for order in "<>"}
_HEADER = {order: Struct(order + "iII") for order in "<>"}  # sec, nanosec, length of frame_id
_LENGTH = {order: Struct(order + "I") for order in "<>"}
_IMU = {order: Struct(order + "37d") for order in "<>"}
_ODOMETRY = {order: Struct(order + "85d") for order in "<>"}
_POSE = {order: Struct(order + "7d") for order in "<>"}


class Event(NamedTuple):
    """One input message: stamp of its header and time of arrival [ns], kind (of KINDS), CDR bytes.

    stamp: read once, where the message comes in; 0: there is none, None: the bytes are too short for one.
    """

    stamp: int | None
    arrival: int
    kind: str
    data: bytes

    @property
    def is_command(self) -> bool:
        """Is it for winch or flaps, and no motion?"""
        return self.kind in COMMANDED

    @property
    def is_motion(self) -> bool:
        """Is it motion of the ship?"""
        return self.kind in SHIPS

    @property
    def time(self) -> int:
        """The stamp, or the arrival of a message without one, ns."""
        return self.stamp or self.arrival

    def moved(self, shift: int) -> Event:
        """The message with its stamp moved by shift [ns]."""
        stamp, data = (self.stamp or 0) + shift, bytearray(self.data)
        _STAMP["<" if data[1] & 1 else ">"].pack_into(data, 4, *divmod(stamp, 10**9))
        return self._replace(stamp=stamp, data=bytes(data))


def stamp_of(data: bytes) -> int | None:
    """Stamp [ns] of a CDR message that begins with a std_msgs/Header; None when it is too short."""
    if len(data) < 12:
        return None
    sec, nanosec = _STAMP["<" if data[1] & 1 else ">"].unpack_from(data, 4)
    return sec * 10**9 + nanosec


def _order(data: bytes) -> str:
    """Byte order of a message that has room for a header; Refused for other bytes."""
    if not 16 <= len(data) <= MAX_BYTES:
        raise Refused("size")
    if data[0] != 0 or data[1] not in (0, 1):
        raise Refused("encoding")
    return "<" if data[1] else ">"


def _open(data: bytes, strings: int, body: dict[str, Struct]) -> tuple[int, Any, tuple[bytes, ...]]:
    """Stamp [ns], doubles and strings of a message that is a header, `strings` - 1 more strings, and doubles."""
    order = _order(data)
    sec, nanosec, length = _HEADER[order].unpack_from(data, 4)
    at = 16 + length
    names = [data[16:at]]
    for _ in range(strings - 1):
        at += -at % 4
        if at + 4 > len(data):
            raise Refused("size")
        begin = at + 4
        at = begin + _LENGTH[order].unpack_from(data, at)[0]
        names.append(data[begin:at])
    at += (4 - at) % 8  # doubles are aligned from the fourth byte on
    if len(data) != at + body[order].size:
        raise Refused("size")
    if sec < 0 or nanosec >= 10**9:
        raise Refused("out_of_range")
    return sec * 10**9 + nanosec, body[order].unpack_from(data, at), tuple(names)


def _unit(quaternion: Rotor) -> tuple[Rotor, float]:
    """The quaternion at norm 1, and the norm it had."""
    _check(quaternion, 2.0)
    x, y, z, w = quaternion
    norm = sqrt(x * x + y * y + z * z + w * w)
    if abs(norm - 1.0) > NORM_WITHIN:
        raise Refused("quaternion")
    return (x / norm, y / norm, z / norm, w / norm), norm


def _angles(rotor: Rotor) -> tuple[float, float, float]:
    angles = angles_of(*rotor)
    if abs(angles[1]) > MAX_PITCH:
        raise Refused("out_of_range")
    return angles


def _check(values, maximum: float) -> None:
    for value in values:
        if not isfinite(value):
            raise Refused("not_finite")
        if abs(value) > maximum:
            raise Refused("out_of_range")


# ned -> enu: R_enu = Rz(90 deg) S R_ned S with S = diag(1, -1, -1), which leaves roll and turns pitch and yaw round
def _world_angles(angles):
    return angles[0], -angles[1], (1.5 * pi - angles[2]) % (2.0 * pi) - pi


def _body(vector):
    return vector[0], -vector[1], -vector[2]


def decode_imu(
    data: bytes, convention: Convention = Convention.ENU, mounting: Mounting | None = None, force_reversed: bool = False
) -> Imu:
    """Checked numbers of a sensor_msgs/Imu, in base_link where the mounting is that of the sensor.

    Refused if it cannot be used. Covariances but the first are not read. force_reversed: it has minus the force."""
    stamp, d, frames = _open(data, 1, _IMU)
    if d[4] == -1.0:
        raise Refused("no_orientation")
    rate, force = d[13:16], d[25:28]
    rotor, norm = _unit(d[:4])
    _check(rate, MAX_RATE)
    _check(force, MAX_FORCE)
    force = (-force[0], -force[1], -force[2]) if force_reversed else force
    ned = convention is Convention.NED
    if ned:
        rate, force = _body(rate), _body(force)
    if mounting is None:
        angles = _angles(rotor)
        return Imu(stamp, _world_angles(angles) if ned else angles, rate, force, norm, frames)
    rate, force = to_world(mounting.angles, rate), to_world(mounting.angles, force)
    return Imu(stamp, _angles(mounting.of_ship(rotor, ned)), rate, force, norm, frames)


def decode_odometry(data: bytes, convention: Convention = Convention.ENU) -> Odometry:
    """Checked numbers of a nav_msgs/Odometry; Refused if it cannot be used. Covariances are not read."""
    stamp, d, frames = _open(data, 2, _ODOMETRY)
    position, velocity, rate = d[:3], d[43:46], d[46:49]
    _check(position, MAX_POSITION)
    rotor, norm = _unit(d[3:7])
    angles = _angles(rotor)
    _check(velocity, MAX_SPEED)
    _check(rate, MAX_RATE)
    if convention is Convention.NED:
        position = position[1], position[0], -position[2]
        angles, rate, velocity = _world_angles(angles), _body(rate), _body(velocity)
    return Odometry(stamp, position, angles, velocity, rate, any(velocity) or any(rate), norm, frames)


def decode_pose(data: bytes, convention: Convention = Convention.ENU) -> Odometry:
    """Checked numbers of a geometry_msgs/PoseStamped, as odometry without twist; Refused if it cannot be used."""
    stamp, d, frames = _open(data, 1, _POSE)
    _check(d[:3], MAX_POSITION)
    rotor, norm = _unit(d[3:])
    position, angles = d[:3], _angles(rotor)
    if convention is Convention.NED:
        position, angles = (position[1], position[0], -position[2]), _world_angles(angles)
    return Odometry(stamp, position, angles, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), False, norm, frames)


class _Joints:
    """A message of joints: their names, then its strings and sequences of doubles, one after another; Refused where
    they leave the bytes."""

    def __init__(self, data: bytes) -> None:
        self.data, self.order, self.at = data, _order(data), 12
        self.string()  # frame_id
        self.names = [self.string() for _ in range(self.count())]

    def _next(self, size: int) -> int:
        """Where the next `size` bytes begin; goes past them."""
        at, self.at = self.at, self.at + size
        if self.at > len(self.data):
            raise Refused("size")
        return at

    def count(self) -> int:
        self.at += -self.at % 4
        return _LENGTH[self.order].unpack_from(self.data, self._next(4))[0]

    def string(self) -> bytes:
        size = self.count()
        at = self._next(size)
        return self.data[at : at + size].removesuffix(b"\0")

    def doubles(self) -> tuple[float, ...]:
        count = self.count()
        if not count:  # an empty sequence is its length, without the padding before doubles
            return ()
        self.at += (4 - self.at) % 8
        at = self._next(8 * count)
        return Struct(f"{self.order}{count}d").unpack_from(self.data, at)


def _of_joint(array: tuple[float, ...], names: list[bytes]) -> float | None:
    """Entry of `payout` in an array of a JointState, NaN in an empty one; None where it is not known which it is.

    ros2_control's hardware component names every joint, and gives an array entries for those with that interface alone.
    """
    if not array:
        return nan
    if len(array) != len(names):
        names = [name for name in names if name != DRUM.encode()]
    return array[names.index(JOINT.encode())] if len(array) == len(names) else None


def decode_command(data: bytes) -> Command:
    """Checked numbers of a winch command, a sensor_msgs/JointState; Refused if it cannot be used.

    A joint `payout` with position or velocity or both; NaN or an empty array = not commanded, and with neither the
    message commands nothing, as from a controller that is not active. Effort is carried out by nothing here.
    """
    parts = _Joints(data)
    arrays = [parts.doubles() for _ in range(3)]  # rclpy may leave padding after them
    if parts.names.count(JOINT.encode()) != 1:
        raise Refused("joint_name")
    payout, rate, force = (_of_joint(array, parts.names) for array in arrays)
    if payout is None or rate is None:
        raise Refused("array_length")
    if isinf(payout) or isinf(rate):
        raise Refused("not_finite")
    if isnan(payout) and isnan(rate) and force is not None and not isnan(force):
        raise Refused("effort_only")
    if abs(payout) > MAX_COMMAND or abs(rate) > MAX_COMMAND:
        raise Refused("out_of_range")
    return Command(stamp_of(data) or 0, payout, rate)


def decode_flaps(data: bytes) -> dict[str, float]:
    """Checked angles of flaps [rad] by the name of the joint, NaN: not commanded; of a sensor_msgs/JointState, of which
    only the position is read. Refused if it cannot be used."""
    parts = _Joints(data)
    names, position = [name.decode(errors="replace") for name in parts.names], parts.doubles()
    if len(set(names)) < len(names):
        raise Refused("flap_name")
    if position and len(position) != len(names):
        raise Refused("flap_array")
    for angle in position:
        if isinf(angle):
            raise Refused("not_finite")
        if abs(angle) > MAX_FLAP:
            raise Refused("out_of_range")
    return dict(zip(names, position or (nan,) * len(names), strict=True))


def decode_joint_command(data: bytes) -> Command:
    """Checked numbers of a winch command, a control_msgs/JointCommand; Refused if it cannot be used.

    One value for each joint that is named, `payout` among them, of the interface that the message names, whatever the
    topic is; NaN commands nothing.
    """
    parts = _Joints(data)
    names, interface, values = parts.names, parts.string(), parts.doubles()
    if names.count(JOINT.encode()) != 1:
        raise Refused("joint_name")
    if interface not in [name.encode() for name in INTERFACES]:
        raise Refused("interface")
    if len(values) != len(names):
        raise Refused("array_length")
    value = values[names.index(JOINT.encode())]
    if isinf(value):
        raise Refused("not_finite")
    if interface == b"effort" and not isnan(value):
        raise Refused("effort_only")
    if abs(value) > MAX_COMMAND:
        raise Refused("out_of_range")
    return Command(
        stamp_of(data) or 0, value if interface == b"position" else nan, value if interface == b"velocity" else nan
    )


JOINT_COMMAND = "control_msgs/msg/JointCommand"  # in Kilted and newer; its fields: ../bags/typestore.py
KINDS = {  # kind -> type, how its topic's name ends
    "imu": ("sensor_msgs/msg/Imu", "imu/data"),
    "odometry": ("nav_msgs/msg/Odometry", "odom"),
    "command": ("sensor_msgs/msg/JointState", "winch/command"),
    # as ros2_control's JointCommandTopicSystem names them: a topic for each interface, below the one that it is given
    "command_position": (JOINT_COMMAND, "winch/joint_command/position"),
    "command_velocity": (JOINT_COMMAND, "winch/joint_command/velocity"),
    "flaps": ("sensor_msgs/msg/JointState", "towbody/flaps"),
    # of the vehicle at the far end of the cable
    "vehicle": ("nav_msgs/msg/Odometry", "vehicle/odom"),
    "vehicle_pose": ("geometry_msgs/msg/PoseStamped", "vehicle/pose"),
}
SHIPS = ("imu", "odometry")  # kinds of the ship's motion
VEHICLES = {"vehicle": decode_odometry, "vehicle_pose": decode_pose}  # kind -> decoder; the newest counts
COMMANDS = {  # kind -> decoder; they are one input: the newest counts, on whichever topic it came
    "command": decode_command,
    "command_position": decode_joint_command,
    "command_velocity": decode_joint_command,
}
COMMANDED = (*COMMANDS, "flaps")  # kinds that are no motion
OWN = ("towbody/odom", "winch/state", "vehicle/odom")  # what this project publishes, or is of a vehicle, is no motion
# of a ship


def find_topics(topics: dict[str, str], asked: dict[str, str] | None = None) -> dict[str, str]:
    """kind -> topic. topics: name -> type; asked: kind -> name, in place of the search.

    A topic must have the type and the end of the name; a lone topic of the type will do for imu and odometry.
    BagError if one that was asked for is not there, or several would do.
    """
    found = {}
    for kind, (msgtype, suffix) in KINDS.items():
        name = (asked or {}).get(kind)
        if name:
            if topics.get(name) != msgtype:
                raise BagError(
                    f"topic '{name}' is {topics.get(name, 'not in the bag')}, {kind} needs {msgtype}: "
                    f"nothing was read; the bag has {', '.join(sorted(topics)) or 'no topics'}"
                )
            found[kind] = name
            continue
        others = tuple(f"/{own}" for own in OWN if own != suffix)
        fit = sorted(n for n, t in topics.items() if t == msgtype and not f"/{n}".endswith(others))
        named = [n for n in fit if f"/{n}".endswith(f"/{suffix}")]
        if kind in SHIPS and not named:
            named = fit
        if len(named) > 1:
            raise BagError(f"{kind} could be any of {', '.join(named)}: nothing was read; say which topic it is")
        if named:
            found[kind] = named[0]
    return found
