"""Who else is on our topics: foreign publishers on an output, a second node of our name, two senders of one input."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence

EVERY = 0.15  # s between two queries of the graph: a round of all topics takes two seconds
UNKNOWN = "a participant without a ROS node"


def full_name(name: str, namespace: str) -> str:
    """As in `ros2 node list`."""
    if name.startswith("_NODE_NAME_UNKNOWN_") or not name:
        return UNKNOWN
    return f"{namespace.rstrip('/')}/{name}"


Publishers = Mapping[str, Sequence[str]]  # full names of their nodes by topic, one each


def judge(
    own: str, names: Iterable[str], outputs: Publishers, inputs: Publishers, one: Collection[str] = ()
) -> list[str]:
    """What is wrong, one text each, in a fixed order.

    own: our full name; names: full names of all nodes; outputs, inputs: every publisher found on our topics, our own
    among them; one: topics that are one input, so that a node may be on several of them, but not two nodes.
    """
    problems = []
    twins = list(names).count(own)
    if twins > 1:
        problems.append(
            f"{twins} nodes have the name {own}: services, parameters and topics answer for one or the other; end one, "
            f"or start it with -r __ns:=/other"
        )
    for topic, nodes in sorted(outputs.items()):
        foreign = sorted({node for node in nodes if node != own})
        if nodes.count(own) > 1 and twins <= 1:
            foreign.append(f"another endpoint named {own}")
        if foreign:
            problems.append(
                f"{topic} is also published by {', '.join(foreign)}: what is heard there is not only from this "
                f"simulation; end it, or start this node with -r __ns:=/other"
            )
    for topic, nodes in sorted(inputs.items()):
        if len(nodes) > 1:
            problems.append(
                f"{topic} has {len(nodes)} publishers ({', '.join(sorted(nodes))}): the newest message counts, "
                f"whoever sent it; leave one"
            )
    used = sorted(topic for topic, nodes in inputs.items() if nodes and topic in one)
    several = sorted({node for topic in used for node in inputs[topic]})
    if len(several) > 1 and len(used) > 1:
        problems.append(
            f"{' and '.join(used)} are one input and have {len(several)} senders ({', '.join(several)}): the newest "
            f"message counts, whoever sent it; leave one"
        )
    return problems


class Neighbours:
    """Looks at the graph of a node, a topic at a time; `problems` has what the newest round found."""

    def __init__(self, node) -> None:
        self.node = node
        self.own = full_name(node.get_name(), node.get_namespace())
        self.problems: list[str] = []
        self._known: set[str] = set()
        self._left: list[str] = []
        self._found: dict[str, list[str]] = {}

    def step(self, outputs: Sequence[str], inputs: Sequence[str], one: Collection[str] = ()) -> list[str]:
        """Query one topic (about a millisecond); at the end of a round, returns problems never seen before.

        one: as of `judge`.
        """
        if not self._left:
            self._left = [*outputs, *inputs]
            self._found = {}
        topic = self._left.pop()
        ends = self.node.get_publishers_info_by_topic(topic)
        self._found[topic] = [full_name(end.node_name, end.node_namespace) for end in ends]
        if self._left:
            return []
        names = [full_name(name, space) for name, space in self.node.get_node_names_and_namespaces()]
        report, sent = ({topic: self._found.get(topic, []) for topic in topics} for topics in (outputs, inputs))
        self.problems = judge(self.own, names, report, sent, one)
        new = [problem for problem in self.problems if problem not in self._known]
        self._known.update(new)
        return new
