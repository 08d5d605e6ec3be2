"""`cable-sim plan`: what a recovery or a tow needs of its winch, from a run made now or recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.motion_options import motion_options, simulated
from ...cli.options import Answer, Reporter, answers, folder_option, report_option, reporting, settings_options
from ...cli.report import tell_faults, tell_rules
from ...errors import RunError
from ...sim.flag_rules import FAILED
from ...terminal import print_table, say

if TYPE_CHECKING:
    from ...runs.summary import Run
    from ...sim.verdict import Verdict

SIMULATES = (  # options of a run that a recording has made already
    "motion",
    "heave",
    "rao",
    "ship",
    "vehicle",
    "duration",
    "winch",
    "faults",
    "algorithm",
    "imu_only",
    "step",
    "every",
    "convention",
    "topics",
    "settings",
)
FLAG = {"algorithm": "--setpoint", "topics": "--topic", "settings": "--set", "imu_only": "--imu-only"}


class NoPlan(RunError):
    """The run failed: its figures say nothing of a winch; verdict: on that run, which is ``run``."""

    def __init__(self, text: str, verdict: Verdict, run: Run) -> None:
        super().__init__(text)
        self.verdict, self.run = verdict, run


@click.command()
@click.argument("scene", metavar="SCENE|RUN")
@motion_options
@settings_options
@folder_option("Folder for the bag and figures of the run.")
@click.option(
    "--smallest",
    type=click.IntRange(1, 50),
    metavar="SEEDS",
    help="Find the smallest winch that suffices in so many seeds of the sea: some runs of each, limits raised until "
    "none is reached.",
)
@report_option
@answers
def plan(scene, out, smallest, report, **asked) -> Answer:
    """What a recovery or a tow needs of its winch: rate, torque, power, brake and cable, with margins.

    SCENE is simulated as by `cable-sim run`; RUN is a recording of one, a bag or its MCAP file. A run that failed has
    no plan.
    """
    path = Path(scene)
    if path.suffix.lower() == ".mcap" or (path / "metadata.yaml").is_file():
        given = [FLAG.get(name, f"--{name}") for name in SIMULATES if asked[name]]
        given += ["--out"] if out is not None else []
        given += ["--smallest"] if smallest is not None else []
        if given:
            raise click.UsageError(
                f"{given[0]} is of a run, and {scene} is a recording of one; nothing was done; leave it out"
            )
        with reporting(report, path) as reporter:
            from ...runs.offline import recorded

            needs = _planned(scene, result := recorded(path), reporter)
    else:
        with reporting(report, out) as reporter:
            result = simulated(scene, None, out=reporter.folder, **asked)
            needs = _planned(scene, result, reporter, partial(_smallest, scene, smallest, asked) if smallest else None)
    verdict = result.verdict
    kept = out and out / "plan.json"
    return Answer(needs, lambda: _tell(needs, result.metrics), kept, verdict=verdict.lines(), code=verdict.code)


def _smallest(scene: str, seeds: int, asked: dict[str, Any], result: Run) -> dict[str, Any]:
    """The smallest winch for the job of a run, in so many seeds."""
    from ...physics.water import WaveKind
    from .plan import SEED, smallest

    assert result.scene is not None
    if seeds > 1 and result.scene.water.waves.kind is not WaveKind.JONSWAP:
        raise click.UsageError(f"--smallest {seeds}: the scene has no irregular waves, so no {SEED}; give --smallest 1")

    def simulate(values: Mapping[str, Any]) -> Run:
        own = [one for one in asked["settings"] if one.partition("=")[0].strip() not in values]
        settings = (*own, *(f"{key}={value}" for key, value in values.items()))
        return simulated(scene, None, quiet=True, out=None, **{**asked, "settings": settings, "markers": 0.0})

    return smallest(simulate, result.scene, seeds)


def _planned(
    scene: str, result: Run, reporter: Reporter, size: Callable[[Run], dict[str, Any]] | None = None
) -> dict[str, Any]:
    """The plan of a run, and its report with the plan in it. Raises NoPlan for a run that failed."""
    verdict, frames, tow = result.verdict, result.frames, result.scene
    if verdict.state == FAILED or not len(frames) or tow is None:
        reasons = "; ".join(str(reason) for reason in verdict.reasons) or "no tick was simulated"
        raise NoPlan(f"{scene}: no plan is made of a run that failed: {reasons}", verdict, result)
    from ...sim.verdict import check, verdict_of
    from .plan import plan_of

    needs = plan_of(frames, tow, result.metrics)
    if size is not None:
        needs["smallest"] = size(result)
        for seed, texts in needs["smallest"]["lacks"].items():
            needs["short"] += [f"seed {seed}: {text}" for text in texts if text not in needs["short"]]
        needs["sufficient"] = not needs["short"]
    if needs["short"]:
        reason = check("WINCH", f"the winch does not suffice: {'; '.join(needs['short'])}")
        result.verdict = verdict_of([*verdict.reasons, reason])._replace(notes=verdict.notes)
        needs["verdict"] = result.verdict.as_dict()
    reporter.write(result, needs)
    return needs


def _tell(report: dict[str, Any], metrics: dict[str, Any]) -> None:
    """The plan, and of the metrics of the run its scenario of faults."""
    duration = f", {report['duration_s']:.5g} s" if "duration_s" in report else ""
    rows = [
        (
            row["need"],
            f"{row['needed']:.5g}",
            row["unit"],
            f"{row['at_s']:.5g}",
            "" if row["has"] is None else f"{row['has']:.5g}",
            "" if row["margin"] is None else f"{row['margin']:.5g}",
            "" if row["margin_share"] is None else f"{100.0 * row['margin_share']:.3g}",
        )
        for row in report["plan"]
    ]
    title = f"Plan of {report.get('scene', '')}, motion {report.get('motion')}{duration}"
    columns = ("need", "needed", "unit", "at s", "has", "margin", "margin %")
    print_table(title, columns, rows, left=("need", "unit"))
    if "rules" in report:
        tell_rules(report["rules"])
    servo = "" if any(row["need"] == "torque" and row["has"] for row in report["plan"]) else " of rate and cable"
    least = min((row["margin_share"], row["need"]) for row in report["plan"] if row["margin_share"] is not None)
    if report["sufficient"]:
        say(f"the winch suffices{servo}; least margin: {least[1]} {100.0 * least[0]:.3g} %")
    for text in report["short"]:
        say(f"insufficient: {text}")
    if "smallest" in report:
        found = report["smallest"]
        say(f"smallest winch, {found['runs']} runs of seeds {', '.join(map(str, found['seeds']))}:")
        for row in found["limits"]:
            values = row["least"] if isinstance(row["least"], list) else [row["least"]]
            say(f"  {row['key']}: {', '.join(f'{value:.4g}' for value in values)} (seed {row['seed']})")
    for note in report["notes"]:
        say(f"note: {note}")
    if "faults" in metrics:
        tell_faults(metrics["scenario"], metrics["faults"])
