"""Parts of the node that a tool adds: parameters under a name of their own, and what acts on them while it runs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from ..extensions import NODE_PARTS, found, load
from ..physics.parameter import Block, quantity
from ..sim.scene import Scene
from .status import Status


class NodePart:
    """What one tool adds. The class is imported with the parameters of the node; import rclpy and what takes long when
    it starts. Raise a CableSimError where it cannot: nothing runs then."""

    block: ClassVar[type[Block]]  # its parameters
    doc: ClassVar[str]  # what they are, for the manual

    def __init__(self, node: Any, block: Any) -> None:
        """Start it on a CableSimNode that has its parameters, and no session yet; `asked` was true."""

    @staticmethod
    def asked(block: Any) -> bool:
        """Do these parameters ask for it at all?"""
        raise NotImplementedError

    @staticmethod
    def problem(block: Any, scene: Scene) -> str:
        """ "" or why these parameters cannot be used."""
        return ""

    tick: Callable[[Any], None] | None = None  # takes each tick output that was published, in the publisher's thread

    def statuses(self) -> list[Status]:
        """Its tasks of /diagnostics."""
        return []

    def metrics(self) -> dict[str, Any]:
        """Its final figures."""
        return {}

    def close(self) -> None:
        """Give up what it holds."""


PARTS: dict[str, type[NodePart]] = {name: load(point) for name, point in sorted(found(NODE_PARTS).items())}


def with_parts(block: type[Block]) -> type[Block]:
    """A Block with the parameters of the parts beside its own."""
    fields = {name: quantity(part.block(), "", None, None, part.doc) for name, part in PARTS.items()}
    kinds = {name: part.block for name, part in PARTS.items()}
    return type(
        block.__name__,
        (block,),
        {"__doc__": block.__doc__, "__module__": block.__module__, "__annotations__": kinds, **fields},
    )


def problem_of_parts(block: Any, scene: Scene) -> str:
    """ "" or the first reason why the parameters of a part cannot be used."""
    return next(filter(None, (part.problem(getattr(block, name), scene) for name, part in PARTS.items())), "")


def started(node: Any) -> list[NodePart]:
    """The parts that a CableSimNode is asked for, started; one that fails ends those before it."""
    running: list[NodePart] = []
    try:
        for name, part in PARTS.items():
            if part.asked(block := getattr(node.settings.node, name)):
                running.append(part(node, block))
    except BaseException:
        for one in running:
            one.close()
        raise
    return running
