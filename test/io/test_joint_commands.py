"""control_msgs/JointCommand: its bytes are read as those of a JointState, and the newest of both topics counts."""

from math import inf, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.rosbag2 import StoragePlugin, Writer
from test_commands import NOW, Scene, command, pushed
from test_motion import S, odometry, serialized

from cable_sim_ros.io.bags.typestore import BESIDE, STORE, type_hash
from cable_sim_ros.io.messages.cdr import header
from cable_sim_ros.io.messages.commands import CommandIngest, as_joint_state
from cable_sim_ros.io.messages.messages import (
    CAUSES,
    COMMANDS,
    JOINT_COMMAND,
    KINDS,
    Event,
    Refused,
    decode_command,
    decode_joint_command,
    find_topics,
)
from cable_sim_ros.io.sources.recorded_tow import Feeder, read_motion, read_tow
from cable_sim_ros.physics.inputs import make_inputs

pytestmark = pytest.mark.check

POSITION, VELOCITY = "command_position", "command_velocity"


def joint_command(stamp, interface, values, names=("payout",), frame="", little_endian=True):
    """CDR bytes of a JointCommand, by the type's own serializer."""
    message = STORE.types[JOINT_COMMAND](header(stamp, frame), list(names), interface, np.array(values, float))
    return serialized(message, little_endian)


@given(
    st.floats(-1e5, 1e5),
    st.sampled_from(["position", "velocity"]),
    st.lists(st.text("abp_", max_size=9), max_size=4),
    st.integers(0, 4),
    st.text("abc_/", max_size=9),
    st.booleans(),
)
def test_the_value_of_the_joint_comes_out_of_any_layout(value, interface, others, place, frame, little_endian):
    names = [*others[:place], "payout", *others[place:]]
    values = [value if name == "payout" else 9.0 for name in names]
    data = joint_command(NOW, interface, values, names, frame, little_endian)
    wanted = (NOW, value, nan) if interface == "position" else (NOW, nan, value)
    for padding in (b"", bytes(8)):  # as rclpy leaves it
        assert np.array_equal(decode_joint_command(data + padding), wanted, equal_nan=True)
    event = as_joint_state(Event(NOW, NOW, f"command_{interface}", data))
    assert event.kind == "command" and np.array_equal(decode_command(event.data), wanted, equal_nan=True)


@pytest.mark.parametrize(
    "decode, good",
    [
        (decode_joint_command, joint_command(NOW, "velocity", [1.0, 2.0], ["a", "payout"], frame="winch")),
        (decode_command, command(NOW, [1.0, 2.0], [3.0, 4.0], ["a", "payout"], frame="winch")),
    ],
    ids=["JointCommand", "JointState"],
)
@given(data=st.data())
def test_damaged_and_random_bytes_are_refused_or_within_their_bounds(decode, good, data):
    raw = bytearray(good)
    for _ in range(data.draw(st.integers(0, 4))):
        raw[data.draw(st.integers(0, len(raw) - 1))] = data.draw(st.integers(0, 255))
    cut = bytes(raw[: data.draw(st.integers(0, len(raw)))]) + data.draw(st.binary(max_size=80))
    for sent in (bytes(raw), cut):
        try:
            _, payout, rate = decode(sent)
        except Refused as refusal:
            assert CAUSES[refusal.cause]
        else:
            assert not abs(payout) > 1e5 and not abs(rate) > 1e5


GIANT = (2**32 - 1).to_bytes(4, "little")
BAD = [
    ("size", b""),
    ("size", joint_command(NOW, "velocity", [1.0])[:-1]),
    ("size", joint_command(NOW, "velocity", [1.0])[:20] + GIANT + bytes(40)),  # so many joints
    ("size", joint_command(NOW, "velocity", [1.0], frame="x" * 65536)),
    ("encoding", b"\0\7" + joint_command(NOW, "velocity", [1.0])[2:]),
    ("joint_name", joint_command(NOW, "velocity", [1.0], ["drum"])),
    ("joint_name", joint_command(NOW, "velocity", [1.0, 1.0], ["payout", "payout"])),
    ("joint_name", joint_command(NOW, "velocity", [], [])),
    ("interface", joint_command(NOW, "", [1.0])),
    ("interface", joint_command(NOW, "acceleration", [1.0])),
    ("interface", joint_command(NOW, "Velocity", [1.0])),
    ("array_length", joint_command(NOW, "velocity", [])),
    ("array_length", joint_command(NOW, "velocity", [1.0, 2.0])),
    ("array_length", joint_command(NOW, "velocity", [1.0], ["payout", "drum"])),
    ("not_finite", joint_command(NOW, "velocity", [inf])),
    ("not_finite", joint_command(NOW, "effort", [-inf])),
    ("effort_only", joint_command(NOW, "effort", [1.0])),
    ("out_of_range", joint_command(NOW, "position", [1.1e5])),
    ("out_of_range", joint_command(NOW, "velocity", [-1e6])),
]


@pytest.mark.parametrize("cause, data", BAD)
def test_a_bad_one_is_refused_by_cause_and_the_command_before_goes_on(cause, data):
    it = CommandIngest(make_inputs())
    assert it.take(command(NOW - 1, [7.0]), 0, NOW - 1) == ""
    assert it.take(data, 5, NOW, VELOCITY) == cause
    assert dict(it.refused) == {cause: 1} and it.accepted == 1 and it.last_refusal == CAUSES[cause]
    assert pushed(it.inputs) == [(NOW - 1, 7.0, pytest.approx(nan, nan_ok=True))]
    assert as_joint_state(Event(NOW, NOW, POSITION, data)).kind == "command"


def test_nan_commands_nothing_before_the_motion_too():
    it = CommandIngest(make_inputs())
    for interface in ("position", "velocity", "effort"):
        assert it.take(joint_command(NOW, interface, [nan]), 5, None, POSITION) == ""
    assert it.no_command == 3 and not it.refused and it.inputs.command_head[0] == 0
    assert it.take(joint_command(NOW, "position", [1.0]), 5, None, POSITION) == "before_motion"


def test_the_newest_arrival_over_both_messages_counts():
    """A rate, a length, and a rate again, each on another topic: the ring has them as they came."""
    it = CommandIngest(make_inputs())
    came = [
        ("command", command(NOW, velocity=[0.5])),
        (POSITION, joint_command(NOW, "position", [450.0])),
        (VELOCITY, joint_command(NOW, "velocity", [-0.25])),
        ("command", command(NOW, [440.0])),
        (POSITION, joint_command(NOW, "velocity", [0.125])),  # the message says what it is, whatever the topic
    ]
    for k, (kind, data) in enumerate(came):
        assert it.take(data, NOW + k, NOW + k, kind) == ""
    wanted = [(nan, 0.5), (450.0, nan), (nan, -0.25), (440.0, nan), (nan, 0.125)]
    assert np.array_equal([row[1:] for row in pushed(it.inputs)], wanted, equal_nan=True)
    assert [row[0] for row in pushed(it.inputs)] == [NOW + k for k in range(5)] and it.accepted == 5
    assert np.array_equal(it.last, (NOW, nan, 0.125), equal_nan=True)


def of_bag(path, items):
    """The ring and the counts of a bag of commands (log time, kind, bytes) under a second of motion."""
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        made = {
            kind: writer.add_connection(f"/tow_sim/{topic}", msgtype, typestore=STORE)
            for kind, (msgtype, topic) in KINDS.items()
        }
        for k in range(50):
            time = NOW + k * S // 50
            writer.write(made["odometry"], time, odometry(time, velocity=(1, 0, 0)))
            for at, kind, data in items:
                if time < at <= time + S // 50:
                    writer.write(made[kind], at, data)
    feeder = Feeder(make_inputs(), read_tow(path), Scene)
    feeder.until(NOW + S)
    return pushed(feeder.inputs), feeder.intake.commands


def test_a_bag_gives_the_ring_that_the_topics_gave(tmp_path):
    """Also where two arrive at one time, as in lockstep: in the order in which they were recorded."""
    at = [NOW + 1 + k * S // 20 for k in range(4)]
    mixed = [
        (at[0], VELOCITY, joint_command(NOW, "velocity", [0.5])),
        (at[1], VELOCITY, joint_command(NOW, "velocity", [0.75])),
        (at[1], "command", command(NOW, [450.0])),
        (at[2], POSITION, joint_command(NOW, "position", [455.0])),
        (at[3], POSITION, joint_command(NOW, "position", [inf])),
    ]
    plain = [(time, "command", as_joint_state(Event(NOW, time, kind, data)).data) for time, kind, data in mixed[:-1]]
    ring, commands = of_bag(tmp_path / "mixed", mixed)
    other, _ = of_bag(tmp_path / "plain", plain)
    assert len(ring) == 4 and np.array_equal(ring, other, equal_nan=True)
    assert np.array_equal(
        [row[1:] for row in ring], [(nan, 0.5), (nan, 0.75), (450.0, nan), (455.0, nan)], equal_nan=True
    )
    assert dict(commands.refused) == {"not_finite": 1}
    kinds = [kind for _, kind, _ in read_motion(tmp_path / "mixed") if kind in COMMANDS]
    assert kinds == [kind for _, kind, _ in mixed]


def test_a_topic_of_a_bag_is_found_by_its_type_and_name():
    topics = {f"/tow_sim/{topic}": msgtype for msgtype, topic in KINDS.values()}
    assert find_topics(topics) == {kind: f"/tow_sim/{topic}" for kind, (_, topic) in KINDS.items()}
    assert find_topics({"/arm/commands/position": JOINT_COMMAND}) == {}, "of another robot"
    assert find_topics({"/a/b": JOINT_COMMAND}, {VELOCITY: "/a/b"}) == {VELOCITY: "/a/b"}


def test_its_hash_is_that_of_the_fields_in_their_order():
    assert type_hash(JOINT_COMMAND) == "RIHS01_6080a1df9d28b6badffa5efb27d4ba4ae657c4f6dd2b519b178a32db12405985"
    assert [name for name, _ in STORE.fielddefs[JOINT_COMMAND][1]] == [name for name, _ in BESIDE[JOINT_COMMAND]]
