"""Flaps: how an angle reaches one, by scene, live key, Python, controller and message, and what bounds it."""

from __future__ import annotations

from math import degrees, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_attitude import scene_of
from underway import refused

from cable_sim_ros import FlapCommand, Simulator
from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.messages.commands import CommandIngest, encode_flaps
from cable_sim_ros.io.messages.messages import KINDS, Refused, decode_flaps
from cable_sim_ros.io.scenes.load import SceneError, scene_from_dict
from cable_sim_ros.physics.inputs import MAX_WINGS, make_inputs
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.runs.controller import ControllerError
from cable_sim_ros.runs.offline import replay, run
from cable_sim_ros.runs.summary import pitch_and_roll
from cable_sim_ros.sim.inputs import InputError, WinchCommand

pytestmark = pytest.mark.trust
S = 1_000_000_000
TAIL = {"flap_share": 0.3, "flap_rate": 10.0, "flap_range": 12.0, "flap_timeout": 1.0, "flap_neutral": -2.0}
FLAPPED = {f"towbody.wings.tail.{key}": value for key, value in TAIL.items()}


@pytest.fixture(scope="module")
def started():
    """A tow with a flap on its tail, and its state at the start."""
    sim = Simulator(scene_of(FLAPPED | {"towbody.wings.tail.flap": 3.0}))
    sim.start()
    return sim, sim.snapshot()


@pytest.fixture
def tow(started):
    sim, begun = started
    sim.restore(begun)
    yield sim
    sim.set("faults.flaps.kind", "none")
    sim.set("towbody.wings.tail.flap", 3.0)


def angle(sim: Simulator) -> float:
    """Of the flap, deg: row of the tail in the order of the wings, last column."""
    return degrees(sim.output.shape[0, 1, -1])


def test_a_command_goes_at_its_rate_to_its_range_and_after_its_time_out_to_neutral(tow):
    tow.run(2)
    assert angle(tow) == pytest.approx(3.0)
    tow.push(FlapCommand(angles={"tail": radians(8.0)}))
    tow.run(10)
    assert angle(tow) == pytest.approx(4.0), "10 deg/s for 0.1 s"
    tow.run(60)
    assert angle(tow) == pytest.approx(8.0) and not int(tow.frame.status) & (Flag.FLAP_STALE | Flag.FLAP_LIMITED)
    tow.push(FlapCommand(angles={"tail": radians(20.0)}))
    tow.run(60)
    assert angle(tow) == pytest.approx(12.0) and int(tow.frame.status) & Flag.FLAP_LIMITED
    tow.run(41)
    assert int(tow.frame.status) & Flag.FLAP_STALE and 11.0 < angle(tow) < 12.0, "1 s after it came"
    tow.run(200)
    assert angle(tow) == pytest.approx(-2.0)
    tow.set("towbody.wings.tail.flap", 5.0)
    tow.run(200)
    assert angle(tow) == pytest.approx(5.0) and not int(tow.frame.status) & Flag.FLAP_STALE, "a live key stays"


@pytest.mark.parametrize(
    ("kind", "size", "after"),  # a command of 8 deg comes 0.5 s after the fault; after 1 s more, deg
    [
        ("frozen", 0.0, 3.0),
        ("bias", 0.02, 8.0 + degrees(0.02)),
        ("drift", 0.02, 8.0 + degrees(0.02) * 1.5),
        ("late", 0.7, 6.0),
        ("lost", 0.0, 3.0),
        ("stuck", -0.05, degrees(-0.05)),
        ("runaway", -0.1, 3.0 - degrees(0.1) * 1.5),
    ],
)
def test_faults_act_on_the_flap(tow, kind, size, after):
    tow.set("faults.flaps.size", size)
    tow.set("faults.flaps.kind", kind)
    tow.run(50)
    tow.push(FlapCommand(angles={"tail": radians(8.0)}))
    tow.run(100)
    assert angle(tow) == pytest.approx(after, abs=0.11), "within the way of a tick"


def test_a_saved_state_has_flap_command_and_time_out(tow):
    tow.push(FlapCommand(angles={"tail": radians(8.0)}))
    tow.run(20)
    kept = tow.snapshot()
    first = tow.run(150)
    tow.restore(kept)
    assert tow.run(150).tobytes() == first.tobytes() and int(first.status[-1]) & Flag.FLAP_STALE


def test_a_controller_moves_flap_and_winch_and_its_run_replays_to_the_bit(tow, tmp_path):
    def keep(row):
        return [FlapCommand(angles={"tail": 0.1 * float(np.sin(row.time * 2e-9))}), WinchCommand(rate=0.1)]

    begun = tow.scene
    done = run(begun, heave=(0.5, 8.0), duration=4.0, controller=keep, control_period=0.1, out=tmp_path)
    assert done.frames.payout[-1] > done.frames.payout[0] + 0.2
    flaps = [message.position[0] for message in _messages(done.bag, "towbody/flap_angles")]
    assert len(flaps) == 400 and max(flaps) > 0.05
    assert np.abs(np.diff(flaps)).max() <= radians(10.0) * 0.01 * (1.0 + 1e-9)
    again = replay(done.bag)
    assert again.frames.tobytes() == done.frames.tobytes()
    with pytest.raises(ControllerError, match="'rudder' is no flap of this tow.*tail"):
        run(begun, heave=(0.5, 8.0), duration=1.0, controller=lambda row: FlapCommand(angles={"rudder": 0.0}))


def _messages(bag, topic):
    from cable_sim_ros import BagReader

    with BagReader(bag) as reader:
        names = [name for name in reader.topics if name.endswith(topic)]
        return [STORE.deserialize_cdr(message.data, message.msgtype) for message in reader.read(names)]


def test_messages_are_taken_or_refused_by_cause():
    inputs = make_inputs()
    ingest = CommandIngest(inputs, flaps={"tail": 1, "depressor/port": 3})
    assert ingest.take(encode_flaps(5, {"depressor/port": 0.1, "tail": np.nan}), 7, 100, "flaps") == ""
    assert inputs.flap_head[0] == 1 and inputs.flap_time[0] == 100
    row = inputs.flap[0]
    assert row[3] == 0.1 and np.isnan(row[[k for k in range(MAX_WINGS) if k != 3]]).all()
    assert ingest.take(encode_flaps(5, {"tail": 0.2}), 7, 100, "flaps") == "" and inputs.flap_time[1] == 101
    assert ingest.take(encode_flaps(5, {"tail": np.nan}), 7, 100, "flaps") == "" and ingest.no_command == 1
    assert inputs.command_head[0] == 0 and inputs.flap_head[0] == 2, "the winch hears nothing of it"
    kind = KINDS["flaps"][0]
    twice = STORE.types[kind](_header(), ["tail", "tail"], np.zeros(2), np.zeros(0), np.zeros(0))
    for data, now, cause in (
        (encode_flaps(5, {"rudder": 0.1}), 1, "flap_name"),
        (bytes(STORE.serialize_cdr(twice, kind)), 1, "flap_name"),
        (encode_flaps(5, {"tail": np.inf}), 1, "not_finite"),
        (encode_flaps(5, {"tail": 10.0}), 1, "out_of_range"),
        (encode_flaps(5, {"tail": 0.1}), None, "before_motion"),
        (encode_flaps(5, {"tail": 0.1})[:40], 1, "size"),
        (b"", 1, "size"),
    ):
        assert ingest.take(data, 7, now, "flaps") == cause
    short = STORE.types[kind](_header(), ["tail", "fin"], np.zeros(1), np.zeros(0), np.zeros(0))
    assert ingest.take(bytes(STORE.serialize_cdr(short, kind)), 7, 1, "flaps") == "flap_array"
    assert ingest.flaps_accepted == 2 and inputs.flap_head[0] == 2 and sum(ingest.refused.values()) == 8


def _header():
    return STORE.types["std_msgs/msg/Header"](STORE.types["builtin_interfaces/msg/Time"](0, 5), "")


@settings(max_examples=200, deadline=None)
@given(st.binary(max_size=300))
def test_no_bytes_end_in_another_error(data):
    for whole in (data, b"\0\1\0\0" + data):
        try:
            angles = decode_flaps(whole)
        except Refused:
            continue
        assert all(abs(value) <= np.pi or np.isnan(value) for value in angles.values())


@pytest.mark.parametrize(
    ("angles", "text"),
    [
        ({}, "names no flap"),
        ({"tail": 5.0}, r"angles\['tail'\].*5.*rad"),
        ({"tail": np.nan}, r"angles\['tail'\]"),
        ({"tail": "up"}, r"angles\['tail'\]"),
        ([0.1], "names no flap"),
    ],
)
def test_no_command_of_flaps(angles, text):
    with pytest.raises(InputError, match=text):
        FlapCommand(angles=angles)


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        ({"wings.tail.flap_share": 0.0}, ("towbody.wings.tail.flap_range", "without a flap", "flap_share")),
        ({"wings.tail.flap": 13.0}, ("towbody.wings.tail.flap", "flap_range = 12")),
        ({"wings.tail.flap_neutral": -13.0}, ("towbody.wings.tail.flap_neutral", "flap_range = 12")),
        ({"wings.tail.flap_range": 40.0}, ("towbody.wings.tail.flap_range", "stall_angle", "more than")),
    ],
)
def test_what_no_flap_is(changes, parts):
    said = refused(scene_of, FLAPPED | {f"towbody.{key}": value for key, value in changes.items()})
    assert all(part in said for part in parts), said


def test_faults_of_flaps_need_a_flap_and_wings_are_counted():
    with pytest.raises(SceneError, match=r"faults\.flaps\.kind.*no body has a flap"):
        scene_of({"faults.flaps.kind": "stuck"})
    tree = scene_of().model_dump(mode="json")
    wing = {"place": [-1.5, 0.0, -0.25], "span": 0.1, "chord": 0.1}
    tree["towbody"]["wings"] |= {f"extra{k}": wing for k in range(MAX_WINGS - 2)}
    with pytest.raises(SceneError, match=f"{MAX_WINGS + 1} wings on one line, at most {MAX_WINGS}"):
        scene_from_dict(tree, "a test")


def test_the_fish_tells_its_attitude_and_height_and_is_kept_by_what_it_tells(tmp_path):
    """Ideal: roll, pitch, heading and height of the truth; with a zero, an end of range and a fault what these make of
    it; a recording has them, a controller that is fed by instruments sees them."""
    aboard = {"instruments.fish_attitude.on": True, "instruments.altimeter.on": True, "seabed.depth": 150.0}
    bent = {"instruments.fish_attitude.zero": [0.02, -0.01, 0.1], "instruments.altimeter.max_range": 30.0}
    faulty = {"faults.fish_pitch.kind": "stuck", "faults.fish_pitch.size": 0.2, "instruments.feed": "instruments"}
    seen = []
    for other in ({}, bent | faulty):
        seen.clear()
        ask, folder = lambda row: seen.append(row.copy()), tmp_path / str(len(other))
        done = run(scene_of(FLAPPED | aboard | other), heave=(0.5, 8.0), duration=2.0, controller=ask, out=folder)
        f, (pitch, roll) = done.frames, pitch_and_roll(done.frames)
        np.testing.assert_allclose(f.fish_roll, np.radians(roll) + (0.02 if other else 0.0), atol=1e-9)
        np.testing.assert_allclose(f.fish_pitch, 0.2 if other else -np.radians(pitch), atol=1e-9)
        height = f.body_position[:, 2] + 150.0
        np.testing.assert_allclose(f.altitude_reading, np.minimum(height, 30.0) if other else height, atol=1e-9)
        assert (f.readings_new & 192 == 192).all()
        told = [message.orientation for message in _messages(done.bag, "instruments/fish_attitude")]
        assert len(told) == len(f) and tilt(*(getattr(told[9], axis) for axis in "xyzw")) == pytest.approx(
            f.fish_pitch[9]
        )
        heights = [message.point.z for message in _messages(done.bag, "instruments/altimeter")]
        assert heights == f.altitude_reading.tolist()
    assert tilt(*seen[5].body_quaternion) == pytest.approx(0.2), "what is stuck is what it sees"
    with pytest.warns(UserWarning, match="altimeter.*no seabed"):
        tree = scene_of(FLAPPED | {"instruments.altimeter.on": True}).model_dump(mode="json")
        run(scene_from_dict(tree, "a test"), motion=None, duration=0.1)


def tilt(x, y, z, w):
    """Pitch of a quaternion, nose down, rad."""
    return np.arcsin(2.0 * (w * y - z * x))
