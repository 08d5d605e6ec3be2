"""`cable-sim span`: a span in a cross wind, as a table, as JSON, as a picture."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...cli.keys import keys_option
from ...cli.out_folder import ready
from ...cli.progress import progress_bar
from ...files import write_text
from ...physics.parameter import Block
from ...terminal import plain_console, say

if TYPE_CHECKING:
    from .in_time.wake_run import SpanRun


def _kind() -> type[Block]:
    from .span_file import SpanFile

    return SpanFile


@click.command()
@click.argument("file")
@keys_option(_kind)
@click.option("--case", "cases", multiple=True, metavar="NAME", help="Run this case only; may be repeated.")
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for the figures (span.json) and the picture.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
def span(file: str, cases: tuple[str, ...], out: Path | None, as_json: bool) -> None:
    """Vibration in time of the span in FILE (YAML, or the name of a shipped one) by the vortices that the wind sheds.

    A wake oscillator on every node, see docs/wake.md; `cable-sim viv` takes the same file in the frequency domain.
    """
    from .in_time import wake_run

    ready(out)
    with progress_bar(as_json) as progress:
        run = wake_run.run_span(file, list(cases) or None, progress)
    report = run.as_data()
    if out is not None:
        from .picture_in_time import draw_span

        write_text(out / "span.json", json.dumps(report, indent=1) + "\n")
        say(f"picture:   {draw_span(run, out / 'span.png')}", err=True)
    if as_json:
        say(json.dumps(report, indent=1), lines=True)
    else:
        _print(run)
        for notice in run.notices:
            say(f"note: {notice}")
    verdict = run.verdict
    if not as_json or verdict.code:
        for line in verdict.lines():
            say(line, err=as_json)
    if verdict.code:
        sys.exit(verdict.code)


STEADY = {True: "yes", False: "no", None: "-"}


def _print(run: SpanRun) -> None:
    from rich.table import Table

    table = Table(title=f"{run.span.name}, ends: {run.span.ends.value}", title_justify="left")
    columns = (
        ("case", None),
        ("natural Hz", "natural_frequency_hz"),
        ("St U/d Hz", "strouhal_frequency_hz"),
        ("wake Hz", "wake_frequency_hz"),
        ("wake q", "wake_amplitude"),
        ("vertical rms m", "vertical_rms_m"),
        ("vertical peak m", "vertical_peak_m"),
        ("streamwise peak m", "streamwise_peak_m"),
        ("at the end m", "end_vertical_peak_m"),
        ("shift %", "wake_shift_percent"),
        ("locks within %", "lock_in_width_percent"),
        ("steady", "steady"),
    )
    for head, _ in columns:
        table.add_column(head, justify="left" if head in ("case", "steady") else "right")
    for row in run.rows:
        report = row._asdict()
        cells = [report[name] for _, name in columns[1:-1] if name is not None]
        table.add_row(row.case, *("-" if v is None else f"{v:.4g}" for v in cells), STEADY[row.steady])
    plain_console(160).print(table)
