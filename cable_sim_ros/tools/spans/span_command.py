"""`cable-sim span`: a span in a cross wind, as a table, as JSON, as a picture."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...cli.options import Answer, answers, folder_option, keys_option, progress_bar, ready
from ...physics.parameter import Block
from ...terminal import print_table, say

if TYPE_CHECKING:
    from .in_time.wake_run import SpanRun


def _kind() -> type[Block]:
    from .span_file import SpanFile

    return SpanFile


@click.command()
@click.argument("file")
@keys_option(_kind)
@click.option("--case", "cases", multiple=True, metavar="NAME", help="Run this case only; may be repeated.")
@folder_option("Folder for the figures (span.json) and the picture.")
@answers
def span(file: str, cases: tuple[str, ...], out: Path | None) -> Answer:
    """Vibration in time of the span in FILE (YAML, or the name of a shipped one) by the vortices that the wind sheds.

    A wake oscillator on every node, see docs/wake.md; `cable-sim viv` takes the same file in the frequency domain.
    """
    from .in_time import wake_run
    from .picture_in_frequency import draw_span

    ready(out)
    with progress_bar() as progress:
        run = wake_run.run_span(file, list(cases) or None, progress)
    return Answer(
        run.as_data(),
        lambda: _tell(run),
        kept=out and out / "span.json",
        files=[("picture", draw_span(run, out / "span.png"))] if out else (),
        verdict=run.verdict.lines(),
        code=run.verdict.code,
    )


STEADY = {True: "yes", False: "no", None: "-"}


def _tell(run: SpanRun) -> None:
    columns = (
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
    )
    rows = []
    for row in run.rows:
        cells = [getattr(row, name) for _, name in columns]
        rows.append((row.case, *("-" if v is None else f"{v:.4g}" for v in cells), STEADY[row.steady]))
    head = ("case", *(words for words, _ in columns), "steady")
    print_table(f"{run.span.name}, ends: {run.span.ends.value}", head, rows, left=("case", "steady"), width=160)
    for notice in run.notices:
        say(f"note: {notice}")
