"""What stands beside the core, found by the entry points of what is installed: docs/extending.md#a-tool.

The core asks for a group by its name here and knows no tool; a package of its own adds to it in the same way.
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from typing import Any

from .errors import CableSimError

COMMANDS = "cable_sim.commands"  # name of the command -> click.Command
NODE_PARTS = "cable_sim.node_parts"  # name of a group of parameters of the node -> NodePart (ros/parts.py)
PAGES = "cable_sim.pages"  # page of `cable-sim manual` -> function that gives its text
OF_A_CHECKOUT = "verification"  # stands beside the product, in no wheel
RUN_PARTS = "cable_sim.run_parts"  # report: --report of what simulates; scores: --limits of replay -> module


class ExtensionError(CableSimError, ImportError):
    """What an installed package offers cannot be used; the text names it, the package, why, and the remedy."""


@cache
def found(group: str) -> dict[str, EntryPoint]:
    """Entry points of a group by name. Raises ExtensionError where two packages offer one name."""
    by_name: dict[str, EntryPoint] = {}
    checkout = find_spec(OF_A_CHECKOUT) is not None
    for point in entry_points(group=group):
        if point.module.partition(".")[0] == OF_A_CHECKOUT and not checkout:
            continue
        other = by_name.setdefault(point.name, point)
        if other.value != point.value:
            raise ExtensionError(
                f"{point.name} of {group} is offered by {package_of(other)} and by {package_of(point)}: which is meant "
                f"is not known; nothing was started. Uninstall one of them"
            )
    return by_name


def package_of(point: EntryPoint) -> str:
    """Name and version of the package that offers it."""
    return "an unnamed package" if point.dist is None else f"{point.dist.name} {point.dist.version}"


def load(point: EntryPoint) -> Any:
    """What an entry point stands for. Raises ExtensionError with the package and the reason."""
    try:
        return point.load()
    except Exception as error:
        raise ExtensionError(
            f"{point.name} of {point.group} cannot be loaded from {point.value} of {package_of(point)} ({error!r}); "
            f"nothing was started. Repair or uninstall that package"
        ) from error


def part_of_a_run(name: str) -> Any:
    """The module of this name among RUN_PARTS, or None where none is installed."""
    point = found(RUN_PARTS).get(name)
    return None if point is None else load(point)
