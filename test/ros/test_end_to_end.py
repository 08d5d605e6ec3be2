"""Player process -> node process -> our own subscriptions, and the recording of it, in lockstep: nothing is lost."""

import math
import signal

import pytest
from conftest import ns, poll, recorded
from geometry_msgs.msg import PoseStamped, WrenchStamped
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState, PointCloud2

from cable_sim_ros.io.bags.bag import read_metadata
from cable_sim_ros.io.recordings.journal import read_journal

TICK = 10_000_000


@pytest.mark.trust
def test_topics_frames_stamps_and_recording(world, bag):
    ears = world.ears()
    kinds = {"towbody/pose": PoseStamped, "towbody/odom": Odometry, "sheave/tension": WrenchStamped}
    kinds |= {"sheave/contact": PointCloud2, "cable/shape": PointCloud2, "winch/state": JointState}
    heard = {topic: ears.listen(kind, topic, raw=True) for topic, kind in kinds.items()}
    path = world.folder / "tow"
    recording = {"recording__enabled": True, "recording__root": str(path.parent), "recording__path": path.name}
    node = world.node(
        time_mode="lockstep", lockstep__rate=0.0, lockstep__wait=600.0, publish__marker_rate=0.0, **recording
    ).until("waiting")
    player = world.run("cable_sim_ros.cli", "play", str(bag), "--duration", "2", "--lockstep")
    assert player.wait(600.0) == 0, player.text
    poll(lambda: all(heard.values()), "every topic")
    assert "/tow_sim/cable/markers" not in dict(ears.node.get_topic_names_and_types()), "switched off"
    tasks = poll(lambda: (tasks := ears.diagnostics()) and tasks["loop"][2]["state"] == "running" and tasks)
    assert set(tasks) == {"loop", "lockstep", "inputs", "motion", "command", "solver", "recorder", "neighbours"}
    assert node.stop() == 0
    assert "Traceback" not in node.text and "cable/markers" not in node.text

    metrics = node.state()
    assert metrics["state"] == "stopped" and metrics["last"] == "running" and metrics["ticks"] > 150
    assert metrics["recorder"]["errors"] == 0 and metrics["recorder"]["dropped"] == 0
    assert read_metadata(path)["custom_data"]["scene"] == "full_scale"
    bytes_of = recorded(path)
    assert {"/tow_sim/imu/data", "/tow_sim/odom", "/diagnostics", "/tow_sim/sim/health"} <= set(bytes_of)
    tow = {}
    for topic, kind in kinds.items():
        written = bytes_of[f"/tow_sim/{topic}"]
        padded = {data + bytes(-len(data) % 4) for data in written}  # as the wire does, to four bytes
        assert set(heard[topic]) <= padded, f"{topic}: live and recorded bytes differ"
        tow[topic] = [deserialize_message(data, kind) for data in written]
    assert len(tow["towbody/pose"]) == metrics["ticks"], "every tick is recorded"
    for topic, ticks in (("towbody/pose", 1), ("sheave/contact", 5), ("cable/shape", 10)):
        times = [ns(message.header.stamp) for message in tow[topic]]
        assert {b - a for a, b in zip(times, times[1:])} == {ticks * TICK}, topic
    frames = {topic: {message.header.frame_id for message in messages} for topic, messages in tow.items()}
    assert frames["towbody/pose"] == frames["towbody/odom"] == frames["cable/shape"] == {"odom"}
    assert frames["sheave/tension"] == frames["sheave/contact"] == {"sheave_link"}
    assert {message.child_frame_id for message in tow["towbody/odom"]} == {"towbody_link"}
    assert list(tow["winch/state"][0].name) == ["payout", "drum"]
    places = [message.pose.position for message in tow["towbody/pose"]]
    assert all(math.isfinite(x) for p in places for x in (p.x, p.y, p.z))
    assert max(p.z for p in places) - min(p.z for p in places) > 0.5, "no heave came through"
    (segment,) = read_journal(bytes_of["/tow_sim/sim/journal"]).segments
    assert segment.start.time == ns(tow["towbody/pose"][0].header.stamp) - TICK and segment.ticks == metrics["ticks"]


def test_a_signal_during_configure_ends_at_once(world):
    node = world.node()
    poll(node.state, "the first state")
    assert node.stop(((signal.SIGTERM, 600.0),)) == 0, node.text
    assert "Traceback" not in node.text


def test_the_player_keeps_stamps_and_leaves_odometry_out(world, bag):
    ears = world.ears()
    imu, odom = ears.listen(Imu, "imu/data"), ears.listen(Odometry, "odom")
    part = ("--duration", "2", "--imu-only", "--start", "1", "--keep-stamps")
    player = world.run("cable_sim_ros.cli", "play", str(bag), *part)
    assert player.wait(600.0) == 0, player.text
    assert "played 101 messages" in player.text and not odom
    poll(lambda: imu, "a message")
    assert 1 <= ns(imu[0].header.stamp) * 1e-9 - 1_400_000_000 <= 3
