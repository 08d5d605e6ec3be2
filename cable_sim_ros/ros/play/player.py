"""Plays the IMU and odometry of a bag over real topics at real-time pace, as the ship's own sensors would send them.

    cable-sim play BAG [--rate R] [--loop] [--duration S] [--start S] [--imu-only] [--keep-stamps]
        [--lockstep] [--ros-args ...]

Stamps are moved to now by default, with --lockstep to /clock, which then says when a message is sent
(clock_player.py). The namespace is /tow_sim unless remapped, so that a node started without arguments
hears it.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.utilities import remove_ros_args

from ...errors import CableSimError
from ...io.bags.bag import BagReader
from ...io.messages.messages import COMMANDED, Event, stamp_of
from ...io.messages.mounting import in_enu
from ...io.scenes.document import find_bag
from ...io.sources.recorded_tow import at_speed, needs_speed, read_motion
from ...limits import LONGEST_RUN
from ...terminal import plain_console
from .. import discovery
from ..process import RCLError, unreadable
from .clock_player import SECOND, interval, play_by_clock, publishers_of

SLEEP_CHUNK = 0.1  # s, so that a signal is seen soon


class PlayError(CableSimError, ValueError):
    """A bag or an option that cannot be used; the text says why and what to do."""


def load(
    path: Path,
    *,
    start: float = 0.0,
    duration: float | None = None,
    imu_only: bool = False,
    topics: Mapping[str, str] | None = None,
    ned: bool = False,
    speed: float | None = None,
) -> list[Event]:
    """Motion messages of a bag, start [s] after its first one, duration [s] long. PlayError when there are none.

    topics: as of `read_motion`; ned: they are in NED axes and turned to ENU, as a node by default wants them; speed:
    of the ship [m/s], for an imported bag whose log has none.
    """
    with BagReader(path) as bag:
        about = dict(bag.custom_data)
    if needs_speed(about) and speed is None and not imu_only:
        raise PlayError(
            f"bag '{path}': its log has no speed, the ship would stand still; nothing was played; give --speed M/S, "
            "ship.tow_speed of the scene"
        )
    for name, value in (("start", start), ("duration", duration)):
        if value is not None and not 0.0 <= value <= LONGEST_RUN:
            raise PlayError(
                f"--{name} {value:g} s is outside [0, {LONGEST_RUN:g}] s; nothing was played; give seconds of the bag"
            )
    items: list[Event] = []
    first = None
    for log_time, kind, data in read_motion(path, dict(topics or {})):
        if kind in COMMANDED or (imu_only and kind == "odometry"):
            continue
        stamp = stamp_of(data)
        if stamp is None or not data[1] & 1:
            raise PlayError(
                f"bag '{path}': a message of {kind} is not little-endian CDR; nothing was played; convert the bag"
            )
        first = log_time if first is None else first
        due = log_time - first - round(start * SECOND)
        if due < 0:
            continue
        if duration is not None and due > duration * SECOND:
            break
        items.append(Event(stamp, due, kind, in_enu(kind, data) if ned else data))
    if not items:
        wanted = "sensor_msgs/Imu" if imu_only else "sensor_msgs/Imu or nav_msgs/Odometry"
        raise PlayError(f"bag '{path}' has no {wanted} in the part asked for (from {start:g} s on); nothing was played")
    return at_speed(items, about, speed or 0.0)


def sleep_until(deadline: int, alive) -> bool:
    """Sleep to CLOCK_MONOTONIC deadline [ns]; False when alive() turned false meanwhile."""
    while True:
        left = deadline - time.monotonic_ns()
        if not alive():
            return False
        if left <= 0:
            return True
        time.sleep(min(left / SECOND, SLEEP_CHUNK))


def play(
    node, items: list[Event], *, rate: float = 1.0, loop: bool = False, keep_stamps: bool = False, alive, progress
) -> int:
    """Send the items; returns how many were sent. progress(seconds played) is called some ten times a second."""
    publishers = publishers_of(node, items)
    wait = time.monotonic() + 10.0
    while alive() and time.monotonic() < wait and not all(p.get_subscription_count() for p in publishers.values()):
        time.sleep(0.02)
    time.sleep(0.3)  # the other side may learn of us a little later than we of it
    length = items[-1].arrival + interval(items)
    begun, sent, reported = time.monotonic_ns() + SECOND // 50, 0, 0
    base = time.time_ns() + SECOND // 50
    lap = 0
    while True:
        shift = 0 if keep_stamps else base + lap * length - (items[0].stamp or 0)
        for item in items:
            played = lap * length + item.arrival
            if not sleep_until(begun + round(played / rate), alive):
                return sent
            publishers[item.kind].publish((item.moved(shift) if shift else item).data)
            sent += 1
            if played - reported > SECOND // 10:
                reported = played
                progress(played / SECOND)
        lap += 1
        if not loop:
            break
    for publisher in publishers.values():  # let the last messages out before the process ends
        publisher.wait_for_all_acked()
    return sent


def _bar(total: float | None):
    """Progress bar on a terminal, else nothing: (context, function of seconds)."""
    if not sys.stderr.isatty():
        return nullcontext(), lambda seconds: None
    from rich.progress import Progress

    bar = Progress(console=plain_console(err=True), transient=True)
    task = bar.add_task("playing", total=total)
    return bar, lambda seconds: bar.update(task, completed=seconds)


def play_bag(
    bag: str,
    *,
    rate: float | None = None,
    loop: bool = False,
    start: float = 0.0,
    duration: float | None = None,
    imu_only: bool = False,
    keep_stamps: bool = False,
    lockstep: bool = False,
    topics: Mapping[str, str] | None = None,
    ned: bool = False,
    speed: float | None = None,
    ros_arguments: Sequence[str] = (),
) -> int:
    """Play the motion of a bag (path or name of a shipped one) until its end or a signal; returns messages sent.

    rate: speed of sending, 1 by default, stamps keep their spacing; loop: begin again at the end; start, duration: part
    of the bag, s; lockstep: by /clock, not by wall time, then no rate; topics, ned, speed: see `load`; ros_arguments:
    passed on to rclpy.
    Raises PlayError, BagError, ResourceError before a node is made.
    """
    given = ["play", *ros_arguments]
    try:
        unknown = remove_ros_args(given)[1:]
    except RCLError as error:
        raise PlayError(f"{unreadable(error)}; nothing was played. Correct the file or argument it names") from None
    if unknown:
        raise PlayError(
            f"{' '.join(unknown)}: no option of play; nothing was played. See --help; ROS arguments follow --ros-args"
        )
    if rate is not None and not 0.0 < rate <= 100.0:
        raise PlayError(f"--rate {rate:g} is out of range; nothing was played; give a value above 0 and up to 100")
    if lockstep and rate is not None:
        raise PlayError(
            f"--rate {rate:g} with --lockstep: /clock says when a message is sent; nothing was played. Leave --rate "
            f"out, and set lockstep.rate of the node"
        )
    items = load(find_bag(bag), start=start, duration=duration, imu_only=imu_only, topics=topics, ned=ned, speed=speed)
    node, sent = None, 0
    discovery.limit([])
    try:
        rclpy.init(args=given)
        node = rclpy.create_node("motion_player", namespace="/tow_sim")
        bar, progress = _bar(None if loop else items[-1].arrival / SECOND)
        with bar:
            send = play_by_clock if lockstep else partial(play, rate=1.0 if rate is None else rate)
            sent = send(node, items, loop=loop, keep_stamps=keep_stamps, alive=rclpy.ok, progress=progress)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    return sent
