"""`cable-sim import`."""

from __future__ import annotations

from math import radians
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...cli.options import Answer, Number, answers, force_option
from ...terminal import say
from .inspect_command import format_option

if TYPE_CHECKING:
    from .imports.import_logs import Imported


@click.command("import")
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option("--mapping", metavar="NAME|FILE", help="Which field is which quantity. Default: the ready one that fits.")
@format_option
@click.option("--out", type=click.Path(path_type=Path), required=True, metavar="BAG", help="Bag to write.")
@click.option(
    "--track",
    type=click.Choice(["measured", "mean"]),
    default="measured",
    help="Positions as measured, or the waves of them about a straight track at --speed.",
)
@click.option(
    "--speed",
    type=Number(-10.0, 10.0, "m/s"),
    help="Of the mean track, in place of the log's. Default: a run takes ship.tow_speed of its scene.",
)
@click.option("--heading", type=Number(-360.0, 360.0, "deg"), help="Of the bow, clockwise from north.")
@click.option(
    "--height",
    type=Number(-50.0, 50.0, "m"),
    default=0.0,
    help="Mean height of base_link above the water; that of the scene is ship.reference_height.",
)
@force_option("Replace a bag that exists.")
@answers
def import_command(files, mapping, kind, out, track, speed, heading, height, force) -> Answer:
    """Make a BAG that run, replay and live take of foreign logs: ship motion, and what was measured of the tow."""
    from .imports.import_logs import import_logs
    from .imports.track import Choice

    way = None if heading is None else radians(90.0 - heading)
    done = import_logs(files, out, mapping, format=kind, choice=Choice(track, speed, way, height), force=force)
    told = {"bag": str(done.path), "assumed": done.assumed, "said": done.said, "missing": done.missing}
    return Answer(done.figures | told, lambda: _tell(done))


def _tell(done: Imported) -> None:
    f = done.figures
    say(
        f"{done.path}: {f['seconds']:.6g} s from {f['files']} files, {f['records']} records, {f['lost']} lost"
        f"{', ' + str(f['without_value']) + ' without a value' if f['without_value'] else ''}; "
        f"motion: {f['motion']} of {', '.join(f['given']) or 'none'}"
    )
    for name, count in f["signals"].items():
        say(f"  {name}: {count} records")
    told = {"lost": f["losses"], "not there": done.missing, "done": done.said, "assumed": done.assumed}
    for word, lines in told.items():
        for line in lines:
            say(f"{word}: {line}")
