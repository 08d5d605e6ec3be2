"""The node in lockstep among nodes that move on /clock only: sensors and controllers of rclpy with use_sim_time."""

from __future__ import annotations

import math
import threading

import pytest
from conftest import poll

pytest.importorskip("rclpy")

S = 1_000_000_000
TICK = 10_000_000  # ns, of the scene
DELAY = 30_000_000  # ns, input_delay: so far a tick is behind its clock
LOCKSTEP = {"time_mode": "lockstep", "lockstep__rate": 0.0, "lockstep__wait": 5.0, "lockstep__command_period": 0.01}


class Seat:
    """Sensors (IMU and odometry at 50 Hz) and a controller (100 Hz) whose timers move on /clock; a thread spins them.

    answers: the controller answers each winch/state instead of its timer.
    """

    def __init__(self, domain: int, ship, sensors: bool = True, controller: bool = True, answers: bool = False) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.parameter import Parameter
        from sensor_msgs.msg import JointState

        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.ship, self.JointState = ship, JointState
        self.mute = self.deaf = False  # of the controller, of the sensors
        self.sensed: list[int] = []
        self.commanded: list[int] = []
        self.stamp = lambda now: now  # of a command, ns
        self.nodes = []
        for name, wanted in (("sensors", sensors), ("controller", controller)):
            if wanted:
                node = rclpy.create_node(
                    name,
                    context=self.context,
                    namespace="/tow_sim",
                    parameter_overrides=[Parameter("use_sim_time", value=True)],
                )
                self.executor.add_node(node)
                self.nodes.append(node)
                if name == "sensors":
                    self.imu = node.create_publisher(ship.imu.msg_type, "imu/data", 200)
                    self.odom = node.create_publisher(ship.odom.msg_type, "odom", 200)
                    node.create_timer(0.02, lambda node=node: self.sense(node))
                else:
                    self.winch = node.create_publisher(JointState, "winch/command", 10)
                    if answers:
                        node.create_subscription(JointState, "winch/state", lambda _, n=node: self.command(n), 10)
                    else:
                        node.create_timer(0.01, lambda node=node: self.command(node))
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._stop.is_set():
            self.executor.spin_once(timeout_sec=0.02)
        self.executor.shutdown()
        for node in self.nodes:
            node.destroy_node()
        self.context.try_shutdown()

    def sense(self, node) -> None:
        now = node.get_clock().now().nanoseconds
        if self.deaf or not now:
            return
        imu, odom = self.ship.messages(now, now * 1e-9)
        self.imu.publish(imu)
        self.odom.publish(odom)
        self.sensed.append(now)

    def command(self, node) -> None:
        now = node.get_clock().now().nanoseconds
        if self.mute or not now:
            return
        message = self.JointState(name=["payout"], velocity=[0.2 * math.sin(now * 1e-9)])
        stamp = self.stamp(now)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, S)
        self.winch.publish(message)
        self.commanded.append(stamp)

    def close(self) -> None:
        self._stop.set()
        self._thread.join(30.0)
        assert not self._thread.is_alive(), "the thread that spins did not end within 30 s"


class Watcher:
    """What a test looks at: /clock, winch/state, diagnostics; and the services."""

    def __init__(self, world) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from rclpy.serialization import deserialize_message
        from rosgraph_msgs.msg import Clock
        from sensor_msgs.msg import JointState

        self.ears = world.ears()
        self.clocks = self.ears.listen(Clock, "/clock")
        self.states: list = []
        self.ears.hear(
            JointState, "winch/state", lambda data: self.states.append(deserialize_message(data, JointState))
        )
        self.ears.listen(DiagnosticArray, "/diagnostics")

    def task(self, name: str = "lockstep"):
        return self.ears.diagnostics().get(name, (0, "", {}))

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
            before = len(self.clocks)
            poll(lambda: len(self.clocks) > before + times, f"/clock {times} times more")
            return self.ticks(), self.clock()

        assert said() == said()

    def clock(self) -> int:
        return self.clocks[-1].clock.sec * S + self.clocks[-1].clock.nanosec

    def stamps(self) -> list[int]:
        return [m.header.stamp.sec * S + m.header.stamp.nanosec for m in self.states]

    def call(self, name: str, data: bool | None = None):
        from std_srvs.srv import SetBool, Trigger

        if data is None:
            return self.ears.call(Trigger, f"cable_sim/{name}", Trigger.Request())
        return self.ears.call(SetBool, f"cable_sim/{name}", SetBool.Request(data=data))

    def set(self, **parameters) -> None:
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import Parameter

        given = [Parameter(k.replace("__", "."), value=v).to_parameter_msg() for k, v in parameters.items()]
        request = SetParameters.Request(parameters=given)
        for result in self.ears.call(SetParameters, "cable_sim/set_parameters", request).results:
            assert result.successful, result.reason


def seat(world, watcher, **what) -> Seat:
    found = Seat(world.domain, world.ship(watcher.ears), **what)
    world.closing.insert(0, found.close)
    return found


def test_nodes_on_the_clock_in_any_order_pause_step_and_a_controller_that_dies(world):
    """How long a step waits, and at which rate: test_lockstep.py."""
    watcher = Watcher(world)
    there = seat(world, watcher)  # sensors and controller are there before the node
    node = world.node(**LOCKSTEP, lockstep__steps=7, recording__root=str(world.folder)).until("running")
    watcher.more(80)
    assert watcher.call("record", True).success
    watcher.more(100)
    assert set(b - a for a, b in zip(there.sensed[-50:], there.sensed[-49:])) == {2 * TICK}, "no stroke of a timer lost"
    assert set(b - a for a, b in zip(there.commanded[-50:], there.commanded[-49:])) == {TICK}
    poll(lambda: watcher.task()[2].get("controller_spoke") == "true", "the controller in /diagnostics")
    assert watcher.task()[2]["command_period_s"] == "0.010"
    assert watcher.call("pause", True).success
    watcher.stands()
    before = watcher.stamps()[-1]
    assert watcher.call("step").success
    watcher.stands()
    assert watcher.stamps()[-1] == before + 7 * TICK
    assert watcher.call("pause", False).success
    watcher.more(50)
    assert watcher.call("record", False).success
    # the controller stops answering: bounded, counted, ERROR, and the simulation goes on without it
    there.mute = True
    watcher.set(lockstep__wait=0.2)
    poll(lambda: watcher.task()[0] == 2, "ERROR")
    assert "silent" in watcher.task()[1] and watcher.figure("commands_missed_in_row") == 5.0
    watcher.more(50)
    watcher.set(lockstep__wait=5.0)
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
    from cable_sim_ros.io.bags.bag import BagReader

    (path,) = [p for p in world.folder.glob("tow_*") if p.is_dir()]
    with BagReader(path) as reader:
        messages = [(m.topic, m.time) for m in reader.read(list(reader.topics))]
    first, last = min(t for _, t in messages), max(t for _, t in messages)
    assert stamps[0] <= first <= last <= stamps[-1] + 100 * TICK, "log times are simulated ones"
    assert last - first > 100 * TICK and {topic.rpartition("/")[2] for topic, _ in messages} >= {"data", "command"}


def test_a_paused_node_first_then_a_controller_that_answers_and_a_second_clock(world):
    from rosgraph_msgs.msg import Clock

    watcher = Watcher(world)
    node = world.node(**LOCKSTEP, lockstep__paused=True).until("waiting")
    watcher.stands()
    assert watcher.clock() == S, "at lockstep.start"
    there = seat(world, watcher, answers=True)
    poll(lambda: there.sensed, "the first motion")
    watcher.stands()
    assert there.sensed == [S] and not there.commanded
    assert watcher.call("pause", False).success
    watcher.more(80)
    assert set(b - a for a, b in zip(there.commanded[-50:], there.commanded[-49:])) == {TICK}, "one answer a tick"
    stamps = watcher.stamps()  # from where both ends know of each other: the first may not come
    assert (stamps[0] - S) % TICK == 0 and {b - a for a, b in zip(stamps, stamps[1:])} == {TICK}
    # another clock: held with ERROR until it is gone
    other = watcher.ears.node.create_publisher(Clock, "/clock", 1)
    poll(lambda: watcher.task()[0] == 2, "ERROR")
    assert "held" in watcher.task()[1] and "/tow_sim/ears" in watcher.task()[1]
    held = watcher.figure("step")
    said = len(watcher.ears.received["/diagnostics"])
    poll(lambda: len(watcher.ears.received["/diagnostics"]) > said + 2, "two more of /diagnostics")
    assert watcher.figure("step") == held
    told = S + round(held) * TICK - DELAY  # each step since lockstep.start was a tick
    poll(lambda: watcher.stamps()[-1] == told, f"the tick of step {held:g}; {watcher.stamps()[-1]} is not {told}")
    watcher.ears.node.destroy_publisher(other)
    watcher.more(20)
    poll(lambda: watcher.task()[0] == 0, "OK again")
    assert node.stop() == 0


def test_another_clock_before_the_start_is_refused(monkeypatch):
    """Without a process of its own: what `open` raises fails the configure, as every error there does."""
    from types import SimpleNamespace

    from cable_sim_ros.ros.play import clock_player

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
