"""The benchmark command: table, JSON and plots of a scene, and what a plot joins."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from cable_sim_ros import cli
from cable_sim_ros.lab import features, sheave
from cable_sim_ros.lab.bench import Row, front, series


def test_a_scene_gives_table_json_and_plot(tmp_path):
    pytest.importorskip("matplotlib")
    done = CliRunner().invoke(cli.main, ["bench", "P3", "P4", "--repeats", "1", "--out", str(tmp_path), "--json"])
    assert done.exit_code == 0, done.output
    rows = json.loads((tmp_path / "bench.json").read_text())["rows"]
    table = (tmp_path / "bench.md").read_text().splitlines()
    assert len(table) == 2 + len(rows)
    own = [r for r in rows if r["code"] == "cable_sim_ros"]
    assert {r["scene"] for r in own} == {"P3", "P4"} and all(r["cpu_s_per_sim_s"] > 0.0 for r in own)
    for scene in ("p3", "p4"):
        assert (tmp_path / f"bench_{scene}.png").read_bytes().startswith(b"\x89PNG")
    pulled = [r for r in own if r["scene"] == "P4"]
    # what is wanted of P4: 0.5 % and 1 %
    assert min(r["error_tension"] for r in pulled) < 1e-3
    assert pulled[0]["error_tension"] < 5e-3 and pulled[0]["error_position"] < 1e-2
    assert max(r["error_position"] for r in own if r["scene"] == "P3") < 5e-3


@given(st.lists(st.tuples(st.floats(1e-6, 1.0), st.floats(1e-9, 1.0)), min_size=1, max_size=20))
def test_the_line_joins_what_nothing_cheaper_undercuts(points):
    points = sorted(points)
    line = front(points)
    assert line[0] == points[0] and min(p[1] for p in points) == line[-1][1]
    assert all(a[0] <= b[0] and a[1] > b[1] for a, b in zip(line, line[1:], strict=False))
    assert all(any(c <= p[0] and e <= p[1] for c, e in line) for p in points)


def test_the_set_point_algorithms_of_the_whole_tow_are_told_apart():
    row = Row("P7", "cable_sim_ros", "hold, 1-2-3, 10 ms", 6, 0.01, 0.0, 0.0, 1.0, 1.0, 1.0)
    assert series(row) == "cable_sim_ros, hold"
    assert series(row._replace(scene="P5")) == "cable_sim_ros"


def test_the_cost_of_each_feature_is_a_command(monkeypatch, tmp_path):
    monkeypatch.setattr(features, "STEPS", 2)
    done = CliRunner().invoke(cli.main, ["bench", "--features", "--repeats", "1", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    rows = json.loads((tmp_path / "features.json").read_text())
    assert [row["feature"] for row in rows] == list(features.FEATURES)
    assert all(row[k] > 0.0 for row in rows for k in ("absent_us", "off_us", "on_us"))
    assert done.stdout == (tmp_path / "features.md").read_text() and len(done.stdout.splitlines()) == 2 + len(rows)


def test_the_mesh_at_the_sheave_is_a_command(monkeypatch):
    monkeypatch.setattr(sheave, "RATIOS", (6.0, 1.0, 0.15))
    monkeypatch.setattr(sheave, "PHASES", (0.0,))
    monkeypatch.setattr(sheave, "LIMITS", sheave.LIMITS[:1])
    done = CliRunner().invoke(cli.main, ["bench", "--sheave-mesh", "--json"])
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert found["rigid_cylinder"]["lost_deg"] == pytest.approx(4.71, abs=0.01)
    assert len(found["sweeps"]) == 4 and len(found["softness"]) == 2
    text = CliRunner().invoke(cli.main, ["bench", "--sheave-mesh"]).stdout
    assert "| resultant | 6 | 6 | 6 | 6 |" in text and "largest_line_load" in text
