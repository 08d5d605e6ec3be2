"""The node: ros2 launch cable_sim_ros node.launch.py scene:=side_scan

The other launch files of this folder take what they share from here; none imports cable_sim_ros, whose environment the
Python of `ros2 launch` need not be.
"""

import os
from pathlib import Path

from ament_index_python.packages import PackageNotFoundError, get_package_prefix
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

CONFIG = Path(__file__).parents[1] / "config"
NAMESPACE = "/tow_sim"  # of the files in config
ARGUMENTS = {  # name -> default, description
    "scene": ("", "Name or path of a scene; empty: that of params_file, else full_scale"),
    "namespace": (NAMESPACE, "Of the node and of its topics"),
    "use_sim_time": ("false", "true: lockstep, the node publishes /clock, and what starts beside it follows it"),
    "params_file": ("", "YAML file of parameters of the node; arguments given here stand above it"),
}


def declared(more=None):
    """Actions that declare the arguments, and others of a file: name -> default, description."""
    rows = ARGUMENTS | (more or {})
    return [
        DeclareLaunchArgument(name, default_value=default, description=text) for name, (default, text) in rows.items()
    ]


def value(context, name):
    """Text of an argument."""
    return LaunchConfiguration(name).perform(context)


def flag(context, name):
    """True or false of an argument; RuntimeError for any other text."""
    text = value(context, name)
    if text.lower() not in ("true", "false"):
        raise RuntimeError(f"{name}:={text} is neither true nor false: nothing was started")
    return text.lower() == "true"


def namespace(context):
    """Namespace with a slash in front and none behind; "" for the root."""
    name = value(context, "namespace").strip("/")
    return f"/{name}" if name else ""


def need(file, *packages):
    """RuntimeError with what to install where a package is not there; before anything is started."""
    missing = []
    for package in packages:
        try:
            get_package_prefix(package)
        except PackageNotFoundError:
            missing.append(package)
    if missing:
        distribution = os.environ.get("ROS_DISTRO", "<distribution>")
        names = " ".join(f"ros-{distribution}-{package.replace('_', '-')}" for package in missing)
        raise RuntimeError(
            f"{file} needs {', '.join(missing)}, not installed: nothing was started; sudo apt install {names}, or "
            f"start the node alone: ros2 launch cable_sim_ros node.launch.py"
        )


def node(context, **fixed):
    """The simulator; fixed: parameters of a launch file's own, above all others."""
    given = dict(fixed)
    if scene := value(context, "scene"):
        given["scene"] = scene
    if flag(context, "use_sim_time"):
        given["time_mode"] = "lockstep"
    file = value(context, "params_file")
    if file and not Path(file).is_file():
        raise RuntimeError(f"params_file:={file} is no file: nothing was started")
    return Node(
        package="cable_sim_ros",
        executable="node",
        name="cable_sim",  # so that what is given here is written for this name, and stands above params_file
        namespace=namespace(context) or "/",
        parameters=[*([file] if file else []), *([given] if given else [])],
        output="screen",
    )


def generate_launch_description():
    """Entry point of ros2 launch."""
    return LaunchDescription([*declared(), OpaqueFunction(function=lambda context: [node(context)])])
