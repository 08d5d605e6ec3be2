"""`cable-sim ensemble`: the band of the towbody's place and of the tension, beside a node or over a recording."""

from __future__ import annotations

import re
import sys
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.options import (
    Answer,
    Count,
    answers,
    asks_json,
    drawn,
    folder_option,
    need_ros,
    node_options,
    progress_bar,
    ready,
    tow_scene_option,
)
from ...errors import CODE_DAMAGED, CODE_DOUBTFUL, CODE_OK
from ...terminal import say
from .limits import COPIES, LEAST_COPIES, MAX_COPIES, MAX_SEED, SEED

if TYPE_CHECKING:
    from ...sim.scene import Scene
    from .plan import EnsemblePlan
    from .recording import Followed

SHOWN = ("tension", "body_depth", "layback")


@click.command()
@click.argument("bag", required=False, type=click.Path(path_type=Path))
@click.option(
    "--file",
    "file",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="YAML file of the ensemble. Default: what the interval of cable-sim layback takes as not known.",
)
@tow_scene_option
@click.option(
    "--copies",
    type=Count(LEAST_COPIES, MAX_COPIES),
    metavar="N",
    help=f"Copies, in place of those of the file. Default: {COPIES}.",
)
@click.option("--seed", type=Count(0, MAX_SEED), metavar="N", help=f"Seed of the draws. Default: {SEED}.")
@folder_option("Folder for ensemble.csv and picture; of a bag. Default: runs/ensemble.")
@click.option(
    "--twins",
    type=Count(2, 10_000),
    metavar="N",
    help="Tows drawn from the same ranges: say how often the band holds them; of a bag.",
)
@click.option(
    "--outside",
    multiple=True,
    metavar="NAME=VALUE",
    help="Of every twin: drag (factor), speed, east, north (m/s), turn_deg or payout (m). Repeatable.",
)
@node_options(wait=60.0)
@answers
def ensemble(bag, file, scene, copies, seed, out, twins, outside, namespace, wait, open_) -> Answer:
    """Run perturbed copies of a tow on its inputs: the 95 % band of towbody and tension, and a look-ahead.

    Without BAG beside a running node, in a process of its own with low priority: see docs/ensemble.md. With BAG, a
    recording of the node or of cable-sim run, a table and a picture.
    """
    changed = {"copies": copies, "seed": seed}
    if bag is None:
        given = [name for name, value in (("--out", out), ("--twins", twins), ("--json", asks_json())) if value]
        if given or outside:
            name = (given or ["--outside"])[0]
            raise click.UsageError(f"{name} is of a bag; nothing was started. Give BAG, or leave it out")
        from .plan import load_plan

        load_plan(file, changed)  # refused before a node is waited for
        need_ros()
        from .beside import beside

        sys.exit(beside(file, changed, scene, namespace, wait, open_))
    if open_ or namespace != "/tow_sim":
        raise click.UsageError("--namespace and --open are of a node; nothing was simulated. Leave them or BAG out")
    if outside and not twins:
        raise click.UsageError("--outside is of twins; nothing was simulated. Give --twins N, or leave it out")
    return _over_a_bag(bag, file, changed, scene, out, twins, outside)


def _over_a_bag(bag, file, changed, scene, out, twins, outside) -> Answer:
    from ...io.scenes.document import find_bag
    from ...io.scenes.load import SceneWarning
    from .coverage import covered, outside_of
    from .plan import load_plan
    from .recording import CSV_NAME, JSON_NAME, doubts_of, figures, follow_recording, scene_kept, write_table

    values = outside_of(outside)
    source = find_bag(bag)
    tow = scene_kept(source, scene)
    plan = load_plan(file, changed, tow)
    folder = out or Path("runs") / "ensemble"
    ready(folder)
    with progress_bar() as progress:
        with warnings.catch_warnings(record=True, action="always") as warned:
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
    files = [("table", folder / CSV_NAME), *drawn(lambda: _picture(folder, one, tow, report))]
    return Answer(report, lambda: _tell(report), folder / JSON_NAME, files, code=report["exit_code"])


def of_copies(scene: Scene, texts: list[str]) -> list[str]:
    """Of the warnings of copies those that the scene itself does not have, one of a kind, with their number."""
    from ...io.scenes.load import scene_from_dict

    def kind(text: str) -> str:
        return re.sub(r"[-+]?\d[\d.e+-]*", "#", text.partition(": ")[2])

    with warnings.catch_warnings(record=True, action="always") as own:
        scene_from_dict(scene.model_dump(mode="json"), scene.name)
    known = {kind(str(item.message)) for item in own}
    found: dict[str, list[str]] = {}
    for text in texts:
        if kind(text) not in known:
            found.setdefault(kind(text), []).append(text)
    return [f"warned of {len(alike)} x in the copies, first: {alike[0].partition(': ')[2]}" for alike in found.values()]


def assumed(plan: EnsemblePlan) -> list[str]:
    """A line for each range, with its size."""
    from . import plan as ranges

    further = plan.ranges.items()
    return ranges.assumed(plan.half_widths) + [
        f"assumed: {key} is in {one.low:g} to {one.high:g} ({one.spread.value})" for key, one in further
    ]


def _picture(folder: Path, one: Followed, tow: Scene, report: dict[str, Any]) -> Path:
    from .copies import FIGURES
    from .coverage import plot
    from .recording import PICTURE

    panels = []
    for name in SHOWN:
        k = list(FIGURES).index(name)
        label = f"{name.removeprefix('body_')} [{FIGURES[name][3]}]"
        panels.append((label, one.low[:, k], one.median[:, k], one.high[:, k], one.tow[:, k]))
    title = f"{tow.name}: {one.members} copies over {report['duration_s']:.4g} s"
    return plot(folder / PICTURE, title, one.time, panels, report["level"])


def _tell(report: dict[str, Any]) -> None:
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
