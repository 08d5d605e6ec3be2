"""Tools from outside: found by entry points, refused where two offer one name, said where one cannot be loaded."""

import math
import os
import re
import subprocess
import sys
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from click.testing import CliRunner

from cable_sim_ros import extensions
from cable_sim_ros.cli.commands import main
from cable_sim_ros.physics.parameter import Block, quantity
from cable_sim_ros.ros import parts
from cable_sim_ros.ros.blocks import OwnBlock

ROOT = Path(__file__).resolve().parents[2]
SECTION = (ROOT / "docs" / "extending.md").read_text("utf-8").partition("\n## A tool\n")[2]


@pytest.fixture
def offered(monkeypatch):
    """Entry points in place of those that are installed: offered(group, name, value) adds one."""
    points = {}

    def offer(group, name, value):
        points.setdefault(group, []).append(EntryPoint(name, value, group))
        extensions.found.cache_clear()

    monkeypatch.setattr(extensions, "entry_points", lambda group: points.get(group, []))
    extensions.found.cache_clear()
    yield offer
    monkeypatch.undo()
    extensions.found.cache_clear()


def test_the_tool_of_the_page_is_a_command(tmp_path):
    setup, code = re.findall(r"```python\n(.*?)```", SECTION, re.S)
    for name, text in (("setup.py", setup), ("depth_of.py", code)):
        (tmp_path / name).write_text(text)
    subprocess.run([sys.executable, "setup.py", "-q", "egg_info"], cwd=tmp_path, check=True, capture_output=True)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path)])}
    command = [sys.executable, "-m", "cable_sim_ros.cli", "depth-of", "full_scale"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=600)
    said = re.search(r"`cable-sim depth-of full_scale` prints (\S+)\.\n", SECTION)
    assert (done.returncode, done.stdout) == (0, f"{said[1]}\n"), done.stderr


def invoke(*words):
    done = CliRunner().invoke(main, words)
    assert "Traceback" not in done.output
    return done


@pytest.mark.parametrize(
    "values, why",
    [
        (("one:command", "two:command"), "Uninstall one of them"),
        (("no_such_module:command",), "no_such_module"),
        (("math:pi",), "is no click.Command"),
    ],
)
def test_a_command_that_cannot_be_used_is_listed_and_the_others_work(offered, values, why):
    for value in values:
        offered(extensions.COMMANDS, "depth-of", value)
    listed = invoke("--help")
    assert listed.exit_code == 0 and "depth-of" in listed.stdout and "Cannot be used" in listed.stdout
    assert invoke("mesh", "--help").exit_code == 0
    for words in (("--anything",), ("--help",)):
        done = invoke("depth-of", "full_scale", *words)
        assert done.exit_code == 2 and why in done.stderr and len(done.stderr.splitlines()) == 1


def test_a_name_of_the_core_is_not_replaced(offered):
    offered(extensions.COMMANDS, "mesh", "no_such_module:command")
    offered(extensions.PAGES, "fields", "no_such_module:text")
    assert "elements" in invoke("mesh", "--help").stdout and "tension_tick_min" in invoke("manual", "fields").stdout


def test_what_needs_a_tool_that_is_not_there_says_so(offered, monkeypatch):
    done = invoke("run", "full_scale", "--report", "a.html")
    assert done.exit_code == 2 and "cable_sim.run_parts" in done.stderr
    done = invoke("replay", "nbp1406", "--limits", "a.yaml")
    assert done.exit_code == 2 and "cable_sim.run_parts" in done.stderr
    done = invoke("manual", "mapping_keys")
    assert done.exit_code == 2 and "parameters, fields" in done.stderr
    offered(extensions.COMMANDS, "bench", "verification.commands:bench")
    monkeypatch.setattr(extensions, "find_spec", lambda name: None)
    extensions.found.cache_clear()
    done = invoke("bench")
    assert done.exit_code == 2 and "checkout" in done.stderr


class Numbers(Block):
    size: float = quantity(1.0, "m", 0.0, 2.0, "a size")


class Depth(parts.NodePart):
    block, doc = Numbers, "an example"


def test_what_is_no_part_of_a_node_is_refused():
    assert parts.unfit(Depth) == "" and Depth.asked(Numbers())
    for made, why in (
        (math.pi, "NodePart"),
        (object, "NodePart"),
        (type("A", (parts.NodePart,), {"doc": ""}), "Block"),
        (type("A", (parts.NodePart,), {"block": Numbers}), "doc"),
    ):
        assert why in parts.unfit(made)


def test_a_part_has_parameters_under_a_name_of_its_own(monkeypatch, offered):
    def settings(name):
        offered(extensions.NODE_PARTS, name, "one:Depth")
        monkeypatch.setattr(parts, "PARTS", {name: Depth})
        return parts.with_parts(OwnBlock)

    assert settings("depth_of")().depth_of.size == 1.0
    for name in ("recording", "winch", "scene", "a.b"):
        with pytest.raises(extensions.ExtensionError, match=f"^{name} of {extensions.NODE_PARTS}, offered by "):
            settings(name)


def test_a_part_that_fails_at_the_start_ends_those_before_it(monkeypatch):
    ended = []

    class First(parts.NodePart):
        asked = staticmethod(lambda block: True)

        def close(self):
            ended.append(self)

    class Second(First):
        def __init__(self, node, block):
            raise extensions.ExtensionError("no")

    monkeypatch.setattr(parts, "PARTS", {"a": First, "b": Second})
    node = type("Node", (), {"settings": type("S", (), {"node": type("B", (), {"a": 1, "b": 2})})})
    with pytest.raises(extensions.ExtensionError):
        parts.started(node)
    assert len(ended) == 1
