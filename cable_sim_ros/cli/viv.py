"""`cable-sim viv`: the vibration of a span as a table, as JSON, as a picture."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import click

from ..physics.parameter import Block
from .keys import keys_option
from .out_folder import ready
from .progress import progress_bar

HEADING = """# Keys of a span file

Made by `cable-sim viv any --keys > docs/viv_keys.md`; do not edit. The command:
[vibration](viv.md).

## Keys

"""


def _kind() -> type[Block]:
    from ..spans.in_frequency.span import Span

    return Span


@click.command()
@click.argument("file")
@click.option("--sensitivity", is_flag=True, help="What the response changes by where a choice is made otherwise.")
@keys_option(_kind, HEADING)
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for the figures (viv.json) and the picture."
)
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
def viv(file: str, sensitivity: bool, out: Path | None, as_json: bool) -> None:
    """Vibration by vortices of the cable in FILE (YAML, or the name of a shipped one): frequencies, damping, response.

    In the frequency domain, after Capozucca (1988).
    """
    from ..spans.in_frequency import files, report
    from ..spans.in_frequency.response import vibration

    span = files.load_span(file)
    ready(out)
    if sensitivity:
        from ..spans.in_frequency import sensitivity as study

        with progress_bar(as_json, "choices") as progress:
            changes = study.sensitivity(span, progress)
        rows = [change._asdict() for change in changes]
        if out is not None:
            (out / "sensitivity.json").write_text(json.dumps(rows, indent=1) + "\n", "utf-8")
            (out / "sensitivity.md").write_text(study.markdown(changes) + "\n", "utf-8")
        if as_json:
            click.echo(json.dumps(rows, indent=1))
        else:
            report.print_sensitivity(span, changes)
        return
    with progress_bar(as_json, "frequencies") as progress:
        result = vibration(span, progress)
    for warning in files.warnings(span, result):
        warnings.warn(f"{file}: {warning}", files.SpanWarning, stacklevel=2)
    data = files.as_data(span, result)
    if out is not None:
        from ..plots.span_in_frequency import draw

        (out / "viv.json").write_text(json.dumps(data, indent=1) + "\n", "utf-8")
        click.echo(f"picture:   {draw(span, result, out / 'viv.png')}", err=True)
    if as_json:
        click.echo(json.dumps(data, indent=1))
    else:
        report.print_vibration(span, result)
