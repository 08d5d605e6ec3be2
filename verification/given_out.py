"""What a command of the laboratory gives out: JSON and Markdown into its folder, one of them on standard output."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cable_sim_ros.terminal import say

FAILED = 1  # exit code where a value is missing or a limit is not kept


def give_out(
    name: str,
    data: Any,
    text: str,
    out: Path | None,
    as_json: bool,
    show: Callable[[], None] | None = None,
    filed: Any = None,
) -> None:
    """Write ``name``.json and ``name``.md, print JSON or what ``show`` shows; None: the Markdown itself.

    filed: data of the file, where it has more than what is printed.
    """
    shown = json.dumps(data, indent=1, default=float)
    if out is not None:
        kept = shown if filed is None else json.dumps(filed, indent=1, default=float)
        (out / f"{name}.json").write_text(kept + "\n", "utf-8")
        (out / f"{name}.md").write_text(text + "\n", "utf-8")
    if as_json or show is None:
        say(shown if as_json else text, lines=True)
    else:
        show()
