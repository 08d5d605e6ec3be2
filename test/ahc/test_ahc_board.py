"""The definition, the leaderboard and who may be on it: merged, refused, compared; every error text."""

import copy
import json

import pytest
from ahc_rows import call, result_of, row_of

from cable_sim_ros.tools.ahc import board, definition, tables
from cable_sim_ros.tools.ahc.definition import Cell
from cable_sim_ros.tools.ahc.entrants import AhcError
from cable_sim_ros.tools.ahc.figures import NAMES

CELLS = definition.cells()


def figures(scale=1.0):
    return {name: scale * (k + 1.0) for k, name in enumerate(NAMES)}


def rows_for(*entrants, cells=CELLS):
    return [row_of(name, cell, figures(), figures()) for name in entrants for cell in cells]


def result(*entrants, **changed):
    return result_of(**{"rows": rows_for(*entrants), **changed})


def test_cells_are_those_of_the_tables():
    every = [one for one in definition.CLASSES if one.scenes == ("*",)]
    assert len(CELLS) == len(set(CELLS)) == 16 * len(every) + 2 * (len(definition.CLASSES) - len(every))
    assert definition.cells(("flume/*/ideal", "deep/lmg1903/dead_50")) == [
        *(Cell("flume", one.name, "ideal") for one in definition.MOTIONS),
        Cell("deep", "lmg1903", "dead_50"),
    ]
    assert len(definition.cells(definition.QUICK)) == len(definition.QUICK)
    assert all(definition.condition(one.twin).twin == one.twin for one in definition.CLASSES)


def test_values_of_a_scene_at_scale_follow_froude():
    values = {"drive.dead_time": 0.1, "water.waves.height": 4.0, "drive.bandwidth": 6.0, "drive.model": "motor"}
    small = definition.scaled(values, 0.04)
    assert small == pytest.approx(
        {**values, "drive.dead_time": 0.02, "water.waves.height": 0.16, "drive.bandwidth": 30}
    )
    assert definition.scaled(values, 1.0) == values


def test_another_definition_has_another_digest(monkeypatch):
    before = definition.digest()
    monkeypatch.setattr(definition, "DURATION", 119.0)
    assert definition.digest() != before
    monkeypatch.undo()
    assert definition.digest() == before


def test_a_leaderboard_goes_through_its_file(tmp_path):
    mine = result("hold", "mine")
    mine["rows"][3] |= {"state": "skipped", "reason": 'no key "a, b"', "figures": None, "twin": None}
    merged = board.merge([], mine, "ahc.json")
    path = tmp_path / "board.csv"
    path.write_text(board.text_of(merged), "utf-8")
    again = board.read(path)
    assert board.compared(merged, again) == [] and board.text_of(again) == board.text_of(merged)
    assert len(again) == 2 * len(CELLS) and again[3]["reason"] == 'no key "a, b"'
    assert board.read(tmp_path / "none.csv") == []


@pytest.mark.parametrize(
    "change, text",
    [
        ({"benchmark": "ahc-2"}, "benchmark = ahc-2, this is ahc-1: run it with this version"),
        ({"definition": "123"}, "definition = 123, that of this version is"),
        ({"rows": rows_for("mine", cells=CELLS[1:])}, f"mine lacks 1 of {len(CELLS)} cells, the first {CELLS[0]}"),
        ({"rows": rows_for("mine", cells=[*CELLS, CELLS[0]])}, "mine has a cell twice"),
        ({"rows": rows_for("mine", cells=[*CELLS, Cell("pond", "nbp1406", "ideal")])}, "or one that ahc-1 does not"),
        ({"rows": [row | {"seed": 7} for row in rows_for("mine")]}, "seed of nbp1406 = 7, that of ahc-1 is None"),
        ({"rows": [row | {"twin": figures(1.01)} for row in rows_for("mine")]}, "further apart than 0.1 %"),
    ],
)
def test_a_result_that_cannot_be_compared_is_not_merged(change, text):
    with pytest.raises(AhcError, match=r"^mine.json: ") as error:
        board.merge(board.merge([], result("hold"), "hold.json"), result("mine", **change), "mine.json")
    assert text in str(error.value) and "the leaderboard was not changed" in str(error.value)


def test_a_twin_within_the_tolerance_is_the_same_physics():
    held = board.merge([], result("hold"), "hold.json")
    near = result("mine", rows=[row | {"twin": figures(1.0009)} for row in rows_for("mine")])
    assert len(board.merge(held, near, "mine.json")) == 2 * len(CELLS)


def test_rows_are_replaced_on_demand_alone():
    held = board.merge([], result("hold", "mine"), "first.json")
    better = result("mine", rows=[row | {"figures": figures(0.5)} for row in rows_for("mine")], commit="new")
    with pytest.raises(AhcError, match="mine: stands on the leaderboard already; give --replace, or another --name"):
        board.merge(held, better, "mine.json")
    merged = board.merge(held, better, "mine.json", replace=True)
    assert len(merged) == len(held) and {row["commit"] for row in merged if row["entrant"] == "mine"} == {"new"}


def test_a_re_run_is_compared_figure_by_figure():
    rows = board.merge([], result("hold"), "hold.json")
    again = copy.deepcopy(rows)
    again[0]["figures"]["tension_std_n"] *= 1.0 + 0.9 * definition.TOLERANCE
    assert board.compared(rows, again) == []
    again[0]["figures"]["tension_std_n"] *= 1.001
    again[1] |= {"state": "failed", "figures": None}
    again[2]["figures"]["snaps"] = None
    again.append(rows[0] | {"entrant": "other"})
    found = board.compared(rows, again)
    assert [(one.entrant, one.what) for one in found] == [
        ("hold", "tension_std_n"),
        ("hold", "state"),
        ("hold", "snaps"),
        ("other", "row"),
    ]
    assert board.agree(0.0, 1e-13) and not board.agree(0.0, 1e-9) and board.agree(None, None)


def test_commands_merge_and_show(tmp_path):
    for name, done in (("hold", result("hold")), ("mine", result("mine"))):
        (tmp_path / f"{name}.json").write_text(json.dumps(done))
    path = tmp_path / "new" / "ahc-1.csv"
    for name in ("hold", "mine"):
        done = call("--merge", tmp_path / f"{name}.json", "--board", path)
        assert done.exit_code == 0, done.output
    assert f"{2 * len(CELLS)} rows of hold, mine" in done.output
    before = path.read_bytes()
    done = call("--merge", tmp_path / "mine.json", "--board", path)
    assert done.exit_code == 2 and "stands on the leaderboard already" in done.output and path.read_bytes() == before
    shown = call("--table", "--board", path)
    assert shown.exit_code == 0 and "| `mine` | +0 %, +0 % |" in shown.output and "-91 %, -89 %" in shown.output
    page = call("--definition")
    assert page.exit_code == 0 and tables.figures_markdown() in page.output and definition.digest() in page.output


@pytest.mark.parametrize(
    "text, why",
    [("entrant,rank\n", "its columns are not those"), (None, "is no row of a leaderboard"), ("twice", "twice")],
)
def test_a_file_that_is_no_leaderboard_is_refused(tmp_path, text, why):
    path = tmp_path / "board.csv"
    good = board.text_of(board.merge([], result("hold"), "hold.json"))
    line = good.splitlines()[1]
    path.write_text(
        text if text == "entrant,rank\n" else good + (line if text else line.replace(",1,", ",one,")) + "\n"
    )
    done = call("--table", "--board", path)
    assert done.exit_code == 2 and why in done.output and str(path) in done.output


def test_rows_of_another_definition_or_entrant_are_not_checked(tmp_path):
    path = tmp_path / "board.csv"
    text = board.text_of(board.merge([], result("hold"), "hold.json"))
    path.write_text(text)
    done = call("simplified_sheave", "--check", "--board", path)
    assert done.exit_code == 2 and "has no row of simplified_sheave; nothing was run. It has hold" in done.output
    path.write_text(text.replace(definition.digest(), "0123456789ab"))
    done = call("hold", "--check", "--board", path)
    assert done.exit_code == 2 and "has rows of definition 0123456789ab, here ahc-1 is" in done.output


@pytest.mark.parametrize("text", ["{}", "[1]", "no json", '{"rows": [{"entrant": "a"}]}'])
def test_a_file_that_is_no_result_is_refused(tmp_path, text):
    path = tmp_path / "ahc.json"
    path.write_text(text)
    done = call("--merge", path, "--board", tmp_path / "board.csv")
    assert done.exit_code == 2 and f"{path}: is no result of cable-sim ahc" in done.output
    done = call("--merge", tmp_path / "none.json", "--board", tmp_path / "board.csv")
    assert done.exit_code == 2 and "cannot be read (No such file" in done.output
    assert not (tmp_path / "board.csv").exists()


@pytest.mark.parametrize(
    "arguments, text",
    [
        (("no_such_law",), "no_such_law: is no set-point law; nothing was run. Known: hold, simplified_sheave"),
        (("hold", "--controller", "a.py:make"), "LAW and --controller stand alone"),
        (("--controller", "a.py"), "--controller a.py: is no FILE.py:NAME; nothing was run. Give FILE.py:NAME of"),
        (("--controller", "none.py:make"), "there is no file none.py; nothing was run"),
        (("--command", "python 'my"), "No closing quotation; nothing was run. Quote it as in a shell"),
        (("--command", " "), "--command is empty; nothing was run"),
        (("--command", "python my.py", "--name", "hold"), "--name 'hold': is a law of the product"),
        (("--command", "python my.py", "--name", "a,b"), "--name 'a,b': is a law of the product, empty"),
        (("--name", "a"), "--name is that of --controller or --command; nothing was run"),
        (("--only", "pond/*/*"), "--only pond/*/*: fits no cell; nothing was run. cable-sim ahc --definition lists"),
        (("--quick", "--only", "*"), "--quick stands alone"),
        (("--merge", "a.json"), "--board is the leaderboard of --merge, --check or --table, and they need it"),
        (("--board", "a.csv"), "--board is the leaderboard of --merge, --check or --table"),
        (("--replace",), "--replace belongs to --merge"),
        (("--table", "--check", "--board", "a.csv"), "--check and --table stand alone"),
        (("--page", "a.md"), "--page belongs to --table"),
        (("hold", "--definition", "--quick"), "--definition runs nothing; nothing was done. Leave LAW, --quick out"),
        (("--check", "--board", "none.csv"), "none.csv: has no rows to check; nothing was run"),
        (("--processes", "0"), "0 is outside [1, 64]"),
    ],
)
def test_what_cannot_be_run_is_said_in_one_line(arguments, text):
    done = call(*arguments)
    assert done.exit_code == 2 and text in " ".join(done.output.split()), done.output
