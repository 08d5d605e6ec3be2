"""IMU and odometry messages turned from north-east-down axes to ENU, as bytes, for whoever sends a bag on.

The same rotation as in `messages.py`: R_enu = Rz(90 deg) S R_ned S with S = diag(1, -1, -1).
"""

from __future__ import annotations

from struct import Struct

from .mounting import NORTH, times

_NUMBERS = {"imu": Struct("<37d"), "odometry": Struct("<85d")}
QUATERNION = {"imu": 0, "odometry": 3}  # where it begins
VECTORS = {"imu": (13, 25), "odometry": (43, 46)}  # in body axes: rates and force, velocity and rates


def in_enu(kind: str, data: bytes) -> bytes:
    """A little-endian CDR message of kind "imu" or "odometry" in NED axes as one in ENU; covariances stay as they are.

    A message too short to be one is returned as it is.
    """
    numbers = _NUMBERS[kind]
    if len(data) < 12 + numbers.size:
        return data
    d = list(numbers.unpack_from(data, len(data) - numbers.size))
    at = QUATERNION[kind]
    x, y, z, w = d[at : at + 4]
    if not (kind == "imu" and d[4] == -1.0):  # no attitude
        d[at : at + 4] = times(NORTH, (x, -y, -z, w))
    for at in VECTORS[kind]:
        d[at + 1], d[at + 2] = -d[at + 1], -d[at + 2]
    if kind == "odometry":
        d[:3] = d[1], d[0], -d[2]
    return data[: len(data) - numbers.size] + numbers.pack(*d)
