"""Stand-in for the hardware component of ros2_control that speaks JointStates, joint_state_topic_hardware_interface.

What it sends and what it makes of what it hears, after the source of version 1.1.0 (d115f23) and, of ros2_control,
hardware_interface 4.46.0 (Jazzy); the functions are named where they are followed. Written anew, no code was taken.
"""

from __future__ import annotations

from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

INTERFACES = ("position", "velocity", "effort")  # of a JointState, in its order
THRESHOLD = 1e-5  # trigger_joint_command_threshold_ where the parameter is left out
COMMANDS, STATES = "/robot_joint_commands", "/robot_joint_states"  # on_init(): topics where they are left out


class Joint(NamedTuple):
    commands: tuple[str, ...]
    states: tuple[str, ...]


class Message(NamedTuple):
    """The fields of a JointState that are sent."""

    name: list[str]
    position: list[float]
    velocity: list[float]
    effort: list[float]


class Component:
    """One <ros2_control> of type system. Controllers write `command`, and find `state`: "joint/interface" -> number."""

    def __init__(self, joints: dict[str, Joint], parameters: dict[str, str] | None = None) -> None:
        given = parameters or {}
        self.joints = joints
        self.commands_topic = given.get("joint_commands_topic", COMMANDS)
        self.states_topic = given.get("joint_states_topic", STATES)
        self.threshold = float(given.get("trigger_joint_command_threshold", THRESHOLD))
        # handle.hpp: without initial_value a handle is NaN
        self.command = {f"{name}/{i}": nan for name, joint in joints.items() for i in joint.commands}
        self.state = {f"{name}/{i}": nan for name, joint in joints.items() for i in joint.states}

    def read(self, message) -> None:
        """JointStateTopicSystem::read(): takes what is finite, of the joints that it knows, by their names.

        A joint without a state interface for an array that has numbers is an exception there, and the component fails.
        """
        for index, name in enumerate(message.name):
            if name not in self.joints:
                continue
            for interface in INTERFACES:
                array = getattr(message, interface)
                if not len(array) or not isfinite(array[index]):
                    continue
                key, value = f"{name}/{interface}", float(array[index])
                if key not in self.state:
                    raise RuntimeError(f"state interface not found: {key}")
                self.state[key] = value

    def write(self) -> Message | None:
        """JointStateTopicSystem::write(), called in every cycle while the component is active; None: nothing is sent.

        The differences of all commands from their states are summed: NaN, before a controller wrote, is not at most the
        threshold, so it is sent. Every joint is named, those without a command interface too; entries are given for
        the command interfaces alone.
        """
        differences = (abs(self.state[key] - command) for key, command in self.command.items())
        if sum(differences) <= self.threshold:
            return None
        message = Message([], [], [], [])
        for name, joint in self.joints.items():
            message.name.append(name)
            for interface in joint.commands:
                getattr(message, interface).append(self.command[f"{name}/{interface}"])
        return message


def of_urdf(path: Path) -> Component:
    """The component of a URDF; parse_control_resources_from_urdf() of component_parser.cpp.

    A joint of <ros2_control> must be one of the robot, and not fixed.
    """
    robot = ElementTree.parse(path).getroot()
    assert robot.tag == "robot"
    (system,) = robot.findall("ros2_control")
    kinds = {joint.get("name"): joint.get("type") for joint in robot.findall("joint")}
    joints = {}
    for joint in system.findall("joint"):
        name = str(joint.get("name"))
        assert kinds.get(name, "fixed") != "fixed", f"joint '{name}' not found in URDF, or fixed"
        joints[name] = Joint(
            *(tuple(str(i.get("name")) for i in joint.findall(f"{k}_interface")) for k in ("command", "state"))
        )
    parameters = {str(p.get("name")): (p.text or "").strip() for p in system.findall("hardware/param")}
    return Component(joints, parameters)
