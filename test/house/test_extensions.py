"""Tools from outside: found by entry points, refused where two offer one name, said where one cannot be loaded."""

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
from cable_sim_ros.ros import parts

ROOT = Path(__file__).resolve().parents[2]
SECTION = (ROOT / "docs" / "extending.md").read_text("utf-8").partition("\n## A tool\n")[2]


@pytest.fixture
def offered(monkeypatch):
    """Entry points in place of those that are installed: offered(group, name, value) adds one."""
    points = {}

    def offer(group, name, value):
        points.setdefault(group, []).append(EntryPoint(name, value, group))

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


def test_one_name_of_two_packages_is_refused(offered):
    offered(extensions.COMMANDS, "depth-of", "one:command")
    offered(extensions.COMMANDS, "depth-of", "two:command")
    done = CliRunner().invoke(main, ["depth-of"])
    assert done.exit_code == 2 and "Uninstall one of them" in done.stderr


def test_a_command_that_cannot_be_loaded_is_listed_with_its_reason_and_the_others_work(offered):
    offered(extensions.COMMANDS, "depth-of", "no_such_module:command")
    listed = CliRunner().invoke(main, ["--help"])
    assert listed.exit_code == 0 and "depth-of" in listed.stdout and "mesh" in listed.stdout
    assert "Cannot be loaded" in listed.stdout
    done = CliRunner().invoke(main, ["depth-of", "full_scale", "--anything"])
    assert done.exit_code == 2 and "no_such_module" in done.stderr and "Traceback" not in done.stderr


def test_a_name_of_the_core_is_not_replaced(offered):
    offered(extensions.COMMANDS, "mesh", "no_such_module:command")
    assert "elements" in CliRunner().invoke(main, ["mesh", "--help"]).stdout


def test_what_needs_a_tool_that_is_not_there_says_so(offered):
    done = CliRunner().invoke(main, ["run", "full_scale", "--report", "a.html"])
    assert done.exit_code == 2 and "cable_sim.run_parts" in done.stderr
    done = CliRunner().invoke(main, ["manual", "mapping_keys"])
    assert done.exit_code == 2 and "parameters, fields" in done.stderr
    done = CliRunner().invoke(main, ["bench"])
    assert done.exit_code == 2 and "checkout" in done.stderr


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
