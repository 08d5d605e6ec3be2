"""`cable-sim recover` and `cable-sim make-bags`."""

from __future__ import annotations

import click

from ..errors import CODE_DAMAGED
from ..limits import MAX_TOW_SPEED
from ..terminal import say
from .number import Number


class DamagedBag(click.ClickException):
    """Only a part of a bag could be read."""

    exit_code = CODE_DAMAGED


@click.command()
@click.argument("source")
@click.argument("target")
def recover(source: str, target: str) -> None:
    """Copy what can be read of the damaged or cut-off bag SOURCE (a path, or the name of a shipped one) into a new bag
    TARGET. Exit code 3: not all of it."""
    from ..io.recordings.recovery import recover as recover_bag
    from ..io.scenes.resources import find_bag

    result = recover_bag(find_bag(source), target)
    say(f"{target}: {result.messages} messages over {result.duration:.2f} s")
    if result.damage:
        raise DamagedBag(str(result.damage))
    say("the source was whole: nothing is missing")


@click.command("make-bags")
@click.option("--out", default="bags", show_default=True, help="Folder for the bags.")
@click.option("--data", help="Folder of the source CSV files. Default: the shipped ones.")
@click.option(
    "--speed",
    type=Number(-MAX_TOW_SPEED, MAX_TOW_SPEED, "m/s"),
    default=2.2,
    show_default=True,
    metavar="M/S",
    help="Mean speed ahead.",
)
@click.option("--only", multiple=True, metavar="NAME", help="Make this bag only; may be repeated.")
@click.option("--force", is_flag=True, help="Replace bags that exist.")
def make_bags(out: str, data: str | None, speed: float, only: tuple[str, ...], force: bool) -> None:
    """Make the shipped bags of recorded ship motion from their 1 Hz sources."""
    from ..runs.make_bags import make_bags as make

    for row in make(out, data, speed=speed, only=only, force=force):
        say(row)
