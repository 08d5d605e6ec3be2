"""Commands of the laboratory: cases, experiments, stress and benchmarks."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import click

from cable_sim_ros.cli.number import Count, Number
from cable_sim_ros.cli.out_folder import ready
from cable_sim_ros.cli.progress import progress_bar
from cable_sim_ros.cli.report_option import report_option, said, typed
from cable_sim_ros.limits import LONGEST_RUN
from cable_sim_ros.terminal import plain_console, say
from cable_sim_ros.tools.sweeps.command import WORKERS

from .experiments import EXPERIMENTS

FAILED = 1  # exit code where a value is missing or a limit is not kept
json_option = click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option(
    "--fidelity",
    type=click.Choice(["verification", "realtime"]),
    default="verification",
    show_default=True,
    help="Refined until settled, or the shipped step on a mesh for real time.",
)
@json_option
def case(files, fidelity, as_json) -> None:
    """Run verification cases: values from the product's own element, water, contact and integrator.

    With --json one object for one FILE, a list for several. Leaves with code 1 where a value is missing.
    """
    from .cases import Fidelity, load_case, run_case

    cases = [load_case(path) for path in files]
    done = []
    with progress_bar(as_json) as progress:
        for i, one in enumerate(cases):
            progress(one.id, i, len(cases))
            done.append(run_case(one, Fidelity(fidelity)))
    if as_json:
        report = [metrics._asdict() for metrics in done]
        say(json.dumps(report[0] if len(report) == 1 else report, indent=1), lines=True)
    else:
        from .cases.table import print_cases

        print_cases(done, cases)
    if any(o["value"] is None for metrics in done for o in metrics.outputs):
        sys.exit(FAILED)


@click.command()
@click.argument("names", nargs=-1, type=click.Choice(EXPERIMENTS), metavar="[NAME...]")
@click.option(
    "--duration",
    type=Number(0.5, LONGEST_RUN, "s"),
    metavar="S",
    help="Seconds of each experiment in time; default: 10 of pulley, 300 of turbulence.",
)
@click.option("--quick", is_flag=True, help="Shorter runs and fewer choices; what was left out is said beside them.")
@WORKERS
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for plots and figures.")
@report_option
@json_option
def validate(names, duration, quick, workers, out, report, as_json) -> None:
    """Repeat experiments of the source documents (default: all): measured, ours, allowed and who says so.

    Figures are the same for any number of workers, but for CPU times.
    """
    ready(out)
    from cable_sim_ros.tools.sweeps.engine import workers_of

    from .experiments.table import as_data, digest, page, print_result
    from .experiments.together import repeat

    drawn = out is not None or report is not None
    with progress_bar(as_json, "runs") as progress:
        results = repeat(names or EXPERIMENTS, duration, progress, quick, workers_of(workers), drawn)
    data = [as_data(result) for result in results]
    if report is not None:
        from .experiments.report import write_report

        said(write_report(results, report, typed()))
    if out is not None:
        (out / "validate.json").write_text(json.dumps(data, indent=1) + "\n", "utf-8")
        (out / "validate.md").write_text(page(results), "utf-8")
        (out / "experiments.md").write_text(digest(results), "utf-8")
        for result in results:
            say(f"plot:      {result.plot(out)}", err=True)
    if as_json:
        say(json.dumps(data, indent=1), lines=True)
        return
    for result in results:
        print_result(result)


# the keys of lab.stress.STRESS, whose import is long
STRESS_IDS = [*(f"N{i}" for i in range(1, 29)), "I10", "I11", "I12", "I14", "I16", "S1", "S2", "S3"]


@click.command()
@click.argument(
    "ids", nargs=-1, type=click.Choice(STRESS_IDS, case_sensitive=False), metavar="[N1 ... N28, I10 ... I16, S1 ... S3]"
)
@click.option("--quick", is_flag=True, help="Shorter runs; what was shortened is in the notes.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for table and JSON.")
@json_option
def stress(ids, quick, out, as_json) -> None:
    """Stability stress (default: all): measured against the limits. Leaves with code 1 where one is missed."""
    ready(out)
    from . import stress as stresses
    from .stress.table import markdown, print_verdicts

    with progress_bar(as_json) as progress:
        verdicts = stresses.run(tuple(ids), quick, progress)
    report = [verdict.as_dict() for verdict in verdicts]
    if out is not None:
        (out / "stress.json").write_text(json.dumps(report, indent=1, default=float) + "\n", "utf-8")
        (out / "stress.md").write_text(markdown(verdicts) + "\n", "utf-8")
    if as_json:
        say(json.dumps(report, indent=1, default=float), lines=True)
    else:
        print_verdicts(verdicts)
    if not all(verdict.passed for verdict in verdicts):
        sys.exit(FAILED)


# the scenes of bench.SCENES and against.TICKS, whose imports are long
BENCH_IDS, TICK_IDS = [f"P{i}" for i in range(1, 10)], ["full_scale", "side_scan"]


@click.command()
@click.argument(
    "scenes",
    nargs=-1,
    type=click.Choice([*BENCH_IDS, *TICK_IDS], case_sensitive=False),
    metavar="[P1 ... P9, full_scale, side_scan]",
)
@click.option("--peers", is_flag=True, help="Other codes beside ours, taking turns; needs the extra [peers].")
@click.option("--repeats", type=Count(1, 1000), help="Timed runs of each setting. Default: 5, of --features 15.")
@click.option("--features", is_flag=True, help="In place of scenes: what each feature of a scene costs a step.")
@click.option("--sheave-mesh", is_flag=True, help="In place of scenes: how fine a mesh the answers at the sheave need.")
@click.option("--mesh", "promises", is_flag=True, help="In place of scenes: is the error promised for a mesh kept?")
@click.option("--haul", is_flag=True, help="In place of scenes: what cable on the drum, cable out and elements cost.")
@click.option("--ticks", is_flag=True, help="In place of scenes: the longest tick in real time, a minute at 2 m/s.")
@click.option("--water", is_flag=True, help="In place of scenes: what each option of the water costs a tick.")
@click.option("--sweep", is_flag=True, help="In place of scenes: throughput of a sweep, per worker beside single runs.")
@click.option(
    "--against",
    metavar="COMMIT",
    help="Run times as ratios to those of an earlier commit, of P2, P5 to P9 and the ticks of full_scale and side_scan "
    "unless named.",
)
@click.option("--rounds", type=Count(1, 100), help="Rounds of --against, both versions in each. Default: 3.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for table, JSON and plots.")
@json_option
def bench(
    scenes, peers, repeats, features, sheave_mesh, promises, haul, ticks, water, sweep, against, rounds, out, as_json
) -> None:
    """Run time against error on the benchmark scenes (default: all), medians of runs that take turns."""
    asked = {"features": features, "sheave_mesh": sheave_mesh, "mesh": promises, "haul": haul}
    studies = [name for name, on in (asked | {"ticks": ticks, "water": water, "sweep": sweep}).items() if on]
    if against is not None:
        if studies or peers or repeats:
            raise click.UsageError(
                "--against compares two versions of this project by themselves: beside it stand names of benchmarks, "
                "--rounds, --out and --json alone; nothing was run. Leave the other options out"
            )
        ready(out)
        _compare(against, scenes, rounds, out, as_json)
        return
    if rounds:
        raise click.UsageError("--rounds are those of --against; nothing was run. Give --against COMMIT, or --repeats")
    if of_ticks := [name for name in scenes if name in TICK_IDS]:
        raise click.UsageError(
            f"{' '.join(of_ticks)}: ticks have a time only beside another version; nothing was run. Give --against "
            f"COMMIT, or benchmarks from P1 to P9"
        )
    if studies:
        if len(studies) > 1 or scenes or peers:
            raise click.UsageError(
                "--features, --sheave-mesh, --mesh, --haul, --ticks, --water and --sweep each stand alone: no scene "
                "and no --peers beside them"
            )
        if repeats and studies[0] not in ("features", "haul", "water", "sweep"):
            option = "--" + studies[0].replace("_", "-")
            raise click.UsageError(f"{option} repeats nothing; leave --repeats out")
        ready(out)
        _study(studies[0], repeats, out, as_json)
        return
    ready(out)
    from .benchmarks import bench as benchmarks

    with progress_bar(as_json) as progress:
        rows = benchmarks.bench(
            tuple(scenes) or benchmarks.SCENES,
            with_peers=peers,
            repeats=repeats or benchmarks.REPEATS,
            progress=progress,
        )
    report = [benchmarks.as_json(row) for row in rows]
    if out is not None:
        about = benchmarks.about()
        (out / "bench.json").write_text(json.dumps({"about": about, "rows": report}, indent=1) + "\n", "utf-8")
        (out / "bench.md").write_text(benchmarks.markdown(rows) + "\n", "utf-8")
        for path in benchmarks.plots(rows, out):
            say(f"plot:      {path}", err=True)
    if as_json:
        say(json.dumps(report, indent=1), lines=True)
        return
    from rich.table import Table

    table = Table(title="Run time against error", title_justify="left")
    for name in (
        "scene",
        "code",
        "setting",
        "elements",
        "step ms",
        "tension",
        "position",
        "CPU s/s",
        "us/el/it",
        "it/step",
        "note",
    ):
        table.add_column(name)
    for row in rows:
        table.add_row(*benchmarks.cells(row))
    plain_console(160).print(table)


def _compare(commit: str, names: tuple[str, ...], rounds: int | None, out: Path | None, as_json: bool) -> None:
    """Ratios to a commit: Markdown or JSON, both into the folder."""
    from .benchmarks import against
    from .benchmarks.bench import about

    with progress_bar(as_json, "runs") as progress:
        found = against.compare(commit, names or against.BENCHMARKS, rounds or against.ROUNDS, out, progress)
    data, text = {"about": about()} | against.as_json(found), against.markdown(found)
    _written("against", data, text, out, as_json)


def _study(name: str, repeats: int | None, out: Path | None, as_json: bool) -> None:
    """A study by the name of its option: Markdown or JSON, both into the folder."""
    found: Any
    data: Any
    if name == "features":
        from .benchmarks import features

        found = features.costs(repeats or features.TURNS)
        data, text = [row._asdict() for row in found], features.markdown(found)
    elif name == "mesh":
        from .meshes import mesh_other, mesh_promise

        found = mesh_promise.promises()
        with progress_bar(as_json) as progress:
            others = mesh_other.others(progress=progress)
        data = {"tows": [row._asdict() for row in found], "other_tows": [row._asdict() for row in others]}
        text = mesh_other.page(mesh_promise.markdown(found), mesh_other.markdown(others))
    elif name == "haul":
        from .benchmarks import haul_cost

        with progress_bar(False) as progress:
            found = haul_cost.study(repeats or haul_cost.TURNS, progress)
        data = found._asdict() | {"points": [point._asdict() for point in found.points]}
        text = haul_cost.markdown(found)
    elif name == "ticks":
        from .benchmarks import ticks

        with progress_bar(False) as progress:
            found = ticks.ticks(progress=progress)
        data, text = found._asdict(), ticks.markdown(found)
    elif name == "water":
        from .benchmarks import water_cost

        with progress_bar(as_json) as progress:
            found = water_cost.costs(repeats or water_cost.TURNS, progress)
        data, text = [row._asdict() | {"off": row.off, "on": row.on} for row in found], water_cost.markdown(found)
    elif name == "sweep":
        from .benchmarks import sweep_cost

        with progress_bar(as_json) as progress:
            found = sweep_cost.throughput(turns=repeats or sweep_cost.TURNS, progress=progress)
        data, text = [row._asdict() for row in found], sweep_cost.markdown(found)
    else:
        from . import sheave

        found = data = sheave.sweeps()
        text = sheave.markdown(found)
    _written(name, data, text, out, as_json)


def _written(name: str, data: Any, text: str, out: Path | None, as_json: bool) -> None:
    if out is not None:
        (out / f"{name}.json").write_text(json.dumps(data, indent=1) + "\n", "utf-8")
        (out / f"{name}.md").write_text(text + "\n", "utf-8")
    say(json.dumps(data, indent=1) if as_json else text, lines=True)


COMMANDS = (case, validate, stress, bench)
