"""The interval of a tow that manoeuvres: when it does, what copies of it give, and what is told of it."""

import csv
import json
from math import cos, pi, radians, sin
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from test_tow_log import written

from cable_sim_ros.cli import commands
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.sim.inputs import ShipMotion, WinchCommand
from cable_sim_ros.tools.ensemble.copies import EnsembleEnded
from cable_sim_ros.tools.ensemble.plan import EnsembleError, Ranges
from cable_sim_ros.tools.layback.laid import Tow, band_of, with_copies
from cable_sim_ros.tools.layback.towed import Copied, Towed, body_places, ends_of, half_widths, manoeuvres, yaw_of

SECOND = 1_000_000_000
NONE = {"drag": 0.0, "speed": 0.0, "current": 0.0, "current_turn_deg": 0.0}


def of_way(course, speed=2.0, cable=100.0, scene=None, since=0.0):
    """Does a tow of arrays of 600 s manoeuvre?"""
    t = np.arange(0.0, 600.0)
    course, speed, cable = (np.broadcast_to(value, t.shape) for value in (course, speed, cable))
    velocity = speed[:, None] * np.column_stack([np.cos(course), np.sin(course)])
    return manoeuvres(t, velocity, course, cable, scene or load_scene("side_scan"), since)


def test_a_tow_manoeuvres_from_the_change_until_the_ship_went_twice_its_cable():
    t = np.arange(0.0, 600.0)
    gone = np.clip((t - 200.0) / 50.0, 0.0, 1.0)
    assert not of_way(0.3).any() and not of_way(0.3 + radians(4.0) * gone).any()
    for found in (of_way(4.0 - pi * gone), of_way(0.0, 2.0 - 0.001 * gone, 100.0 - 20.0 * gone)):
        assert not found[:200].any() and found[210:320].all() and not found[352:].any(), "80 to 100 s"
    assert of_way(0.0, 2.0 - gone)[300] and not of_way(0.0, 2.0 - 0.09 * gone).any()
    assert of_way(0.0, 2.0 * (1.0 - gone))[250:].all(), "a ship that lies does not go away from its manoeuvre"


def test_a_current_that_leaves_that_of_the_start_is_a_manoeuvre():
    turns = {"time": [100.0, 200.0], "turn_deg": [0.0, 45.0]}
    scene = override(load_scene("side_scan"), {"water.current": [0.2, 0.0], "water.current_variation": turns})
    found = of_way(0.0, scene=scene)
    assert not found[:100].any() and found[200:].all() and of_way(0.0, scene=scene, since=200.0).all()
    t = np.zeros(1)
    assert manoeuvres(t, np.ones((1, 2)), t, t + 100.0, scene, 300.0, last=1).tolist() == [True]


def test_half_the_differences_of_both_ends_add_as_squares_and_headings_do_not_jump():
    nominal = np.array([[0.0, -100.0, 50.0, 3.1]])
    copies = np.array([[[3.0, -100.0, 54.0, 3.13]], [[-3.0, -100.0, 46.0, -3.13]], [[0.0, -98.0, 53.0, 3.1]]])
    found = half_widths(nominal, np.concatenate([copies, [[[0.0, -102.0, 47.0, 3.1]]]]))[0]
    assert found == pytest.approx([2.0, 2.0, 3.0, 5.0, pi - 3.13], rel=1e-6)
    assert len(ends_of(Ranges(), False)) == 8 and len(ends_of(Ranges(payout=1.0), True)) == 12


def test_a_point_of_the_body_turns_with_it():
    """A quarter turn to port, bow 90 deg down: ahead lies below, port lies west."""
    q = 0.5 * np.array([[-1.0, 1.0, 1.0, 1.0]])  # x, y, z, w of Rz(90) Ry(90)
    frames = {"body_position": np.array([[1.0, 2.0, -50.0]]), "body_quaternion": q}
    assert body_places(frames, (2.0, 0.0, 0.0))[0] == pytest.approx([1.0, 2.0, -52.0])
    assert body_places(frames, (0.0, 2.0, 0.0))[0] == pytest.approx([-1.0, 2.0, -50.0])
    level = np.array([[0.0, 0.0, sin(1.0), cos(1.0)]])
    assert yaw_of(level) == pytest.approx([2.0])


def test_copies_of_a_steady_tow_have_the_interval_of_steady_tows_and_a_ship_of_their_own():
    """On a way to the north-east: within 2 % of the static tows; speed is wrong along it, cable from the start on."""
    scene = override(
        load_scene("side_scan"), {"solver.tick": 0.1, "ship.heading_deg": 45.0, "winch.command_timeout": 2}
    )
    ranges = Ranges(**NONE | {"speed": 0.1, "payout": 1.0})
    towed, speed = Towed(scene, ranges), scene.ship.tow_speed * sin(pi / 4)
    towed.start()
    out = float(towed.nominal.frame["payout"])
    way = {"velocity": (speed, speed, 0.0), "attitude": (0.0, 0.0, pi / 4), "rate": (0.0, 0.0, 0.0)}
    for k in range(21):
        at = (speed * k, speed * k, scene.ship.reference_height)
        towed.push(ShipMotion(time_ns=k * SECOND, position=at, **way))
    towed.push(WinchCommand(payout=out))
    band = towed.run(190, 190)
    found = towed.interval(band.nominal, band.values)[0]
    _, steady = band_of(scene, Tow(float(scene.winch.scope), speed, speed, pi / 4), ranges)
    assert found[[0, 1, 3]] == pytest.approx([steady.layback, steady.along, steady.depth], rel=0.02)
    ships = [sim.frame["ship_position"][:2] for sim in towed._sims.values()]
    assert ships[1] - ships[0] == pytest.approx([1.9 * sin(pi / 4)] * 2, abs=0.02)
    assert [s.frame["payout"] - out for s in list(towed._sims.values())[3:]] == pytest.approx([1.0, -1.0], abs=1e-6)


def test_where_no_copies_can_be_towed_the_interval_is_steady_and_said(monkeypatch):
    def gone():
        raise EnsembleEnded("copy 3 was given up")

    notes, moves = [], np.array([False, True])
    band, there, copies = with_copies(np.arange(2.0), np.ones((2, 5)), moves, gone, notes)
    assert (band == 1.0).all() and not there.any() and copies == 0 and "cannot be towed" in notes[0]
    made = Copied(np.arange(2.0), np.full((2, 5), 3.0), 8, [])
    band, there, copies = with_copies(np.arange(2.0), np.ones((2, 5)), moves, lambda: made, notes)
    assert band[:, 0].tolist() == [1.0, 3.0] and there.tolist() == [False, True] and copies == 8
    with pytest.raises(EnsembleError, match="half_widths.drag = 0.2 multiplies"):
        strums = {"viv.law": "sarpkaya", "cable.sections.armoured.drag_amplification": 1.0}
        Towed(override(load_scene("side_scan"), strums), Ranges())


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    """A log with a turn of 90 deg to starboard, and a table of static tows, through the command; drag alone."""
    folder = tmp_path_factory.mktemp("turn")
    t = np.arange(0.0, 200.0)
    heading = 90.0 * np.clip((t - 40.0) / 60.0, 0.0, 1.0)
    payout, speed = t * 0.0 + 60.0, t * 0.0 + 2.0
    columns = {"time_s": t, "payout_m": payout, "speed_mps": speed, "heading_deg": heading, "depth_m": None}
    log, table = written(folder / "log.csv", **columns), folder / "table.csv"
    rows = ["winch.scope,ship.tow_speed,layback_max_m,reasons"]
    rows += [f"{c},{v},{c * v / 3.0 if c < 80 else ''}," for c in (50, 70, 90) for v in (1, 3)]
    table.write_text("\n".join(rows) + "\n")
    words = ["layback", log, "--scene", "side_scan", "--json", "--origin", "60,5", "--table", table, "--sonar", "1,0,0"]
    words += [word for key in ("speed", "current") for word in ("--range", f"{key}=0")]
    done = CliRunner().invoke(commands.main, [*map(str, words), "--out", str(folder / "out")])
    assert done.exit_code in (0, 4), done.output
    return json.loads(done.stdout), list(csv.DictReader((folder / "out" / "layback.csv").read_text().splitlines()))


def test_a_turn_has_the_interval_of_copies_and_the_straight_that_of_steady_tows(turned):
    report, rows = turned
    sources = [row["interval"] for row in rows]
    assert sources[10] == sources[-5] == "steady" and sources[80] == sources[130] == "copies"
    assert report["copies"] == 2 and 0.4 < report["copies_share"] == report["manoeuvre_share"] < 0.8
    assert any("2 copies of the tow" in note for note in report["notes"])
    at = {k: float(rows[k]["along_95_m"]) for k in (42, 43, 44, 45, 46, 47)}
    assert max(at.values()) < 1.1 * min(at.values()), "from one source to the other there is no step"


def test_the_table_says_heading_course_and_ship(turned):
    report, rows = turned
    first, last = (
        {k: float(v) for k, v in row.items() if v and k not in ("time_s", "interval")} for row in (rows[5], rows[-1])
    )
    for row, heading in ((first, 0.0), (last, 90.0)):
        for name in ("heading_deg", "course_deg", "ship_heading_deg", "ship_course_deg"):
            assert (row[name] - heading + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=2.0)
        assert row["layback_table_m"] == pytest.approx(40.0, abs=0.3) and "altitude_m" not in row
    heading, ship = (float(rows[70][name]) for name in ("heading_deg", "ship_heading_deg"))
    assert rows[70]["layback_along_track_m"] and heading < 40.0 < ship
    assert first["ship_latitude"] > first["latitude"] and report["heading_95_deg"]["mean"] >= 0.0


def test_of_a_recording_with_the_winch_at_work_copies_follow_it(tmp_path):
    line = "run side_scan --motion none --duration 25 --every 0.05 --winch".split()
    line += ["0 hold, 10 rate -0.5", "--out", str(tmp_path / "run")]
    assert CliRunner().invoke(commands.main, line).exit_code == 0
    words = [word for key in ("speed", "current") for word in ("--range", f"{key}=0")]
    done = CliRunner().invoke(commands.main, ["layback", str(tmp_path / "run" / "tow"), "--json", *words])
    report = json.loads(done.stdout)
    assert report["copies"] == 2 and report["copies_share"] == report["manoeuvre_share"] > 0.2
    alone = CliRunner().invoke(
        commands.main, ["layback", str(tmp_path / "run" / "tow"), "--json", *words, "--interval", "steady"]
    )
    report, was = json.loads(alone.stdout), report["interval_95_m"]["along"]["max"]
    assert report["copies"] == 0 and report["interval_95_m"]["along"]["max"] == pytest.approx(was, rel=0.1)


def test_a_live_fix_takes_steady_tows_copies_or_nothing():
    pytest.importorskip("rclpy")
    from cable_sim_ros.tools.layback.fixes import Fixes

    part = Fixes.__new__(Fixes)
    part.node = SimpleNamespace(settings=SimpleNamespace(scene=load_scene("side_scan")))
    part.table = SimpleNamespace(of=lambda *_: (1.0, 2.0, 3.0))
    part._copies, part._ready, part._past, part.source = (0, np.eye(6)), False, [], "none"
    frame = {"scope": 100.0, "body_position": np.array([0.0, -50.0, -9.0]), "sheave_position": np.zeros(3), "tick": 0}
    told = []
    for second, heading, ready in ((0, 0.0, False), (1, 0.0, False), (2, 0.5, False), (3, 0.5, True), (60, 0.5, True)):
        part._last, part._velocity, part._ready = second * SECOND, 2.0 * np.array([cos(heading), sin(heading)]), ready
        covariance = part._covariance(frame | {"ship_quaternion": np.array([0.0, 0.0, 0.0, 1.0])})
        told.append(part.source)
        if part.source == "steady":
            assert np.diag(covariance)[:3] == pytest.approx([4.0, 1.0, 9.0]) and 0.0 < covariance[5, 5] < 0.01
        assert (covariance is None) == (part.source == "manoeuvre")
        assert part.statuses()[0].level == (1 if covariance is None else 0)
    assert told == ["steady", "steady", "manoeuvre", "copies", "manoeuvre"], "and a covariance of a minute ago is none"
