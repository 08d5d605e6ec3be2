"""``cable-sim soak``."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import click

from cable_sim_ros.cli.out_folder import ready
from cable_sim_ros.cli.progress import progress_bar
from cable_sim_ros.terminal import say

IDS = [f"R{i}" for i in range(1, 12)] + [f"S{i}" for i in range(3, 10)]
MISSED = 1  # exit code where a limit is not kept


@click.command()
@click.argument("ids", nargs=-1, type=click.Choice(IDS, case_sensitive=False), metavar="[R1 ... S9]")
@click.option("--quick", is_flag=True, help="Shorter runs; what was shortened is in the notes.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for table and JSON.")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
def soak(ids, quick, out, as_json) -> None:
    """The real node under load, faults and hostile neighbours (default: all rows, two hours).

    Leaves with code 1 where a limit is missed. Needs ROS 2 and a machine that does nothing else.
    """
    ready(out)
    from ..stress.table import markdown, print_verdicts
    from .table import run

    with progress_bar(as_json) as progress:
        verdicts = run(tuple(ids), quick, progress)
    report = [verdict.as_dict() for verdict in verdicts]
    if out is not None:
        (out / "soak.json").write_text(json.dumps(report, indent=1, default=float) + "\n", "utf-8")
        (out / "soak.md").write_text(markdown(verdicts) + "\n", "utf-8")
    if as_json:
        say(json.dumps(report, indent=1, default=float), lines=True)
    else:
        print_verdicts(verdicts)
    if not all(verdict.passed for verdict in verdicts):
        sys.exit(MISSED)
