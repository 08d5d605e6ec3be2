"""The command `cable-sim soak`."""

from ..stress.command import command_of
from . import SOAK

soak = command_of(
    "soak",
    SOAK,
    "[R1 ... S9]",
    """The real node under load, faults and hostile neighbours (default: all rows, two hours).

    Leaves with code 1 where a limit is missed. Needs ROS 2 and a machine that does nothing else.
    """,
)
