"""Picture of the AHC benchmark: what each entrant leaves of the held winch's tension, by scene, dead time and class."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ...plots.run import BLUE, FAINT, INK, ORANGE, PORT, PURPLE, STARBOARD, canvas
from .benchmark import Row
from .board import cell_of
from .definition import MRU, VERSION, version_of
from .score import score_of
from .tables import overshoot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

SIZE, ROOM = (16.0, 10.5), 10  # inches, and classes that it has room for
COLOURS, MARKS = (BLUE, ORANGE, STARBOARD, PORT, PURPLE, "#b08a1e", "#3aa6a6"), "osD^vP*"
HELD = "hold"  # left out: it is what the others are compared with
THESIS = {"deviation": 9.0, "volume": 11.0}  # % left, Westin (2018), full scale under another motion
DEAD = re.compile(r"(dead|heard)_(\d+)$")
IDEAL = "ideal"


def draw(rows: Sequence[Row], out: Path, title: str) -> Path:
    """Draw rows with figures and twins to an image file. RuntimeError where matplotlib is missing."""
    ran, looks = drawn(rows)
    taller = max(0, len({row["class"] for row in ran}) - ROOM)  # classes that need room of their own
    heading = f"Heave compensators on {title}: what is left of the held winch"
    heights = [1.0, 1.15 + 0.05 * taller, 0.25 + 0.08 * len(looks)]
    size = SIZE[0], SIZE[1] + 0.22 * taller + 4.5 * heights[2]
    with canvas(out, size, heading, "benchmark `cable-sim ahc`") as figure:
        figure.get_layout_engine().set(w_pad=0.2, h_pad=0.15)
        panels = figure.subplots(3, 2, gridspec_kw={"height_ratios": heights})
        by_scene(panels[0, 0], ran, looks)
        dead_time(panels[0, 1], ran, looks)
        by_class(panels[1, 0], ran, looks, "Deviation of the tension, by class", deviation, "% of the twin's")
        by_class(
            panels[1, 1],
            ran,
            looks,
            "Overshoot after a fault",
            overshoot,
            "largest of all runs, deviations of the twin",
        )
        grid = panels[2, 0].get_gridspec()
        for axes in panels[2]:
            axes.remove()
        by_score(figure.add_subplot(grid[2, :]), rows, looks)
        handles = key(panels[0, 0], ran, looks)
        if handles:
            figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 3), fontsize=11)
    return out


def drawn(rows: Sequence[Row]) -> tuple[list[Row], dict[str, tuple[str, str]]]:
    """The rows that can be drawn, and colour and mark of each entrant."""
    ran = [row for row in rows if row["figures"] and row["twin"]]
    names = [name for name in dict.fromkeys(row["entrant"] for row in ran) if name != HELD]
    looks = {
        name: (COLOURS[k % len(COLOURS)], MARKS[(k + k // len(COLOURS)) % len(MARKS)]) for k, name in enumerate(names)
    }
    return [row for row in ran if row["entrant"] in looks], looks


def key(axes: Axes, rows: Sequence[Row], looks: Mapping[str, tuple[str, str]]) -> list[Line2D]:
    """A mark for each entrant, for a legend, with its runs: means over fewer scenes are not those over all."""
    runs = Counter(row["entrant"] for row in rows)
    return [
        axes.plot([], [], mark, color=colour, ms=9, label=f"{name}, {runs[name]} runs")[0]
        for name, (colour, mark) in looks.items()
    ]


def share(name: str) -> Callable[[Row], float | None]:
    """A figure of a row in percent of that of its twin; None where the twin has none."""

    def of(row: Row) -> float | None:
        twin = row["twin"][name]
        return 100.0 * row["figures"][name] / twin if twin else None

    return of


deviation, volume = share("tension_std_n"), share("ellipsoid_volume_m3")


def mean(rows: Sequence[Row], of: Callable[[Row], float | None]) -> float | None:
    """Of the rows that have it."""
    values = [value for row in rows if (value := of(row)) is not None]
    return sum(values) / len(values) if values else None


def largest(rows: Sequence[Row], of: Callable[[Row], float | None]) -> float | None:
    """Of the rows that have it."""
    return max((value for row in rows if (value := of(row)) is not None), default=None)


def by_scene(axes: Axes, rows: Sequence[Row], looks: Mapping[str, tuple[str, str]]) -> None:
    """With an ideal winch, deviation of the tension (filled) and volume of the ellipsoid (open), by scene."""
    rows = [row for row in rows if row["class"] == IDEAL]
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    axes.set_title("Ideal winch: deviation of the tension\n(filled), volume of the ellipsoid (open)", size=13)
    for k, (name, (colour, mark)) in enumerate(looks.items()):
        shift = 0.6 * ((k + 0.5) / len(looks) - 0.5)
        for at, scene in enumerate(scenes):
            mine = [row for row in rows if (row["entrant"], row["scene"]) == (name, scene)]
            for of, face, aside in ((deviation, colour, -0.03), (volume, "white", 0.03)):
                if (value := mean(mine, of)) is not None:
                    axes.plot(at + shift + aside, value, mark, color=colour, mfc=face, mew=1.8, ms=9)
    if "full_scale" in scenes:
        at = scenes.index("full_scale")
        for what, style in (("deviation", "-"), ("volume", "--")):
            axes.plot([at - 0.42, at + 0.42], [THESIS[what]] * 2, style, color=FAINT, lw=1.6, zorder=1)
        axes.annotate("Westin (2018), other motion", (at - 0.42, 5.6), size=11, color=FAINT)
    axes.set_yscale("log")
    axes.axhline(100.0, color=INK, lw=1.2, ls=(0, (6, 4)))
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_xlim(-0.6, max(len(scenes), 1) - 0.4)
    axes.set_xticks(range(len(scenes)), scenes)
    axes.set_ylabel("% of the twin's, mean over motions")


def dead_time(axes: Axes, rows: Sequence[Row], looks: Mapping[str, tuple[str, str]]) -> None:
    """Deviation of the tension over the dead time of the drive, a line for each entrant; by an MRU dashed and open."""
    axes.set_title("Dead time of the drive\n(open: heard by an MRU)", size=13)
    for name, (colour, mark) in looks.items():
        points: dict[str, list[tuple[int, float]]] = {"dead": [], "heard": []}
        for one in dict.fromkeys(row["class"] for row in rows):
            found = DEAD.match(one)
            mine = [row for row in rows if (row["entrant"], row["class"]) == (name, one)]
            if (found or one == IDEAL) and (value := mean(mine, deviation)) is not None:
                points[found[1] if found else "dead"].append((int(found[2]) if found else 0, value))
        for kind, face, line in (("dead", colour, "-"), ("heard", "white", "--")):
            if points[kind]:
                axes.plot(*zip(*sorted(points[kind]), strict=True), mark + line, color=colour, mfc=face, lw=1.8, ms=8)
    if axes.lines:
        axes.set_ylim(bottom=0.0)
    axes.set(xlabel="ms, at full scale", ylabel="deviation of the tension,\n% of the twin's, mean of all runs")


def by_score(axes: Axes, rows: Sequence[Row], looks: Mapping[str, tuple[str, str]]) -> None:
    """Score by entrant, by the truth filled and by an MRU open; dashed lines: the held winch."""
    names = [*looks][::-1]
    for version, full, line in ((VERSION, True, "--"), (MRU, False, ":")):
        mine = [row for row in rows if version_of(cell_of(row)) == version]
        found = score_of(mine)["entrants"]
        for at, name in enumerate(names):
            colour, mark = looks[name]
            if name in found and found[name]["not_run"] < found[name]["cells"]:
                face = colour if full else "white"
                axes.plot(found[name]["score"], at, mark, color=colour, mfc=face, mew=1.8, ms=9)
        if HELD in found:
            axes.axvline(found[HELD]["score"], color=INK, lw=1.2, ls=line)
    axes.set_title("Score (filled: the truth; open: heard by an MRU; lines: the held winch)", size=13)
    axes.set_yticks(range(len(names)), names)
    axes.set(ylim=(-0.6, max(len(names), 1) - 0.4), xlim=(0.0, 100.0))


def by_class(
    axes: Axes,
    rows: Sequence[Row],
    looks: Mapping[str, tuple[str, str]],
    title: str,
    of: Callable[[Row], float | None],
    unit: str,
) -> None:
    """A figure by class, a mark for each entrant: the mean of its runs, of an overshoot the largest."""
    together = largest if of is overshoot else mean
    classes = [one for one in dict.fromkeys(row["class"] for row in rows) if mean(_of(rows, one), of) is not None]
    axes.set_title(title, size=13)
    for k, (name, (colour, mark)) in enumerate(looks.items()):
        shift = 0.5 * ((k + 0.5) / len(looks) - 0.5)
        for at, one in enumerate(classes):
            mine = [row for row in _of(rows, one) if row["entrant"] == name]
            if (value := together(mine, of)) is not None:
                axes.plot(value, at + shift, mark, color=colour, ms=8)
    if not classes:
        axes.text(0.5, 0.5, "no such class was run", transform=axes.transAxes, ha="center", size=13, color=FAINT)
    axes.set_yticks(range(len(classes)), classes)
    axes.set_ylim(max(len(classes), 1) - 0.4, -0.6)
    if of is deviation:
        axes.axvline(100.0, color=INK, lw=1.2, ls=(0, (6, 4)))
    axes.set(xlim=(0.0, None), xlabel=unit)


def _of(rows: Sequence[Row], one: str) -> list[Row]:
    return [row for row in rows if row["class"] == one]
