"""The nodes of a test from sample to command: does each hear the others, and did all they sent count at its time?

What is sent to a listener that is known of, but not yet connected, is lost to it alone; so nothing is sent before both
ends say that they are connected. Between two processes of the test that is theirs to look at: docs/lockstep.md.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rcl_interfaces.msg import ParameterEvent
from rcl_interfaces.srv import GetParameters, SetParameters
from rclpy.parameter import Parameter
from rclpy.time import Time

from ..errors import TowError
from ..io.messages.messages import COMMANDED, KINDS
from ..ros.client import NAMESPACE, Client
from .arguments import COMMAND

WINCH = tuple(KINDS[kind][1] for kind in COMMANDED)
NODE = f"{NAMESPACE}/cable_sim"
SEEN = (("command", "publishers"), ("neighbours", "nodes"))  # where the node says what it is connected to
SETTLE = 0.3  # s: the other end may learn of ours a little later than we of it
PEERS = 3.5  # s: between two processes of the test nobody sees it; Fast DDS says every 3 s again that one is there
ROUNDS = 10  # answers of every node of a chain, in which its threads that learn of the others came to run too
LOOK = 0.05  # s
EVENTS = "/parameter_events"
CLOCK = 60_000_000_000  # ns; a stamp further off is of another clock
ANSWER = 5.0  # s that a node may take to answer a service; one that nobody spins does not


class Chain:
    """What the processes of a test publish, and who hears it.

    publishers: ours, by kind; clock(): what /clock says, ns, None: nothing.
    """

    def __init__(self, client: Client, publishers: Mapping[str, Any], clock: Callable[[], int | None]) -> None:
        self.client, self._publishers, self._clock = client, publishers, clock
        self._events = client.listen(ParameterEvent, EVENTS)
        self._links: dict[str, str] = {}  # topic -> process
        self._before: dict[str, int] = {}
        self._before_nodes: set[str] = set()
        self._answering: set[str] = set()  # nodes of the processes that answer services

    def _count(self, topic: str) -> int:
        """Publishers beside our own; any topic of commands stands for all of them."""
        names = WINCH if topic in WINCH else (topic,)
        return sum(self.client.others_on(absolute(name)) for name in names)

    def comes(self, topics: Sequence[str]) -> None:
        """A process is about to start that will publish these topics."""
        self._before = {topic: self._count(topic) for topic in topics}
        self._before_nodes = self._names()

    def missing(self) -> list[str]:
        """Topics that it does not publish yet."""
        return [topic for topic, before in self._before.items() if self._count(topic) <= before]

    def came(self, name: str, within: float, check: Callable[[], None]) -> None:
        """It does: let it, the node and our motion learn of each other. TowError where that does not happen within so
        many seconds."""
        self._links |= dict.fromkeys(self._before, name)
        came = self._round(self._names() - self._before_nodes)
        self._answering |= came
        for node in sorted(came):
            self._hears_clock(node)
        deadline = time.monotonic() + within
        while problem := self._apart():
            check()
            if time.monotonic() > deadline:
                raise TowError(f"{problem}, within {within:g} s after {name} came: do reliability and durability fit?")
            time.sleep(0.01)
        for _ in range(ROUNDS):
            self._round({NODE, *self._answering & self._names()})
        time.sleep(PEERS if len(self._answering & self._names()) > 1 else SETTLE)

    def _apart(self) -> str:
        """ "" or which two ends know of each other and are not connected, as far as we and the node can say."""
        found = self.client.diagnostics()
        heard, known = (int(found.get(task, (0, "", {}))[2].get(key, 0)) for task, key in SEEN)
        commanders = sum(self.client.node.count_publishers(absolute(topic)) for topic in WINCH)
        if heard < commanders:
            return f"the node is connected to {heard} of {commanders} publishers of {COMMAND}"
        if known < len(self._names()):
            return f"the node knows {known} of {len(self._names())} nodes"
        for made in self._publishers.values():
            if made.get_subscription_count() < (known := self.client.node.count_subscribers(made.topic_name)):
                return f"{made.topic_name} is connected to {made.get_subscription_count()} of {known} subscribers"
        return ""

    def _names(self) -> set[str]:
        found = self.client.node.get_node_names_and_namespaces()
        return {f"{space.rstrip('/')}/{name}" for name, space in found}

    def _round(self, nodes: set[str]) -> set[str]:
        """Have an answer of each node; returns those that gave one.

        A node learns of our topics in the order in which we made them: one that knows the newest, that of a service,
        knows those of the motion.
        """
        answered = set()
        for node in sorted(nodes):
            service = f"{node}/get_parameters"
            if any(name == service for name, _ in self.client.node.get_service_names_and_types()):
                try:
                    self.client.call(GetParameters, service, GetParameters.Request(names=["use_sim_time"]), ANSWER)
                    answered.add(node)
                except TowError:
                    self.client.check()
                    self.client.give_up()  # raises where a process has ended; one that is not spun is let be
        return answered

    def _hears_clock(self, node: str) -> None:
        """Wait until a node with use_sim_time has heard the clock, and so is connected to others than us: it stamps the
        event of a parameter, here of use_sim_time set to what it is, by its clock. One that says nothing is let be."""
        name, deadline = [Parameter("use_sim_time", value=True).to_parameter_msg()], time.monotonic() + ANSWER
        request = GetParameters.Request(names=["use_sim_time"])
        values = self.client.call(GetParameters, f"{node}/get_parameters", request, ANSWER).values
        if self._clock() is None or not values or not values[0].bool_value:
            return
        while time.monotonic() < deadline:
            self.client.call(SetParameters, f"{node}/set_parameters", SetParameters.Request(parameters=name), ANSWER)
            time.sleep(LOOK)
            now = self._clock() or 0
            stamps = (Time.from_msg(event.stamp).nanoseconds for event in self._events if event.node == node)
            if any(0 < stamp and abs(stamp - now) < CLOCK for stamp in stamps):
                return

    def closed(self) -> str:
        """ "" or what of the chain nobody hears: where a name is wrong the rest of the chain stands still."""
        for topic, name in self._links.items():
            if not self.client.node.count_subscribers(absolute(topic)):
                return (
                    f"nobody subscribes to {absolute(topic)}, which {name} publishes: nothing was stepped; is it "
                    f"remapped, or did a node of the chain not start? publishes names only what is to be heard"
                )
        return ""


def absolute(topic: str) -> str:
    """A topic's name from the root; relative ones are those of the node."""
    return topic if topic.startswith("/") else f"{NAMESPACE}/{topic}"
