"""What opens the AHC benchmark to others: score, entries, their processes, the track for prediction, resuming."""

import json
from pathlib import Path

import numpy as np
import pytest
from ahc_rows import call, result_of, row_of

from cable_sim_ros import WinchCommand
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.tools.ahc import benchmark, board, definition, remote, score, simulate
from cable_sim_ros.tools.ahc.definition import MRU, VERSION, Cell
from cable_sim_ros.tools.ahc.entrants import AhcError, Entrant, entries, laws
from cable_sim_ros.tools.ahc.figures import NAMES

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "docs" / "examples" / "ahc"
HEARD = Cell("lowered", "nbp1406", "heard_200")
TWIN = dict.fromkeys(NAMES, 1.0) | {"tension_mean_n": 100.0, "tension_std_n": 10.0, "snaps": 0, "energy_j": 0.0}


def row(entrant="mine", cell=HEARD, state="ok", **changed):
    figures = None if state in ("failed", "skipped") else TWIN | {"tension_min_n": 80.0} | changed
    return row_of(entrant, cell, figures, TWIN if figures else None, state)


@pytest.mark.parametrize(
    "changed, wanted",
    [
        ({}, (0.0, 0.0, 1.0, 0.8)),  # the held winch itself
        ({"tension_std_n": 2.5, "depth_rms_m": 0.1}, (0.75, 0.9, 1.0, 0.8)),
        ({"tension_std_n": 90.0, "depth_rms_m": 3.0, "tension_min_n": -5.0}, (0.0, 0.0, 1.0, 0.0)),  # capped
        ({"energy_j": 500.0 * np.pi, "tension_min_n": 300.0}, (0.0, 0.0, 0.75, 1.0)),
    ],
)
def test_points_of_a_run(changed, wanted):
    assert tuple(score.points(row(**changed)).values()) == pytest.approx(wanted)


def test_a_hauling_wave_of_10_s_at_any_scale_has_no_points_for_energy():
    for scale in (1.0, 0.02):
        rms, seconds = 0.4 * scale, 100.0 * scale**0.5
        energy = 50.0 * seconds * 2.0 * np.pi / (10.0 * scale**0.5) * rms
        held = TWIN | {"tension_mean_n": 50.0}
        assert score.METRICS[2].of({"energy_j": energy, "input_rms_m": rms}, held) == pytest.approx(0.0, abs=1e-12)


def test_a_snap_a_crash_and_what_was_not_run_count_as_the_worst():
    rows = [row(), row(snaps=1), row(state="failed"), row(state="skipped")]
    found = score.score_of(rows)["entrants"]["mine"]
    assert found["score"] == pytest.approx(100.0 * (1.0 + 0.8) / 4.0 / 4.0, abs=0.01)
    assert (found["cells"], found["disqualified"], found["not_run"]) == (4, 2, 1)


def test_tracks_have_cells_and_definitions_of_their_own():
    heard = definition.cells(version=MRU)
    assert not set(heard) & set(definition.cells()) and definition.digest(MRU) != definition.digest()
    assert {definition.version_of(cell) for cell in heard} == {MRU}
    seeds = [definition.seed(one.name) for one in (*definition.MOTIONS, *definition.SECOND)]
    assert len({seed for seed in seeds if seed}) == 4
    assert {definition.condition(cell.condition).values["drive.dead_time"] for cell in heard} == {0.1, 0.2, 0.4}


def test_a_leaderboard_has_both_tracks_of_an_entrant():
    truth = [row(cell=cell) for cell in definition.cells()]
    heard = [row(cell=cell) for cell in definition.cells(version=MRU)]
    both = board.merge(board.merge([], result_of(truth), "a"), result_of(heard, MRU), "b")
    assert len(both) == len(truth) + len(heard)
    assert len(board.merge(both, result_of(heard, MRU), "b", replace=True)) == len(both)
    with pytest.raises(AhcError, match="b: mine: stands on the leaderboard"):
        board.merge(both, result_of(heard, MRU), "b")
    with pytest.raises(AhcError, match=f"mine lacks {len(truth)} of"):
        board.merge([], result_of(heard), "b")


def test_a_scene_held_out_is_told_by_its_hash(tmp_path, monkeypatch):
    path = tmp_path / "scene.yaml"
    path.write_text("salt: abc\nseed: 7\nscene: {a: 1.0, b: [1, 2]}\n")
    assert call("--reveal", path).exit_code == 1
    text = "scene: {b: [1, 2], a: 1.0}  # another layout\nseed: 7\nsalt: abc\n"
    monkeypatch.setattr(definition, "HELD_OUT", definition.sealed(text))
    done = call("--reveal", path)
    assert done.exit_code == 0 and "is the scene that ahc-1-mru holds out" in done.output
    assert "cannot be read" in call("--reveal", tmp_path / "none.yaml").output


@pytest.fixture
def asked(request):
    """A controller of controllers.py in its process, made for the truth or the rig, asked once."""

    def ask(name, heard):
        line = remote.Remote(f"{HERE / 'controllers.py'}:{name}")
        request.addfinalizer(line.close)
        seen = np.zeros(1, TICK_OUTPUT).view(np.recarray)[0]
        seen["payout"], seen["mru_heave_rate"], seen["tension"] = 50.0, 0.25, 3000.0
        scene = simulate.scene_of(HEARD, "hold")
        return line.begin(scene, 0.05, heard)(seen)

    return ask


def test_a_controller_hears_the_mru_and_commands(asked):
    assert asked("echoes", heard=True) == [WinchCommand(rate=0.25), WinchCommand(payout=50.0, rate=0.05)]
    assert asked("looks_for_the_simulator", heard=True) == [WinchCommand(rate=0.0)]


@pytest.mark.parametrize(
    "name, heard, text",
    [
        ("reads_the_truth", True, "tension is not heard on this track; an MRU gives surge, sway, heave, surge_rate"),
        ("writes_the_row", False, "read-only"),
        ("dies", False, r"its process ended without an answer \(code 3\)"),
        ("returns_words", False, "returned 'out', a str and no command"),
    ],
)
def test_what_a_controller_must_not_do_is_an_error_of_its_call(asked, name, heard, text):
    with pytest.raises(Exception, match=text):
        asked(name, heard)


def test_a_controller_that_never_answers_is_given_up(asked, monkeypatch):
    monkeypatch.setattr(remote, "ANSWER", 0.3)  # whatever takes longer, on any machine: it never ends
    with pytest.raises(Exception, match="gave no answer within 0.3 s"):
        asked("never_answers", heard=False)


def test_a_controller_that_dies_fails_its_cell_and_the_rest_goes_on():
    dead = Entrant("dead", "callable", f"{HERE / 'controllers.py'}:dies")
    feed = next(one for one in entries(EXAMPLES) if one.name == "feed_forward")
    done = benchmark.run([dead, feed], [HEARD], simulate.Span(16.0, 8.0))
    first, second = done["rows"]
    assert first["state"] == "failed" and "its process ended without an answer (code 3)" in first["reason"]
    assert second["state"] == "ok" and second["figures"]["decoupling"] > 0.6
    assert second["figures"]["tension_std_n"] < 0.5 * second["twin"]["tension_std_n"]
    assert done["benchmark"] == MRU and done["score"]["entrants"]["dead"]["disqualified"] == 1
    program = simulate.run_cell(Entrant("p", "program", "python3 x.py"), HEARD, simulate.Span(16.0, 8.0))
    assert program.state == "skipped" and "a program of rclpy hears every topic" in program.reason


@pytest.mark.parametrize(
    "text, why",
    [
        (None, "cannot be read (No such file or directory)"),
        ("[1", "nothing was run. Give a line such as {name: ours, file: ours.py"),
        ("{name: ours, file: a.py, author: A}", "source is missing, or no key of it"),
        ("{name: ours, file: a.py, author: A, source: B, speed: 3}", "speed is missing, or no key of it"),
        ("{name: ours, file: a.py, author: A, source: B, tracks: [sea]}", "tracks = ['sea'], of truth and mru"),
        ("{name: hold, file: a.py, author: A, source: B}", "'hold': is a law of the product"),
        ("{name: ours, file: b.py, author: A, source: B}", "there is no file"),
        ("[]", "has no entrant, or two of one name"),
    ],
)
def test_an_entry_that_is_none_is_refused_in_one_line(tmp_path, text, why):
    (tmp_path / "a.py").write_text("def make(scene, period):\n    return lambda row: None\n")
    if text:
        (tmp_path / "entry.yaml").write_text(text)
    done = call("--check", tmp_path)
    assert done.exit_code == 2 and why in " ".join(done.output.split()), done.output


def test_an_entry_goes_on_where_it_was_stopped(tmp_path, monkeypatch):
    (tmp_path / "a.py").write_text("def make(scene, period):\n    return lambda row: None\n")
    (tmp_path / "entry.yaml").write_text("{name: ours, file: a.py, author: A, source: B, tracks: [mru]}")
    ran = []

    def stopped(entrant, cell, span):
        if len(ran) == 2:
            raise KeyboardInterrupt
        ran.append(cell)
        return row(entrant.name, cell)

    monkeypatch.setattr(benchmark, "row_of", stopped)
    options = ("--check", tmp_path, "--processes", "1", "--only", "lowered/nbp1406/heard_*", "--json")
    first = call(*options)
    assert first.exit_code != 0 and "ahc-1-mru: 3 runs of 120 s; about 1 min" in first.output and len(ran) == 2
    with (tmp_path / "ahc_rows.jsonl").open("a") as file:
        file.write('\n["cut o')
    ran.clear()
    again = call(*options)
    assert again.exit_code == 0 and [str(cell) for cell in ran] == ["lowered/nbp1406/heard_400"]
    assert "1 runs of 120 s, 2 more are there" in again.output
    found = json.loads((tmp_path / "ahc-mru.json").read_text())
    assert len(found["rows"]) == 3 and found["score"]["entrants"]["ours"]["cells"] == 3 and not found["complete"]
    assert [one.split(":")[0] for one in found["score"]["definition"]][:4] == ["tension", "place", "energy", "slack"]
    assert call(*options).exit_code == 0 and len(ran) == 1  # the row after the one that was cut is there


def test_the_examples_are_entries_for_both_tracks():
    found = {one.name: one.tracks for one in entries(EXAMPLES)}
    assert len(found) == 6 and found.pop("pid_tension") == (VERSION,)
    assert set(found.values()) == {(VERSION, MRU)} and {one.rank for one in laws()} == {"built-in"}
