"""The executor's turns: callbacks, waiting input messages between any two of them, and the steps of lockstep.

rclpy's executor takes one message of a topic each time round, among services and timers: under a flood of service
calls, or at hundreds of messages a second, motion would wait its turn. This empties the queues each time instead. And
its turn gathers all that a node has, 0.3 ms of work: between two turns `Waiter` waits for what comes often only.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor, TimeoutObject
from rclpy.impl.implementation_singleton import rclpy_implementation

from .loop import raise_priority

TURN = 5_000_000  # ns of steps, or of messages, between two turns of the executor: services and timers get theirs
SECOND = 1_000_000_000
MAX = 100  # messages of one topic at a time, so that a flood cannot hold up services and timers for ever


def drain(subscriptions: Sequence) -> int:
    """Hand every message that waits to the callback of its subscription, the topics in turn; returns how many.

    In turn, because a backlog of one topic ahead of the other's looks like the other being silent.
    subscriptions: of rclpy, with callbacks of (message, info). Call it from the executor's thread, outside callbacks.
    """
    taken, waiting = 0, list(subscriptions)
    for _ in range(MAX):
        for subscription in list(waiting):
            with subscription.handle:
                found = subscription.handle.take_message(subscription.msg_type, subscription.raw)
            if found is None:
                waiting.remove(subscription)
            else:
                subscription.callback(*found)
                taken += 1
        if not waiting:
            break
    return taken


class Waiter:
    """Waits for messages of some subscriptions and for answers of services, of one context and in one thread."""

    def __init__(self, context: rclpy.Context) -> None:
        self._context = context
        self._set: Any = None
        self._size = (-1, -1)

    def wait(self, subscriptions: Sequence, nanoseconds: int, clients: Iterable = ()) -> bool:
        """Until a message or an answer is there, at most so long; is it an answer? A turn of the executor takes it."""
        clients = list(clients)
        if self._size != (len(subscriptions), len(clients)):
            self._size = len(subscriptions), len(clients)
            with self._context.handle:
                made = rclpy_implementation.WaitSet
                self._set = made(self._size[0], 0, 0, self._size[1], 0, 0, self._context.handle)
        self._set.clear_entities()
        for subscription in subscriptions:
            self._set.add_subscription(subscription.handle)
        for client in clients:
            self._set.add_client(client.handle)
        self._set.wait(nanoseconds)
        return bool(clients) and bool(self._set.get_ready_entities("client"))


def spin(node, stop) -> None:
    """Turn the executor of a CableSimNode until stop.asked or the end of the context."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    if node.settings.node.realtime.priority:
        raise_priority()  # motion that is taken in late is motion extrapolated
    # one object: with another argument each time rclpy begins its round anew, with coroutines and timers, and services
    # are never reached
    idle: Any = TimeoutObject(0.1)
    waiter = Waiter(node.context)
    while not stop.asked and rclpy.ok():
        executor.spin_once(timeout_sec=idle)
        end, stepping = time.monotonic_ns() + TURN, node.session.steps_left
        while True:
            drain(node.inputs)
            now = time.monotonic_ns()
            idle.timeout = node.session.advance(now)
            if now >= end or (idle.timeout > 0.0 and not node.session.awaits):
                break
            if idle.timeout > 0.0:
                waiter.wait(node.inputs, min(round(idle.timeout * SECOND), end - now))
        if stepping and not node.session.steps_left:
            executor.wake()  # ~/step waits to answer, and nothing else may come
    executor.shutdown(timeout_sec=1.0)
