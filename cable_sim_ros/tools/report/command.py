"""`cable-sim report`: a recorded run as one HTML file that prints."""

from __future__ import annotations

from pathlib import Path

import click

from ...cli.options import checked_place, leave, said, typed


@click.command()
@click.argument("bag")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE.html",
    required=True,
    callback=checked_place,
    help="The file to write.",
)
def report(bag, out) -> None:
    """A recorded run as one HTML file that prints, for somebody who has never seen this program.

    BAG is a recording of the node or of an offline run. The figures are made from it again; how fast it was and what a
    replay found is not in it: ask for --report where it is run.
    """
    from ...io.scenes.document import find_bag
    from ...runs.offline import recorded
    from .write import write_report

    result = recorded(find_bag(bag), "no report is made", "cable-sim run SCENE --report FILE.html")
    said(write_report(result, out, command=typed()))
    leave(result.verdict.lines(), result.verdict.code, quiet=True)
