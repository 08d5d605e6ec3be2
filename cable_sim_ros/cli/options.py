"""Options that mean the same in every command that takes them."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from pathlib import Path

import click

from .number import Number

CONVENTION_HELP = "Axes of the IMU and odometry messages in the bag; the node's motion.convention."
TOPIC_HELP = (
    "Topic of the bag for a kind (imu, odometry, command, command_position, command_velocity), as in imu=/mru/imu. May "
    "be repeated."
)
SET_HELP = (
    "A value by its dotted key, as the node's parameters: of the scene (water.density=1000), or of how messages are "
    "taken in (heave.imu_position=[1, 0, 2]). May be repeated."
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
EVERYTHING = "cable_sim_ros.everything"  # of click's context: print all figures


def _everything(context: click.Context, param: click.Parameter, value: bool) -> None:
    context.meta[EVERYTHING] = value


all_option = click.option(
    "--all",
    is_flag=True,
    expose_value=False,
    callback=_everything,
    help="Print every figure with its meaning, not only those that matter most for this run.",
)
out_option = click.option(
    "--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for the bag, figures and picture."
)

limits_option = click.option(
    "--limits",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="YAML file of limits that the scores must keep: exit code 1 where one is violated or was not scored.",
)
junit_option = click.option(
    "--junit",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write limits and doubts as JUnit's XML to FILE.",
)
markers_option = click.option(
    "--markers",
    type=Number(0.0, 1000.0, "Hz"),
    default=0.0,
    metavar="HZ",
    help="Rate of cable/markers in the bag of --out, for Foxglove and RViz. Default: none.",
)


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
    """--convention, --topic and --set, which mean the same in every command that takes them."""
    for option in (click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help=SET_HELP), bag_options):
        command = option(command)
    return command


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
