"""Commands of the laboratory: cases, experiments, stress and benchmarks."""

from __future__ import annotations

import sys
from importlib import import_module
from pathlib import Path

import click

from cable_sim_ros.cli.number import Count, Number
from cable_sim_ros.cli.options import json_option
from cable_sim_ros.cli.out_folder import ready
from cable_sim_ros.cli.progress import progress_bar
from cable_sim_ros.cli.report_option import report_option, said, typed
from cable_sim_ros.limits import LONGEST_RUN
from cable_sim_ros.terminal import print_table, say
from cable_sim_ros.tools.sweeps.command import WORKERS

from .experiments import EXPERIMENTS
from .given_out import FAILED, give_out
from .stress.command import stress

__all__ = ["bench", "case", "stress", "validate"]


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
    data = [metrics._asdict() for metrics in done]
    give_out("case", data[0] if len(data) == 1 else data, "", None, as_json, lambda: _print_cases(done, cases))
    if any(o["value"] is None for metrics in done for o in metrics.outputs):
        sys.exit(FAILED)


def _print_cases(done: list, cases: list) -> None:
    """One table a case: output, value, unit; then mesh, step, time and notes."""

    def text(value) -> str:
        if value is None:
            return "no value"
        return ", ".join(f"{x:.8g}" for x in (value if isinstance(value, (list, tuple)) else (value,)))

    for metrics, one in zip(done, cases, strict=True):
        values = zip(one.outputs, metrics.outputs, strict=True)
        rows = [(output.name, text(found["value"]), output.unit) for output, found in values]
        print_table(metrics.id, ("output", "value", "unit"), rows, ("value",))
        say(f"{metrics.elements} elements, step {metrics.dt_s:g} s, {metrics.cpu_s:.2f} CPU s")
        for note in metrics.notes:
            say(f"  {note}")


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
    if report is not None:
        from .experiments.report import write_report

        said(write_report(results, report, typed()))
    if out is not None:
        (out / "experiments.md").write_text(digest(results) + "\n", "utf-8")
        for result in results:
            say(f"plot:      {result.plot(out)}", err=True)
    text = "" if out is None else page(results)

    def show() -> None:
        for result in results:
            print_result(result)

    give_out("validate", [as_data(result) for result in results], text, out, as_json, show)


# the scenes of bench.SCENES and against.TICKS, whose imports are long
BENCH_IDS, TICK_IDS = [f"P{i}" for i in range(1, 10)], ["full_scale", "side_scan"]
# option of bench that stands in place of scenes: module with study(repeats, progress) -> (data, Markdown), does it
# repeat anything, and what it answers
STUDIES = {
    "features": ("benchmarks.features", True, "what each feature of a scene costs a step."),
    "sheave_mesh": ("sheave", False, "how fine a mesh the answers at the sheave need."),
    "mesh": ("meshes.mesh_other", False, "is the error promised for a mesh kept?"),
    "haul": ("benchmarks.haul_cost", True, "what cable on the drum, cable out and elements cost."),
    "ticks": ("benchmarks.ticks", False, "the longest tick in real time, a minute at 2 m/s."),
    "water": ("benchmarks.water_cost", True, "what each option of the water costs a tick."),
    "sweep": ("benchmarks.sweep_cost", True, "throughput of a sweep, per worker beside single runs."),
}


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")


def studies(command):
    """An option for each of STUDIES."""
    for name, (_, _, what) in reversed(STUDIES.items()):
        command = click.option(_flag(name), is_flag=True, help=f"In place of scenes: {what}")(command)
    return command


@click.command()
@click.argument(
    "scenes",
    nargs=-1,
    type=click.Choice([*BENCH_IDS, *TICK_IDS], case_sensitive=False),
    metavar="[P1 ... P9, full_scale, side_scan]",
)
@click.option("--peers", is_flag=True, help="Other codes beside ours, taking turns; needs the extra [peers].")
@click.option("--repeats", type=Count(1, 1000), help="Timed runs of each setting. Default: 5, of --features 15.")
@studies
@click.option(
    "--against",
    metavar="COMMIT",
    help="Run times as ratios to those of an earlier commit, of P2, P5 to P9 and the ticks of full_scale and side_scan "
    "unless named.",
)
@click.option("--rounds", type=Count(1, 100), help="Rounds of --against, both versions in each. Default: 3.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for table, JSON and plots.")
@json_option
def bench(scenes, peers, repeats, against, rounds, out, as_json, **options) -> None:
    """Run time against error on the benchmark scenes (default: all), medians of runs that take turns."""
    chosen = [name for name in STUDIES if options[name]]
    _together(chosen, scenes, peers, repeats, against, rounds)
    ready(out)
    if against is not None:
        from .benchmarks.against import study as compare

        with progress_bar(as_json, "runs") as progress:
            data, text = compare(against, scenes, rounds, out, progress)
        give_out("against", data, text, out, as_json)
    elif chosen:
        (name,) = chosen
        with progress_bar(as_json) as progress:
            data, text = import_module(f".{STUDIES[name][0]}", __package__).study(repeats, progress)
        give_out(name, data, text, out, as_json)
    else:
        _scenes(scenes, peers, repeats, out, as_json)


def _together(chosen, scenes, peers, repeats, against, rounds) -> None:
    """click.UsageError where these options do not go together."""
    if against is not None:
        if chosen or peers or repeats:
            raise click.UsageError(
                "--against compares two versions of this project by themselves: beside it stand names of benchmarks, "
                "--rounds, --out and --json alone; nothing was run. Leave the other options out"
            )
        return
    if rounds:
        raise click.UsageError("--rounds are those of --against; nothing was run. Give --against COMMIT, or --repeats")
    if of_ticks := [name for name in scenes if name in TICK_IDS]:
        raise click.UsageError(
            f"{' '.join(of_ticks)}: ticks have a time only beside another version; nothing was run. Give --against "
            f"COMMIT, or benchmarks from P1 to P9"
        )
    if chosen and (len(chosen) > 1 or scenes or peers):
        *first, last = map(_flag, STUDIES)
        raise click.UsageError(f"{', '.join(first)} and {last} each stand alone: no scene and no --peers beside them")
    if chosen and repeats and not STUDIES[chosen[0]][1]:
        raise click.UsageError(f"{_flag(chosen[0])} repeats nothing; leave --repeats out")


def _scenes(scenes, peers, repeats, out, as_json) -> None:
    """Rows of the benchmark scenes, and their plots into the folder."""
    from .benchmarks import bench as benchmarks
    from .benchmarks.row import about

    with progress_bar(as_json) as progress:
        rows = benchmarks.bench(
            scenes or benchmarks.SCENES, with_peers=peers, repeats=repeats or benchmarks.REPEATS, progress=progress
        )
    data = [benchmarks.as_json(row) for row in rows]
    filed = None if out is None else {"about": about(), "rows": data}
    lines = [benchmarks.cells(row) for row in rows]

    def show() -> None:
        print_table("Run time against error", benchmarks.HEAD.split(" | "), lines, width=160)

    give_out("bench", data, benchmarks.markdown(rows), out, as_json, show, filed)
    if out is not None:
        for path in benchmarks.plots(rows, out):
            say(f"plot:      {path}", err=True)
