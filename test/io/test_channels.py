"""Channels: what is written is what is read back, exactly where the type allows it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from synthetic import START, canonical, make_contact, make_frames, make_shape, serialize

from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.messages.channels import (
    CHANNELS,
    HEALTH,
    NAMES,
    Context,
    Encoder,
    channel_of,
    decode,
    decode_frames,
    numbers_of,
    rotate,
)
from cable_sim_ros.io.messages.instrument_channels import INSTRUMENTS
from cable_sim_ros.physics.tick_output import CONTACT_COLUMNS, FIELDS, SHAPE_COLUMNS, TICK_OUTPUT

pytestmark = pytest.mark.check

CONTEXT = Context()
BY_NAME = {channel.name: channel for channel in CHANNELS}
finite = st.floats(allow_nan=False, allow_infinity=False, width=64)


@st.composite
def frames(draw):
    """Any finite tick output; unit quaternions, because a velocity is turned by one and back."""
    frame = np.zeros((), TICK_OUTPUT)
    for name, shape, kind, _, _ in FIELDS:
        if name == "time":
            frame[name] = draw(st.integers(0, 2**31 * 10**9 - 1))
        elif kind == "i8":
            frame[name] = draw(st.integers(0, 2**40))
        elif name.endswith("quaternion"):
            q = draw(arrays.arrays(float, 4, elements=st.floats(-1, 1)).filter(lambda q: np.linalg.norm(q) > 0.1))
            frame[name] = q / np.linalg.norm(q)
        else:
            frame[name] = draw(arrays.arrays(float, shape, elements=finite))
    return frame[()]


def tables(frame):
    return make_shape(frame), make_contact(frame)


def message_of(name, frame, context=CONTEXT):
    channel = BY_NAME[name]
    return STORE.deserialize_cdr(serialize(channel, frame, *tables(make_frames(1)[0]), context), channel.msgtype)


def read_back(name, frame, shape=None, contact=None):
    return decode(BY_NAME[name], serialize(BY_NAME[name], frame, shape, contact, CONTEXT))


@given(frames())
@settings(max_examples=20)
def test_health_carries_every_field_of_the_frame_bit_by_bit(frame):
    data = serialize(BY_NAME["sim_health"], frame, None, None, CONTEXT)
    assert decode_frames([data])[0].tobytes() == frame.tobytes()
    fields = decode(BY_NAME["sim_health"], data)
    assert set(fields) == {name for name, *_ in FIELDS}
    for name, *_ in FIELDS:
        assert np.array_equal(fields[name], frame[name]), name


def test_health_names_are_fields_with_components():
    assert len(HEALTH) == sum(int(np.prod(shape)) for _, shape, *_ in FIELDS) - 1
    assert {name.partition(".")[0] for name in HEALTH} | {"time"} == {name for name, *_ in FIELDS}
    assert "body_position.z" in HEALTH and "body_quaternion.w" in HEALTH and "tension" in HEALTH


def test_health_of_another_version_is_read_by_name():
    frame = make_frames(1)[0]
    message = message_of("sim_health", frame)
    assert message.header.frame_id == "" and not len(message.velocity) and not len(message.effort)
    keep = [k for k, name in enumerate(message.name) if name not in ("residual", "status")][::-1]
    message.name = [message.name[k] for k in keep] + ["unheard_of"]
    message.position = np.append(message.position[keep], 7.0)
    (again,) = decode_frames([bytes(STORE.serialize_cdr(message, "sensor_msgs/msg/JointState"))])
    assert math.isnan(again["residual"]) and again["status"] == 0
    assert again["tension"] == frame["tension"] and again["time"] == frame["time"]
    assert again["substeps"] == frame["substeps"]


@given(frames())
@settings(max_examples=20)
def test_encoder_writes_the_bytes_of_the_serializer(frame):
    frame["tick"] = 0  # every channel is due
    shape, contact = tables(make_frames(1)[0])
    frame["contact_stations"] = len(contact) - 3
    frame["readings_new"] = -1
    rows = (*CHANNELS, *(channel for channel, _ in INSTRUMENTS))
    written = Encoder(CONTEXT, 0.01, rows).encode(frame, shape, contact)
    assert [row for row, *_ in written] == list(rows)
    for row, _, data in written:
        assert data == canonical(data, row.msgtype), row.name


def test_template_is_written_anew_each_time():
    encoder, run = Encoder(CONTEXT, 0.01), make_frames(3)
    kept = [encoder.encode(frame, *tables(frame)) for frame in run]
    for frame, messages in zip(run, kept):
        for channel, _, data in messages:
            assert data == serialize(channel, frame, *tables(frame), CONTEXT)


@given(frames())
@settings(max_examples=20)
def test_fixed_channels_read_back(frame):
    for name in ("winch_state", "towbody_pose", "sheave_tension"):
        fields = read_back(name, frame)
        assert fields.pop("time") == frame["time"]
        fields.pop("tension", None)
        assert fields
        for field, value in fields.items():
            assert np.array_equal(value, frame[field]), field


def test_odometry_twist_is_in_the_child_frame():
    frame = make_frames(1)[0]
    frame["body_quaternion"] = [0, 0, math.sqrt(0.5), math.sqrt(0.5)]  # heading along +y
    frame["body_velocity"] = [0, 2, 1]
    frame["body_rate"] = [0.1, 0, 0]
    message = message_of("towbody_odom", frame)
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    assert (linear.x, linear.y, linear.z) == pytest.approx((2, 0, 1))
    assert (angular.x, angular.y, angular.z) == pytest.approx((0, -0.1, 0))
    assert (message.header.frame_id, message.child_frame_id) == ("odom", "towbody_link")


@given(
    arrays.arrays(float, 4, elements=st.floats(-1, 1)).filter(lambda q: np.linalg.norm(q) > 0.1),
    arrays.arrays(float, (2, 3), elements=st.floats(-100, 100)),
)
@settings(max_examples=40)
def test_odometry_velocity_reads_back(q, velocity):
    frame = make_frames(1)[0]
    frame["body_quaternion"] = q / np.linalg.norm(q)
    frame["body_velocity"], frame["body_rate"] = velocity
    fields = read_back("towbody_odom", frame)
    assert fields["body_velocity"] == pytest.approx(tuple(velocity[0]), abs=1e-12)
    assert fields["body_rate"] == pytest.approx(tuple(velocity[1]), abs=1e-12)


def test_rotation_agrees_with_scipy():
    from scipy.spatial.transform import Rotation

    q = np.array([0.1, -0.5, 0.3, 0.8]) / np.linalg.norm([0.1, -0.5, 0.3, 0.8])
    assert rotate(tuple(q), (1.0, 2.0, 3.0)) == pytest.approx(Rotation.from_quat(q).apply([1, 2, 3]))


@given(
    arrays.arrays(
        np.float32,
        st.tuples(st.integers(0, 30), st.just(9)),
        elements=st.floats(allow_nan=False, allow_infinity=False, width=32),
    )
)
@settings(max_examples=40)
def test_clouds_read_back(table):
    frame = make_frames(1)[0]
    frame["contact_stations"] = max(0, len(table) - 1)
    filled = table[: frame["contact_stations"]]
    assert np.array_equal(read_back("sheave_contact", frame, None, table)["contact"], filled)
    assert np.array_equal(read_back("cable_shape", frame, table[:, :5])["shape"], table[:, :5])


def test_cloud_fields_carry_the_names_of_the_contract():
    frame = make_frames(1)[0]
    for name, frame_id, columns in (
        ("sheave_contact", "sheave_link", CONTACT_COLUMNS),
        ("cable_shape", "odom", SHAPE_COLUMNS),
    ):
        message = message_of(name, frame)
        assert [field.name for field in message.fields] == [label for label, _ in columns]
        assert {field.datatype for field in message.fields} == {7}
        assert message.header.frame_id == frame_id
        assert message.row_step == message.point_step * message.width == len(message.data)


def test_stamp_is_exact():
    frame = make_frames(1)[0]
    frame["time"] = START + 123_456_789
    for channel in CHANNELS:
        message = message_of(channel.name, frame)
        assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1_700_000_000, 123_456_789)
        assert read_back(channel.name, frame, *tables(frame))["time"] == START + 123_456_789


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", [name for name in NAMES if name in ("tension", "residual", "body_position.y")])
def test_what_is_not_finite_is_refused_by_name(name, value):
    frame = make_frames(1)[0]
    field, _, axis = name.partition(".")
    if axis:
        frame[field]["xyzw".index(axis)] = value
    else:
        frame[field] = value
    with pytest.raises(ValueError, match=rf"frame field '{name}' is (nan|inf|-inf) at time {START} ns"):
        Encoder(CONTEXT, 0.01).encode(frame, *tables(make_frames(1)[0]))


def test_what_is_not_finite_in_a_table_is_refused_by_name():
    frame = make_frames(1)[0]
    shape, contact = tables(frame)
    shape[7, 3] = math.nan
    with pytest.raises(ValueError, match="'tension' of cable/shape, row 7, is nan"):
        serialize(BY_NAME["cable_shape"], frame, shape, contact, CONTEXT)
    contact[5, 4] = math.inf
    with pytest.raises(ValueError, match="'load_port' of sheave/contact, row 5, is inf"):
        serialize(BY_NAME["sheave_contact"], frame, shape, contact, CONTEXT)


def test_rows_past_the_filled_stations_are_not_looked_at():
    frame = make_frames(1)[0]
    contact = np.vstack([make_contact(frame), np.full((3, 9), math.nan)])
    assert len(read_back("sheave_contact", frame, None, contact)["contact"]) == frame["contact_stations"]


def test_huge_finite_frame_is_no_false_alarm():
    frame = make_frames(1)[0]
    frame["kinetic_energy"] = frame["strain_energy"] = 1.7e308  # their sum overflows
    assert numbers_of(frame).kinetic_energy == 1.7e308


def test_what_nobody_wants_is_not_encoded_but_a_frame_that_is_not_finite_refused_all_the_same():
    encoder, frame = Encoder(CONTEXT, 0.01), make_frames(1)[0]
    wanted = CONTEXT.topic(BY_NAME["sheave_tension"])
    ((channel, topic, data),) = encoder.encode(frame, *tables(frame), wanted.__eq__)
    assert topic == wanted and data == serialize(channel, frame, *tables(frame), CONTEXT)
    frame["payout"] = np.nan
    with pytest.raises(ValueError, match="payout"):
        encoder.encode(frame, *tables(frame), lambda topic: False)


def test_rates():
    encoder, counts = Encoder(CONTEXT, 0.01), {}
    for frame in make_frames(100):
        for channel, *_ in encoder.encode(frame, *tables(frame)):
            counts[channel.name] = counts.get(channel.name, 0) + 1
    assert counts == dict.fromkeys(BY_NAME, 100) | {"sheave_contact": 20, "cable_shape": 10}
    assert BY_NAME["sheave_contact"].every(0.2) == 1


def test_names_come_from_the_context():
    context = Context(odom="map", towbody_link="fish", namespace="/other")
    frame = make_frames(1)[0]
    message = message_of("towbody_odom", frame, context)
    assert (message.header.frame_id, message.child_frame_id) == ("map", "fish")
    assert context.topic(BY_NAME["towbody_odom"]) == "/other/towbody/odom"
    assert channel_of("/other/towbody/odom") is BY_NAME["towbody_odom"]
    assert channel_of("towbody/odom") is BY_NAME["towbody_odom"]
    assert channel_of("/xtowbody/odom") is None and channel_of("/tow_sim/imu/data") is None


def test_winch_joints_are_those_of_the_contract():
    frame = make_frames(1)[0]
    message = message_of("winch_state", frame)
    assert message.name == ["payout", "drum"]
    assert message.position.tolist() == [frame["payout"], frame["drum_angle"]]
    assert message.velocity.tolist() == [frame["payout_rate"], frame["drum_rate"]]
    assert message.effort.tolist() == [frame["tension_drum"], frame["drum_torque"]]


def test_ros_reads_the_bytes_and_writes_them_back():
    """Where rclpy is present: through its own reader and writer (whose padding is random, at the end too)."""
    serialization = pytest.importorskip("rclpy.serialization")
    from importlib import import_module

    frame = make_frames(1)[0]
    for channel in CHANNELS:
        data = serialize(channel, frame, *tables(frame), CONTEXT)
        package, _, name = channel.msgtype.split("/")
        msgtype = getattr(import_module(f"{package}.msg"), name)
        again = serialization.serialize_message(serialization.deserialize_message(data, msgtype))
        for field, value in decode(channel, data).items():
            assert np.array_equal(value, decode(channel, again[: len(data)])[field]), (channel.name, field)
