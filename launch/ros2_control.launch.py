"""The node, a controller manager and one controller of config/ros2_control, as docs/ros2_control.md describes:
ros2 launch cable_sim_ros ros2_control.launch.py controller:=winch_velocity

Motion is not started: the controller is activated when the winch has a state, which it has with the first motion.
"""

import runpy
from pathlib import Path

from launch import LaunchDescription
from launch.actions import ExecuteProcess, LogInfo, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

BASE = runpy.run_path(str(Path(__file__).with_name("node.launch.py")))
FILES = BASE["CONFIG"] / "ros2_control"
CONTROLLERS = {  # argument -> URDF, controllers that are activated together, packages of their types
    "winch_velocity": ("winch_velocity.urdf", ["winch_velocity"], ["velocity_controllers"]),
    "winch_trajectory_velocity": (
        "winch_velocity.urdf",
        ["winch_trajectory_velocity"],
        ["joint_trajectory_controller"],
    ),
    "winch_pid": ("winch_velocity.urdf", ["winch_pid"], ["pid_controller"]),
    "winch_trajectory_pid": (
        "winch_velocity.urdf",
        ["winch_pid", "winch_trajectory_pid"],
        ["pid_controller", "joint_trajectory_controller"],
    ),
    "winch_position": ("winch_position.urdf", ["winch_position"], ["position_controllers"]),
    "winch_trajectory": ("winch_position.urdf", ["winch_trajectory"], ["joint_trajectory_controller"]),
}
PACKAGES = (
    "controller_manager",
    "robot_state_publisher",
    "joint_state_topic_hardware_interface",
    "joint_state_broadcaster",
)
ARGUMENTS = {"controller": ("winch_velocity", f"One of {', '.join(CONTROLLERS)}")}


def spawner(*arguments):
    """The controller manager's spawner."""
    return Node(
        package="controller_manager",
        executable="spawner",
        arguments=[*arguments, "--param-file", str(FILES / "controllers.yaml")],
        output="screen",
    )


def start(context):
    """The actions; RuntimeError for an unknown controller, or where a package is not there."""
    name = BASE["value"](context, "controller")
    if name not in CONTROLLERS:
        raise RuntimeError(f"controller:={name} is none of {', '.join(CONTROLLERS)}: nothing was started")
    urdf, together, packages = CONTROLLERS[name]
    BASE["need"]("ros2_control.launch.py", *PACKAGES, *packages)
    space, clock = BASE["namespace"](context), {"use_sim_time": BASE["flag"](context, "use_sim_time")}
    text = (FILES / urdf).read_text("utf-8").replace(f">{BASE['NAMESPACE']}/", f">{space}/")
    group = ["--activate-as-group"] if len(together) > 1 else []
    spawners = [spawner("joint_state_broadcaster"), spawner(*together, *group)]
    waiting = ExecuteProcess(
        cmd=["ros2", "topic", "echo", "--once", f"{space}/winch/state", "sensor_msgs/msg/JointState"], output="log"
    )

    def spawn(event, context):
        return (
            spawners if event.returncode == 0 else [LogInfo(msg="no state of the winch came: no controller was loaded")]
        )

    return [
        BASE["node"](context, **{"setpoint.algorithm": "hold"}),  # or compensation adds to what the controller commands
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            parameters=[{"robot_description": ParameterValue(text, value_type=str)} | clock],
        ),
        Node(  # without a name, so that the parameters reach every node of the process
            package="controller_manager",
            executable="ros2_control_node",
            parameters=[str(FILES / "controllers.yaml"), clock],
            output="screen",
        ),
        waiting,
        RegisterEventHandler(OnProcessExit(target_action=waiting, on_exit=spawn)),
        LogInfo(msg=f"waiting for {space}/winch/state, which comes with motion, as of cable-sim play nbp1406"),
    ]


def generate_launch_description():
    """Entry point of ros2 launch."""
    return LaunchDescription([*BASE["declared"](ARGUMENTS), OpaqueFunction(function=start)])
