"""`cable-sim viv`: the vibration of a span as a table, as JSON, as a picture."""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.options import Answer, answers, folder_option, keys_option, progress_bar, ready
from ...files import write_text
from ...physics.parameter import Block

if TYPE_CHECKING:
    from .in_frequency.response import Vibration
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
