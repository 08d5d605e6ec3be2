"""`cable-sim mesh`: the table of a scene's mesh, and its check."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from ..errors import CODE_FAILED, CODE_OK
from ..limits import LONGEST_RUN
from ..terminal import print_table, say
from .answer import Answer, answers
from .number import Number
from .progress import progress_bar

if TYPE_CHECKING:
    from ..runs.mesh import Change
    from ..sim.mesh.mesh_kinds import MeshPlan
    from ..sim.scene import Scene


@click.command()
@click.argument("scene")
@click.option("--check", "checked", is_flag=True, help="Measure it by two and four times the elements, half the step.")
@click.option(
    "--seconds", type=Number(0.0, LONGEST_RUN, "s"), default=60.0, help="Heave of the check; 0: statics alone."
)
@answers
def mesh(scene: str, checked: bool, seconds: float) -> Answer:
    """The mesh made for SCENE: elements, lengths, the reason of each, the expected error.

    With --check, the error that finer meshes and a finer step show beside what is promised; leaves with code 1 where
    it is more.
    """
    from ..runs import mesh as study

    tow, plan = study.plan_of(scene)
    changes: list[Change] = []
    if checked:
        with progress_bar() as progress:
            changes = study.check(tow, plan, progress, seconds)
    report = study.as_json(tow, plan, changes)
    code = CODE_FAILED if changes and not report["kept"] else CODE_OK
    return Answer(report, lambda: _tell(tow, plan, changes, report), code=code)


def _tell(scene: Scene, plan: MeshPlan, changes: list[Change], report: dict[str, Any]) -> None:
    words, width = ("part", "where", "reason", "what"), 140
    title = f"{scene.name}: {report['elements']} elements, {report['scope_m']:.4g} m of scope at the start"
    rows = [
        (part.name, part.place, f"{part.elements}", f"{part.shortest:.3g}", f"{part.longest:.3g}", part.reason)
        for part in plan.parts
    ]
    print_table(title, ("part", "where", "elements", "shortest m", "longest m", "reason"), rows, words, width)
    promised = [
        (f"{row.scope:.4g}", f"{100.0 * row.tension:.2g}", f"{row.position:.2g}")
        if row.tension == row.tension
        else (f"{row.scope:.4g}", "none promised", "static shape does not close")
        for row in plan.expected
    ]
    print_table("Expected error", ("scope m", "tension %", "place of the towbody m"), promised, words, width)
    say(f"solver.tick = {scene.solver.tick:g} s is the scene's; for motion of 4 s and longer {plan.tick:g} s would do")
    say(f"forces are solved to {plan.tolerance:g} of contact.working_tension (solver.tolerance)")
    if changes:
        found = [
            (
                change.what,
                f"{100.0 * change.tension:+.3f}",
                "" if change.deviation != change.deviation else f"{100.0 * change.deviation:+.3f}",
                f"{change.position:.4f}",
            )
            for change in changes
        ]
        columns = ("what", "tension, mean %", "tension, deviation %", "place of the towbody m")
        print_table("Error by two and four times the elements and half the step", columns, found, words, width)
        say("within what is promised" if report["kept"] else "MORE than is promised")
