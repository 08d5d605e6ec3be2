"""The wheel of the sdist: what is in it, and in an environment of its own with an empty home a run from its data.

In CI it is that of pip, with kernels of this machine; at night that with those of one scene, as of `make wheel`. Other
interpreters are those of this machine, with what pip brings and no ROS.
"""

import hashlib
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

import pytest
from standin import ROOT, copied, environment

from cable_sim_ros import start
from verification.wheel import build

pytestmark = pytest.mark.install
SCENE = "full_scale"
SDIST = "import sys; from setuptools import build_meta; build_meta.build_sdist(sys.argv[1])"
WHERE = "from cable_sim_ros.io.scenes.document import *; print(share_folder(), *shipped_scenes(), *shipped_bags())"
FRAMES = """
import hashlib, sys
from cable_sim_ros.compiler.packaged import packaged
from cable_sim_ros.runs import offline
frames = offline.run(sys.argv[1], motion="nbp1406", duration=2.0).frames
print(hashlib.sha256(b"".join(frames[name].tobytes() for name in frames.dtype.names)).hexdigest(), packaged.told())
"""


def install(folder, wheel):
    """(bin of the environment, environment variables, an empty folder). Dependencies are those of this environment."""
    bin_ = environment(folder / "env", "--no-deps", str(wheel))
    variables = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
    variables |= {"HOME": str(folder / "home")}
    (folder / "home").mkdir()
    site = next((folder / "env" / "lib").glob("python*/site-packages"))
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")  # its own .pth files do not count
    (folder / "here").mkdir()
    return bin_, variables, folder / "here"


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """The wheel that pip makes of the sdist."""
    folder = tmp_path_factory.mktemp("plain")
    subprocess.run([sys.executable, "-c", SDIST, folder], cwd=copied(folder / "source"), check=True, timeout=600)
    pip = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, *folder.glob("*.tar.gz")]
    subprocess.run(pip, check=True, timeout=600)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def names(plain):
    """Of files in the wheel."""
    with zipfile.ZipFile(plain) as wheel:
        return {name for name in wheel.namelist() if not name.endswith("/")}


def test_wheel_has_all_code_and_package_data(names):
    for path in (ROOT / "cable_sim_ros").rglob("*"):
        if path.is_file() and "__pycache__" not in path.parts and path.suffix not in (".nbi", ".nbc"):
            assert path.relative_to(ROOT).as_posix() in names, path


def test_wheel_has_all_scenes_and_bags(names):
    shared = {name.partition("/share/cable_sim_ros/")[2] for name in names if "/share/cable_sim_ros/" in name}
    assert "package.xml" in shared
    for folder in ("bags", "config", "launch"):
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and not path.name.startswith("."):
                assert path.relative_to(ROOT).as_posix() in shared, path


def test_wheel_has_nothing_else(names):
    tops = {name.split("/")[0].partition("-")[0].removesuffix(".data") for name in names}
    assert tops == {"cable_sim_ros"}


def test_metadata_says_what_is_declared(plain, names):
    (metadata,) = [name for name in names if name.endswith(".dist-info/METADATA")]
    text = zipfile.ZipFile(plain).read(metadata).decode()
    for name, bounds in start.declared(start.REQUIREMENTS.read_text("utf-8")):
        line = next(line for line in text.splitlines() if line.lower().startswith(f"requires-dist: {name}"))
        assert all(bound in line for bound in filter(None, bounds.split(","))), line
    for extra in ("ros", "ros-jazzy", "ros-kilted"):
        assert f"Provides-Extra: {extra}\n" in text


def test_scenes_and_bags_are_found_in_a_folder_of_its_own(plain, tmp_path):
    pip = [sys.executable, "-m", "pip", "install", "-qq", "--no-deps", "--no-compile", "--target", tmp_path, plain]
    subprocess.run(pip, check=True, timeout=600)
    there = os.environ | {"PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-c", WHERE]
    done = subprocess.run(command, cwd=tmp_path, env=there, text=True, capture_output=True, timeout=600)
    assert done.stdout.startswith(f"{tmp_path}/share/cable_sim_ros "), done.stderr
    assert {"full_scale", "full_scale_westin", "nbp1406", "lmg1903"} <= set(done.stdout.split())


@pytest.fixture(scope="module")
def installed(tmp_path_factory, plain):
    return of_this_machine(install(tmp_path_factory.mktemp("installed"), plain))


@pytest.fixture(scope="module")
def with_kernels(tmp_path_factory):
    folder = tmp_path_factory.mktemp("with_kernels")
    return install(folder, build(folder, [SCENE]))


def of_this_machine(installed):
    """The same with the kernels that other tests have compiled for this processor."""
    bin_, variables, here = installed
    kept = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return bin_, variables | {"CABLE_SIM_KERNELS": "host", "XDG_CACHE_HOME": kept}, here


def call(installed, *command, timeout=600):
    bin_, variables, here = installed
    command = [str(bin_ / command[0]), *command[1:]]
    return subprocess.run(command, env=variables, cwd=here, text=True, capture_output=True, timeout=timeout)


def test_code_and_data_are_those_of_the_wheel(installed):
    script = f"import cable_sim_ros; print(cable_sim_ros.__file__); {WHERE}"
    code, fraction, *names = call(installed, "python", "-c", script).stdout.split()
    prefix = installed[0].parent
    assert Path(code).is_relative_to(prefix) and Path(fraction) == prefix / "share" / "cable_sim_ros"
    expected = {path.stem for path in (ROOT / "config").glob("*.yaml")} | {"nbp1406", "lmg1903"}
    assert set(names) | {"span_in_wind"} == expected


def files(folder):
    return {path: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.nightly
def test_its_kernels_are_used_as_they_came(with_kernels):
    """With nothing in the home, and nothing there afterwards; it is for Linux alone."""
    (folder,) = with_kernels[0].parent.rglob("compiler/kernels")
    assert list(with_kernels[2].parent.glob("*-1x86_64_v3-*-none-manylinux_2_28_x86_64.whl"))
    before = files(folder)
    done = call(with_kernels, "python", "-c", FRAMES, SCENE, timeout=600)
    digest, told = done.stdout.split(maxsplit=1)
    assert told.endswith(" from the package (x86-64-v3)\n") and "compiled" not in told, told
    assert not list(Path(with_kernels[1]["HOME"]).rglob("kernels/*")) and files(folder) == before


@pytest.mark.nightly
def test_kernels_compiled_here_give_the_same_bits(with_kernels):
    theirs = call(with_kernels, "python", "-c", FRAMES, SCENE, timeout=600).stdout.split(maxsplit=1)
    ours = call(of_this_machine(with_kernels), "python", "-c", FRAMES, SCENE, timeout=1500).stdout.split(maxsplit=1)
    assert "not used: CABLE_SIM_KERNELS = host" in ours[1] and "from the package" not in ours[1]
    assert "compiled" not in theirs[1] and "from disk" not in theirs[1]
    assert ours[0] == theirs[0]


def test_a_run_with_a_shipped_scene_and_bag(installed):
    line = "cable-sim run full_scale --motion nbp1406 --duration 5 --out a --json".split()
    done = call(installed, *line, timeout=1500)  # two minutes of processor time where nothing is compiled yet
    assert done.returncode in (0, 4), done.stderr  # 4: doubtful, as five seconds are short
    assert json.loads(done.stdout)["verdict"]
    assert (installed[2] / "a" / "tow" / "metadata.yaml").is_file()


def test_the_node_starts_and_says_what_it_refuses(installed):
    pytest.importorskip("rclpy")
    done = call(installed, "node", "--ros-args", "-p", "no_such:=1")
    assert done.returncode == 2 and "parameter 'no_such' = 1" in done.stderr, done.stderr


@pytest.fixture(scope="module", params=[pytest.param("3.12", marks=pytest.mark.nightly), "3.13"])
def other(request, tmp_path_factory, plain):
    """The plain wheel with its dependencies in an environment of another Python."""
    beside = Path(sys.base_prefix).parent.glob(f"{request.param}.*/bin/python")
    made = [str(path) for path in (*beside, shutil.which(f"python{request.param}")) if path]
    usable = (
        one for one in made if not subprocess.run([one, "-c", "import ensurepip"], capture_output=True).returncode
    )
    if (python := next(usable, None)) is None:
        pytest.skip(f"no Python {request.param} here that makes environments")
    folder = tmp_path_factory.mktemp("other")
    bin_ = environment(folder / "env", str(plain), python=python)
    return bin_, {"HOME": str(folder), "PATH": "/usr/bin:/bin"}, folder


def test_without_ros_another_python_loads_every_module_that_needs_no_extra(other):
    script = "import pkgutil, importlib, cable_sim_ros as c; [print(m.name) or m.name.endswith('__main__') or "
    script += "importlib.import_module(m.name) for m in pkgutil.walk_packages(c.__path__, 'cable_sim_ros.') "
    script += "if m.name.split('.')[1] in ('physics', 'sim', 'io', 'runs')]"
    done = call(other, "python", "-c", script)
    assert done.returncode == 0 and len(done.stdout.split()) > 200, done.stdout[-80:] + done.stderr
    done = call(other, "cable-sim", "live", "nbp1406", "--scene", "flume")
    assert done.returncode == 2 and "rclpy" in done.stderr, done.stderr


@pytest.mark.nightly
def test_without_ros_another_python_simulates(other):
    done = call(other, "cable-sim", "run", SCENE, "--motion", "nbp1406", "--duration", "1", "--json")
    assert json.loads(done.stdout)["verdict"]["state"] == "ok", done.stderr
