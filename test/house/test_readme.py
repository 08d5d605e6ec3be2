"""What the README says is so: commands, Python, tables, files."""

import re
import shlex
from pathlib import Path

import click
import pytest

from cable_sim_ros import cli
from cable_sim_ros.io.channels import CHANNELS
from cable_sim_ros.io.resources import shipped_bags, shipped_scenes
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.summary import SUMMARY, summary_markdown

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")


def commands():
    """Every `cable-sim ...` in the README as words."""
    return sorted({text for text in re.findall(r"`(cable-sim [^`]*)`", README)})


def test_there_are_commands_to_check():
    assert len(commands()) >= 8


@pytest.mark.parametrize("text", commands())
def test_commands_exist_with_their_options(text):
    _, name, *arguments = shlex.split(text)
    command = cli.main.commands[name]
    parser = command.make_parser(click.Context(command))
    parser.parse_args(arguments)  # raises for an unknown option; argument types are the command's own matter


def test_every_command_is_in_the_readme():
    named = {text.split()[1] for text in commands()}
    assert named == set(cli.main.commands)


def test_make_targets_exist():
    for target in set(re.findall(r"make (\w+)", README)):
        assert re.search(rf"^{target}:", MAKEFILE, re.M), target


@pytest.mark.filterwarnings("ignore::cable_sim_ros.io.load.SceneWarning")
def test_the_python_of_the_readme_runs(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.S)
    exec(compile(code, "README.md", "exec"), {})
    tension = float(capsys.readouterr().out.split()[0])
    assert tension > 100.0


def test_tables_of_json_names_are_the_declared_ones():
    assert summary_markdown() in README and offline.figures_markdown() in README


@pytest.mark.filterwarnings("ignore::cable_sim_ros.io.load.SceneWarning")
def test_no_json_name_is_undeclared():
    declared = {name for name, *_ in (*SUMMARY, *offline.FIGURES)}
    assert set(offline.run("full_scale", duration=0.1).figures) <= declared
    assert len(declared) == len(SUMMARY) + len(offline.FIGURES)


def test_every_channel_has_its_row():
    for channel in CHANNELS:
        kind = channel.msgtype.replace("/msg/", "/")
        assert re.search(rf"^\| out \| `{channel.topic}` \| {kind} \|", README, re.M), channel.topic


def test_shipped_names_are_right():
    for name in ("nbp1406", "lmg1903"):
        assert name in shipped_bags() and f"`{name}`" in README
    assert "full_scale" in shipped_scenes()


def test_files_named_in_the_readme_exist():
    for path in re.findall(r"\]\(((?!http)[^)]+)\)", README):
        assert (ROOT / path.partition("#")[0]).exists(), path
    for path in re.findall(r"`((?:physics|sim|io|lab|ros)/\w+\.py)`", README):
        assert (ROOT / "cable_sim_ros" / path).exists(), path
    for name in ("DragLaw", "LOADING", "surface_row", "SetpointLaw", "compensation", "CHANNELS"):
        assert f"`{name}`" in README
        assert any(
            re.search(rf"^(class |def )?{name}\b", path.read_text("utf-8"), re.M)
            for path in (ROOT / "cable_sim_ros").rglob("*.py")
        ), name
