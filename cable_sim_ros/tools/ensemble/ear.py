"""What an ensemble hears of a node: tick outputs, winch commands, plans of the winch; it sends the node nothing."""

from __future__ import annotations

import time
from collections import deque
from typing import Any

from std_msgs.msg import String

from ...io.messages.messages import COMMANDED, KINDS
from ...ros.topics import inputs_there
from ...ros.watcher import HEALTH as HEALTH_CHANNEL
from ...ros.watcher import Watcher
from .follow import HEALTH, Heard

PLAN = "ensemble/plan"
KEPT = 20_000  # messages that may wait: 200 s of 100 Hz


class Ear(Watcher):
    """Of one namespace. `plan_text`: a plan of the winch that came, until it is taken."""

    def listen(self) -> None:
        """Subscribe; best effort holds no publisher up."""
        self._items: deque[Heard] = deque(maxlen=KEPT)
        self._overflowed = False
        self.plan_text: str | None = None
        kinds, _ = inputs_there()
        from sensor_msgs.msg import JointState

        self.client.hear(JointState, self.topic(HEALTH_CHANNEL.topic), self._put_tick, reliable=False)
        for kind, made in kinds.items():
            if kind in COMMANDED:
                self.client.hear(made, self.topic(KINDS[kind][1]), self._command(kind), reliable=False)
        self.client.hear(String, self.topic(PLAN), self._put_plan, reliable=False)

    def _put_tick(self, data: bytes) -> None:
        self._heard = time.monotonic()
        self._put(HEALTH, data)

    def _command(self, kind: str) -> Any:
        return lambda data: self._put(kind, data)

    def _put(self, kind: str, data: bytes) -> None:
        with self.lock:
            self._overflowed = self._overflowed or len(self._items) == KEPT
            self._items.append(Heard(time.monotonic_ns(), kind, bytes(data)))

    def _put_plan(self, data: bytes) -> None:
        from rclpy.serialization import deserialize_message

        with self.lock:
            self.plan_text = deserialize_message(data, String).data[:10_000]

    def items(self) -> list[Heard]:
        """Messages since the last call, in the order of their arrival."""
        with self.lock:
            found = list(self._items)
            self._items.clear()
        return found

    def overflowed(self) -> bool:
        """Were messages lost since the last call, because more than KEPT waited?"""
        with self.lock:
            found, self._overflowed = self._overflowed, False
        return found

    def ordered(self) -> str | None:
        """The newest plan of the winch since the last call."""
        with self.lock:
            text, self.plan_text = self.plan_text, None
        return text
