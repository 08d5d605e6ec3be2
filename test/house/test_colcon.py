"""The package built and installed by colcon; by pip: test/install."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "install"))
standin = pytest.importorskip("standin")
ROOT = Path(__file__).resolve().parents[2]
WHERE = "from cable_sim_ros.io.scenes.document import *; print(share_folder(), *shipped_scenes(), *shipped_bags())"


def call(*command, cwd, **environment):
    # the whole environment: rclpy from wheels does not start without what its own hook has put there
    done = subprocess.run(command, cwd=cwd, env=os.environ | environment, text=True, capture_output=True, timeout=600)
    assert done.returncode == 0, f"{command}\n{done.stdout}\n{done.stderr}"
    return done.stdout


@pytest.fixture(
    scope="module",
    params=["", pytest.param("--symlink-install", marks=pytest.mark.nightly)],
    ids=["copied", "symlinked"],
)
def workspace(request, tmp_path_factory):
    """Workspace with the package built by colcon."""
    pytest.importorskip("colcon_core")
    folder = tmp_path_factory.mktemp("workspace")
    standin.copied(folder / "src")
    colcon = str(Path(sys.executable).with_name("colcon"))
    listed = call(colcon, "list", cwd=folder)
    assert listed.split() == ["cable_sim_ros", "src", "(ros.ament_python)"]
    call(colcon, "build", *filter(None, [request.param]), cwd=folder)
    return folder


def sourced(workspace, *command, **environment):
    """Output of a command after ``source install/setup.bash``, run elsewhere."""
    return call(
        "bash",
        "-c",
        f'source "{workspace}/install/setup.bash" && exec "$@"',
        "bash",
        *command,
        cwd=workspace.parent,
        PYTHONPATH="",
        **environment,
    )


def test_colcon_installs_share_and_index(workspace):
    prefix = workspace / "install" / "cable_sim_ros"
    assert (prefix / "share" / "ament_index" / "resource_index" / "packages" / "cable_sim_ros").is_file()
    for path in (ROOT / "config").glob("*.yaml"):
        assert (prefix / "share" / "cable_sim_ros" / "config" / path.name).read_bytes() == path.read_bytes()
    for path in (ROOT / "launch").glob("*.launch.py"):
        assert (prefix / "share" / "cable_sim_ros" / "launch" / path.name).read_bytes() == path.read_bytes()
    assert (prefix / "share" / "cable_sim_ros" / "package.xml").is_file()
    assert sorted(p.name for p in (prefix / "lib" / "cable_sim_ros").iterdir()) == ["cable-sim", "node"]
    assert str(prefix) in sourced(workspace, "bash", "-c", "echo $AMENT_PREFIX_PATH")


def test_executable_installed_by_colcon_runs(workspace):
    executable = workspace / "install" / "cable_sim_ros" / "lib" / "cable_sim_ros" / "cable-sim"
    assert "make-bags" in sourced(workspace, str(executable), "--help")


def test_scenes_and_bags_are_found_after_colcon(workspace):
    fraction, *names = sourced(workspace, sys.executable, "-c", WHERE).split()
    assert fraction.startswith(str(workspace)) and {"full_scale", "nbp1406"} <= set(names)


def test_node_installed_by_colcon_starts(workspace):
    pytest.importorskip("rclpy")
    executable = workspace / "install" / "cable_sim_ros" / "lib" / "cable_sim_ros" / "node"
    done = subprocess.run(
        [
            "bash",
            "-c",
            f'source "{workspace}/install/setup.bash" && exec "$@"',
            "bash",
            str(executable),
            "--ros-args",
            "-p",
            "no_such_parameter:=1.0",
        ],
        cwd=workspace.parent,
        text=True,
        capture_output=True,
        timeout=600,
    )
    assert done.returncode == 2 and "no_such_parameter" in done.stderr, done.stderr
