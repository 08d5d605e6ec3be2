"""The worked examples of docs/extending.md: applied to a copy of the package one after the other, then proved."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "extending.md").read_text("utf-8")
EXAMPLES = re.findall(r"^## (.+?)\n(.*?)```diff\n(.*?)```\n.*?```python\n(.*?)```", PAGE, re.M | re.S)
FILES = dict(re.findall(r"^\| \[(.+?)\]\(.*?\) \| (\d+) \|$", PAGE, re.M))


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the package with every example in it."""
    copy = tmp_path_factory.mktemp("extended")
    shutil.copy(ROOT / "package.xml", copy)
    for folder in ("cable_sim_ros", "config", "bags"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name, _, patch, _ in EXAMPLES:
        done = subprocess.run(["git", "apply", "-"], cwd=copy, input=patch, capture_output=True, text=True)
        assert done.returncode == 0, f"{name}: {done.stderr}"
    return copy


def test_the_examples_apply_one_after_the_other_and_are_python(copy):
    for path in (copy / "cable_sim_ros").rglob("*.py"):
        compile(path.read_text("utf-8"), str(path), "exec")
    for name, _, _, code in EXAMPLES:
        compile(code, name, "exec")


def test_there_is_an_example_of_each_kind():
    assert {name.lower() for name, *_ in EXAMPLES} == set(FILES) and len(EXAMPLES) == 8


@pytest.mark.parametrize("name, patch", [(name, patch) for name, _, patch, _ in EXAMPLES], ids=lambda x: str(x)[:30])
def test_an_addition_touches_no_more_files_than_the_page_says(name, patch):
    assert len(re.findall(r"^diff --git ", patch, re.M)) == int(FILES[name.lower()])


@pytest.mark.nightly
def test_the_examples_do_what_they_say(copy):
    """One process for all: the kernels of the copy are compiled once, which takes minutes."""
    program = "\n".join(
        ["import warnings", "warnings.simplefilter('ignore')"]
        + [f"exec(compile({code!r}, {name!r}, 'exec'), {{}}); print({name!r})" for name, _, _, code in EXAMPLES]
    )
    own = os.environ | {"PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(copy / "cache")}
    done = subprocess.run([sys.executable, "-c", program], cwd=copy, env=own, capture_output=True, text=True)
    assert done.returncode == 0, f"after {done.stdout}: {done.stderr[-3000:]}"
    assert done.stdout.splitlines() == [name for name, *_ in EXAMPLES]
