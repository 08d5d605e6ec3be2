"""`cable-sim ensemble`: the band of the towbody's place and of the tension, beside a node or over a recording."""

from __future__ import annotations

import json
import re
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.number import Count, Number
from ...cli.out_folder import ready
from ...errors import CODE_DAMAGED, CODE_DOUBTFUL, CODE_OK
from ...files import write_text
from ...terminal import clean, plain_console, say
from .limits import COPIES, LEAST_COPIES, MAX_COPIES, MAX_SEED, SEED

if TYPE_CHECKING:
    from ...sim.scene import Scene
    from .plan import EnsemblePlan
    from .recording import Followed

SHOWN = ("tension", "body_depth", "layback")


@click.command()
@click.argument("bag", required=False, type=click.Path(path_type=Path))
@click.option("--file", "file", type=click.Path(path_type=Path), metavar="FILE", help="YAML file of the ensemble. "
              "Default: what the interval of cable-sim layback takes as not known.")  # fmt: skip
@click.option("--scene", help="Scene in place of the one that the bag keeps or the node has.")
@click.option("--copies", type=Count(LEAST_COPIES, MAX_COPIES), metavar="N",
              help=f"Copies, in place of those of the file. Default: {COPIES}.")  # fmt: skip
@click.option("--seed", type=Count(0, MAX_SEED), metavar="N",
              help=f"Seed of the draws. Default: {SEED}.")  # fmt: skip
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for ensemble.csv and picture; "
              "of a bag. Default: runs/ensemble.")  # fmt: skip
@click.option("--twins", type=Count(2, 10_000), metavar="N", help="Tows drawn from the same ranges: say how "
              "often the band holds them; of a bag.")  # fmt: skip
@click.option("--outside", multiple=True, metavar="NAME=VALUE", help="Of every twin: drag (factor), speed, east, north "
              "(m/s), turn_deg or payout (m). Repeatable.")  # fmt: skip
@click.option("--namespace", default="/tow_sim", show_default=True, help="Namespace of the node.")
@click.option("--wait", type=Number(0.0, 3600.0, "s"), default=60.0, show_default=True, metavar="S",
              help="How long to wait for the node.")  # fmt: skip
@click.option("--open", "open_", is_flag=True, help="Listen to every host of the subnet, not to this one alone.")
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else; of a bag.")
def ensemble(bag, file, scene, copies, seed, out, twins, outside, namespace, wait, open_, as_json) -> None:
    """Run perturbed copies of a tow on its inputs: the 95 % band of towbody and tension, and a look-ahead.

    Without BAG beside a running node, in a process of its own with low priority: see docs/ensemble.md. With BAG, a
    recording of the node or of cable-sim run, a table and a picture.
    """
    changed = {"copies": copies, "seed": seed}
    if bag is None:
        given = [name for name, value in (("--out", out), ("--twins", twins), ("--json", as_json)) if value]
        if given or outside:
            name = (given or ["--outside"])[0]
            raise click.UsageError(f"{name} is of a bag; nothing was started. Give BAG, or leave it out")
        from .plan import load_plan

        load_plan(file, changed)  # refused before a node is waited for
        _need_ros()
        from .beside import beside

        sys.exit(beside(file, changed, scene, namespace, wait, open_))
    if open_ or namespace != "/tow_sim":
        raise click.UsageError("--namespace and --open are of a node; nothing was simulated. Leave them or BAG out")
    if outside and not twins:
        raise click.UsageError("--outside is of twins; nothing was simulated. Give --twins N, or leave it out")
    _over_a_bag(bag, file, changed, scene, out, twins, outside, as_json)


def _over_a_bag(bag, file, changed, scene, out, twins, outside, as_json) -> None:
    from ...io.scenes.load import SceneWarning
    from ...io.scenes.resources import find_bag
    from .coverage import covered, outside_of
    from .plan import load_plan
    from .recording import CSV_NAME, JSON_NAME, doubts_of, figures, follow_recording, scene_kept, write_table

    values = outside_of(outside)
    source = find_bag(bag)
    tow = scene_kept(source, scene)
    plan = load_plan(file, changed, tow)
    folder = out or Path("runs") / "ensemble"
    ready(folder)
    with _bar(as_json) as progress:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            one = follow_recording(source, tow, plan, progress=progress)
        report = {"scene": tow.name, "path": str(source), **figures(one, plan)}
        if twins:
            report["coverage"] = covered(source, tow, plan, twins, values, progress)
    report["assumed"] = assumed(plan)
    ours = [item for item in warned if issubclass(item.category, SceneWarning)]
    for item in (item for item in warned if item not in ours):  # of a library: as it came
        warnings.warn_explicit(item.message, item.category, item.filename, item.lineno)
    odd = of_copies(tow, [str(item.message) for item in ours])
    odd += [*one.flags, *doubts_of(one, report, plan)]
    report["notes"] = [*one.notes, *odd, *([one.damage] if one.damage else [])]
    doubtful = CODE_DOUBTFUL if one.lost or odd or not one.settled.any() else CODE_OK
    report["exit_code"] = CODE_DAMAGED if one.damage else doubtful
    write_table(folder / CSV_NAME, one)
    write_text(folder / JSON_NAME, json.dumps(report, indent=1) + "\n")
    paths = [folder / CSV_NAME, folder / JSON_NAME, *_picture(folder, one, tow, report)]
    if as_json:
        say(json.dumps(report, indent=1), lines=True)
    else:
        _tell(report, paths)
    sys.exit(report["exit_code"])


def of_copies(scene: Scene, texts: list[str]) -> list[str]:
    """Of the warnings of copies those that the scene itself does not have, one of a kind, with their number."""
    from ...io.scenes.load import scene_from_dict

    def kind(text: str) -> str:
        return re.sub(r"[-+]?\d[\d.e+-]*", "#", text.partition(": ")[2])

    with warnings.catch_warnings(record=True) as own:
        warnings.simplefilter("always")
        scene_from_dict(scene.model_dump(mode="json"), scene.name)
    known = {kind(str(item.message)) for item in own}
    found: dict[str, list[str]] = {}
    for text in texts:
        if kind(text) not in known:
            found.setdefault(kind(text), []).append(text)
    return [f"warned of {len(alike)} x in the copies, first: {alike[0].partition(': ')[2]}" for alike in found.values()]


def assumed(plan: EnsemblePlan) -> list[str]:
    """A line for each range, with its size."""
    from ...physics.parameter import declared
    from ..layback.ranges import Ranges

    lines = []
    for row in declared(Ranges):
        unit = "" if row.unit == "1" else f" {row.unit}"
        lines.append(f"assumed: {row.doc} is within {getattr(plan.half_widths, row.key):g}{unit} (95 %, normal)")
    for key, one in plan.ranges.items():
        lines.append(f"assumed: {key} is in {one.low:g} to {one.high:g} ({one.spread.value})")
    return lines


def _picture(folder: Path, one: Followed, tow: Scene, report: dict[str, Any]) -> list[Path]:
    from .copies import FIGURES
    from .picture import plot
    from .recording import PICTURE

    panels = []
    for name in SHOWN:
        k = list(FIGURES).index(name)
        label = f"{name.removeprefix('body_')} [{FIGURES[name][3]}]"
        panels.append((label, one.low[:, k], one.median[:, k], one.high[:, k], one.tow[:, k]))
    title = f"{tow.name}: {one.members} copies over {report['duration_s']:.4g} s"
    try:
        return [plot(folder / PICTURE, title, one.time, panels, report["level"])]
    except RuntimeError as error:
        say(f"note: {error}", err=True)
        return []


def _tell(report: dict[str, Any], paths: list[Path]) -> None:
    say(
        f"{report['scene']}: {report['copies']} copies over {report['duration_s']:.4g} s; a true tow of the same "
        f"ranges is in the band {100.0 * report['level']:.3g} % of the time, on the mean over seeds"
    )
    for name, row in report["figures"].items():
        say(
            f"{name + ':':14}band {row['width_mean']:.4g} {row['unit']} wide (largest {row['width_max']:.4g}); "
            f"recorded inside {100.0 * row['recorded_inside']:.3g} % of the time"
        )
    if coverage := report.get("coverage"):
        _tell_coverage(coverage)
    for line in [*report["assumed"], *(f"note: {note}" for note in report["notes"])]:
        say(line)
    for row in report["lost"]:
        say(f"lost: copy {row['copy']} ({row['draw']}): {row['why']}", err=True)
    say(
        f"cost: {report['start_cpu_s']:.1f} s of CPU for static starts, {1e3 * report['cpu_per_copy_and_second']:.2f} "
        "ms a copy and second"
    )
    for path in paths:
        say(f"{path.suffix.removeprefix('.') + ':':11}{path}")


def _tell_coverage(told: dict[str, Any]) -> None:
    kinds = [("drawn", "from the same ranges")]
    if "outside" in told:
        kinds.append(("set_outside", "with " + ", ".join(f"{k} = {v:g}" for k, v in told["outside"].items())))
    for key, words in kinds:
        say(f"{told['twins']} twins {words}, {told['ensembles']} ensembles of {told['copies']} copies:")
        for name, row in told[key].items():
            say(
                f"  {name + ':':14}{100.0 * row['share']:.1f} % of time and twins inside ({100.0 * row['low']:.1f} to "
                f"{100.0 * row['high']:.1f}, 95 %)"
            )


@contextmanager
def _bar(quiet: bool) -> Iterator[Any]:
    if quiet or not sys.stderr.isatty():
        yield lambda what, done, total: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("{task.description}", markup=False), BarColumn(), TimeRemainingColumn()
    with Progress(*columns, console=plain_console(err=True)) as bar:
        task = bar.add_task("following", total=None)
        yield lambda what, done, total: bar.update(task, description=clean(what), completed=done, total=total or None)


def _need_ros() -> None:
    from ...errors import NEEDS_ROS

    try:
        import_module("rclpy")
    except ImportError as error:
        raise click.UsageError(f"this command {NEEDS_ROS.format(error=error)}") from None
