"""docs/install.md, its commands as they stand there, on a stand-in for Ubuntu 24.04 with ROS from apt."""

import shutil
import sys

import pytest
from standin import ROOT, UBUNTU, World, commands, copied

pytest.importorskip("rclpy")
pytest.importorskip("colcon_core")
pytestmark = [
    pytest.mark.install,
    pytest.mark.skipif(sys.version_info >= (3, 13), reason="Ubuntu's numpy 1.26 has no wheel for this Python"),
]
PAGE = (ROOT / "docs" / "install.md").read_text("utf-8")
ONCE, EACH = commands(PAGE, "Next to a ROS from its distribution")[:2]
ONCE = ONCE.replace("-m venv ", "-m venv --without-pip ")  # which has that of the system: to unpack another takes 5 s
REFUSED = " --ros-args -p no_such:=1"  # as far as it comes without compiling
NEVER = "numba 0.58.1 in "


@pytest.fixture(scope="module")
def world(tmp_path_factory):
    made = World(tmp_path_factory.mktemp("machine"))
    yield made
    out = ROOT / "runs"
    out.mkdir(exist_ok=True)
    (out / "install_check.txt").write_text("\n".join(made.transcript) + "\n")


@pytest.fixture(scope="module")
def workspace(world):
    """The folder of the page, all its steps done."""
    copied(world.home / "tow_ws" / "src" / "cable_sim_ros")
    world.shell(ONCE, check=True)
    return world.home / "tow_ws"


def node(extra=REFUSED):
    """The second block of the page, its node given a parameter that it refuses."""
    return EACH.replace(" --ros-args -p scene:=full_scale", extra)


def test_system_is_what_ubuntu_has(world):
    done = world.shell("python3 -m pip list --format=freeze", said=False)
    have = dict(line.split("==") for line in done.stdout.splitlines() if "==" in line)
    assert {name: have[name] for name in UBUNTU} == UBUNTU
    assert not {"mcap", "rosbags", "rclpy"} & set(have)


def test_pip_into_the_system_is_refused(world):
    done = world.shell("python3 -m pip install mcap rosbags")
    assert done.returncode and "externally-managed-environment" in done.stdout


def test_the_steps_of_the_page(world, workspace):
    """Built, found, started by the Python of the environment; what Ubuntu has new enough is used."""
    first = (workspace / "install/cable_sim_ros/lib/cable_sim_ros/node").read_text().splitlines()[0]
    assert first.startswith(f"#!{workspace}/.venv/bin/python")
    done = world.shell(node())
    assert done.returncode == 2 and "error: parameter 'no_such' = 1" in done.stdout, done.stdout
    done = world.shell(EACH.replace("node --ros-args -p scene:=full_scale", "cable-sim mesh full_scale"))
    assert done.returncode == 0 and "elements" in done.stdout, done.stdout
    script = "import numpy, scipy, numba, pydantic; print(*(m.__file__ for m in (numpy, scipy, numba, pydantic)))"
    places = world.shell(f'~/tow_ws/.venv/bin/python -c "{script}"', said=False).stdout.split()
    assert [place.startswith(str(world.usr)) for place in places] == [True, True, False, False]


def test_plain_colcon_makes_commands_that_say_what_is_too_old(world, tmp_path):
    copied(tmp_path / "tow_ws" / "src" / "cable_sim_ros")
    build = "cd ~/tow_ws; source /opt/ros/jazzy/setup.bash; colcon build --packages-select cable_sim_ros"
    world.shell(build, said=False, HOME=str(tmp_path))
    done = world.shell(node(), HOME=str(tmp_path))
    last = done.stdout.splitlines()[-1]
    assert done.returncode == 2 and "Traceback" not in done.stdout
    assert last.startswith(f"error: {NEVER}{world.site} is too old (>=0.65,<0.70 is needed); pydantic 1.10.14 in ")
    assert f"nothing was started by {world.python}." in last and "-m venv --system-site-packages .venv" in last


def test_environment_that_does_not_see_the_system(world, tmp_path):
    lines = ONCE.replace("--system-site-packages ", "").splitlines(True)
    done = world.shell("".join(line for line in lines if "requirements.txt" not in line), HOME=str(tmp_path))
    assert done.returncode and "No module named colcon" in done.stdout


def test_without_the_requirements(world, workspace):
    (site,) = workspace.glob(".venv/lib/python*/site-packages")
    aside = site.rename(site.with_name("aside"))
    site.mkdir()
    done = world.shell(node())
    site.rmdir()
    aside.rename(site)
    assert done.returncode == 2 and f"error: {NEVER}" in done.stdout
    assert f"Install: {workspace}/.venv/bin/python -m pip install 'numba>=0.65,<0.70'" in done.stdout


def test_without_sourcing_the_distribution(world):
    done = world.shell(node().replace("source /opt/ros/jazzy/setup.bash\n", "").replace("source ~/tow_ws", "# "))
    assert done.returncode == 127 and "ros2: command not found" in done.stdout


def test_environment_under_another_name_needs_the_mark(world, tmp_path):
    """colcon passes over folders that begin with a dot; any other it searches, and finds packages of ROS in it."""
    folder = tmp_path / "env" / "share" / "some_package"
    folder.mkdir(parents=True)
    shutil.copy(ROOT / "package.xml", folder)
    (folder / "setup.py").write_text("")
    listed = "cd; source /opt/ros/jazzy/setup.bash; colcon list"
    assert "env/share/some_package" in world.shell(listed, said=False, HOME=str(tmp_path)).stdout
    (tmp_path / "env" / "COLCON_IGNORE").touch()
    assert "some_package" not in world.shell(listed, said=False, HOME=str(tmp_path)).stdout
