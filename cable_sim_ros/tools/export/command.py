"""`cable-sim export`."""

from __future__ import annotations

from pathlib import Path

import click

from ...cli.options import Answer, Number, answers, force_option
from ...terminal import say


def _names(values: tuple[str, ...]) -> list[str]:
    return [name.strip() for value in values for name in value.split(",") if name.strip()]


@click.command()
@click.argument("bag", metavar="RUN")
@click.option("--out", required=True, type=click.Path(path_type=Path), metavar="FILE", help="File to write.")
@click.option(
    "--format", "form", type=click.Choice(["csv", "nc", "parquet", "mat"]), help="Of the file. Default: by its ending."
)
@click.option("--fields", multiple=True, metavar="NAME,...", help="Fields of a tick, beside its time. Default: all.")
@click.option(
    "--every",
    type=Number(1e-4, 86400.0, "s"),
    help="Keep one tick output, and one table, each S seconds. Default: all.",
)
@click.option(
    "--tables",
    multiple=True,
    metavar="NAME,...",
    help="Of shape (cable), contact (sheave), strum. Default: none. Of csv and parquet files of their own.",
)
@force_option()
@answers
def export(bag, out, form, fields, every, tables, force) -> Answer:
    """Write the recorded RUN, a recording or the folder of a run, as CSV, NetCDF, Parquet or MATLAB file."""
    from .formats import export as write

    done = write(bag, out, form, _names(fields), every, _names(tables), force)

    def tell() -> None:
        for path in done.files:
            say(f"{path}: {path.stat().st_size / 1e6:.3g} MB")
        say(f"{done.ticks} tick outputs of {done.columns} columns; verdict of the run: {done.verdict}")

    return Answer(done._asdict() | {"files": [str(path) for path in done.files]}, tell)
