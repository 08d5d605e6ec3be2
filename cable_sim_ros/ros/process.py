"""The node as a process: its ROS arguments, signals as a flag, and a configure that a signal can end."""

from __future__ import annotations

import signal
import threading

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args

from .parameters import ParameterError


def start_ros(arguments: list[str]) -> None:
    """rclpy.init; ParameterError for arguments or a parameter file that it cannot read."""
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except RCLError as error:
        raise ParameterError(
            f"{unreadable(error)}; nothing was started. Correct the file or argument it names"
        ) from None


def unreadable(error: RCLError) -> str:
    """What rcl says of arguments that it cannot read, without the places in its sources."""
    what = str(error).removeprefix("failed to initialize rcl: ").removeprefix("Failed to parse ROS arguments: ")
    return f"ROS arguments: {' '.join(what.partition(', at /')[0].split())[:400]}"


def refuse_unknown(arguments: list[str]) -> None:
    """ParameterError for arguments of the command line that are neither ours nor for ROS; the first is the program."""
    unknown = remove_ros_args(arguments)[1:]
    if unknown:
        raise ParameterError(
            f"{' '.join(unknown)[:200]}: no option of the node; nothing was started. Its only one is --open; "
            f"parameters follow --ros-args, for example --ros-args -p scene:=side_scan"
        )


class Stop:
    """SIGINT and SIGTERM as a flag. rclpy's own handlers would shut the context down before the threads have ended."""

    def __init__(self) -> None:
        self.asked = False
        self._before = {number: signal.signal(number, self._ask) for number in (signal.SIGINT, signal.SIGTERM)}

    def _ask(self, number, frame) -> None:
        self.ask()

    def ask(self) -> None:
        """End, as a signal would."""
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
