"""Beside a node: there is none, another namespace, another type, one that stops; what it shows is what was sent."""

import os
import time

import numpy as np
import pytest

from cable_sim_ros.errors import CODE_FAILED, CODE_INPUT

rclpy = pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros
DOMAIN = 187


@pytest.fixture
def domain(monkeypatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(DOMAIN))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")


def refusal(namespace="/tow_sim", wait=2.5):
    from cable_sim_ros.ros.watcher import WatchError, watching

    with pytest.raises(WatchError) as error, watching(namespace, wait, lambda: True):
        pass
    return str(error.value), error.value.exit_code


@pytest.fixture
def neighbour(domain):
    from cable_sim_ros.ros.client import Client

    client = Client(DOMAIN, f"neighbour_{os.getpid()}")
    yield client
    client.close()


def test_no_node_is_said(domain):
    text, code = refusal(wait=0.5)
    assert "nothing publishes /tow_sim/sim/health within 0.5 s" in text and "cable-sim node" in text
    assert code == CODE_FAILED


def test_a_node_in_another_namespace_is_named(neighbour):
    from sensor_msgs.msg import JointState

    neighbour.publisher(JointState, "/other/sim/health")
    text, _ = refusal()
    assert "There is one in /other: give --namespace /other" in text


def test_a_node_that_says_nothing_is_said(neighbour):
    from sensor_msgs.msg import JointState

    neighbour.publisher(JointState, "/tow_sim/sim/health")
    text, _ = refusal()
    assert "no message came within 2.5 s" in text and "waits for motion" in text


def test_another_type_is_said(neighbour):
    from std_msgs.msg import String

    neighbour.publisher(String, "/tow_sim/sim/health")
    text, _ = refusal()
    assert "std_msgs/msg/String" in text and "not sensor_msgs/msg/JointState" in text


@pytest.mark.parametrize("text", ["-1", "233", "abc"])
def test_a_domain_that_is_none_is_refused(monkeypatch, text):
    from cable_sim_ros.ros.watcher import WatchInputError, domain

    monkeypatch.setenv("ROS_DOMAIN_ID", text)
    with pytest.raises(WatchInputError, match="from 0 to 232") as error:
        domain()
    assert error.value.exit_code == CODE_INPUT


def test_what_is_watched_is_what_was_sent(neighbour, bag, run):
    """Messages of a recording, sent again; damaged ones among them are said and the rest goes on."""
    from rclpy.serialization import deserialize_message
    from sensor_msgs.msg import JointState, PointCloud2

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

    with watching("tow_sim/", 20.0, alive) as watcher:
        send(messages)
        deadline, frames, ticks = time.monotonic() + 20.0, [], []
        while time.monotonic() < deadline and not (ticks and frames and frames[-1] == run.run.frames["time"][-1]):
            got, tick = watcher.take()
            frames += list(got["time"])
            ticks += [tick] if tick is not None else []
            time.sleep(0.02)
        assert watcher.heard is not None and watcher.heard < 25.0 and watcher.publishers() == 1
        last = run.moment(len(run) - 1)
        assert ticks[-1].frame["time"] == last.frame["time"]
        assert np.array_equal(ticks[-1].shape, last.shape) and np.array_equal(ticks[-1].contact, last.contact)
        assert not watcher.problem
        publishers["sim/health"].publish(JointState())
        publishers["cable/shape"].publish(PointCloud2())
        until, kept = time.monotonic() + 10.0, 0
        while not watcher.problem and time.monotonic() < until:
            kept += len(watcher.take()[0])
            time.sleep(0.05)
        assert watcher.problem and kept == 0
