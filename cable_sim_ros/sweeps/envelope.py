"""Operating envelope: what a tow bears over sea, speed and scope, by extremes over seeds and the rules on watch.

A cell is a combination of what a sweep varies, all seeds of it together. An extreme of a cell: its mean over the seeds
with a Student interval, and the value that a run of this length passes once in twenty, by a Gumbel distribution through
the mean and deviation of the seeds (method of moments: Gumbel 1958, Statistics of Extremes). The share of runs that
break a rule has an exact binomial interval (Clopper and Pearson 1934, Biometrika 26, 404).
"""

from __future__ import annotations

import json
import sys
from collections import defaultdict
from math import log, pi, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import click
import numpy as np
from scipy.stats import binomtest
from scipy.stats import t as student

from ..errors import CableSimError
from ..report.sweep_page import named
from .dataset import names_of
from .figures import BROKEN, RULE
from .sweep import Swept

LEVEL, ONCE_IN = 0.95, 20
CAPTION = f"mean of the extreme over the seeds (once in {ONCE_IN} runs)"
SEED = "seed"
EXTREMES = (  # figure, its end, words
    ("tension_max_n", 1.0, "most tension"),
    ("tension_min_n", -1.0, "least tension"),
    ("body_depth_max_m", 1.0, "largest depth"),
    ("body_depth_min_m", -1.0, "least depth"),
    ("winch_pull_max_n", 1.0, "most drum tension"),
    ("winch_rate_max_m_s", 1.0, "most rate of pay-out"),
    ("winch_power_max_w", 1.0, "most power of the winch"),
    ("contact_resultant_max_n", 1.0, "most load of the sheave"),
)
KEPT = "allowed"
PANELS = (
    (KEPT, "runs within the rules"),
    ("tension_max_n", "most tension [N]"),
    ("tension_min_n", "least tension [N]"),
    ("body_depth_min_m", "least depth [m]"),
)
LINES = 6  # of panels in the picture


class EnvelopeError(CableSimError, ValueError):
    """Rows that make no envelope."""


class Extreme(NamedTuple):
    """Over the seeds of a cell: mean, its interval, worst, what is passed once in ONCE_IN runs; NaN: of one seed."""

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
    """varied: by key; failed, doubtful: runs without figures, and runs whose figures are doubtful."""

    varied: dict[str, Any]
    runs: int
    failed: int
    doubtful: int
    extremes: dict[str, Extreme]
    rules: dict[str, Share]

    @property
    def allowed(self) -> bool:
        """No run of it failed or broke a rule; whether it was right to be sure of that says the interval."""
        return not self.failed and not any(share.broken for share in self.rules.values())


def extreme_of(values: np.ndarray, end: float) -> Extreme:
    """Of the extremes [n] of n seeds; end: 1 the largest, -1 the least."""
    mean, n = float(values.mean()), len(values)
    worst = float((end * values).max() * end)
    if n < 2:
        return Extreme(mean, np.nan, np.nan, worst, np.nan)
    deviation = float(values.std(ddof=1))
    half = float(student.ppf(0.5 + 0.5 * LEVEL, n - 1)) * deviation / sqrt(n)
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
    extremes = {}
    for name, end, _ in EXTREMES:
        values = np.array([row.get(name, np.nan) for row in whole], float)
        if len(values) and np.isfinite(values).all():
            extremes[name] = extreme_of(values, end)
    shares = {}
    for name in rules:
        broken = [bool(row[name]) for row in whole if name in row]
        if broken:
            interval = binomtest(sum(broken), len(broken)).proportion_ci(LEVEL)
            word = name.removeprefix(RULE).removesuffix(BROKEN)
            shares[word] = Share(sum(broken), len(broken), float(interval.low), float(interval.high))
    doubtful = sum(row["verdict"] == "doubtful" for row in rows)
    return Cell(varied, len(rows), len(rows) - len(whole), doubtful, extremes, shares)


def as_dict(cell: Cell) -> dict[str, Any]:
    """For JSON."""
    return {
        "varied": cell.varied,
        "runs": cell.runs,
        "failed": cell.failed,
        "doubtful": cell.doubtful,
        "allowed": cell.allowed,
        "extremes": {
            name: {key: None if np.isnan(value) else value for key, value in one._asdict().items()}
            for name, one in cell.extremes.items()
        },
        "rules": {name: share._asdict() for name, share in cell.rules.items()},
    }


def rows_of(cells: list[Cell]) -> tuple[list[str], list[list[str]]]:
    """Heads and rows of the table of the cells."""
    head = [*cells[0].varied, "runs", "most tension [N]", "least tension [N]", "depth [m]", "rules broken"]
    rows = []
    for cell in cells:
        broken = ", ".join(f"{name} {s.broken}/{s.runs}" for name, s in cell.rules.items() if s.broken)
        bad = [f"{n} {word}" for n, word in ((cell.failed, "failed"), (cell.doubtful, "doubtful")) if n]
        ends = [_text(cell.extremes.get(f"tension_{end}_n")) for end in ("max", "min")]
        depth = [cell.extremes.get(f"body_depth_{end}_m") for end in ("min", "max")]
        band = " to ".join("-" if one is None else f"{one.worst:.1f}" for one in depth)
        values = [f"{v:g}" if isinstance(v, int | float) else str(v) for v in cell.varied.values()]
        rows.append([*values, str(cell.runs), *ends, band, "; ".join(filter(None, (broken, *bad))) or "none"])
    return head, rows


def tell(swept: Swept, cells: list[Cell]) -> None:
    """Print the table of the cells."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    shown = Table(title=escape(f"{swept.plan.sweep}: {CAPTION}"))
    shown.title_justify = "left"
    head, rows = rows_of(cells)
    for name in head:
        shown.add_column(escape(name), justify="right")
    for row in rows:
        shown.add_row(*row)
    Console(width=None if sys.stdout.isatty() else 140).print(shown)
    click.echo(
        f"{len(swept.rows)} runs, {swept.computed} computed now in {swept.wall:.1f} s of wall time on {swept.workers} "
        f"workers"
    )


def _text(one: Extreme | None) -> str:
    return "-" if one is None else f"{one.mean:.0f}" + ("" if np.isnan(one.rare) else f" ({one.rare:.0f})")


def draw(title: str, cells: list[Cell], path: Path) -> Path:
    """Runs within the rules, tensions and depth over the first two keys that vary, a line of panels for each value of a
    third, LINES at most; of others the first value. The heading says what is left out."""
    from ..plots.canvas import canvas

    keys = [key for key in cells[0].varied if len({str(cell.varied[key]) for cell in cells}) > 1]
    x, y, third = (*keys[:3], "", "", "")[:3]
    rest = {key: cells[0].varied[key] for key in keys[3:]}
    kept = [cell for cell in cells if all(cell.varied[key] == value for key, value in rest.items())]
    every = list(dict.fromkeys(cell.varied.get(third, "") for cell in kept))
    lines = every[:LINES]
    less = f", the first {LINES} of {len(every)} values of {third}" if len(every) > LINES else ""
    heading = f"{title}{''.join(f', {key} = {value}' for key, value in rest.items())}{less}"
    size = (16.0, 1.6 + 3.2 * len(lines))
    with canvas(path, size, heading, "`cable-sim envelope`: docs/sweeps.md") as figure:
        grid = figure.subplots(len(lines), len(PANELS), squeeze=False, sharex=True, sharey=True)
        for k, (name, words) in enumerate(PANELS):
            known = [value for cell in kept if np.isfinite(value := _value(cell, name))]
            ends = (0.0, 1.0) if name == KEPT or not known else (min(known), max(known))
            for axes, line in zip(grid[:, k], lines):
                _panel(axes, [cell for cell in kept if cell.varied.get(third, "") == line], name, (x, y), ends)
                axes.set_ylabel(
                    (f"{named(third)} = {line}\n\n" if third and k == 0 else "") + (named(y) if k == 0 else "")
                )
            grid[0, k].set_title(words)
            grid[-1, k].set_xlabel(named(x))
    return path


def _panel(axes: Any, cells: list[Cell], name: str, keys: tuple[str, str], ends: tuple[float, float]) -> None:
    """One map of a figure over two keys, a number a cell; ends: of the colours, the same for all maps of a figure."""
    xs, ys = (list(dict.fromkeys(cell.varied.get(key, "") for cell in cells)) for key in keys)
    grid = np.full((len(ys), len(xs)), np.nan)
    for cell in cells:
        grid[ys.index(cell.varied.get(keys[1], "")), xs.index(cell.varied.get(keys[0], ""))] = _value(cell, name)
    image = axes.imshow(grid, origin="lower", aspect="auto", cmap="cividis", vmin=ends[0], vmax=ends[1])
    for (j, i), value in np.ndenumerate(grid):
        color = "white" if np.isfinite(value) and image.norm(value) < 0.5 else "black"
        axes.text(i, j, _shown(value, name), ha="center", va="center", color=color)
    axes.set_xticks(range(len(xs)), [str(value) for value in xs])
    axes.set_yticks(range(len(ys)), [str(value) for value in ys])
    axes.grid(False)


def _shown(value: float, name: str) -> str:
    if np.isnan(value):
        return "-"
    return f"{100.0 * value:.0f} %" if name == KEPT else f"{value:.0f}" if abs(value) >= 100.0 else f"{value:#.3g}"


def _value(cell: Cell, name: str) -> float:
    if name == KEPT:
        broken = max((share.broken for share in cell.rules.values()), default=0)
        return 1.0 - (broken + cell.failed) / cell.runs
    return cell.extremes[name].mean if name in cell.extremes else np.nan
