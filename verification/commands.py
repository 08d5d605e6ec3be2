"""Commands of the laboratory: cases, experiments, stress and benchmarks."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cable_sim_ros.cli.answer import Answer, answers, json_of
from cable_sim_ros.cli.number import Count, Number
from cable_sim_ros.cli.options import folder_option, ready, workers_option
from cable_sim_ros.cli.progress import progress_bar
from cable_sim_ros.cli.report_option import report_option, said, typed
from cable_sim_ros.errors import CODE_FAILED, CODE_OK
from cable_sim_ros.limits import LONGEST_RUN
from cable_sim_ros.terminal import print_table, say

from .experiments import EXPERIMENTS

if TYPE_CHECKING:
    from .stress.verdict import Verdict


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
    from .cases.table import print_cases

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
        lambda: print_cases(done, cases),
        code=CODE_FAILED if missing else CODE_OK,
    )


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

    from .experiments.table import as_data, digest, page, print_result
    from .experiments.together import repeat

    drawn = out is not None or report is not None
    with progress_bar(unit="runs") as progress:
        results = repeat(names or EXPERIMENTS, duration, progress, quick, workers_of(workers), drawn)
    if report is not None:
        from .experiments.report import write_report

        said(write_report(results, report, typed()))
    files = []
    if out is not None:
        (out / "validate.md").write_text(page(results), "utf-8")
        (out / "experiments.md").write_text(digest(results), "utf-8")
        files = [("table", out / "validate.md"), *(("picture", result.plot(out)) for result in results)]

    def tell() -> None:
        for result in results:
            print_result(result)

    return Answer([as_data(result) for result in results], tell, out and out / "validate.json", files)


# the keys of lab.stress.STRESS, whose import is long
STRESS_IDS = [*(f"N{i}" for i in range(1, 29)), "I10", "I11", "I12", "I14", "I16", "S1", "S2", "S3"]


@click.command()
@click.argument(
    "ids", nargs=-1, type=click.Choice(STRESS_IDS, case_sensitive=False), metavar="[N1 ... N28, I10 ... I16, S1 ... S3]"
)
@click.option("--quick", is_flag=True, help="Shorter runs; what was shortened is in the notes.")
@folder_option("Folder for table and JSON.")
@answers
def stress(ids, quick, out) -> Answer:
    """Stability stress (default: all): measured against the limits. Leaves with code 1 where one is missed."""
    ready(out)
    from . import stress as stresses

    with progress_bar() as progress:
        return judged("stress", stresses.run(tuple(ids), quick, progress), out)


def judged(name: str, verdicts: list[Verdict], out: Path | None) -> Answer:
    """Verdicts on limits: their table and JSON; code 1 where one is missed."""
    from .stress.table import markdown, print_verdicts

    files = []
    if out is not None:
        files = [("table", out / f"{name}.md")]
        (out / f"{name}.md").write_text(markdown(verdicts) + "\n", "utf-8")
    code = CODE_OK if all(verdict.passed for verdict in verdicts) else CODE_FAILED
    figures = [verdict.as_dict() for verdict in verdicts]
    return Answer(figures, lambda: print_verdicts(verdicts), out and out / f"{name}.json", files, code=code)


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
@folder_option("Folder for table, JSON and plots.")
@answers
def bench(
    scenes, peers, repeats, features, sheave_mesh, promises, haul, ticks, water, sweep, against, rounds, out
) -> Answer:
    """Run time against error on the benchmark scenes (default: all), medians of runs that take turns."""
    asked = {"features": features, "sheave_mesh": sheave_mesh, "mesh": promises, "haul": haul}
    studies = [name for name, on in (asked | {"ticks": ticks, "water": water, "sweep": sweep}).items() if on]
    _refuse(studies, scenes, peers, repeats, against, rounds)
    ready(out)
    if against is not None:
        return _compared(against, scenes, rounds, out)
    return _study(studies[0], repeats, out) if studies else _timed(scenes, peers, repeats, out)


def _refuse(
    studies: list[str],
    scenes: tuple[str, ...],
    peers: bool,
    repeats: int | None,
    against: str | None,
    rounds: int | None,
) -> None:
    """Refuse options that do not go together."""
    if against is not None:
        if studies or peers or repeats:
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
    if len(studies) > 1 or (studies and (scenes or peers)):
        raise click.UsageError(
            "--features, --sheave-mesh, --mesh, --haul, --ticks, --water and --sweep each stand alone: no scene "
            "and no --peers beside them"
        )
    if repeats and studies and studies[0] not in ("features", "haul", "water", "sweep"):
        option = "--" + studies[0].replace("_", "-")
        raise click.UsageError(f"{option} repeats nothing; leave --repeats out")


def _timed(scenes: tuple[str, ...], peers: bool, repeats: int | None, out: Path | None) -> Answer:
    """Run time against error on the benchmark scenes."""
    from .benchmarks import bench as benchmarks

    with progress_bar() as progress:
        rows = benchmarks.bench(
            tuple(scenes) or benchmarks.SCENES,
            with_peers=peers,
            repeats=repeats or benchmarks.REPEATS,
            progress=progress,
        )
    figures, files = [benchmarks.as_json(row) for row in rows], []
    if out is not None:
        (out / "bench.json").write_text(json_of({"about": benchmarks.about(), "rows": figures}) + "\n", "utf-8")
        (out / "bench.md").write_text(benchmarks.markdown(rows) + "\n", "utf-8")
        files = [("figures", out / "bench.json"), ("table", out / "bench.md")]
        files += [("picture", path) for path in benchmarks.plots(rows, out)]
    columns = ("scene", "code", "setting", "elements", "step ms", "tension", "position", "CPU s/s", "us/el/it",
               "it/step", "note")  # fmt: skip
    cells = [benchmarks.cells(row) for row in rows]
    return Answer(figures, lambda: print_table("Run time against error", columns, cells, columns, 160), files=files)


def _compared(commit: str, names: tuple[str, ...], rounds: int | None, out: Path | None) -> Answer:
    """Ratios to a commit: Markdown or JSON, both into the folder."""
    from .benchmarks import against
    from .benchmarks.bench import about

    with progress_bar(unit="runs") as progress:
        found = against.compare(commit, names or against.BENCHMARKS, rounds or against.ROUNDS, out, progress)
    return _written("against", {"about": about()} | against.as_json(found), against.markdown(found), out)


def _study(name: str, repeats: int | None, out: Path | None) -> Answer:
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
        with progress_bar() as progress:
            others = mesh_other.others(progress=progress)
        data = {"tows": [row._asdict() for row in found], "other_tows": [row._asdict() for row in others]}
        text = mesh_other.page(mesh_promise.markdown(found), mesh_other.markdown(others))
    elif name == "haul":
        from .benchmarks import haul_cost

        with progress_bar() as progress:
            found = haul_cost.study(repeats or haul_cost.TURNS, progress)
        data = found._asdict() | {"points": [point._asdict() for point in found.points]}
        text = haul_cost.markdown(found)
    elif name == "ticks":
        from .benchmarks import ticks

        with progress_bar() as progress:
            found = ticks.ticks(progress=progress)
        data, text = found._asdict(), ticks.markdown(found)
    elif name == "water":
        from .benchmarks import water_cost

        with progress_bar() as progress:
            found = water_cost.costs(repeats or water_cost.TURNS, progress)
        data, text = [row._asdict() | {"off": row.off, "on": row.on} for row in found], water_cost.markdown(found)
    elif name == "sweep":
        from .benchmarks import sweep_cost

        with progress_bar() as progress:
            found = sweep_cost.throughput(turns=repeats or sweep_cost.TURNS, progress=progress)
        data, text = [row._asdict() for row in found], sweep_cost.markdown(found)
    else:
        from . import sheave

        found = data = sheave.sweeps()
        text = sheave.markdown(found)
    return _written(name, data, text, out)


def _written(name: str, figures: Any, text: str, out: Path | None) -> Answer:
    if out is not None:
        (out / f"{name}.md").write_text(text + "\n", "utf-8")
    files = [("table", out / f"{name}.md")] if out else []
    return Answer(figures, lambda: say(text, lines=True), out and out / f"{name}.json", files)


COMMANDS = (case, validate, stress, bench)
