"""The hardware component of ros2_control against the node, through real topics, with the URDFs that are shipped.

The component is a stand-in, test/io/hardware_component.py.
"""

from __future__ import annotations

import sys
import threading
import time
from math import isfinite, isnan, nan
from pathlib import Path

import pytest
from conftest import ROOT, poll

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))
import rclpy
from hardware_component import INTERFACES, Component, of_urdf
from rclpy.qos import QoSProfile, qos_profile_sensor_data
from sensor_msgs.msg import JointState

FILES = ROOT / "config" / "ros2_control"
CYCLE = 0.02  # s, 1 / update_rate
TIMEOUT = 1.0  # s; a busy machine holds up a sender for half of it


class Hardware:
    """A component on its topics: read() and write() in turn, as the controller manager calls them."""

    def __init__(self, ears, component: Component) -> None:
        self.component, self.kind, self.node, self.active = component, JointState, ears.node, True
        self.sent: list[float] = []  # when
        self.cycles = 0
        self.newest = None
        # on_init(): QoS(1), which is reliable with depth 1, and SensorDataQoS
        self.publisher = ears.node.create_publisher(JointState, component.commands_topic, QoSProfile(depth=1))
        self.states = ears.node.create_subscription(
            JointState, component.states_topic, lambda m: setattr(self, "newest", m), qos_profile_sensor_data
        )
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while not self._stop.wait(CYCLE):
            if self.newest is not None:
                self.component.read(self.newest)
            if self.active:
                self._write()
            self.cycles += 1

    def _write(self) -> None:
        fields = self.component.write()
        if fields is not None:
            message = self.kind(**fields._asdict())
            message.header.stamp = self.node.get_clock().now().to_msg()  # write(): get_node()->now()
            self.publisher.publish(message)
            self.sent.append(time.monotonic())

    def close(self) -> None:
        self._stop.set()
        self._thread.join(10.0)
        assert not self._thread.is_alive()
        self.node.destroy_publisher(self.publisher)
        self.node.destroy_subscription(self.states)


@pytest.fixture
def tow(world):
    """(ears, node) of a node that runs on the stand-in for the simulator, on a live ship."""
    ears = world.ears()
    ears.listen(JointState, "winch/state")
    node = world.node(winch__command_timeout=TIMEOUT)
    hardware = Hardware(ears, of_urdf(FILES / "winch_velocity.urdf"))  # before the first motion: nothing is refused
    world.closing.insert(0, hardware.close)
    poll(hardware.publisher.get_subscription_count, "the node to listen")
    world.ship(ears).sail()
    node.until("running")
    poll(lambda: ears.task("command")[2].get("no_command", "0") != "0", "the component in /diagnostics")
    return ears, node, hardware


def rates(ears, seconds: float) -> list[float]:
    """Rates of the pay-out [m/s] that come in the seconds from now on."""
    box = ears.received["winch/state"]
    begun = len(box)
    time.sleep(seconds)
    return [message.velocity[message.name.index("payout")] for message in box[begun:]]


@pytest.mark.realtime
def test_a_winch_through_the_life_of_a_controller(tow):
    ears, node, hardware = tow
    it = hardware.component
    # no controller yet: NaN in every cycle
    level, text, values = ears.task("command")
    assert level == 0 and text.startswith("no command yet: the winch holds; ") and "messages without a command" in text
    assert values["accepted"] == "0" and not [key for key in values if key.startswith("refused")]
    poll(lambda: all(isfinite(it.state[f"{joint}/{i}"]) for joint in it.joints for i in INTERFACES), "both joints")

    # a velocity controller: the state is soon equal to the command, and the rate lasts (threshold -1)
    it.command["payout/velocity"] = 0.3
    poll(lambda: it.state["payout/velocity"] == pytest.approx(0.3), "the rate in the state")
    found = rates(ears, 2.5 * TIMEOUT)
    assert len(found) > 50 and set(found) == {0.3}
    level, _, values = ears.task("command")
    assert level == 0 and values["stale"] == "false" and values["newest"] == "rate 0.3 m/s"

    # it is deactivated: on_deactivate() of JointGroupVelocityController writes 0
    it.command["payout/velocity"] = 0.0
    poll(lambda: it.state["payout/velocity"] == 0.0, "the stop")
    assert set(rates(ears, 1.5 * TIMEOUT)) == {0.0} and ears.task("command")[2]["stale"] == "false"

    # the component is emptied while it pays out: the rate runs out
    it.command["payout/velocity"] = 0.3
    poll(lambda: it.state["payout/velocity"] == pytest.approx(0.3), "the rate again")
    it.command["payout/velocity"] = nan
    found = rates(ears, 2.5 * TIMEOUT)
    assert found[0] == 0.3 and found[-1] == 0.0 and found == sorted(found, reverse=True)
    text = poll(lambda: ears.task("command")[1] if ears.task("command")[0] == 1 else "", "a WARN")
    assert "command stale: the newest, rate 0.3 m/s" in text and "is the controller active?" in text

    # the component itself is deactivated: silence, and the same end
    it.command["payout/velocity"] = -0.2
    poll(lambda: it.state["payout/velocity"] == pytest.approx(-0.2), "another rate")
    hardware.active = False
    found = rates(ears, 2.5 * TIMEOUT)
    assert found[0] == -0.2 and found[-1] == 0.0 and found == sorted(found)
    assert "winch command refused" not in node.text


@pytest.mark.realtime
def test_commands_that_are_equal_to_the_state_and_lengths(tow, world):
    ears, node, hardware = tow
    it = hardware.component
    # the default threshold: what is equal is not sent, and the rate runs into its time-out again and again
    it.threshold = 1e-5
    it.command["payout/velocity"] = 0.3
    poll(lambda: it.state["payout/velocity"] == pytest.approx(0.3), "the rate in the state")
    box, begun, sent, cycles = (
        ears.received["winch/state"],
        len(ears.received["winch/state"]),
        len(hardware.sent),
        hardware.cycles,
    )

    def starts() -> int:
        found = [message.velocity[message.name.index("payout")] for message in box[begun:]]
        return sum(now == 0.3 and before == 0.0 for before, now in zip(found, found[1:]))

    poll(lambda: starts() >= 3, "three stops and starts")
    assert len(hardware.sent) - sent < 0.6 * (hardware.cycles - cycles), "most cycles send nothing"
    it.command["payout/velocity"] = 0.0
    poll(lambda: it.state["payout/velocity"] == 0.0, "the stop")
    hardware.active = False

    # lengths, by the other URDF, and equal ones not sent either: it is there and stays there
    lengths = Hardware(ears, of_urdf(FILES / "winch_position.urdf"))
    world.closing.insert(0, lengths.close)
    poll(lengths.publisher.get_subscription_count, "the node to listen")
    other = lengths.component
    other.threshold = 1e-5
    poll(lambda: isfinite(other.state["payout/position"]), "the state")
    assert isnan(other.command["payout/position"])
    other.command["payout/position"] = other.state["payout/position"] + 0.4
    wanted = other.command["payout/position"]
    poll(lambda: abs(other.state["payout/position"] - wanted) <= 1e-5, "the length")
    begun = len(lengths.sent)
    time.sleep(1.0)
    assert len(lengths.sent) - begun <= 2 and other.state["payout/position"] == pytest.approx(wanted, abs=1e-4)
    assert ears.task("command")[2]["newest"].startswith("length") and "winch command refused" not in node.text


def given(world, name: str, *arguments: str) -> dict:
    """Parameters of a node of this name that is started with these arguments, as rcl reads them."""
    context = rclpy.Context()
    rclpy.init(args=["--ros-args", *arguments], context=context, domain_id=world.domain)
    node = rclpy.create_node(name, context=context, automatically_declare_parameters_from_overrides=True)
    found = {key: node.get_parameter(key).value for key in node.get_parameters_by_prefix("")}
    node.destroy_node()
    context.try_shutdown()
    return found


def test_rcl_reads_the_files_as_the_page_gives_them(world):
    for name in ("winch_velocity.urdf", "winch_position.urdf"):
        text = (FILES / name).read_text("utf-8")
        found = given(world, "robot_state_publisher", "-p", f"robot_description:={text}")["robot_description"]
        assert found.split() == text.split() and found.startswith("<?xml")
    file = str(FILES / "controllers.yaml")
    manager = given(world, "controller_manager", "--params-file", file, "-p", "use_sim_time:=true")
    assert manager["update_rate"] == round(1.0 / CYCLE) and manager["use_sim_time"] is True
    assert manager["winch_pid.type"] == "pid_controller/PidController"
    assert given(world, "winch_pid", "--params-file", file)["gains.payout.u_clamp_min"] == -2.0
    assert given(world, "winch_trajectory_pid", "--params-file", file)["command_joints"] == ["winch_pid/payout"]


def test_simulation_time_reaches_the_node_of_the_component_from_the_command_line_alone(world):
    """define_custom_node_options() of hardware_component_interface.cpp gives it nothing but its name."""
    alone = world.folder / "alone.yaml"
    alone.write_text("controller_manager: {ros__parameters: {use_sim_time: true}}")
    manager, component = (
        given(world, name, "--params-file", str(alone)) for name in ("controller_manager", "winch_by_rate")
    )
    assert manager["use_sim_time"] is True and component["use_sim_time"] is False
    assert given(world, "winch_by_rate", "-p", "use_sim_time:=true")["use_sim_time"] is True
