"""Our own end of the topics, in the test's process: hears tick outputs, clock and anything else, sends, calls
services."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from ..errors import TowError
from ..ros.executor import drain

DEPTH = 2000  # messages: 20 s of tick outputs, should this process stand still
NAME = "cable_sim_test"


@contextmanager
def variables(wanted: Mapping[str, str | None]) -> Iterator[None]:
    """Environment variables for a while, None: unset; the middleware reads them when a context is made."""
    before = {name: os.environ.get(name) for name in wanted}
    _put(wanted)
    try:
        yield
    finally:
        _put(before)


def _put(wanted: Mapping[str, str | None]) -> None:
    for name, value in wanted.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


class Ears:
    """A node in a context of its own, spun by a thread of its own until `close`."""

    def __init__(self, domain: int, namespace: str, environment: Mapping[str, str | None]) -> None:
        self.context, self.namespace = rclpy.Context(), namespace
        with variables(environment):
            rclpy.init(args=[], context=self.context, domain_id=domain)
            self.node = rclpy.create_node(
                NAME, context=self.context, namespace=namespace, use_global_arguments=False, enable_rosout=False
            )
        self._subscriptions: list = []
        self._publishers: dict[str, Any] = {}
        self._clients: dict[str, Any] = {}
        self._stop = threading.Event()
        self.watch: Callable[[], None] = lambda: None  # raises where it is of no use to wait on
        self.failure: BaseException | None = None  # of a callback
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, name="cable_sim_test", daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        try:
            while not self._stop.is_set():
                self._executor.spin_once(timeout_sec=0.05)
                drain(self._subscriptions)
        except BaseException as error:
            self.failure = error
        finally:  # by the thread that waited on them: rclpy frees what another still holds
            self._executor.remove_node(self.node)
            self._executor.shutdown(timeout_sec=1.0)
            self.node.destroy_node()
            self.context.try_shutdown()

    def hear(self, kind: type, topic: str, callback: Callable[[bytes], None], reliable: bool = True) -> Any:
        """Call back with the CDR bytes of every message, in the thread that spins; returns the subscription."""
        policy = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
        profile = QoSProfile(depth=DEPTH, reliability=policy)
        made = self.node.create_subscription(kind, topic, lambda data, info: callback(data), profile, raw=True)
        self._subscriptions = [*self._subscriptions, made]  # a list of its own: the thread may be walking the old one
        return made

    def listen(self, kind: type, topic: str) -> list:
        """A list that grows by every message of a topic, from now on; any publisher is heard."""
        box: list = []
        self.hear(kind, topic, lambda data: box.append(deserialize_message(data, kind)), reliable=False)
        return box

    def publisher(self, kind: type, topic: str) -> Any:
        """One publisher a topic, reliable: every subscriber hears it."""
        if topic not in self._publishers:
            self._publishers[topic] = self.node.create_publisher(kind, topic, QoSProfile(depth=200))
        return self._publishers[topic]

    def call(
        self, kind: type, name: str, request: Any, within: float, meanwhile: Callable[[], bool] = lambda: False
    ) -> Any:
        """Answer of a service; TowError when it is not there or does not answer within so many seconds.

        meanwhile: called while it waits; the seconds count anew from where it says True.
        """
        deadline = time.monotonic() + within
        if name not in self._clients:
            self._clients[name] = self.node.create_client(kind, name)
        client = self._clients[name]
        while not client.service_is_ready():
            self._until(deadline, f"there is no service {name} within {within:g} s")
            time.sleep(0.01)
        future = client.call_async(request)
        answered = threading.Event()
        future.add_done_callback(lambda _: answered.set())
        while not answered.wait(0.05):
            if meanwhile():
                deadline = time.monotonic() + within
            self._until(deadline, f"no answer of {name} within {within:g} s")
        return future.result()

    def check(self) -> None:
        """TowError when the thread that spins has ended by an error."""
        if self.failure is not None:
            raise TowError(f"the test's own listener failed: {self.failure!r}") from self.failure

    def _until(self, deadline: float, problem: str) -> None:
        self.check()
        self.watch()
        if time.monotonic() > deadline:
            raise TowError(problem)

    def others_on(self, topic: str) -> int:
        """How many publishers of other nodes a topic (absolute) has."""
        return sum(end.node_name != NAME for end in self.node.get_publishers_info_by_topic(topic))

    def close(self) -> None:
        """End the thread and leave the domain; bounded."""
        self._stop.set()
        self._thread.join(10.0)
        if self._thread.is_alive():
            raise TowError("the thread of the test's own listener has not ended within 10 s")
