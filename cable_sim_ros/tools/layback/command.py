"""`cable-sim layback`: where the towbody was, from a recording or from a log of pay-out, speed, heading and depth."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from ...cli.options import Answer, Number, answers, drawn, folder_option, progress_bar, ready
from ...errors import CableSimError
from ...terminal import print_table, say

if TYPE_CHECKING:
    from ...sim.scene import Scene
    from ...sim.verdict import Verdict
    from ..ensemble.plan import Ranges
    from .laid import Laid
    from .report import Place
    from .towed import Copied


class LaybackError(CableSimError, ValueError):
    """Options of the command that do not fit each other."""


class Numbers(click.ParamType):
    """Numbers with commas between, as many as there are bounds."""

    def __init__(self, name: str, low: tuple[float, ...], high: tuple[float, ...], unit: str) -> None:
        self.name, self.low, self.high, self.unit = name, low, high, unit

    def convert(self, value: Any, param: Any, context: Any) -> tuple[float, ...]:
        """Raises click's error."""
        if isinstance(value, tuple):
            return value
        try:
            numbers = tuple(float(part) for part in str(value).split(","))
            if len(numbers) != len(self.low):
                raise ValueError
        except ValueError:
            count = {2: "two", 3: "three"}[len(self.low)]
            said = f"'{value}' is not {self.name} ({count} numbers, {self.unit}); nothing was simulated"
            self.fail(said, param, context)
        for number, low, high in zip(numbers, self.low, self.high, strict=True):
            if not low <= number <= high:
                self.fail(
                    f"{number:g} is outside [{low:g}, {high:g}] {self.unit}; nothing was simulated", param, context
                )
        return numbers


@click.command()
@click.argument("source", metavar="RECORDING|LOG", type=click.Path(path_type=Path))
@click.option("--scene", help="Scene that is towed. Needed with a log; of a recording the one it keeps.")
@click.option("--mapping", type=click.Path(path_type=Path), metavar="FILE", help="What the fields of a log mean.")
@click.option(
    "--range",
    "ranges",
    multiple=True,
    metavar="KEY=VALUE",
    help="Half-width of 95 % of drag (share), speed, current (m/s), current_turn_deg or payout (m). Repeatable.",
)
@click.option(
    "--factor",
    type=Number(0.5, 1.0),
    default=None,
    metavar="F",
    help="Of the cable out, for that way of the trade. Default: 0.9.",
)
@click.option(
    "--astern",
    type=click.Choice(["course", "heading"]),
    default="course",
    help="Direction against which the ways of the trade lay the towbody.",
)
@click.option(
    "--antenna",
    type=Numbers("X,Y", (-500.0, -100.0), (500.0, 100.0), "m"),
    metavar="X,Y",
    help="Antenna in base_link, m forward and to port. Default: 0,0.",
)
@click.option(
    "--sonar",
    type=Numbers("X,Y,Z", (-20.0,) * 3, (20.0,) * 3, "m"),
    metavar="X,Y,Z",
    help="Point of the towbody whose place is told, in towbody_link: m forward, to port, up. Default: 0,0,0.",
)
@click.option(
    "--interval",
    type=click.Choice(["auto", "steady"]),
    default="auto",
    help="auto: of copies of the tow where it manoeuvres; steady: of steady tows everywhere, which costs a tenth.",
)
@click.option(
    "--table",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="table.csv of cable-sim table over scope and speed, for that way of the trade.",
)
@click.option(
    "--counter-offset",
    type=Number(-1000.0, 1000.0, "m"),
    help="Added to the pay-out of a log, so that it counts from the sheave. Default: 0.",
)
@click.option("--fit-drag", is_flag=True, help="Adjust the drag, within its range, to the depths of a log.")
@click.option(
    "--origin",
    type=Numbers("LAT,LON", (-89.0, -180.0), (89.0, 180.0), "deg"),
    metavar="LAT,LON",
    help="Where the axes of the recording, or a log without positions, begin; WGS 84.",
)
@click.option("--began", metavar="TIME", help="When the log began, ISO 8601, where its times are no date.")
@folder_option("Folder for layback.csv and picture.")
@answers
def layback(source, scene, mapping, ranges, out, **asked) -> Answer:
    """Where the towbody was: simulated with a 95 % interval, beside the ways of the trade.

    RECORDING is a run of the node or offline; LOG a CSV file with the columns time_s, payout_m, speed_mps, heading_deg,
    depth_m, latitude, longitude, or any log with a mapping, under which the tow of --scene is simulated.
    """
    ready(out)
    from ...io.scenes.document import find_bag
    from ..ensemble.plan import Ranges, ranges_of
    from .ways import read_table

    known, lines = ranges_of(ranges, Ranges)

    asked["table"] = asked["table"] and read_table(asked["table"])
    asked["sonar"] = asked["sonar"] or (0.0, 0.0, 0.0)

    source = find_bag(source) if source.is_dir() else source
    if mapping is None and ((source / "metadata.yaml").is_file() or source.suffix.lower() == ".mcap"):
        given = [name for name in ("counter_offset", "began") if asked[name] is not None]
        given += ["fit_drag"] if asked["fit_drag"] else []
        if given:
            raise LaybackError(
                f"--{given[0].replace('_', '-')} is of a log, and {source} is a recording of a run; nothing was "
                f"simulated. Leave it out, or give --mapping FILE where it is a bag of another origin"
            )
        with progress_bar() as progress:
            found = _of_recording(source, scene, known, asked, progress)
        return _answer(found, lines, source, out)
    if scene is None:
        raise LaybackError(
            f"{source} is a log, and a log does not say what is towed; nothing was simulated. Give --scene NAME or FILE"
        )
    with progress_bar() as progress:
        found = _of_log(source, scene, mapping, known, asked, progress)
    return _answer(found, lines, source, out)


class Found(NamedTuple):
    """What was towed, how it lay, where, whether its depth was measured, verdict, figures beside, what was assumed."""

    tow: Scene
    one: Laid
    place: Place
    measured: bool
    verdict: Verdict
    figures: dict[str, Any]
    assumed: list[str]


def _factor(asked: dict[str, Any], lines: list[str]) -> float:
    from .ways import FACTOR

    if asked["factor"] is None:
        lines.append(f"assumed: the factor on the cable out is {FACTOR:g}; --factor")
        return FACTOR
    return asked["factor"]


def _laid(asked: dict[str, Any], copied: Callable[[], Copied], *tow: Any) -> Laid:
    """The towbody by all ways, as was asked for; copied: makes the interval of copies; tow: as of `laid`."""
    from .laid import laid

    how = {"by_heading": asked["astern"] == "heading", "table": asked["table"]}
    return laid(*tow, copied=copied if asked["interval"] == "auto" else None, **how)


def _of_recording(source: Path, scene: str | None, ranges: Ranges, asked: dict[str, Any], progress: Any) -> Found:
    """Of a run that is recorded: its towbody is the simulated one, its depth stands for the measured one."""
    from ...io.recordings.recorded_run import load_run, scene_of_recording
    from ...runs.offline import judged
    from ...runs.summary import Run
    from .laid import samples_of
    from .report import Place
    from .tow_log import EPOCH, STEP
    from .towed import Towed, of_recording

    recorded = load_run(source)
    tow = scene_of_recording(recorded.custom_data, source, scene, "what was towed is not known")
    lines = ["assumed: the depth that a survey measures is that of the simulated towbody"]
    antenna = asked["antenna"] or (0.0, 0.0)
    if asked["antenna"] is None:
        lines.append("assumed: the antenna stands at base_link; --antenna X,Y")
    factor = _factor(asked, lines)
    samples = samples_of(recorded.frames, STEP, antenna, asked["sonar"])

    def copied() -> Copied:
        return of_recording(source, tow, recorded.frames, Towed(tow, ranges, asked["sonar"]), progress)

    one = _laid(asked, copied, tow, samples, ranges, factor)
    began = float(recorded.frames["time"][0]) * 1e-9
    verdict = judged(Run(recorded.frames, {}, "", source, scene=tow), tow).verdict
    place = Place(asked["origin"], began if began > EPOCH else None)
    return Found(tow, one, place, False, verdict, {"source": "recording"}, lines)


def _of_log(
    source: Path, scene: str, mapping: Path | None, ranges: Ranges, asked: dict[str, Any], progress: Any
) -> Found:
    """Of a log, under which the tow is simulated."""
    from ...io.scenes.load import load_scene
    from . import by_log
    from .report import Place
    from .tow_log import moment_of, read_log

    began = None if asked["began"] is None else moment_of(asked["began"])
    tow, log = load_scene(scene), read_log(source, mapping)
    lines = [*log.assumed]
    antenna = asked["antenna"] or (0.0, 0.0)
    if asked["antenna"] is None and log.origin is not None:
        lines.append("assumed: the antenna stands at base_link; --antenna X,Y")
    offset = asked["counter_offset"] or 0.0
    if asked["counter_offset"] is None:
        lines.append("assumed: the pay-out counts from the sheave, metre for metre of layback; --counter-offset M")
    factor = _factor(asked, lines)
    cable = by_log.checked_cable(log, tow, offset)
    drag = 1.0
    figures: dict[str, Any] = {"source": "log"}
    if asked["fit_drag"]:
        fit = by_log.adjusted(log, tow, cable, by_log.before_run(log, tow, cable, antenna), ranges)
        drag = fit.factor
        figures["drag_factor"] = fit._asdict()
        lines.append(
            f"adjusted: drag x {fit.factor:.3f}, for which the static depths are {fit.after:.2g} m rms from the "
            f"measured ones (x 1: {fit.before:.2g} m)"
            + ("; it is at the end of its range: something else is wrong too" if fit.at_end else "")
        )
    run = by_log.simulated(log, tow, cable, antenna, drag, progress)
    samples = by_log.samples_of_log(log, run, antenna, asked["sonar"])

    def copied() -> Copied:
        return by_log.interval_of(run, ranges, asked["sonar"], progress)

    one = _laid(asked, copied, tow, samples, ranges, factor, drag)
    if log.depth is None:
        lines.append("assumed: the depth that the ways of the trade take is the simulated one (no depth_m was logged)")
    one.notes[:0] = [*log.notes, *run.notes]
    place = Place(log.origin or asked["origin"], log.began if log.began is not None else began)
    return Found(tow, one, place, log.depth is not None, run.run.verdict, figures, lines)


def _answer(found: Found, ranges: list[str], source: Path, out: Path | None) -> Answer:
    """ranges: what the interval assumes."""
    from .picture import plot
    from .report import figures, verdict_on, write_table

    tow, one, place, measured, verdict, beside, own = found
    told = figures(one, measured)
    verdict = verdict_on(verdict, told, one.notes)
    report = {"scene": tow.name, "path": str(source), **beside, **told}
    report |= {"assumed": [*own, *ranges], "notes": one.notes, "static_tows": one.statics, "static_cpu_s": one.cpu}
    report["copies"], report["copies_cpu_s"] = one.copies
    report["verdict"] = verdict.as_dict()
    files = []
    if out is not None:
        write_table(out / "layback.csv", one, place, measured, tow.seabed.depth)
        files = [("table", out / "layback.csv")]
        files += drawn(lambda: plot(one, out / "layback.png", f"{tow.name}, {source.name}", measured))
    kept = out and out / "layback.json"
    return Answer(report, lambda: _tell(report), kept, files, verdict=verdict.lines(), code=verdict.code)


def _tell(report: dict[str, Any]) -> None:
    found = {name: report[f"{name}_m"] for name in ("layback", "along_track", "offset", "depth")}
    found |= {f"95 % of {name}": values for name, values in report["interval_95_m"].items()}
    rows = [
        (name, *("-" if values[k] is None else f"{values[k]:.2f}" for k in ("min", "mean", "max")))
        for name, values in found.items()
    ]
    title = f"Layback of {report['scene']}, {report['duration_s']:.5g} s"
    print_table(title, ("figure, m", "least", "mean", "largest"), rows, left=("figure, m",))
    keys = ("apart_mean_m", "apart_largest_m", "apart_largest_s", "layback_difference_mean_m")
    rows = [
        (row["way"], *("-" if row[key] is None else f"{row[key]:.1f}" for key in keys), str(row["no_solution"] or ""))
        for row in report["ways"]
    ]
    columns = ("way", "mean m", "largest m", "at s", "layback longer by m", "no solution")
    print_table("Ways: horizontal distance from the simulated towbody", columns, rows, left=("way",))
    if "depth_difference_m" in report:
        gap = report["depth_difference_m"]
        say(
            f"depth, simulated less measured: mean {gap['mean']:.2f} m, rms {gap['rms']:.2f} m, within the interval "
            f"for {100.0 * gap['share_within_interval']:.3g} % of the time"
        )
    for line in [*report["assumed"], *(f"note: {note}" for note in report["notes"])]:
        say(line)
