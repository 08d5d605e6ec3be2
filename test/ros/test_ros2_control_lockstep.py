"""A controller manager in simulation time against the node in lockstep: who waits for whom, through real topics.

Manager and hardware component are stand-ins, after ros2_control_node.cpp, sleeping_policies.cpp and the component's own
source (test/io/hardware_component.py); each has a node with use_sim_time, as there.
"""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path

import pytest
from conftest import ROOT, ns, poll

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))
import rclpy
from hardware_component import of_urdf
from rclpy.duration import Duration
from rclpy.parameter import Parameter
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState

PERIOD = 20_000_000  # ns, 1 / update_rate of controllers.yaml


class Sensors:
    """A ship that is measured at 50 Hz of /clock, each stamp sent once the clock has come to it."""

    def __init__(self, ears, ship) -> None:
        self.ship, self.next, self.clock = ship, 0, 0
        ears.node.create_subscription(Clock, "/clock", self.on_clock, QoSProfile(depth=10))

    def on_clock(self, message) -> None:
        self.clock = ns(message.clock)
        if not self.next:
            self.next = self.clock - self.clock % PERIOD
        while self.next <= self.clock:
            imu, odom = self.ship.messages(self.next, self.next * 1e-9)
            self.ship.imu.publish(imu)
            self.ship.odom.publish(odom)
            self.next += PERIOD


class Manager:
    """main() of ros2_control_node.cpp with use_sim_time, and one component."""

    def __init__(self, ears, component) -> None:
        self.component, self.kind, self.newest, self.sent, self.cycles = component, JointState, None, 0, 0
        self.on_cycle = lambda cycle: None
        self.begins: list[int] = []  # ns, of its cycles
        sim_time = [Parameter("use_sim_time", value=True)]
        self.node, self.own = (
            rclpy.create_node(name, context=ears.context, parameter_overrides=sim_time)
            for name in ("controller_manager", "winch_by_rate")
        )
        self.publisher = self.own.create_publisher(JointState, component.commands_topic, QoSProfile(depth=1))
        self.own.create_subscription(JointState, component.states_topic, self.on_state, qos_profile_sensor_data)
        for node in (self.node, self.own):
            ears.executor.add_node(node)
        self.period = Duration(nanoseconds=PERIOD)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def on_state(self, message) -> None:
        self.newest = message

    def _run(self) -> None:
        clock = self.node.get_clock()
        while not self._stop.is_set() and not clock.now().nanoseconds:  # wait_until_started()
            time.sleep(0.01)
        while not self._stop.is_set():
            previous = self.begun = clock.now()
            self.begins.append(previous.nanoseconds)
            if self.newest is not None:
                self.component.read(self.newest)
            self.on_cycle(self.cycles)  # update(): the controllers
            self._write()
            self.cycles += 1
            # sleep_for_sim_time(); rclpy's sleep_until stands still where the clock is there before it listens
            while clock.now() < previous + self.period and not self._stop.is_set():
                time.sleep(0.0005)

    def _write(self) -> None:
        fields = self.component.write()
        if fields is not None:
            while self.own.get_clock().now() < self.begun and not self._stop.is_set():
                time.sleep(0.001)  # two nodes, two subscriptions to /clock: the stamp must not be the one before
            message = self.kind(**fields._asdict())
            message.header.stamp = self.own.get_clock().now().to_msg()
            self.publisher.publish(message)
            self.sent += 1

    def stop(self) -> None:
        self._stop.set()
        self._thread.join(15.0)
        assert not self._thread.is_alive(), "the manager hangs in its clock"


def test_a_manager_that_sends_every_command_is_waited_for_and_one_that_does_not_is_silent(world):
    ears = world.ears()
    states = ears.listen(JointState, "winch/state")
    sensors = Sensors(ears, world.ship(ears))
    component = of_urdf(ROOT / "config" / "ros2_control" / "winch_velocity.urdf")
    manager = Manager(ears, component)
    world.closing.insert(0, manager.stop)
    node = world.node(
        time_mode="lockstep", lockstep__rate=0.0, lockstep__wait=0.2, lockstep__command_period=PERIOD * 1e-9
    )

    def wait_at_most(seconds: float) -> None:
        assert ears.set("lockstep.wait", seconds) == ""
        ears.more("/diagnostics", 3)  # from after it

    node.until("running")
    poll(lambda: manager.sent > 20 and ears.task("lockstep")[2].get("controller_spoke") == "true", "NaN, and it spoke")
    wait_at_most(600.0)  # only now: what is sent before both ends have found each other is lost
    missed = ears.task("lockstep")[2]["commands_missed"]
    assert ears.diagnostics()["command"][2]["accepted"] == "0", "it commands nothing, and is waited for"

    # a rate for 3 s of simulation: sent in every cycle, by simulation time, none missed for its own doing
    component.command["payout/velocity"] = 0.3
    rate = lambda message: message.velocity[message.name.index("payout")]  # noqa: E731
    poll(lambda: component.state["payout/velocity"] == pytest.approx(0.3) and rate(states[-1]) == 0.3, "the rate")
    cycles, begun, first = len(manager.begins), len(states), sensors.clock
    poll(lambda: sensors.clock - first > 3 * 10**9, "3 s of simulation")
    *begins, last = manager.begins[cycles:]
    assert len(begins) == pytest.approx((last - begins[0]) / PERIOD, abs=3), "50 Hz of simulation"
    assert set(map(rate, states[begun:])) == {0.3}
    ears.more("/diagnostics", 2)
    level, text, values = ears.task("lockstep")
    assert values["commands_unstamped"] == "0" and values["commands_missed"] == missed and level < 2, text
    assert ears.diagnostics()["command"][2]["newest"] == "rate 0.3 m/s"

    # commands that are equal to the state are not sent: the steps wait, are counted, and it counts as silent
    component.command["payout/velocity"] = 0.0
    poll(lambda: component.state["payout/velocity"] == 0.0, "the stop")
    component.threshold = 1e-5
    wait_at_most(0.2)
    level, text, values = poll(lambda: ears.task("lockstep") if ears.task("lockstep")[0] == 2 else None, "an ERROR")
    assert "the controller is silent" in text and int(values["commands_missed"]) >= 5
    first = sensors.clock
    poll(lambda: sensors.clock - first > 10**9, "the simulation to go on")
