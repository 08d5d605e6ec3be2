"""The executor's turns: callbacks, waiting input messages between any two of them, and the steps of lockstep.

rclpy's executor takes one message of a topic each time round, among services and timers: under a flood of service
calls, or at hundreds of messages a second, motion would wait its turn. This empties the queues each time instead.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import rclpy
from rclpy.executors import SingleThreadedExecutor, TimeoutObject

from .loop import raise_priority

TURN = 5_000_000  # ns of steps between two turns of the executor, so that services and timers get theirs
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


def spin(node, stop) -> None:
    """Turn the executor of a CableSimNode until stop.asked or the end of the context."""
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    if node.settings.node.realtime.priority:
        raise_priority()  # motion that is taken in late is motion extrapolated
    # one object: with another argument each time rclpy begins its round anew, with coroutines and timers, and services
    # are never reached
    idle: Any = TimeoutObject(0.1)
    while not stop.asked and rclpy.ok():
        executor.spin_once(timeout_sec=idle)
        end, stepping = time.monotonic_ns() + TURN, node.session.steps_left
        while True:
            drain(node.inputs)
            now = time.monotonic_ns()
            idle.timeout = node.session.advance(now)
            if idle.timeout > 0.0 or now >= end:
                break
        if stepping and not node.session.steps_left:
            executor.wake()  # ~/step waits to answer, and nothing else may come
    executor.shutdown(timeout_sec=1.0)
