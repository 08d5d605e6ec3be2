"""The other end of the node's topics, for load tests: listens, talks, calls services, and keeps times of arrival."""

from __future__ import annotations

import threading
import time
from typing import Any, NamedTuple

import numpy as np

from ...io.messages.channels import decode_frames
from ..topics import message_class

HEALTH, DIAGNOSTICS = "sim/health", "/diagnostics"


class Task(NamedTuple):
    """One status of /diagnostics: time of arrival on CLOCK_MONOTONIC [s], level, sentence, figures as text."""

    at: float
    level: int
    message: str
    values: dict[str, str]


class Probe:
    """A ROS node of its own in this process, on a domain [1]; one thread spins it until `close`."""

    def __init__(self, domain: int, name: str = "probe", namespace: str = "/tow_sim") -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import QoSProfile, ReliabilityPolicy

        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node(name, context=self.context, namespace=namespace)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._best_effort = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
        self.received: dict[str, list[tuple[float, Any]]] = {}
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._spin, name=name, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._stop.is_set():
            self.executor.spin_once(timeout_sec=0.05)
        self.executor.remove_node(self.node)  # by the thread that waited on them: rclpy frees what another still holds
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()

    def listen(self, msgtype: str, topic: str, raw: bool = False) -> list[tuple[float, Any]]:
        """List that grows by (arrival on CLOCK_MONOTONIC [s], message or its bytes)."""
        box = self.received[topic] = []
        self.node.create_subscription(
            message_class(msgtype),
            topic,
            lambda message: box.append((time.monotonic(), message)),
            self._best_effort,
            raw=raw,
        )
        return box

    def publish(self, msgtype: str, topic: str):
        """A publisher on a topic, reliable, ten deep."""
        return self.node.create_publisher(message_class(msgtype), topic, 10)

    def watch(self) -> None:
        """Listen to health and diagnostics."""
        self.listen("sensor_msgs/msg/JointState", HEALTH, raw=True)
        self.listen("diagnostic_msgs/msg/DiagnosticArray", DIAGNOSTICS)

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

    def call(self, srvtype: str, name: str, within: float = 10.0, **fields):
        """Answer of a service, None when it does not come in time [s]."""
        package, _, kind = srvtype.split("/")
        service = getattr(__import__(f"{package}.srv", fromlist=[kind]), kind)
        client = self.node.create_client(service, name)
        try:
            if not client.wait_for_service(timeout_sec=within):
                return None
            future = client.call_async(service.Request(**fields))
            end = time.monotonic() + within
            while not future.done() and time.monotonic() < end:
                time.sleep(0.002)
            return future.result() if future.done() else None
        finally:
            self.node.destroy_client(client)

    def close(self) -> None:
        """End thread, node and context. Raises TimeoutError after 30 s."""
        self._stop.set()
        self._thread.join(30.0)
        if self._thread.is_alive():
            raise TimeoutError("the thread that spins the probe did not end within 30 s; its node is still there")
