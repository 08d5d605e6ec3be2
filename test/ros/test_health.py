"""What the node says of its inputs, its pace and its neighbours, and how soon, over real topics."""

import os
import re
import signal
import time

import pytest
import rclpy
from conftest import COMPILED, poll
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

from cable_sim_ros.ros.services.policy import differences
from verification.soak.probe import Probe

pytestmark = [pytest.mark.realtime, COMPILED]

# The definition: a change is on the wire within SOON of its time-out. Twice that here: the tests share the machine
SOON = 0.2


@pytest.fixture
def ears(world):
    class Listener(Probe):
        def first(self, task, condition, since, within, what):
            """First status of a task after a time that condition(level, message, values) holds for."""
            return poll(lambda: [t for t in self.tasks(task, since) if condition(*t[1:])], what, within)[0]

    it = Listener(world.domain, "ears")
    world.closing.append(it.close)
    it.watch()
    it.listen(JointState, "sim/inputs")
    return it


def silenced(ears, ship, names, task, level, allowed):
    """First status of that level after these inputs fell silent, within the seconds allowed in one of four tries.

    A machine that is busy with something else delays one try, not all."""
    for _ in range(4):
        ship.silent, stopped = set(names), time.monotonic()
        found = ears.first(task, lambda at, *_: at == level, stopped, 10.0, f"level {level} of {task}")
        ship.silent = set()
        for name in ("inputs", "motion"):
            ears.first(name, lambda at, *_: at == 0, time.monotonic(), 30.0, f"{name} OK again")
        late = found.at - stopped
        if late < allowed:
            return found
    pytest.fail(f"{task} says that {names} are silent {late:.3f} s after the last, at best; {allowed:g} s are allowed")


def test_a_silent_input_is_seen_at_once_each_by_itself(world, ears):
    ship = world.ship(ears)
    ship.sail()
    world.node().until("running")
    poll(lambda: any(task.message == "fresh" for task in ears.tasks("inputs")), "fresh inputs")

    _, *_, text, values = silenced(ears, ship, {"odometry"}, "inputs", 1, 0.5 + SOON)
    assert re.search(r"odometry silent for 0\.[5-9] s; the IMU alone gives the motion", text), "said when it is written"
    assert values["odometry_stale"] == "true"
    assert values["imu_stale"] == "false"
    _, *_, text, values = silenced(ears, ship, {"imu"}, "inputs", 1, 0.5 + SOON)
    assert re.search(r"imu silent for 0\.[5-9] s", text) and values["odometry_stale"] == "false"
    _, *_, text, _ = silenced(ears, ship, {"imu", "odometry"}, "inputs", 2, 0.5 + SOON)
    assert "no motion is known" in text
    # the tick is input_delay behind, and may be as much older as a sample
    silenced(ears, ship, {"imu", "odometry"}, "motion", 2, 0.5 + 0.1 + SOON)

    rate = JointState(name=["payout"], velocity=[0.1])
    publisher = ears.node.create_publisher(JointState, "winch/command", 10)
    poll(publisher.get_subscription_count, "the node to listen")
    late = []
    while not late or (late[-1] >= 0.5 + 0.03 + SOON and len(late) < 4):
        for _ in range(30):
            publisher.publish(rate)
            time.sleep(0.02)
        stopped = time.monotonic()
        at, *_, text, values = ears.first("inputs", lambda level, *_: level == 1, stopped, 10.0, "WARN of the command")
        late.append(at - stopped)
    assert "command silent" in text and late[-1] < 0.5 + 0.03 + SOON, late

    ages = ears.received["sim/inputs"]
    times = [at for at, _ in ages]
    gaps = sorted(b - a for a, b in zip(times, times[1:]))
    assert gaps[len(gaps) // 2] < 0.1, "sim/inputs comes 20 times a second"
    newest = ages[-1][1]
    assert list(newest.name) == ["imu", "odometry", "command"] and list(newest.effort) == [0.0, 0.0, 1.0]
    assert 40.0 < newest.velocity[0] < 60.0 and newest.position[2] > 0.5 and 0.0 <= newest.position[0] < 0.2


def test_a_process_that_stood_still_says_so_and_goes_on(world, ears):
    ship = world.ship(ears)
    ship.sail()
    node = world.node().until("running")
    time.sleep(0.5)
    for number, seconds in enumerate((0.3, 3.0), 1):
        os.kill(node.pid, signal.SIGSTOP)
        time.sleep(seconds)
        os.kill(node.pid, signal.SIGCONT)
        woken = time.monotonic()
        said = f"({number} times so far)"
        _, *_, text, values = ears.first("loop", lambda _, t, __, said=said: said in t, woken, 3.0, "the standstill")
        assert seconds - 0.1 < float(text.removeprefix("the process stood still for ").split(" s, ")[0]) < seconds + 1.0
        assert values["standstills"] == str(number)
        time.sleep(0.5)
    metrics = ears.first("loop", lambda *_: True, time.monotonic(), 3.0, "figures").values
    assert metrics["clock_jumps"] == "0", "what was sent meanwhile looks like a jump of the clock"
    assert metrics["skips_ahead"] == "1" and float(metrics["lag_ms"]) < 500.0 and metrics["state"] == "running"
    assert metrics["resets"] == "0" and node.stop() == 0


def test_a_model_too_big_is_overloaded_at_once_and_never_starts_anew(world, ears):
    ship = world.ship(ears)
    ship.sail()
    node = world.node(environment={"FAKE_WORK": "3000000"}, realtime__max_lag=1.0).until("running")
    begun = time.monotonic() + 0.3  # the first tick is due a little after the start
    at, *_, text, values = ears.first("loop", lambda level, *_: level == 2, 0.0, 5.0, "an ERROR of the loop")
    assert at - begun < 5.0
    assert "overloaded: simulated time passes at 0." in text and values["state"] == "overloaded"
    poll(lambda: ears.tasks("loop")[-1].at - at >= 2.5, "three seconds of it")
    values = ears.first("loop", lambda *_: True, time.monotonic(), 3.0, "figures").values
    assert values["state"] == "overloaded" and values["resets"] == "0" and int(values["skips_ahead"]) >= 1
    assert 0.0 < float(values["real_time_factor"]) < 0.9 and values["overloads"] == "1"
    assert node.text.count("] [tow_sim.cable_sim]: overloaded") == 1
    assert node.stop() == 0
    metrics = node.state()
    assert metrics["overloaded_s"] > 2.0 and 0.0 < metrics["min_real_time_factor"] < 0.9


def test_neighbours_are_warned_of_and_giants_refused(world, ears):
    ship = world.ship(ears)
    ship.sail()
    node = world.node(environment={"ROS_AUTOMATIC_DISCOVERY_RANGE": ""}).until("running")
    assert "discovery: this host only; --open or ROS_AUTOMATIC_DISCOVERY_RANGE=SUBNET opens it" in node.text
    imu, _ = ship.messages(time.time_ns(), 0.0)
    imu.header.frame_id = "x" * 200_000
    poll(
        lambda: ship.imu.publish(imu) or any("dropped: size" in task.values for task in ears.tasks("motion")),
        "a giant refused",
        step=0.2,
    )
    assert "imu of more than 64 kB refused" in node.text
    poll(lambda: any(task.level == 0 for task in ears.tasks("neighbours")), "nobody else")
    assert differences(ears.node) == [], "config/sros2/policy.xml is not what the node has"
    spoof = ears.node.create_publisher(PoseStamped, "towbody/pose", 10)
    begun = time.monotonic()
    _, *_, text, _ = ears.first("neighbours", lambda level, *_: level == 1, begun, 8.0, "the spoof")
    assert "/tow_sim/towbody/pose is also published by /tow_sim/ears" in text
    poll(lambda: node.text.count("/tow_sim/towbody/pose is also published") == 1, "one line in the log")
    ears.node.destroy_publisher(spoof)
    ears.first("neighbours", lambda level, *_: level == 0, time.monotonic(), 10.0, "gone again")
    twin = rclpy.create_node("cable_sim", context=ears.context, namespace="/tow_sim")
    try:
        *_, text, _ = ears.first("neighbours", lambda level, *_: level == 1, time.monotonic(), 10.0, "the twin")
        assert text.startswith("2 nodes have the name /tow_sim/cable_sim")
    finally:
        twin.destroy_node()
    assert node.text.count("also published") == 1 and node.stop() == 0
