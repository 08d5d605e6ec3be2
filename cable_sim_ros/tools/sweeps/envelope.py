"""Operating envelope: what a tow bears over sea, speed and scope, by extremes over seeds and the rules on watch.

A cell is a combination of what a sweep varies, all seeds of it together. An extreme of a cell: its mean over the seeds
with a Student interval, and the value that a run of this length passes once in twenty, by a Gumbel distribution through
the mean and deviation of the seeds (method of moments: Gumbel 1958, Statistics of Extremes). The share of runs that
break a rule has an exact binomial interval (Clopper and Pearson 1934, Biometrika 26, 404).
"""

from __future__ import annotations

import json
from collections import defaultdict
from math import log, pi, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest
from scipy.stats import t as student

from ...errors import CableSimError
from ...files import finite
from ...terminal import in_lines, plain_console, say
from ..report.sweep_page import named
from .dataset import names_of
from .figures import BROKEN, RULE, refuse_texts, significant
from .sweep import Swept
from .sweep_file import SweepPlan

LEVEL, ONCE_IN = 0.95, 20
FEWEST = 5  # seeds for what is passed once in ONCE_IN runs: the deviation of fewer is not known
CAPTION = f"extremes of each run: mean of the seeds (95 % interval), worst of any run, passed once in {ONCE_IN} runs"
SEED = "seed"
EXTREMES = (  # figure, its end, words
    ("tension_max_n", 1.0, "largest tension"),
    ("tension_min_n", -1.0, "least tension"),
    ("body_depth_max_m", 1.0, "largest depth"),
    ("body_depth_min_m", -1.0, "least depth"),
    ("winch_pull_max_n", 1.0, "largest drum tension"),
    ("winch_rate_max_m_s", 1.0, "largest rate of pay-out"),
    ("winch_power_max_w", 1.0, "largest power of the winch"),
    ("contact_resultant_max_n", 1.0, "largest load of the sheave"),
)
KEPT = "allowed"
PANELS = (  # figure, title
    (KEPT, "runs within the rules"),
    ("tension_max_n", "largest tension [N]\nmean of the seeds"),
    ("tension_min_n", "least tension [N]\nmean of the seeds"),
    ("body_depth_min_m", "least depth [m]\nmean of the seeds"),
)
WIDE = 180  # characters of a table in a file or a pipe
MISSING = "#d9dde1"
LINES = 6  # of panels in the picture


class EnvelopeError(CableSimError, ValueError):
    """Rows that make no envelope."""


class Extreme(NamedTuple):
    """Of a figure that is the extreme of a run, over the seeds of a cell: mean, its interval, the worst of any run,
    what is passed once in ONCE_IN runs; NaN: of one seed, the last of fewer than FEWEST."""

    mean: float
    low: float
    high: float
    worst: float
    rare: float


class Share(NamedTuple):
    """Runs that break a rule, of how many, with the interval of the share."""

    broken: int
    runs: int
    low: float
    high: float


class Cell(NamedTuple):
    """varied: by key; failed, doubtful: runs without figures, and runs whose figures are doubtful; rules: on watch, by
    name, of the runs that have a reading; within: runs that broke none of them, None: none is on watch, nothing ran, or
    no run has a reading of all; unread: rules without a reading in some run; alike: its seeds gave the same run."""

    varied: dict[str, Any]
    runs: int
    failed: int
    doubtful: int
    extremes: dict[str, Extreme]
    rules: dict[str, Share]
    within: int | None = None
    unread: tuple[str, ...] = ()
    alike: bool = False

    @property
    def allowed(self) -> bool | None:
        """No run of it failed or broke a rule; whether it was right to be sure of that says the interval. None: no rule
        was on watch, nothing ran, or a rule has no reading."""
        if self.within is None:
            return None
        if self.failed or any(share.broken for share in self.rules.values()):
            return False
        return None if self.unread else self.within == self.runs

    @property
    def ran(self) -> int:
        """Runs that have figures."""
        return self.runs - self.failed


def extreme_of(values: np.ndarray, end: float) -> Extreme:
    """Of the extremes [n] of n seeds; end: 1 the largest, -1 the least."""
    mean, n = float(values.mean()), len(values)
    worst = float((end * values).max() * end)
    if n < 2:
        return Extreme(mean, np.nan, np.nan, worst, np.nan)
    deviation = float(values.std(ddof=1))
    half = float(student.ppf(0.5 + 0.5 * LEVEL, n - 1)) * deviation / sqrt(n)
    if n < FEWEST:
        return Extreme(mean, mean - half, mean + half, worst, np.nan)
    reduced = -log(-log(1.0 - 1.0 / ONCE_IN))
    rare = mean + end * sqrt(6.0) / pi * deviation * (reduced - float(np.euler_gamma))
    return Extreme(mean, mean - half, mean + half, worst, rare)


def envelope(swept: Swept) -> list[Cell]:
    """Cells of a sweep in the order of its cases."""
    groups: dict[str, list[tuple[dict[str, Any], dict[str, Any]]]] = defaultdict(list)
    for case, row in zip(swept.cases, swept.rows):
        varied = {key: value for key, value in case.varied.items() if key != SEED}
        groups[json.dumps(varied)].append((varied, row))
    rules = [name for name in names_of(swept) if name.startswith(RULE) and name.endswith(BROKEN)]
    return [_cell(group[0][0], [row for _, row in group], rules) for group in groups.values()]


def _cell(varied: dict[str, Any], rows: list[dict[str, Any]], rules: list[str]) -> Cell:
    whole = [row for row in rows if row["verdict"] != "failed"]
    table = {name: np.array([row.get(name, np.nan) for row in whole], float) for name, *_ in EXTREMES}
    table = {name: values for name, values in table.items() if len(values) and np.isfinite(values).all()}
    alike = len(whole) > 1 and bool(table) and all(np.ptp(values) == 0.0 for values in table.values())
    extremes = {  # one run, however often: no interval
        name: extreme_of(table[name][:1] if alike else table[name], end) for name, end, _ in EXTREMES if name in table
    }
    rules = [name for name in rules if any(name in row for row in whole)]
    broken = np.array([[row.get(name, np.nan) for name in rules] for row in whole], float)
    broken = broken.reshape(len(whole), len(rules))
    shares, unread = {}, []
    for name, column in zip(rules, broken.T, strict=True):
        read = column[np.isfinite(column)][: 1 if alike else None]
        word = name.removeprefix(RULE).removesuffix(BROKEN)
        if len(read):
            interval = binomtest(int(read.sum()), len(read)).proportion_ci(LEVEL)
            shares[word] = Share(int(read.sum()), len(read), float(interval.low), float(interval.high))
        if not np.isfinite(column).all():
            unread.append(word)
    doubtful = sum(row["verdict"] == "doubtful" for row in rows)
    judged = np.isfinite(broken).all(axis=1)
    clear = judged & ~(broken > 0.0).any(axis=1)
    within = int(clear.sum()) if rules and (judged.any() or (broken > 0.0).any()) else None
    return Cell(
        varied, len(rows), len(rows) - len(whole), doubtful, extremes, shares, within, tuple(sorted(unread)), alike
    )


def as_dict(cell: Cell) -> dict[str, Any]:
    """For JSON."""
    return {
        **{name: getattr(cell, name) for name in ("varied", "runs", "failed", "doubtful", "allowed", "within")},
        "unread": list(cell.unread),
        "alike": cell.alike,
        "extremes": {name: finite(one._asdict()) for name, one in cell.extremes.items()},
        "rules": {name: share._asdict() for name, share in cell.rules.items()} or None,
    }


def doubts_of(cells: list[Cell]) -> list[str]:
    """Why the cells are doubtful, beside their runs."""
    alike = [cell for cell in cells if cell.alike]
    if not alike:
        return []
    first = alike[0]
    where = ", ".join(f"{key} = {_word(value)}" for key, value in first.varied.items())
    return [
        f"the seeds of {len(alike)} of {len(cells)} cells gave the same run {first.ran} times (first: {where}): "
        "nothing that is random acts on it, and there is no interval. Leave seeds out, or give waves or turbulence"
    ]


def refuse_others(plan: SweepPlan, file: str) -> None:
    """Raise EnvelopeError where a sweep makes no cells, or keeps no figure of them."""
    if not plan.grid:
        raise EnvelopeError(f"{file}: varies nothing by grid; nothing was simulated. Give sea, speed or scope in grid")
    if plan.samples is not None:
        raise EnvelopeError(
            f"{file}: samples: each sample would be a cell of its own, in no order; nothing was simulated. Leave "
            "samples out, or take cable-sim sweep"
        )
    refuse_texts(plan.figures, "extremes")
    names = [name for name, *_ in EXTREMES]
    if plan.figures and not set(plan.figures) & set(names):
        raise EnvelopeError(
            f"{file}: figures keeps no extreme, so every cell would be empty; nothing was simulated. Leave figures "
            f"out, or name of {', '.join(names)}"
        )


def watched(cells: list[Cell]) -> bool:
    """Is any rule on watch?"""
    return any(cell.rules or cell.unread for cell in cells)


def notes_of(cells: list[Cell]) -> list[str]:
    """What a reader of the cells must know."""
    notes = []
    if not watched(cells) and any(cell.ran for cell in cells):
        notes.append(
            "The scene has no rules on watch: nothing is said of what is allowed. Set rules.set and thresholds, see "
            "docs/rules.md"
        )
    for name in sorted({name for cell in cells for name in cell.unread}):
        notes.append(
            f"Rule {name} has no reading in runs of {sum(name in cell.unread for cell in cells)} of {len(cells)} "
            "cells: these are not counted as within the rules. Make runs longer, or leave the rule out"
        )
    few = sorted({cell.ran for cell in cells if 0 < cell.ran < FEWEST})
    if few:
        notes.append(
            f"What one run in {ONCE_IN} passes is not given from fewer than {FEWEST} runs, here "
            f"{' and '.join(map(str, few))} of a cell: give seeds: {FEWEST} or more"
        )
    return notes


def rows_of(cells: list[Cell]) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of the table of the cells: columns for what is there."""
    rules, bad = watched(cells), any(cell.failed or cell.doubtful for cell in cells)
    head = [*map(named, cells[0].varied), "runs"]
    for words in ("largest", "least"):
        head += [f"{words} tension, mean [N]", "worst", f"once in {ONCE_IN}"]
    head += ["depth of all runs [m]", *(["rules broken"] if rules else []), *(["not ok"] if bad else [])]
    rows = []
    for cell in cells:
        broken = ", ".join(f"{name} {s.broken}/{s.runs}" for name, s in cell.rules.items() if s.broken)
        odd = [f"{n} {word}" for n, word in ((cell.doubtful, "doubtful"), (cell.failed, "failed")) if n]
        ends = [text for end in ("max", "min") for text in _texts(cell.extremes.get(f"tension_{end}_n"))]
        depth = [cell.extremes.get(f"body_depth_{end}_m") for end in ("min", "max")]
        band = " to ".join("-" if one is None else significant(one.worst, 1) for one in depth)
        if cell.unread:
            broken = ", ".join([*([broken] if broken else []), *(f"{name} not read" for name in cell.unread)])
        values = list(map(_word, cell.varied.values()))
        row = [*values, str(cell.runs), *ends, "-" if band == "- to -" else band]
        row += [(broken or "none") if cell.rules or cell.unread else "-"] if rules else []
        rows.append(row + (["; ".join(odd) or "none"] if bad else []))
    return head, rows


def tell(swept: Swept, cells: list[Cell]) -> None:
    """Print the table of the cells."""
    from rich.table import Table

    shown = Table(title=f"{swept.plan.sweep}: {CAPTION}", title_justify="left")
    head, rows = rows_of(cells)
    for name in head:
        key = name.partition(" ")[0] in cells[0].varied  # a key breaks at its dots alone
        shown.add_column(in_lines(*name.replace(".", ".\n").split("\n")) if key else name, justify="right", no_wrap=key)
    for row in rows:
        shown.add_row(*row)
    plain_console(WIDE).print(shown)
    swept.tell()
    for note in notes_of(cells):
        say(f"note: {note}")


def _texts(one: Extreme | None) -> list[str]:
    """Mean with its interval, worst and what is passed once in ONCE_IN runs, "-" for what there is not."""
    if one is None:
        return ["-"] * 3
    interval = "" if np.isnan(one.low) else f" ({significant(one.low)} to {significant(one.high)})"
    rare = "-" if np.isnan(one.rare) else significant(one.rare)
    return [f"{significant(one.mean)}{interval}", significant(one.worst), rare]


def draw(title: str, cells: list[Cell], path: Path) -> Path:
    """Runs within the rules, tensions and depth over the first two keys that vary, a line of panels for each value of a
    third, LINES at most; of others the first value. The heading says what is left out, and how cells are drawn in which
    nothing ran."""
    from matplotlib.patches import Patch

    from ...plots.run import canvas

    keys = [key for key in cells[0].varied if len({str(cell.varied[key]) for cell in cells}) > 1]
    x, y, third = (*keys[:3], "", "", "")[:3]
    rest = {key: cells[0].varied[key] for key in keys[3:]}
    kept = [cell for cell in cells if all(cell.varied[key] == value for key, value in rest.items())]
    every = list(dict.fromkeys(_at(cell, third) for cell in kept))
    lines = every[:LINES]
    less = f", the first {LINES} of {len(every)} values of {third}" if len(every) > LINES else ""
    heading = f"{title}{''.join(f', {key} = {_word(value)}' for key, value in rest.items())}{less}"
    panels = PANELS if watched(cells) else PANELS[1:]
    empty, many = any(not cell.ran for cell in kept), any(cell.runs > 1 for cell in kept)
    size = (4.0 * len(panels), 1.6 + 3.2 * len(lines) + 0.3 * empty)
    with canvas(path, size, heading, "`cable-sim envelope`: docs/sweeps.md") as figure:
        grid = figure.subplots(len(lines), len(panels), squeeze=False, sharex=True, sharey=True)
        for k, (name, words) in enumerate(panels):
            known = [value for cell in kept if np.isfinite(value := _value(cell, name))]
            ends = (0.0, 1.0) if name == KEPT or not known else (min(known), max(known))
            for axes, line in zip(grid[:, k], lines):
                _panel(axes, [cell for cell in kept if _at(cell, third) == line], name, (x, y), ends)
                axes.set_ylabel(
                    (f"{named(third)} = {line}\n\n" if third and k == 0 else "") + (named(y) if k == 0 else "")
                )
            grid[0, k].set_title(words if many else words.partition("\n")[0], size=12)
            grid[-1, k].set_xlabel(named(x))
        if empty:
            patch = Patch(facecolor=MISSING, edgecolor="white", hatch="///", label="no run came to its end")
            figure.legend(handles=[patch], loc="outside lower left")
    return path


def _panel(axes: Any, cells: list[Cell], name: str, keys: tuple[str, str], ends: tuple[float, float]) -> None:
    """One map of a figure over two keys, a number a cell; ends: of the colours, the same for all maps of a figure."""
    from matplotlib.patches import Rectangle

    xs, ys = (list(dict.fromkeys(_at(cell, key) for cell in cells)) for key in keys)
    grid = np.full((len(ys), len(xs)), np.nan)
    for cell in cells:
        i, j = xs.index(_at(cell, keys[0])), ys.index(_at(cell, keys[1]))
        grid[j, i] = _value(cell, name)
        if not cell.ran:
            axes.add_patch(Rectangle((i - 0.5, j - 0.5), 1, 1, facecolor=MISSING, edgecolor="white", hatch="///"))
    image = axes.imshow(grid, origin="lower", aspect="auto", cmap="cividis", vmin=ends[0], vmax=ends[1])
    for (j, i), value in np.ndenumerate(grid):
        color = "white" if np.isfinite(value) and image.norm(value) < 0.5 else "black"
        axes.text(i, j, _shown(value, name), ha="center", va="center", color=color)
    axes.set_xticks(range(len(xs)), xs)
    axes.set_yticks(range(len(ys)), ys)
    axes.grid(False)


def _word(value: Any) -> str:
    """A value of a key as it is shown."""
    return f"{value:.12g}" if isinstance(value, int | float) and not isinstance(value, bool) else str(value)


def _at(cell: Cell, key: str) -> str:
    """The value of a key in a cell as it is shown, "" where the key is none."""
    return _word(cell.varied[key]) if key in cell.varied else ""


def _shown(value: float, name: str) -> str:
    if np.isnan(value):
        return "-"
    return f"{100.0 * value:.0f} %" if name == KEPT else f"{value:.0f}" if abs(value) >= 100.0 else f"{value:#.3g}"


def _value(cell: Cell, name: str) -> float:
    if name == KEPT:
        return np.nan if cell.within is None else cell.within / cell.runs  # a run that failed is not within
    return cell.extremes[name].mean if name in cell.extremes else np.nan
