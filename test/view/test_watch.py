"""Beside a node: there is none, another namespace, another type, one that stops; what it shows is what was sent."""

import os
import time

import numpy as np
import pytest

from cable_sim_ros.errors import CODE_FAILED, CODE_INPUT

pytest.importorskip("rclpy")
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import JointState, PointCloud2
from std_msgs.msg import String


@pytest.fixture
def domain(monkeypatch):
    from cable_sim_ros.testing.domain import reserve

    ours = reserve()
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ours.number))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    yield ours.number
    ours.close()


def refused(words):
    """What is said of /tow_sim within 1 s; once more with longer where the neighbour was not found so soon."""
    from cable_sim_ros.ros.watcher import WatchError, watching

    for wait in (1.0, 10.0, 60.0):
        with pytest.raises(WatchError) as error, watching("/tow_sim", wait, lambda: True):
            pass
        if words in str(error.value):
            break
    return str(error.value), error.value.exit_code


@pytest.fixture
def neighbour(domain):
    from cable_sim_ros.ros.client import Client

    client = Client(domain, f"neighbour_{os.getpid()}")
    yield client
    client.close()


def test_no_node_is_said(domain):
    words = "nothing publishes /tow_sim/sim/health within 1 s"
    text, code = refused(words)
    assert words in text and "cable-sim node" in text
    assert code == CODE_FAILED


@pytest.mark.parametrize(
    "kind, topic, words, more",
    [
        (JointState, "/other/sim/health", "There is one in /other: give --namespace /other", ""),
        (JointState, "/tow_sim/sim/health", "no message came within", "waits for motion"),
        (String, "/tow_sim/sim/health", "std_msgs/msg/String", "not sensor_msgs/msg/JointState"),
    ],
    ids=["another namespace", "says nothing", "another type"],
)
def test_what_another_node_publishes_is_said(neighbour, kind, topic, words, more):
    neighbour.publisher(kind, topic)
    text, _ = refused(words)
    assert words in text and more in text


@pytest.mark.parametrize("text", ["-1", "233", "abc"])
def test_a_domain_that_is_none_is_refused(monkeypatch, text):
    from cable_sim_ros.ros.watcher import WatchInputError, domain

    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(WatchInputError, match="from 0 to 232") as error:
        domain()
    assert error.value.exit_code == CODE_INPUT


def test_what_is_watched_is_what_was_sent(neighbour, bag, run):
    """Messages of a recording, sent again; damaged ones among them are said and the rest goes on."""
    from cable_sim_ros.io.bags.bag import BagReader
    from cable_sim_ros.ros.watcher import watching

    kinds = {"sim/health": JointState, "cable/shape": PointCloud2, "sheave/contact": PointCloud2}
    with BagReader(bag) as reader:
        messages = [(name, m.data) for m in reader for name in kinds if m.topic == f"/tow_sim/{name}"]
    publishers = {name: neighbour.publisher(kind, f"/tow_sim/{name}") for name, kind in kinds.items()}

    def send(part):
        for name, data in part:
            publishers[name].publish(deserialize_message(bytes(data), kinds[name]))
            time.sleep(0.002)

    waits = [0]

    def alive():
        waits[0] += 1
        if waits[0] % 10 == 0:
            send(messages[:3])
        return True

    last, frames, ticks = run.moment(len(run) - 1), [], []

    def all_came():
        """The last tick, whose three messages come one after the other."""
        tick, time_ns = ticks[-1] if ticks else None, last.frame["time"]
        if tick is None or not frames or not frames[-1] == tick.frame["time"] == time_ns:
            return False
        return np.array_equal(tick.shape, last.shape) and np.array_equal(tick.contact, last.contact)

    with watching("tow_sim/", 600.0, alive) as watcher:
        send(messages)
        deadline, looks = time.monotonic() + 600.0, 0
        while not all_came():
            assert time.monotonic() < deadline, "the last tick"
            looks += 1
            if looks % 100 == 0:  # best effort may lose the last
                send(messages[-50:])
            got, tick = watcher.take()
            frames += list(got["time"])
            ticks += [tick] if tick is not None else []
            time.sleep(0.02)
        assert watcher.heard is not None and watcher.publishers() == 1
        assert not watcher.problem
        until = time.monotonic() + 600.0
        while not watcher.problem and time.monotonic() < until:
            publishers["sim/health"].publish(JointState())
            publishers["cable/shape"].publish(PointCloud2())
            watcher.take()
            time.sleep(0.05)
        assert watcher.problem
