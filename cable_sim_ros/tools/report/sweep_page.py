"""Many runs as one HTML file that prints: what was varied, what came of it, which runs cannot be taken as they are."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...physics.parameter import declaration
from ...plots.strips import LOOKS, WIDTH, svg
from ...sim.flag_rules import DOUBTFUL, FAILED, OK
from ...sim.scene import Scene
from .subject import Card, Figure, Part, Section, Table, Text, counted, number, share, typed, unit
from .write import write_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

MOST_RUNS = 400  # rows of the table of runs
MOST_REASONS = 20
MARKERS = "osD^"
TITLES = {  # of the figures that stand first: by these names outside the table of all figures
    "tension_max_n": "largest tension at the sheave",
    "tension_mean_n": "mean tension at the sheave",
    "tension_std_n": "deviation of the tension",
    "body_depth_m": "mean depth of the towbody",
    "departure_angle_deg": "departure angle",
    "layback_max_m": "largest layback",
    "tension_min_n": "least tension at the sheave",
    "body_depth_std_m": "deviation of the depth",
}
DRAWN = 4  # figures
CARDS = (("tension_max_n", "largest tension of any run", max), ("tension_min_n", "least tension of any run", min))


class Many(NamedTuple):
    """Runs side by side. varied: of each run, by key; rows: of each run `verdict`, `error`, `reasons` and figures by
    name, NaN or None where it has none; units, meanings: of the figures, by name; same: what holds for all, as pairs.
    """

    title: str
    varied: Sequence[Mapping[str, Any]]
    rows: Sequence[Mapping[str, Any]]
    units: Mapping[str, str]
    meanings: Mapping[str, str]
    same: Sequence[tuple[str, str]] = ()

    def values(self, name: str) -> np.ndarray:
        """A figure [runs], NaN where a run failed or has none."""
        return np.array([_float(row.get(name)) if row["verdict"] != FAILED else np.nan for row in self.rows])

    def shown(self, names: Sequence[str]) -> list[str]:
        """Those of the figures that any run has."""
        return [name for name in names if np.isfinite(self.values(name)).any()]


def write_sweep_page(
    many: Many,
    path: str | os.PathLike,
    *,
    kind: str = "sweep",
    command: Sequence[str] = (),
    notes: Sequence[str] = (),
    tables: Sequence[Table] = (),
    doubts: Sequence[str] = (),
) -> Path:
    """Write the report of many runs and return its path.

    kind: what was done, under the title; command: words as typed; notes: what a reader must know; tables: what else was
    found, as indices of a sensitivity or cells of an envelope; doubts: why that is doubtful, whatever the runs are. The
    same rows give the same bytes. Raises ReportError.
    """
    states = Counter(str(row["verdict"]) for row in many.rows)
    state = FAILED if states[FAILED] else DOUBTFUL if doubts or len(many.rows) != states[OK] else OK
    every = [
        Section("verdict", "Verdict and its reasons", _reasons(many, notes, doubts)),
        Section("simulated", "What was simulated", _same(many, command)),
        Section("varied", "What was varied", _varied(many)),
        Section("found", "What was found", [*tables]),
        Section("figures", "What came of it", _figures(many)),
        Section("runs", "Every run", _runs(many)),
    ]
    keys = len(_keys(many))
    return write_page(
        path,
        title=many.title,
        line=f"{kind}; {counted(len(many.rows), 'run')}; {counted(keys, 'key')} varied",
        state=state,
        sentence=sentence(states, len(many.rows), sum(bool(row.get("warnings")) for row in many.rows), bool(doubts)),
        beside=[],
        cards=_cards(many, states),
        sections=[section for section in every if section.parts],
    )


def sentence(states: Mapping[str, int], count: int, warned: int = 0, doubts: bool = False) -> str:
    """The verdict in one sentence; states: runs by verdict; warned: runs with a warning; doubts: of what was found."""
    failed, doubtful = states.get(FAILED, 0), states.get(DOUBTFUL, 0)
    if warned and not failed and not doubtful and not doubts:
        return (
            f"{counted(count, 'run')} came to the end and no check objects, but {warned} of them warn. The warnings "
            "stand below."
        )
    if not failed and not doubtful and not doubts:
        return f"{counted(count, 'run')} came to the end and no check objects: the figures can be taken as they are."
    said = []
    if failed:
        said.append(f"{failed} of {counted(count, 'run')} failed and have no figures")
    if doubtful:
        said.append(f"some figures of {doubtful} of {counted(count, 'run')} cannot be taken as they are")
    if doubts:
        said.append("some of what was found cannot be taken as it is")
    if warned:
        said.append(f"{warned} of {counted(count, 'run')} warn")
    return f"{'; '.join(said)}. The reasons stand below."


def _keys(many: Many) -> list[str]:
    return list(dict.fromkeys(key for one in many.varied for key in one))


def _cards(many: Many, states: Mapping[str, int]) -> list[Card]:
    cards = [Card("runs", "runs", str(len(many.rows)), "")]
    cards.append(Card("failed", "of them failed", str(states.get(FAILED, 0)), ""))
    for name, label, end in CARDS:
        values = many.values(name)
        if np.isfinite(values).any():
            cards.append(Card(name, label, number(float(end(values[np.isfinite(values)])), 4), unit(many.units[name])))
    return cards


def _reasons(many: Many, notes: Sequence[str], doubts: Sequence[str]) -> list[Part]:
    """Texts of failures, doubts and warnings with how often they came; no run is left out in silence."""
    parts: list[Part] = []
    if doubts:
        shown = [(text,) for text in doubts[:MOST_REASONS]]
        parts.append(Table("Why what was found is doubtful", ("reason",), shown))
        if len(doubts) > MOST_REASONS:
            parts.append(Text([f"{len(doubts) - MOST_REASONS} more reasons are not shown."]))
    for state, key, caption in (
        (FAILED, "error", "Why runs failed"),
        (DOUBTFUL, "reasons", "Why figures are doubtful"),
        ("", "warnings", "What runs warn of"),
    ):
        unknown = "no reason is known" if state else ""
        mine = [row for row in many.rows if row["verdict"] == state or (not state and row.get(key))]
        texts = Counter(str(row.get(key) or unknown) for row in mine)
        if not texts:
            continue
        rows = [(text, str(count), share(count / len(many.rows))) for text, count in texts.most_common(MOST_REASONS)]
        bad = range(len(rows)) if state == FAILED else ()
        parts.append(Table(caption, ("reason", "runs", "share"), rows, right=(1, 2), bad=bad))
        if len(texts) > MOST_REASONS:
            parts.append(Text([f"{len(texts) - MOST_REASONS} rarer ones are not shown."]))
    if not parts:
        parts.append(Text(["Every tick of every run was checked. No check objected."]))
    return [*parts, *([Text(list(notes), note=True)] if notes else [])]


def _same(many: Many, command: Sequence[str]) -> list[Part]:
    words = typed(command)
    rows = [*many.same, *([("command", f"cable-sim {words}")] if words else [])]
    return [Table("The same in every run", ("what", "how"), rows)] if rows else []


def _varied(many: Many) -> list[Part]:
    rows = []
    for key in _keys(many):
        found = [one[key] for one in many.varied if key in one]
        count = len({str(value) for value in found})
        if all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in found):
            span = f"{number(min(found))} to {number(max(found))}"
        else:
            span = ", ".join(list(dict.fromkeys(str(value) for value in found))[:8]) + (", ..." if count > 8 else "")
        rows.append((named(key), str(count), span))
    caption = "Keys of the scene that differ from run to run"
    return [Table(caption, ("key", "values", "which"), rows, right=(1,))] if rows else []


def _figures(many: Many) -> list[Part]:
    """Least, mean and largest of each figure with the run it is of, and drawings over the first key of numbers."""
    rows, names = [], many.shown([name for name in many.units if any(name in row for row in many.rows)])
    for name in names:
        values = many.values(name)
        least, most = int(np.nanargmin(values)), int(np.nanargmax(values))
        cells = [number(float(value), 4) for value in (values[least], np.nanmean(values), values[most])]
        at = f"{least + 1}, {most + 1}"
        rows.append((_words(many, name), *cells, unit(many.units[name]), at, name))
    head = ("figure", "least", "mean", "largest", "unit", "runs of least, largest", "name in the table")
    table: list[Part] = [Table("Over all runs that ended", head, rows, right=(1, 2, 3), names=names)] if rows else []
    return [*_drawn(many), *table]


def _words(many: Many, name: str) -> str:
    """What a figure is; by its name where its meaning leans on the one before it."""
    said = many.meanings.get(name, name)
    leans = said.startswith(("that ", "its ")) or "that tick" in said
    return TITLES.get(name) or (name.rpartition("_")[0].replace("_", " ") if leans else said)


def _drawn(many: Many) -> list[Part]:
    found = ((key, _axis(many, key)) for key in _keys(many) if key != "seed")
    over, x = next(((key, one) for key, one in found if one is not None and len(set(one)) > 1), ("", None))
    known = {name: many.values(name) for name in many.shown(tuple(TITLES))}
    names = [name for name, values in known.items() if np.ptp(values[np.isfinite(values)]) > 0.0][:DRAWN]
    if x is None or not names:
        return []
    others = [key for key in _keys(many) if key not in (over, "seed")]
    by = next((key for key in others if 1 < len({str(one.get(key)) for one in many.varied}) <= len(LOOKS)), None)
    words = f"Each mark is a run; over {over}"
    words += f", by {by}" if by else ""
    rest = [key for key in others if key != by and len({str(one.get(key)) for one in many.varied}) > 1]
    words += f"; all values of {', '.join(rest)} together" if rest else ""
    words += "; open: doubtful; runs that failed have none."

    def draw(figure: Drawing) -> None:
        panels = figure.subplots(-(-len(names) // 2), min(len(names), 2), squeeze=False).ravel()
        doubtful = np.array([row["verdict"] == DOUBTFUL for row in many.rows])
        groups = list(dict.fromkeys(str(one.get(by)) for one in many.varied)) if by else [""]
        for axes, name in zip(panels, names):
            y = known[name]
            for group, (colour, _), marker in zip(groups, LOOKS, MARKERS):
                mine = np.array([not by or str(one.get(by)) == group for one in many.varied])
                for odd, fill in ((False, colour), (True, "none")):
                    at = mine & (doubtful == odd)
                    axes.plot(x[at], y[at], marker, color=colour, mfc=fill, ms=4.5, label="" if odd else group)
            what = TITLES[name]
            axes.set_title(f"{what[0].upper()}{what[1:]}", size=10)
            axes.set(xlabel=named(over), ylabel=f"[{unit(many.units[name])}]")
            axes.margins(y=0.12)
            axes.locator_params(nbins=6)
        for axes in panels[len(names) :]:
            axes.set_visible(False)
        if by:
            handles, labels = panels[0].get_legend_handles_labels()
            figure.legend(handles, labels, title=named(by), loc="outside lower center", ncols=len(labels))

    height = 2.7 * -(-len(names) // 2) + 0.4
    return [Figure(svg("runs", (WIDTH, height), draw), words, words)]


def _axis(many: Many, key: str) -> np.ndarray | None:
    """Values of a key as numbers; None where any is no number."""
    values = [one.get(key) for one in many.varied]
    if not all(isinstance(value, (int, float)) and not isinstance(value, bool) for value in values):
        return None
    return np.array(values, float)


def _runs(many: Many) -> list[Part]:
    keys, names = _keys(many), many.shown(tuple(TITLES))
    rows, bad = [], []
    for k, (varied, row) in enumerate(zip(many.varied, many.rows)):
        if k == MOST_RUNS:
            break
        if row["verdict"] == FAILED:
            bad.append(k)
        figures = ("-" if row["verdict"] == FAILED else number(_float(row.get(name)), 4) for name in names)
        rows.append((str(k + 1), *(number(varied.get(key)) for key in keys), *figures, str(row["verdict"])))
    heads = [f"{TITLES[name]} [{unit(many.units[name])}]" for name in names]
    right = range(0, 1 + len(keys) + len(names))
    parts: list[Part] = [Table("Runs", ("run", *map(named, keys), *heads, "verdict"), rows, right=right, bad=bad)]
    if len(many.rows) > MOST_RUNS:
        parts.append(Text([f"{len(many.rows) - MOST_RUNS} more runs stand in the table of the sweep (sweep.csv)."]))
    return parts


def _float(value: Any) -> float:
    return float(value) if isinstance(value, (int, float)) else float("nan")


def named(key: str) -> str:
    """A key of the scene with its unit; other names as they are."""
    item = declaration(Scene, key)
    what = unit(item.unit) if item is not None else ""
    return f"{key} [{what}]" if what else key
