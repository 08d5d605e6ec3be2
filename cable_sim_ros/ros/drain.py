"""Takes in waiting input messages between any two other callbacks.

rclpy's executor takes one message of a topic each time round, among services and timers: under a flood of service
calls, or at hundreds of messages a second, motion would wait its turn. This empties the queues each time instead.
"""

from __future__ import annotations

from collections.abc import Sequence

MOST = 100  # messages of one topic at a time, so that a flood cannot hold up services and timers for ever


def drain(subscriptions: Sequence) -> int:
    """Hand every message that waits to the callback of its subscription, the topics in turn; returns how many.

    In turn, because a backlog of one topic ahead of the other's looks like the other being silent.
    subscriptions: of rclpy, with callbacks of (message, info). Call it from the executor's thread, outside callbacks.
    """
    taken, waiting = 0, list(subscriptions)
    for _ in range(MOST):
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
