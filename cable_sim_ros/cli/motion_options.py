"""Options that say what is simulated and how its ship moves, and the run that they ask for."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..limits import LONGEST_RUN
from .options import Heave, Number, imu_option, progress_bar, setpoint_option, together

if TYPE_CHECKING:
    from ..runs.offline import Run

SHIPPED_BAG = "nbp1406"
OTHERWISE = "heave", "rao", "ship", "vehicle"  # what may move in place of, or beside, --motion
motion_options = together(  # how a run is made: motion, duration, winch plan, set-point, steps
    click.option(
        "--motion",
        metavar="BAG|CSV|none",
        help="Ship motion: a bag, a table in a CSV file, or none: the static tow. Default: the bag nbp1406; with "
        "--from that of the saved run, which goes on.",
    ),
    click.option(
        "--heave", type=Heave(), help="Sinusoidal heave in place of --motion: amplitude in m, period in s, as in 1.2,8."
    ),
    click.option(
        "--rao",
        metavar="FILE|simple",
        help="Ship moved by the waves of SCENE: response amplitude operators in a CSV file, or "
        "simple:length=60,beam=12.",
    ),
    click.option(
        "--duration",
        type=Number(0.0, LONGEST_RUN, "s", above=True),
        help="Seconds to simulate. Default: all the motion there is; 60 s of --heave or --rao; without motion a short "
        "settling; without a bag at least a minute more than --winch.",
    ),
    click.option(
        "--winch",
        metavar="PLAN|FILE",
        help="What the winch is to do, times in s from the start: '0 hold, 60 rate 0.5, 360 hold'; also length M and "
        "scope M, and mode WORD for drive.mode. Positive is cable out. Compensation goes on and adds to it.",
    ),
    click.option(
        "--ship",
        metavar="PLAN|FILE",
        help="Where the ship goes in place of --motion, times in s from the start: '60 starboard 90 over 120, 300 "
        "speed 1 over 60'; also port. Turns in deg, speed in m/s. Goes with --heave: docs/turns.md.",
    ),
    click.option(
        "--vehicle",
        metavar="MOTION|CSV|BAG",
        help="How the vehicle at the far end moves: 'circle 5 60', 'heave 1 8' (also surge, sway; m, s), still, a "
        "table or a bag with vehicle/odom. Default: as --motion has it, or along with the ship: docs/vehicles.md.",
    ),
    click.option("--faults", metavar="FILE", help="A scenario of what goes wrong when: docs/instruments.md."),
    setpoint_option,
    imu_option,
    click.option(
        "--step",
        type=click.Choice(["chosen", "fixed"]),
        help="Time step: chosen by its error (solver.tension_error, else accuracy.tension), or fixed: one a tick. "
        "Default: chosen; with --from and no SCENE as saved.",
    ),
    click.option(
        "--every",
        type=Number(1e-4, 1.0, "s"),
        help="Seconds between tick outputs. Default: solver.tick of the scene; 0.1 where it does not choose steps "
        "itself, or less for rules that read the tension oftener or a motor's controller that is faster.",
    ),
)


def simulated(
    scene: str | None,
    begin: Path | None,
    *,
    quiet: bool = False,
    motion: str | None,
    step: str | None,
    convention: str | None,
    topics: tuple[str, ...],
    settings: tuple[str, ...],
    **asked: Any,
) -> Run:
    """The run that the options ask for; begin: a saved state, or None; quiet: no progress bar; asked: as of
    `offline.run`."""
    if motion == "none" and (asked["heave"] or asked["rao"]) is not None:
        name = "--heave" if asked["rao"] is None else "--rao"
        raise click.UsageError(f"{name} and --motion none contradict each other; nothing was simulated; leave one out")
    if scene is None and begin is None:
        raise click.UsageError("Missing argument 'SCENE' (or --from FILE)")
    if scene is not None and step is None:
        step = "chosen"
    with progress_bar(quiet=quiet) as progress:
        from ..runs import offline
        from ..runs.resume import Resumed
        from ..runs.settings import settings_of, topics_of

        given, names = settings_of(settings, convention), topics_of(topics)
        state = None if begin is None else Resumed(begin)
        if motion is None and all(asked[name] is None for name in OTHERWISE):
            if state is None:
                motion = SHIPPED_BAG
            else:
                report = state.report()
                motion = report.motion
                asked |= {name: getattr(report, name) for name in (*OTHERWISE, "imu_only")}
                given, names = {**report.settings, **given}, names or report.topics
        return offline.run(
            scene,
            None if motion == "none" else motion,
            step=step,
            resumed=state,
            settings=given,
            topics=names,
            progress=progress,
            **asked,
        )
