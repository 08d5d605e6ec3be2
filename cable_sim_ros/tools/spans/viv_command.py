"""`cable-sim viv`: the vibration of a span as a table, as JSON, as a picture."""

from __future__ import annotations

import json
import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ...cli.keys import keys_option
from ...cli.out_folder import ready
from ...cli.progress import progress_bar
from ...files import write_text
from ...physics.parameter import Block
from ...terminal import say

if TYPE_CHECKING:
    from .to_frequency import FrequencyCase

HEADING = """# Keys of a span file

Made by `cable-sim viv any --keys > docs/viv_keys.md`; do not edit. The command:
[vibration](viv.md).

## Keys

"""


def _kind() -> type[Block]:
    from .in_frequency.span import Span

    return Span


@click.command()
@click.argument("file")
@click.option("--sensitivity", is_flag=True, help="What the response changes by where a choice is made otherwise.")
@keys_option(_kind, HEADING)
@click.option(
    "--case", "names", multiple=True, metavar="NAME", help="This case only, of a file with span: ; may be repeated."
)
@click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for the figures (viv.json) and the picture."
)
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
def viv(file: str, sensitivity: bool, names: tuple[str, ...], out: Path | None, as_json: bool) -> None:
    """Vibration by vortices of the cable in FILE (YAML, or the name of a shipped one): frequencies, damping, response.

    In the frequency domain, after Capozucca (1988). FILE may be one for `cable-sim span`: each of its cases.
    """
    from .to_frequency import load_cases

    cases = load_cases(file, names)
    ready(out)
    if sensitivity:
        _sensitivity(file, cases, out, as_json)
        return
    found = [_computed(file, case, out, as_json) for case in cases.values()]
    of = next(iter(cases.values())).of
    report = {"span": of, "cases": found} if of else found[0]
    if out is not None:
        write_text(out / "viv.json", json.dumps(report, indent=1) + "\n")
    if as_json:
        say(json.dumps(report, indent=1), lines=True)


def _computed(file: str, case: FrequencyCase, out: Path | None, as_json: bool) -> dict:
    """Compute one span, warn, draw and print it; its figures."""
    from .in_frequency import files, report
    from .in_frequency.response import vibration

    with progress_bar(as_json, "frequencies") as progress:
        result = vibration(case.span, progress)
    doubts = case.warnings(result)
    for doubt in doubts:
        warnings.warn(f"{file}: {doubt}", files.SpanWarning, stacklevel=3)
    if out is not None:
        from .picture_in_frequency import draw

        picture = "_".join(["viv", *re.findall(r"[\w.-]+", case.case)]) + ".png"
        say(f"picture:   {draw(case.span, result, out / picture)}", err=True)
    if not as_json:
        report.print_vibration(case.span, result)
        report.print_taken(case.taken)
    data = {**files.as_data(case.span, result), files.WARNINGS: doubts}
    return {"case": case.case} | data | {"taken": [taken._asdict() for taken in case.taken]} if case.case else data


def _sensitivity(file: str, cases: dict[str, FrequencyCase], out: Path | None, as_json: bool) -> None:
    from .in_frequency import files, report
    from .in_frequency import sensitivity as study

    if len(cases) > 1:
        text = f"{file}: has {len(cases)} cases, and --sensitivity is of one; nothing was computed. Name it: --case "
        raise files.SpanError([text + next(iter(cases))])
    span = next(iter(cases.values())).span
    with progress_bar(as_json, "choices") as progress:
        changes = study.sensitivity(span, progress)
    rows = [change._asdict() for change in changes]
    if out is not None:
        write_text(out / "sensitivity.json", json.dumps(rows, indent=1) + "\n")
        write_text(out / "sensitivity.md", study.markdown(changes) + "\n")
    if as_json:
        say(json.dumps(rows, indent=1), lines=True)
    else:
        report.print_sensitivity(span, changes)
