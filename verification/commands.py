"""Commands of the laboratory: cases, experiments, stress and benchmarks."""

from __future__ import annotations

from functools import partial
from importlib import import_module
from pathlib import Path

import click

from cable_sim_ros.cli.options import (
    Answer,
    Count,
    Number,
    answers,
    drawn,
    folder_option,
    json_of,
    progress_bar,
    ready,
    report_option,
    said,
    together,
    typed,
    workers_option,
)
from cable_sim_ros.errors import CODE_FAILED, CODE_OK
from cable_sim_ros.files import finite, write_text
from cable_sim_ros.limits import LONGEST_RUN
from cable_sim_ros.terminal import print_table, say

from .experiments import EXPERIMENTS
from .stress.command import stress, with_table

__all__ = ["bench", "case", "stress", "validate"]


@click.command()
@click.argument("files", nargs=-1, required=True, metavar="FILE...")
@click.option(
    "--fidelity",
    type=click.Choice(["verification", "realtime"]),
    default="verification",
    help="Refined until settled, or the shipped step on a mesh for real time.",
)
@answers
def case(files, fidelity) -> Answer:
    """Run verification cases: values from the product's own element, water, contact and integrator.

    With --json one object for one FILE, a list for several. Leaves with code 1 where a value is missing.
    """
    from .cases import Fidelity, load_case, run_case

    cases = [load_case(path) for path in files]
    done = []
    with progress_bar() as progress:
        for i, one in enumerate(cases):
            progress(one.id, i, len(cases))
            done.append(run_case(one, Fidelity(fidelity)))
    figures = [metrics._asdict() for metrics in done]
    missing = any(o["value"] is None for metrics in done for o in metrics.outputs)
    return Answer(
        figures[0] if len(figures) == 1 else figures,
        lambda: _print_cases(done, cases),
        code=CODE_FAILED if missing else CODE_OK,
    )


def _print_cases(done: list, cases: list) -> None:
    """One table a case: output, value, unit; then mesh, step, time and notes."""

    def text(value) -> str:
        if value is None:
            return "no value"
        return ", ".join(f"{x:.8g}" for x in (value if isinstance(value, (list, tuple)) else (value,)))

    for metrics, one in zip(done, cases, strict=True):
        values = zip(one.outputs, metrics.outputs, strict=True)
        rows = [(output.name, text(found["value"]), output.unit) for output, found in values]
        print_table(metrics.id, ("output", "value", "unit"), rows, left=("output", "unit"))
        say(f"{metrics.elements} elements, step {metrics.dt_s:g} s, {metrics.cpu_s:.2f} CPU s")
        for note in metrics.notes:
            say(f"  {note}")


@click.command()
@click.argument("names", nargs=-1, type=click.Choice(EXPERIMENTS), metavar="[NAME...]")
@click.option(
    "--duration",
    type=Number(0.5, LONGEST_RUN, "s"),
    help="Seconds of each experiment in time; default: 10 of pulley, 300 of turbulence.",
)
@click.option("--quick", is_flag=True, help="Shorter runs and fewer choices; what was left out is said beside them.")
@workers_option
@folder_option("Folder for plots and figures.")
@report_option
@answers
def validate(names, duration, quick, workers, out, report) -> Answer:
    """Repeat experiments of the source documents (default: all): measured, ours, allowed and who says so.

    Figures are the same for any number of workers, but for CPU times.
    """
    ready(out)
    from cable_sim_ros.tools.sweeps.engine import workers_of

    from .experiments import repeat
    from .experiments.table import as_data, digest, page, print_result, write_report

    pictured = out is not None or report is not None
    with progress_bar(unit="runs") as progress:
        results = repeat(names or EXPERIMENTS, duration, progress, quick, workers_of(workers), pictured)
    if report is not None:
        said(write_report(results, report, typed()))

    def tell() -> None:
        for result in results:
            print_result(result)

    figures = [as_data(result) for result in results]
    if out is None:
        return Answer(figures, tell)
    write_text(out / "experiments.md", digest(results) + "\n")
    answer = with_table("validate", figures, page(results), out, tell)
    pictures = drawn(*(partial(result.plot, out) for result in results))
    return answer._replace(files=[*answer.files, *pictures])


# the scenes of bench.SCENES and against.TICKS, whose imports are long
BENCH_IDS, TICK_IDS = [f"P{i}" for i in range(1, 10)], ["full_scale", "side_scan"]
# option of bench that stands in place of scenes: module with study(repeats, progress) -> (data, Markdown), does it
# repeat anything, and what it answers
STUDIES = {
    "features": ("benchmarks.features", True, "what each feature of a scene costs a step."),
    "account": ("benchmarks.account", False, "what a step calls and copies, with each option off and on."),
    "sheave_mesh": ("sheave", False, "how fine a mesh the answers at the sheave need."),
    "mesh": ("meshes.mesh_promise", False, "is the error promised for a mesh kept?"),
    "haul": ("benchmarks.haul_cost", True, "what cable on the drum, cable out and elements cost."),
    "ticks": ("benchmarks.ticks", False, "the longest tick in real time, a minute at 2 m/s."),
    "lockstep": ("benchmarks.lockstep", True, "how fast a test goes in lockstep, and who works meanwhile."),
    "water": ("benchmarks.water_cost", True, "what each option of the water costs a tick."),
    "sweep": ("benchmarks.sweep_cost", True, "throughput of a sweep, per worker beside single runs."),
}


def _flag(name: str) -> str:
    return "--" + name.replace("_", "-")


@click.command()
@click.argument(
    "scenes",
    nargs=-1,
    type=click.Choice([*BENCH_IDS, *TICK_IDS], case_sensitive=False),
    metavar="[P1 ... P9, full_scale, side_scan]",
)
@click.option("--peers", is_flag=True, help="Other codes beside ours, taking turns; needs the extra [peers].")
@click.option("--repeats", type=Count(1, 1000), help="Timed runs of each setting. Default: 5, of --features 15.")
@together(
    *(
        click.option(_flag(name), is_flag=True, help=f"In place of scenes: {what}")
        for name, (*_, what) in STUDIES.items()
    )
)
@click.option(
    "--against",
    metavar="COMMIT",
    help="Run times as ratios to those of an earlier commit, of P2, P5 to P9 and the ticks of full_scale and side_scan "
    "unless named.",
)
@click.option("--rounds", type=Count(1, 100), help="Rounds of --against, both versions in each. Default: 3.")
@folder_option("Folder for table, JSON and plots.")
@answers
def bench(scenes, peers, repeats, against, rounds, out, **options) -> Answer:
    """Run time against error on the benchmark scenes (default: all), medians of runs that take turns."""
    chosen = [name for name in STUDIES if options[name]]
    _together(chosen, scenes, peers, repeats, against, rounds)
    ready(out)
    if against is not None:
        from .benchmarks.against import study as compare

        with progress_bar(unit="runs") as progress:
            return with_table("against", *compare(against, scenes, rounds, out, progress), out)
    if chosen:
        (name,) = chosen
        with progress_bar() as progress:
            return with_table(name, *import_module(f".{STUDIES[name][0]}", __package__).study(repeats, progress), out)
    return _timed(scenes, peers, repeats, out)


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


def _timed(scenes: tuple[str, ...], peers: bool, repeats: int | None, out: Path | None) -> Answer:
    """Rows of the benchmark scenes, and their plots into the folder."""
    from .benchmarks import bench as benchmarks
    from .benchmarks.row import about

    with progress_bar() as progress:
        rows = benchmarks.bench(
            scenes or benchmarks.SCENES, with_peers=peers, repeats=repeats or benchmarks.REPEATS, progress=progress
        )
    figures, lines = [finite(row._asdict()) for row in rows], [benchmarks.cells(row) for row in rows]
    head = benchmarks.HEAD.split(" | ")

    def tell() -> None:
        print_table("Run time against error", head, lines, left=head, width=160)
        if beside := list(benchmarks.beside_others(rows)):
            names = benchmarks.BESIDE.split(" | ")
            print_table("Beside the best of other codes at the same error", names, beside, left=names, width=160)

    answer = with_table("bench", figures, benchmarks.markdown(rows), out, tell)
    if out is None:
        return answer
    with_machine = out / "bench.json"
    write_text(with_machine, json_of({"about": about(), "rows": figures}) + "\n")
    pictures = drawn(*(partial(benchmarks.plot, rows, scene, out) for scene in dict.fromkeys(r.scene for r in rows)))
    return answer._replace(kept=None, files=[("figures", with_machine), *answer.files, *pictures])
