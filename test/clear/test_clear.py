"""A shoal ahead of a tow: what is advised, simulated as it is advised; what cannot be judged is named."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.sim.simulator import Simulator
from cable_sim_ros.tools.clear import towed
from cable_sim_ros.tools.clear.advice import Allowances, Passage, Wanted, actions_of, advise, deeper_than_the_wire, told
from cable_sim_ros.tools.clear.command import clear
from cable_sim_ros.tools.clear.profile import ahead_of, profile_of, read_profile
from cable_sim_ros.tools.clear.towed import Action, ClearError, Tow, copies_of, sail

KNOWN, MARGIN = Allowances(drag=0.1, speed=0.05), 3.0
WANTED = Wanted(None, None, MARGIN, 1.0, None, 2.5, 0.05, 100.0, 25.0, 600.0)


def ground(top, at=400.0, flat=60.0, wide=60.0):
    """Points each 10 m with a shoal."""
    distance = np.arange(-100.0, 900.0, 10.0)
    return distance, flat - (flat - top) * np.exp(-(((distance - at) / wide) ** 2))


@pytest.fixture(scope="module")
def tow():
    return Tow(load_scene("side_scan"), 60.0, 2.06, 1.0, 0.05)


@pytest.fixture(scope="module")
def copies(tow):
    return copies_of(tow, actions_of(tow, 15.0, 2.5), KNOWN.drag, KNOWN.speed, lambda *_: None)


@pytest.fixture
def passage(copies):
    def made(distance, depth, margin=MARGIN, **more):
        return Passage(copies, profile_of(distance, depth, 100.0, "profile"), margin, KNOWN, **more)

    return made


def test_what_is_not_known_makes_the_towbody_deeper(copies):
    """Less drag and less speed do; the cable hangs astern."""
    depth = {name: one.depth for name, one in copies.items()}
    assert depth["drag"] > depth["itself"] + 0.3 and depth["slower"] > depth["itself"] > depth["faster"]
    assert copies["itself"].behind < -50.0


@pytest.mark.parametrize("kind", ("haul", "speed", "both"))
def test_an_advice_simulated_keeps_the_clearance_that_it_states(tow, copies, passage, kind):
    """0.3 m: shares of an action that lie between those simulated."""
    one = passage(*ground(copies["itself"].depth + 3.5))
    report = advise(one)
    way = next(way for way in report["ways"] if way["way"] == kind)
    assert report["state"] == "act" and way["clears"] and way["clearance_m"] - way["allowance_m"] >= MARGIN
    action = Action(way["haul_m"], way["speed_more_mps"])
    found = sail(tow, action, way["begin_by_s"], way["let_out_from_s"], int(one.seconds))
    gap = one.profile.ground(found.place) - found.depth
    assert gap[np.isfinite(gap)].min() == pytest.approx(way["clearance_m"], abs=0.3)
    assert not one.clear(kind, way["share"], way["begin_by_s"] + 5.0), "later is too late"
    assert not one.clear(kind, way["share"] - 0.02, 0.0), "less is too little"
    assert way["let_out_from_s"] < one.seconds and "begun within" in told(report)


def test_ground_that_is_clear_out_of_reach_or_too_high(tow, passage):
    held = advise(passage(*ground(55.0)))
    assert held["state"] == "clear" and held["ways"] == [] and told(held).startswith("clear: held as it is")
    high = advise(passage(*ground(1.0)))
    assert high["state"] == "cannot" and not any(way["clears"] for way in high["ways"])
    assert "s left" in told(high) and high["held"]["clearance_m"] < 0.0
    deep = deeper_than_the_wire(tow, profile_of(*ground(90.0, flat=95.0), 100.0, "p"), MARGIN, KNOWN)
    assert deep["state"] == "clear" and "out of reach" in told(deep)
    assert deeper_than_the_wire(tow, profile_of(*ground(30.0), 100.0, "p"), MARGIN, KNOWN) is None


def test_a_towbody_below_its_steady_depth_is_judged_there(copies, passage):
    depth = copies["itself"].depth + 12.0
    assert advise(passage(*ground(depth)))["state"] == "clear"
    assert advise(passage(*ground(depth), deeper=8.0))["state"] == "act"


def test_what_cannot_be_judged_is_named_and_the_rest_judged(copies, passage):
    distance, depth = ground(copies["itself"].depth + 3.0)
    aground = depth.copy()
    aground[distance < 0.0] = copies["itself"].depth - 1.0
    one = passage(distance, aground)
    assert one.aground == pytest.approx(1.0, abs=0.1) and -10.0 < one.first < 20.0
    assert advise(one)["state"] == "act" and "aground at the start by" in one.notes[-1]
    all_along = passage(distance, 0.0 * distance + copies["itself"].depth - 1.0)
    assert advise(all_along)["state"] == "unknown" and "nothing further can be judged" in all_along.notes[-1]
    late = passage(distance[20:], depth[20:])
    assert "no depth is known from the towbody" in late.notes[-1] and advise(late)["state"] == "act"
    there = np.abs(distance - 400.0) > 150.0
    holed = passage(distance[there], depth[there])
    assert "holes wider than 100 m are not judged: 240 to 560 m" in holed.notes[0]
    assert advise(holed)["state"] == "clear" and np.isinf(holed.profile.ground(np.array([400.0])))[0]


def test_a_profile_that_runs_back_is_put_in_order_and_the_shallower_counts():
    one = profile_of(np.array([0.0, 50.0, 20.0, 50.0, np.nan]), np.array([30.0, 40.0, 10.0, 35.0, 5.0]), 100.0, "p")
    assert one.distance.tolist() == [0.0, 20.0, 50.0] and one.depth.tolist() == [30.0, 10.0, 35.0]
    assert "1 of 5 points" in one.notes[0] and "runs back at 1 points, first from 50 to 20 m" in one.notes[1]
    many = np.arange(10_000.0)
    assert profile_of(many, np.where(many == 7777.0, 5.0, 50.0), 100.0, "p").depth.min() == 5.0


def test_points_in_the_world_are_taken_along_the_track():
    points = np.array([[10.0, 100.0 + 10.0 * k, -40.0 + k] for k in range(5)] + [[60.0, 120.0, -1.0]])
    one = ahead_of(points, np.array([0.0, 110.0]), np.pi / 2, 25.0, 100.0, "p")
    assert one.distance == pytest.approx([-10.0, 0.0, 10.0, 20.0, 30.0]) and one.depth[0] == 40.0
    assert one.notes == ["p: 1 of 6 points are beside the track by 25 m and 5 % of their distance"]
    far = ahead_of(np.array([[0.0, 0.0, -40.0], [900.0, 69.0, -9.0]]), np.zeros(2), 0.0, 25.0, 1000.0, "p")
    assert far.depth.tolist() == [40.0, 9.0], "the course made good is known to some degrees"


@pytest.mark.parametrize(
    ("text", "said"),
    (
        ("distance,depth_m\n1,2\n", "has no column distance_m; nothing was judged. The first line is"),
        ("distance_m,depth_m\n1,20\n", "1 points are no profile; nothing was judged. Give two or more"),
        ("distance_m,depth_m\n1,-20\n2,-20\n", "most depths are not positive"),
        ("distance_m,depth_m\n1,20\n2,x\n", ":3: depth_m = x is no finite number"),
    ),
)
def test_a_profile_that_is_none_is_refused(tmp_path, text, said):
    (tmp_path / "p.csv").write_text(text)
    found = CliRunner().invoke(clear, ["side_scan", "--profile", str(tmp_path / "p.csv")])
    assert found.exit_code != 0 and said in str(found.exception) + found.output


def test_rows_with_an_empty_cell_are_left_out(tmp_path):
    (tmp_path / "p.csv").write_text("distance_m,depth_m\n1,20\n2,\n3,21\n")
    assert "1 rows with an empty cell" in read_profile(tmp_path / "p.csv", 100.0).notes[0]


def test_a_tow_that_hangs_or_has_no_winch_to_haul_is_refused(tow):
    short = override(tow.scene, {"cable.sections.armoured.length": 62.0, "winch.scope": 50.0})
    for scene, speed, said in (
        (tow.scene, 0.1, "the ship makes 0.1 m/s, below 0.2"),
        (short, 1.0, "60 m of scope are more than the 5"),
        (load_scene("rov_tether"), 1.0, "towbody.model = vehicle"),
        (load_scene("full_scale_contact"), 1.0, "winch.drum = contact"),
    ):
        with pytest.raises(ClearError, match=said):
            sail(tow._replace(scene=scene, speed=speed), Action(0.0, 0.0), 0.0, None, 1)


@pytest.fixture
def at_once(copies, monkeypatch):
    """The copies of the module, in place of new ones."""
    monkeypatch.setattr(towed, "copies_of", lambda *_: copies)


def test_command_of_a_scene_and_of_a_state(at_once, copies, tmp_path):
    rows = zip(*ground(copies["itself"].depth + 3.0), strict=True)
    (tmp_path / "p.csv").write_text("distance_m,depth_m\n" + "".join(f"{a},{b}\n" for a, b in rows))
    sim = Simulator(override(load_scene("side_scan"), {"winch.scope": 60.0}))
    sim.start()
    sim.run(1)
    sim.save(tmp_path / "tow.npz")
    common = ["--profile", str(tmp_path / "p.csv"), "--margin", "3", "--range", "drag=0.1", "--range", "speed=0.05"]
    scene = CliRunner().invoke(clear, ["side_scan", "--scope", "60", *common, "--json", "--out", str(tmp_path / "o")])
    report = json.loads(scene.stdout)
    assert scene.exit_code == 1 and report["state"] == "act" and report["answer"].startswith("act: ")
    assert (tmp_path / "o" / "clear.png").stat().st_size > 10_000 and "drag" not in " ".join(report["assumed"])
    state = CliRunner().invoke(clear, [str(tmp_path / "tow.npz"), *common])
    assert state.exit_code == 1 and "side_scan: act: held as it is" in state.output and "begin by s" in state.output
    for given, said in (
        (["side_scan", "--scope", "60"], "--scope needs a profile"),
        (common, "over it what is towed?"),
        ([str(tmp_path / "tow.npz"), *common, "--set", "a=1"], "--set is of a scene"),
        (["side_scan", *common, "--range", "current=1"], "there is no range 'current'"),
        (["side_scan", *common, "--scope", "60", "--least-scope", "90"], "--least-scope 90 is more than the 60 m"),
        (["side_scan", *common, "--max-speed", "1"], "--max-speed 1 is less than the 2.06 m/s"),
        (["full_scale_contact", *common], "has no winch.scope; nothing was judged"),
    ):
        refused = CliRunner().invoke(clear, given)
        assert refused.exit_code != 0 and said in refused.output + str(refused.exception)


FRAME = {  # of a tick output, what a lookout takes
    "time": 10**9,
    "ship_position": np.zeros(3),
    "scope": 60.0,
    "payout_rate": 0.0,
    "ship_velocity": np.array([2.06, 0.0, 0.0]),
    "ship_quaternion": np.array([0.0, 0.0, 0.0, 1.0]),
    "body_position": np.array([0.0, 0.0, -50.0]),
}


def test_a_course_is_no_moment_of_a_ship_that_sways():
    """Begun at the largest sway: over a wave it is the mean track, where an exponential would keep two thirds."""
    pytest.importorskip("rclpy")
    from cable_sim_ros.tools.clear.beside import here_of

    here = None
    for k in range(1, 3201):
        velocity = np.array([2.0, 0.5 * np.cos(2.0 * np.pi * (k - 1) / 800.0), 0.0])
        frame = FRAME | {"time": k * 10**7, "ship_velocity": velocity}
        here = here_of(frame) if here is None else here.then(frame)
        if k % 800 == 0:  # whole waves
            assert abs(here.velocity[1]) < (0.002 if k <= 1600 else 0.05) and here.depth == pytest.approx(50.0), k
    assert here.then(frame | {"time": 10**15}).first == 10**15, "after a gap it begins anew"


def test_lookout_beside_a_node(tow, copies):
    """Without a node: tick outputs and messages as they come, and what is answered when something is missing."""
    pytest.importorskip("rclpy")
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import PointCloud2, PointField

    from cable_sim_ros.tools.clear.beside import Lookout, status_of

    one = Lookout(tow.scene, WANTED, KNOWN)
    body = np.array([900.0, 0.0, -copies["itself"].depth])
    frame = FRAME | {"ship_position": np.array([1000.0, 0.0, 0.0]), "body_position": body}

    def profile(frame_id, depth, data=None, sec=1):
        points = np.column_stack([1000.0 + ground(0.0)[0], 0.0 * depth, -depth]).astype("<f4")
        fields = [PointField(name=n, offset=4 * k, datatype=7, count=1) for k, n in enumerate("xyz")]
        made = PointCloud2(height=1, width=len(points), fields=fields, point_step=12, row_step=12 * len(points))
        made.header.frame_id, made.data = frame_id, points.tobytes() if data is None else data
        made.header.stamp.sec = sec
        return serialize_message(made)

    said = lambda now=0.5: one.look(now)["answer"]  # noqa: E731
    assert "no tick output of the node for 3 s" in said()
    one.tick(frame, 0.0)
    assert "no profile has come on clear/profile" in said()
    one.profile(profile("map", ground(55.0)[1]))
    assert "is in 'map'; nothing was taken" in said()
    one.profile(profile("odom", ground(55.0)[1]))
    assert "the answers of the tow are being simulated" in said()
    one.copies = copies
    assert one.look(0.5)["state"] == "clear" and status_of(one.look(0.5)).level == 0
    one.profile(serialize_message(PointCloud2()))
    assert "has no x, y, z of 4 or 8 byte floats" in one.look(0.5)["notes"][-1]
    one.profile(bytes(4_000_001))
    assert "4000001 bytes, most are 4000000" in one.look(0.5)["notes"][-1]
    one.profile(profile("odom", ground(55.0)[1], b""))
    assert "0 bytes are not 100 points" in one.look(0.5)["notes"][-1]
    one.profile(profile("odom", ground(copies["itself"].depth + 3.0)[1]))
    report = one.look(0.5)
    assert report["state"] == "act" and report["held"]["at_m"] == pytest.approx(400.0, abs=1.0)
    one.tick(frame | {"time": 2 * 10**9, "payout_rate": -0.5, "scope": 55.0}, 1.0)
    notes = " ".join(one.look(1.0)["notes"])
    assert "the tow has changed from 60.0 m at 2.06 m/s" in notes and "the winch moves at -0.50 m/s" in notes
    assert status_of(one.look(1.0)).level >= 1
    one.profile(profile("odom", ground(55.0)[1]))
    assert one.look(1.0)["state"] == "clear" and status_of(one.look(1.0)).level == 1, "of the tow as it was"
    one.problem = "the ship makes 0.1 m/s"
    assert one.look(1.0)["state"] == "unknown" and said(1.0) == "unknown: the ship makes 0.1 m/s"
    one.tick(frame | {"time": 700 * 10**9}, 1.0)
    assert "the profile is 699 s old, fresh up to 600 s" in said(1.0)
    assert "no tick output" in said(9.0)
    one.close()
