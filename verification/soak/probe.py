"""A client that keeps times of arrival."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np

from cable_sim_ros.io.messages.channels import decode_frames
from cable_sim_ros.ros.client import Client
from cable_sim_ros.ros.topics import message_class

HEALTH, DIAGNOSTICS = "sim/health", "/diagnostics"


class Task(NamedTuple):
    """One status of /diagnostics: time of arrival on CLOCK_MONOTONIC [s], level, sentence, figures as text."""

    at: float
    level: int
    message: str
    values: dict[str, str]


class Probe(Client):
    """A client whose lists hold (arrival on CLOCK_MONOTONIC [s], message)."""

    def entry(self, message: Any) -> Any:
        return time.monotonic(), message

    def watch(self) -> None:
        """Listen to health and diagnostics."""
        self.listen(message_class("sensor_msgs/msg/JointState"), HEALTH, raw=True)
        self.listen(message_class("diagnostic_msgs/msg/DiagnosticArray"), DIAGNOSTICS)

    def frames(self, since: int = 0) -> tuple[np.ndarray, np.recarray]:
        """Times of arrival [s] and tick outputs heard, from message number `since` on."""
        box = self.received[HEALTH][since:]
        return np.array([at for at, _ in box]), decode_frames([data for _, data in box])

    def tasks(self, name: str, since: float = 0.0) -> list[Task]:
        """Statuses of one task of the node heard after a time [s], oldest first."""
        found = []
        for at, array in list(self.received[DIAGNOSTICS]):
            if at < since:
                continue
            for status in array.status:
                if status.name.partition(": ")[2] == name:
                    values = {pair.key: pair.value for pair in status.values}
                    found.append(Task(at, status.level[0], status.message, values))
        return found
