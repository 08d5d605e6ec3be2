"""`sweep`, `envelope`, `sensitivity`, `table` as typed: what they print, what they leave, how they end."""

import json

import pytest
from click.testing import CliRunner

from cable_sim_ros.cli.commands import main

SWEEP = """
sweep: a flume
scene: flume
duration: 0.3
settings: {water.turbulence.deviation: [0.01, 0.01, 0.01]}
seeds: 2
grid: {winch.scope: [0.9, 1.0]}
"""
RANGES = """
sweep: what decides
scene: flume
duration: 0.3
samples:
  method: sobol
  count: 2
  ranges:
    towbody.mass: {low: 0.001, high: 0.0012}
    water.density: {low: 990.0, high: 1030.0}
figures: [tension_mean_n, body_depth_m]
"""


def command(*arguments, code=0):
    result = CliRunner().invoke(main, list(map(str, arguments)))
    assert result.exit_code == code, result.output
    return result


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    folder = tmp_path_factory.mktemp("commands")
    (folder / "a.yaml").write_text(SWEEP)
    told = json.loads(command("sweep", folder / "a.yaml", "--out", folder, "--workers", 1, "--json", code=4).stdout)
    return folder, told


def test_a_sweep_says_what_it_did(swept):
    folder, told = swept
    assert told["cases"] == told["computed"] == 4
    assert told["verdicts"] == {"doubtful": 4} and told["exit_code"] == 4, "too short to say anything"
    assert json.loads((folder / "sweep.json").read_text()) == told
    assert len((folder / "sweep.csv").read_text().splitlines()) >= 5
    assert command("sweep", folder / "a.yaml", "--out", folder, "--dry-run").stdout == "4 cases, 0 of them new\n"


def test_an_envelope_of_rows_that_are_there_simulates_nothing(swept):
    folder, _ = swept
    report = folder / "a.html"
    given = "envelope", folder / "a.yaml", "--out", folder, "--workers", 1
    told = json.loads(command(*given, "--report", report, "--json", code=4).stdout)
    assert told["verdicts"] == {"doubtful": 4} and sum(told["reasons"].values()) == 4
    shown = command(*given, code=4)
    assert "2 doubtful" in shown.stdout and f"doubtful 4 x: {next(iter(told['reasons']))}" in shown.stderr
    assert told["computed"] == 0 and [cell["varied"] for cell in told["cells"]] == [
        {"winch.scope": 0.9},
        {"winch.scope": 1.0},
    ]
    for cell in told["cells"]:
        tension = cell["extremes"]["tension_max_n"]
        assert cell["runs"] == 2 and tension["low"] <= tension["mean"] <= tension["worst"] + 1e-12
    assert (folder / "envelope.png").stat().st_size > 5000
    text = report.read_text("utf-8")
    assert "envelope; 4 runs" in text and "What was found" in text and "most tension [N]" in text
    assert "http://" not in text.replace("http://www.w3.org", "")


def test_a_picture_of_many_values_says_which_are_left_out(tmp_path, monkeypatch):
    from cable_sim_ros.plots import canvas
    from cable_sim_ros.sweeps import envelope

    drawn, titles = canvas.canvas, []

    def titled(path, size, title, source):
        titles.append(title)
        return drawn(path, size, title, source)

    monkeypatch.setattr(canvas, "canvas", titled)
    depth = {"body_depth_min_m": envelope.Extreme(9.0, 9.0, 9.0, 9.0, 9.0)}
    values = [(s, h, v) for s in (50, 100) for h in (1.0, 2.0) for v in range(1, 9)]
    cells = [
        envelope.Cell({"winch.scope": s, "water.waves.height": h, "ship.tow_speed": v}, 1, 0, 0, depth, {})
        for s, h, v in values
    ]
    assert envelope.draw("tow", cells, tmp_path / "a.png").stat().st_size > 5000
    assert envelope.draw("tow", cells[:8], tmp_path / "b.png").stat().st_size > 5000
    assert titles == ["tow, the first 6 of 8 values of ship.tow_speed", "tow"]


def test_indices_of_a_tow_have_their_report(tmp_path):
    (tmp_path / "s.yaml").write_text(RANGES)
    result = command(
        "sensitivity", tmp_path / "s.yaml", "--out", tmp_path, "--workers", 1, "--report", tmp_path / "s.html", "--json"
    )
    told = json.loads(result.stdout)
    assert told["runs"] == 8 and {one["figure"] for one in told["indices"]} | set(told["constant"]) >= {
        "tension_mean_n",
        "body_depth_m",
    }
    assert "Share of the variance" in (tmp_path / "s.html").read_text("utf-8")


def test_a_table_has_a_row_for_each_scope_and_speed(tmp_path):
    result = command("table", "flume", "--scope", "0.9,1.0", "--speed", "0.2,0.4", "--out", tmp_path, "--workers", 1)
    rows = [line for line in (tmp_path / "table.csv").read_text().splitlines() if not line.startswith("#")]
    assert len(rows) == 5 and (tmp_path / "table.png").stat().st_size > 5000
    assert "0.9" in result.output


@pytest.mark.parametrize("name", ["sweep", "envelope", "sensitivity"])
def test_a_file_that_cannot_be_used_is_one_line(tmp_path, name):
    (tmp_path / "x.yaml").write_text(SWEEP.replace("scene: flume", "scene: flum"))
    result = command(name, tmp_path / "x.yaml", code=2)
    assert "flum" in result.stderr and "Traceback" not in result.stderr
    assert "nothing was" in result.stderr
