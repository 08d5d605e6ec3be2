"""The node in lockstep among nodes that move on /clock only: sensors and controllers of rclpy with use_sim_time."""

from __future__ import annotations

import math
from types import SimpleNamespace

import pytest
import rclpy
from conftest import ns, poll
from rclpy.parameter import Parameter
from rclpy.serialization import deserialize_message
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

from cable_sim_ros.io.bags.bag import BagReader
from cable_sim_ros.ros.client import Client
from cable_sim_ros.ros.play import clock_player

S = 1_000_000_000
TICK = 10_000_000  # ns, of the scene
DELAY = 30_000_000  # ns, input_delay: so far a tick is behind its clock
LOCKSTEP = {"time_mode": "lockstep", "lockstep__rate": 0.0, "lockstep__wait": 5.0, "lockstep__command_period": 0.01}


class Seat:
    """Sensors (IMU and odometry at 50 Hz) and a controller (100 Hz) whose timers move on /clock.

    answers: the controller answers each winch/state instead of its timer.
    """

    def __init__(self, domain: int, ship, answers: bool = False) -> None:
        self.client = Client(domain, "seat")
        self.ship, self.mute = ship, False  # mute: the controller says nothing
        self.sensed: list[int] = []
        self.commanded: list[int] = []
        sim_time = [Parameter("use_sim_time", value=True)]
        self.sensors, self.controller = nodes = [
            rclpy.create_node(name, context=self.client.context, namespace="/tow_sim", parameter_overrides=sim_time)
            for name in ("sensors", "controller")
        ]
        self.imu = self.sensors.create_publisher(ship.imu.msg_type, "imu/data", 200)
        self.odom = self.sensors.create_publisher(ship.odom.msg_type, "odom", 200)
        self.sensors.create_timer(0.02, self.sense)
        self.winch = self.controller.create_publisher(JointState, "winch/command", 10)
        if answers:
            self.controller.create_subscription(JointState, "winch/state", lambda _: self.command(), 10)
        else:
            self.controller.create_timer(0.01, self.command)
        for node in nodes:
            self.client.executor.add_node(node)

    def sense(self) -> None:
        now = self.sensors.get_clock().now().nanoseconds
        if not now:
            return
        imu, odom = self.ship.messages(now, now * 1e-9)
        self.imu.publish(imu)
        self.odom.publish(odom)
        self.sensed.append(now)

    def command(self) -> None:
        now = self.controller.get_clock().now().nanoseconds
        if self.mute or not now:
            return
        message = JointState(name=["payout"], velocity=[0.2 * math.sin(now * 1e-9)])
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, S)
        self.winch.publish(message)
        self.commanded.append(now)


class Watcher:
    """What a test looks at: /clock, winch/state, diagnostics; and the services."""

    def __init__(self, world) -> None:
        self.ears = world.ears()
        self.clocks = self.ears.listen(Clock, "/clock")
        self.states: list = []
        self.ears.hear(
            JointState, "winch/state", lambda data: self.states.append(deserialize_message(data, JointState))
        )

    def task(self):
        return self.ears.task("lockstep")

    def figure(self, name: str) -> float:
        return float(self.task()[2].get(name, "nan"))

    def ticks(self) -> int:
        return len(self.states)

    def more(self, count: int) -> None:
        """So many more ticks."""
        before = self.ticks()
        poll(lambda: self.ticks() >= before + count, f"{count} more ticks; {self.task()}")

    def stands(self, times: int = 20) -> None:
        """No tick and no other time while /clock is said so many times, after what was under way has come."""

        def said():
            self.ears.more("/clock", times + 1)
            return self.ticks(), self.clock()

        assert said() == said()

    def clock(self) -> int:
        return ns(self.clocks[-1].clock)

    def stamps(self) -> list[int]:
        return [ns(message.header.stamp) for message in self.states]


def seat(world, watcher, **what) -> Seat:
    found = Seat(world.domain, world.ship(watcher.ears), **what)
    world.closing.insert(0, found.client.close)
    return found


def test_nodes_on_the_clock_in_any_order_pause_step_and_a_controller_that_dies(world):
    """How long a step waits, and at which rate: test_lockstep.py."""
    watcher = Watcher(world)
    there = seat(world, watcher)  # sensors and controller are there before the node
    node = world.node(**LOCKSTEP, lockstep__steps=7, recording__root=str(world.folder)).until("running")
    watcher.more(80)
    assert watcher.ears.ask("record", True)[0]
    watcher.more(100)
    assert set(b - a for a, b in zip(there.sensed[-50:], there.sensed[-49:])) == {2 * TICK}, "no stroke of a timer lost"
    assert set(b - a for a, b in zip(there.commanded[-50:], there.commanded[-49:])) == {TICK}
    poll(lambda: watcher.task()[2].get("controller_spoke") == "true", "the controller in /diagnostics")
    assert watcher.task()[2]["command_period_s"] == "0.010"
    assert watcher.ears.ask("pause", True)[0]
    watcher.stands()
    before = watcher.stamps()[-1]
    assert watcher.ears.ask("step")[0]
    watcher.stands()
    assert watcher.stamps()[-1] == before + 7 * TICK
    assert watcher.ears.ask("pause", False)[0]
    watcher.more(50)
    assert watcher.ears.ask("record", False)[0]
    # the controller stops answering: bounded, counted, ERROR, and the simulation goes on without it
    there.mute = True
    assert watcher.ears.set("lockstep.wait", 0.2) == ""
    poll(lambda: watcher.task()[0] == 2, "ERROR")
    assert "silent" in watcher.task()[1] and watcher.figure("commands_missed_in_row") == 5.0
    watcher.more(50)
    assert watcher.ears.set("lockstep.wait", 5.0) == ""
    there.mute = False
    poll(lambda: watcher.task()[0] == 0, "the controller is heard again")
    watcher.more(20)
    stamps = watcher.stamps()
    assert set(b - a for a, b in zip(stamps, stamps[1:])) == {TICK}, "no tick is lost in all of it"
    assert node.stop() == 0
    metrics = node.state()["lockstep"]
    assert metrics["commands_missed"] >= 5 and metrics["rate_wanted"] == 0.0
    bag_is_on_the_clock(world, stamps)


def bag_is_on_the_clock(world, stamps: list[int]) -> None:
    (path,) = [p for p in world.folder.glob("tow_*") if p.is_dir()]
    with BagReader(path) as reader:
        messages = [(m.topic, m.time) for m in reader.read(list(reader.topics))]
    first, last = min(t for _, t in messages), max(t for _, t in messages)
    assert stamps[0] <= first <= last <= stamps[-1] + 100 * TICK, "log times are simulated ones"
    assert last - first > 100 * TICK and {topic.rpartition("/")[2] for topic, _ in messages} >= {"data", "command"}


def test_a_paused_node_first_then_a_controller_that_answers_and_a_second_clock(world):
    watcher = Watcher(world)
    node = world.node(**LOCKSTEP, lockstep__paused=True).until("waiting")
    watcher.stands()
    assert watcher.clock() == S, "at lockstep.start"
    there = seat(world, watcher, answers=True)
    poll(lambda: there.sensed, "the first motion")
    watcher.stands()
    assert there.sensed == [S] and not there.commanded
    assert watcher.ears.ask("pause", False)[0]
    watcher.more(80)
    assert set(b - a for a, b in zip(there.commanded[-50:], there.commanded[-49:])) == {TICK}, "one answer a tick"
    stamps = watcher.stamps()  # from where both ends know of each other: the first may not come
    assert (stamps[0] - S) % TICK == 0 and {b - a for a, b in zip(stamps, stamps[1:])} == {TICK}
    # another clock: held with ERROR until it is gone
    other = watcher.ears.node.create_publisher(Clock, "/clock", 1)
    poll(lambda: watcher.task()[0] == 2, "ERROR")
    assert "held" in watcher.task()[1] and "/tow_sim/ears" in watcher.task()[1]
    held = watcher.figure("step")
    watcher.ears.more("/diagnostics", 3)
    assert watcher.figure("step") == held
    told = S + round(held) * TICK - DELAY  # each step since lockstep.start was a tick
    poll(lambda: watcher.stamps()[-1] == told, f"the tick of step {held:g}; {watcher.stamps()[-1]} is not {told}")
    watcher.ears.node.destroy_publisher(other)
    watcher.more(20)
    poll(lambda: watcher.task()[0] == 0, "OK again")
    assert node.stop() == 0


def test_another_clock_before_the_start_is_refused(monkeypatch):
    """Without a process of its own: what `open` raises fails the configure, as every error there does."""
    others: list = []
    node = SimpleNamespace(
        count_publishers=lambda topic: len(others),
        get_publishers_info_by_topic=lambda topic: others,
        get_name=lambda: "cable_sim",
        get_namespace=lambda: "/tow_sim",
        create_publisher=lambda *what: "publisher",
    )
    learns = iter([None, SimpleNamespace(node_name="player", node_namespace="/")])  # discovery takes a moment
    monkeypatch.setattr(clock_player.time, "sleep", lambda seconds: others.extend(filter(None, [next(learns)])))
    topic = clock_player.ClockTopic(node)
    with pytest.raises(clock_player.ClockTaken, match="/clock is also published by /player.*without --clock"):
        topic.open(SimpleNamespace(lockstep=True))
    assert topic.publisher is None
    others.clear()
    monkeypatch.setattr(clock_player, "DISCOVERY", 0.0)
    topic.open(session := SimpleNamespace(lockstep=True))
    assert topic.publisher == "publisher" and session.publish_clock == topic.publish
    real = clock_player.ClockTopic(node)
    real.open(SimpleNamespace(lockstep=False))
    assert real.publisher is None, "real time publishes no clock"
