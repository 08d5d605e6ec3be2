"""Measured tows: fits to tows of a closed form, tables that are none, and a table simulated to the end."""

import csv
import json
import re
from math import atan, cos, degrees, radians

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros import load_scene, override
from cable_sim_ros.cli.commands import main
from cable_sim_ros.errors import CODE_DOUBTFUL, CableSimError
from cable_sim_ros.io.scenes.ship_plan import ShipPlan
from cable_sim_ros.io.scenes.winch_plan import PlanItem, WinchPlan
from cable_sim_ros.physics.ship import Ship
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.flag_rules import FAILED
from cable_sim_ros.tools.calibrate.free import free_of
from cable_sim_ros.tools.sweeps import sweep
from cable_sim_ros.tools.sweeps.worker import simulate
from cable_sim_ros.tools.tows import series
from cable_sim_ros.tools.tows.fit import folds_of, widened, wider
from cable_sim_ros.tools.tows.simulated import Setting, answered, cases_of, height_of, made_of
from cable_sim_ros.tools.tows.table import MAPS, TowsMapError, load_map, read_tows
from cable_sim_ros.tools.tows.tows import judge

FREE = "towbody.drag_area[*]=0.4:1.2"
MAP = {
    "tows": "made",
    "wire_from": "water",
    "name": "tow",
    "group": "cruise",
    "wire": {"field": "wire", "unit": "m"},
    "rate_out": {"field": "rate", "unit": "m/min"},
    "speeds": {"ship": {"field": "speed", "unit": "kn"}},
    "angle": {"field": "angle", "unit": "deg"},
    "depth": {"field": "depth", "unit": "m"},
}
SERIES = MAP | {
    "series": {
        "field": "file",
        "wire": {"field": "wire", "unit": "m"},
        "speed": {"field": "speed", "unit": "kn"},
        "depth": {"field": "depth", "unit": "m"},
    }
}
HEAD = "tow,cruise,wire,rate,speed,angle,depth\n"
ROW = "a,one,100,30,1.8,40,75\n"


def incline(area, speed):
    """Angle of a straight wire without weight: a tow of closed form."""
    return atan(0.9 * area * speed**2)


HEIGHT = height_of(load_scene("bongo"))


def row_of(case):
    """What the run of a case would give, of the closed form."""
    items = [*WinchPlan(case.winch).items, PlanItem(case.duration, "hold")]
    wire = case.settings["winch.scope"] - HEIGHT
    wire += max(np.cumsum([0.0, *(a.value * (b.time - a.time) for a, b in zip(items, items[1:]))]))
    area = case.settings.get("towbody.drag_area", [0.85])[0]
    angle = incline(area, case.settings["ship.tow_speed"])
    figures = {"body_depth_max_m": wire * cos(angle), "departure_angle_deepest_deg": degrees(angle)}
    return figures | {"verdict": "ok", "error": "", "reasons": ""}


def run(cases):
    return [row_of(case) for case in cases]


def tows_of(count, area=0.7, seed=1, angle=3.0, speed=0.12, depth=0.03):
    """Rows of tows with errors of these deviations [deg, m/s, share]."""
    rng = np.random.default_rng(seed)
    for k in range(count):
        true, wire = rng.normal(0.9, 0.12), float(rng.choice([40, 70, 100, 150, 200]))
        theta = incline(area, true)
        yield (
            f"t{k}", f"c{k % 8}", wire, 30, (true + speed * rng.normal()) * 3.6 / 1.852,
            degrees(theta) + angle * rng.normal(), wire * cos(theta) * (1.0 + depth * rng.normal()),
        )  # fmt: skip


def table_of(folder, rows, head=HEAD):
    path = folder / "tows.csv"
    with open(path, "w", newline="", encoding="utf-8") as file:
        file.write(head)
        csv.writer(file).writerows(rows)
    return path


def judged(path, made=MAP, folds=2, free=(FREE,), run=run, design=64):
    scene = load_scene("bongo")
    made = MAPS.check(made, "map")
    read = read_tows(path, made, height_of(scene))
    setting = Setting("bongo", scene, {}, made.begin, height_of(scene), free_of(free, scene) if free else [])
    return judge(read, made, setting, (0.4, 1.5), design, folds, run)


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """160 tows of closed form in eight groups, fitted and judged by two folds."""
    return judged(table_of(tmp_path_factory.mktemp("tows"), tows_of(160)), folds=2, design=128)


def test_the_number_that_the_tows_were_made_with_is_found(many):
    (value,), (sd,) = many.fitted.values, np.sqrt(np.diag(many.fitted.covariance))
    assert abs(value - 0.7) < 3.0 * sd < 0.15
    assert many.fitted.at.depth == pytest.approx(0.03, rel=0.4)
    assert many.fitted.at.speeds["ship"] == pytest.approx(0.12, rel=0.3)
    assert many.verdict.state == "ok"


def test_intervals_hold_nine_of_ten_tows_that_were_left_out(many):
    ways = {one.way: one for one in many.ways}
    ours = ways["this fit"]
    assert ours.tows == 160
    assert 0.86 <= ours.held <= 0.94
    assert ours.spread < ways["cosine of the angle"].spread
    assert ways["this fit without angles"].spread < ways["wire times a ratio"].spread
    assert many.apart[0] < 0.01  # the interpolation, beside each tow itself


def test_a_winch_that_cannot_pay_out_as_far_is_no_tow():
    said = "COMMAND_LIMITED for 9 s (1 % of the run): winch commands asked for more than rate or travel allow"
    row = {"verdict": "doubtful", "error": "", "reasons": said, "body_depth_max_m": 1.0}
    found = answered([row | {"departure_angle_deepest_deg": 1.0}])
    assert np.isnan(found.depth[0]) and found.why == [said]


def test_what_leaves_a_fold_out_does_not_see_its_depths(tmp_path, many):
    rows = list(tows_of(160))
    rows = [(*row[:-1], 0.7 * row[-1]) if row[1] == "c3" else row for row in rows]
    other = judged(table_of(tmp_path, rows), folds=2, design=128)
    own = many.folds == many.folds[3]
    assert np.allclose(other.left_out[own][:, 1], many.left_out[own][:, 1], rtol=1e-9)
    assert not np.allclose(other.left_out[~own][:, 1], many.left_out[~own][:, 1], rtol=1e-3)


@pytest.mark.parametrize(
    ("row", "why"),
    [
        ("b,one,,30,1.8,40,75", "wire"),
        ("b,one,3,30,1.8,40,2", "begin"),
        ("b,one,100,3000,1.8,40,75", "rate_out"),
        ("b,one,100,30,180,40,75", "speeds.ship"),
        ("b,one,100,30,,40,75", "speed"),
        ("b,one,100,30,1.8,95,75", "angle"),
        ("b,one,100,30,1.8,40,120", "depth"),
        ("b,one,100,30,1.8,40", "cells"),
    ],
)
def test_a_row_that_is_no_tow_is_left_out_with_its_reason(tmp_path, row, why):
    path = tmp_path / "tows.csv"
    path.write_text(HEAD + ROW + row + "\n", encoding="utf-8")
    table = read_tows(path, MAPS.check(MAP, "map"), 6.0)
    assert [tow.name for tow in table.tows] == ["a"]
    assert len(table.left) == 1 and "line 3" in table.left[0] and why in table.left[0]


def test_a_row_without_a_depth_is_answered_and_not_scored(tmp_path):
    rows = [*tows_of(40), ("none", "c1", 100, 30, 1.8, 40, "")]
    found = judged(table_of(tmp_path, rows))
    assert np.isnan(found.table.tows[-1].depth) and found.left_out[-1, 0] < found.left_out[-1, 1] < 100.0
    assert found.ways[0].tows == 40


@pytest.mark.parametrize(
    ("rows", "why"),
    [
        ([("a", "one", 100, 30, 1.8, 40, 75)] * 20, "the same to the last digit"),
        (list(tows_of(5)), "needs 8"),
        ([(row[0], "one", *row[2:]) for row in tows_of(20)], "one group"),
        ([], "has 0 rows"),
        ([("a", "one", 3, 30, 1.8, 40, 2)], "none of its 1 rows"),
    ],
)
def test_a_table_that_no_number_can_be_fitted_to_is_refused(tmp_path, rows, why):
    with pytest.raises(CableSimError, match=why):
        judged(table_of(tmp_path, rows))


def flags(found):
    return {reason.flag: reason.text for reason in found.verdict.reasons}


def test_what_makes_depths_doubtful_is_said(tmp_path):
    def faulty(cases):
        rows = run(cases)
        for case, row in zip(cases, rows):
            row["body_depth_max_m"] *= 1.0 + 0.05 * np.sin(1e4 * case.settings["ship.tow_speed"])  # rough
            row |= {"verdict": "doubtful", "reasons": "RINGING_DAMPED for 1 s (1 % of the run): the steps"}
            if len(cases) < 40 and case.number == 0:
                row |= {"verdict": FAILED, "error": "winch.scope: too long"}
        return rows

    odd = [
        ("deep", "c1", 100, 30, 1.8, 40, 120),
        ("fast", "c1", 100, 30, 6.0, 40, 75),
        ("off", "c2", 200, 30, 1.8, 30, 9),
    ]
    said = flags(judged(table_of(tmp_path, [*tows_of(25), *odd]), run=faulty))
    wanted = {"ROUGH", "DOUBTFUL_TOWS", "FAILED_TOWS", "LEFT_OUT", "SPEEDS", "OUTLIERS", "FEW_TOWS"}
    assert wanted <= set(said)
    assert "fast (3.09 m/s)" in said["SPEEDS"] and "off (9 for" in said["OUTLIERS"]
    assert "RINGING_DAMPED in 26" in said["DOUBTFUL_TOWS"] and "too long" in said["FAILED_TOWS"]


def test_a_fit_behind_the_cosine_and_intervals_that_do_not_hold_are_said(tmp_path):
    exact = list(tows_of(40, angle=0.0, depth=0.0))
    assert "BEHIND" in flags(judged(table_of(tmp_path, exact)))
    apart = [(*row[:-1], row[-1] * (0.6 if row[1] in ("c0", "c2", "c4", "c6") else 1.0)) for row in tows_of(40)]
    halves = [(row[0], "even" if row[1] in ("c0", "c2", "c4", "c6") else "odd", *row[2:]) for row in apart]
    assert "COVERAGE" in flags(judged(table_of(tmp_path, halves)))


def test_a_number_at_the_end_of_its_range_is_said(tmp_path):
    less = judged(table_of(tmp_path, tows_of(25, area=0.1)), free=("towbody.drag_area[*]=0.8:1.2",))
    assert "drag_area" in flags(less)["AT_BOUND"]


def of_the_product(cases):
    """Tows of which the depth tells the product of drag area and amplification alone."""
    for case in cases:
        amplification = case.settings.get("cable.sections.wire.drag_amplification", 1.0)
        case.settings["towbody.drag_area"] = [amplification * case.settings.get("towbody.drag_area", [0.85])[0]]
    return run(cases)


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("end", "run", "wanted"), [(2.5, run, {"UNKNOWN"}), (1.4, of_the_product, {"NOT_APART", "UNKNOWN"})]
)
def test_numbers_that_the_tows_cannot_tell_are_said(tmp_path, end, run, wanted):
    free = FREE, f"cable.sections.wire.drag_amplification=0.7:{end}"
    found = flags(judged(table_of(tmp_path, tows_of(30)), free=free, run=run))
    assert wanted & set(found)


def test_without_a_free_number_errors_are_found_all_the_same(tmp_path):
    found = judged(table_of(tmp_path, tows_of(40, area=0.85)), free=())
    assert found.fitted.values.size == 0 and found.fitted.at.depth == pytest.approx(0.03, rel=0.5)


def test_a_scene_that_cannot_be_towed_so_is_refused_with_its_reason(tmp_path):
    def broken(cases):
        return [{"verdict": FAILED, "error": "winch.scope: too long", "reasons": ""} for _ in cases]

    with pytest.raises(CableSimError, match=r"winch\.scope: too long"):
        judged(table_of(tmp_path, tows_of(20)), run=broken)


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"wire_from": "deck"}, "wire_from"),
        ({"speeds": {}}, "speeds"),
        ({"speeds": {"net": {"field": "speed", "unit": "kn", "scaled": True}}}, "speeds"),
        ({"depth": {"field": "depth", "unit": "kn"}}, "depth.unit"),
        ({"depth": {"field": "depth", "unit": "dbar"}}, "dbar in Pa; nothing was started. Known for it: m,"),
        ({"wire": {"field": "wire", "unit": "parsec"}}, "wire.unit"),
        ({"wire": {"field": "wire", "unit": "m", "scaled": True}}, "wire.scaled"),
        ({"wire": {"field": "wire", "unit": "m", "factor": 0.0}}, "wire.factor"),
        ({"angle": {"field": "angle", "unit": "deg", "over": "wire"}}, "angle.over"),
        ({"angle": {"field": "angle", "unit": "deg", "error": 3.0}}, "angle.error"),
        ({"depth": {"field": "", "unit": "m"}}, "depth.field"),
        ({"hold": {"field": "hold", "unit": "m"}}, "hold.unit"),
        ({"hold": {"field": "hold", "unit": "s"}, "stays": 3.0}, "stays"),
        ({"series": SERIES["series"] | {"field": ""}}, "series.field"),
        ({"series": SERIES["series"] | {"wire": {"field": "wire", "unit": "kn"}}}, "series.wire.unit"),
        ({"series": SERIES["series"] | {"wire": {"field": ["a", "b"], "unit": "m"}}}, "series.wire.field"),
        ({"series": SERIES["series"] | {"depth": {"field": "d", "unit": "m", "scaled": True}}}, "series.depth.scaled"),
        ({"wire": None}, "wire"),
    ],
)
def test_a_map_that_does_not_fit_is_refused_by_its_key(change, key):
    with pytest.raises(TowsMapError) as caught:
        MAPS.check(MAP | change, "map")
    assert any(key in text for text in caught.value.problems)


def test_a_column_that_is_not_there_is_named_with_those_that_are(tmp_path):
    path = table_of(tmp_path, [], "tow,cruise,wire,rate,speed,angle\n")
    with pytest.raises(CableSimError, match="'depth'.*tow, cruise, wire"):
        read_tows(path, MAPS.check(MAP, "map"), 6.0)


def test_wire_from_the_sheave_is_less_in_the_water(tmp_path):
    path = table_of(tmp_path, [("a", "one", 100, 30, 1.8, 40, 75)])
    water, sheave = (read_tows(path, MAPS.check(MAP | {"wire_from": one}, "map"), 6.0) for one in ("water", "sheave"))
    assert water.tows[0].wire - sheave.tows[0].wire == 6.0


def test_counts_of_a_flow_meter_become_a_speed():
    made = load_map("nes_lter")
    table = read_tows("nes_lter", made, 6.0)
    assert len(table.tows) == 98 and not table.left
    first = table.tows[0]
    assert first.speeds["net"] == pytest.approx(0.5 * (16790 + 18411) * 0.026873 / 606.0)
    assert first.rate_out == pytest.approx(20 / 60) and first.angle == pytest.approx(radians(40.0))


def test_folds_keep_groups_together_and_intervals_are_widened_by_rank():
    groups = list("aabbbcd")
    assert len(set(folds_of(groups, None))) == 4
    two = folds_of(groups, 2)
    assert all(len({fold for fold, name in zip(two, groups) if name == one}) == 1 for one in "abcd")
    assert sorted(np.bincount(two)) == [3, 4]
    found = np.tile([9.0, 10.0, 12.0], (9, 1))
    depth = np.array([10.0] * 8 + [14.0])
    assert widened(depth, found) == 2.0  # nine tows: the ninth of nine holds 90 of 100, and one more
    assert wider(found, 2.0)[0].tolist() == [8.0, 10.0, 14.0]


def command(*arguments):
    return CliRunner().invoke(main, ["tows", *map(str, arguments)])


@pytest.mark.nightly
def test_a_table_is_simulated_to_its_end(tmp_path):
    """Ten short tows, the design and each of them in processes; one beside the same run in this one."""
    rows = [(f"t{k}", "ab"[k % 2], 8 + 0.2 * k, 30, 1.6 + 0.04 * k, 30 + k, 6.6 + 0.1 * k) for k in range(10)]
    (tmp_path / "map.yaml").write_text(json.dumps(MAP), encoding="utf-8")
    given = table_of(tmp_path, rows), "--scene", "bongo", "--map", tmp_path / "map.yaml", "--design", 64
    done = command(*given, "--free", "towbody.drag_area[0]=0.5:1.5", "--out", tmp_path / "out", "--json")
    assert done.exit_code == CODE_DOUBTFUL, done.output
    figures = json.loads(done.stdout)
    assert "FEW_TOWS" in {reason["flag"] for reason in figures["verdict"]["reasons"]}
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"rows", "tows.csv", "tows.json", "tows.png"}
    row, value = figures["rows"][0], figures["numbers"][0]["value"]
    scene = override(
        load_scene("bongo"),
        {"ship.tow_speed": row["true_speed_mps"], "winch.scope": 10.0, "towbody.drag_area": [value, 0.85, 0.85]},
    )
    frames = offline.run(scene, duration=23.0, winch="0 rate 0.5, 8 hold, 13.001 rate -0.5", step="chosen").frames
    assert -frames["body_position"][:, 2].min() == row["simulated_depth_m"]


def test_the_command_answers_in_files_and_with_its_code(tmp_path, monkeypatch):
    """The runs of the closed form in place of those of the tow, which are nightly."""

    def computed(cases, folder, **more):
        folder.mkdir(exist_ok=True)
        return run(cases), []

    monkeypatch.setattr(sweep, "computed", computed)
    (tmp_path / "map.yaml").write_text(json.dumps(MAP), encoding="utf-8")
    given = table_of(tmp_path, tows_of(20)), "--scene", "bongo", "--map", tmp_path / "map.yaml", "--folds", 2
    done = command(*given, "--free", FREE, "--out", tmp_path / "out", "--json")
    assert done.exit_code == CODE_DOUBTFUL, done.output
    figures = json.loads(done.stdout)
    assert "FEW_TOWS" in {reason["flag"] for reason in figures["verdict"]["reasons"]} and len(figures["rows"]) == 20
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"tows.csv", "tows.json", "tows.png"}


@pytest.mark.parametrize(
    ("more", "why"),
    [
        (("--set", "ship.tow_speed=1"), "ship.tow_speed is given"),
        (("--free", "winch.scope=8:20"), "winch.scope is given"),
        (("--free", "towbody.mass", "--free", "towbody.net_weight", "--free", "cable.diameter"), "3 numbers"),
        (("--group", "nothing"), "'nothing'"),
    ],
)
def test_options_that_contradict_the_table_are_refused_in_one_line(tmp_path, more, why):
    (tmp_path / "map.yaml").write_text(json.dumps(MAP), encoding="utf-8")
    done = command(table_of(tmp_path, tows_of(20)), "--scene", "bongo", "--map", tmp_path / "map.yaml", *more)
    assert done.exit_code == 2 and why in " ".join(done.output.split()), done.output


LEGS = np.array([0.0, 10.0, 200.0, 205.0, 400.0]), np.array([0.0, 0.0, 95.0, 95.0, -2.5])  # s, m: deck, out, hold, in


def file_of(path, time=None, wire=None, speed=1.8, depth=None, head="t_s,wire,speed,depth"):
    """A series of one of the legs at 1 Hz, or of these columns; depth: of its deepest row."""
    time = np.arange(401.0) if time is None else np.asarray(time)
    wire = np.interp(time, *LEGS) if wire is None else np.asarray(wire)
    rows = np.broadcast_arrays(time, wire, speed, np.nan if depth is None else depth)
    lines = [",".join("" if value != value else f"{value:.9g}" for value in row) for row in zip(*rows)]
    path.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")


def over_time(folder, name="a.csv", row="a,one,,,,40,75", made=SERIES, max_rate=0.6):
    (folder / "tows.csv").write_text(f"{HEAD.strip()},file\n{row},{name}\n{ROW.strip()},\n", encoding="utf-8")
    return read_tows(folder / "tows.csv", MAPS.check(made, "map"), 6.0, max_rate=max_rate)


def test_a_series_counts_in_place_of_the_numbers_of_its_row(tmp_path):
    file_of(tmp_path / "a.csv", speed=1.8 + 0.3 * np.sin(0.01 * np.arange(401.0)), depth=60.0)
    table = over_time(tmp_path, row="a,one,50,,,40,75")
    tow, plain = table.tows
    assert plain.series is None and not table.left
    assert (tow.wire, tow.depth) == (95.0, 60.0) and len(table.notes) == 2  # wire and depth of the row are others
    # from 4 m on the way out to 4 m on the way in, along the legs
    assert tow.series.time == pytest.approx([0.0, 182.0, 187.0, 369.0], abs=0.3) and tow.series.wire[0] == 4.0
    assert tow.speeds["ship"] == pytest.approx(np.mean(1.8 + 0.3 * np.sin(0.01 * np.arange(18, 388))) / 1.944, 1e-2)
    winch, ship, speed = tow.series.plans(2.0 * tow.series.mean)
    assert WinchPlan(winch).items[0].value == pytest.approx(0.5, 1e-3)
    ShipPlan(ship).check(load_scene("bongo").ship)
    track = ShipPlan(ship).track(np.arange(0.0, 369.0, 0.02), Ship(tow_speed=speed))[1][:, 0]
    read = 2.0 * (1.8 + 0.3 * np.sin(0.01 * (np.arange(0.0, 369.0, 0.02) + 18.0))) / 1.944
    assert np.abs(track - read).max() < 0.1 and track.mean() == pytest.approx(read.mean(), 2e-3)


def test_a_winch_follows_a_counter_of_whole_metres_and_leaves_gaps_out(tmp_path):
    wire = np.round(np.interp(np.arange(401.0), *LEGS))
    wire[50] = np.nan
    file_of(tmp_path / "a.csv", wire=wire)
    table = over_time(tmp_path)
    rates = table.tows[0].series.rates
    assert 0.4 < rates.max() <= 0.606 and table.tows[0].wire == 95.0
    assert "1 of 401 rows, first in row 51" in table.notes[0] and "followed within" in table.notes[-1]


TIME = np.arange(401.0)


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"time": [*range(300), *range(298, 399)]}, "row 301 is 298 s .* not after 299 s"),
        ({"wire": np.full(401, np.nan)}, "is no column of numbers"),
        ({"wire": np.where(TIME < 399, np.nan, 5.0)}, "wire has 2 finite numbers, .* needs 4"),
        ({"wire": np.interp(TIME, *LEGS) / 40}, r"wire reaches 2.375 m .* outside \[5"),
        ({"wire": -np.interp(TIME, *LEGS)}, "wire reaches 2.5 m .*factor: -1"),
        ({"wire": np.interp(TIME, *LEGS) - 7.0}, "wire = -9.5 m .* below -6 m"),
        ({"wire": 2.0 * np.interp(TIME, *LEGS)}, "wire runs at 1 m/s.* winch.max_rate = 0.6 m/s.*--set"),
        ({"wire": np.where(abs(TIME - 200.0) < 40.0, np.nan, np.interp(TIME, *LEGS))}, "no number for 80 s.*10%"),
        ({"time": TIME / 100.0, "wire": np.interp(TIME, *LEGS)}, "lasts 3.69 s, outside"),
        ({"speed": 1800.0}, "speed = 926 to 926 m/s.*outside"),
        ({"time": [0, 1, 2], "wire": [0, 50, 0]}, "has 3 rows .* needs 4"),
        ({"head": "t_s,wire_ft,speed,depth"}, r"is no column of numbers \(wire_ft"),
        ({"head": "t_s,wire [ft],speed,depth"}, "wire is in ft by its heading, in m by the map"),
        ({"head": "t_s,wire,speed [m],depth"}, "speed is in m by its heading, in kn by the map"),
    ],
)
def test_a_series_that_is_no_tow_is_left_out_with_its_reason(tmp_path, given, why):
    file_of(tmp_path / "a.csv", **given)
    (left,) = over_time(tmp_path).left
    assert left.startswith("line 2, a: a.csv: ") and re.search(why, left), left


DEEP = 0.7 * np.interp(TIME - 3.0, *LEGS)  # m; a little behind the wire


@pytest.mark.parametrize(
    ("depth", "largest", "why"),
    [
        (np.where(TIME % 5.0 > 0.0, np.nan, DEEP), 66.5, None),  # a slower recorder
        (np.where(TIME == 100.0, 90.0, DEEP), 66.5, "stands alone in 1 rows, first 90 m at 82 s"),
        (np.where(abs(TIME - 200.0) < 60.0, np.nan, DEEP), 75.0, "no number for 120 s, 122 s.* reached 75.1 m"),
        (np.where(TIME < 150.0, DEEP, np.nan), 75.0, "no number for 23[0-9.]+ s, 13[01]"),
        (np.where(TIME > 260.0, DEEP, np.nan), 75.0, "no number for 24[0-9.]+ s, 0 s"),
        (-DEEP, 75.0, "sign"),
    ],
)
def test_a_largest_depth_that_a_series_does_not_show_is_left_to_the_row(tmp_path, depth, largest, why):
    file_of(tmp_path / "a.csv", depth=depth)
    table = over_time(tmp_path)
    assert table.tows[0].depth == pytest.approx(largest, abs=0.01)
    assert why is None or any(re.search(why, note) for note in table.notes), table.notes


def test_lines_do_not_follow_the_noise_of_a_counter(tmp_path):
    noise = 0.05 * np.random.default_rng(1).normal(size=401)
    file_of(tmp_path / "a.csv", wire=np.round(np.interp(TIME, *LEGS) + noise, 1), depth=75.0)
    table = over_time(tmp_path)
    assert len(table.tows[0].series.time) < 15 and not table.notes  # 150, were they within 0.1 m
    assert table.tows[0].series.rates.max() == pytest.approx(0.5, rel=0.03)


def test_rows_may_be_missing_where_the_wire_stands(tmp_path):
    time = np.delete(TIME, np.s_[201:264])
    file_of(tmp_path / "a.csv", time, np.interp(time, [0, 200, 265, 400], [0, 95, 95, 30]))
    assert over_time(tmp_path).tows[0].series.time[-1] == pytest.approx(391.6, abs=0.1)


def test_a_file_that_is_not_there_or_too_large_is_left_out_and_one_elsewhere_refused(tmp_path, monkeypatch):
    file_of(tmp_path / "a.csv")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "b.csv").symlink_to(tmp_path / "a.csv")
    assert "no such file" in over_time(tmp_path / "in", "c.csv").left[0].lower()
    assert "it is a folder" in over_time(tmp_path, "in").left[0]
    for name in ("../a.csv", "b.csv", str(tmp_path / "a.csv")):
        with pytest.raises(CableSimError, match="outside the folder of the table"):
            over_time(tmp_path / "in", name)
    monkeypatch.setattr(series, "MOST_BYTES", 100)
    assert "beyond 0 MB" in over_time(tmp_path).left[0]


def test_a_tow_over_time_has_the_depth_and_interval_of_its_row(tmp_path):
    """Three of 12 rows as series: between designs of 64 and of 16 tows of closed form the same but for both errors."""
    rows = [(*row, "") for row in tows_of(12)]
    plain = judged(table_of(tmp_path, rows, f"{HEAD.strip()},file\n"), made=SERIES)
    for k in range(3):
        name, group, wire, rate, speed, angle, depth, _ = rows[k]
        out = (wire - 4.0) * 60.0 / rate
        file_of(tmp_path / f"{k}.csv", [0, out, out + 5, 2 * out + 5], [4, wire, wire, 4], speed, depth)
        rows[k] = (name, group, "", "", "", angle, "", f"{k}.csv")
    found = judged(table_of(tmp_path, rows, f"{HEAD.strip()},file\n"), made=SERIES)
    assert found.between.tows == 64 + 3 * 16 and found.between.over_time[1] < 0.005
    within = found.between.over_time[0] + plain.between.error[0]
    assert found.left_out == pytest.approx(plain.left_out, rel=within)
    assert found.fitted.values == pytest.approx(plain.fitted.values, rel=within)


def test_tows_of_nes_lter_written_as_series_are_as_deep(tmp_path):
    """Lines of wire are the same but for digits: 1 mm, where 0.1 m were allowed. The last has a speed that swings by
    0.03 m/s about its mean, of which 0.1 m/s are 7.5 % of depth (docs/tows.md)."""
    made, scene = load_map("nes_lter"), load_scene("bongo")
    own = SERIES["series"] | {"speed": {"field": "speed", "unit": "m/s"}}
    rows = [tow for tow in read_tows("nes_lter", made, HEIGHT).tows if tow.wire <= 30.0]
    rows = sorted(rows, key=lambda tow: tow.wire)[:2]
    lines = [f"{HEAD.strip()},file"]
    for k, tow in enumerate(rows):
        out, back = tow.wire / tow.rate_out, tow.wire / tow.rate_in
        time = np.arange(0.0, out + 5.0 + back, 1.0)
        speed = tow.speeds["ship"] + (0.03 * np.sin(time / 10.0) if k else 0.0)
        wire = np.interp(time, [0.0, out, out + 5.0, out + 5.0 + back], [0.0, tow.wire, tow.wire, 0.0])
        file_of(tmp_path / f"{k}.csv", time, wire, speed)
        lines.append(f"{tow.name},{tow.group},,,,,,{k}.csv")
    (tmp_path / "tows.csv").write_text("\n".join(lines), encoding="utf-8")
    map_ = MAPS.check(MAP | {"begin": made.begin, "series": own}, "map")
    found = read_tows(tmp_path / "tows.csv", map_, HEIGHT)
    setting = Setting("bongo", scene, {}, made.begin, HEIGHT, [])
    tows = [made_of(tow, row.speeds["ship"]) for row, tow in zip([*rows, *rows], [*rows, *found.tows], strict=True)]
    cases = cases_of(setting, tows, np.empty((4, 0)))
    assert [case.ship is None for case in cases] == [True] * 3 + [False]
    by_row, by_series = np.split(answered([simulate(case) for case in cases]).depth, 2)
    assert by_series[0] == pytest.approx(by_row[0], abs=1e-3)
    assert by_series[1] == pytest.approx(by_row[1], rel=0.75 * 0.03)
