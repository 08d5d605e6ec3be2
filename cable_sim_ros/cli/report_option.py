"""--report, which means the same in every command that simulates: the run as one HTML file that prints."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .. import extensions
from ..errors import CODE_FAILED, CableSimError
from ..terminal import say

if TYPE_CHECKING:
    from ..runs.result import Run

ARGUMENTS = "cable_sim_ros.arguments"  # of click's context: the command line as typed


def checked_place(context: click.Context, param: click.Parameter, value: Path | None) -> Path | None:
    """Refuse a report that cannot be made, before anything is run."""
    if value is not None:
        writer = _writer()
        writer.check_tools()
        writer.check_place(value)
    return value


def _writer() -> Any:
    """The part that writes reports; every command that simulates offers --report, whether it is installed or not."""
    writer = extensions.part_of_a_run("report")
    if writer is None:
        raise click.UsageError(
            "--report needs a part named report among cable_sim.run_parts, and none is installed; nothing was "
            "simulated. Install cable_sim_ros again"
        )
    return writer


report_option = click.option(
    "--report",
    type=click.Path(path_type=Path),
    metavar="FILE.html",
    callback=checked_place,
    help="The run as one HTML file that prints, for somebody who has never seen this program.",
)


class Reporter:
    """Writes the report of a command; folder: where the run is recorded, so that there is something to report on."""

    def __init__(self, path: Path | None, folder: Path | None) -> None:
        self.path, self.folder = path, folder

    def write(self, result: Run, plan: Mapping[str, Any] | None = None) -> None:
        """Write the report of a run, where one was asked for."""
        if self.path is not None:
            _writer().write_report(result, self.path, command=typed(), plan=plan)
            said(self.path)


@contextmanager
def reporting(path: Path | None, out: Path | None) -> Iterator[Reporter]:
    """The Reporter of a command. Without ``out`` the run is recorded in a folder that is removed at the end. A run that
    fails before it has figures gets its report too, with the reason."""
    with tempfile.TemporaryDirectory(prefix="cable_sim_") as own:
        reporter = Reporter(path, Path(own) / "run" if path is not None and out is None else out)
        try:
            yield reporter
        except CableSimError as error:
            if path is not None and error.exit_code == CODE_FAILED:
                _failed(reporter, error)
            raise


def unrecorded(result: Run, out: Path | None) -> Run:
    """The run without a recording that is removed at the end of the command."""
    if out is None:
        result.bag = None
    return result


def typed() -> list[str]:
    """The command line."""
    return click.get_current_context().meta.get(ARGUMENTS, [])


def said(path: Path) -> None:
    """Say where the report is; on stderr, for --json."""
    say(f"report:    {path}", err=True)


def _failed(reporter: Reporter, error: CableSimError) -> None:
    import numpy as np

    from ..physics.tick_output import TICK_OUTPUT
    from ..runs.result import Run
    from ..sim.verdict import check, verdict_of

    ended = getattr(error, "run", None)  # of a controller that raised: the run so far
    if ended is None:
        verdict = getattr(error, "verdict", None) or verdict_of([check(error.cause, str(error))])
        scene = click.get_current_context().params.get("scene") or click.get_current_context().params.get("bag")
        name = Path(str(scene)).name if scene else "Cable tow"
        frames = np.recarray(0, dtype=TICK_OUTPUT)
        ended = Run(frames, {"scene": name}, str(error), verdict=verdict)
    reporter.write(ended)
