"""A careless or hostile neighbour, for load tests: floods services and topics of the node as fast as one core allows.

python -m verification.soak.flood services|topics|giants [--seconds S] [--bytes N]
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence

import rclpy
from rcl_interfaces.srv import DescribeParameters, GetParameters, ListParameters
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import SetBool

from cable_sim_ros.io.messages.messages import KINDS
from cable_sim_ros.processes import Alive
from cable_sim_ros.ros.topics import inputs_there, senders
from cable_sim_ros.terminal import say

from .sender import Ship

AT_ONCE = 50  # calls under way at a time, of each service


def services(node, spin: Callable, alive: Callable) -> int:
    """Call the node's services, AT_ONCE of each under way; returns the answers."""
    calls = [
        (ListParameters, "list_parameters", ListParameters.Request()),
        (GetParameters, "get_parameters", GetParameters.Request(names=["scene"] * 20)),
        (DescribeParameters, "describe_parameters", DescribeParameters.Request(names=["scene"] * 20)),
        (SetBool, "record", SetBool.Request(data=False)),
    ]
    clients = [(node.create_client(kind, f"/tow_sim/cable_sim/{name}"), request) for kind, name, request in calls]
    waiting: list[list] = [[] for _ in clients]
    answered = 0
    while alive():
        for (client, request), futures in zip(clients, waiting):
            answered += sum(future.done() for future in futures)
            futures[:] = [future for future in futures if not future.done()]
            if client.service_is_ready():
                futures += [client.call_async(request) for _ in range(AT_ONCE - len(futures))]
        spin(0.001)
    return answered


def topics(node, spin: Callable, alive: Callable) -> int:
    """Send winch commands and bytes that are no message to every input, as fast as it goes; returns how many."""
    publishers = [node.create_publisher(made, KINDS[kind][1], 10) for kind, made in inputs_there()[0].items()]
    junk = [b"\0\1\0\0", b"\0\1\0\0" + bytes(60), b"\0\1\0\0" + b"\xff" * 400]
    sent = 0
    while alive():
        for publisher in publishers:
            publisher.publish(junk[sent % len(junk)])
            sent += 1
    return sent


def giants(node, spin: Callable, alive: Callable, size: int) -> int:
    """IMU and odometry whose frame_id has `size` bytes, twice a second; returns how many."""
    ship, publishers = Ship(frame_id="x" * size), senders(node, ("imu", "odometry"), 1)
    sent = 0
    while alive():
        for kind, publisher in publishers.items():
            publisher.publish(ship.message(kind, time.time_ns(), 0.0))
            sent += 1
        spin(0.5)
    return sent


def main(arguments: Sequence[str]) -> int:
    """Entry point: prints how much was sent or answered; 0 at the end of the time or after a signal."""
    parser = argparse.ArgumentParser(prog="flood", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("what", choices=["services", "topics", "giants"])
    parser.add_argument("--seconds", type=float, default=10.0, metavar="S")
    parser.add_argument("--bytes", type=int, default=20_000_000, metavar="N", help="length of a giant's frame_id")
    given, ros = parser.parse_known_args(list(arguments))
    running = Alive()
    rclpy.init(args=["flood", *ros], signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node("flood", namespace="/tow_sim")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    end = time.monotonic() + given.seconds

    def alive() -> bool:
        return running() and time.monotonic() < end

    say("flooding")
    parts = (node, executor.spin_once, alive)
    if given.what == "giants":
        count = giants(*parts, given.bytes)
    else:
        count = (services if given.what == "services" else topics)(*parts)
    say(f"{given.what}: {count}")
    executor.shutdown()
    node.destroy_node()
    rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
