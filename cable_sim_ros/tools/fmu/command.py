"""`cable-sim fmu`."""

from __future__ import annotations

from pathlib import Path

import click

from ...cli.options import Answer, answers, force_option, set_option
from ...terminal import say


@click.command()
@click.argument("scene")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="FILE.fmu", help="File to write.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", help="Version of the standard.")
@set_option("A value of the scene by its dotted key, fixed in the FMU. May be repeated.")
@click.option(
    "--parameter",
    "parameters",
    multiple=True,
    metavar="KEY",
    help="A number of the scene by its dotted key, which the importing tool may set. May be repeated.",
)
@force_option()
@answers
def fmu(scene, out, fmi, settings, parameters, force) -> Answer:
    """Write SCENE as an FMU for co-simulation: ship motion and winch command in, pull on the ship and towbody out."""
    from ...runs.settings import settings_of
    from .build import build

    built = build(scene, out, int(fmi), settings_of(settings), parameters, force)
    told = (
        f"{built.file}: FMI {built.fmi}, model {built.model}, tick {built.tick:g} s, {built.inputs} inputs, "
        f"{built.outputs} outputs, {built.parameters} parameters"
    )
    return Answer(built._asdict() | {"file": str(built.file)}, lambda: say(told))
