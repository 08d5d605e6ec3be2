"""sdist and wheel: everything that belongs in them is, and a wheel made from the sdist is the same."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "install"))
standin = pytest.importorskip("standin")
ROOT = Path(__file__).resolve().parents[2]
SDIST = "import sys; from setuptools import build_meta; build_meta.build_sdist(sys.argv[1])"


def run(*command, cwd):
    environment = os.environ | {"PYTHONPATH": ""}
    command = [sys.executable, *map(str, command)]
    subprocess.run(command, cwd=cwd, env=environment, check=True, capture_output=True, timeout=600)


def wheel(source, out):
    """Built as every pip does it, with setuptools of its own."""
    run("-m", "pip", "wheel", "-q", "--no-deps", "-w", out, source, cwd=out.parent)
    (path,) = out.glob("*.whl")
    return zipfile.ZipFile(path)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """(names in the wheel, names in the wheel made from the sdist, metadata of the first)."""
    folder = tmp_path_factory.mktemp("built")
    source = standin.copied(folder / "source")
    run("-c", SDIST, folder / "sdist", cwd=source)
    (sdist,) = (folder / "sdist").glob("*.tar.gz")
    wheels = [wheel(source, folder / "first"), wheel(sdist, folder / "second")]
    first, second = ({name for name in wheel.namelist() if not name.endswith("/")} for wheel in wheels)
    (metadata,) = [name for name in first if name.endswith(".dist-info/METADATA")]
    return first, second, wheels[0].read(metadata).decode()


def test_wheel_has_all_code_and_package_data(built):
    names, _, _ = built
    for path in (ROOT / "cable_sim_ros").rglob("*"):
        if path.is_file() and "__pycache__" not in path.parts and path.suffix not in (".nbi", ".nbc"):
            assert path.relative_to(ROOT).as_posix() in names, path


def test_wheel_has_all_scenes_and_bags(built):
    names, _, _ = built
    shared = {name.partition("/share/cable_sim_ros/")[2] for name in names if "/share/cable_sim_ros/" in name}
    assert "package.xml" in shared
    for folder in ("bags", "config", "launch"):
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and not path.name.startswith("."):
                assert path.relative_to(ROOT).as_posix() in shared, path


def test_wheel_has_nothing_else(built):
    names, _, _ = built
    tops = {name.split("/")[0].partition("-")[0].removesuffix(".data") for name in names}
    assert tops == {"cable_sim_ros"}


def test_sdist_makes_the_same_wheel(built):
    first, second, _ = built
    assert first == second


def test_metadata_says_what_is_declared(built):
    from cable_sim_ros import start

    _, _, text = built
    for name, bounds in start.declared(start.REQUIREMENTS.read_text("utf-8")):
        line = next(line for line in text.splitlines() if line.lower().startswith(f"requires-dist: {name}"))
        assert all(bound in line for bound in filter(None, bounds.split(","))), line
    for extra in ("ros", "ros-jazzy", "ros-kilted"):
        assert f"Provides-Extra: {extra}\n" in text
