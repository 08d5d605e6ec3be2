"""The one way to print: a text of others, as a name or an error's, is shown and never obeyed. Imports nothing of ours.

Names stand in scenes, bags, logs, arguments and messages of others. As markup of `rich` they would be styles, or an
error; with the escape sequences of a terminal they would move the cursor, colour it or change its title.
"""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

OBEYED = re.compile(  # controls but tab and line end; what turns the direction of writing; halves of a character
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


def clean(text: object) -> str:
    r"""The text with what a terminal would obey, or cannot show, written out: ``\x1b``."""
    return OBEYED.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), str(text))


def say(text: object = "", err: bool = False, nl: bool = True) -> None:
    """A line on standard output, or on standard error."""
    print(clean(text), end="\n" if nl else "", file=sys.stderr if err else sys.stdout, flush=True)


def plain_console(width: int = 120, err: bool = False, **options: Any) -> Console:
    """Of rich, for tables and bars: as wide as the terminal, width [characters] where there is none."""
    from rich.console import Console

    class Plain(Console):
        def render_str(self, text: str, **how: Any) -> Any:
            """A text of a cell, title or line: no markup, no emoji, cleaned."""
            return super().render_str(clean(text), **how | {"markup": False, "emoji": False})

    there = (sys.stderr if err else sys.stdout).isatty()
    return Plain(width=None if there else width, stderr=err, **options)
