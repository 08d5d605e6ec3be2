"""`cable-sim replay`: a recorded tow simulated again beside its recording."""

from __future__ import annotations

import click

from .. import extensions
from .options import (
    all_option,
    json_option,
    junit_option,
    limits_option,
    markers_option,
    needs_out,
    out_option,
    settings_options,
)
from .progress import progress_bar
from .report import tell
from .report_option import report_option, reporting, unrecorded


@click.command()
@click.argument("bag")
@click.option("--scene", help="Scene in place of the one kept in the bag; needed where the bag keeps none.")
@click.option("--setpoint", "algorithm", metavar="NAME", help="Set-point algorithm in place of the scene's.")
@settings_options
@out_option
@markers_option
@limits_option
@junit_option
@report_option
@all_option
@json_option
def replay(bag, scene, algorithm, convention, topics, settings, out, markers, limits, junit, report, as_json) -> None:
    """Simulate a recorded BAG again and print the residuals against what it recorded of the tow.

    --limits: the scores of `cable-sim compare`, recorded against simulated, decide the exit code.
    """
    needs_out(markers, out)
    scorer = extensions.part_of_a_run("scores") if limits or junit else None
    if (limits or junit) and scorer is None:
        raise click.UsageError(
            "--limits and --junit need a part named scores among cable_sim.run_parts, and none is installed; nothing "
            "was simulated. Install cable_sim_ros again"
        )
    asked = scorer.load_limits(limits) if scorer and limits else None
    with reporting(report, out) as reporter:
        with progress_bar(as_json) as progress:
            from ..runs import offline
            from ..runs.settings import settings_of, topics_of

            result = offline.replay(
                bag,
                scene,
                algorithm=algorithm,
                settings=settings_of(settings, convention),
                topics=topics_of(topics),
                out=reporter.folder,
                markers=markers,
                progress=progress,
            )
        scores = scorer.score_replay(result, bag, asked, out) if scorer else None
        reporter.write(result)
    try:
        tell(unrecorded(result, out), out, as_json)
    finally:
        if scorer:
            scorer.tell_limits(scores, junit, as_json)
