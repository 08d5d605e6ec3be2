"""The result of the benchmark as tables: on the terminal, and as Markdown for its page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from ...terminal import markdown_table
from . import definition
from .benchmark import Row
from .board import cell_of
from .figures import FIGURES, NAMES
from .remote import AhcError
from .score import METRICS, RULES, score_of

THESIS = ("Westin (2018), other motion", "-91 %, -89 %")  # deviation of the tension, volume of the ellipsoid


class Column(NamedTuple):
    """A column of the table by class: title, figure of a row (None: it has none), how cells go together, form."""

    title: str
    figure: Callable[[Row], float | None]
    together: Callable[[list[float]], float]
    form: str


def _mean(values: list[float]) -> float:
    return sum(values) / len(values)


def figure(name: str) -> Callable[[Row], float | None]:
    """A figure of a row."""
    return lambda row: None if row["figures"] is None else row["figures"][name]


def against_twin(name: str) -> Callable[[Row], float | None]:
    """A figure of a row over that of its twin, less 1; None where either has none."""

    def of(row: Row) -> float | None:
        run, twin = (row["figures"] or {}).get(name), (row["twin"] or {}).get(name)
        return None if run is None or not twin else run / twin - 1.0

    return of


def overshoot(row: Row) -> float | None:
    """Over the deviation of the twin's tension; None where either is not there."""
    found, twin = figure("overshoot_n")(row), row["twin"] and row["twin"]["tension_std_n"]
    return None if found is None or not twin else found / twin


DEVIATION, VOLUME = against_twin("tension_std_n"), against_twin("ellipsoid_volume_m3")
SPREAD = (
    Column("decoupling", figure("decoupling"), _mean, "{:.3f}"),
    Column("worst", figure("decoupling"), min, "{:.3f}"),
    Column("deviation", DEVIATION, _mean, "{:+.0%}"),
    Column("depth rms", against_twin("depth_rms_m"), _mean, "{:+.0%}"),
    Column("volume", VOLUME, _mean, "{:+.0%}"),
    Column("peak tension", against_twin("tension_max_n"), _mean, "{:+.1%}"),
    Column("snaps", figure("snaps"), sum, "{:.0f}"),
    Column("lifted [s]", figure("lifted_s"), sum, "{:.3g}"),
    Column("saturated [s]", figure("saturated_s"), sum, "{:.3g}"),
    Column("overshoot", overshoot, max, "{:.2f}"),
    Column("to safe [s]", figure("time_to_safe_s"), max, "{:.3g}"),
)


def _said(rows: Sequence[Row], column: Column) -> str:
    values = [value for row in rows if (value := column.figure(row)) is not None]
    return column.form.format(column.together(values)) if values else "-"


def by_class(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """A line for each entrant and class, over its scenes and motions; the first line is the head."""
    lines: list[tuple[str, ...]] = [("entrant", "class", "runs", "not ok", *(column.title for column in SPREAD))]
    for entrant in dict.fromkeys(row["entrant"] for row in rows):
        for name in dict.fromkeys(row["class"] for row in rows):
            mine = [row for row in rows if (row["entrant"], row["class"]) == (entrant, name)]
            ran = [row for row in mine if row["state"] != "skipped"]
            odd = sum(row["state"] != "ok" for row in ran)
            if ran:
                cells = (_said(ran, column) for column in SPREAD)
                lines.append((entrant, name, str(len(ran)), str(odd or "-"), *cells))
    return lines


def skipped(rows: Sequence[Row]) -> list[str]:
    """Why cells were skipped or failed, each reason once with how many."""
    count: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        if row["state"] in ("skipped", "failed"):
            count.setdefault((row["state"], row["reason"]), []).append(row)
    found = []
    for (state, reason), these in count.items():
        what = ", ".join(dict.fromkeys(row["entrant"] for row in these))
        where = ", ".join(dict.fromkeys(row["class"] for row in these))
        found.append(f"{state}, {len(these)} runs ({what}; {where}): {reason}")
    return found


def matrix(rows: Sequence[Row], key: str, form: Callable[[list[Row]], str]) -> list[tuple[str, ...]]:
    """Entrants over what a key of the rows says; form: of the rows of a place in it that ran.

    Where an entrant ran in fewer cells than others their number stands beside: its mean does not compare.
    """
    names = [name for name in dict.fromkeys(row[key] for row in rows) if _ran(rows, key, name)]
    lines: list[tuple[str, ...]] = [("entrant", *(f"`{name}`" for name in names))]
    entrants = list(dict.fromkeys(row["entrant"] for row in rows))
    for entrant in entrants:
        mine = [row for row in rows if row["entrant"] == entrant]
        cells = []
        for name in names:
            ran = _ran(mine, key, name)
            most = max(len(_ran([row for row in rows if row["entrant"] == other], key, name)) for other in entrants)
            cells.append(f"{form(ran)} ({len(ran)} of {most})" if 0 < len(ran) < most else form(ran))
        lines.append((f"`{entrant}`", *cells))
    return lines


def _ran(rows: Sequence[Row], key: str, name: str) -> list[Row]:
    return [row for row in rows if row[key] == name and row["figures"] is not None]


def _pair(rows: list[Row]) -> str:
    """Deviation of the tension and volume of the ellipsoid against the twin."""
    return ", ".join(_said(rows, Column("", of, _mean, "{:+.0%}")) for of in (DEVIATION, VOLUME)).replace("%", " %")


def _deviation(rows: list[Row]) -> str:
    return _said(rows, Column("", DEVIATION, _mean, "{:+.0%}")).replace("%", " %")


def _on(rows: Sequence[Row], version: str) -> list[Row]:
    """Rows of a track."""
    return [row for row in rows if definition.version_of(cell_of(row)) == version]


def scores(rows: Sequence[Row]) -> list[tuple[str, ...]]:
    """A line for each entrant, the best first: score on each track, mean metrics in percent, cells that count as 0."""
    versions = [one for one in (definition.VERSION, definition.MRU) if _on(rows, one)]
    found = [score_of(_on(rows, version))["entrants"] for version in versions]
    parts = ", ".join(one.name for one in METRICS)
    lines: list[tuple[str, ...]] = [("entrant", *(head for one in versions for head in (one, parts, "count as 0")))]
    names = dict.fromkeys(row["entrant"] for row in rows)
    for name in sorted(names, key=lambda name: [-one[name]["score"] if name in one else 0.0 for one in found[::-1]]):
        line = [f"`{name}`"]
        for of in (one.get(name) for one in found):
            line += (
                ["-"] * 3
                if of is None or of["not_run"] == of["cells"]
                else [
                    f"{of['score']:.1f}",
                    ", ".join(f"{100.0 * of[one.name]:.0f}" for one in METRICS),
                    f"{of['disqualified'] + of['not_run']} of {of['cells']}",
                ]
            )
        lines.append(tuple(line))
    return lines


def _seeds(rows: Sequence[Row]) -> list[Row]:
    """Rows of the seas, in whose class it stands which set of seeds they are of."""
    second = {one.name for one in definition.SECOND}
    seas = [row for row in rows if definition.seed(row["motion"]) is not None]
    return [{**row, "class": f"{'second' if row['motion'] in second else 'first'} seeds"} for row in seas]


def results(rows: Sequence[Row]) -> str:
    """Tables of a leaderboard for docs/ahc.md: scores; with an ideal winch by scene, beside the thesis; on the track
    for prediction by dead time and seeds."""
    others = [row for row in rows if row["entrant"] != definition.TWIN]
    truth, heard = (_on(others, version) for version in (definition.VERSION, definition.MRU))
    ideal = matrix([row for row in truth if row["class"] == "ideal"], "scene", _pair)
    thesis = (THESIS[0], *(THESIS[1] if name == "`full_scale`" else "-" for name in ideal[0][1:]))
    parts = [markdown_table(scores(rows)), markdown_table([*ideal, thesis])]
    if heard:
        ran = [row for row in heard if any(one["figures"] for one in heard if one["entrant"] == row["entrant"])]
        parts.append(markdown_table(matrix([*ran, *_seeds(ran)], "class", _deviation)))
    return "\n\n".join(parts)


def score_markdown() -> str:
    """What the score is, for docs/ahc.md."""
    metrics = markdown_table([("metric", "is"), *((f"`{one.name}`", one.formula) for one in METRICS)])
    return "\n".join((metrics, "", *(f"* {rule}." for rule in RULES)))


def cells_markdown(rows: Sequence[Row]) -> str:
    """Every figure of every run, with that of its twin in brackets, for ahc.md of --out."""
    lines: list[tuple[str, ...]] = [("entrant", "cell", "state", *(f"{name}" for name in NAMES))]
    for row in rows:
        found, twin = row["figures"] or {}, row["twin"] or {}
        values = (_beside(found.get(name), twin.get(name)) for name in NAMES)
        lines.append((row["entrant"], str(cell_of(row)), row["state"], *values))
    return markdown_table(lines)


def _beside(value: float | None, twin: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.4g}" if twin is None else f"{value:.4g} ({twin:.4g})"


def figures_markdown() -> str:
    """The figures as a table, for docs/ahc.md."""
    rows = [(f"`{name}`", "" if unit == "1" else unit, meaning) for name, unit, meaning in FIGURES]
    return markdown_table([("figure", "unit", "meaning"), *rows])


def made(text: str, rows: Sequence[Row]) -> str:
    """A page with what is made of definition and leaderboard between its markers. AhcError where it has none."""
    parts = {
        "results": results(rows),
        "score": score_markdown(),
        "definition": definition_markdown(),
        "figures": figures_markdown(),
    }
    for name, part in parts.items():
        begin, end = f"<!-- made: {name} -->\n", "\n<!-- made: end -->"
        head, sign, rest = text.partition(begin)
        _, closed, tail = rest.partition(end.lstrip())
        if not sign or not closed:
            raise AhcError(
                f"--page: has no lines {begin.strip()} and {end.strip()} with room between; it was not changed"
            )
        text = f"{head}{begin}\n{part}\n{end}{tail}"
    return text


def definition_markdown() -> str:
    """Head line and tables of the definition, for docs/ahc.md."""
    heads = (f"{version}, definition {definition.digest(version)}" for version in (definition.VERSION, definition.MRU))
    return f"{'; '.join(heads)}\n\n{definition.markdown()}"
