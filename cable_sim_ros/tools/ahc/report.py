"""The result of the benchmark as one HTML file that prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...plots.strips import WIDTH, svg
from ...sim.flag_rules import DOUBTFUL, FAILED, OK
from ..report.subject import Figure, Section, Table, Text, counted, number, typed, unit
from ..report.write import write_page
from . import picture as plots
from .benchmark import Row
from .figures import FIGURES
from .simulate import SKIPPED
from .tables import by_class, skipped

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

SHOWN = (
    "decoupling",
    "tension_std_n",
    "tension_max_n",
    "depth_rms_m",
    "ellipsoid_volume_m3",
    "rate_max_m_s",
    "power_max_w",
)
MEANINGS = {  # of figures whose meaning leans on the one before it
    "tension_std_n": "standard deviation of the tension",
    "tension_max_n": "largest tension, in any time step",
}
WHAT = (
    "A heave compensator turns the winch so that the towbody feels less of the ship's motion. Each run stands beside "
    "its twin: the same scene, motion and seed with the winch held. A change of -90 % means that a tenth is left; "
    "decoupling is 1 where nothing of the motion is left, and 0 of a held winch.",
    "An entrant is a law or a controller; `hold` is the held winch itself. A class is what the winch and its "
    "instruments can do: ideal; a dead time of the drive in ms (dead_200); limits; a fault of an instrument "
    "(mru_heave_frozen). A run is named by scene, ship motion and class.",
)
PICTURES = (
    ("scenes", 3.6, "With an ideal winch: deviation of the tension (filled) and ellipsoid of the towbody (open)."),
    ("dead_time", 3.6, "Deviation of the tension over the dead time of the drive."),
    ("classes", 5.0, "Deviation of the tension, by class; left of the dashed line is better than a held winch."),
    ("overshoot", 4.0, "Overshoot of the tension after a fault, by class."),
)


def write_report(done: Mapping[str, Any], path: Path, command: Sequence[str] = ()) -> Path:
    """Write the report of a result of `benchmark.run` and return its path. The same result gives the same bytes."""
    rows = done["rows"]
    states = [row["state"] for row in rows]
    odd, left = [row for row in rows if row["state"] not in (OK, SKIPPED)], states.count(SKIPPED)
    runs, entrants = counted(len(rows), "run"), counted(len({row["entrant"] for row in rows}), "entrant")
    said = f"{len(odd)} with a verdict that is not ok, {left} left out" if odd or left else "each with the verdict ok"
    return write_page(
        path,
        title=f"Heave compensators on {done['benchmark']}",
        line=f"benchmark of heave compensators; cable_sim_ros {done['product']} {done['commit']}".rstrip(),
        state=FAILED if states.count(FAILED) == len(rows) else DOUBTFUL if odd else OK,
        sentence=f"{runs} of {entrants} on {done['benchmark']}: {said}.",
        beside=[],
        cards=[],
        sections=sections(rows, odd, typed(command)),
    )


def sections(rows: Sequence[Row], odd: Sequence[Row], command: str) -> list[Section]:
    """Reasons, pictures, table by class, every run, and what its figures mean."""
    found = [Section("verdict", "Verdict and its reasons"), Section("what", "What was run", [Text(WHAT)])]
    found[1].parts += [Text([f"Command: cable-sim {command}"])] if command else []
    if odd:
        reasons = [(cell(row), row["state"], row["reason"] or "-") for row in odd]
        found[0].parts.append(Table("Runs with a verdict that is not ok", ("run", "verdict", "reason"), reasons))
    lines = skipped(rows) or ["No run failed or was left out."]
    found[0].parts.append(Text(lines, note=bool(skipped(rows))))
    ran, looks = plots.drawn(rows)
    if looks:
        figures = [
            Figure(svg(name, (WIDTH, height), partial(draw, name, ran, looks)), words, words)
            for name, height, words in PICTURES
        ]
        found.append(Section("pictures", "What is left of the held winch", [*figures]))
    head, *table = by_class(rows)
    caption = "Over scenes and motions: means, the worst, sums or the largest; signed: change against a held winch"
    found.append(Section("classes", "By class", [Table(caption, head, table, right=range(2, len(head)))]))
    units = {name: (unit(what), meaning) for name, what, meaning in FIGURES}
    every = []
    for row in rows:
        figures_of = row["figures"] or {}
        every.append((cell(row), row["state"], *(number(figures_of.get(name), 4) for name in SHOWN)))
    heads = ["run", "verdict"]
    for name in SHOWN:
        what = units[name][0]
        words = name.removesuffix("_m_s") if name.endswith("_m_s") else name.rpartition("_")[0]
        heads.append(f"{words.replace('_', ' ')} [{what}]" if what else name)
    meaning = [(heads[2 + k], units[name][0], MEANINGS.get(name, units[name][1])) for k, name in enumerate(SHOWN)]
    parts = [
        Table("Figures of every run", heads, every, right=range(2, len(heads))),
        Table("What they mean", ("figure", "unit", "meaning"), meaning),
    ]
    found.append(Section("runs", "Every run", [*parts]))
    return found


def cell(row: Row) -> str:
    """Entrant and cell of a run."""
    return f"{row['entrant']}: {row['scene']}/{row['motion']}/{row['class']}"


def draw(name: str, rows: Sequence[plots.Row], looks: Mapping[str, tuple[str, str]], figure: Drawing) -> None:
    """One of PICTURES."""
    axes = figure.subplots()
    if name == "scenes":
        plots.by_scene(axes, rows, looks)
    elif name == "dead_time":
        plots.dead_time(axes, rows, looks)
    elif name == "classes":
        plots.by_class(
            axes, rows, looks, "Deviation of the tension, by class", plots.deviation, "% of the held winch's"
        )
    else:
        what = "largest of all runs, in deviations of the held winch's tension"
        plots.by_class(axes, rows, looks, "Overshoot after a fault", plots.overshoot, what)
    figure.axes[0].set_title(axes.get_title(), size=11)
    figure.legend(handles=plots.key(axes, rows, looks), loc="outside lower center", ncols=min(len(looks), 4))
