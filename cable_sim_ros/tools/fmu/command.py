"""`cable-sim fmu`."""

from __future__ import annotations

import json
from pathlib import Path

import click

from ...terminal import say


@click.command()
@click.argument("scene")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="FILE.fmu", help="File to write.")
@click.option("--fmi", type=click.Choice(["2", "3"]), default="2", show_default=True, help="Version of the standard.")
@click.option(
    "--set",
    "settings",
    multiple=True,
    metavar="KEY=VALUE",
    help="A value of the scene by its dotted key, fixed in the FMU. May be repeated.",
)
@click.option(
    "--parameter",
    "parameters",
    multiple=True,
    metavar="KEY",
    help="A number of the scene by its dotted key, which the importing tool may set. May be repeated.",
)
@click.option("--force", is_flag=True, help="Replace a file that is there.")
@click.option("--json", "as_json", is_flag=True, help="Print what was written as JSON, nothing else.")
def fmu(scene, out, fmi, settings, parameters, force, as_json) -> None:
    """Write SCENE as an FMU for co-simulation: ship motion and winch command in, pull on the ship and towbody out."""
    from ...runs.settings import settings_of
    from .build import build

    built = build(scene, out, int(fmi), settings_of(settings), parameters, force)
    if as_json:
        say(json.dumps(built._asdict() | {"file": str(built.file)}, indent=1), lines=True)
        return
    say(
        f"{built.file}: FMI {built.fmi}, model {built.model}, tick {built.tick:g} s, {built.inputs} inputs, "
        f"{built.outputs} outputs, {built.parameters} parameters"
    )
