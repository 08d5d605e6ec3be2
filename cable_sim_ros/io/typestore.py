"""Message types without ROS: one typestore, the definition text a bag carries and the type hashes.

The store is that of ROS 2 Kilted; the standard messages used here have the same definitions, and so the same
hashes, in Jazzy. Source of text and hash: REP-2011 (RIHS01) and the ``ros2msg`` schema encoding of MCAP.
"""

from __future__ import annotations

from functools import cache

from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.base import TypesysError

STORE = get_typestore(Stores.ROS2_KILTED)
ROS_DISTRO = "kilted"


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
