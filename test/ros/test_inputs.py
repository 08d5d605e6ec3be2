"""A node in real time on one ship: bad input, winch commands, a solver that gives up, services; events, no pace.

Stale motion: test_motion_task.py, and how soon: test_health.py; a clock that jumps: test_session.py,
test_run_is_replay.py.
"""

import math
import time

import pytest
from conftest import poll, recorded
from geometry_msgs.msg import PoseStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from sensor_msgs.msg import JointState


@pytest.fixture(scope="module")
def running(shared_world):
    """A node that runs on a live ship: (world, node, ears, ship); each test leaves it running."""
    ears = shared_world.ears()
    ears.listen(PoseStamped, "towbody/pose")
    ears.listen(JointState, "winch/state")
    ears.listen(JointState, "sim/health")
    ship = shared_world.ship(ears).sail()
    node = shared_world.node().until("running")
    poll(lambda: ears.received["towbody/pose"] and ears.received["/diagnostics"], "poses and diagnostics")
    return shared_world, node, ears, ship


def numbers(ears):
    """Every number heard so far."""
    for message in ears.received["towbody/pose"]:
        p, q = message.pose.position, message.pose.orientation
        yield from (p.x, p.y, p.z, q.x, q.y, q.z, q.w)
    for topic in ("winch/state", "sim/health"):
        for message in ears.received[topic]:
            yield from (*message.position, *message.velocity, *message.effort)


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
        return {f"dropped: {cause}" for cause in causes} <= set(ears.task("motion")[2])

    poll(spoilt, "five causes in /diagnostics", step=0.2)
    assert "imu of more than 64 kB refused" in node.text and node.state()["state"] == "running"
    assert all(map(math.isfinite, numbers(ears)))


def command(ears, **arrays):
    message = JointState(name=arrays.pop("name", ["payout"]))
    for field, values in arrays.items():
        setattr(message, field, values)
    return message


def test_winch_commands(running):
    world, node, ears, ship = running
    publisher = ears.publisher(JointState, "winch/command")
    poll(publisher.get_subscription_count, "the node to listen")
    state = ears.received["winch/state"]

    def send_until(message, condition, what):
        poll(lambda: publisher.publish(message) or condition(), what, step=0.05)

    out = state[-1].position[0] + 0.2
    rate = command(ears, velocity=[0.5])
    send_until(rate, lambda: state[-1].velocity[0] == 0.5 and state[-1].position[0] > out, "a rate of 0.5 m/s")
    poll(lambda: "stale" in ears.task("command")[1] and ears.task("command")[0] == 1, "the stale command")
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
    poll(lambda: causes <= set(ears.task("command")[2]), "four causes in /diagnostics")
    poll(lambda: ears.task("command")[2]["no_command"] == "2", "two that command nothing")
    assert all(map(math.isfinite, numbers(ears)))


def test_a_halt_lasts_until_reset(running):
    world, node, ears, ship = running
    publisher = ears.publisher(JointState, "winch/command")
    poll(publisher.get_subscription_count, "the node to listen")
    fatal = command(ears, position=[-1000.0])  # what the stand-in gives up at; said again until it is heard
    poll(lambda: publisher.publish(fatal) or ears.task("solver")[0] == 2, "an ERROR of the solver", step=0.05)
    node.until("halted")
    assert "~/reset" in ears.task("solver")[1]
    counts = []
    for _ in range(2):  # what was on its way has come by then
        ears.more("/diagnostics", 2)
        counts.append(len(ears.received["towbody/pose"]))
    assert counts[0] == counts[1], "poses are published after the halt"
    done, text = ears.ask("reset")
    assert done, text
    ears.more("towbody/pose", 20)


def test_record_service(running):
    world, node, ears, ship = running
    done, text = ears.ask("record", True)
    assert done, text
    assert not ears.ask("record", True)[0]
    ears.more("towbody/pose", 50)
    done, text = ears.ask("record", False)
    assert done, text
    (bag,) = world.folder.glob("recordings/tow_*")
    assert len(recorded(bag)["/tow_sim/towbody/pose"]) >= 40
    assert not ears.ask("record", False)[0]
    for name in (".", "../x", "x" * 5000):  # none of them ends the node
        assert "is not a name for a recording" in ears.set("recording.path", name)
    assert ears.ask("record", True)[0]
    assert ears.ask("record", False)[0]
    assert len(list(world.folder.glob("recordings/tow_*"))) == 2


def test_life_cycle_by_its_services(running):
    world, node, ears, ship = running

    def change(*transitions):
        for transition in transitions:
            request = ChangeState.Request(transition=Transition(id=transition))
            assert ears.call(ChangeState, "/tow_sim/cable_sim/change_state", request).success

    change(Transition.TRANSITION_DEACTIVATE)
    node.until("ready")
    change(Transition.TRANSITION_ACTIVATE)
    ears.more("towbody/pose", 20)
    change(Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_CLEANUP)
    node.until("unconfigured")
    change(Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE)
    ears.more("towbody/pose", 20)
    assert "Traceback" not in node.text
