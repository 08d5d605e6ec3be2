"""The report of a sweep: its rows on the page of many runs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...version import __version__
from ..report.parts import Table
from ..report.sweep_page import Many, write_sweep_page
from .dataset import names_of, rule_units
from .figures import MEANINGS, RULE, unit_of
from .sweep import Swept
from .sweep_file import SweepPlan


def write_report(
    swept: Swept,
    path: Path,
    command: Sequence[str] = (),
    *,
    kind: str = "sweep",
    tables: Sequence[Table] = (),
    notes: Sequence[str] = (),
    doubts: Sequence[str] = (),
) -> Path:
    """Write the report of a sweep and return its path; kind: what it is, as table or envelope; tables: what else was
    found; notes: what a reader must know; doubts: why what was found is doubtful, beside its runs. Raises
    ReportError."""
    names, rules = names_of(swept), rule_units(swept)
    many = Many(
        swept.plan.sweep,
        [case.varied for case in swept.cases],
        swept.rows,
        {name: unit_of(name, rules) for name in names},
        {name: MEANINGS.get(name, f"rule on watch: {name.removeprefix(RULE)}").replace("`", "") for name in names},
    )
    many = many._replace(same=_same(swept.plan))
    notes = [f"Rows in {name} could not be read: their cases were computed again." for name in swept.damaged] + [*notes]
    return write_sweep_page(many, path, kind=kind, command=command, notes=notes, tables=tables, doubts=doubts)


def _same(plan: SweepPlan) -> list[tuple[str, str]]:
    """What every run of a sweep has: scene, motion, seconds, seeds, version."""
    rows = [("scene", Path(plan.scene).name)]
    rows += [(key, str(value)) for key, value in plan.settings.items()]
    motions = [Path(one.name).name if one.bag else one.name for one in plan.motions]
    said = ["none: the mean track, so nothing swings" if name == "none" else name for name in motions]
    rows.append(("ship motion", "; ".join(said)))
    if plan.plans != [None]:
        rows.append(("winch plan", "; ".join(words or "none" for words in plan.plans)))
    if plan.setpoints != [None]:
        rows.append(("set-point law", "; ".join(law.value if law else "that of the scene" for law in plan.setpoints)))
    rows.append(("length of each run", f"{plan.duration:g} s" if plan.duration else "as cable-sim run"))
    rows.append(("seeds of what is random", f"1 to {plan.seeds}" if plan.seeds else "those of the scene"))
    rows.append(("time steps", f"{plan.step} by their error" if plan.step == "chosen" else "fixed, one a tick"))
    return [*rows, ("version", f"cable_sim_ros {__version__}")]
