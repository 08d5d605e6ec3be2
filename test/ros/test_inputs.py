"""Bad input at the topics, winch commands, jumps of the clock, a solver that gives up, services."""

from __future__ import annotations

import math
import time

import pytest
from conftest import poll

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros


@pytest.fixture
def running(world):
    """A node that runs on a live ship: (world, node, ears, ship)."""
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseStamped
    from sensor_msgs.msg import JointState

    ears = world.ears()
    ears.listen(DiagnosticArray, "/diagnostics")
    ears.listen(PoseStamped, "towbody/pose")
    ears.listen(JointState, "winch/state")
    ears.listen(JointState, "sim/health")
    ship = world.ship(ears).sail()
    node = world.node().until("running")
    poll(lambda: ears.received["towbody/pose"] and ears.received["/diagnostics"], 115.0, "poses and diagnostics")
    return world, node, ears, ship


def numbers(ears):
    """Every number heard so far."""
    for message in ears.received["towbody/pose"]:
        p, q = message.pose.position, message.pose.orientation
        yield from (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
    for topic in ("winch/state", "sim/health"):
        for message in ears.received[topic]:
            yield from (*message.position, *message.velocity, *message.effort)


def test_bad_motion_is_refused_counted_and_never_published(running):
    world, node, ears, ship = running
    nan, inf = math.nan, math.inf

    def bad_messages():
        for place in range(8):
            imu, odom = ship.messages(time.time_ns(), 0.0)
            if place == 0:
                imu.linear_acceleration.x = nan
            elif place == 1:
                imu.angular_velocity.y = inf
            elif place == 2:
                imu.orientation.w = 0.0
            elif place == 3:
                imu.orientation.w = 2.0
            elif place == 4:
                odom.pose.pose.position.x = nan
            elif place == 5:
                odom.pose.pose.orientation.w = 0.0
            elif place == 6:
                odom.header.stamp.sec -= 100
                imu.header.stamp.sec += 100
            else:
                odom.twist.twist.linear.x = inf
            yield imu, odom

    for imu, odom in bad_messages():
        ship.imu.publish(imu)
        ship.odom.publish(odom)
    same, _ = ship.messages(time.time_ns(), 0.0)
    ship.imu.publish(same)
    ship.imu.publish(same)

    def counted():
        values = ears.diagnostics().get("motion", (0, "", {}))[2]
        return {key: int(value) for key, value in values.items() if key.startswith("dropped")}

    poll(
        lambda: (
            {"dropped: not_finite", "dropped: quaternion", "dropped: stamp_not_advancing", "dropped: stamp_off_clock"}
            <= set(counted())
        ),
        15.0,
        "four causes in /diagnostics",
    )
    assert counted()["dropped: not_finite"] == 4
    assert counted()["dropped: quaternion"] == 3
    assert node.state()["state"] == "running"
    assert all(map(math.isfinite, numbers(ears)))


def test_stale_motion_is_reported_and_taken_up_again(running):
    world, node, ears, ship = running
    ship.silent = {"imu", "odometry"}
    level, text, _ = poll(
        lambda: (lambda m: m if m[0] == 2 else None)(ears.diagnostics().get("motion", (0, "", {}))),
        115.0,
        "an ERROR of the motion",
    )
    assert "stale" in text
    before = len(ears.received["towbody/pose"])
    poll(lambda: len(ears.received["towbody/pose"]) > before + 50, 15.0, "ticks without motion")
    ship.silent = set()
    poll(lambda: ears.diagnostics()["motion"][0] == 0, 115.0, "motion OK again")
    assert all(map(math.isfinite, numbers(ears)))


def test_a_backward_jump_of_the_clock_maps_it_anew(running):
    world, node, ears, ship = running
    ship.shift = -3600 * 10**9
    poll(lambda: ears.diagnostics()["motion"][2].get("clock_jumps") == "1", 115.0, "the jump in /diagnostics")
    node.until("running", 5.0)

    def on_new_clock():
        message = ears.received["towbody/pose"][-1]
        return abs(time.time() - 3600.0 - message.header.stamp.sec) < 3.0

    poll(on_new_clock, 15.0, "poses on the new clock")
    assert node.code is None


def command(ears, **arrays):
    from sensor_msgs.msg import JointState

    message = JointState(name=arrays.pop("name", ["payout"]))
    for field, values in arrays.items():
        setattr(message, field, values)
    return message


def test_winch_commands(running):
    from sensor_msgs.msg import JointState

    world, node, ears, ship = running
    publisher = ears.node.create_publisher(JointState, "winch/command", 10)
    poll(publisher.get_subscription_count, 15.0, "the node to listen")
    state = ears.received["winch/state"]

    def send_until(message, condition, what):
        def once():
            publisher.publish(message)
            return condition()

        poll(once, 115.0, what, step=0.05)

    send_until(
        command(ears, velocity=[0.5]),
        lambda: state[-1].velocity[0] == 0.5 and state[-1].position[0] > 0.2,
        "a rate of 0.5 m/s",
    )
    poll(lambda: ears.diagnostics().get("command", (0,))[0] == 1, 15.0, "the stale command in /diagnostics")
    assert "stale" in ears.diagnostics()["command"][1]
    assert state[-1].velocity[0] == 0.0, "a silent source must hold the winch"
    send_until(
        command(ears, position=[1.0], velocity=[math.nan]),
        lambda: abs(state[-1].position[0] - 1.0) < 0.01,
        "a length of 1 m",
    )

    for bad in (
        command(ears, name=["drum"], velocity=[1.0]),
        command(ears, velocity=[1.0, 2.0]),
        command(ears, velocity=[math.nan]),
        command(ears),
        command(ears, effort=[1.0]),
        command(ears, velocity=[math.inf]),
    ):
        publisher.publish(bad)

    def refused():
        return {key for key in ears.diagnostics()["command"][2] if key.startswith("refused")}

    poll(
        lambda: (
            {"refused: joint_name", "refused: array_length", "refused: effort_only", "refused: not_finite"} <= refused()
        ),
        15.0,
        "four causes in /diagnostics",
    )
    assert ears.diagnostics()["command"][2]["no_command"] == "2"
    assert all(map(math.isfinite, numbers(ears)))


def test_a_halt_stops_the_poses_until_reset(running):
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    world, node, ears, ship = running
    publisher = ears.node.create_publisher(JointState, "winch/command", 10)
    poll(publisher.get_subscription_count, 15.0, "the node to listen")
    fatal = command(ears, position=[-1000.0])  # what the stand-in gives up at; said again until it is heard
    poll(lambda: publisher.publish(fatal) or ears.diagnostics()["solver"][0] == 2, 15.0, "an ERROR of the solver")
    node.until("halted", 5.0)
    assert "~/reset" in ears.diagnostics()["solver"][1]
    count = len(ears.received["towbody/pose"])
    poll(lambda: len(ears.received["/diagnostics"]) >= 3, 15.0, "three seconds")
    assert len(ears.received["towbody/pose"]) == count, "poses are published after the halt"
    answer = ears.call(Trigger, "/tow_sim/cable_sim/reset", Trigger.Request())
    assert answer.success, answer.message
    poll(lambda: len(ears.received["towbody/pose"]) > count + 20, 15.0, "poses after the reset")


def test_record_service(running):
    from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
    from rcl_interfaces.srv import SetParameters
    from std_srvs.srv import SetBool

    from cable_sim_ros.io.bags.bag import read_bag

    world, node, ears, ship = running
    answer = ears.call(SetBool, "/tow_sim/cable_sim/record", SetBool.Request(data=True))
    assert answer.success, answer.message
    assert not ears.call(SetBool, "/tow_sim/cable_sim/record", SetBool.Request(data=True)).success
    count = len(ears.received["towbody/pose"])
    poll(lambda: len(ears.received["towbody/pose"]) > count + 50, 15.0, "fifty ticks")
    answer = ears.call(SetBool, "/tow_sim/cable_sim/record", SetBool.Request(data=False))
    assert answer.success, answer.message
    bags = list(world.folder.glob("recordings/tow_*"))
    assert len(bags) == 1
    assert sum(message.topic == "/tow_sim/towbody/pose" for message in read_bag(bags[0])) >= 40
    assert not ears.call(SetBool, "/tow_sim/cable_sim/record", SetBool.Request(data=False)).success
    for name in (".", "../x", "x" * 5000):  # none of them ends the node
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value=name)
        request = SetParameters.Request(parameters=[Parameter(name="recording.path", value=value)])
        (result,) = ears.call(SetParameters, "/tow_sim/cable_sim/set_parameters", request).results
        assert not result.successful and "is not a name for a recording" in result.reason
    assert ears.call(SetBool, "/tow_sim/cable_sim/record", SetBool.Request(data=True)).success
    assert ears.call(SetBool, "/tow_sim/cable_sim/record", SetBool.Request(data=False)).success
    assert len(list(world.folder.glob("recordings/tow_*"))) == 2


def test_life_cycle_by_its_services(running):
    from lifecycle_msgs.msg import Transition
    from lifecycle_msgs.srv import ChangeState

    world, node, ears, ship = running

    def change(transition):
        request = ChangeState.Request(transition=Transition(id=transition))
        return ears.call(ChangeState, "/tow_sim/cable_sim/change_state", request, within=40.0).success

    assert change(Transition.TRANSITION_DEACTIVATE)
    node.until("ready", 5.0)
    count = len(ears.received["towbody/pose"])
    assert change(Transition.TRANSITION_ACTIVATE)
    poll(lambda: len(ears.received["towbody/pose"]) > count + 20, 15.0, "poses after a second activation")
    assert change(Transition.TRANSITION_DEACTIVATE)
    assert change(Transition.TRANSITION_CLEANUP)
    node.until("unconfigured", 5.0)
    assert change(Transition.TRANSITION_CONFIGURE)
    count = len(ears.received["towbody/pose"])
    assert change(Transition.TRANSITION_ACTIVATE)
    poll(lambda: len(ears.received["towbody/pose"]) > count + 20, 20.0, "poses after a second configure")
    assert "Traceback" not in node.text
    assert node.stop() == 0
