"""docs/install.md says what is declared; the Dockerfile takes its steps."""

import re
import sys
from pathlib import Path

import pytest

from cable_sim_ros import start

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "test" / "install"))
standin = pytest.importorskip("standin")
PAGE = (ROOT / "docs" / "install.md").read_text("utf-8")
DOCKER = (ROOT / "Dockerfile").read_text("utf-8").replace("\\\n", " ")
ONCE, EACH = standin.commands(PAGE, "Next to a ROS from its distribution")[:2]


def steps(script):
    return [line.strip() for line in re.split(r"\n|&&", script) if line.strip() and line.strip()[0] != "#"]


def test_table_of_versions_is_the_stand_in_and_the_declaration():
    rows = dict(start.declared(start.REQUIREMENTS.read_text("utf-8")))
    table = re.findall(r"^\| ([\w.-]+) \| (\S+) \| (\S+) \| (used|too old|missing) \|$", PAGE, re.M)
    assert {name.lower() for name, *_ in table} == set(rows)
    for name, has, needed, verdict in table:
        bounds = rows[name.lower()]
        assert needed == (bounds or "any")
        assert has == standin.UBUNTU.get(name, "none")
        assert verdict == ("missing" if has == "none" else start.misfit(has, bounds) or "used")


def test_every_file_of_the_steps_is_there():
    for path in re.findall(r"src/cable_sim_ros/(\S+)", ONCE):
        assert (ROOT / path).is_file(), path


def test_dockerfile_takes_the_steps_of_the_page():
    """So that what the stand-in runs is what the image does; the sources are copied instead of put there."""
    docker = [step for block in re.findall(r"^RUN (.*)$", DOCKER.split("AS kernels")[0], re.M) for step in steps(block)]
    page = [step for step in steps(ONCE) if not step.startswith(("mkdir", "cd"))]
    assert [step for step in docker if not step.startswith(("apt-get", "rm"))] == page
    entry = re.search(r'^ENTRYPOINT \["/bin/bash", "-c", "(.*) && exec', DOCKER, re.M).group(1)
    assert steps(entry) == steps(EACH)[:-1]
    command = " ".join(re.findall(r'"([^"]*)"', re.findall(r"^CMD (.*)$", DOCKER, re.M)[0]))
    assert command == steps(EACH)[-1]
    assert "WORKDIR /root/tow_ws" in DOCKER and "COPY . src/cable_sim_ros" in DOCKER  # ~/tow_ws of root


def test_extras_of_the_page_are_those_of_setup():
    setup = (ROOT / "setup.py").read_text("utf-8")
    for line in ('JAZZY = ros("7.1.6", "5.3.6"', 'KILTED = ros("9.1.2", "5.5.1"', '"ros": JAZZY'):
        assert line in setup
    assert "| `[ros]`, `[ros-jazzy]` | 7.1.6 | 5.3.6 |" in PAGE and "| `[ros-kilted]` | 9.1.2 | 5.5.1 |" in PAGE


def test_keys_that_rosdep_skips_are_in_package_xml():
    (skipped,) = re.findall(r'--skip-keys "([^"]+)"', PAGE)
    declared = re.findall(r"<exec_depend>([^<]+)<", (ROOT / "package.xml").read_text("utf-8"))
    assert set(skipped.split()) <= set(declared)
