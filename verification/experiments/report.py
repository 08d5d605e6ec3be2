"""Experiments as one HTML file that prints: measured, ours, allowed, verdict; misses red; the picture of each."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from cable_sim_ros.sim.flag_rules import FAILED, OK
from cable_sim_ros.tools.report.parts import Card, Picture, Section, Table, Text, counted, unit
from cable_sim_ros.tools.report.subject import typed
from cable_sim_ros.tools.report.write import write_page

from . import KEPT, MISSED, OPEN, Result, verdict_of
from .table import NUMBERS, choices, columns


def write_report(results: Sequence[Result], path: Path, command: Sequence[str] = ()) -> Path:
    """Write the report of experiments that ran and return its path. Raises ReportError."""
    states = [verdict_of(row) for result in results for row in result.rows]
    judged, missed = len(states) - states.count(OPEN), states.count(MISSED)
    count = counted(len(results), "experiment")
    said = f"{missed} of {judged} figures miss what is allowed; they are red below" if missed else "every figure is"
    sentence = f"{count}: {said}{'' if missed else f' within what is allowed ({judged} of them judged)'}."
    if not judged:
        sentence = f"{count}: no source allows a difference, so that no figure is judged."
    words = typed(command)
    cards = [
        Card("experiments", "experiments", str(len(results)), ""),
        Card("within", "figures within what is allowed", str(states.count(KEPT)), ""),
        Card("missed", "figures that miss it", str(missed), ""),
        Card("open", "figures that nobody judges", str(states.count(OPEN)), ""),
    ]
    about = [
        "Measured: what the source measured or printed; of a closed form its value. Ours: what this program gives for "
        "the same experiment. Allowed: the largest difference that the source reports of its own simulation, so that "
        "within means at least as near to the measurement as the source came; of a formula a share of its value."
    ]
    if words:
        about.append(f"Command: cable-sim {words}")
    overview = Section("overview", "Every experiment", [Text(about), _overview(results)])
    return write_page(
        path,
        title="Validation: experiments of the sources",
        line=f"repetition of {count} from publications, by the product's own cable, water and winch",
        state=FAILED if missed else OK,
        sentence=sentence,
        beside=[],
        cards=cards,
        sections=[overview, *(_section(result) for result in results)],
    )


def _overview(results: Sequence[Result]) -> Table:
    rows, bad = [], []
    for k, result in enumerate(results):
        states = [verdict_of(row) for row in result.rows]
        if MISSED in states:
            bad.append(k)
        counts = (str(states.count(state)) for state in (KEPT, MISSED, OPEN))
        rows.append((result.experiment, str(len(states)), *counts))
    head = ("experiment", "figures", "within", "missed", "not judged")
    return Table("Figures by experiment", head, rows, right=(1, 2, 3, 4), bad=bad)


def _section(result: Result) -> Section:
    """Picture, table and choices of an experiment."""
    head, cells = columns(result, difference=True)
    rows = [(name, unit(of), *rest) for name, of, *rest in cells]
    right = [k for k, name in enumerate(head) if name in NUMBERS]
    bad = [k for k, row in enumerate(result.rows) if verdict_of(row) == MISSED]
    found = Section(result.experiment, f"Experiment {result.experiment}")
    if result.shortened:
        found.parts.append(Text([f"Shortened by --quick: {result.shortened}."]))
    with tempfile.TemporaryDirectory(prefix="cable_sim_plot_") as folder:
        drawn = result.plot(Path(folder))
        if drawn.suffix == ".png":
            found.parts.append(Picture(drawn.read_bytes(), f"Picture of the experiment {result.experiment}"))
    found.parts.append(Table("Measured beside ours", head, rows, right=right, bad=bad))
    if result.choices:
        names, *lines = choices(result)
        title = f"{result.chosen[0].upper()}{result.chosen[1:]}"
        found.parts.append(Table(title, names, lines, right=range(1, len(names))))
    return found
