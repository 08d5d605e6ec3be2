"""The pytest plugin in sessions of its own, with a stand-in for the tow.

docs/testing.md does what it says: its first test runs as it stands there, and what its table names is there.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from cable_sim_ros.testing.tow_sim import Tow

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "testing.md").read_text("utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE, re.S | re.M)

ALONE = os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}  # others' plugins take seconds
STAND_IN = """
import sys
import types
from types import SimpleNamespace

class Fake:
    def __init__(self, scene, **options):
        print("started", scene, options["folder"].name)
        self.node = SimpleNamespace(name="the node", tail=lambda lines: "  last words")
        self.processes = []
    def close(self):
        print("it is shut")
        if FAILS:
            raise RuntimeError("it would not end")

sys.modules["rclpy"] = {rclpy}
module = types.ModuleType("cable_sim_ros.testing.tow_sim")
module.tow, FAILS = Fake, {fails}
sys.modules[module.__name__] = module
"""


def session_in(folder, *options):
    """Code and output of a pytest session with the plugin on a folder of tests."""
    command = [sys.executable, "-m", "pytest", "-p", "cable_sim_ros.testing.plugin", *options, "."]
    done = subprocess.run(command, cwd=folder, env=ALONE, capture_output=True, text=True, timeout=600)
    return done.returncode, done.stdout + done.stderr


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs the speed")
def test_the_first_test_of_the_page_passes_as_it_stands_there(tmp_path):
    pytest.importorskip("rclpy")
    assert len(BLOCKS[0].splitlines()) <= 15
    (tmp_path / "test_mine.py").write_text(BLOCKS[0])
    code, text = session_in(tmp_path, "-q")
    assert code == 0 and "1 passed" in text, text


def test_the_others_are_python():
    for block in BLOCKS[1:]:
        compile(block, "testing.md", "exec")


def test_every_name_of_its_table_is_there():
    table = PAGE.partition("| of the tow | |")[2].partition("\n## ")[0]
    names = {name for cell in re.findall(r"^\| (.*?) \|", table, re.M) for name in re.findall(r"`(\w+)", cell)}
    assert len(names) > 15
    set_at_start = {"environment", "domain", "node", "processes", "folder", "recording"}
    assert {name for name in names if not hasattr(Tow, name)} <= set_at_start


def session(folder, test, rclpy='types.ModuleType("rclpy")', fails=False):
    """Code and output of a pytest session with the plugin and one test file."""
    (folder / "conftest.py").write_text(STAND_IN.replace("{rclpy}", rclpy).replace("{fails}", str(fails)))
    (folder / "test_it.py").write_text(test)
    return session_in(folder, "-rs", "-s")


def test_a_session_that_does_not_use_it_loads_nothing(tmp_path):
    test = "def test_it():\n    import sys\n    assert not {'numba', 'numpy', 'scipy', 'pydantic'} & set(sys.modules)\n"
    code, text = session(tmp_path, test, rclpy="None")
    assert code == 0 and "1 passed" in text, text


def test_without_rclpy_the_test_is_skipped_with_what_to_do(tmp_path):
    code, text = session(tmp_path, "def test_it(tow_sim):\n    tow_sim()\n", rclpy="None")
    assert code == 0 and "1 skipped" in text and "tow_sim needs rclpy (pip install 'cable_sim_ros[ros]'" in text, text


@pytest.mark.parametrize("end", ["assert 1 == 2", "raise KeyboardInterrupt"])
def test_every_tow_is_closed_however_the_test_ends(tmp_path, end):
    test = f"def test_it(tow_sim):\n    tow_sim('side_scan')\n    tow_sim()\n    {end}\n"
    code, text = session(tmp_path, test)
    assert code == (1 if "assert" in end else 2) and text.count("it is shut") == 2, text
    assert "started side_scan tow_sim0" in text and "started full_scale tow_sim1" in text
    if code == 1:
        assert "the node of tow_sim 1, last lines" in text and "last words" in text


def test_what_cannot_be_ended_fails_the_test(tmp_path):
    code, text = session(tmp_path, "def test_it(tow_sim):\n    tow_sim()\n    tow_sim()\n", fails=True)
    assert code == 1 and text.count("it is shut") == 2 and "it would not end\nit would not end" in text, text
