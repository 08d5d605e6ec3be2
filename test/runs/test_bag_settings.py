"""How a bag is read: its axes, its topics, its scene. Nothing of it is guessed without a word."""

import struct

import pytest
from click.testing import CliRunner

from cable_sim_ros.cli.commands import main
from cable_sim_ros.io.bags.bag import BagError
from cable_sim_ros.io.bags.bag_writer import BagWriter
from cable_sim_ros.io.messages.messages import KINDS, decode_imu, decode_odometry
from cable_sim_ros.io.messages.mounting import in_enu, times
from cable_sim_ros.io.scenes.load import SceneError, load_scene
from cable_sim_ros.io.sources.motion_table import MotionError
from cable_sim_ros.io.sources.recorded_tow import read_motion
from cable_sim_ros.physics.heave_filter import Convention
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.settings import apply_to_scene, settings_of, topics_of

pytestmark = pytest.mark.trust
SECONDS = 6.0
SOUTH = (0.0, 0.0, -(0.5**0.5), 0.5**0.5)  # Rz(-90 deg)


def in_ned(kind, data):
    """The message with all of it in NED axes: R_ned = S Rz(-90 deg) R S."""
    count, at, vectors = (37, 0, (13, 25)) if kind == "imu" else (85, 3, (43, 46))
    d = list(struct.unpack(f"<{count}d", data[-8 * count :]))
    x, y, z, w = times(SOUTH, tuple(d[at : at + 4]))
    d[at : at + 4] = x, -y, -z, w
    for k in vectors:
        d[k + 1], d[k + 2] = -d[k + 1], -d[k + 2]
    if kind == "odometry":
        d[:3] = d[1], d[0], -d[2]
    return data[: -8 * count] + struct.pack(f"<{count}d", *d)


def reversed_force(kind, data):
    """The message of a driver that sends gravity for specific force."""
    return data[:-96] + struct.pack("<3d", *(-f for f in struct.unpack("<3d", data[-96:-72]))) + data[-72:]


@pytest.fixture(scope="module")
def messages():
    """Time, kind and bytes of the first seconds of the shipped motion."""
    found = []
    for item in read_motion(offline.find_bag("nbp1406")):
        if found and item[0] - found[0][0] > SECONDS * 1e9:
            return found
        found.append(item)
    return found


@pytest.fixture(scope="module")
def bags(messages, tmp_path_factory):
    """The motion as it is, all in NED, with the IMU alone in NED or its force reversed; topics of another name."""
    folder, paths = tmp_path_factory.mktemp("bags"), {}
    for name, turn, turned in (
        ("enu", in_ned, ()),
        ("ned", in_ned, ("imu", "odometry")),
        ("ned_imu", in_ned, ("imu",)),
        ("reversed", reversed_force, ("imu",)),
    ):
        paths[name] = folder / name
        writer = BagWriter(paths[name], custom_data={})
        for time, kind, data in messages:
            for topic in (f"/mru/{KINDS[kind][1]}", f"/spare/{KINDS[kind][1]}"):
                writer.add(topic, KINDS[kind][0], time, turn(kind, data) if kind in turned else data, time)
        writer.close()
    return paths


TOPICS = {"imu": "/mru/imu/data", "odometry": "/mru/odom"}


def ran(bag, **how):
    return offline.run("full_scale", bag, duration=2.0, every=0.1, step="chosen", topics=TOPICS, **how)


def test_messages_in_ned_are_turned_as_the_decoder_turns_them(messages):
    for _, kind, data in messages[:40]:
        turned, decode = in_ned(kind, data), decode_imu if kind == "imu" else decode_odometry
        ours, theirs = decode(in_enu(kind, turned)), decode(turned, Convention.NED)
        for field in ("stamp", "angles", "rate", *(("force",) if kind == "imu" else ("position", "velocity"))):
            assert getattr(ours, field) == pytest.approx(getattr(theirs, field), abs=1e-9)
        assert decode(in_enu(kind, turned)).angles == pytest.approx(decode(data).angles, abs=1e-9)
    assert in_enu("imu", b"short") == b"short"


def test_a_bag_in_ned_is_refused_and_right_once_its_axes_are_given(bags):
    """Taken for ENU it gave three times the deviation, and ok."""
    with pytest.raises(
        MotionError, match=r"none of the ship's motion can be used. imu/data \(gravity_sign\): .*; odom"
    ):
        ran(bags["ned"])
    with pytest.raises(MotionError, match=r"Is it in NED axes\? Then give --convention ned\."):
        ran(bags["ned"], imu_only=True)
    true, given = ran(bags["enu"]), ran(bags["ned"], settings=settings_of((), "ned"))
    assert given.metrics["tension_std_n"] == pytest.approx(true.metrics["tension_std_n"], rel=1e-6)
    assert given.metrics["motion_refused"] == {} and given.verdict.state == true.verdict.state == "ok"
    beside = ran(bags["ned_imu"])  # odometry that is right, beside an IMU that is not: the heading is not the IMU's
    assert beside.metrics["tension_std_n"] == pytest.approx(true.metrics["tension_std_n"], rel=1e-3)
    assert beside.metrics["motion_refused"]["gravity_sign"] > 50


def test_a_force_of_the_other_sign_is_refused_and_right_once_it_is_said(bags):
    with pytest.raises(MotionError, match=r"Then --set motion\.force_reversed=true\."):
        ran(bags["reversed"], imu_only=True)
    true = ran(bags["enu"], imu_only=True)
    given = ran(bags["reversed"], imu_only=True, settings=settings_of(("motion.force_reversed=true",), None))
    assert given.metrics["motion_refused"] == {}
    assert given.metrics["tension_std_n"] == true.metrics["tension_std_n"] > 0.0


def test_the_axes_are_kept_in_a_recording_and_in_a_saved_state(bags, tmp_path):
    how = {"settings": {"motion.convention": "ned"}}
    first = ran(bags["ned"], out=tmp_path / "a", save=tmp_path / "s.npz", **how)
    again = offline.run("full_scale", first.bag, duration=2.0, every=0.1, step="chosen")
    assert again.metrics["motion_refused"] == {}
    assert again.metrics["tension_std_n"] == pytest.approx(first.metrics["tension_std_n"], rel=0.05)  # fewer headings
    report = offline.Resumed(tmp_path / "s.npz").report()
    assert report.settings == how["settings"] and report.topics == TOPICS


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("motion.conventio=ned",), r"--set motion.conventio=ned: there is no such key; .* Did you mean motion.conv"),
        (
            ("motion.convention=left",),
            r"--set motion.convention=left: Input should be 'enu' or 'ned'; nothing was simul",
        ),
        (("motion.max_jump=-1",), r"--set motion.max_jump=-1: .* See cable-sim manual for its range"),
        (("tow_speed",), r"--set tow_speed: is no key=value; nothing was simulated. Give for example --set water.den"),
        (("water.density=[1",), r"--set water.density=\[1: has no value; .* Give a number or a word"),
        (("a=1", "a=2"), r"--set a: was given twice; nothing was simulated. Keep one of them"),
    ],
)
def test_settings_that_are_none(bags, given, message):
    with pytest.raises(MotionError, match=message):
        ran(bags["enu"], settings=settings_of(given))


def test_settings_of_the_scene_and_of_topics():
    scene = load_scene("full_scale")
    settings = settings_of(("water.density=1000", "sheave.position=[-31.0, 0, 5]"))
    assert apply_to_scene(scene, settings).water.density == 1000.0
    assert apply_to_scene(scene, settings).sheave.position == (-31.0, 0.0, 5.0)
    with pytest.raises(SceneError, match="water.densty"):
        apply_to_scene(scene, {"water.densty": 1.0})
    with pytest.raises(MotionError, match="--convention ned and --set motion.convention=enu contradict each other"):
        settings_of(("motion.convention=enu",), "ned")
    assert topics_of(("imu=/mru/imu",)) == {"imu": "/mru/imu"}
    for pair, why in (("gyro=/x", "is none of imu=/name"), ("imu", "is none of"), ("imu=", "is none of")):
        with pytest.raises(MotionError, match=f"--topic {pair}: {why}.* Give for example --topic imu=/mru/imu"):
            topics_of((pair,))
    with pytest.raises(MotionError, match=r"--topic imu=/b: was given twice"):
        topics_of(("imu=/a", "imu=/b"))
    with pytest.raises(
        MotionError, match=r"motion.convention: says how messages of a bag are taken in, but the motion"
    ):
        offline.run("full_scale", heave=(1.0, 8.0), settings={"motion.convention": "ned"})


def test_a_replay_names_its_scene_and_says_where_there_is_nothing_to_compare(bags):
    with pytest.raises(BagError, match=r"enu' keeps no scene, so it is not known which tow it recorded: nothing was"):
        offline.replay(bags["enu"], topics=TOPICS)
    found = offline.replay(bags["enu"], "full_scale", algorithm="hold", topics=TOPICS)
    assert [reason.flag for reason in found.verdict.reasons] == ["NOT_COMPARED"] and found.verdict.code == 4
    assert found.metrics["setpoint"] == "hold"


def test_another_scene_than_the_kept_one_is_compared_on_purpose(bags, tmp_path):
    first = ran(bags["enu"], out=tmp_path / "a")
    same = offline.replay(first.bag, load_scene("full_scale"))  # the steps of the run are not those of the file
    assert same.metrics["largest_difference"]["ticks"] > 0 and same.verdict.state == "ok"
    held = offline.replay(first.bag, algorithm="hold")
    assert held.verdict.state == "ok" and max(row.largest for row in held.residuals if row.unit == "N") > 10.0
    with pytest.raises(MotionError, match="the motion is in the journal of the bag, as the run took it"):
        offline.replay(first.bag, settings={"motion.convention": "ned"})


def test_the_options_mean_the_same_on_the_command_line(bags):
    asked = ["--topic", "imu=/mru/imu/data", "--topic", "odometry=/mru/odom"]
    found = CliRunner().invoke(main, ["run", "full_scale", "--motion", str(bags["ned"]), *asked, "--json"])
    assert found.exit_code == 2 and "--convention ned" in found.output
    for command in ("run", "replay"):
        text = CliRunner().invoke(main, [command, "--help"]).output
        assert "--convention" in text and "--topic" in text and "--set " in text and "--setpoint" in text
    assert "--convention" in (text := CliRunner().invoke(main, ["play", "--help"]).output) and "--topic" in text
