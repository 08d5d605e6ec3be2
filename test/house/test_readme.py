"""What README, CONTRIBUTING and the pages of reference say is so: commands, Python, topics, figures, floors, files."""

import ast
import re
import shlex
from pathlib import Path

import click
import pytest
from pydantic import ValidationError

import cable_sim_ros
from cable_sim_ros.cli.commands import main
from cable_sim_ros.cli.options import deliver
from cable_sim_ros.cli.report import answer_of
from cable_sim_ros.io.messages import channels
from cable_sim_ros.io.messages.channels import EVERY, Channel, Context, channels_of
from cable_sim_ros.io.messages.instrument_channels import INSTRUMENTS
from cable_sim_ros.io.messages.markers import markers_channel
from cable_sim_ros.io.messages.messages import KINDS
from cable_sim_ros.io.scenes.document import shipped_bags, shipped_scenes
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.scenes.winch_plan import WinchPlan
from cable_sim_ros.physics.sensor_models import DEVICES
from cable_sim_ros.physics.towbody import LineBody
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.summary import SUMMARY

pytestmark = pytest.mark.trust

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text("utf-8")
CONTRIBUTING = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
COMMANDS, METRICS, INDEX, JSON, TOPICS, WINCH = (
    (ROOT / "docs" / f"{name}.md").read_text("utf-8")
    for name in ("commands", "figures", "index", "json", "topics", "winch")
)
MAKEFILE = (ROOT / "Makefile").read_text("utf-8")
PLACEHOLDER = "cable-sim COMMAND --help"
DOORS = ["Start", "How-to", "Reference", "Theory", "Evidence", "Developers"]


def commands(*pages):
    """Every `cable-sim ...` of the pages as words."""
    return sorted({text for page in pages for text in re.findall(r"`(cable-sim [^`]*)`", page)} - {PLACEHOLDER})


def section(page, heading):
    """What stands on a page under a heading of the second level."""
    return page.partition(f"\n## {heading}\n")[2].partition("\n## ")[0]


def plain(text):
    """A text in one line."""
    return " ".join(text.split())


def test_there_are_commands_to_check():
    assert len(commands(COMMANDS)) >= len(main.list_commands(None))


@pytest.mark.parametrize("text", commands(README, CONTRIBUTING, COMMANDS, INDEX))
def test_commands_exist_with_their_options(text):
    _, name, *arguments = shlex.split(text)
    command = main.get_command(None, name)
    parser = command.make_parser(click.Context(command))
    parser.parse_args(arguments)  # raises for an unknown option; argument types are the command's own matter


def test_every_command_has_its_row():
    """One row a command in the first table; the second has only forms of `run`."""
    first = re.findall(r"^\| `cable-sim ([\w-]+)", section(COMMANDS, "Every command"), re.M)
    assert sorted(first) == sorted(main.list_commands(None))
    second = re.findall(r"^\| `cable-sim ([\w-]+)", section(COMMANDS, "Offline runs"), re.M)
    assert len(second) >= 8 and set(second) == {"run"}


@pytest.mark.parametrize("page", [README, CONTRIBUTING, COMMANDS], ids=["README", "CONTRIBUTING", "commands"])
def test_make_targets_exist(page):
    targets = set(re.findall(r"`make ([a-z-]+)", page)) | set(re.findall(r"^make ([a-z-]+)", page, re.M))
    assert targets
    for target in targets:
        folder = ROOT / "test" / target.removeprefix("test-")  # of the rule test-%
        assert re.search(rf"^{target}:", MAKEFILE, re.M) or folder.is_dir(), target


def test_every_make_target_stands_in_contributing():
    (targets,) = re.findall(r"^\.PHONY: (.*)$", MAKEFILE, re.M)
    assert set(targets.split()) - set(re.findall(r"`make ([a-z-]+)", CONTRIBUTING)) == {"help", "clean"}


def test_the_python_of_the_readme_runs_and_prints_what_it_says(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.S)
    assert len([line for line in code.splitlines() if line]) <= 12
    exec(compile(code, "README.md", "exec"), {})
    (said,) = re.findall(r"# (\d+ N, [\d.]+ m deep)$", code, re.M)
    printed, shown = (list(map(float, re.findall(r"[\d.]+", text))) for text in (capsys.readouterr().out, said))
    assert printed[0] == pytest.approx(shown[0], abs=1.0) and printed[1] == pytest.approx(shown[1], abs=0.1)


def test_what_the_readme_shows_of_a_run_is_what_a_run_prints(tmp_path, capsys):
    (block,) = re.findall(r"```text\n(.*?)```", README, re.S)
    rows = re.findall(r"^│ ([\w ]+?) +│ +[\d.]+ │", block, re.M)
    assert rows == ["tension at the sheave", "depth of the towbody"]
    deliver(answer_of(offline.run("full_scale", duration=1.0, out=tmp_path), tmp_path), quiet=False)
    printed = capsys.readouterr().out.splitlines()
    assert all(any(line.startswith(f"│ {name} ") for line in printed) for name in rows)
    paths = [line.replace(f"{tmp_path}/", "runs/20261122_233406/") for line in printed if not line.startswith("│")]
    assert paths[-4:] == block.splitlines()[-4:]


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
    (code,) = re.findall(r"```python\n(.*?)```", WINCH, re.S)
    exec(compile(code, "winch.md", "exec"), {})
    assert float(capsys.readouterr().out) == pytest.approx(0.2, abs=1e-3)


def test_the_plans_of_the_pages_are_plans():
    for page in (COMMANDS, WINCH):
        plans = re.findall(r'--winch "([^"]*)"', page)
        assert plans and all(str(WinchPlan(plan)) == plan for plan in plans)


def test_no_json_name_is_undeclared():
    declared = {name for name, *_ in (*SUMMARY, *offline.METRICS)}
    assert set(offline.run("full_scale", duration=0.1).metrics) <= declared
    assert len(declared) == len(SUMMARY) + len(offline.METRICS)


DRAWN = markers_channel(load_scene("full_scale"), 1.0)


def test_the_readme_names_no_other_topic():
    named = set(re.findall(r"`([\w/]+)`", section(README, "Topics").partition("\n* ")[2]))
    assert len(named) == 12 and named <= set(re.findall(r"^\| `([\w/]+)` \|", TOPICS, re.M))


def test_every_channel_may_be_published_by_the_security_policy():
    pytest.importorskip("rclpy")
    from cable_sim_ros.ros.services.policy import FILE, rules

    allowed = rules(ROOT / FILE)["topics publish"]
    assert {Context().topic(channel) for channel in (*EVERY, DRAWN)} <= allowed


def test_what_others_may_do_is_what_the_node_offers():
    pytest.importorskip("rclpy")
    from cable_sim_ros.ros import watcher
    from cable_sim_ros.ros.services import policy

    node = policy.rules(ROOT / policy.FILE)
    out, into = node["topics publish"], node["topics subscribe"]
    others = ("controller", "sensors", "cable_sim_view", "operator")
    profiles = {name: policy.rules(ROOT / policy.FILE, name) for name in others}
    for name, may in profiles.items():
        assert may["topics publish"] - {"/parameter_events", "/rosout"} <= into, name
        assert may.get("topics subscribe", set()) <= out | into, name
        assert may.get("services request", set()) <= node["services reply"], name
    heard = profiles["controller"]["topics subscribe"]
    aboard = {Context().topic(channel) for channel in EVERY if channel.new}
    assert aboard | {"/clock"} | {f"{policy.SPACE}/{KINDS[kind][1]}" for kind in ("imu", "odometry")} <= heard
    drawn = {f"{policy.SPACE}/{channel.topic}" for channel in (watcher.HEALTH, watcher.SHAPE, watcher.CONTACT)}
    assert profiles["cable_sim_view"]["topics subscribe"] == drawn | {"/diagnostics"}
    standard = {f"{policy.SPACE}/{policy.NODE}/{policy.service_name(name)}" for name in policy.SERVICES}
    beside = {f"{policy.SPACE}/{policy.NODE}/get_type_description"}
    assert profiles["operator"]["services request"] == node["services reply"] - standard - beside


def test_a_channel_of_some_scenes_is_one_of_all():
    """One that stood in no table was missing from page and policy, and nothing said so."""
    rows = {row for row in vars(channels).values() if isinstance(row, Channel)}
    by_hand = {f"cable.sections.{name}.drag_amplification": 1.0 for name in ("bare", "faired")}
    strumming = override(load_scene("full_scale"), {"viv.law": "govardhan_williamson"} | by_hand)
    aboard = override(load_scene("full_scale"), {f"instruments.{name}.on": True for name in DEVICES})
    pod = {"at": "bare", "mass": 50.0, "net_weight": 300.0}
    hung = load_scene("full_scale").model_copy(update={"bodies": {"pod": LineBody(**pod)}})
    scenes = load_scene("depressor"), strumming, aboard, hung, load_scene("rov_tether")
    shown = [row for scene in scenes for row in channels_of(scene)]
    assert rows <= set(EVERY) and set(shown) == set(EVERY) and len(EVERY) == len(set(EVERY))
    tree = ast.parse(Path(str(channels.__file__)).read_text("utf-8"))
    made = [ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)]
    rows = made.count("Channel") - 1 + made.count("_cloud")  # one is within _cloud
    assert rows == len(EVERY) - len(INSTRUMENTS), "a channel is made that is not in EVERY"


def test_shipped_names_are_right():
    for name in ("nbp1406", "lmg1903"):
        assert name in shipped_bags()
    for heading, names in (("Scenes", shipped_scenes()), ("Bags", shipped_bags())):
        assert sorted(re.findall(r"^\| `(\w+)` \|", section(COMMANDS, heading), re.M)) == names


def test_the_readme_has_three_figures_and_each_stands_among_all():
    """Each result, and the mesh of the reference, is that of the same row in docs/figures.md."""
    bullets = [plain(text) for text in section(README, "Figures").split("\n* ")[1:]]
    assert [re.match(r"\*\*(\w+):", text)[1] for text in bullets] == ["Speed", "Accuracy", "Agreement"]
    numbers = [set(re.findall(r"\d+\.\d+|\d{3,}", re.sub(r"\(\d{4}\)|NBP1406", "", text))) for text in bullets]
    assert [len(found) for found in numbers] == [4, 2, 6]
    rows = [row for row in METRICS.splitlines() if row.startswith("|")]
    for found, first in zip(numbers, ("offline", "offline", "static tow `full_scale_westin`"), strict=True):
        among = " ".join(row for row in rows if row.startswith(f"| {first}"))
        assert found <= set(re.findall(r"\d+\.\d+|\d{3,}", among)), found
    for condition in ("AVX2", "Python 3.11", "numba 0.68"):
        assert condition in section(README, "Figures").split("\n* ")[0] and condition in METRICS.split("|")[0]


def test_no_row_of_a_table_stands_on_two_pages():
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
    mine = ("README.md", "CONTRIBUTING.md", "commands.md", "figures.md", "index.md", "topics.md")
    where: dict[str, set[str]] = {}
    for page in pages:
        for row in page.read_text("utf-8").splitlines():
            if row.startswith("| ") and len(row) > 60:
                where.setdefault(row, set()).add(page.name)
    assert len(where) > 500
    assert not {row: names for row, names in where.items() if len(names) > 1 and names & set(mine)}


def test_readme_and_index_have_the_same_doors():
    assert re.findall(r"^\* \*\*([\w-]+)\*\*: ", section(README, "Doors"), re.M) == DOORS
    assert re.findall(r"^## (.+)$", INDEX, re.M) == DOORS
    for door in DOORS:  # what the README opens, the index opens under the same door
        text = section(README, "Doors").partition(f"* **{door}**: ")[2].partition("\n* ")[0]
        opened = {target.removeprefix("docs/") for target in re.findall(r"\]\(([^)]+)\)", text)}
        behind = {target.removeprefix("../") for target in re.findall(r"\]\(([^)]+)\)", section(INDEX, door))}
        assert opened and opened <= behind | {f"index.md#{door.lower()}"}, door


def test_the_readme_is_a_page():
    assert len(README.splitlines()) <= 100
    assert f"Version {cable_sim_ros.__version__} " in README


def test_contributing_names_every_floor():
    (block,) = re.findall(r"```\ncable_sim_ros/\n(.*?)```", CONTRIBUTING, re.S)
    folders = {path.parent.name for path in (ROOT / "cable_sim_ros").glob("*/__init__.py")}
    assert set(re.findall(r"^  (\w+)/ ", block, re.M)) == folders
    names = block.partition("lazily: ")[2].partition("\n  physics/")[0]
    assert set(re.findall(r"\w+", names)) <= set(cable_sim_ros.__all__)
