"""`cable-sim tows`: a table of measured tows, each simulated as it was made; numbers fitted, depths with intervals."""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.options import Answer, answers, drawn, folder_option, progress_bar, set_option, workers_option
from ...files import write_csv
from ...terminal import print_table, say
from ..sweeps.command import stoppable

if TYPE_CHECKING:
    from .tows import Judged

DESIGN = 256  # tows between which all others are interpolated


@click.command()
@click.argument("table")
@click.option("--scene", required=True, metavar="NAME|FILE", help="Scene of the tows.")
@click.option("--map", "map_", required=True, metavar="NAME|FILE", help="What the columns of TABLE are: docs/tows.md.")
@click.option(
    "--free",
    multiple=True,
    metavar="KEY[=LOW:HIGH][~[MEAN:]SD]",
    help="A number of the scene that is fitted over all tows, as of cable-sim calibrate; two at most.",
)
@click.option("--group", default="", metavar="COLUMN", help="What tows have in common, in place of the map's `group`.")
@click.option(
    "--folds",
    type=click.IntRange(2, 1000),
    help="Parts of the groups, of which each is left out once. Default: a part a group.",
)
@click.option("--design", type=click.IntRange(64, 8192), default=DESIGN, help="Tows simulated to interpolate between.")
@set_option("A value of the scene by its key.")
@folder_option("Folder for runs, tows.csv, tows.json and tows.png; what was simulated there is not simulated again.")
@workers_option
@answers
def tows(table, scene, map_, free, group, folds, design, settings, out, workers) -> Answer:
    """Depths of the tows of TABLE from wire out, speed and angle, judged by groups that are left out.

    Exit codes: 0 ok; 2 bad input; 4 doubtful: the text says why.
    """
    from ...io.scenes.load import load_scene
    from ...runs.settings import apply_to_scene, settings_of
    from ..calibrate.free import free_of
    from ..sweeps.sweep import computed
    from .figures import draw, figures_of
    from .simulated import OWN, Setting, height_of, speeds_around
    from .table import TowsError, load_map, read_tows
    from .tows import judge

    base = apply_to_scene(load_scene(scene), given := settings_of(settings))
    if len(free) > 2:
        raise click.UsageError(f"--free: {len(free)} numbers; one or two can be told apart by depths. Fix the others")
    made = load_map(map_)
    height = height_of(base)
    read = read_tows(table, made, height, group, base.winch.max_rate)
    numbers = free_of(free, base) if free else []
    for key in (*given, *(one.key for one in numbers)):
        if key in OWN:
            raise TowsError(f"{key} is given, and each tow has it from {table}; nothing was simulated. Leave it out")
    place = str(Path(scene)) if Path(scene).is_file() else scene
    setting = Setting(place, base, given, made.begin, height, numbers)
    speeds = speeds_around(read.tows, frozenset(name for name, one in made.readings.items() if one.scaled))
    with (
        stoppable(out),
        tempfile.TemporaryDirectory(prefix="cable_sim_tows_") as scratch,
        progress_bar("tows") as progress,
    ):

        def run(cases: Any) -> list[dict[str, Any]]:
            folder = out if out is not None else scratch
            return computed(cases, folder, workers=workers, progress=partial(progress, "simulating"))[0]

        judged = judge(read, made, setting, speeds, design, folds, run)
    figures = figures_of(judged, setting.free)
    files = []
    if out is not None:
        write_csv(out / "tows.csv", figures["rows"][0], map(dict.values, figures["rows"]))
        files = [("table", out / "tows.csv"), *drawn(lambda: draw(judged, out / "tows.png"))]
    verdict = judged.verdict.lines(what={"doubtful": "its depths cannot be taken as they are"}, page="docs/tows.md")
    return Answer(
        figures,
        lambda: tell(judged, figures),
        out and out / "tows.json",
        files,
        warnings=read.notes[:20],
        verdict=verdict,
        code=judged.verdict.code,
    )


def tell(judged: Judged, figures: dict[str, Any]) -> None:
    """Print the numbers and the ways."""
    for one in figures["numbers"]:
        unit = f" {one['unit']}".rstrip()
        spread = "" if one["deviation"] is None else f" +- {one['deviation']:.2g}"
        say(f"{one['key']} = {one['value']:.4g}{spread}{unit} (scene: {one['scene']:.4g})")
    for name, scale in figures["scales"].items():
        say(f"scale of {name}: {scale:.3g}")
    rows = [
        (
            one.way,
            f"{one.tows}",
            f"{100 * one.bias:+.1f}",
            *(f"{100 * value:.1f}" for value in (one.spread, one.median, one.rms)),
            "" if one.held is None else f"{100 * one.held:.0f}",
        )
        for one in judged.ways
    ]
    heads = ("way to the depth", "tows", "bias %", "spread %", "median error %", "rms error %", "held of 100")
    print_table(f"{judged.made.tows}: groups left out, shares of the measured depth", heads, rows, left=(heads[0],))
    say(
        f"interpolated between {judged.between.tows} simulated tows; beside these tows simulated themselves off by "
        f"{100 * judged.apart[1]:.2g} % of depth rms, {100 * judged.apart[0]:.2g} % at most"
    )
    between = figures["interpolation"]
    if between["series"]:
        say(
            f"{between['series']} tows over time have designs of their own, between which depths are off by "
            f"{100 * between['series_rms_share']:.2g} % rms, {100 * between['series_max_share']:.2g} % at most"
        )
