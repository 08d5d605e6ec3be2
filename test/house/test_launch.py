"""launch/: each file gives the processes, arguments and parameters of its page, and says which package is missing.

No process is started. `launch` and `launch_ros` are a stand-in, of what the files of launch/ use and no more: actions
keep what they are given, arguments are read from the context, a dictionary. With the real ones the descriptions are
made by these, too.
"""

from __future__ import annotations

import ast
import importlib.util
import re
import runpy
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml

from cable_sim_ros.ros.parameters import settle

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "launch"
FILES = sorted(FOLDER.glob("*.launch.py"))
COMMON = {"scene", "namespace", "use_sim_time", "params_file"}
OWN = {"node": set(), "foxglove": {"port", "address"}, "rviz": {"layout"}, "ros2_control": {"controller"}}
PAGES = "".join((ROOT / "docs" / name).read_text("utf-8") for name in ("realtime.md", "seeing.md", "ros2_control.md"))
REAL = importlib.util.find_spec("launch_ros") is not None


class Kept:
    """An action: its keyword arguments, and the positional ones as `given`."""

    def __init__(self, *given, **named) -> None:
        self.given, self.named = given, named


class LaunchDescription:
    def __init__(self, entities) -> None:
        self.entities = list(entities)


ACTIONS = ("DeclareLaunchArgument", "OpaqueFunction", "LogInfo", "ExecuteProcess", "RegisterEventHandler")
KINDS = {name: type(name, (Kept,), {}) for name in (*ACTIONS, "OnProcessExit", "Node")}
LogInfo, RegisterEventHandler, Node = KINDS["LogInfo"], KINDS["RegisterEventHandler"], KINDS["Node"]


class ParameterValue:
    def __init__(self, value, *, value_type) -> None:
        self.value, self.value_type = value, value_type


class LaunchConfiguration:
    def __init__(self, name: str) -> None:
        self.name = name

    def perform(self, context) -> str:
        return context[self.name]


def modules() -> dict[str, SimpleNamespace]:
    """The stand-in, name -> module, for sys.modules."""
    has = {
        "launch": (LaunchDescription,),
        "launch.actions": [KINDS[name] for name in ACTIONS],
        "launch.substitutions": (LaunchConfiguration,),
        "launch.event_handlers": (KINDS["OnProcessExit"],),
        "launch_ros": (),
        "launch_ros.actions": (Node,),
        "launch_ros.parameter_descriptions": (ParameterValue,),
    }
    return {name: SimpleNamespace(**{kind.__name__: kind for kind in kinds}) for name, kinds in has.items()}


class NotFound(KeyError):
    """PackageNotFoundError of ament_index_python."""


class Launched:
    """One file under the stand-in; packages: those that are there, None: all."""

    def __init__(self, monkeypatch, name: str, packages: set[str] | None = None) -> None:
        for module, made in modules().items():
            monkeypatch.setitem(sys.modules, module, made)

        def prefix(package):
            if packages is not None and package not in packages:
                raise NotFound(package)

        index = SimpleNamespace(PackageNotFoundError=NotFound, get_package_prefix=prefix)
        monkeypatch.setitem(sys.modules, "ament_index_python", SimpleNamespace())
        monkeypatch.setitem(sys.modules, "ament_index_python.packages", index)
        entities = runpy.run_path(str(FOLDER / f"{name}.launch.py"))["generate_launch_description"]().entities
        *self.declared, self.start = entities
        self.defaults = {action.given[0]: action.named["default_value"] for action in self.declared}

    def actions(self, **arguments):
        assert set(arguments) <= set(self.defaults)
        return self.start.named["function"](self.defaults | arguments)

    def nodes(self, **arguments) -> dict[str, dict]:
        """Executable -> what it is started with."""
        found = [a.named for a in self.actions(**arguments) if isinstance(a, Node)]
        return {named["executable"]: named for named in found}


@pytest.fixture
def file(monkeypatch):
    return lambda name, packages=None: Launched(monkeypatch, name, packages)


def test_there_is_a_file_for_each_purpose():
    assert [path.name.partition(".")[0] for path in FILES] == sorted(OWN)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_file_needs_the_packages_of_package_xml_alone(path):
    """Not cable_sim_ros either: the Python of `ros2 launch` need not have its environment."""
    tree = ast.parse(path.read_text("utf-8"))
    compile(tree, str(path), "exec")
    tops = {node.module.partition(".")[0] for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    tops |= {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    declared = set(re.findall(r"<exec_depend>([^<]+)<", (ROOT / "package.xml").read_text("utf-8")))
    assert tops - sys.stdlib_module_names <= declared and "cable_sim_ros" not in tops
    assert "launch" in tops


@pytest.mark.parametrize("name", OWN)
def test_arguments_are_declared_described_and_on_a_page(file, name):
    it = file(name)
    assert set(it.defaults) == COMMON | OWN[name]
    assert all(action.named["description"] for action in it.declared)
    assert f"ros2 launch cable_sim_ros {name}.launch.py" in PAGES
    for line in re.findall(rf"ros2 launch cable_sim_ros {name}\.launch\.py((?: \w+:=\S+)*)", PAGES):
        assert set(re.findall(r"(\w+):=", line)) <= set(it.defaults), line


def test_the_node_gets_what_is_given_and_nothing_else(file, tmp_path):
    it = file("node")
    plain = it.nodes()["node"]
    assert (plain["package"], plain["name"], plain["namespace"]) == ("cable_sim_ros", "cable_sim", "/tow_sim")
    assert plain["parameters"] == []
    given = tmp_path / "mine.yaml"
    given.touch()
    full = it.nodes(scene="side_scan", namespace="tow_b", use_sim_time="True", params_file=str(given))["node"]
    assert full["namespace"] == "/tow_b"
    assert full["parameters"] == [str(given), {"scene": "side_scan", "time_mode": "lockstep"}], "the later one counts"
    assert settle(full["parameters"][1]).node.time_mode.value == "lockstep"
    assert it.nodes(namespace="/")["node"]["namespace"] == "/"
    setup = (ROOT / "setup.py").read_text("utf-8")
    assert '"node = cable_sim_ros.start:node"' in setup and 'shared("bags", "config", "launch")' in setup


@pytest.mark.parametrize(
    "name, wrong, text",
    [
        ("node", {"use_sim_time": "maybe"}, "use_sim_time:=maybe is neither true nor false: nothing was started"),
        ("rviz", {"params_file": "/no/file.yaml"}, "params_file:=/no/file.yaml is no file: nothing was started"),
        ("foxglove", {"port": "70000"}, "port:=70000 is no number from 1 to 65535: nothing was started"),
        ("ros2_control", {"controller": "x"}, "controller:=x is none of winch_velocity, "),
    ],
)
def test_a_wrong_argument_is_said(file, name, wrong, text):
    with pytest.raises(RuntimeError, match=re.escape(text)):
        file(name).actions(**wrong)


@pytest.mark.parametrize("name, package", [("foxglove", "foxglove_bridge"), ("rviz", "rviz2")])
def test_what_is_not_installed_is_named_with_its_remedy(file, monkeypatch, name, package):
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    with pytest.raises(RuntimeError) as error:
        file(name, set()).actions()
    assert str(error.value) == (
        f"{name}.launch.py needs {package}, not installed: nothing was started; sudo apt install "
        f"ros-jazzy-{package.replace('_', '-')}, or start the node alone: ros2 launch cable_sim_ros node.launch.py"
    )


def test_foxglove_is_reached_from_this_host_alone_unless_asked(file):
    bridge = file("foxglove").nodes(use_sim_time="true")
    assert set(bridge) == {"node", "foxglove_bridge"}
    assert bridge["foxglove_bridge"]["parameters"] == [{"port": 8765, "address": "127.0.0.1", "use_sim_time": True}]
    (said,) = [a.named["msg"] for a in file("foxglove").actions() if isinstance(a, LogInfo)]
    assert said.startswith("Foxglove: ws://127.0.0.1:8765, layout ") and Path(said.split()[-1]).is_file()


def test_rviz_has_the_layout_of_the_namespace(file):
    it = file("rviz")
    rviz = it.nodes()["rviz2"]
    assert rviz["arguments"] == ["-d", it.defaults["layout"]] and Path(it.defaults["layout"]).is_file()
    assert rviz["remappings"] == [("/tf", "/tow_sim/tf"), ("/tf_static", "/tow_sim/tf_static")]
    assert it.nodes(layout="")["rviz2"]["arguments"] == []
    for space, front in (("tow_b", "/tow_b"), ("/", "")):
        other = it.nodes(namespace=space)["rviz2"]
        copy = Path(other["arguments"][1])
        text = yaml.safe_load(copy.read_text("utf-8"))
        copy.unlink()
        topics = re.findall(r"'Value': '(/[\w/]+)'", str(text))
        assert f"{front}/cable/markers" in topics and not [name for name in topics if name.startswith("/tow_sim")]
        assert other["remappings"][0] == ("/tf", f"{front}/tf")


CONTROLLERS = yaml.safe_load((ROOT / "config" / "ros2_control" / "controllers.yaml").read_text("utf-8"))
TYPES = {
    name: value["type"]
    for name, value in CONTROLLERS["controller_manager"]["ros__parameters"].items()
    if isinstance(value, dict)
}


@pytest.mark.parametrize("controller", [name for name in TYPES if name != "joint_state_broadcaster"])
def test_a_controller_is_spawned_when_the_winch_has_a_state(file, monkeypatch, controller):
    it = file("ros2_control")
    actions = it.actions(controller=controller, namespace="tow_b", use_sim_time="true")
    nodes = it.nodes(controller=controller, namespace="tow_b", use_sim_time="true")
    assert set(nodes) == {"node", "robot_state_publisher", "ros2_control_node"}
    assert nodes["node"]["parameters"][-1]["setpoint.algorithm"] == "hold"
    description = nodes["robot_state_publisher"]["parameters"][0]["robot_description"]
    wanted = "position" if controller in ("winch_position", "winch_trajectory") else "velocity"
    assert f'<command_interface name="{wanted}"/>' in description.value and description.value_type is str
    assert ">/tow_b/winch/command<" in description.value and ">/tow_sim/" not in description.value
    manager = nodes["ros2_control_node"]
    assert manager["parameters"][1] == {"use_sim_time": True} and "name" not in manager, "for every node of the process"
    (handler,) = [a.given[0] for a in actions if isinstance(a, RegisterEventHandler)]
    waiting = handler.named["target_action"]
    assert waiting in actions and "/tow_b/winch/state" in waiting.named["cmd"]
    (said,) = handler.named["on_exit"](SimpleNamespace(returncode=1), None)
    assert isinstance(said, LogInfo), "no state came: nothing is spawned"
    first, second = handler.named["on_exit"](SimpleNamespace(returncode=0), None)
    assert first.named["arguments"][0] == "joint_state_broadcaster"
    names = second.named["arguments"][: second.named["arguments"].index("--param-file")]
    assert controller in names and set(names) <= {*TYPES, "--activate-as-group"}
    assert ("--activate-as-group" in names) == (len(names) > 2) == (controller == "winch_trajectory_pid")
    with pytest.raises(RuntimeError) as error:
        file("ros2_control", set()).actions(controller=controller)
    kinds = {TYPES[name].partition("/")[0] for name in [*names, "joint_state_broadcaster"] if name in TYPES}
    asked = set(re.search(r"needs (.*), not installed", str(error.value)).group(1).split(", "))
    assert asked == kinds | {"controller_manager", "robot_state_publisher", "joint_state_topic_hardware_interface"}


@pytest.mark.skipif(not REAL, reason="launch_ros is not installed")
@pytest.mark.parametrize("name", OWN)
def test_the_real_launch_makes_the_same_description(name):
    """In a process of its own, as the stand-in takes the place of the package here. Nothing is executed."""
    script = f"""
import runpy, launch
description = runpy.run_path({str(FOLDER / name) + ".launch.py"!r})["generate_launch_description"]()
print(*[action.name for action in description.get_launch_arguments()])
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=600, cwd="/")
    assert done.returncode == 0, done.stderr
    assert set(done.stdout.split()) == COMMON | OWN[name]
