"""`cable-sim replay`: a recorded tow simulated again beside its recording."""

from __future__ import annotations

import click

from ..tools.compare.command import junit_option, limits_option, load_limits, score_replay, tell_limits
from .options import json_option, markers_option, needs_out, out_option, settings_options
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
@json_option
def replay(bag, scene, algorithm, convention, topics, settings, out, markers, limits, junit, report, as_json) -> None:
    """Simulate a recorded BAG again and print the residuals against what it recorded of the tow.

    --limits: the scores of `cable-sim compare`, recorded against simulated, decide the exit code.
    """
    needs_out(markers, out)
    asked = None if limits is None else load_limits(limits)
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
        scores = score_replay(result, bag, asked, out) if asked or junit else None
        reporter.write(result)
    try:
        tell(unrecorded(result, out), out, as_json)
    except SystemExit:
        tell_limits(scores, junit, as_json)
        raise
    tell_limits(scores, junit, as_json)
