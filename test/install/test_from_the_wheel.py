"""The wheel in an environment of its own with an empty home: a run from scenes and bags that came with it."""

import json
import os
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from standin import ROOT, copied

from cable_sim_ros.compiler.kernel_cache import roots

pytestmark = pytest.mark.install


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """(bin of the environment, environment variables, an empty folder). Dependencies are those of this environment."""
    folder = tmp_path_factory.mktemp("installed")
    bin_ = folder / "env" / "bin"
    subprocess.run([sys.executable, "-m", "venv", str(folder / "env")], check=True, timeout=600)
    source = copied(folder / "source")
    pip = [str(bin_ / "python"), "-m", "pip"]
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR")}
    # kernels are named by what they are made of: those of this checkout are those of the wheel, compiled once
    environment |= {"HOME": str(folder / "home"), "NUMBA_CACHE_DIR": str(roots()[0].parent)}
    (folder / "home").mkdir()
    build = [*pip, "wheel", "-q", "--no-deps", "-w", str(folder), str(source)]
    subprocess.run(build, check=True, env=environment, timeout=600)
    (wheel,) = folder.glob("*.whl")
    subprocess.run([*pip, "install", "-q", "--no-deps", str(wheel)], check=True, env=environment, timeout=600)
    site = next((folder / "env" / "lib").glob("python*/site-packages"))
    (site / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")  # its own .pth files do not count
    (folder / "here").mkdir()
    return bin_, environment, folder / "here"


def call(installed, *command, timeout=600):
    bin_, environment, here = installed
    command = [str(bin_ / command[0]), *command[1:]]
    return subprocess.run(command, env=environment, cwd=here, text=True, capture_output=True, timeout=timeout)


def test_code_and_data_are_those_of_the_wheel(installed):
    script = "import cable_sim_ros; from cable_sim_ros.io.scenes.resources import *; "
    script += "print(cable_sim_ros.__file__, share_folder(), *shipped_scenes(), *shipped_bags())"
    code, fraction, *names = call(installed, "python", "-c", script).stdout.split()
    environment = installed[0].parent
    assert Path(code).is_relative_to(environment) and Path(fraction) == environment / "share" / "cable_sim_ros"
    expected = {path.stem for path in (ROOT / "config").glob("*.yaml")} | {"nbp1406", "lmg1903"}
    assert set(names) | {"span_in_wind"} == expected


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
