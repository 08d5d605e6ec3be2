"""``cable-sim soak``."""

from __future__ import annotations

import click

from cable_sim_ros.cli.answer import Answer, answers
from cable_sim_ros.cli.options import folder_option, ready
from cable_sim_ros.cli.progress import progress_bar

IDS = [f"R{i}" for i in range(1, 12)] + [f"S{i}" for i in range(3, 10)]


@click.command()
@click.argument("ids", nargs=-1, type=click.Choice(IDS, case_sensitive=False), metavar="[R1 ... S9]")
@click.option("--quick", is_flag=True, help="Shorter runs; what was shortened is in the notes.")
@folder_option("Folder for table and JSON.")
@answers
def soak(ids, quick, out) -> Answer:
    """The real node under load, faults and hostile neighbours (default: all rows, two hours).

    Leaves with code 1 where a limit is missed. Needs ROS 2 and a machine that does nothing else.
    """
    ready(out)
    from ..commands import judged
    from .table import run

    with progress_bar() as progress:
        return judged("soak", run(tuple(ids), quick, progress), out)
