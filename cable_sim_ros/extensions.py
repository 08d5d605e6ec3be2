"""What stands beside the core, found by the entry points of what is installed: docs/extending.md#a-tool.

The core asks for a group by its name here and knows no tool; a package of its own adds to it in the same way.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from importlib.util import find_spec
from typing import Any

from .errors import CableSimError

COMMANDS = "cable_sim.commands"  # name of the command -> click.Command
NODE_PARTS = "cable_sim.node_parts"  # name of a group of parameters of the node -> NodePart (ros/parts.py)
PAGES = "cable_sim.pages"  # page of `cable-sim manual` -> function that gives its text
CHECKOUT = "verification"  # package that stands beside the product, in no wheel
RUN_PARTS = "cable_sim.run_parts"  # report: --report of what simulates; scores: --limits of replay -> module


class ExtensionError(CableSimError):
    """What an installed package offers cannot be used; the text names it, the package, why, and the remedy."""


def _here(point: EntryPoint) -> bool:
    return point.module.partition(".")[0] != CHECKOUT or find_spec(CHECKOUT) is not None


@cache
def found(group: str) -> dict[str, tuple[EntryPoint, ...]]:
    """Entry points of a group by name, more than one where several packages offer it."""
    by_name: dict[str, tuple[EntryPoint, ...]] = {}
    for point in filter(_here, entry_points(group=group)):
        if point not in by_name.get(point.name, ()):
            by_name[point.name] = (*by_name.get(point.name, ()), point)
    return by_name


def absent(group: str) -> set[str]:
    """Names that a checkout offers, and no wheel."""
    return {point.name for point in entry_points(group=group) if not _here(point)}


def package_of(point: EntryPoint) -> str:
    """Name and version of the package that offers it."""
    return "an unnamed package" if point.dist is None else f"{point.dist.name} {point.dist.version}"


def load(points: tuple[EntryPoint, ...], fits: Callable[[Any], str] = lambda _: "") -> Any:
    """What one name stands for. Raises ExtensionError with the package and the reason.

    fits: "" or what is wrong with what was loaded.
    """
    point = points[0]
    if len(points) > 1:
        raise ExtensionError(
            f"{point.name} of {point.group} is offered by {' and by '.join(map(package_of, points))}: which is meant "
            f"is not known; nothing was started. Uninstall one of them"
        )
    try:
        made = point.load()
        why = fits(made)
    except Exception as error:
        made, why = None, repr(error)
    if why:
        raise ExtensionError(
            f"{point.name} of {point.group} cannot be used: {point.value} of {package_of(point)}: {why}; nothing was "
            f"started. Repair or uninstall that package"
        )
    return made


def part_of_a_run(name: str) -> Any:
    """The module of this name among RUN_PARTS, or None where none is installed."""
    points = found(RUN_PARTS).get(name)
    return None if points is None else load(points)
