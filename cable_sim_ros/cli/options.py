"""The frame of a command and the options that mean the same in every command that takes them.

A command returns an Answer, and what is said, written and left with is the same for all of them. With --json the
figures alone are on standard output, and what else there is to say on standard error. Errors that a command reports in
one line have their text as the whole message; anything else keeps its traceback.

Every number is finite, and in a range that is said where it is not kept. ``--keys`` of commands whose file is of a kind
of its own lists what such a file may hold, and leaves; --report is a run as one HTML file that prints.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import wraps
from importlib import import_module
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from .. import extensions
from ..errors import CODE_FAILED, CODE_INPUT, CODE_OK, NEEDS_ROS, NO_PLACE, CableSimError, told_as
from ..files import write_text
from ..limits import LONGEST_RUN
from ..physics.parameter import Block
from ..terminal import clean, plain_console, say

if TYPE_CHECKING:
    from ..runs.summary import Run
    from ..sim.verdict import Verdict

ARGUMENTS = "cable_sim_ros.arguments"  # of click's context: the command line as typed

FILE, FOLDER = click.Path(dir_okay=False, path_type=Path), click.Path(file_okay=False, path_type=Path)
CONVENTION_HELP = "Axes of the IMU and odometry messages in the bag; the node's motion.convention."
TOPIC_HELP = (
    "Topic of the bag for a kind (imu, odometry, command, command_position, command_velocity), as in imu=/mru/imu. May "
    "be repeated."
)
SET_HELP = (
    "A value by its dotted key, as the node's parameters: of the scene (water.density=1000), or of how messages are "
    "taken in (heave.imu_position=[1, 0, 2]). May be repeated."
)
EVERYTHING = "cable_sim_ros.everything"  # of click's context: print all figures


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


def _verdict_on(error: BaseException) -> Verdict:
    """Of a run that an error ended: its own, of what is no tow, else that of its cause."""
    from ..sim.verdict import check, verdict_of

    found = getattr(error, "verdict", None)
    return found or verdict_of([check(getattr(error, "cause", CableSimError.cause), str(error))])


def _failed(reporter: Reporter, error: CableSimError) -> None:
    import numpy as np

    from ..physics.tick_output import TICK_OUTPUT
    from ..runs.summary import Run

    ended = getattr(error, "run", None)  # of a controller that raised: the run so far
    if ended is None:
        verdict = _verdict_on(error)
        scene = click.get_current_context().params.get("scene") or click.get_current_context().params.get("bag")
        name = Path(str(scene)).name if scene else "Cable tow"
        frames = np.recarray(0, dtype=TICK_OUTPUT)
        ended = Run(frames, {"scene": name}, str(error), verdict=verdict)
    reporter.write(ended)


class Answer(NamedTuple):
    """What a command found.

    figures: for the JSON; tell: prints them for a person; kept: file for the figures; files: what else was written,
    with a word for each, None: it was not; warnings: lines for standard error; verdict: its lines; code: of the exit.
    """

    figures: Any
    tell: Callable[[], None]
    kept: Path | None = None
    files: Sequence[tuple[str, Path | None]] = ()
    warnings: Sequence[str] = ()
    verdict: Sequence[str] = ()
    code: int = CODE_OK


def answers(function: Callable[..., Answer | None]) -> Callable[..., None]:
    """A function that returns an Answer, or None where it has said all there is, as one that click calls; with --json.
    It stands below the other options."""

    @click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
    @wraps(function)
    def command(as_json: bool, **given: Any) -> None:
        answer = function(**given)
        if answer is not None:
            deliver(answer, as_json)

    return command


def asks_json() -> bool:
    """Are the figures of this command to be JSON?"""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.params.get("as_json"))


def json_of(figures: Any) -> str:
    """The text of figures, on standard output and in files; what numpy counts in becomes a number."""
    return json.dumps(figures, indent=1, default=float)


def deliver(answer: Answer, quiet: bool) -> None:
    """Write, print, and leave with the code; quiet: the figures as JSON, the verdict only where it is not ok."""
    files = list(answer.files)
    if answer.kept is not None:
        write_text(answer.kept, json_of(answer.figures) + "\n")
        files.append(("figures", answer.kept))
    if quiet:
        say(json_of(answer.figures), lines=True)
    else:
        answer.tell()
    for text in answer.warnings:
        say(text, err=True)
    for what, path in files:
        if path is not None:
            say(f"{what + ':':11}{path}", err=quiet)
    leave(answer.verdict, answer.code, quiet)


def leave(verdict: Sequence[str], code: int, quiet: bool) -> None:
    """Say the lines of a verdict and leave with the code; quiet: only where it is not 0, on standard error."""
    if code or not quiet:
        for line in verdict:
            say(line, err=quiet)
    if code:
        sys.exit(code)


def drawn(*draws: Callable[[], Path]) -> list[tuple[str, Path]]:
    """Pictures, for the files of an Answer; none, with a warning, where matplotlib is not installed."""
    try:
        return [("picture", draw()) for draw in draws]
    except RuntimeError as error:
        say(f"warning: {error}", err=True)
        return []


@contextmanager
def progress_bar(unit: str = "s", quiet: bool = False) -> Iterator[Callable[[str, float, float], None]]:
    """Function (what, done, in all) that shows a bar on a terminal, else nothing; unit: of what is counted; quiet:
    show none, as with --json."""
    if quiet or asks_json() or not sys.stderr.isatty():
        yield lambda what, done, total: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    texts = (TextColumn(f"{{task.{name}}}", markup=False) for name in ("description", "fields[now]"))
    columns = next(texts), BarColumn(), next(texts), TimeElapsedColumn(), TimeRemainingColumn()
    with Progress(*columns, console=plain_console(err=True), transient=True) as bar:
        task = bar.add_task("loading", total=None, now="")
        yield lambda what, done, total: bar.update(
            task,
            description=clean(what),
            completed=done,
            total=total or None,
            now=f"{done:.0f} of {total:.0f} {unit}" if total else "",
        )


class NoRos(click.ClickException):
    """rclpy cannot be imported."""

    exit_code = CODE_INPUT


def need_ros() -> None:
    """Refuse a command of the node where there is no ROS. Raises NoRos."""
    try:
        import_module("rclpy")
    except ImportError as error:
        raise NoRos(f"this command {NEEDS_ROS.format(error=error)}") from None


def code_of(error: BaseException) -> int | None:
    """Exit code of an expected error, None for one that is a fault of the program."""
    if isinstance(error, CableSimError):
        return error.exit_code
    return CODE_INPUT if isinstance(error, OSError) else None


def report(error: BaseException, code: int, as_json: bool) -> int:
    """Say it in one line on stderr, and with --json as the verdict of a run that failed; returns the code."""
    say(f"error: {error}", err=True, lines=getattr(error, "lines", False))
    if as_json and code == CODE_FAILED:
        say(json_of({"problem": str(error), "verdict": _verdict_on(error).as_dict()}), lines=True)
    return code


def keys_option(kind: Callable[[], type[Block]], heading: str = "") -> Callable:
    """kind: gives the block of the whole file; called, and so imported, only where the option is used.

    heading: Markdown that stands above the tables.
    """

    def tell(context: click.Context, _parameter: click.Parameter, asked: bool) -> None:
        if not asked:
            return
        from ..runs.manual import tables

        say(heading + "\n".join(tables(kind())), nl=False, lines=True)
        context.exit()

    return click.option(
        "--keys", is_flag=True, is_eager=True, expose_value=False, callback=tell, help="List the keys of a FILE."
    )


class Number(click.FloatRange):
    """A finite number from ``minimum`` to ``maximum``; above: the least itself is refused; unit: as it stands in
    errors."""

    name = "number"

    def __init__(self, minimum: float, maximum: float, unit: str = "", *, above: bool = False):
        super().__init__(min=minimum, max=maximum, min_open=above)
        self.unit = f" {unit}" if unit else ""
        self.range = f"{'(' if above else '['}{minimum:g}, {maximum:g}]{self.unit}"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str | None:
        """In the help the unit stands for the number."""
        return self.unit.strip().upper() or None

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """The number; a usage error, code 2, where it is none, not finite or out of range."""
        try:
            number = float(value)
        except (TypeError, ValueError):
            self.fail(f"{value!r} is not a number; nothing was done. Give one in {self.range}", param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number; nothing was done. Give one in {self.range}", param, ctx)
        assert self.min is not None and self.max is not None
        if number > self.max or number < self.min or (self.min_open and number == self.min):
            self.fail(f"{number:g}{self.unit} is outside {self.range}; nothing was done", param, ctx)
        return number


class Count(click.IntRange):
    """A whole number from ``minimum`` to ``maximum``."""

    name = "count"

    def __init__(self, minimum: int, maximum: int):
        super().__init__(min=minimum, max=maximum)
        self.range = f"[{minimum}, {maximum}]"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> int:
        """The number; a usage error, code 2, where it is none or out of range."""
        try:
            number = int(value)
        except (TypeError, ValueError):
            self.fail(f"{value!r} is not a whole number; nothing was done. Give one in {self.range}", param, ctx)
        assert self.min is not None and self.max is not None
        if not self.min <= number <= self.max:
            self.fail(f"{number} is outside {self.range}; nothing was done. Give one inside", param, ctx)
        return number


def together(*options: Callable) -> Callable:
    """Arguments and options as one decorator; the help has them in this order."""

    def with_options(command: Callable) -> Callable:
        for option in reversed(options):
            command = option(command)
        return command

    return with_options


def folder_option(text: str) -> Callable:
    """--out of a command that writes several files; text: its help."""
    return click.option("--out", type=FOLDER, help=text)


def set_option(text: str = SET_HELP) -> Callable:
    """--set; text: its help."""
    return click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help=text)


def force_option(text: str = "Replace a file that is there.") -> Callable:
    """--force; text: its help."""
    return click.option("--force", is_flag=True, help=text)


def _everything(context: click.Context, param: click.Parameter, value: bool) -> None:
    context.meta[EVERYTHING] = value


all_option = click.option(
    "--all",
    is_flag=True,
    expose_value=False,
    callback=_everything,
    help="Print every figure with its meaning, not only those that matter most for this run.",
)
out_option = folder_option("Folder for the bag, figures and picture.")
limits_option = click.option(
    "--limits",
    type=FILE,
    metavar="FILE",
    help="YAML file of limits that the scores must keep: exit code 1 where one is violated or was not scored.",
)
junit_option = click.option(
    "--junit", type=FILE, metavar="FILE", help="Write limits and doubts as JUnit's XML to FILE."
)
markers_option = click.option(
    "--markers",
    type=Number(0.0, 1000.0, "Hz"),
    default=0.0,
    show_default="none",
    help="Rate of cable/markers in the bag of --out, for Foxglove and RViz.",
)
setpoint_option = click.option(
    "--setpoint", "algorithm", metavar="NAME", help="Set-point algorithm in place of the scene's."
)
imu_option = click.option("--imu-only", is_flag=True, help="Leave the odometry of the bag out.")
start_option = click.option(
    "--start", type=Number(0.0, LONGEST_RUN, "s"), default=0.0, help="Seconds of the bag to skip."
)
bag_scene_option = click.option(
    "--scene", help="Scene in place of the one kept in the bag; needed where the bag keeps none."
)
tow_scene_option = click.option("--scene", help="Scene in place of the one that the bag keeps or the node has.")
workers_option = click.option(
    "--workers", type=click.IntRange(1, 4096), help="Processes. Default: one a core that memory holds."
)

bag_options = together(  # how a bag is read
    click.option("--convention", type=click.Choice(["enu", "ned"]), help=CONVENTION_HELP),
    click.option("--topic", "topics", multiple=True, metavar="KIND=NAME", help=TOPIC_HELP),
)
settings_options = together(bag_options, set_option())


def node_options(wait: float) -> Callable:
    """--namespace, --wait and --open: which node is listened to, and how; wait: default [s]."""
    return together(
        click.option("--namespace", default="/tow_sim", help="Namespace of the node."),
        click.option("--wait", type=Number(0.0, 3600.0, "s"), default=wait, help="How long to wait for the node."),
        click.option(
            "--open", "open_", is_flag=True, help="Listen to every host of the subnet, not to this one alone."
        ),
    )


def ready(out: Path | None) -> None:
    """Make the folder of --out and try to write in it, before anything is run; None: none was asked for.
    click.UsageError, code 2, where not."""
    if out is None:
        return
    after = "; nothing was run. Give a folder that can be"
    with told_as(click.UsageError, f"--out {out}: cannot be made or written", after, NO_PLACE):
        out.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=out).close()


def needs_out(markers: float, out: Path | None) -> None:
    """Refuse --markers where there is no bag to write them into."""
    if markers > 0.0 and out is None:
        raise click.UsageError("--markers writes into the bag of --out; nothing was simulated; give --out DIR")


class Heave(click.ParamType):
    """Amplitude [m] and period [s] of a heave, as in 1.2,8."""

    name = "M,S"

    def convert(self, value: str, param: click.Parameter | None, context: click.Context | None) -> tuple[float, float]:
        """The two numbers."""
        try:
            amplitude, period = map(float, value.split(","))
            if not (isfinite(amplitude) and isfinite(period)):
                raise ValueError
        except ValueError:
            self.fail(f"{value!r} is not an amplitude in m and a period in s, as in 1.2,8; nothing was simulated")
        return amplitude, period
