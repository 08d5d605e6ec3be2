"""What a command of the laboratory returns: its figures, with a table in Markdown beside them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from cable_sim_ros.cli.options import Answer
from cable_sim_ros.errors import CODE_OK
from cable_sim_ros.files import write_text
from cable_sim_ros.terminal import say


def with_table(
    name: str, figures: Any, text: str, out: Path | None, tell: Callable[[], None] | None = None, code: int = CODE_OK
) -> Answer:
    """An Answer with ``name``.json and ``name``.md in its folder; tell None: the Markdown itself is printed."""
    tell = tell or (lambda: say(text, lines=True))
    if out is None:
        return Answer(figures, tell, code=code)
    table = out / f"{name}.md"
    write_text(table, text + "\n")
    return Answer(figures, tell, out / f"{name}.json", [("table", table)], code=code)
