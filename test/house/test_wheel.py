"""sdist and wheel: everything that belongs in a wheel is there when it is made from the sdist."""

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


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """(wheel made from the sdist, names in it, its metadata); built as every pip does it."""
    folder = tmp_path_factory.mktemp("built")
    source = standin.copied(folder / "source")
    run("-c", SDIST, folder / "sdist", cwd=source)
    (sdist,) = (folder / "sdist").glob("*.tar.gz")
    run("-m", "pip", "wheel", "-q", "--no-deps", "-w", folder / "wheel", sdist, cwd=folder)
    (path,) = (folder / "wheel").glob("*.whl")
    with zipfile.ZipFile(path) as wheel:
        names = {name for name in wheel.namelist() if not name.endswith("/")}
        (metadata,) = [name for name in names if name.endswith(".dist-info/METADATA")]
        return path, names, wheel.read(metadata).decode()


def test_wheel_has_all_code_and_package_data(built):
    _, names, _ = built
    for path in (ROOT / "cable_sim_ros").rglob("*"):
        if path.is_file() and "__pycache__" not in path.parts and path.suffix not in (".nbi", ".nbc"):
            assert path.relative_to(ROOT).as_posix() in names, path


def test_wheel_has_all_scenes_and_bags(built):
    _, names, _ = built
    shared = {name.partition("/share/cable_sim_ros/")[2] for name in names if "/share/cable_sim_ros/" in name}
    assert "package.xml" in shared
    for folder in ("bags", "config", "launch"):
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and not path.name.startswith("."):
                assert path.relative_to(ROOT).as_posix() in shared, path


def test_wheel_has_nothing_else(built):
    _, names, _ = built
    tops = {name.split("/")[0].partition("-")[0].removesuffix(".data") for name in names}
    assert tops == {"cable_sim_ros"}


def test_metadata_says_what_is_declared(built):
    from cable_sim_ros import start

    _, _, text = built
    for name, bounds in start.declared(start.REQUIREMENTS.read_text("utf-8")):
        line = next(line for line in text.splitlines() if line.lower().startswith(f"requires-dist: {name}"))
        assert all(bound in line for bound in filter(None, bounds.split(","))), line
    for extra in ("ros", "ros-jazzy", "ros-kilted"):
        assert f"Provides-Extra: {extra}\n" in text


def test_scenes_and_bags_are_found_in_a_folder_of_its_own(built, tmp_path):
    there = tmp_path / "there"
    run("-m", "pip", "install", "-qq", "--no-deps", "--no-compile", "--target", there, built[0], cwd=tmp_path)
    where = "from cable_sim_ros.io.scenes.document import *; print(share_folder(), *shipped_scenes(), *shipped_bags())"
    done = subprocess.run(
        [sys.executable, "-c", where],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(there)},
        text=True,
        capture_output=True,
        timeout=600,
    )
    share, *names = done.stdout.split()
    assert share == str(there / "share" / "cable_sim_ros"), done.stderr
    assert {"full_scale", "full_scale_westin", "nbp1406", "lmg1903"} <= set(names)
