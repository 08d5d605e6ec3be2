"""What is not known of a tow, declared once: half-widths of 95 % intervals, independent of each other."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

from ...errors import CableSimError
from ...physics.parameter import Block, declared, quantity
from ...sim.scene import Scene

LEAST_FACTOR, MOST_FACTOR = 0.1, 10.0  # of cable.sections.<name>.drag_amplification

B = TypeVar("B", bound=Block)


class Ranges(Block):
    """Half-widths of the 95 % intervals of what a layback hangs on."""

    drag: float = quantity(
        0.2,
        "1",
        0.0,
        0.8,
        "share of the drag of cable and towbody",
        "choice: measured C_D of bare tow cables are 2.2 to 2.5, of calm ones 1.2 to 1.5 (docs/drag.md)",
    )
    speed: float = quantity(0.1, "m/s", 0.0, 3.0, "speed of the ship along its course", "choice: 0.2 kn")
    current: float = quantity(
        0.1, "m/s", 0.0, 3.0, "either horizontal component of a current that the scene does not have", "choice: 0.2 kn"
    )
    current_turn_deg: float = quantity(15.0, "deg", 0.0, 180.0, "direction of the current of the scene", "choice")
    payout: float = quantity(
        0.0, "m", 0.0, 1000.0, "cable out, as the counter shows it", "choice: the counter is taken as exact"
    )


class RangeError(CableSimError):
    """A range on the command line that cannot be."""


def ranges_of(words: Iterable[str], block: type[B]) -> tuple[B, list[str]]:
    """A Block of half-widths from words KEY=VALUE, and what it assumes, a line each. Raises RangeError."""
    rows, values = {row.key: row for row in declared(block)}, {}
    for word in words:
        key, _, text = word.partition("=")
        if key not in rows:
            raise RangeError(
                f"--range {word}: there is no range '{key}'; nothing was simulated. Known: {', '.join(rows)}"
            )
        try:
            values[key] = float(text)
            block(**{key: values[key]})
        except ValueError:  # also pydantic's
            row = rows[key]
            raise RangeError(
                f"--range {word}: '{text}' is no number in {row.interval} {row.unit} ({row.doc}); nothing was "
                f"simulated. Give the half-width of the 95 % interval"
            ) from None
    return (ranges := block(**values)), assumed(ranges, set(values))


def assumed(ranges: Block, chosen: set[str] | None = None) -> list[str]:
    """A line for each range with its size; chosen: those that a user chose are left out, of the others the option."""
    lines = []
    for row in declared(type(ranges)):
        if row.key not in (chosen or ()):
            unit = "" if row.unit == "1" else f" {row.unit}"
            how = "(95 %, normal)" if chosen is None else f"(95 %); --range {row.key}="
            lines.append(f"assumed: {row.doc} is within {getattr(ranges, row.key):g}{unit} {how}")
    return lines


def with_drag(scene: Scene, factor: float) -> Scene:
    """The scene with ``factor`` times the drag of its cable, as drag_amplification takes it, and of its towbody."""
    if factor == 1.0:
        return scene
    sections = {
        name: section.model_copy(
            update={"drag_amplification": min(max(factor * section.drag_amplification, LEAST_FACTOR), MOST_FACTOR)}
        )
        for name, section in scene.cable.sections.items()
    }
    body = scene.towbody.model_copy(update={"drag_area": tuple(factor * area for area in scene.towbody.drag_area)})
    return scene.model_copy(update={"cable": scene.cable.model_copy(update={"sections": sections}), "towbody": body})
