"""Who else is on our topics: foreign publishers on an output, a second node of our name, two senders of one input."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

EVERY = 2.0  # s between looks at the graph
UNKNOWN = "a participant without a ROS node"


class Endpoint(NamedTuple):
    """Name of a publisher's node with its namespace, and the topic."""

    node: str
    topic: str


def full_name(name: str, namespace: str) -> str:
    """As in `ros2 node list`."""
    if name.startswith("_NODE_NAME_UNKNOWN_") or not name:
        return UNKNOWN
    return f"{namespace.rstrip('/')}/{name}"


def judge(own: str, names: Iterable[str], outputs: Iterable[Endpoint], inputs: Iterable[Endpoint]) -> list[str]:
    """What is wrong, one text each, in a fixed order.

    own: our full name; names: full names of all nodes; outputs, inputs: every publisher found on our topics, our own
    among them.
    """
    problems = []
    twins = list(names).count(own)
    if twins > 1:
        problems.append(
            f"{twins} nodes have the name {own}: services, parameters and topics answer for one or the other; end one, "
            f"or start it with -r __ns:=/other"
        )
    by_topic: dict[str, list[str]] = {}
    for found in outputs:
        by_topic.setdefault(found.topic, []).append(found.node)
    for topic, nodes in sorted(by_topic.items()):
        foreign = sorted({node for node in nodes if node != own})
        if nodes.count(own) > 1 and twins <= 1:
            foreign.append(f"another endpoint named {own}")
        if foreign:
            problems.append(
                f"{topic} is also published by {', '.join(foreign)}: what is heard there is not only from this "
                f"simulation; end it, or start this node with -r __ns:=/other"
            )
    senders: dict[str, list[str]] = {}
    for found in inputs:
        senders.setdefault(found.topic, []).append(found.node)
    for topic, nodes in sorted(senders.items()):
        if len(nodes) > 1:
            problems.append(
                f"{topic} has {len(nodes)} publishers ({', '.join(sorted(nodes))}): the newest message counts, "
                f"whoever sent it; leave one"
            )
    return problems


class Neighbours:
    """Looks at the graph of a node; `problems` has what the newest look found."""

    def __init__(self, node) -> None:
        self.node = node
        self.own = full_name(node.get_name(), node.get_namespace())
        self.problems: list[str] = []
        self._known: set[str] = set()

    def look(self, outputs: Iterable[str], inputs: Iterable[str]) -> list[str]:
        """Query the graph (some tenths of a millisecond); returns the problems that were never seen before."""
        names = [full_name(name, space) for name, space in self.node.get_node_names_and_namespaces()]
        self.problems = judge(self.own, names, self._publishers(outputs), self._publishers(inputs))
        new = [problem for problem in self.problems if problem not in self._known]
        self._known.update(new)
        return new

    def _publishers(self, topics: Iterable[str]) -> list[Endpoint]:
        return [
            Endpoint(full_name(info.node_name, info.node_namespace), topic)
            for topic in topics
            for info in self.node.get_publishers_info_by_topic(topic)
        ]
