"""A node in real time on one ship: bad input, winch commands, a solver that gives up, services; events, no pace.

Stale motion: test_motion_task.py, and how soon: test_health.py; a clock that jumps: test_session.py,
test_run_is_replay.py.
"""

from __future__ import annotations

import math
import time

import pytest
from conftest import poll

pytest.importorskip("rclpy")


@pytest.fixture(scope="module")
def running(shared_world):
    """A node that runs on a live ship: (world, node, ears, ship); each test leaves it running."""
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseStamped
    from sensor_msgs.msg import JointState

    ears = shared_world.ears()
    ears.listen(DiagnosticArray, "/diagnostics")
    ears.listen(PoseStamped, "towbody/pose")
    ears.listen(JointState, "winch/state")
    ears.listen(JointState, "sim/health")
    ship = shared_world.ship(ears).sail()
    node = shared_world.node().until("running")
    poll(lambda: ears.received["towbody/pose"] and ears.received["/diagnostics"], "poses and diagnostics")
    return shared_world, node, ears, ship


def task(ears, name: str):
    return ears.diagnostics().get(name, (0, "", {}))


def numbers(ears):
    """Every number heard so far."""
    for message in ears.received["towbody/pose"]:
        p, q = message.pose.position, message.pose.orientation
        yield from (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
    for topic in ("winch/state", "sim/health"):
        for message in ears.received[topic]:
            yield from (*message.position, *message.velocity, *message.effort)


def more_poses(ears, count: int, what: str) -> None:
    before = len(ears.received["towbody/pose"])
    poll(lambda: len(ears.received["towbody/pose"]) > before + count, what)


def test_bad_motion_is_refused_and_never_published(running):
    """Said again until it is heard, each with a cause of its own; that each is counted: test/io/test_motion.py."""
    world, node, ears, ship = running

    def spoilt():
        def imu(spoil):
            message, _ = ship.messages(time.time_ns(), 0.0)
            spoil(message)
            ship.imu.publish(message)

        imu(lambda m: setattr(m.linear_acceleration, "x", math.nan))
        imu(lambda m: setattr(m.orientation, "w", 0.0))
        imu(lambda m: setattr(m.header.stamp, "sec", m.header.stamp.sec + 100))
        imu(lambda m: setattr(m.header, "frame_id", "x" * 200_000))
        same, _ = ship.messages(time.time_ns(), 0.0)
        ship.imu.publish(same)
        ship.imu.publish(same)
        causes = {"not_finite", "quaternion", "stamp_off_clock", "size", "stamp_not_advancing"}
        return {f"dropped: {cause}" for cause in causes} <= set(task(ears, "motion")[2])

    poll(spoilt, "five causes in /diagnostics", step=0.2)
    assert "imu of more than 64 kB refused" in node.text and node.state()["state"] == "running"
    assert all(map(math.isfinite, numbers(ears)))


def command(ears, **arrays):
    from sensor_msgs.msg import JointState

    message = JointState(name=arrays.pop("name", ["payout"]))
    for field, values in arrays.items():
        setattr(message, field, values)
    return message


def test_winch_commands(running):
    from sensor_msgs.msg import JointState

    world, node, ears, ship = running
    publisher = ears.publisher(JointState, "winch/command")
    poll(publisher.get_subscription_count, "the node to listen")
    state = ears.received["winch/state"]

    def send_until(message, condition, what):
        poll(lambda: publisher.publish(message) or condition(), what, step=0.05)

    out = state[-1].position[0] + 0.2
    rate = command(ears, velocity=[0.5])
    send_until(rate, lambda: state[-1].velocity[0] == 0.5 and state[-1].position[0] > out, "a rate of 0.5 m/s")
    poll(lambda: "stale" in task(ears, "command")[1] and task(ears, "command")[0] == 1, "the stale command")
    poll(lambda: state[-1].velocity[0] == 0.0, "a silent source holds the winch")
    length = command(ears, position=[1.0], velocity=[math.nan])
    send_until(length, lambda: abs(state[-1].position[0] - 1.0) < 0.01, "a length of 1 m")
    for bad in (
        command(ears, name=["drum"], velocity=[1.0]),
        command(ears, velocity=[1.0, 2.0]),
        command(ears, velocity=[math.nan]),
        command(ears),
        command(ears, effort=[1.0]),
        command(ears, velocity=[math.inf]),
    ):
        publisher.publish(bad)
    causes = {f"refused: {cause}" for cause in ("joint_name", "array_length", "effort_only", "not_finite")}
    poll(lambda: causes <= set(task(ears, "command")[2]), "four causes in /diagnostics")
    poll(lambda: task(ears, "command")[2]["no_command"] == "2", "two that command nothing")
    assert all(map(math.isfinite, numbers(ears)))


def test_a_halt_lasts_until_reset(running):
    from sensor_msgs.msg import JointState
    from std_srvs.srv import Trigger

    world, node, ears, ship = running
    publisher = ears.publisher(JointState, "winch/command")
    poll(publisher.get_subscription_count, "the node to listen")
    fatal = command(ears, position=[-1000.0])  # what the stand-in gives up at; said again until it is heard
    poll(lambda: publisher.publish(fatal) or task(ears, "solver")[0] == 2, "an ERROR of the solver", step=0.05)
    node.until("halted")
    assert "~/reset" in task(ears, "solver")[1]
    answer = ears.call(Trigger, "/tow_sim/cable_sim/reset", Trigger.Request())
    assert answer.success, answer.message
    more_poses(ears, 20, "poses after the reset")


def test_record_service(running):
    from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
    from rcl_interfaces.srv import SetParameters
    from std_srvs.srv import SetBool

    from cable_sim_ros.io.bags.bag import read_bag

    world, node, ears, ship = running
    answer = ears.call(SetBool, "/tow_sim/cable_sim/record", SetBool.Request(data=True))
    assert answer.success, answer.message
    assert not ears.call(SetBool, "/tow_sim/cable_sim/record", SetBool.Request(data=True)).success
    more_poses(ears, 50, "fifty ticks")
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

    def change(*transitions):
        for transition in transitions:
            request = ChangeState.Request(transition=Transition(id=transition))
            assert ears.call(ChangeState, "/tow_sim/cable_sim/change_state", request).success

    change(Transition.TRANSITION_DEACTIVATE)
    node.until("ready")
    change(Transition.TRANSITION_ACTIVATE)
    more_poses(ears, 20, "poses after a second activation")
    change(Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP)
    node.until("unconfigured")
    change(Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE)
    more_poses(ears, 20, "poses after a second configure")
    assert "Traceback" not in node.text
