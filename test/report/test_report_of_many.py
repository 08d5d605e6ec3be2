"""Reports of many runs, of experiments, and what a report says of scores and of imported motion."""

import json
import re

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.summary import Run
from cable_sim_ros.tools.ahc.figures import NAMES
from cable_sim_ros.tools.ahc.report import write_report as write_ahc
from cable_sim_ros.tools.report.sweep_page import MOST_RUNS, Many, write_sweep_page
from cable_sim_ros.tools.report.write import write_report
from cable_sim_ros.tools.sweeps.dataset import write_report as write_sweep
from cable_sim_ros.tools.sweeps.sweep import sweep
from cable_sim_ros.tools.sweeps.sweep_file import checked
from verification import experiments
from verification.experiments import Comparison, Result

pytest.importorskip("matplotlib")
pytest.importorskip("jinja2")
EVIL = '<img src=x onerror="alert(1)"> & $x'
PNG = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108000000003a7e9b550000000a49444154789c6360000000020001"
    "48afa4710000000049454e44ae426082"
)


def rows_of(text):
    """Cells of every row of the tables, with the class of the row."""
    found = []
    for attributes, row in re.findall(r"<tr([^>]*)>(.*?)</tr>", text, re.DOTALL):
        cells = [re.sub(r"<[^>]+>", "", cell) for cell in re.findall(r"<t[hd][^>]*>(.*?)</t[hd]>", row)]
        found.append(("bad" in attributes, cells))
    return found


def alone(text):
    """Nothing is loaded from anywhere, and nothing of a user is markup."""
    bare = re.sub(r"data:image/png;base64,[A-Za-z0-9+/=]*", "", text)
    assert not re.search(r"https?:|//|@import|<link|<script|<iframe|url\((?!#)", bare)
    return not re.search(r"<img(?! src=\"\" alt=)", bare)


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    asked = {"sweep": EVIL, "scene": "flume", "duration": 0.3, "grid": {"winch.scope": [0.9, 1.0, 99999.0]}}
    return sweep(checked(asked, "here"), tmp_path_factory.mktemp("sweep"), workers=1)


def test_a_sweep_says_what_was_varied_what_came_and_what_failed(swept, tmp_path):
    text = write_sweep(swept, tmp_path / "a.html", ["sweep", "/data/x.yaml", "--report", "a.html"]).read_text("utf-8")
    assert alone(text) and "&lt;img src=x" in text
    assert "cable-sim sweep x.yaml" in text.replace("<wbr>", "")
    assert "failed</span>: 1 of 3 runs failed and have no figures." in text
    assert ["scene", "flume"] in [cells for _, cells in rows_of(text)] and "0.3 s" in text
    rows = rows_of(text)
    runs = [(bad, cells) for bad, cells in rows if cells[-1] in ("ok", "doubtful", "failed")]
    assert [bad for bad, _ in runs] == [row["verdict"] == "failed" for row in swept.rows] == [False, False, True]
    assert [cells[1] for _, cells in runs] == ["0.9", "1", "99999"]
    assert "winch.scope [m]" in text.replace("<wbr>", "")
    assert any(bad and "is outside [0, 20000] m" in cells[0] and cells[1] == "1" for bad, cells in rows)
    depths = [row["body_depth_m"] for row in swept.rows[:2]]
    (figure,) = [cells for _, cells in rows if cells[-1] == "body_depth_m"]
    assert figure[1:4] == [f"{value:.4g}" for value in (min(depths), sum(depths) / 2.0, max(depths))]
    again = write_sweep(swept, tmp_path / "b.html", ["sweep", "/data/x.yaml"]).read_text("utf-8")
    assert again == text and text.count("<svg") == 1


def test_the_command_writes_it(tmp_path, swept, monkeypatch):
    monkeypatch.setattr("cable_sim_ros.tools.sweeps.sweep.sweep", lambda *words, **more: swept)
    monkeypatch.setattr("cable_sim_ros.tools.sweeps.dataset.write", lambda *words: [])
    (tmp_path / "s.yaml").write_text(json.dumps({"sweep": "x", "scene": "flume", "duration": 0.3}))
    (tmp_path / "out").mkdir()
    asked = ["sweep", str(tmp_path / "s.yaml"), "--out", str(tmp_path / "out"), "--report", str(tmp_path / "a.html")]
    result = CliRunner().invoke(commands.main, asked)
    assert result.exit_code == 1 and "report:" in result.output, result.output
    assert "1 of 3 runs failed" in (tmp_path / "a.html").read_text("utf-8")
    refused = CliRunner().invoke(commands.main, [*asked[:-1], str(tmp_path / "a.txt")])
    assert refused.exit_code == 2 and "is no HTML file by its name; nothing was run" in refused.output


def many(count, **row):
    figures = {"verdict": "ok", "error": "", "reasons": "", **row}
    varied = [{"ship.tow_speed": 1.0 + k, "note": "a"} for k in range(count)]
    return Many("m", varied, [dict(figures) for _ in range(count)], {"tension_max_n": "N"}, {"tension_max_n": "x"})


def test_runs_without_any_figure_and_more_runs_than_fit(tmp_path):
    text = write_sweep_page(many(3, verdict="failed", error="e"), tmp_path / "a.html").read_text("utf-8")
    assert "3 of 3 runs failed" in text and "<svg" not in text
    text = write_sweep_page(many(2, tension_max_n=None), tmp_path / "b.html").read_text("utf-8")
    assert "2 runs came to the end and no check objects" in text and "No check objected" in text
    text = write_sweep_page(many(MOST_RUNS + 7, tension_max_n=2.0), tmp_path / "c.html").read_text("utf-8")
    assert "7 more runs stand in the table" in text and len(rows_of(text)) < MOST_RUNS + 20
    text = write_sweep_page(many(2, verdict="doubtful", reasons="SLACK", tension_max_n=1.0), tmp_path / "d.html")
    assert "doubtful</span>: some figures of 2 of 2 runs" in text.read_text("utf-8")


def test_compensators_say_what_was_run_and_what_failed(tmp_path):
    figures = {name: 1.0 for name in NAMES}
    row = {"scene": "full_scale", "motion": EVIL, "state": "ok", "reason": "", "figures": figures, "twin": figures}
    rows = [row | {"entrant": name, "class": one} for name in ("hold", "ours") for one in ("ideal", "dead_200")]
    rows.append(row | {"entrant": "ours", "class": "limited", "state": "failed", "reason": "gave up", "figures": None})
    done = {"benchmark": "ahc-1", "product": "0.2.0", "commit": "", "rows": rows}
    text = write_ahc(done, tmp_path / "a.html", ["ahc", "--quick"]).read_text("utf-8")
    assert alone(text) and "A heave compensator turns the winch" in text and "cable-sim ahc --quick" in text
    assert "doubtful</span>: 5 runs of 2 entrants on ahc-1: 1 with a verdict that is not ok" in text
    assert any(cells[-1] == "gave up" for _, cells in rows_of(text)) and text.count("<svg") == 4
    held = done | {"rows": rows[:2]}
    assert "<svg" not in write_ahc(held, tmp_path / "b.html").read_text("utf-8")


def experiment(folder_seen):
    rows = [
        Comparison("near", "N", 10.05, 10.0, 0.1, "who"),
        Comparison(EVIL, "deg", 12.0, 10.0, 0.1, "who", "because"),
        Comparison("no number", "m", float("nan"), 1.0, 0.1, "who"),
        Comparison("unprinted", "m", 1.0, None, None, "who"),
    ]

    def plot(folder):
        folder_seen.append(folder)
        (folder / "x.png").write_bytes(PNG)
        return folder / "x.png"

    return Result("pulley", rows, [{"choice": "other", "tension": 1.5}], plot)


def test_experiments_have_a_verdict_each_and_misses_are_red(tmp_path, monkeypatch):
    seen = []
    monkeypatch.setattr(experiments, "run", lambda name, *_: experiment(seen))
    made = tmp_path / "v.html"
    result = CliRunner().invoke(commands.main, ["validate", "pulley", "--json", "--report", str(made)])
    assert result.exit_code == 0 and json.loads(result.stdout)[0]["experiment"] == "pulley", result.output
    text = made.read_text("utf-8")
    assert alone(text) and text.count("data:image/png;base64,") == 1 and not seen[0].exists()
    assert "failed</span>: 1 experiment: 2 of 3 figures miss what is allowed" in text
    table = {cells[0]: (bad, cells) for bad, cells in rows_of(text) if len(cells) == 9}
    assert table["near"][0] is False and table["near"][1][6] == "within" and table["near"][1][4] == "0.05"
    assert table["no number"][0] and table["unprinted"] == (False, table["unprinted"][1])
    assert table["unprinted"][1][2] == "-" and table["unprinted"][1][6] == "-"
    (evil,) = [cells for bad, cells in rows_of(text) if bad and "onerror" in cells[0]]
    assert evil[6] == "MISSED" and evil[8] == "because"
    kept = experiments.verdict_of(Comparison("at the limit", "N", 1.5, 1.0, 0.5, ""))
    assert kept == experiments.KEPT


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    """Shorter than any start-up or spectrum."""
    out = tmp_path_factory.mktemp("short") / "run"
    return offline.run(load_scene("flume"), heave=(0.02, 2.0), duration=0.3, out=out)


@pytest.fixture(scope="module")
def tow(tmp_path_factory):
    out = tmp_path_factory.mktemp("tow") / "run"
    return offline.run(load_scene("flume"), heave=(0.02, 2.0), duration=4.0, out=out)


def test_a_short_run_and_one_whose_channels_are_not_there(short, tmp_path):
    text = write_report(short, tmp_path / "a.html").read_text("utf-8")
    assert "Time series" in text and alone(text)
    frames = np.recarray(len(short.frames), TICK_OUTPUT)
    frames[:] = short.frames
    for name in ("energy_residual", "payout", "layback", "scope"):
        frames[name] = np.nan
    bare = Run(frames, {"scene": "x", "skip_s": 0.0}, scene=None, verdict=short.verdict)
    text = write_report(bare, tmp_path / "b.html").read_text("utf-8")
    assert "Time series" in text and "Energy balance" not in text and alone(text)


def test_limits_of_a_replay_decide_the_headline(short, tow, tmp_path):
    limits, made = tmp_path / "limits.yaml", tmp_path / "r.html"
    limits.write_text("limits: x\nquantities:\n  tension: {rms: 1.0}\n")
    result = CliRunner().invoke(
        commands.main, ["replay", str(tow.bag), "--limits", str(limits), "--report", str(made), "--json"]
    )
    judged = json.loads(result.stdout)["comparison"]["judged"]
    text = made.read_text("utf-8")
    rows = [(bad, cells) for bad, cells in rows_of(text) if cells[0] in ("kept", "VIOLATED")]
    assert [bad for bad, _ in rows] == [not one["passed"] for one in judged] and rows
    assert result.exit_code == (0 if judged[0]["passed"] else 1)
    said = "1 limit on the scores is not kept"
    assert (said in text) == (not judged[0]["passed"])
    other = Run(short.frames, short.metrics | {"largest_difference": None}, scene=short.scene, verdict=short.verdict)
    missed = {"quantity": "tension", "limit": "rms", "value": 9.0, "passed": False, "text": "rms 9 N is over 1 N"}
    score = {"quantity": "tension", "unit": "N", "scored": True, "notes": ["<b>"], "intervals": {"bias": [1.0, 3.0]}}
    score |= {"figures": {"bias": 2.0, "gain": None, "samples": 12}}
    other.metrics["comparison"] = {
        "a": "measured", "b": "ours", "judged": [missed], "scores": [score], "only_a": ["depth"], "only_b": [],
    }  # fmt: skip
    text = write_report(other, tmp_path / "s.html").read_text("utf-8")
    assert f"failed</span>: The replay came to its end, but {said}: rms 9 N is over 1 N." in text
    assert ["tension", "N", "2 [1, 3]", "-", "-", "-", "-", "-", "12"] in [cells for _, cells in rows_of(text)]
    assert "tension: &lt;b&gt;" in text and "Only in what was measured, not compared: depth" in text


def test_what_an_import_assumed_is_said(short, tmp_path):
    about = {"files": ["a.csv"], "records": 12, "notes": [f"imported: assumed {k} {EVIL}" for k in range(25)]}
    result = Run(short.frames, short.metrics | {"imported": about}, scene=short.scene, verdict=short.verdict)
    text = write_report(result, tmp_path / "i.html").read_text("utf-8")
    assert "The ship motion is imported from logs (12 records read, - lost)" in text
    assert "imported: assumed 0 &lt;img" in text and "imported: assumed 20" not in text and "5 more:" in text
    assert ["records", "12"] in [cells for _, cells in rows_of(text)] and alone(text)
