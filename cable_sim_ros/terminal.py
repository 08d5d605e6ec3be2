"""The one way to print: a text of others, as a name or an error's, is shown and never obeyed. Imports nothing of ours.

Names stand in scenes, bags, logs, arguments and messages of others. As markup of `rich` they would be styles, or an
error; with the escape sequences of a terminal they would move the cursor, colour it or change its title.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console
    from rich.text import Text

OBEYED = re.compile(  # controls but tab; what turns the direction of writing; halves of a character
    "[\x00-\x08\x0a-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


def clean(text: object, lines: bool = False) -> str:
    r"""The text with what a terminal would obey, or cannot show, written out: ``\x1b``; so are line ends, with which
    a name would begin a line of ours, but for a text of several lines, each of which is clean."""
    if lines:
        return "\n".join(map(clean, str(text).split("\n")))
    return OBEYED.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), str(text))


def say(text: object = "", err: bool = False, nl: bool = True, lines: bool = False) -> None:
    """A line on standard output, or on standard error; lines: several, as of `clean`."""
    print(clean(text, lines), end="\n" if nl else "", file=sys.stderr if err else sys.stdout, flush=True)


def in_lines(*texts: object) -> Text:
    """Of rich: texts as the lines of one cell or title."""
    from rich.text import Text

    return Text("\n".join(map(clean, texts)))


def plain_console(width: int = 120, err: bool = False, **options: Any) -> Console:
    """Of rich, for tables and bars: as wide as the terminal, width [characters] where there is none."""
    from rich.console import Console

    class Plain(Console):
        def render_str(self, text: str, **how: Any) -> Any:
            """A text of a cell, title or line: no markup, no emoji, cleaned."""
            return super().render_str(clean(text), **how | {"markup": False, "emoji": False})

    there = (sys.stderr if err else sys.stdout).isatty()
    return Plain(width=None if there else width, stderr=err, **options)


def markdown_table(lines: Iterable[Sequence[str]]) -> str:
    """Lines as a table in Markdown, the first its head; a bar within a cell ends no column."""
    head, *rest = lines
    shown = ["| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in (head, *rest)]
    return "\n".join([shown[0], "|---" * len(head) + "|", *shown[1:]])


def print_table(
    title: str | Text | None,
    columns: Sequence[str | Text],
    rows: Iterable[Sequence[str | Text]],
    left: Collection[str] = (),
    width: int = 120,
) -> None:
    """A table on standard output; left: the columns of words, the others are of numbers; width: as of plain_console."""
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for name in columns:
        table.add_column(name, justify="left" if name in left else "right")
    for row in rows:
        table.add_row(*row)
    plain_console(width).print(table)
