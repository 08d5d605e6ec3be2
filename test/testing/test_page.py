"""docs/testing.md does what it says: its first test runs as it stands there, and what its table names is there."""

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


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs the speed")
def test_the_first_test_of_the_page_passes_as_it_stands_there(tmp_path):
    pytest.importorskip("rclpy")
    assert len(BLOCKS[0].splitlines()) <= 15
    (tmp_path / "test_mine.py").write_text(BLOCKS[0])
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-p", "cable_sim_ros.testing.plugin", "-q", "."],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT), "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0 and "1 passed" in done.stdout, done.stdout + done.stderr


def test_the_others_are_python():
    for block in BLOCKS[1:]:
        compile(block, "testing.md", "exec")


def test_every_name_of_its_table_is_there():
    table = PAGE.partition("| of the tow | |")[2].partition("`load_run(bag)`")[0]
    names = {name for cell in re.findall(r"^\| (.*?) \|", table, re.M) for name in re.findall(r"`(\w+)", cell)}
    assert len(names) > 15
    set_at_start = {"environment", "domain", "node", "processes", "folder", "recording"}
    assert {name for name in names if not hasattr(Tow, name)} <= set_at_start
