"""docs/jobs.md begins every job as it says: its commands are commands, its scripts exist, each job has its parts."""

import re
import shlex
from pathlib import Path

import click
import pytest

from cable_sim_ros.cli.commands import main
from cable_sim_ros.io.scenes.document import shipped_bags, shipped_scenes
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.io.scenes.winch_plan import WinchPlan
from cable_sim_ros.physics.heave_compensation import SetpointLaw
from cable_sim_ros.runs.settings import apply_to_scene, settings_of

pytestmark = pytest.mark.trust

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "jobs.md").read_text("utf-8")
TABLE, *SECTIONS = PAGE.split("\n## ")
LINES = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.S) for line in block.splitlines()]
NAMES = {*shipped_scenes(), *shipped_bags(), "none"}


@pytest.mark.parametrize("line", [line for line in LINES if line.startswith("cable-sim ")])
def test_its_commands_exist_with_their_options_scenes_and_keys(line):
    _, name, *arguments = shlex.split(line)
    command = main.get_command(None, name)
    parser = command.make_parser(click.Context(command, **command.context_settings))
    options, _, _ = parser.parse_args(arguments)  # raises for an unknown option
    given = [options.get(name) for name in ("scene", "bag", "motion", "a", "b")] + re.findall(r"-p scene:=(\w+)", line)
    named = [name for name in given if isinstance(name, str)]
    assert named and all(name in NAMES or name.startswith("my_") for name in named), named
    if "winch" in options:
        assert str(WinchPlan(options["winch"])) == options["winch"]
    if "setpoint" in options:
        assert options["setpoint"] in {law.value for law in SetpointLaw}
    if values := [arguments[k + 1] for k, word in enumerate(arguments) if word == "--set"]:
        apply_to_scene(load_scene(options["scene"]), settings_of(values))  # raises for an unknown key or a bad value


def test_there_are_commands_to_check():
    assert sum(line.startswith("cable-sim ") for line in LINES) >= 12


def test_files_of_other_commands_exist():
    others = [line for line in LINES if not line.startswith("cable-sim ")]
    files = [word for line in others for word in line.split() if re.match(r"(config|cable_sim_ros|docs|test)/", word)]
    assert len(files) >= 3 and all((ROOT / file).exists() for file in files)
    assert "class SetpointLaw" in (ROOT / files[-1]).read_text("utf-8")


def test_every_job_has_its_section_its_begin_its_page_and_its_limits():
    linked = re.findall(r"\]\(#([\w-]+)\)", TABLE)
    titles = [section.partition("\n")[0] for section in SECTIONS]
    assert linked == [title.lower().replace(" ", "-") for title in titles] and len(linked) >= 10
    for title, section in zip(titles, SECTIONS, strict=True):
        assert "\n```" in section, title
        read_on, _, limits = section.partition("\n* Read on: ")[2].partition("\n* Not done: ")
        assert ".md" in read_on and limits.strip(), title


def test_the_scripts_are_called_as_on_the_page_that_runs_them():
    """test/examples/test_scripts.py runs every command of docs/examples.md and compares what it prints."""
    calls = [line for line in LINES if line.startswith("python3 docs/")]
    others = (ROOT / "docs" / "examples.md").read_text("utf-8").splitlines()
    assert len(calls) == 1 and set(calls) <= set(others)
