"""Every step of docs/tutorial.md runs with the figures it states; tables of flags and set-point laws are complete."""

import json
import re
import shlex
import subprocess
import warnings
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics.heave_compensation import SetpointLaw
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.layout import layout_of

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
TUTORIAL = (DOCS / "tutorial.md").read_text("utf-8")
HEAVE_MARK = "<!-- needs --heave -->\n"
BLOCKS = re.findall(rf"({re.escape(HEAVE_MARK)})?```(sh|python)\n(.*?)```", TUTORIAL, re.S)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Folder to work in that has `config/` as the project has."""
    (tmp_path / "config").symlink_to(ROOT / "config")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(warnings, "showwarning", warnings.showwarning)  # main() replaces it
    return tmp_path


def command(words):
    """Output of a `cable-sim` command."""
    result = CliRunner().invoke(commands.main, words, catch_exceptions=False)
    assert result.exit_code == 0, f"{words}\n{result.output}\n{result.stderr}"
    return result.output


def shell(text):
    """Run a block line by line: ours in this process, others by the shell."""
    for line in text.splitlines():
        words = shlex.split(line)
        if words[0] == "cable-sim":
            command(words[1:])
        else:
            subprocess.run(["bash", "-euc", line], check=True)


def test_every_step_runs_in_order(folder, capsys):
    steps = [(language, text) for marked, language, text in BLOCKS if not marked]
    assert [language for language, _ in steps].count("sh") >= 6 and steps[-1][0] == "python"
    for language, text in steps:
        shell(text) if language == "sh" else exec(compile(text, "tutorial.md", "exec"), {})
    printed = capsys.readouterr().out
    assert re.search(r"^tension \d+ N, std \d+\.\d N$", printed, re.M)
    first, hold, ours = (
        json.loads((folder / "runs" / run / "summary.json").read_text("utf-8"))
        for run in ("first", "hold", "compensated")
    )
    assert (folder / "runs" / "first" / "run.png").stat().st_size > 10_000
    assert (
        f"swings by {first['tension_std_n']:.0f} N (standard deviation) about {first['tension_mean_n']:.0f} N"
        in words()
    )
    assert f"from {hold['tension_std_n']:.0f} N to {ours['tension_std_n']:.0f} N" in words()
    assert f"from {hold['body_depth_std_m']:.2f} m to {ours['body_depth_std_m']:.2f} m" in words()
    assert first["flags"] == hold["flags"] == ours["flags"] == {"MOTION_BLENDING": 99}


def test_the_step_with_heave_runs(folder):
    (text,) = [text for marked, _, text in BLOCKS if marked]
    shell(text)


def words():
    """The tutorial in one line."""
    return " ".join(TUTORIAL.split())


def test_only_marked_blocks_use_heave():
    assert all(bool(marked) == ("--heave" in text) for marked, _, text in BLOCKS)


def test_lengths_in_text_and_sketch_are_those_of_the_scene():
    scene, sketch = load_scene("side_scan"), (DOCS / "tow.svg").read_text("utf-8")
    route, scope, sections = layout_of(scene).route, scene.winch.scope, scene.cable.sections
    assert f"| **{scope:g} m** |" in TUTORIAL and f"| {route.span:.2f} m |" in TUTORIAL
    assert f"{route.sheave:.3f} m x {route.tilt:.3f} | {route.inboard:.2f} m |" in TUTORIAL
    assert f"{np.degrees(route.tilt):.1f} deg or {route.tilt:.3f} rad" in TUTORIAL
    assert f"{route.total:.2f} - {scope:.2f} - {route.inboard:.2f} | {route.wound:.2f} m |" in TUTORIAL
    assert f"{route.wound:.2f} m on the drum" in sketch and f"{route.span:.2f} m straight" in sketch
    assert f"scope {scope:g} m" in sketch
    for name, section in sections.items():
        assert f"section {name} {section.length:g} m" in sketch


def test_static_figures_in_the_text_are_the_computed_ones():
    metrics = offline.run("side_scan").metrics
    assert (
        f"depth {metrics['body_depth_m']:.1f} m, tension {metrics['tension_mean_n']:.0f} N, "
        f"departure angle {metrics['departure_angle_deg']:.1f} deg" in words()
    )


def rows(name):
    """Rows of the first table of a page in docs/, as lists of cells."""
    table = re.search(r"(?:^\|.*\n)+", (DOCS / name).read_text("utf-8"), re.M).group()
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in table.splitlines()[2:]]


def test_every_flag_is_in_the_table_with_its_bit():
    table = rows("flags.md")
    assert [(row[0], int(row[1])) for row in table] == [(f"`{flag.name}`", flag.value) for flag in Flag if flag]
    assert all(len(row) == 6 and all(row) for row in table)


def test_every_law_is_in_the_table():
    table = rows("setpoints.md")
    assert [row[0] for row in table] == [f"`{law.value}`" for law in SetpointLaw]
    assert all(len(row) == 5 and all(row) for row in table)
