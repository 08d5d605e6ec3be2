"""Run time against error: ``cable-sim bench``. The product on P1 to P9, other codes beside it in the same process.

Each setting is run once to warm up and then REPEATS times, taking turns with the other settings and codes of its scene;
the figure is the median of the CPU time. A speed stands in one row with its mesh, step and error.
"""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cable_sim_ros.plots.run import canvas
from cable_sim_ros.runs.message_run import Progress, silent
from cable_sim_ros.terminal import markdown_table

from .. import ours
from ..ours import COARSEST, Setting, even, links
from ..scenes import errors
from . import haul_bench, tow_bench
from .row import METRES, Row, unrun
from .turns import in_turn

REPEATS = 5
OURS = "cable_sim_ros"
# P4 meshes: before, on and after the sheave
OVER_SHEAVE_COARSE, OVER_SHEAVE = ((0.33, 1), (0.29, 12), (0.38, 2)), ((0.32, 2), (0.32, 27), (0.36, 3))


SWEEPS: dict[str, tuple[Callable, tuple[Setting, ...]]] = {
    "P1": (ours.catenary, tuple(even(n) for n in (4, 8, 16, 32, 64))),
    "P2": (
        ours.released,
        tuple(
            even(n, dt, 0.5)
            for n, dt in (
                *((6, 0.01), (8, 0.005), (10, 0.005), (12, 0.005), (13, 0.01 / 3.0), (16, 0.01 / 3.0)),
                *((12, 0.0025), (14, 0.0025), (15, 0.002), (20, 0.0025), (20, 0.01 / 6.0), (24, 0.00125), (40, 0.001)),
            )
        )
        + links(*(even(n, dt, 0.5) for n, dt in ((20, 0.01), (40, 0.005), (80, 0.005), (80, 0.00125), (160, 0.00125)))),
    ),
    "P3": (ours.cantilever, tuple(even(n, dt, 0.5) for n, dt in ((4, 0.01), (6, 0.005), (8, 0.0025), (16, 0.001)))),
    "P4": (
        ours.pulled_over,
        (
            *(Setting(OVER_SHEAVE_COARSE, dt) for dt in (0.05, 0.04, 0.02)),
            *(Setting(OVER_SHEAVE, dt) for dt in (0.1 / 3.0, 0.0125)),
            *(even(n, dt) for n, dt in ((64, 0.01), (96, 0.01), (192, 0.005))),
        ),
    ),
    "P5": (
        ours.towed,
        (
            Setting(((0.6, 2), (0.3, 3), (0.1, 3)), 1.0 / 3.0, 0.5),
            *(Setting(((0.6, 2), (0.3, 3), (0.1, 4)), dt, 0.5) for dt in (1.0 / 3.0, 0.25)),
            *(Setting(COARSEST, dt, 0.5) for dt in (0.4, 1.0 / 3.0, 0.25, 0.2, 0.5 / 3.0, 0.15, 0.1)),
            *(Setting(((0.5, 4), (0.3, 4), (0.2, 6)), dt, 0.5) for dt in (0.2, 0.1)),
            Setting(((0.6, 5), (0.3, 6), (0.1, 6)), 0.1, 0.5),
            *(even(n, dt, 0.5) for n, dt in ((10, 0.1), (20, 0.1), (40, 0.1), (40, 0.05))),
            *links(
                *(Setting(((0.5, 8 * k), (0.3, 12 * k), (0.2, 16 * k)), 0.1, 0.5) for k in (1, 2)),
                *(even(n, dt, 0.5) for n, dt in ((20, 0.1), (40, 0.1), (80, 0.1), (160, 0.05))),
            ),
        ),
    ),
    "P6": (
        ours.towed,
        (
            *(even(69, dt, 0.5) for dt in (1.0 / 3.0, 0.2, 0.125, 0.1, 0.1 / 1.2, 0.1 / 1.5, 0.05)),
            Setting(((0.7, 25), (0.3, 44)), 0.1, 0.5),
        ),
    ),
}
TOWS: dict[str, Callable[[int, Progress], list[Row]]] = {
    "P7": tow_bench.rows,
    "P8": haul_bench.hauled,
    "P9": haul_bench.deep_tow,
}
SCENES = (*SWEEPS, *TOWS)
MAX_NAMES = 5  # beside each other in a legend
PEER_SCENES = ("P2", "P4", "P5", "P6")


def bench(
    scenes: tuple[str, ...] = SCENES, *, with_peers: bool = False, repeats: int = REPEATS, progress: Progress = silent
) -> list[Row]:
    """Rows of the chosen scenes. The lumped chain always runs where it can; the other codes with ``with_peers``."""
    rows = []
    for i, scene in enumerate(scenes):
        progress(scene, i, len(scenes))
        rows += TOWS[scene](repeats, progress) if scene in TOWS else _scene(scene, with_peers, repeats)
    return rows


def _scene(scene: str, with_peers: bool, repeats: int) -> list[Row]:
    solve, settings = SWEEPS[scene]
    jobs: list[tuple[str, Any, Callable]] = [(OURS, s, solve) for s in settings]
    rows: list[Row] = []
    if scene in PEER_SCENES:
        from ..peers import jobs_of

        more, missing = jobs_of(scene, all_codes=with_peers)
        jobs += more
        rows += [unrun(scene, code, "", why) for code, why in missing]
    problem = [""] * len(jobs)

    def attempt(k: int) -> tuple[float, Any]:
        if problem[k]:
            return float("nan"), None
        try:
            done = jobs[k][2](jobs[k][1])
            found = errors(scene, done.history)
        except Exception as error:  # another code's failure is a result of the table, not the end of it
            problem[k] = f"failed: {str(error).splitlines()[0][:160]}"
            return float("nan"), None
        return done.cpu_s / done.simulated_s, (done, found)

    times, last = in_turn([partial(attempt, k) for k in range(len(jobs))], repeats)
    for k, (code, setting, _) in enumerate(jobs):
        if problem[k]:
            rows.append(unrun(scene, code, str(setting), problem[k]))
            continue
        (run, (tension, position)), cpu = last[k], statistics.median(times[k])
        iterations, steps = getattr(run, "iterations", None), getattr(run, "steps", None)
        each = 1e6 * cpu * run.simulated_s / (run.elements * iterations) if iterations else None
        per_step, note = iterations / steps if iterations and steps else None, getattr(jobs[k][1], "note", "")
        errors_of = float(tension), float(position)
        rows.append(Row(scene, code, run.setting, run.elements, run.dt_s, *errors_of, cpu, each, per_step, note))
    return rows


HEAD = (
    "scene | code | setting | elements | step [ms] | error tension | error position | CPU s per s | us per element and "
    "iteration | iterations per step | note"
)
BESIDE = "scene | other code, setting | its larger error | ours | larger error | its CPU time over ours"


def markdown(rows: list[Row]) -> str:
    """The table of docs/benchmarks.md, and what stands beside the best of other codes."""
    table, beside = markdown_table([HEAD.split(" | "), *map(cells, rows)]), list(beside_others(rows))
    return f"{table}\n{markdown_table([BESIDE.split(' | '), *beside])}" if beside else table


def beside_others(rows: list[Row]) -> Iterator[tuple[str, ...]]:
    """Each setting of other codes that none of them undercuts, beside the cheapest of ours whose larger error is at
    most a tenth above its own: the cells of BESIDE."""
    for scene in PEER_SCENES:
        yield from _beside([row for row in rows if row.scene == scene])


def _beside(rows: list[Row]) -> Iterator[tuple[str, ...]]:
    timed = [(r.cpu_s_per_sim_s, max(r.error_tension, r.error_position), r) for r in rows]
    timed = sorted((row for row in timed if np.isfinite(row[:2]).all()), key=lambda row: row[:2])
    ours = [row for row in timed if row[2].code == OURS]
    others = [row for row in timed if row[2].code != OURS]
    best = front([row[:2] for row in others]) if others else []
    for cpu, error, other in (row for row in others if row[:2] in best):
        mine = next((row for row in ours if row[1] <= 1.1 * error), None)
        if mine is not None:
            names = (other.scene, f"{other.code} {other.setting}", f"{100 * error:.2g} %", mine[2].setting)
            yield *names, f"{100 * mine[1]:.2g} %", f"{cpu / mine[0]:.1f}"


def cells(r: Row) -> tuple[str, ...]:
    """A row as text: errors in percent (P7 to P9: position in cm)."""

    def number(x, form):
        return "-" if x is None or not np.isfinite(x) else form.format(x)

    where = number(100.0 * r.error_position, "{:.2g} cm" if r.scene in METRES else "{:.2g} %")
    return (
        r.scene,
        r.code,
        r.setting,
        str(r.elements or "-"),
        number(1e3 * r.dt_s, "{:.3g}") if r.dt_s else "-",
        number(100.0 * r.error_tension, "{:.2g} %"),
        where,
        number(r.cpu_s_per_sim_s, "{:.2g}"),
        number(r.us_per_element_iteration, "{:.2g}"),
        number(r.iterations_per_step, "{:.2f}"),
        r.note,
    )


def series(row: Row) -> str:
    """What a plot distinguishes: the codes, links, and in P7 the set-point algorithms with the model of the drum."""
    if row.code == OURS and " links" in row.setting:
        return f"{row.code}, links"
    return f"{row.code}, {' '.join(row.setting.split()[:2])}" if row.scene == "P7" else row.code


def front(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Of (cost, error), sorted by cost, those that no cheaper one undercuts: what the line of a code joins."""
    best = [points[0]]
    for point in points[1:]:
        if point[1] < best[-1][1]:
            best.append(point)
    return best


def plot(rows: list[Row], scene: str, folder: Path) -> Path:
    """Work-precision plot of a scene, a point a setting; RuntimeError where matplotlib is missing."""
    mine = [r for r in rows if r.scene == scene and np.isfinite(r.cpu_s_per_sim_s)]
    path = folder / f"bench_{scene.lower()}.png"
    title = f"{scene}: error over cost, a point a setting, lines the best of them"
    with canvas(path, (13.0, 6.0), title, "`cable-sim bench`: docs/benchmarks.md") as figure:
        for axis, what in zip(figure.subplots(1, 2), ("error_tension", "error_position"), strict=True):
            for name in dict.fromkeys(series(r) for r in mine):
                points = sorted(
                    (r.cpu_s_per_sim_s, max(getattr(r, what), 1e-9))
                    for r in mine
                    if series(r) == name and np.isfinite(getattr(r, what))
                )
                if points:
                    own = name.startswith(OURS)
                    drawn = axis.loglog(*zip(*points, strict=True), "o" if own else "s", label=name, ms=6)
                    axis.loglog(
                        *zip(*front(points), strict=True),
                        "-" if own else "--",
                        lw=2.0 if own else 1.0,
                        color=drawn[0].get_color(),
                    )
            unit = "m" if scene in METRES and what == "error_position" else "fraction"
            axis.set(title=f"{what.replace('_', ' of ').capitalize()} [{unit}]")
            axis.set(xlabel="CPU s per simulated s" if scene != "P1" else "CPU s")
        handles = axis.get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=min(max(len(handles[0]), 1), MAX_NAMES))
    return path
