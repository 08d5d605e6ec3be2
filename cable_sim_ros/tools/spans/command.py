"""`cable-sim span` and `cable-sim viv`: a span in a wind or a flow, as a table, as JSON, as a picture."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.options import Answer, answers, folder_option, keys_option, progress_bar, ready
from ...files import write_text
from ...physics.parameter import Block
from ...terminal import print_table, say

if TYPE_CHECKING:
    from .in_frequency.response import Vibration
    from .in_time.wake_run import SpanRun
    from .to_frequency import FrequencyCase

STEADY = {True: "yes", False: "no", None: "-"}
HEADING = """# Keys of a span file

Made by `cable-sim viv any --keys > docs/viv_keys.md`; do not edit. The command:
[vibration](viv.md).

## Keys

"""


def _span_file() -> type[Block]:
    from .span_file import SpanFile

    return SpanFile


@click.command()
@click.argument("file")
@keys_option(_span_file)
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


def _span_alone() -> type[Block]:
    from .in_frequency.span import Span

    return Span


@click.command()
@click.argument("file")
@click.option("--sensitivity", is_flag=True, help="What the response changes by where a choice is made otherwise.")
@keys_option(_span_alone, HEADING)
@click.option(
    "--case", "names", multiple=True, metavar="NAME", help="This case only, of a file with span: ; may be repeated."
)
@folder_option("Folder for the figures (viv.json) and the picture.")
@answers
def viv(file: str, sensitivity: bool, names: tuple[str, ...], out: Path | None) -> Answer:
    """Vibration by vortices of the cable in FILE (YAML, or the name of a shipped one): frequencies, damping, response.

    In the frequency domain, after Capozucca (1988). FILE may be one for `cable-sim span`: each of its cases.
    """
    from .to_frequency import load_cases

    cases = load_cases(file, names)
    ready(out)
    if sensitivity:
        return _sensitivity(file, cases, out)
    from .in_frequency.sensitivity import print_taken, print_vibration
    from .picture_in_frequency import draw

    found = [(case, *_computed(file, case)) for case in cases.values()]
    files = []
    if out is not None:
        for case, result, _ in found:
            picture = "_".join(["viv", *re.findall(r"[\w.-]+", case.case)]) + ".png"
            files.append(("picture", draw(case.span, result, out / picture)))

    def tell() -> None:
        for case, result, _ in found:
            print_vibration(case.span, result)
            print_taken(case.taken)

    figures = [data for *_, data in found]
    of = found[0][0].of
    return Answer({"span": of, "cases": figures} if of else figures[0], tell, out and out / "viv.json", files)


def _computed(file: str, case: FrequencyCase) -> tuple[Vibration, dict[str, Any]]:
    """The vibration of one span and its figures; warns of what is doubtful."""
    from .in_frequency import files
    from .in_frequency.response import vibration

    with progress_bar(unit="frequencies") as progress:
        result = vibration(case.span, progress)
    doubts = case.warnings(result)
    for doubt in doubts:
        warnings.warn(f"{file}: {doubt}", files.SpanWarning, stacklevel=3)
    data = {**files.as_data(case.span, result), files.WARNINGS: doubts}
    if case.case:
        data = {"case": case.case, **data, "taken": [taken._asdict() for taken in case.taken]}
    return result, data


def _sensitivity(file: str, cases: dict[str, FrequencyCase], out: Path | None) -> Answer:
    from .in_frequency import files
    from .in_frequency import sensitivity as study
    from .in_frequency.sensitivity import print_sensitivity

    if len(cases) > 1:
        text = f"{file}: has {len(cases)} cases, and --sensitivity is of one; nothing was computed. Name it: --case "
        raise files.SpanError([text + next(iter(cases))])
    span = next(iter(cases.values())).span
    with progress_bar(unit="choices") as progress:
        changes = study.sensitivity(span, progress)
    if out is not None:
        write_text(out / "sensitivity.md", study.markdown(changes) + "\n")
    rows = [change._asdict() for change in changes]
    return Answer(rows, lambda: print_sensitivity(span, changes), out and out / "sensitivity.json")
