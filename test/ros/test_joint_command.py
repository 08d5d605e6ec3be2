"""control_msgs/JointCommand on the wire, with type support made of the fields that are read; and where it is not."""

import json
import os
import sys
from types import SimpleNamespace

import pytest
import standard_package
from conftest import COMPILED, poll
from sensor_msgs.msg import JointState

from cable_sim_ros.io.bags.typestore import BESIDE, type_hash
from cable_sim_ros.io.messages.messages import COMMANDS, JOINT_COMMAND, KINDS, VEHICLES
from cable_sim_ros.io.sources.recorded_tow import read_motion
from cable_sim_ros.ros import topics
from cable_sim_ros.ros.services.policy import differences

PACKAGE, _, NAME = JOINT_COMMAND.split("/")


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Where the package is, importable while this file is tested."""
    definitions = tmp_path_factory.mktemp("definitions")
    (definitions / "msg").mkdir()
    text = "".join(f"{kind} {field}\n" for field, kind in BESIDE[JOINT_COMMAND])
    (definitions / "msg" / f"{NAME}.msg").write_text(text)
    path = standard_package.make(tmp_path_factory.mktemp("made"), definitions, PACKAGE)
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(str(path))
        yield path
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[name]


@COMPILED
@pytest.mark.skipif(bool(standard_package.why_not()), reason=standard_package.why_not())
def test_a_node_takes_both_messages_and_records_both(world, package):
    ears = world.ears()
    ears.listen(JointState, "winch/state")
    kind = topics.message_class(JOINT_COMMAND)
    senders = {name: ears.publisher(kind, KINDS[name][1]) for name in COMMANDS if KINDS[name][0] == JOINT_COMMAND}
    path = os.pathsep.join([str(package), world.environment["PYTHONPATH"]])
    node = world.node(environment={"PYTHONPATH": path}, recording__enabled=True, recording__root=str(world.folder))
    poll(lambda: all(its.get_subscription_count() for its in senders.values()), "the node to listen")
    world.ship(ears).sail()
    node.until("running")
    assert f"winch commands are heard as {JOINT_COMMAND} too" in node.text

    def values():
        return ears.task("command")[2]

    def sent(name, interface, value):
        senders[name].publish(kind(joint_names=["payout"], interface_name=interface, values=[value]))

    def rate():
        sent("command_velocity", "velocity", 0.5)
        return "0.5" in values().get("newest", "")

    poll(rate, "the rate", step=0.05)
    plain = ears.publisher(JointState, KINDS["command"][1])

    def other():
        sent("command_velocity", "acceleration", 1.0)
        plain.publish(JointState(name=["payout"], velocity=[0.25]))
        return "0.25" in values().get("newest", "") and "refused: interface" in values()

    poll(other, "the other message, and the refusal", step=0.05)

    def length():
        sent("command_position", "position", 3.0)
        return any(abs(message.position[0] - 3.0) < 0.01 for message in ears.received["winch/state"][-1:])

    poll(length, "the length", step=0.05)
    assert not [line for line in differences(ears.node) if "joint_command" in line or "winch/command" in line]
    node.stop()
    (bag,) = [found.parent for found in world.folder.rglob("metadata.yaml")]
    kinds = {found for _, found, _ in read_motion(bag)}
    assert kinds == set(KINDS) - {*VEHICLES, "flaps"}  # the scene has none
    made = json.loads((package.parent / "td" / PACKAGE / "msg" / f"{NAME}.json").read_text())["type_hashes"]
    assert {row["type_name"]: row["hash_string"] for row in made}[JOINT_COMMAND] == type_hash(JOINT_COMMAND)


def test_where_it_is_not_there_the_log_says_why(monkeypatch):
    """No control_msgs; one of an older distribution; one with other fields than those that are read."""
    found = topics.message_class

    def answer(made):
        def of(msgtype):
            return found(msgtype) if msgtype != JOINT_COMMAND else made()

        monkeypatch.setattr(topics, "message_class", of)
        return topics.inputs_there()

    def gone(error):
        raise error

    more = SimpleNamespace(get_fields_and_field_types=lambda: {"header": "", "names": "", "values": ""})
    for made, why in (
        (lambda: gone(ImportError()), "the package control_msgs is not installed"),
        (lambda: gone(AttributeError()), "the control_msgs installed has no JointCommand"),
        (lambda: more, "its fields are header, names, values, not header, joint_names, interface_name, values"),
    ):
        kinds, text = answer(made)
        assert set(kinds) == {"imu", "odometry", "command", "flaps", *VEHICLES}
        assert text.startswith("winch/joint_command/position and winch/joint_command/velocity are not heard: " + why)
        assert text.endswith("; winch/command is")
