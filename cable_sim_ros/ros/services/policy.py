"""The SROS2 policy of config/sros2/policy.xml against what a running node has on its graph."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

from ...io.messages.channels import SOMETIMES
from ...io.messages.messages import JOINT_COMMAND, KINDS, VEHICLES
from ...io.scenes.document import share_folder
from .simulation_interfaces import SERVICES, service_name

NODE, SPACE = "cable_sim", "/tow_sim"
FILE = Path("config", "sros2", "policy.xml")
# only where tf2_msgs, visualization_msgs, control_msgs or simulation_interfaces is installed, in lockstep (/clock), in
# some scenes, with fix.latitude
OPTIONAL = (
    {"/clock", f"{SPACE}/tf", f"{SPACE}/cable/markers", f"{SPACE}/towbody/fix"}
    | {f"{SPACE}/{topic}" for topic in ("towbody/fix/pose", "ensemble/towbody", "ensemble/band")}
    | {f"{SPACE}/{channel.topic}" for channel, _ in SOMETIMES}
    | {f"{SPACE}/{topic}" for msgtype, topic in KINDS.values() if msgtype == JOINT_COMMAND}
    | {f"{SPACE}/{KINDS[kind][1]}" for kind in (*VEHICLES, "flaps")}
    | {f"{SPACE}/{NODE}/{service_name(name)}" for name in SERVICES}
)


def rules(path: Path, name: str = NODE, space: str = SPACE) -> dict[str, set[str]]:
    """Absolute names by kind of permission ("topics publish", "services reply", ...) of one profile of a policy."""
    profile = next(
        found
        for found in ElementTree.parse(path).getroot().iter("profile")
        if (found.get("node"), found.get("ns")) == (name, space)
    )
    found: dict[str, set[str]] = {}
    for group in profile:
        for kind in ("publish", "subscribe", "reply", "request", "execute", "call"):
            if group.get(kind) == "ALLOW":
                names = found.setdefault(f"{group.tag} {kind}", set())
                names.update(absolute(str(item.text), name, space) for item in group)
    return found


def absolute(name: str, node: str, space: str) -> str:
    """Full name of a relative, private or absolute one."""
    if name.startswith("/"):
        return name
    return f"{space}/{node}/{name[2:]}" if name.startswith("~/") else f"{space}/{name}"


def differences(node, path: Path | None = None) -> list[str]:
    """What the policy allows and the running node has not, or the other way round; node: any on the same domain."""
    allowed = rules(path or share_folder() / FILE)
    there = {
        "topics publish": node.get_publisher_names_and_types_by_node(NODE, SPACE),
        "topics subscribe": node.get_subscriber_names_and_types_by_node(NODE, SPACE),
        "services reply": node.get_service_names_and_types_by_node(NODE, SPACE),
    }
    wrong = []
    for kind, pairs in there.items():
        names, permitted = {name for name, _ in pairs}, allowed.get(kind, set())
        wrong += [f"{kind}: {name} is not in the policy" for name in sorted(names - permitted)]
        wrong += [f"{kind}: {name} is allowed and not there" for name in sorted(permitted - names - OPTIONAL)]
    return wrong
