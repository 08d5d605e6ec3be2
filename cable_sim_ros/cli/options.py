"""Options that mean the same in every command that takes them, and what they are checked for.

Every number is finite, and in a range that is said where it is not kept.

The option ``--keys`` of commands whose file is of a kind of its own: lists what such a file may hold, and leaves.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable
from math import isfinite
from pathlib import Path
from typing import Any

import click

from ..limits import LONGEST_RUN
from ..physics.parameter import Block
from ..terminal import say

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


def node_options(wait: float) -> Callable:
    """--namespace, --wait and --open: which node is listened to, and how; wait: default [s]."""

    def with_options(command: Callable) -> Callable:
        command = click.option(
            "--open", "open_", is_flag=True, help="Listen to every host of the subnet, not to this one alone."
        )(command)
        command = click.option(
            "--wait", type=Number(0.0, 3600.0, "s"), default=wait, help="How long to wait for the node."
        )(command)
        return click.option("--namespace", default="/tow_sim", help="Namespace of the node.")(command)

    return with_options


def ready(out: Path | None) -> None:
    """Make the folder of --out and try to write in it, before anything is run; None: none was asked for.
    click.UsageError, code 2, where not."""
    if out is None:
        return
    try:
        out.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=out).close()
    except (OSError, ValueError) as error:  # ValueError: a NUL in the name
        why = getattr(error, "strerror", None) or str(error)
        raise click.UsageError(
            f"--out {out}: cannot be made or written ({why}); nothing was run. Give a folder that can be"
        ) from None


def needs_out(markers: float, out: Path | None) -> None:
    """Refuse --markers where there is no bag to write them into."""
    if markers > 0.0 and out is None:
        raise click.UsageError("--markers writes into the bag of --out; nothing was simulated; give --out DIR")


def bag_options(command: Callable) -> Callable:
    """--convention and --topic: how a bag is read."""
    topic = click.option("--topic", "topics", multiple=True, metavar="KIND=NAME", help=TOPIC_HELP)
    convention = click.option("--convention", type=click.Choice(["enu", "ned"]), help=CONVENTION_HELP)
    return convention(topic(command))


def settings_options(command: Callable) -> Callable:
    """--convention, --topic and --set."""
    return bag_options(set_option()(command))


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
