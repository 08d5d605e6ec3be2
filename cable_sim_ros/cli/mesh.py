"""`cable-sim mesh`: the table of a scene's mesh, and its check."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from ..limits import LONGEST_RUN
from ..terminal import plain_console, say
from .number import Number
from .progress import progress_bar

if TYPE_CHECKING:
    from rich.table import Table

    from ..runs.mesh import Change
    from ..sim.mesh.mesh_kinds import MeshPlan
    from ..sim.scene import Scene

FAILED = 1  # exit code where the check finds more than was promised


@click.command()
@click.argument("scene")
@click.option("--check", "checked", is_flag=True, help="Measure it by two and four times the elements, half the step.")
@click.option(
    "--seconds",
    type=Number(0.0, LONGEST_RUN, "s"),
    default=60.0,
    show_default=True,
    metavar="S",
    help="Heave of the check; 0: statics alone.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
def mesh(scene: str, checked: bool, seconds: float, as_json: bool) -> None:
    """The mesh made for SCENE: elements, lengths, the reason of each, the expected error.

    With --check, the error that finer meshes and a finer step show beside what is promised; leaves with code 1 where
    it is more.
    """
    from ..runs import mesh as study

    tow, plan = study.plan_of(scene)
    changes: list[Change] = []
    if checked:
        with progress_bar(as_json) as progress:
            changes = study.check(tow, plan, progress, seconds)
    report = study.as_json(tow, plan, changes)
    if as_json:
        say(json.dumps(report, indent=1), lines=True)
    else:
        _print(tow, plan, changes, report)
    if changes and not report["kept"]:
        sys.exit(FAILED)


def _print(scene: Scene, plan: MeshPlan, changes: list[Change], report: dict[str, Any]) -> None:

    console = plain_console(140)
    title = f"{scene.name}: {report['elements']} elements, {report['scope_m']:.4g} m of scope at the start"
    rows: list[tuple[str, ...]] = [
        (part.name, part.place, f"{part.elements}", f"{part.shortest:.3g}", f"{part.longest:.3g}", part.reason)
        for part in plan.parts
    ]
    console.print(_table(title, ("part", "where", "elements", "shortest m", "longest m", "reason"), rows))
    rows = [
        (f"{row.scope:.4g}", f"{100.0 * row.tension:.2g}", f"{row.position:.2g}")
        if row.tension == row.tension
        else (f"{row.scope:.4g}", "none promised", "static shape does not close")
        for row in plan.expected
    ]
    console.print(_table("Expected error", ("scope m", "tension %", "place of the towbody m"), rows))
    console.print(
        f"solver.tick = {scene.solver.tick:g} s is the scene's; for motion of 4 s and longer {plan.tick:g} s would do"
    )
    console.print(f"forces are solved to {plan.tolerance:g} of contact.working_tension (solver.tolerance)")
    if changes:
        rows = [
            (
                change.what,
                f"{100.0 * change.tension:+.3f}",
                "" if change.deviation != change.deviation else f"{100.0 * change.deviation:+.3f}",
                f"{change.position:.4f}",
            )
            for change in changes
        ]
        columns = ("what", "tension, mean %", "tension, deviation %", "place of the towbody m")
        console.print(_table("Error by two and four times the elements and half the step", columns, rows))
        console.print("within what is promised" if report["kept"] else "MORE than is promised")


def _table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    from rich.table import Table

    table = Table(title=title, title_justify="left")
    for name in columns:
        table.add_column(name, justify="left" if name in ("part", "where", "reason", "what") else "right")
    for row in rows:
        table.add_row(*row)
    return table
