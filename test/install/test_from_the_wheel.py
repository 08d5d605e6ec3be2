"""The wheel in an environment of its own with an empty home: a run from scenes and bags that came with it.

In CI it is without kernels, those are of this machine; at night with those of one scene, as of `make wheel`.
"""

import hashlib
import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from standin import ROOT

from verification.wheel import build

pytestmark = pytest.mark.install
SCENE = "full_scale"
FRAMES = """
import hashlib, sys
from cable_sim_ros.compiler.packaged import packaged
from cable_sim_ros.runs import offline
frames = offline.run(sys.argv[1], motion="nbp1406", duration=2.0).frames
print(hashlib.sha256(b"".join(frames[name].tobytes() for name in frames.dtype.names)).hexdigest(), packaged.told())
"""


def install(folder, *scenes):
    """(bin of the environment, environment variables, an empty folder). Dependencies are those of this environment."""
    bin_ = folder / "env" / "bin"
    subprocess.run([sys.executable, "-m", "venv", str(folder / "env")], check=True, timeout=600)
    pip = [str(bin_ / "python"), "-m", "pip"]
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
    environment |= {"HOME": str(folder / "home")}
    (folder / "home").mkdir()
    wheel = build(folder, list(scenes))
    subprocess.run([*pip, "install", "-q", "--no-deps", str(wheel)], check=True, env=environment, timeout=600)
    site = next((folder / "env" / "lib").glob("python*/site-packages"))
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")  # its own .pth files do not count
    (folder / "here").mkdir()
    return bin_, environment, folder / "here"


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    return of_this_machine(install(tmp_path_factory.mktemp("installed")))


@pytest.fixture(scope="module")
def with_kernels(tmp_path_factory):
    return install(tmp_path_factory.mktemp("with_kernels"), SCENE)


def of_this_machine(installed):
    """The same with the kernels that other tests have compiled for this processor."""
    bin_, environment, here = installed
    kept = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return bin_, environment | {"CABLE_SIM_KERNELS": "host", "XDG_CACHE_HOME": kept}, here


def call(installed, *command, timeout=600):
    bin_, environment, here = installed
    command = [str(bin_ / command[0]), *command[1:]]
    return subprocess.run(command, env=environment, cwd=here, text=True, capture_output=True, timeout=timeout)


def test_code_and_data_are_those_of_the_wheel(installed):
    script = "import cable_sim_ros; from cable_sim_ros.io.scenes.document import *; "
    script += "print(cable_sim_ros.__file__, share_folder(), *shipped_scenes(), *shipped_bags())"
    code, fraction, *names = call(installed, "python", "-c", script).stdout.split()
    environment = installed[0].parent
    assert Path(code).is_relative_to(environment) and Path(fraction) == environment / "share" / "cable_sim_ros"
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
    done = call(
        *(
            installed,
            "cable-sim",
            "run",
            "full_scale",
            "--motion",
            "nbp1406",
            "--duration",
            "5",
            "--out",
            "a",
            "--json",
        ),
        timeout=1500,  # two minutes of processor time where nothing is compiled yet; other work may share it
    )
    assert done.returncode in (0, 4), done.stderr  # 4: doubtful, as five seconds are short
    assert json.loads(done.stdout)["verdict"]
    assert (installed[2] / "a" / "tow" / "metadata.yaml").is_file()


def test_the_node_starts_and_says_what_it_refuses(installed):
    pytest.importorskip("rclpy")
    done = call(installed, "node", "--ros-args", "-p", "no_such:=1")
    assert done.returncode == 2 and "parameter 'no_such' = 1" in done.stderr, done.stderr
