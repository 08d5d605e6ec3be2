"""Another end of the node's topics, for tests and load tests: hears any of them, sends, calls services."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message

from ..errors import TowError
from .executor import TURN, Waiter, drain

DEPTH = 2000  # messages: 20 s of tick outputs, should this process stand still
NAME, NAMESPACE = "cable_sim_test", "/tow_sim"
ENDS = 60.0  # s that leaving the domain may take on a machine that is busy


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


class Client:
    """A node in a context of its own, spun by a thread of its own until `close`. environment: as of `variables`."""

    def __init__(self, domain: int, name: str = NAME, environment: Mapping[str, str | None] | None = None) -> None:
        self.context, self.name = rclpy.Context(), name
        with variables(environment or {}):
            rclpy.init(args=[], context=self.context, domain_id=domain)
            self.node = rclpy.create_node(
                name,
                context=self.context,
                namespace=NAMESPACE,
                use_global_arguments=False,
                enable_rosout=False,
                start_parameter_services=False,  # it has none, and under SROS2 needs no permission by its name
                parameter_overrides=[Parameter("start_type_description_service", value=False)],
            )
        self.received: dict[str, list] = {}  # by topic, the first list of `listen`
        self._subscriptions: list = []
        self._publishers: dict[str, Any] = {}
        self._clients: dict[str, Any] = {}
        self.prompt = True  # or may what comes wait for TURN, that many are taken at once?
        self._stop = threading.Event()
        self.give_up: Callable[[], None] = lambda: None  # raises where it is of no use to wait on
        self.failure: BaseException | None = None  # of a callback
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._thread = threading.Thread(target=self._spin, name=NAME, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        try:
            waiter = Waiter(self.context)
            while not self._stop.is_set():
                self.executor.spin_once(timeout_sec=0.05)
                now = time.monotonic_ns()
                end, answered = now + TURN, False
                while drain(self._subscriptions) and now < end and not answered:
                    heard = self._subscriptions if self.prompt or not self._clients else ()
                    answered = waiter.wait(heard, end - now, self._clients.values())
                    now = time.monotonic_ns()
        except BaseException as error:
            self.failure = error
        finally:  # by the thread that waited on them: rclpy frees what another still holds
            self.executor.remove_node(self.node)
            self.executor.shutdown(timeout_sec=1.0)
            self.node.destroy_node()
            self.context.try_shutdown()

    def hear(self, kind: type, topic: str, callback: Callable[[bytes], None], reliable: bool = True) -> Any:
        """Call back with the CDR bytes of every message, in the thread that spins; returns the subscription."""
        policy = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
        profile = QoSProfile(depth=DEPTH, reliability=policy)
        made = self.node.create_subscription(kind, topic, lambda data, info: callback(data), profile, raw=True)
        self._subscriptions = [*self._subscriptions, made]  # a list of its own: the thread may be walking the old one
        return made

    def listen(self, kind: type, topic: str, raw: bool = False) -> list:
        """A list that grows by every message of a topic (raw: by its bytes), from now on; any publisher is heard."""
        box: list = []
        self.received.setdefault(topic, box)

        def put(data: bytes) -> None:
            box.append(self.entry(data if raw else deserialize_message(data, kind)))

        self.hear(kind, topic, put, reliable=False)
        return box

    def entry(self, message: Any) -> Any:
        """What a list of `listen` has for a message."""
        return message

    def diagnostics(self) -> dict[str, tuple[int, str, dict[str, str]]]:
        """Newest status of each task: name -> (level, text, values); `listen` to /diagnostics before."""
        box = self.received["/diagnostics"]
        return {
            status.name.partition(": ")[2]: (status.level[0], status.message, {v.key: v.value for v in status.values})
            for status in (box[-1].status if box else ())
        }

    def publisher(self, kind: type, topic: str) -> Any:
        """One publisher a topic, reliable: every subscriber hears it."""
        if topic not in self._publishers:
            self._publishers[topic] = self.node.create_publisher(kind, topic, QoSProfile(depth=DEPTH))
        return self._publishers[topic]

    def begin(self, kind: type, name: str, request: Any, within: float = 10.0) -> Any:
        """Future of the answer of a service; TowError when it is not there within so many seconds."""
        deadline = time.monotonic() + within
        if name not in self._clients:
            self._clients[name] = self.node.create_client(kind, name)
        client = self._clients[name]
        while not client.service_is_ready():
            self._until(deadline, f"there is no service {name} within {within:g} s")
            time.sleep(0.01)
        return client.call_async(request)

    def call(
        self, kind: type, name: str, request: Any, within: float = 10.0, meanwhile: Callable[[], bool] = lambda: False
    ) -> Any:
        """Answer of a service; TowError when it is not there or does not answer within so many seconds.

        meanwhile: called while it waits; the seconds count anew from where it says True.
        """
        future = self.begin(kind, name, request, within)
        deadline = time.monotonic() + within
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
        self.give_up()
        if time.monotonic() > deadline:
            raise TowError(problem)

    def others_on(self, topic: str) -> int:
        """How many publishers of other nodes a topic (absolute) has."""
        return sum(end.node_name != self.name for end in self.node.get_publishers_info_by_topic(topic))

    def close(self) -> None:
        """End the thread and leave the domain; bounded."""
        self._stop.set()
        self._thread.join(ENDS)
        if self._thread.is_alive():
            raise TowError(f"the thread of the test's own listener has not ended within {ENDS:g} s")
