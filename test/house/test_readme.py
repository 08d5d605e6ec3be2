"""What README and docs/json.md say is so: commands, Python, tables, files."""

import ast
import re
import shlex
from pathlib import Path

import click
import pytest
from pydantic import ValidationError

from cable_sim_ros.cli.commands import main
from cable_sim_ros.io import channels
from cable_sim_ros.io.channels import EVERY, Channel, Context, channels_of
from cable_sim_ros.io.load import load_scene, override
from cable_sim_ros.io.markers import markers_channel
from cable_sim_ros.io.resources import shipped_bags, shipped_scenes
from cable_sim_ros.io.winch_plan import WinchPlan
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.summary import SUMMARY, summary_markdown

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")
JSON = (ROOT / "docs" / "json.md").read_text("utf-8")
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")


def commands():
    """Every `cable-sim ...` in the README as words."""
    return sorted({text for text in re.findall(r"`(cable-sim [^`]*)`", README)})


def test_there_are_commands_to_check():
    assert len(commands()) >= 8


@pytest.mark.parametrize("text", commands())
def test_commands_exist_with_their_options(text):
    _, name, *arguments = shlex.split(text)
    command = main.get_command(None, name)
    parser = command.make_parser(click.Context(command))
    parser.parse_args(arguments)  # raises for an unknown option; argument types are the command's own matter


def test_every_command_is_in_the_readme():
    named = {text.split()[1] for text in commands()}
    assert named == set(main.list_commands(None))


def test_make_targets_exist():
    for target in set(re.findall(r"make (\w+)", README)):
        assert re.search(rf"^{target}:", MAKEFILE, re.M), target


@pytest.mark.filterwarnings("ignore::cable_sim_ros.io.load.SceneWarning")
def test_the_python_of_the_readme_runs(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.S)
    exec(compile(code, "README.md", "exec"), {})
    tension = float(capsys.readouterr().out.split()[0])
    assert tension > 100.0


def test_the_python_of_the_rig_page_runs(capsys):
    still, waves = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "rig.md").read_text("utf-8"), re.S)
    names: dict = {}
    exec(compile(still, "rig.md", "exec"), names)
    assert float(capsys.readouterr().out.split()[-1]) > 150.0  # N at the top; the body weighs 196
    exec(compile(waves, "rig.md", "exec"), names)
    mean, deviation = map(float, capsys.readouterr().out.split())
    assert 190.0 < mean < 240.0 and 0.1 < deviation < 20.0
    with pytest.raises(ValidationError, match=r"period\n.*outside \[0.3, 40\] s"):
        names["Water"](waves={"kind": "airy", "height": 1.0, "period": 0.1})


def test_the_python_of_the_winch_page_runs(capsys):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "winch.md").read_text("utf-8"), re.S)
    (code,) = (block for block in blocks if "rclpy" not in block)  # test/ros/test_controller.py runs the other
    exec(compile(code, "winch.md", "exec"), {})
    assert float(capsys.readouterr().out) == pytest.approx(0.2, abs=1e-3)


def test_the_plans_of_the_pages_are_plans():
    for page in (README, (ROOT / "docs" / "winch.md").read_text("utf-8")):
        plans = re.findall(r'--winch "([^"]*)"', page)
        assert plans and all(str(WinchPlan(plan)) == plan for plan in plans)


def test_tables_of_json_names_are_the_declared_ones():
    assert summary_markdown() in JSON and offline.figures_markdown() in JSON


@pytest.mark.filterwarnings("ignore::cable_sim_ros.io.load.SceneWarning")
def test_no_json_name_is_undeclared():
    declared = {name for name, *_ in (*SUMMARY, *offline.FIGURES)}
    assert set(offline.run("full_scale", duration=0.1).figures) <= declared
    assert len(declared) == len(SUMMARY) + len(offline.FIGURES)


DRAWN = markers_channel(load_scene("full_scale"), 1.0)


def test_every_channel_has_its_row():
    for channel in (*EVERY, DRAWN):
        kind = channel.msgtype.replace("/msg/", "/")
        assert re.search(rf"^\| out \| `{channel.topic}` \| {kind} \|", README, re.M), channel.topic


def test_every_channel_may_be_published_by_the_security_policy():
    pytest.importorskip("rclpy")
    from cable_sim_ros.ros.policy import FILE, rules

    allowed = rules(ROOT / FILE)["topics publish"]
    assert {Context().topic(channel) for channel in (*EVERY, DRAWN)} <= allowed


@pytest.mark.filterwarnings("ignore::cable_sim_ros.io.load.SceneWarning")
def test_a_channel_of_some_scenes_is_one_of_all():
    """One that stood in no table was missing from README and policy, and nothing said so."""
    rows = {row for row in vars(channels).values() if isinstance(row, Channel)}
    by_hand = {f"cable.sections.{name}.drag_amplification": 1.0 for name in ("bare", "faired")}
    strumming = override(load_scene("full_scale"), {"viv.law": "govardhan_williamson"} | by_hand)
    shown = [*channels_of(load_scene("full_scale")), *channels_of(strumming)]
    assert rows <= set(EVERY) and set(shown) == set(EVERY) and len(EVERY) == len(set(EVERY))
    tree = ast.parse(Path(str(channels.__file__)).read_text("utf-8"))
    made = [node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == "Channel"]
    assert len(made) == len(EVERY), "a channel is made that is not in EVERY"


def test_shipped_names_are_right():
    for name in ("nbp1406", "lmg1903"):
        assert name in shipped_bags() and f"`{name}`" in README
    assert all(f"`{name}`" in README for name in shipped_scenes())


@pytest.mark.parametrize("page", ["README.md", "CONTRIBUTING.md"])
def test_files_named_in_a_page_exist(page):
    text = (ROOT / page).read_text("utf-8")
    for path in re.findall(r"\]\(((?!http)[^)]+)\)", text):
        assert (ROOT / path.partition("#")[0]).exists(), path
    for path in re.findall(r"`((?:physics|sim|io|runs|lab|ros)/\w+\.py)`", text):
        assert (ROOT / "cable_sim_ros" / path).exists(), path
    for path in re.findall(r"`((?:test|docs|config|bags|\.ci)/[\w/.]*)`", text):
        assert (ROOT / path).exists(), path


def test_the_readme_has_six_figures_and_the_others_stand_elsewhere():
    table = README[README.index("\n## Figures\n") :].split("\n\n")[2].splitlines()
    assert len(table) == 2 + 6
    others = (ROOT / "docs" / "figures.md").read_text("utf-8")
    assert not [row for row in table[2:] if row in others]


def test_targets_of_contributing_exist():
    text = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
    for target in set(re.findall(r"`make (\w+)", text)):
        assert re.search(rf"^{target}:", MAKEFILE, re.M), target
