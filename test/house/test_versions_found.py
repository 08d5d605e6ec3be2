"""What is installed is checked before anything is imported: one line that says what, where, and the remedy."""

import os
import subprocess
import sys
from importlib import metadata
from pathlib import Path

import pytest

from cable_sim_ros import start

pytestmark = pytest.mark.check

ROOT = Path(__file__).resolve().parents[2]
UBUNTU = {"numba": "0.58.1", "pydantic": "1.10.14"}  # too old in Ubuntu 24.04


def distribution(folder, name, version, text=None):
    """A package of that name and version: its metadata, and what its import does."""
    info = folder / f"{name}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    if text is not None:
        (folder / f"{name}.py").write_text(text)


def run(*command, path, **environment):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([*map(str, path), str(ROOT)])} | environment
    return subprocess.run([sys.executable, *command], env=environment, text=True, capture_output=True, timeout=600)


@pytest.mark.parametrize(
    ("version", "bounds", "is_"),
    [
        ("0.58.1", ">=0.65,<0.70", "too old"),
        ("0.65", ">=0.65,<0.70", ""),
        ("0.65.0rc1", ">=0.65,<0.70", ""),
        ("0.70.0", ">=0.65,<0.70", "too new"),
        ("1.10.14", ">=2,<3", "too old"),
        ("2.14.3", ">=2,<3", ""),
        ("1.26.4+ds", ">=1.26", ""),
        ("79.0.1", "", ""),
    ],
)
def test_version_against_bounds(version, bounds, is_):
    assert start.misfit(version, bounds) == is_


def test_every_line_of_the_requirements_can_be_checked():
    rows = list(start.declared(start.REQUIREMENTS.read_text("utf-8")))
    assert len(rows) >= 10 and all(start.misfit("1.0", bounds) in ("", "too old", "too new") for _, bounds in rows)


def test_requirements_at_the_top_are_the_declared_ones():
    lines = [line for line in (ROOT / "requirements.txt").read_text("utf-8").splitlines() if line[:1] != "#"]
    assert lines == ["-r cable_sim_ros/requirements.txt"]


def test_this_environment_passes():
    assert start.faults() == []


@pytest.mark.parametrize("entry", ["cable_sim", "node"])
def test_what_ubuntu_has_is_refused_in_one_line(tmp_path, entry):
    """Instead of a traceback from inside the import of pydantic."""
    for name, version in UBUNTU.items():
        distribution(tmp_path, name, version, "raise RuntimeError('imported')")
    done = run("-c", f"import sys; from cable_sim_ros import start; sys.exit(start.{entry}())", path=[tmp_path])
    assert done.returncode == 2 and done.stdout == "" and done.stderr.count("\n") == 1, done.stderr
    for name, version in UBUNTU.items():
        assert f"{name} {version} in {tmp_path} is too old" in done.stderr
    assert f"nothing was started by {sys.executable}. Install: {sys.executable} -m pip install 'numba>=" in done.stderr


def test_library_user_gets_the_same_line(tmp_path):
    distribution(tmp_path, "numba", "0.58.1", "raise RuntimeError('imported')")
    done = run("-c", "from cable_sim_ros import Simulator", path=[tmp_path])
    assert f"NotInstalledError: numba 0.58.1 in {tmp_path} is too old (>=0.65,<0.70 is needed)" in done.stderr


def test_missing_package_is_named():
    def find(name):
        if name == "mcap":
            raise metadata.PackageNotFoundError(name)
        return metadata.distribution(name)

    assert start.faults(find) == [("mcap>=1.5,<2", "mcap is not installed (mcap>=1.5,<2 is needed)")]


def test_remedy_without_an_environment_makes_one(monkeypatch):
    monkeypatch.setattr(sys, "prefix", sys.base_prefix)
    text = start.remedy(["numba>=0.65,<0.70"])
    assert f"{sys.executable} -m venv --system-site-packages .venv" in text and "COLCON_IGNORE" in text


def test_node_without_ros_says_so(tmp_path):
    (tmp_path / "rclpy.py").write_text("raise ImportError('No module named rclpy')")
    done = run("-c", "import sys; from cable_sim_ros import start; sys.exit(start.node())", path=[tmp_path])
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert done.stderr.startswith("error: the node needs ROS 2, and rclpy cannot be imported (No module named rclpy)")


def test_a_newer_numba_is_let_in_where_the_kernels_are_compiled_by_it_alone(tmp_path):
    distribution(tmp_path, "numba", "99.0")
    check = ("-c", "from cable_sim_ros import start; print([name for name, _ in start.faults()])")
    assert "numba" in run(*check, path=[tmp_path]).stdout
    assert run(*check, path=[tmp_path], CABLE_SIM_COMPILER="numba").stdout == "[]\n"
    command = "from cable_sim_ros.start import cable_sim; exit(cable_sim())"
    done = run("-c", command, path=[], CABLE_SIM_COMPILER="Numba")
    assert done.returncode == 2 and done.stderr.startswith("error: CABLE_SIM_COMPILER = 'Numba' is no way to compile")
    assert len(done.stderr.splitlines()) == 1


def test_kernels_that_are_none_are_refused():
    done = run("-c", "from cable_sim_ros.start import cable_sim; exit(cable_sim())", path=[], CABLE_SIM_KERNELS="mine")
    assert done.returncode == 2 and done.stderr.startswith("error: CABLE_SIM_KERNELS = 'mine' names no kernels")
    assert len(done.stderr.splitlines()) == 1
