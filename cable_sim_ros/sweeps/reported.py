"""The report of a sweep: its rows on the page of many runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..report.parts import Table
from ..report.sweep_page import Many, write_sweep_page
from .dataset import names_of, rule_units
from .figures import MEANINGS, RULE, unit_of
from .sweep import Swept


def write_report(
    swept: Swept, path: Path, command: Sequence[str] = (), *, kind: str = "sweep", tables: Sequence[Table] = ()
) -> Path:
    """Write the report of a sweep and return its path; kind: what it is, as table or envelope; tables: what else was
    found. Raises ReportError."""
    names, rules = names_of(swept), rule_units(swept)
    many = Many(
        swept.plan.sweep,
        [case.varied for case in swept.cases],
        swept.rows,
        {name: unit_of(name, rules) for name in names},
        {name: MEANINGS.get(name, f"rule on watch: {name.removeprefix(RULE)}").replace("`", "") for name in names},
    )
    notes = [f"Rows in {name} could not be read: their cases were computed again." for name in swept.damaged]
    return write_sweep_page(many, path, kind=kind, command=command, notes=notes, tables=tables)
