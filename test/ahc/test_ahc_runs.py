"""Runs of the AHC benchmark: motion at scale, twins, live changes, controllers of others, the command itself."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from ahc_rows import call

from cable_sim_ros.errors import TowError
from cable_sim_ros.io.messages.messages import decode_odometry
from cable_sim_ros.tools.ahc import benchmark, board, definition, simulate, tables
from cable_sim_ros.tools.ahc.definition import Cell, Class
from cable_sim_ros.tools.ahc.entrants import AhcError, Entrant, external, laws
from cable_sim_ros.tools.ahc.simulate import Span

HERE = Path(__file__).parent
CONTROLLERS = HERE / "controllers.py"
PAGE, BOARD = (HERE.parents[1] / "docs" / name for name in ("ahc.md", "ahc-1.csv"))
SHORT = Span(16.0, 8.0)
FULL_SCALE = Cell("full_scale", "nbp1406", "ideal")
SHEAVE = Entrant("simplified_sheave", "law", "simplified_sheave")


@pytest.fixture
def follower(tmp_path):
    """The controller of docs/ahc.md as FILE.py:NAME."""
    (code,) = re.findall(r"^```python\n(.*?)^```", PAGE.read_text("utf-8"), re.S | re.M)
    (tmp_path / "my_file.py").write_text(code)
    return f"{tmp_path / 'my_file.py'}:make"


@pytest.fixture
def with_class(monkeypatch):
    """Add a class to the definition."""

    def add(one):
        monkeypatch.setattr(definition, "CLASSES", (*definition.CLASSES, one))
        return FULL_SCALE._replace(condition=one.name)

    return add


def coordinates(tow):
    rows = [decode_odometry(event.data) for event in tow.events]
    time = np.array([row.stamp for row in rows]) * 1e-9
    return (
        time - time[0],
        np.array([(*row.position, *row.angles) for row in rows]),
        np.array([r.velocity for r in rows]),
    )


def test_a_recorded_ship_is_put_on_the_track_of_a_scene_at_its_scale():
    large = simulate.motion_of_cell(FULL_SCALE, 60.0)
    small = simulate.motion_of_cell(Cell("flume", "nbp1406", "ideal"), 60.0 * 0.02**0.5)
    (t, x, v), (s, y, _) = coordinates(large), coordinates(small)
    assert len(t) == len(s) and np.allclose(s, 0.02**0.5 * t, atol=1e-8)
    assert np.allclose(y[:, 2], 0.02 * x[:, 2], atol=1e-9) and np.allclose(y[:, 3:], x[:, 3:], atol=1e-9)
    assert np.allclose(
        y[:, 0], 0.02 * (x[:, 0] - 2.2 * t), atol=1e-7
    )  # the flume's ship stands, this one makes 2.2 m/s
    assert 0.9 < x[:, 2].std() < 1.6
    heave = np.gradient(x[:, 2], t)
    level = np.abs(x[:, 3:5]).max(1) < 0.01
    assert np.abs(v[level, 2] - heave[level])[2:-2].max() < 0.05  # rates are those of the places
    assert abs(np.polyfit(t, x[:, 1], 1)[0]) < 1e-2 and abs(np.polyfit(t, x[:, 0], 1)[0] - 2.2) < 1e-2


def test_gaps_are_cut_out_of_the_motion():
    whole = simulate.motion_of_cell(FULL_SCALE, 60.0)
    stamps = np.array([event.time for event in simulate.with_gaps(whole, ((10.0, 12.0), (20.0, 20.5))).events])
    since = (stamps - stamps[0]) * 1e-9
    assert not ((since > 10.0) & (since < 12.0)).any() and not ((since > 20.0) & (since < 20.5)).any()
    assert len(whole.events) - len(stamps) == pytest.approx(50 * 2.5, abs=2)


def test_a_held_winch_is_its_own_twin_and_a_law_beats_it():
    held, sheave = (benchmark.row_of(entrant, FULL_SCALE, SHORT) for entrant in (laws(("hold",))[0], SHEAVE))
    assert held["figures"] == held["twin"] == sheave["twin"]
    assert held["figures"]["decoupling"] == 0.0 and held["figures"]["travel_m"] == 0.0
    assert sheave["figures"]["decoupling"] > 0.8 and sheave["state"] == "ok"
    assert sheave["figures"]["tension_std_n"] < 0.3 * sheave["twin"]["tension_std_n"]
    again = benchmark.row_of(SHEAVE, FULL_SCALE, SHORT)
    assert again == sheave
    late = benchmark.row_of(SHEAVE, FULL_SCALE._replace(condition="dead_400"), SHORT)
    assert late["figures"]["decoupling"] < sheave["figures"]["decoupling"] - 0.05


def test_a_law_that_is_not_for_a_cable_is_skipped_and_says_so():
    row = benchmark.row_of(Entrant("w", "law", "simplified_waterline"), FULL_SCALE, SHORT)
    assert row["state"] == "skipped" and row["reason"].startswith(
        "the law is not for this cable: Take simplified_sheave"
    )
    assert row["figures"] is None and row["twin"] is None


def test_a_law_that_instruments_cannot_serve_is_skipped_and_one_that_they_can_is_spoiled_by_their_faults():
    cell, span = Cell("lowered", "nbp1406", "mru_heave_frozen"), Span(90.0, 20.0)
    angle = benchmark.row_of(Entrant("r", "law", "rigorous_sheave"), cell, span)
    assert angle["state"] == "skipped" and "goes by the departure angle, which no instrument aboard" in angle["reason"]
    clean, frozen = (
        benchmark.row_of(SHEAVE, cell._replace(condition=name), span)["figures"]
        for name in ("measured", cell.condition)
    )
    assert clean["decoupling"] > 0.98 and frozen["decoupling"] < 0.7
    assert frozen["overshoot_n"] > 1000.0 and frozen["time_to_safe_s"] > 10.0


def test_a_controller_hears_what_instruments_show():
    """A load pin that freezes after 6 s; a controller of a file heard the truth."""
    cell, heard = Cell("full_scale", "nbp1406", "measured"), []
    scene, tow = simulate.scene_of(cell, "hold"), simulate.motion_of_cell(cell, 10.0)
    frozen = ((6.0, "faults.load_pin.kind", "frozen"),)
    simulate.offline(scene, tow, 10.0, lambda row: heard.append(float(row.tension)), 0.02, frozen)
    assert np.ptp(heard[310:]) == 0.0 and np.ptp(heard[:300]) > 10.0


def test_a_wrong_key_of_a_block_that_there_is_fails_and_is_no_skip(with_class):
    row = benchmark.row_of(SHEAVE, with_class(Class("typo", "", {"drive.ded_time": 0.1})), SHORT)
    assert row["state"] == "failed" and "drive.ded_time" in row["reason"] and "drive.dead_time" in row["reason"]
    row = benchmark.row_of(SHEAVE, with_class(Class("dead", "", changes=((5.0, "drive.inertia", 1.0),))), SHORT)
    assert row["state"] == "failed" and "drive.inertia" in row["reason"]


@pytest.mark.parametrize("own", [False, True])
def test_live_changes_come_at_their_times(with_class, follower, own, monkeypatch):
    """The winch is braked from 8 s on: it does not move any more, whoever commands it."""
    motor = definition.place("full_scale").drive
    cell = with_class(Class("braked", "", motor, changes=((8.0, "drive.mode", "brake"),), fault=(8.0, 9.0)))
    entrant = external(None, follower, None) if own else SHEAVE
    done, run = simulate.run_cell(entrant, cell, SHORT), simulate.run_cell
    time = np.arange(1, len(done.frames) + 1) * 0.01
    moved = np.abs(done.frames["payout_rate"])
    assert moved[(time > 5.0) & (time < 8.0)].max() > 0.05 and moved[time > 11.0].max() < 1e-3
    modes = done.frames["winch_mode"]
    assert (modes[time < 7.995] == 0).all() and (modes[time > 8.015] == 3).all()
    monkeypatch.setattr(benchmark, "run_cell", lambda *given: done if given[1] == cell else run(*given))
    row = benchmark.row_of(entrant, cell, SHORT)
    assert row["figures"]["overshoot_n"] > 0.0


def test_events_beyond_a_short_run_are_not_passed_over_in_silence():
    row = benchmark.row_of(SHEAVE, FULL_SCALE._replace(condition="dropouts"), SHORT)
    assert row["state"] == "skipped" and "its events are beyond the 16 s of this run" in row["reason"]


def test_the_controller_of_the_page_stands_beside_the_laws(follower):
    mine = external(None, follower, None)
    assert (mine.name, mine.rank) == ("my_file", "external")
    for cell in (FULL_SCALE, Cell("flume", "nbp1406", "ideal")):
        row = benchmark.row_of(mine, cell, SHORT)
        assert row["state"] == "ok" and row["figures"]["decoupling"] > 0.8, cell


@pytest.mark.parametrize(
    "name, text",
    [
        ("raises_later", "raised RuntimeError: out of ideas"),
        ("refuses", "for full_scale it raised ValueError: not for full_scale. It is called with the scene and the"),
        ("makes_nothing", "for full_scale it returned a NoneType, no callable. Return a controller(row)"),
    ],
)
def test_a_controller_that_fails_is_a_row_with_its_reason(name, text):
    row = benchmark.row_of(external("mine", f"{CONTROLLERS}:{name}", None), FULL_SCALE, SHORT)
    assert row["state"] == "failed" and text in row["reason"] and row["figures"] is None


@pytest.mark.parametrize(
    "content, name, text",
    [
        ("x = 1/0\n", "make", "raised ZeroDivisionError: division by zero; nothing was run. Correct it"),
        ("x = 1\n", "make", "has no make; nothing was run"),
        ("make = 3\n", "make", "has no function but a int make; nothing was run"),
    ],
)
def test_a_file_without_a_maker_is_refused(tmp_path, content, name, text):
    path = tmp_path / "mine.py"
    path.write_text(content)
    with pytest.raises(AhcError, match=re.escape(text)):
        external(None, f"{path}:{name}", None)


def test_the_quick_benchmark_makes_table_json_and_picture(tmp_path):
    pytest.importorskip("matplotlib")
    done = call("simplified_sheave", "--quick", "--processes", "1", "--out", tmp_path)
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "ahc.json").read_text())
    assert [f"{r['scene']}/{r['motion']}/{r['class']}" for r in found["rows"]] == list(definition.QUICK)
    assert all(row["state"] == "ok" for row in found["rows"]) and not found["complete"]
    assert (found["benchmark"], found["definition"]) == ("ahc-1", definition.digest())
    assert (tmp_path / "ahc.png").read_bytes().startswith(b"\x89PNG")
    assert "tension_std_n" in (tmp_path / "ahc.md").read_text() and "simplified_sheave" in done.output
    refused = call("--merge", tmp_path / "ahc.json", "--board", tmp_path / "board.csv")
    assert refused.exit_code == 2 and "simplified_sheave lacks" in refused.output


def test_two_processes_find_the_same():
    one, two = (benchmark.run([SHEAVE, *laws(("hold",))], [FULL_SCALE], SHORT, processes=n) for n in (1, 2))
    assert one["rows"] == two["rows"] and len(one["rows"]) == 2


def test_the_page_is_made_of_definition_and_leaderboard():
    rows = board.with_twins(board.read(BOARD))
    text = PAGE.read_text("utf-8")
    assert tables.made(text, rows) == text, "cable-sim ahc --table --board docs/ahc-1.csv --page docs/ahc.md"
    with pytest.raises(AhcError, match="--page: has no lines <!-- made: results --> and <!-- made: end -->"):
        tables.made("# A page", rows)


def test_a_program_that_cannot_run_is_a_row_with_its_reason(monkeypatch):
    pytest.importorskip("rclpy")

    def fails(*_, **__):
        raise TowError("the node ended with code 3")

    monkeypatch.setattr("cable_sim_ros.testing.tow", fails)
    row = benchmark.row_of(external("idle", None, "python3 idle.py"), FULL_SCALE, SHORT)
    assert (row["state"], row["reason"]) == ("failed", "the node ended with code 3")


def test_a_program_needs_ros_and_says_so(monkeypatch):
    monkeypatch.setattr("cable_sim_ros.tools.ahc.simulate.find_spec", lambda name: None)
    row = benchmark.row_of(external("idle", None, "python3 idle.py"), FULL_SCALE, SHORT)
    assert row["state"] == "failed" and "--command needs ROS 2, and rclpy cannot be imported" in row["reason"]


def test_the_leaderboard_of_the_repository_is_of_this_definition():
    rows = board.read(BOARD)
    assert {row["benchmark"] for row in rows} == {definition.VERSION, definition.MRU}
    for name, version in {(row["entrant"], row["benchmark"]) for row in rows}:
        mine = [row for row in rows if (row["entrant"], row["benchmark"]) == (name, version)]
        assert {row["definition"] for row in mine} == {definition.digest(version)}
        assert {board.cell_of(row) for row in mine} == set(definition.cells(version=version))


def test_dead_time_on_the_leaderboard_leaves_what_the_formula_says():
    """The law leads by nothing in `lowered`; the peak period of nbp1406 is that of bags/README.md."""
    rows = {board.key_of(row): row["figures"] for row in board.read(BOARD)}
    for ms in (50, 100, 200, 400):
        found = rows["simplified_sheave", Cell("lowered", "nbp1406", f"dead_{ms}")]["decoupling"]
        assert 1.0 - found == pytest.approx(2.0 * np.sin(np.pi / 10.7 * 1e-3 * ms), rel=0.1), ms


def test_the_leaderboard_repeats_and_one_that_does_not_is_said_with_code_1(tmp_path, monkeypatch):
    text, kept, run = BOARD.read_text("utf-8"), [], benchmark.run

    def once(*given):
        if not kept:
            kept.append(run(*given))
        return kept[0]

    monkeypatch.setattr(benchmark, "run", once)
    options = ("--check", "--only", "flume/lmg1903/ideal", "--processes", "1", "--board")
    done = call("hold", "simplified_sheave", *options, BOARD)
    assert done.exit_code == 0 and "2 rows run again, 0 differences above 0.1 %" in done.output
    head, *lines = text.splitlines()
    at = head.split(",").index("tension_std_n")
    k = next(i for i, line in enumerate(lines) if ",flume,lmg1903,ideal," in line and line.startswith("hold,"))
    values = lines[k].split(",")
    values[at] = f"{1.01 * float(values[at]):.6g}"
    path = tmp_path / "board.csv"
    path.write_text("\n".join([head, *lines[:k], ",".join(values), *lines[k + 1 :]]) + "\n")
    done = call("hold", "simplified_sheave", *options, path)
    assert done.exit_code == 1 and "hold flume/lmg1903/ideal: tension_std_n = " in done.output
    done = call("hold", "simplified_sheave", *options, path, "--json")
    assert [one["what"] for one in json.loads(done.stdout)] == ["tension_std_n"]
