"""The node as a process: signals as a flag, and a configure that a signal can end."""

from __future__ import annotations

import signal
import threading

from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn


class Stop:
    """SIGINT and SIGTERM as a flag. rclpy's own handlers would shut the context down before the threads have ended."""

    def __init__(self) -> None:
        self.asked = False
        self._before = {number: signal.signal(number, self._ask) for number in (signal.SIGINT, signal.SIGTERM)}

    def _ask(self, number, frame) -> None:
        self.asked = True

    def restore(self) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)


def autostart(node: LifecycleNode, stop: Stop) -> bool:
    """Configure in a thread, so that a signal ends a long compilation at once; False when it was refused."""
    done: list[TransitionCallbackReturn] = []
    thread = threading.Thread(target=lambda: done.append(node.trigger_configure()), name="configure", daemon=True)
    thread.start()
    while thread.is_alive() and not stop.asked:
        thread.join(0.05)
    if stop.asked:
        return True
    return (
        bool(done)
        and done[0] == TransitionCallbackReturn.SUCCESS
        and (node.trigger_activate() == TransitionCallbackReturn.SUCCESS)
    )
