"""Takes in waiting input messages between any two other callbacks.

rclpy's executor takes one message of a topic each time round, among services and timers: under a flood of service
calls, or at hundreds of messages a second, motion would wait its turn. This empties the queues each time instead.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

MOST = 100  # messages of one topic at a time, so that a flood of one topic cannot shut out the rest


def drain(subscriptions: Sequence) -> int:
    """Hand every message that waits to the callback of its subscription; returns how many.

    subscriptions: of rclpy, with callbacks of (message, info). Call it from the executor's thread, outside callbacks.
    """
    taken = 0
    for subscription in subscriptions:
        callback: Callable = subscription.callback
        for _ in range(MOST):
            with subscription.handle:
                found = subscription.handle.take_message(subscription.msg_type, subscription.raw)
            if found is None:
                break
            callback(*found)
            taken += 1
    return taken
