"""The node and foxglove_bridge: ros2 launch cable_sim_ros foxglove.launch.py"""

import runpy
from pathlib import Path

from launch import LaunchDescription
from launch.actions import LogInfo, OpaqueFunction
from launch_ros.actions import Node

BASE = runpy.run_path(str(Path(__file__).with_name("node.launch.py")))
ARGUMENTS = {
    "port": ("8765", "Of the bridge's WebSocket"),
    "address": (
        "127.0.0.1",
        "That the bridge listens on; 0.0.0.0: every host that reaches this one may watch and command",
    ),
}


def start(context):
    """The actions; RuntimeError where foxglove_bridge is not there."""
    BASE["need"]("foxglove.launch.py", "foxglove_bridge")
    port, address = (BASE["value"](context, name) for name in ARGUMENTS)
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise RuntimeError(f"port:={port} is no number from 1 to 65535: nothing was started")
    bridge = Node(
        package="foxglove_bridge",
        executable="foxglove_bridge",
        parameters=[{"port": int(port), "address": address, "use_sim_time": BASE["flag"](context, "use_sim_time")}],
        output="screen",
    )
    layout = BASE["CONFIG"] / "foxglove" / "tow.json"
    return [BASE["node"](context), bridge, LogInfo(msg=f"Foxglove: ws://{address}:{port}, layout {layout}")]


def generate_launch_description():
    """Entry point of ros2 launch."""
    return LaunchDescription([*BASE["declared"](ARGUMENTS), OpaqueFunction(function=start)])
