"""config/ros2_control: the files parse, their names are those of the node, and their parameters are declared there."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from hardware_component import INTERFACES, of_urdf

from cable_sim_ros.io.messages.channels import CHANNELS
from cable_sim_ros.io.messages.messages import DRUM, JOINT, KINDS

pytestmark = pytest.mark.check

FILES = Path(__file__).resolve().parents[2] / "config" / "ros2_control"
URDFS = {"winch_velocity.urdf": "velocity", "winch_position.urdf": "position"}
NAMESPACE = "/tow_sim"  # of the node, unless set

GAINS = (
    "p i d i_clamp_max i_clamp_min u_clamp_max u_clamp_min antiwindup_strategy tracking_time_constant error_deadband"
)

# Declarations that were read: of ros2_control 4.46.0 and ros2_controllers 4.42.1 (Jazzy); each name is declared in
# Kilted (5.16, 5.17) and Rolling (6.8, 6.9) too. "<joint>" stands for __map_joints and __map_dof_names.
DECLARED = {
    "controller_manager": (
        "controller_manager/src/controller_manager_parameters.yaml",
        {"update_rate", "enforce_command_limits", "handle_exceptions", "overruns.print_warnings"},
    ),
    "joint_state_broadcaster/JointStateBroadcaster": (
        "joint_state_broadcaster/src/joint_state_broadcaster_parameters.yaml",
        {"joints", "interfaces", "extra_joints", "use_local_topics", "use_urdf_to_filter", "frame_id"},
    ),
    **dict.fromkeys(  # both are a ForwardCommandController with its interface set
        ("velocity_controllers/JointGroupVelocityController", "position_controllers/JointGroupPositionController"),
        ("forward_command_controller/src/forward_command_controller_parameters.yaml", {"joints", "interface_name"}),
    ),
    "joint_trajectory_controller/JointTrajectoryController": (
        "joint_trajectory_controller/src/joint_trajectory_controller_parameters.yaml",
        {
            *("joints", "command_joints", "command_interfaces", "state_interfaces", "cmd_timeout"),
            *("allow_partial_joints_goal", "allow_integration_in_goal_trajectories", "interpolation_method"),
            *("allow_nonzero_velocity_at_trajectory_end", "action_monitor_rate", "interpolate_from_desired_state"),
            "set_last_command_interface_value_as_state_on_activation",
            *("constraints.stopped_velocity_tolerance", "constraints.goal_time", "constraints.decelerate_on_cancel"),
            *(f"constraints.<joint>.{key}" for key in ("trajectory", "goal", "max_deceleration_on_cancel")),
            *(f"gains.<joint>.{key}" for key in f"{GAINS} ff_velocity_scale".split()),
        },
    ),
    "pid_controller/PidController": (
        "pid_controller/src/pid_controller.yaml",
        {
            *("dof_names", "reference_and_state_dof_names", "command_interface", "reference_and_state_interfaces"),
            *("set_current_state_as_first_setpoint", "use_external_measured_states"),
            *(f"gains.<joint>.{key}" for key in f"{GAINS} feedforward_gain angle_wraparound save_i_term".split()),
        },
    ),
}
# of joint_state_topic_hardware_interface 1.1.0, on_init(); component_parser.cpp for the tags
HARDWARE = {
    *("joint_commands_topic", "joint_states_topic", "trigger_joint_command_threshold", "sum_wrapped_joint_states")
}


def parameters() -> dict[str, dict]:
    document = yaml.safe_load((FILES / "controllers.yaml").read_text("utf-8"))
    assert all(set(node) == {"ros__parameters"} for node in document.values())
    return {name: node["ros__parameters"] for name, node in document.items()}


def types() -> dict[str, str]:
    """Controller -> type, as the controller manager finds it: <name>.type."""
    manager = parameters()["controller_manager"]
    return {name: value["type"] for name, value in manager.items() if isinstance(value, dict)}


def flat(values: dict, joint: str, before: str = ""):
    for key, value in values.items():
        name = before + ("<joint>" if key == joint and before else key)
        if isinstance(value, dict):
            yield from flat(value, joint, f"{name}.")
        else:
            yield name


@pytest.mark.parametrize("name", URDFS)
def test_a_urdf_has_the_names_of_the_node(name):
    it = of_urdf(FILES / name)
    assert it.commands_topic == f"{NAMESPACE}/{KINDS['command'][1]}"
    assert it.states_topic == f"{NAMESPACE}/winch/state" and "winch/state" in {c.topic for c in CHANNELS}
    assert it.threshold < 0.0, "what is equal is sent too"
    assert list(it.joints) == [JOINT, DRUM]
    assert it.joints[JOINT].commands == (URDFS[name],) and it.joints[DRUM].commands == ()
    assert all(joint.states == INTERFACES for joint in it.joints.values()), "one left out is an exception there"


@pytest.mark.parametrize("name", URDFS)
def test_a_urdf_can_be_given_as_a_parameter_on_a_command_line(name):
    """-p name:=value is read as YAML, in which a colon before a space, or a space before a hash, ends a text."""
    text = (FILES / name).read_text("utf-8")
    assert yaml.safe_load(text).split() == text.split()


@pytest.mark.parametrize("name", URDFS)
def test_a_urdf_is_a_tree_whose_joints_have_what_urdf_asks_of_them(name):
    from xml.etree import ElementTree

    robot = ElementTree.parse(FILES / name).getroot()
    links = {link.get("name") for link in robot.findall("link")}
    children = [joint.find("child").get("link") for joint in robot.findall("joint")]
    assert len(links - set(children)) == 1 and len(set(children)) == len(children) and set(children) <= links
    assert {joint.find("parent").get("link") for joint in robot.findall("joint")} <= links
    limited = [joint for joint in robot.findall("joint") if joint.get("type") == "prismatic"]
    assert all({"lower", "upper", "velocity", "effort"} == set(joint.find("limit").attrib) for joint in limited)
    given = {p.get("name") for p in robot.findall("ros2_control/hardware/param")}
    assert given <= HARDWARE and not {p.text for p in robot.iter("param")} & {None, ""}
    plugin = robot.find("ros2_control/hardware/plugin").text
    assert plugin == "joint_state_topic_hardware_interface/JointStateTopicSystem"


def test_every_parameter_is_declared_in_the_source_of_its_controller():
    given, kinds = parameters(), types()
    assert set(given) == set(kinds) - {"joint_state_broadcaster"} | {"controller_manager"}
    manager = {key for key, value in given.pop("controller_manager").items() if not isinstance(value, dict)}
    assert manager <= DECLARED["controller_manager"][1]
    for name, values in given.items():
        source, declared = DECLARED[kinds[name]]
        assert set(flat(values, JOINT)) <= declared, f"{name}: not in {source}"


def test_every_controller_finds_its_interfaces_in_one_of_the_urdfs():
    kinds, given = types(), parameters()
    offered = {}
    for urdf in URDFS:
        it = of_urdf(FILES / urdf)
        offered[urdf] = set(it.command)
    for name, values in given.items():
        states = {f"{JOINT}/{i}" for i in values.get("state_interfaces", [])}
        states |= {f"{JOINT}/{i}" for i in values.get("reference_and_state_interfaces", [])}
        assert states <= set(it.state)
        wanted = commanded(name, kinds.get(name, ""), values)
        urdf = "winch_position.urdf" if name in ("winch_position", "winch_trajectory") else "winch_velocity.urdf"
        exported = {f"winch_pid/{key}" for key in (f"{JOINT}/position",)} if "velocity" in urdf else set()
        assert wanted <= offered[urdf] | exported, name


def commanded(name: str, kind: str, values: dict) -> set[str]:
    """command_interface_configuration() of the controllers."""
    if kind.endswith("JointTrajectoryController"):
        joints = values.get("command_joints", values["joints"])
        return {f"{joint}/{i}" for joint in joints for i in values["command_interfaces"]}
    if kind.endswith("PidController"):
        return {f"{joint}/{values['command_interface']}" for joint in values["dof_names"]}
    if kind:
        interface = "velocity" if "Velocity" in kind else "position"
        return {f"{joint}/{interface}" for joint in values["joints"]}
    return set()


def test_a_cycle_of_the_controller_manager_is_a_whole_number_of_ticks():
    period = 1.0 / parameters()["controller_manager"]["update_rate"]
    assert period / 0.01 == pytest.approx(round(period / 0.01), abs=1e-9)


def test_the_page_starts_a_node_that_does_not_compensate_beside_the_controllers():
    page = (FILES.parents[1] / "docs" / "ros2_control.md").read_text("utf-8")
    lines = [line for line in page.splitlines() if line.startswith("ros2 run cable_sim_ros node")]
    assert lines and all("-p setpoint.algorithm:=hold " in line for line in lines)
