"""Message types without ROS: one typestore, the definition text a bag carries and the type hashes.

The store is that of the ROS distribution in use; the standard messages used here have the same fields, and so the
same hashes, in Jazzy, Kilted and Lyrical. Source of text and hash: REP-2011 (RIHS01) and the ``ros2msg`` schema
encoding of MCAP.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import cache
from importlib import metadata

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.base import TypesysError
from rosbags.typesys.store import Typestore

RCLPY = {"7": "jazzy", "9": "kilted", "10": "lyrical"}  # major version -> distribution, by rosdistro's lists
NEWER = "rolling"
WITHOUT_ROS = "jazzy"  # a recording that is made where there is no ROS at all
# types beside those of a distribution's common packages: field by field, in the order of the bytes
BESIDE = {
    "control_msgs/msg/JointCommand": (
        ("header", "std_msgs/Header"),
        ("joint_names", "string[]"),
        ("interface_name", "string"),
        ("values", "float64[]"),
    )
}


def distribution(environ: Mapping[str, str] = os.environ, version: Callable[[str], str] = metadata.version) -> str:
    """Name of the ROS distribution in use: of the one sourced, else of rclpy's version, else `WITHOUT_ROS`."""
    if name := environ.get("ROS_DISTRO", "").strip().lower():
        return name
    try:
        return RCLPY.get(version("rclpy").partition(".")[0], NEWER)
    except metadata.PackageNotFoundError:
        return WITHOUT_ROS


def store_of(name: str) -> Typestore:
    """Message types of a distribution; of the newest one known for a name that is not (rolling, a later one)."""
    store = get_typestore(getattr(Stores, f"ROS2_{name.upper()}", Stores.LATEST))
    for msgtype, fields in BESIDE.items():
        store.register(get_types_from_msg("\n".join(f"{kind} {field}" for field, kind in fields), msgtype))
    return store


ROS_DISTRO = distribution()
STORE = store_of(ROS_DISTRO)


@cache
def definition(msgtype: str) -> str:
    """Text of the message with all its dependencies, as a ``ros2msg`` schema; ValueError for an unknown type."""
    try:
        return STORE.generate_msgdef(msgtype, ros_version=2)[0]
    except (TypesysError, KeyError):
        raise ValueError(
            f"message type '{msgtype}' is not known: nothing can be recorded or published with it; "
            f"use a standard type written as package/msg/Name"
        ) from None


@cache
def type_hash(msgtype: str) -> str:
    """RIHS01 hash of the type, as ROS publishers announce it; ValueError for an unknown type."""
    definition(msgtype)
    return STORE.hash_rihs01(msgtype)
