"""A ROS domain that no other test has, for as long as any process of this one lives.

A domain is reserved by binding TCP port 32768 + domain, as ros-domain-coordinator 0.12 does (used by launch_testing and
ament_cmake_ros), so tests started by either keep apart. Its own context manager is not used: it takes an OSError of
the test inside for a taken port, and gives the domain up while a process of the test may still be on it.
"""

from __future__ import annotations

import random
import socket
from pathlib import Path

from ..errors import TowError

PORT = 32768  # plus the domain: those of ros-domain-coordinator
DOMAINS = range(1, 101)  # 0 is everybody's; ports of higher ones are those of outgoing connections
RTPS, PORTS = 7400, 250  # UDP ports of domain d: from 7400 + 250 d on. OMG DDSI-RTPS 9.6.2.3


class Domain:
    """A reserved domain: `number`, and the descriptor that holds it, which processes of the test inherit."""

    def __init__(self, number: int, holder: socket.socket) -> None:
        self.number, self._holder = number, holder

    @property
    def descriptor(self) -> int:
        """For `pass_fds` of the processes of the test: the domain is free again when the last of them has ended."""
        return self._holder.fileno()

    def close(self) -> None:
        """Give it up; a second call does nothing."""
        self._holder.close()


def reserve() -> Domain:
    """A domain that nobody has reserved and no process of this machine is on. TowError when there is none."""
    ports = udp_ports()
    order = list(DOMAINS)
    random.shuffle(order)  # not the one that has just been left: its last packets may still be under way
    for number in order:
        first = RTPS + PORTS * number
        if any(first <= port < first + PORTS for port in ports):
            continue  # a node that reserved nothing, such as a robot's, is on it
        holder = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            holder.bind(("", PORT + number))
        except OSError:
            holder.close()
            continue
        return Domain(number, holder)
    raise TowError(
        f"all ROS domains from {DOMAINS[0]} to {DOMAINS[-1]} are in use on this machine: nothing was started. End "
        f"processes that earlier tests left, or run fewer tests at once"
    )


def udp_ports() -> set[int]:
    """UDP ports that are bound on this machine, as far as the kernel lists them."""
    found = set()
    for table in ("/proc/net/udp", "/proc/net/udp6"):
        try:
            lines = Path(table).read_text("ascii").splitlines()[1:]
        except OSError:
            continue
        found |= {int(line.split()[1].rpartition(":")[2], 16) for line in lines}
    return found
