"""Parts of the node that a tool adds: parameters under a name of their own, and what acts on them while it runs.

Beside them one task of /diagnostics, and numbers in its text.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

from ..extensions import NODE_PARTS, ExtensionError, found, load, package_of
from ..physics.parameter import Block, choice
from ..sim.scene import Scene

OK, WARN, ERROR = 0, 1, 2


class Status(NamedTuple):
    """One task: name, level, a sentence, and figures as text."""

    name: str
    level: int
    message: str
    values: dict[str, str]


def text_of(number: float) -> str:
    """Three decimals; "-" where there is no number."""
    return "-" if math.isnan(number) else f"{number:.3f}"


class NodePart:
    """What one tool adds. The class is imported with the parameters of the node; import rclpy and what takes long when
    it starts. Raise a CableSimError where it cannot: nothing runs then."""

    block: ClassVar[type[Block]]  # its parameters
    doc: ClassVar[str]  # what they are, for the manual

    def __init__(self, node: Any, block: Any) -> None:
        """Start it on a CableSimNode that has its parameters, and no session yet; `asked` was true."""

    @staticmethod
    def asked(block: Any) -> bool:
        """Do these parameters ask for it at all? Without a word of its own: yes, wherever it is installed."""
        return True

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


def unfit(part: Any) -> str:
    """ "" or why what was loaded is no part of a node."""
    if not (isinstance(part, type) and issubclass(part, NodePart)):
        return "is no subclass of cable_sim_ros.ros.parts.NodePart"
    if not (isinstance(block := getattr(part, "block", None), type) and issubclass(block, Block)):
        return "its block is no cable_sim_ros.physics.parameter.Block"
    return "" if isinstance(getattr(part, "doc", None), str) else "its doc is no text"


PARTS: dict[str, type[NodePart]] = {name: load(points, unfit) for name, points in sorted(found(NODE_PARTS).items())}


def with_parts(block: type[Block]) -> type[Block]:
    """A Block with the parameters of the parts beside its own. Raises ExtensionError where a part has the name of a
    parameter or group that there is."""
    for name in PARTS:
        if not name.isidentifier() or name in block.model_fields or name in Scene.model_fields:
            packages = " and ".join(map(package_of, found(NODE_PARTS)[name]))
            raise ExtensionError(
                f"{name} of {NODE_PARTS}, offered by {packages}, is no name for a group of parameters, or one that "
                f"scene or node have: its parameters could not be told apart; nothing was started. Uninstall that "
                f"package, or have it renamed"
            )
    fields = {name: choice(part.block(), part.doc) for name, part in PARTS.items()}
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
