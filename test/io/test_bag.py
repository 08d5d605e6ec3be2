"""Bags: what goes in comes out, whoever reads it, and a cut-off bag loses at most a second."""

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from synthetic import make_frames, serialize, write_run

from cable_sim_ros.io.bags.bag import BagError, BagWriter, Damage, Message, read_bag, read_metadata
from cable_sim_ros.io.bags.typestore import definition, type_hash
from cable_sim_ros.io.messages.channels import CHANNELS, Context, decode
from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.io.recordings.recorder import Recorder
from cable_sim_ros.io.recordings.recovery import recover

pytestmark = pytest.mark.trust

ROOT = Path(__file__).parents[2]
HEALTH = CHANNELS[-1]
JOINT = HEALTH.msgtype
DATA = serialize(HEALTH, make_frames(1)[0], None, None, Context())
SECOND = 10**9


def run_child(code: str, *args, **popen):
    return subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(code), *map(str, args)],
        text=True,
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=dict(os.environ),
        **popen,
    )


# ---- round trips


@given(
    st.lists(
        st.tuples(st.sampled_from(["/a", "/b/c"]), st.integers(0, 2**62), st.binary(min_size=4, max_size=64)),
        max_size=30,
    )
)
@settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_what_is_added_is_read_in_order_of_time(tmp_path_factory, messages):
    path = tmp_path_factory.mktemp("bag") / "run"
    with BagWriter(path) as writer:
        for topic, when, data in messages:
            writer.add(topic, JOINT, when, data)
    read = list(read_bag(path))
    assert sorted(read) == sorted(Message(topic, JOINT, when, data) for topic, when, data in messages)
    assert [m.time for m in read] == sorted(m.time for m in read)
    info = read_metadata(path)
    assert info["message_count"] == len(messages)
    if messages:
        times = [when for _, when, _ in messages]
        assert info["starting_time"]["nanoseconds_since_epoch"] == min(times)
        assert info["duration"]["nanoseconds"] == max(times) - min(times)


def test_run_reads_back_with_rosbags_and_with_mcap(tmp_path):
    frames = write_run(tmp_path / "run", 1.0)
    with Reader(tmp_path / "run") as reader:
        assert reader.message_count == 5 * 100 + 20 + 10
        assert {c.topic for c in reader.connections} == {Context().topic(c) for c in CHANNELS}
    with AnyReader([tmp_path / "run"]) as reader:
        x = [
            reader.deserialize(data, connection.msgtype).pose.position.x
            for connection, _, data in reader.messages()
            if connection.topic == "/tow_sim/towbody/pose"
        ]
    assert x == frames["body_position"][:, 0].tolist()
    with open(tmp_path / "run" / "run_0.mcap", "rb") as file:
        reader = make_reader(file)
        assert reader.get_header().profile == "ros2"
        for schema, channel, message in reader.iter_messages():
            row = next(c for c in CHANNELS if channel.topic == Context().topic(c))
            assert (schema.name, schema.encoding, channel.message_encoding) == (row.msgtype, "ros2msg", "cdr")
            assert schema.data.decode() == definition(row.msgtype)
            assert channel.metadata["topic_type_hash"] == type_hash(row.msgtype)
            assert message.publish_time == message.log_time == decode(row, message.data)["time"]
        (record,) = reader.iter_metadata()
    assert record.name == "rosbag2"
    inner = yaml.safe_load(record.metadata["serialized_metadata"])
    assert inner == read_metadata(tmp_path / "run")


def test_load_run_gives_back_the_frames(tmp_path):
    frames = write_run(tmp_path / "run", 0.5, model="12")
    run = load_run(tmp_path / "run")
    assert run.frames.tobytes() == frames.tobytes()
    assert (len(run.shapes), len(run.contacts)) == (5, 10)
    assert run.shapes[1][0] == frames["time"][10] and run.shapes[1][1].shape == (41, 5)
    assert run.contacts[1][0] == frames["time"][5] and run.contacts[1][1].shape == (40, 9)
    assert run.custom_data == {"scene": "made-up tow", "model": "12"}


def test_bag_without_frames_is_no_run(tmp_path):
    with BagWriter(tmp_path / "imu") as writer:
        writer.add("/imu/data", "sensor_msgs/msg/Imu", 1, b"\0\1\0\0")
    with pytest.raises(BagError, match="has no topic 'sim/health'"):
        load_run(tmp_path / "imu")


def test_metadata_is_what_rosbag2_writes(tmp_path):
    write_run(tmp_path / "run", 0.2)
    info = yaml.safe_load((tmp_path / "run" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert " ".join(info) == (
        "version storage_identifier duration starting_time message_count topics_with_message_count compression_format "
        "compression_mode relative_file_paths files custom_data ros_distro"
    )
    assert (info["version"], info["storage_identifier"], info["compression_mode"]) == (9, "mcap", "")
    assert info["relative_file_paths"] == ["run_0.mcap"] == [file["path"] for file in info["files"]]
    topic = info["topics_with_message_count"][0]
    assert topic["message_count"] == 20
    assert topic["topic_metadata"]["offered_qos_profiles"][0]["reliability"] == "reliable"
    assert topic["topic_metadata"]["type_description_hash"].startswith("RIHS01_")
    assert "&" not in (tmp_path / "run" / "metadata.yaml").read_text()  # no YAML anchors


def test_same_messages_same_bytes(tmp_path):
    for parent in ("one", "two"):
        write_run(tmp_path / parent / "run", 2.0)
        time.sleep(0.01)
    for name in ("run_0.mcap", "metadata.yaml"):
        assert (tmp_path / "one/run" / name).read_bytes() == (tmp_path / "two/run" / name).read_bytes()


# ---- refusals


def test_existing_bag_is_not_overwritten(tmp_path):
    write_run(tmp_path / "run", 0.1)
    before = (tmp_path / "run" / "run_0.mcap").read_bytes()
    for make in (BagWriter, Recorder):
        with pytest.raises(BagError, match=r"run' exists already: it is not overwritten.*give another path"):
            make(tmp_path / "run")
    assert (tmp_path / "run" / "run_0.mcap").read_bytes() == before


def test_wrong_messages_are_refused(tmp_path):
    writer = BagWriter(tmp_path / "run")
    writer.add("/a", JOINT, 1, DATA)
    with pytest.raises(ValueError, match="topic '/a' was recorded as sensor_msgs/msg/JointState and now comes as"):
        writer.add("/a", "sensor_msgs/msg/Imu", 2, DATA)
    with pytest.raises(ValueError, match="time -1 ns of a message of '/a' is negative"):
        writer.add("/a", JOINT, -1, DATA)
    with pytest.raises(ValueError, match="message type 'a/msg/B' is not known"):
        writer.add("/b", "a/msg/B", 2, DATA)
    writer.close()
    writer.close()
    with pytest.raises(BagError, match="is closed: a message of '/a' was not recorded"):
        writer.add("/a", JOINT, 3, DATA)
    assert [m.topic for m in read_bag(tmp_path / "run")] == ["/a"]


@pytest.mark.parametrize("content", [None, "", "a: [", "x: 1"])
def test_what_is_no_bag_is_named(tmp_path, content):
    if content is not None:
        (tmp_path / "metadata.yaml").write_text(content)
    with pytest.raises(BagError, match="nothing was read|cannot be read"):
        list(read_bag(tmp_path))
    with pytest.raises(BagError, match="is not a bag directory"):
        read_metadata(tmp_path)
    with pytest.raises(BagError, match="holds no .mcap file: nothing to recover"):
        recover(tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


# ---- recorder


def test_recorder_writes_everything(tmp_path):
    with Recorder(tmp_path / "run", custom_data={"a": "b"}) as recorder:
        recorder.declare("/a", JOINT, "sensor")
        recorder.declare("/never", JOINT, "reliable")
        for k in range(500):
            recorder.put("/a", JOINT, k, DATA, k + 7)
    stats = recorder.close()
    assert (stats.written, stats.dropped, stats.errors, stats.waiting) == (500, 0, 0, 0)
    assert [m.time for m in read_bag(tmp_path / "run")] == list(range(500))
    info = read_metadata(tmp_path / "run")
    assert info["custom_data"] == {"a": "b"}
    topics = {row["topic_metadata"]["name"]: row for row in info["topics_with_message_count"]}
    assert topics["/a"]["topic_metadata"]["offered_qos_profiles"][0]["reliability"] == "best_effort"
    assert topics["/never"]["message_count"] == 0


def test_full_queue_drops_the_oldest_and_counts(tmp_path):
    recorder = Recorder(tmp_path / "run", queue_size=10, poll_s=30.0)  # the thread sleeps until closed
    for k in range(25):
        recorder.put("/a", JOINT, k, DATA)
    assert recorder.stats()[:4] == (0, 15, 10, 10)
    stats = recorder.close()
    assert (stats.written, stats.dropped) == (10, 15)
    assert [m.time for m in read_bag(tmp_path / "run")] == list(range(15, 25))


def test_one_bad_message_is_counted_and_the_rest_recorded(tmp_path):
    with Recorder(tmp_path / "run") as recorder:
        recorder.declare("/b", "a/msg/B")
        for when in (1, -5, 2):
            recorder.put("/a", JOINT, when, DATA)
    stats = recorder.close()
    assert (stats.written, stats.dropped, stats.errors) == (2, 1, 2)
    assert "time -5 ns of a message of '/a' is negative" in stats.error


def test_closed_recorder_takes_nothing_and_says_so(tmp_path):
    recorder = Recorder(tmp_path / "run")
    recorder.close()
    recorder.put("/a", JOINT, 1, DATA)
    assert (recorder.stats().written, recorder.stats().dropped) == (0, 1)


def test_stuck_disk_does_not_hold_up_the_end(tmp_path):
    recorder, free = Recorder(tmp_path / "run", poll_s=0.001), threading.Event()
    add = recorder.writer.add
    recorder.writer.add = lambda *item: (free.wait(), add(*item))
    recorder.put("/a", JOINT, 1, DATA)
    stats = recorder.close(timeout=0.02)
    free.set()
    assert stats.errors == 1 and "the disk did not take the last messages within 0.02 s" in stats.error
    assert recorder.close(timeout=60.0).written == 1  # it was late, not lost


FULL_DISK = """
    import os, resource, signal, sys, time
    from cable_sim_ros.io.recordings.recorder import Recorder
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))
    recorder = Recorder(sys.argv[1], flush_s=0.01, poll_s=0.002)
    for k in range(4000):   # the feeding side goes on at its pace, whatever the disk does
        recorder.put("/a", "sensor_msgs/msg/JointState", k, os.urandom(200))
        if k % 20 == 0:
            time.sleep(0.002)
    print(*recorder.close(), sep="|")
"""


def test_full_disk_ends_the_recording_and_nothing_else(tmp_path):
    child = run_child(FULL_DISK, tmp_path / "run")
    out, err = child.communicate(timeout=600)
    assert child.returncode == 0, err
    written, dropped, waiting, _, errors, error, *_ = out.strip().split("|")
    assert int(written) + int(dropped) == 4000 and int(waiting) == 0
    assert 0 < int(written) < 400 and int(errors) == 1
    assert "File too large" in error and "the simulation goes on unrecorded" in error
    saved = recover(tmp_path / "run", tmp_path / "saved")
    assert saved.messages == int(written)
    assert [m.time for m in read_bag(tmp_path / "saved")] == list(range(saved.messages))


# ---- crash

ENDLESS = """
    import sys, time
    from cable_sim_ros.io.recordings.recorder import Recorder
    recorder = Recorder(sys.argv[1], custom_data={"scene": "s"})
    data = bytes.fromhex(sys.argv[2])
    while True:
        now = time.time_ns()
        recorder.put("/tow_sim/sim/health", "sensor_msgs/msg/JointState", now, data)
        print(now, flush=True)
        time.sleep(0.05)
"""


def test_what_is_in_memory_is_a_second_old_at_most(tmp_path, monkeypatch):
    """By the clock of the recording thread, which stands still but for us."""
    now, reads, flushes = [0.0], [], []

    def monotonic():
        reads.append(now[0])
        return now[0]

    flush = BagWriter.flush
    monkeypatch.setattr("cable_sim_ros.io.recordings.recorder.time", SimpleNamespace(monotonic=monotonic))
    monkeypatch.setattr(BagWriter, "flush", lambda self: (flushes.append(now[0]), flush(self)))
    with Recorder(tmp_path / "run", poll_s=0.001):
        for now[0] in (100.0, 101.0, 101.5, 102.0):
            while reads.count(now[0]) < 4:  # two turns at least
                time.sleep(0.001)
        assert [at for at in flushes if at > 100.0] == [101.0, 102.0]  # until then by when the thread began


def test_killed_recording_loses_its_end_alone(tmp_path):
    child = run_child(ENDLESS, tmp_path / "run", DATA.hex())
    first = last = int(child.stdout.readline())
    written = tmp_path / "run" / "run_0.mcap"
    while last - first < 3 * SECOND or written.stat().st_size < 4 * len(DATA):
        last = int(child.stdout.readline())
    child.send_signal(signal.SIGKILL)
    child.communicate()
    damage = Damage()
    cut_off = list(read_bag(tmp_path / "run", damage))
    assert "ends without its index, as of a recording that was cut off" in str(damage)
    saved = recover(tmp_path / "run", tmp_path / "saved")
    messages = list(read_bag(tmp_path / "saved"))
    assert messages == cut_off
    assert len(messages) == saved.messages and messages[0].time == first
    assert all(m.data == DATA for m in messages)
    assert str(saved.damage) == str(damage)
    assert read_metadata(tmp_path / "saved")["custom_data"] == {"scene": "s"}


def test_recovery_at_any_cut_gives_whole_messages(tmp_path):
    with BagWriter(tmp_path / "run", chunk_size=2000) as writer:
        for k in range(200):
            writer.add("/a", JOINT, k, DATA[:100])
    file = tmp_path / "run" / "run_0.mcap"
    whole, counts = file.read_bytes(), []
    for cut in np.linspace(30, len(whole), 12).astype(int):
        file.write_bytes(whole[:cut])
        try:
            counts.append(recover(file, tmp_path / f"cut{cut}").messages)
        except BagError as error:
            assert "holds no message" in str(error) and not (tmp_path / f"cut{cut}").exists()
            counts.append(0)
            continue
        assert [m.time for m in read_bag(tmp_path / f"cut{cut}")] == list(range(counts[-1]))
    assert counts == sorted(counts) and counts[0] == 0 and counts[-1] == 200 and len(set(counts)) > 5


def test_recovery_of_a_whole_bag_changes_nothing(tmp_path):
    write_run(tmp_path / "run", 0.3)
    saved = recover(tmp_path / "run", tmp_path / "again" / "run")
    assert not saved.damage and saved.duration == pytest.approx(0.29)
    for name in ("run_0.mcap", "metadata.yaml"):
        assert (tmp_path / "run" / name).read_bytes() == (tmp_path / "again" / "run" / name).read_bytes()
