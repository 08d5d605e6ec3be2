"""The node and RViz with its layout of the tow: ros2 launch cable_sim_ros rviz.launch.py"""

import runpy
import tempfile
from pathlib import Path

from launch import LaunchDescription
from launch.actions import OpaqueFunction
from launch_ros.actions import Node

BASE = runpy.run_path(str(Path(__file__).with_name("node.launch.py")))
LAYOUT = BASE["CONFIG"] / "rviz" / "tow.rviz"
ARGUMENTS = {"layout": (str(LAYOUT), "File of RViz; empty: none")}


def layout(context):
    """File of the layout, "" for none; where it is the shipped one for another namespace a copy for that."""
    file, space = BASE["value"](context, "layout"), BASE["namespace"](context)
    if file != str(LAYOUT) or space == BASE["NAMESPACE"]:
        return file
    with tempfile.NamedTemporaryFile("w", prefix="tow_", suffix=".rviz", delete=False, encoding="utf-8") as copy:
        copy.write(LAYOUT.read_text("utf-8").replace(f"{BASE['NAMESPACE']}/", f"{space}/"))
    return copy.name


def start(context):
    """The actions; RuntimeError where rviz2 is not there."""
    BASE["need"]("rviz.launch.py", "rviz2")
    file, space = layout(context), BASE["namespace"](context)
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", file] if file else [],
        remappings=[(name, f"{space}{name}") for name in ("/tf", "/tf_static")],
        parameters=[{"use_sim_time": BASE["flag"](context, "use_sim_time")}],
    )
    return [BASE["node"](context), rviz]


def generate_launch_description():
    """Entry point of ros2 launch."""
    return LaunchDescription([*BASE["declared"](ARGUMENTS), OpaqueFunction(function=start)])
