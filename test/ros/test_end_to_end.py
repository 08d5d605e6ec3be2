"""Player process -> node process -> our own subscriptions, and the recording of it."""

from __future__ import annotations

import math
import signal

import pytest
from conftest import poll

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

TICK = 10_000_000


def stamp(message) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def test_topics_frames_stamps_and_recording(world, bag):
    from diagnostic_msgs.msg import DiagnosticArray
    from geometry_msgs.msg import PoseStamped, WrenchStamped
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import JointState, PointCloud2

    from cable_sim_ros.io.bags.bag import read_bag, read_metadata
    from cable_sim_ros.io.recordings.journal import read_journal

    ears = world.ears()
    pose = ears.listen(PoseStamped, "towbody/pose")
    odom = ears.listen(Odometry, "towbody/odom")
    tension = ears.listen(WrenchStamped, "sheave/tension")
    contact = ears.listen(PointCloud2, "sheave/contact")
    shape = ears.listen(PointCloud2, "cable/shape")
    winch = ears.listen(JointState, "winch/state")
    raw: list[bytes] = []
    ears.node.create_subscription(PoseStamped, "towbody/pose", raw.append, 500, raw=True)
    ears.listen(DiagnosticArray, "/diagnostics")

    path = world.folder / "tow"
    node = world.node(recording__enabled=True, recording__root=str(path.parent), recording__path=path.name).until(
        "waiting"
    )
    player = world.run("cable_sim_ros.cli", "play", str(bag), "--duration", "6")
    node.until("running")
    assert player.wait(20.0) == 0, player.text
    poll(lambda: len(pose) > 400, 10.0, f"400 poses, got {len(pose)}")
    tasks = ears.diagnostics()
    assert node.stop() == 0
    assert "Traceback" not in node.text

    assert {message.header.frame_id for message in pose} == {"odom"}
    assert {(m.header.frame_id, m.child_frame_id) for m in odom} == {("odom", "towbody_link")}
    assert {message.header.frame_id for message in tension} == {"sheave_link"}
    assert {message.header.frame_id for message in contact} == {"sheave_link"}
    assert {message.header.frame_id for message in shape} == {"odom"}
    assert list(winch[0].name) == ["payout", "drum"]
    stamps = [stamp(message) for message in pose]
    assert {b - a for a, b in zip(stamps, stamps[1:])} == {TICK}, "a stamp is missing or off the grid of ticks"
    assert {b - a for a, b in zip(map(stamp, shape), map(stamp, shape[1:]))} == {10 * TICK}
    assert {b - a for a, b in zip(map(stamp, contact), map(stamp, contact[1:]))} == {5 * TICK}
    for message in pose:
        p = message.pose.position
        assert all(map(math.isfinite, (p.x, p.y, p.z)))
    assert max(m.pose.position.z for m in pose) - min(m.pose.position.z for m in pose) > 1.0, "no heave came through"
    assert set(tasks) == {"loop", "inputs", "motion", "command", "solver", "recorder", "neighbours"}
    assert tasks["loop"][2]["state"] == "running"
    assert 90.0 < float(tasks["loop"][2]["rate_hz"]) < 110.0

    metrics = node.state()
    assert metrics["state"] == "stopped" and metrics["last"] == "running"
    assert metrics["latency_p50_ms"] > 25.0  # the input delay is part of it
    assert metrics["recorder"]["errors"] == 0 and metrics["recorder"]["dropped"] == 0
    assert read_metadata(path)["custom_data"]["scene"] == "full_scale"
    (segment,) = read_journal([m.data for m in read_bag(path) if m.topic == "/tow_sim/sim/journal"]).segments
    assert segment.start.time == stamps[0] - TICK or len(pose) < metrics["ticks"]
    assert segment.ticks == metrics["ticks"]
    recorded = {}
    for message in read_bag(path):
        recorded.setdefault(message.topic, []).append(message.data)
    assert {"/tow_sim/imu/data", "/tow_sim/odom", "/diagnostics", "/tow_sim/sim/health"} <= set(recorded)
    assert len(recorded["/tow_sim/towbody/pose"]) == metrics["ticks"], "every tick is recorded"
    assert set(raw) <= set(recorded["/tow_sim/towbody/pose"]), "live bytes and recorded bytes differ"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_node_cleanly(world, number):
    ears = world.ears()
    world.ship(ears).sail()
    from geometry_msgs.msg import PoseStamped

    poses = ears.listen(PoseStamped, "towbody/pose")
    node = world.node().until("running")
    poll(lambda: poses, 15.0, "the first pose")
    assert node.stop(((number, 3.0),)) == 0
    assert "Traceback" not in node.text
    assert "jitter p99" in node.text
    assert node.text.rstrip().splitlines()[-1] == "verdict: ok"
    assert node.state()["state"] == "stopped" and node.state()["verdict"] == {"state": "ok", "reasons": []}


def test_a_signal_during_configure_ends_at_once(world):
    node = world.node()
    poll(node.state, 20.0, "the first state")
    assert node.stop(((signal.SIGTERM, 3.0),)) == 0, node.text
    assert "Traceback" not in node.text


def test_without_a_static_start_nothing_runs(world):
    node = world.node(environment={"FAKE_START_FAILS": "1"})
    assert node.wait(40.0) == 1
    assert "residual 123 N" in node.text
    assert "Traceback" not in node.text


def test_player_imu_only_and_faults(world, bag):
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import Imu

    ears = world.ears()
    imu, odom = ears.listen(Imu, "imu/data"), ears.listen(Odometry, "odom")
    player = world.run(
        "cable_sim_ros.cli", "play", str(bag), "--duration", "2", "--imu-only", "--start", "1", "--keep-stamps"
    )
    assert player.wait(20.0) == 0, player.text
    poll(lambda: len(imu) >= 100, 5.0, f"100 messages, got {len(imu)}")
    assert not odom
    assert stamp(imu[0]) == 1_400_000_001 * 10**9
    absent = world.run("cable_sim_ros.cli", "play", "no_such_bag")
    assert absent.wait(20.0) == 2
    assert "no such bag" in absent.text and "Traceback" not in absent.text
