"""Run times as ratios to an earlier commit: ``cable-sim bench --against COMMIT``.

A per cent here and there cannot be measured one by one; their sum against a fixed version can. Both trees run the same
benchmark in processes of their own, in turn. The earlier one is driven through its own command line alone, so that its
figures are what it says of itself; its error stands beside them.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.runs.message_run import Progress, silent
from cable_sim_ros.runs.summary import summarize
from cable_sim_ros.sim.checks.deviation_checks import SKIP
from cable_sim_ros.terminal import markdown_table

from .checkout import ROOT, CompareError, Tree, checked_out, described, first_that_runs
from .row import METRES, about
from .tow_bench import FINE_TICK, drive, refined
from .turns import in_turn

TICKS = ("full_scale", "side_scan")  # scenes whose ticks of real time are timed
BENCHMARKS = ("P2", "P5", "P6", "P7", "P8", "P9", *TICKS)
ROUNDS = 3
BAG, SECONDS = "nbp1406", 40.0  # of the ticks
TIMES = ("realtime_factor", "over_contact_")  # metrics of a row that begin so are run times
TICK_RESULTS = ("tension_mean_n", "tension_std_n", "body_depth_m", "body_position_m", "ticks", "steps", "iterations")
OURS = "cable_sim_ros"
COLUMNS = ("setting", "elements", "dt_s", "error_tension", "error_position", "cpu_s_per_sim_s")  # those of Found


class Found(NamedTuple):
    """One setting of a benchmark in one tree and round; results: what is no run time. Errors are fractions, of position
    metres in P7 to P9 and of ticks; None: the benchmark has none."""

    setting: str
    elements: int | None
    step_s: float
    error_tension: float | None
    error_position: float | None
    cpu_s_per_sim_s: float
    results: dict[str, Any]


class Ratio(NamedTuple):
    """A row: this tree beside the other one (in JSON ``there_``), each with its median cost; ratio: of these, below 1
    this tree is the faster one; least and largest of the rounds; same_bits: every result is the same in all of both."""

    benchmark: str
    here: Found
    there: Found
    ratio: float
    ratio_min: float
    ratio_max: float
    same_bits: bool

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        row = self._asdict()
        for side, found in (("", row.pop("here")), ("there_", row.pop("there"))):
            row |= {f"{side}{name}": value for name, value in found._asdict().items() if name != "results"}
        return row


class Comparison(NamedTuple):
    """Both commits, rounds, rows, geometric mean of the ratios of each benchmark, and in words what has no ratio."""

    commit: str
    against: str
    rounds: int
    rows: list[Ratio]
    means: dict[str, float]
    absent: list[str]


def compare(
    commit: str,
    names: Sequence[str] = BENCHMARKS,
    rounds: int = ROUNDS,
    out: Path | None = None,
    progress: Progress = silent,
    root: Path | None = None,
) -> Comparison:
    """Each benchmark in this tree and at a commit, ``rounds`` times in turn. Raises CompareError.

    Before the rounds each tree runs the benchmark once, which compiles its kernels and counts nothing.
    """
    root = root or ROOT
    rows: list[Ratio] = []
    absent: list[str] = []
    with checked_out(commit, out, root) as there:
        trees = there, Tree(described(root), root)
        for name in names:
            jobs = [partial(_timed, tree, name) for tree in trees]
            try:
                (theirs, mine), _ = in_turn(jobs, rounds, progress, [f"{name} at {tree.name}" for tree in trees])
            except _Absent as error:
                if error.tree is not there:
                    raise CompareError(f"{name} of this tree failed ({error}); nothing was compared. Mend it") from None
                absent.append(f"{there.name} does not run {name}: {error}")
                continue
            made, alone = ratios(name, mine, theirs, there.name)
            rows += made
            absent += alone
    if not rows:
        raise CompareError(f"--against {commit}: nothing was compared: {'; '.join(absent)}. Give a later commit")
    return Comparison(trees[1].name, there.name, rounds, rows, means(rows), absent)


class _Absent(Exception):
    """A tree does not run a benchmark; the text is its last words."""

    def __init__(self, tree: Tree, words: str) -> None:
        super().__init__(words.rstrip("."))
        self.tree = tree


def commands_of(name: str) -> list[list[str]]:
    """Arguments of ``cable-sim`` for a benchmark, the newest form first: an option may be younger than a commit."""
    if name not in TICKS:
        return [["bench", name, "--repeats", "1"]]
    run = ["run", name, "--motion", BAG, "--duration", f"{SECONDS:g}"]
    return [[*run, "--step", "fixed"], run]


def _timed(tree: Tree, name: str) -> tuple[list[Found], None]:
    report, words = first_that_runs(tree, commands_of(name))
    if report is None:
        raise _Absent(tree, words)
    try:
        return (ticks_found(name, report) if name in TICKS else rows_found(report)), None
    except (KeyError, TypeError, AttributeError) as error:
        raise _Absent(tree, f"its JSON is another one ({type(error).__name__}: {error})") from None


def rows_found(report: list[dict[str, Any]]) -> list[Found]:
    """Our own settings in what ``cable-sim bench --json`` printed, at any commit."""
    found = []
    for row in report:
        if row["code"] != OURS or row["cpu_s_per_sim_s"] is None:
            continue
        metrics = row.get("metrics", row.get("figures", {}))
        results = {name: value for name, value in metrics.items() if not name.startswith(TIMES)}
        results |= {name: row[name] for name in ("error_tension", "error_position", "iterations_per_step")}
        found.append(Found(*(row[key] for key in COLUMNS), results))
    return found


def ticks_found(name: str, report: dict[str, Any]) -> list[Found]:
    """The ticks of a scene in what ``cable-sim run --json`` printed, at any commit; elements are not in it."""
    if "problem" in report:
        raise KeyError(report["problem"])
    fine = reference(name)
    tension = max(abs(report[key] / fine[key] - 1.0) for key in ("tension_mean_n", "tension_std_n"))
    place = float(np.linalg.norm(np.subtract(report["body_position_m"], fine["body_position_m"])))
    step = round(report["duration_s"] / (report["ticks"] - 1), 4)
    results = {key: report[key] for key in TICK_RESULTS}
    return [Found(f"ticks of {BAG}", None, step, tension, place, 1.0 / report["realtime_factor"], results)]


@cache
def reference(name: str) -> dict[str, Any]:
    """Summary of the ticks of a scene on this tree's mesh doubled twice, with steps of FINE_TICK."""
    fine = refined(load_scene(name), 2, FINE_TICK)
    frames = drive(fine.scene, read_tow(find_bag(BAG)), fine.mesh, None, SECONDS).frames
    return summarize(frames, skip_s=SKIP)


def ratios(name: str, mine: list[list[Found]], theirs: list[list[Found]], other: str) -> tuple[list[Ratio], list[str]]:
    """Rows of a benchmark from the settings found in each round of both trees, and in words what has no partner."""
    rows, alone, taken = [], [], set()
    for k, first in enumerate(mine[0]):
        partner = partner_of(first, theirs[0])
        if partner is None:
            alone.append(first.setting)
            continue
        taken.add(partner)
        here, there = [found[k] for found in mine], [found[partner] for found in theirs]
        each = [a.cpu_s_per_sim_s / b.cpu_s_per_sim_s for a, b in zip(here, there, strict=True)]
        cost, base = (statistics.median(found.cpu_s_per_sim_s for found in tree) for tree in (here, there))
        rows.append(
            Ratio(
                name,
                first._replace(cpu_s_per_sim_s=cost),
                there[0]._replace(cpu_s_per_sim_s=base),
                cost / base,
                min(each),
                max(each),
                same_bits([*here, *there]),
            )
        )
    left = [found.setting for k, found in enumerate(theirs[0]) if k not in taken]
    words = [f"{name}: {other} has no setting {'; '.join(alone)}"] if alone else []
    return rows, words + ([f"{name}: only {other} has {'; '.join(left)}"] if left else [])


def partner_of(mine: Found, theirs: list[Found]) -> int | None:
    """Which of the other tree's settings a setting is compared with: the same one, or of a whole tow the same set-point
    and step on the mesh that the other tree had for it; None: none."""
    same = (k for k, found in enumerate(theirs) if found.setting == mine.setting)
    alike = (k for k, found in enumerate(theirs) if _same_tow(_tow(mine.setting), _tow(found.setting)))
    return next(same, next(alike, None))


def _tow(setting: str) -> tuple[str, str, str] | None:
    """Set-point, drum ("": not named) and step of a row of P7 to P9; None of P1 to P6 and of a refined reference."""
    law, _, rest = setting.partition(", ")
    mesh, _, step = rest.partition(", ")
    if not law.isidentifier() or "refined" in mesh:
        return None
    return law, mesh.partition(" ")[0] if " " in mesh else "", step


def _same_tow(mine: tuple[str, str, str] | None, other: tuple[str, str, str] | None) -> bool:
    if mine is None or other is None or (mine[0], mine[2]) != (other[0], other[2]):
        return False
    return mine[1] == other[1] or "" in (mine[1], other[1])


def same_bits(found: Sequence[Found]) -> bool:
    """Is every result that all of them have the same, to the last bit, of one setting?"""
    first = found[0]
    common = set(first.results).intersection(*(other.results for other in found))
    return all(
        (other.setting, other.step_s) == (first.setting, first.step_s)
        and all(other.results[key] == first.results[key] for key in common)
        for other in found
    )


def means(rows: list[Ratio]) -> dict[str, float]:
    """Geometric mean of the ratios of each benchmark."""
    names = dict.fromkeys(row.benchmark for row in rows)
    return {name: statistics.geometric_mean(r.ratio for r in rows if r.benchmark == name) for name in names}


def study(
    commit: str, names: Sequence[str], rounds: int | None, out: Path | None, progress: Progress
) -> tuple[dict[str, Any], str]:
    """The comparison as data, and as its table. Raises CompareError."""
    found = compare(commit, names or BENCHMARKS, rounds or ROUNDS, out, progress)
    return {"about": about()} | found._asdict() | {"rows": [row.as_dict() for row in found.rows]}, markdown(found)


def markdown(found: Comparison) -> str:
    """The table, the mean of each benchmark, and in words what has no ratio."""
    other = found.against
    head = ("benchmark", "setting", f"elements, {other}", "step [ms]", "CPU s per s", other, "ratio")
    head += (f"error tension, {other}", f"error position, {other}", "same bits")
    shown = ", ".join(f"{name} {mean:.3f}" for name, mean in found.means.items())
    return (
        f"This tree, {found.commit}, beside {other}: CPU s per simulated s, medians, rounds: {found.rounds}.\n"
        "A ratio below 1: this tree is faster. In brackets: least and largest of the rounds.\n\n"
        f"{markdown_table([head, *map(_cells, found.rows)])}\n\n"
        + "\n".join([f"Geometric mean of the ratios: {shown}.", *(f"* {words}" for words in found.absent)])
    )


def _cells(row: Ratio) -> tuple[str, ...]:
    here, there = row.here, row.there
    metres = row.benchmark in (*METRES, *TICKS)

    def percent(value: float | None) -> str:
        return "-" if value is None else f"{100.0 * value:.2g} %"

    def place(value: float | None) -> str:
        return f"{100.0 * value:.2g} cm" if metres and value is not None else percent(value)

    setting = here.setting if here.setting == there.setting else f"{here.setting} for {there.setting}"
    return (
        row.benchmark,
        setting,
        f"{here.elements or '-'}, {there.elements or '-'}",
        f"{1e3 * here.step_s:.3g}" if here.step_s else "-",
        f"{here.cpu_s_per_sim_s:.3g}",
        f"{there.cpu_s_per_sim_s:.3g}",
        f"{row.ratio:.3f} ({row.ratio_min:.3f} to {row.ratio_max:.3f})",
        f"{percent(here.error_tension)}, {percent(there.error_tension)}",
        f"{place(here.error_position)}, {place(there.error_position)}",
        "yes" if row.same_bits else "no",
    )
