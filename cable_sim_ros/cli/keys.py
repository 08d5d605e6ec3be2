"""The option ``--keys`` of commands whose file is of a kind of its own: lists what such a file may hold, and leaves."""

from __future__ import annotations

from collections.abc import Callable

import click

from ..physics.parameter import Block
from ..terminal import say


def keys_option(kind: Callable[[], type[Block]], heading: str = "") -> Callable:
    """kind: gives the block of the whole file; called, and so imported, only where the option is used.

    heading: Markdown that stands above the tables.
    """

    def tell(context: click.Context, _parameter: click.Parameter, asked: bool) -> None:
        if not asked:
            return
        from ..runs.manual import tables

        say(heading + "\n".join(tables(kind())), nl=False, lines=True)
        context.exit()

    return click.option(
        "--keys", is_flag=True, is_eager=True, expose_value=False, callback=tell, help="List the keys of a FILE."
    )
