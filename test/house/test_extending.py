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


@pytest.fixture(scope="session")
def proof(tmp_path_factory):
    """A process that runs the scripts on a copy of the package with every example in it: it compiles for a minute."""
    copy = tmp_path_factory.mktemp("extended")
    shutil.copy(ROOT / "package.xml", copy)
    for folder in ("cable_sim_ros", "config", "bags"):
        shutil.copytree(ROOT / folder, copy / folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name, _, patch, _ in EXAMPLES:
        done = subprocess.run(["git", "apply", "-"], cwd=copy, input=patch, capture_output=True, text=True)
        assert done.returncode == 0, f"{name}: {done.stderr}"
    program = "\n".join(
        ["import warnings", "warnings.simplefilter('ignore')"]
        + [f"exec(compile({code!r}, {name!r}, 'exec'), {{}}); print({name!r})" for name, _, _, code in EXAMPLES]
    )
    with open(copy / "out", "w+") as out, open(copy / "err", "w+") as err:
        process = subprocess.Popen(
            [sys.executable, "-c", program],
            cwd=copy,
            env={**os.environ, "PYTHONPATH": str(copy), "NUMBA_CACHE_DIR": str(copy / "cache")},
            stdout=out,
            stderr=err,
        )
        yield process, copy
        process.kill()
        process.wait()


def test_the_examples_apply_one_after_the_other(proof):
    assert proof[0].poll() in (None, 0)


def test_there_is_an_example_of_each_kind():
    assert {name.lower() for name, *_ in EXAMPLES} == set(FILES) and len(EXAMPLES) == 10


@pytest.mark.parametrize("name, patch", [(name, patch) for name, _, patch, _ in EXAMPLES], ids=lambda x: str(x)[:30])
def test_an_addition_touches_no_more_files_than_the_page_says(name, patch):
    assert len(re.findall(r"^diff --git ", patch, re.M)) == int(FILES[name.lower()])


@pytest.mark.slow
def test_the_examples_do_what_they_say(proof):
    """One process for all, so that the kernels of the copy are compiled once; conftest.py lets it run beside others."""
    process, copy = proof
    code = process.wait(timeout=600)
    ran = (copy / "out").read_text().splitlines()
    assert code == 0, f"after {ran}: {(copy / 'err').read_text()[-3000:]}"
    assert ran == [name for name, *_ in EXAMPLES]
