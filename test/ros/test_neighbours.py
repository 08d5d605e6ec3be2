"""Who else is on our topics, and how far we are seen: the rules, without a network."""

import pytest

from cable_sim_ros.ros.discovery import limit
from cable_sim_ros.ros.graph_monitor import full_name, judge

OWN = "/tow_sim/cable_sim"
POSE, IMU = "/tow_sim/towbody/pose", "/tow_sim/imu/data"


def test_alone_there_is_nothing_to_say():
    assert judge(OWN, [OWN, "/ship/driver"], {POSE: [OWN]}, {IMU: ["/ship/driver"]}) == []


def test_a_foreign_publisher_is_named_with_topic_and_remedy():
    (text,) = judge(OWN, [OWN], {POSE: [OWN, "/x/spoof"]}, {})
    assert text == (
        "/tow_sim/towbody/pose is also published by /x/spoof: what is heard there is not only from this simulation; "
        "end it, or start this node with -r __ns:=/other"
    )


def test_a_publisher_that_borrows_our_name_is_foreign_too():
    (text,) = judge(OWN, [OWN], {POSE: [OWN] * 2}, {})
    assert f"another endpoint named {OWN}" in text


def test_a_second_node_of_our_name_is_said_once_not_for_every_topic():
    (text,) = judge(OWN, [OWN, OWN], {POSE: [OWN] * 2}, {})
    assert text.startswith("2 nodes have the name /tow_sim/cable_sim: services, parameters and topics answer for one")


def test_two_senders_of_one_input():
    (text,) = judge(OWN, [OWN], {}, {IMU: ["/a", "/b"]})
    assert text == (
        "/tow_sim/imu/data has 2 publishers (/a, /b): the newest message counts, whoever sent it; leave one"
    )


def test_topics_that_are_one_input_have_one_sender():
    rate, length = "/tow_sim/winch/command", "/tow_sim/winch/joint_command/position"
    assert judge(OWN, [OWN], {}, {rate: ["/a"], length: ["/a"]}, (rate, length)) == []
    two = {rate: ["/b"], length: ["/a"], IMU: []}
    assert judge(OWN, [OWN], {}, two) == []
    (text,) = judge(OWN, [OWN], {}, two, (rate, length))
    assert text == (
        f"{rate} and {length} are one input and have 2 senders (/a, /b): the newest message counts, whoever sent it; "
        f"leave one"
    )


def test_a_participant_without_a_node_has_a_name_too():
    assert full_name("_NODE_NAME_UNKNOWN_", "_NODE_NAMESPACE_UNKNOWN_") == "a participant without a ROS node"
    assert full_name("cable_sim", "/tow_sim") == OWN and full_name("x", "/") == "/x"


@pytest.mark.parametrize(
    "given, environment, wanted, kept, says",
    [
        ([], {}, "LOCALHOST", [], "this host only"),
        (["node", "--ros-args"], {}, "LOCALHOST", ["node", "--ros-args"], "--open"),
        (["node", "--open", "-r"], {}, "SUBNET", ["node", "-r"], "every host of the subnet may listen and send"),
        (["--open"], {"ROS_AUTOMATIC_DISCOVERY_RANGE": "OFF"}, "SUBNET", [], "SUBNET (--open)"),
        ([], {"ROS_AUTOMATIC_DISCOVERY_RANGE": "SUBNET"}, "SUBNET", [], "SUBNET (environment variable"),
        ([], {"ROS_LOCALHOST_ONLY": "0"}, None, [], "ROS_LOCALHOST_ONLY=0 (environment variable)"),
    ],
)
def test_discovery_is_limited_to_this_host_unless_asked(given, environment, wanted, kept, says):
    arguments, text = limit(given, environment)
    assert arguments == kept and says in text
    assert environment.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == wanted
