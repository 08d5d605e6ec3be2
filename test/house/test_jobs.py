"""docs/jobs.md begins every job as it says: its commands are commands, its Python runs, each job has its parts."""

import re
import shlex
from pathlib import Path

import click
import pytest

from cable_sim_ros.cli.commands import main
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.io.scenes.resources import shipped_bags, shipped_scenes
from cable_sim_ros.io.scenes.winch_plan import WinchPlan
from cable_sim_ros.physics.heave_compensation import SetpointLaw
from cable_sim_ros.runs.settings import apply_to_scene, settings_of

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "jobs.md").read_text("utf-8")
TABLE, *SECTIONS = PAGE.split("\n## ")
LINES = [line for block in re.findall(r"```sh\n(.*?)```", PAGE, re.S) for line in block.splitlines()]
TABULATED, CONTROLLED, IN_CI = re.findall(r"```python\n(.*?)```", PAGE, re.S)
NAMES = {*shipped_scenes(), *shipped_bags(), "none"}


@pytest.mark.parametrize("line", [line for line in LINES if line.startswith("cable-sim ")])
def test_its_commands_exist_with_their_options_scenes_and_keys(line):
    _, name, *arguments = shlex.split(line)
    command = main.get_command(None, name)
    parser = command.make_parser(click.Context(command, **command.context_settings))
    options, _, _ = parser.parse_args(arguments)  # raises for an unknown option
    given = [options.get(name) for name in ("scene", "bag", "motion")] + re.findall(r"-p scene:=(\w+)", line)
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
    files = [word for line in others for word in line.split() if re.match(r"(config|cable_sim_ros|test)/", word)]
    assert len(files) >= 2 and all((ROOT / file).exists() for file in files)
    assert "class SetpointLaw" in (ROOT / files[-1]).read_text("utf-8")


def test_every_job_has_its_section_its_begin_its_page_and_its_limits():
    linked = re.findall(r"\]\(#([\w-]+)\)", TABLE)
    titles = [section.partition("\n")[0] for section in SECTIONS]
    assert linked == [title.lower().replace(" ", "-") for title in titles] and len(linked) >= 10
    for title, section in zip(titles, SECTIONS, strict=True):
        assert "\n```" in section, title
        read_on, _, limits = section.partition("\n* Read on: ")[2].partition("\n* Not done: ")
        assert ".md" in read_on and limits.strip(), title


def test_the_table_of_static_tows_is_printed(capsys):
    exec(compile(TABULATED, "jobs.md", "exec"), {})
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.split() == ["scope", "m", "speed", "m/s", "depth", "m", "layback", "m", "tension", "N"]
    scope, speed, depth, layback, tension = zip(*(map(float, row.split()) for row in rows), strict=True)
    assert scope == (100.0, 100.0, 200.0, 200.0) and speed == (1.5, 2.5, 1.5, 2.5)
    assert depth[1] < depth[0] < depth[2] and layback[0] < layback[1] < layback[3]
    assert tension[0] < tension[2] and tension[1] < tension[3]


@pytest.mark.filterwarnings("ignore::cable_sim_ros.io.scenes.load.SceneWarning")
def test_the_controller_takes_off_most_of_what_the_heave_puts_on(capsys):
    spans = []
    (command,) = re.findall(r"^    rate = .*$", CONTROLLED, re.M)
    for code in (CONTROLLED, CONTROLLED.replace(command, "    rate = 0.0")):
        exec(compile(code, "jobs.md", "exec"), {})
        minimum, largest = map(float, re.findall(r"\d+", capsys.readouterr().out))
        spans.append(largest - minimum)
    assert 0.0 < spans[0] < 0.4 * spans[1], spans


def test_the_test_for_ci_is_that_of_the_page_on_testing():
    """test/testing/test_page.py runs it."""
    assert IN_CI in (ROOT / "docs" / "testing.md").read_text("utf-8")
