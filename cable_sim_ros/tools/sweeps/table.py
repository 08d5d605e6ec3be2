"""`cable-sim table`: depth, tension, departure angle, layback of static tows over scope, speed and more keys."""

from __future__ import annotations

import re
import tempfile
from collections import Counter
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ...cli.options import Answer, answers, folder_option, set_option, workers_option
from ...errors import CODE_DOUBTFUL, CODE_FAILED, CODE_OK, CableSimError
from ...files import write_csv
from ...sim.flag_rules import DOUBTFUL, FAILED
from ...terminal import in_lines, print_table, say
from ..logs.mapping.units import UNITS, named, units_of
from .command import replaced_by, replacing, stoppable, tell_notes

if TYPE_CHECKING:
    from .sweep import Swept

SCOPE, SPEED = "winch.scope", "ship.tow_speed"
MOST = 1000  # values of a key
UNIT = re.compile(r"(?=[^-+0-9.,:eE\s])")  # begins behind the numbers
SHOWN = (  # figure, title, title of its panel, unit, digits
    ("body_depth_m", "depth of the towbody", "depth", "m", 1),
    ("tension_mean_n", "tension at the sheave", "tension", "N", 0),
    ("departure_angle_deg", "departure angle at the sheave, from the downward vertical", "departure angle", "deg", 1),
    ("layback_max_m", "layback: horizontal distance from the sheave to the towbody", "layback", "m", 1),
)
SHORT = {SCOPE: "scope", SPEED: "speed"}
JSON_NAME = "table.json"
TOLD = ("verdict", "reasons", "error")  # columns of text
LINES = 4  # of panels in the picture
FEW = 5  # lines of a panel that have colours of their own
LASTED = re.compile(r" for [-+.e\d]+ s \([-+.e\d]+ % of the run\)")  # of a reason; a static tow lasts no time


class TableError(CableSimError, ValueError):
    """A table that cannot be made."""


def speeds_of(text: str) -> list[float]:
    """Speeds [m/s] as of values_of, behind the last one a unit of UNITS: `2,3,4 kn`. Raises TableError."""
    numbers, word = [*re.split(UNIT, text.strip(), maxsplit=1), ""][:2]
    unit = UNITS.get(named(word) or "") if word else UNITS["m/s"]
    if unit is None or unit.dimension != "m/s":
        raise TableError(
            f"--speed {text!r:.60}: {word!r:.20} is no unit of a speed; nothing was simulated. "
            f"Known are {', '.join(units_of('m/s'))}; none is m/s"
        )
    return [value * unit.factor for value in values_of(numbers, "--speed")]


def values_of(text: str, what: str) -> list[float]:
    """`1`, `1,2,3` or `FIRST:LAST:COUNT`. Raises TableError."""
    try:
        if ":" in text:
            first, last, count = text.split(":")
            begin, end, n = float(first), float(last), int(count)
            if not (2 if begin != end else 1) <= n <= MOST:
                raise ValueError
            values = [begin + (end - begin) * k / max(n - 1, 1) for k in range(n)]
        else:
            values = [float(part) for part in text.split(",")]
        if not values or len(values) > MOST or not all(map(isfinite, values)) or len(set(values)) < len(values):
            raise ValueError
    except ValueError:
        raise TableError(
            f"{what} {text!r:.60}: is neither numbers such as 50,100,150 nor FIRST:LAST:COUNT, at most {MOST} and no "
            "two the same; nothing was simulated. Give for example 50:400:8"
        ) from None
    return values


@click.command()
@click.argument("scene")
@click.option("--scope", required=True, metavar="VALUES", help="Scopes in m: 50,100 or FIRST:LAST:COUNT.")
@click.option("--speed", metavar="VALUES", help="Speeds over ground in m/s, or 2,4kn. Default: the scene's.")
@click.option("--vary", multiple=True, metavar="KEY=VALUES", help="Another key of the scene; may be repeated.")
@set_option("A value of the scene by its key.")
@folder_option("Folder for table.csv, table.json and table.png.")
@workers_option
@answers
def table(scene, scope, speed, vary, settings, out, workers) -> Answer:
    """Depth, tension, departure angle and layback of SCENE for every scope and speed, as static tows."""
    from ...io.scenes.load import load_scene
    from ...runs.settings import apply_to_scene, settings_of
    from .sweep import sweep
    from .sweep_file import checked

    base = apply_to_scene(load_scene(scene), given := settings_of(settings))
    grid = {SCOPE: values_of(scope, "--scope")}
    grid[SPEED] = speeds_of(speed) if speed is not None else [base.ship.tow_speed]
    for text in vary:
        key, sign, values = text.partition("=")
        if not sign or key in grid:
            raise TableError(f"--vary {text!r:.60}: is no KEY=VALUES of another key; nothing was simulated")
        grid[key] = values_of(values, f"--vary {key}")
    place = str(Path(scene)) if Path(scene).is_file() else scene
    if speed is None:
        given.pop(SPEED, None)  # it is the speed of the grid
    words = "".join(f", {key} = {value}" for key, value in given.items())
    plan = checked(
        {"sweep": f"table of {base.name}{words}", "scene": place, "settings": given, "grid": grid}, "the table"
    )
    with stoppable(out), tempfile.TemporaryDirectory(prefix="cable_sim_table_") as scratch:
        swept = sweep(plan, out if out is not None else scratch, workers=workers)
    figures = [
        {**case.varied, **{name: row.get(name) for name, *_ in SHOWN}, **{name: row[name] for name in TOLD}}
        | {"reasons": LASTED.sub("", row["reasons"])}
        for case, row in zip(swept.cases, swept.rows)
    ]
    told = {"scene": base.name, "settings": given, "sweep": plan.sweep, "replaced": None, "rows": figures}
    files, notes = [], []
    if out is not None:
        told["replaced"] = replaced_by(plan, out / JSON_NAME)
        files, notes = _write(swept, figures, out), replacing(told, out)

    def tell() -> None:
        _tell(f"{base.name}{words}", figures)
        tell_notes(notes)

    verdicts = {row["verdict"] for row in figures}
    code = CODE_FAILED if FAILED in verdicts else CODE_DOUBTFUL if DOUBTFUL in verdicts else CODE_OK
    return Answer(told, tell, out and out / JSON_NAME, files, code=code)


def _tell(name: str, figures: list[dict[str, Any]]) -> None:
    from .figures import significant

    scopes, speeds = _axis(figures, SCOPE), _axis(figures, SPEED)
    others = list(dict.fromkeys(_place(row, _keys(figures)[2:]) for row in figures))
    for figure, title, _, what, digits in SHOWN:
        for other in others:
            place = f", {other}" if other else ""
            say(f"{name}{place}: {title} [{what}]")
            mine = {
                (row[SCOPE], row[SPEED]): row[figure] for row in figures if _place(row, _keys(figures)[2:]) == other
            }
            rows = []
            for scope in scopes:
                cells = [mine[scope, speed] for speed in speeds]
                rows.append((f"{scope:g}", *("-" if cell is None else significant(cell, digits) for cell in cells)))
            heads = [in_lines(f"{speed:.4g} m/s", _knots(speed)) for speed in speeds]
            print_table(None, ["scope [m], speed", *heads], rows)
    for words, key in (("failed", "error"), ("doubtful", "reasons")):
        for text, count in Counter(row[key] for row in figures if row[key]).items():
            say(f"{words} {count} x: {text}", err=True)


def _keys(figures: list[dict[str, Any]]) -> list[str]:
    """Keys of the scene in the rows: scope, speed, others."""
    fixed = {*TOLD, *(name for name, *_ in SHOWN)}
    return [key for key in figures[0] if key not in fixed]


def _axis(figures: list[dict[str, Any]], key: str) -> list[float]:
    return sorted({row[key] for row in figures})


def _named(key: str, value: float) -> str:
    """A value of a key in words: scope 100 m, towbody.mass = 30 kg."""
    from ...physics.parameter import declaration
    from ...sim.scene import Scene
    from ..report.subject import unit

    item = declaration(Scene, key)
    what = f" {unit(item.unit)}".rstrip() if item is not None else ""
    if key == SPEED:
        return f"{SHORT[key]} {value:.4g}{what} ({_knots(value)})"
    return f"{SHORT[key]} {value:.12g}{what}" if key in SHORT else f"{key} = {value:.12g}{what}"


def _knots(speed: float) -> str:
    return f"{speed / UNITS['kn'].factor:.3g} kn"


def _place(row: dict[str, Any], keys: list[str]) -> str:
    return ", ".join(_named(key, row[key]) for key in keys)


def _write(swept: Swept, figures: list[dict[str, Any]], out: Path) -> list[tuple[str, Path]]:
    write_csv(out / "table.csv", figures[0], map(dict.values, figures))
    _draw(swept.plan.sweep, figures, out / "table.png")
    return [("table", out / "table.csv"), ("picture", out / "table.png")]


def _draw(title: str, figures: list[dict[str, Any]], path: Path) -> None:
    """Each figure over the first key that varies, a line for each value of the second, a row of panels for each
    combination of the others, LINES at most. The heading says what is the same, what is left out and what failed."""
    from ...plots.run import canvas
    from ..report.subject import unit
    from ..report.sweep_page import named

    varied = [key for key in _keys(figures) if len(_axis(figures, key)) > 1]
    x, by, rest = (varied or [SCOPE])[0], (varied[1:2] or [""])[0], varied[2:]
    every = list(dict.fromkeys(_place(row, rest) for row in figures))
    heading = f"{title[0].upper()}{title[1:]}{_heading(figures, x, varied, rest, len(every))}"
    lines = _axis(figures, by) if by else [None]
    high = 1.9 + 3.3 * min(len(every), LINES) + 0.3 * (len(lines) // 6)
    with canvas(path, (15.0, max(5.2, high)), heading, "`cable-sim table`, static tows") as figure:
        grid = figure.subplots(min(len(every), LINES), len(SHOWN), squeeze=False, sharex=True)
        for place, panels in zip(every, grid):
            if not any(row[name] is not None for row in figures if _place(row, rest) == place for name, *_ in SHOWN):
                for panel in panels:
                    panel.text(0.5, 0.5, "no static tow", ha="center", va="center", transform=panel.transAxes)
                    panel.set_yticks([])
            for panel, (name, _, words, what, _) in zip(panels, SHOWN):
                for k, value in enumerate(lines):
                    mine = [r for r in figures if _place(r, rest) == place and (not by or r[by] == value)]
                    mine.sort(key=lambda row: row[x])
                    _line(panel, mine, x, name, "" if value is None else _named(by, value), k, len(lines))
                panel.set_title(f"{words} [{unit(what)}]" if place == every[0] else "")
                panel.margins(0.08)
                if name == "body_depth_m":
                    panel.invert_yaxis()
            panels[0].set_ylabel(place.replace(", ", "\n"))
        for panel in grid[-1]:
            panel.set_xlabel(f"{SHORT[x]} [{'m' if x == SCOPE else 'm/s'}]" if x in SHORT else named(x))
        if by:
            handles, labels = grid[0, 0].get_legend_handles_labels()
            figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 6))


def _line(panel: Any, rows: list[dict[str, Any]], x: str, name: str, label: str, k: int, count: int) -> None:
    """One line of a panel, marks of doubtful tows open; k: its number of so many."""
    from matplotlib import colormaps

    at, values = [row[x] for row in rows], [nan if row[name] is None else row[name] for row in rows]
    color = f"C{k}" if count <= FEW else colormaps["viridis"](0.95 * k / (count - 1))
    (line,) = panel.plot(at, values, marker="o", ms=5, label=label, color=color)
    odd = [i for i, row in enumerate(rows) if row["verdict"] == DOUBTFUL]
    panel.plot([at[i] for i in odd], [values[i] for i in odd], "o", ms=5, color=line.get_color(), mfc="white")


def _heading(figures: list[dict[str, Any]], x: str, varied: list[str], rest: list[str], count: int) -> str:
    """What of the table is the same everywhere, what its picture leaves out, and what it cannot show."""
    same = [_named(key, figures[0][key]) for key in _keys(figures) if key not in varied]
    text = f", {', '.join(same)}" if same else ""
    if count > LINES:
        text += f", the first {LINES} of {count} combinations of {' and '.join(rest)} (table.csv has all)"
    failed = [row for row in figures if row["verdict"] == FAILED]
    gone = [value for value in _axis(figures, x) if all(r["verdict"] == FAILED for r in figures if r[x] == value)]
    if gone:
        text += f"; no static tow at {', '.join(_named(x, value) for value in gone[:3])}{', ...' if gone[3:] else ''}"
    others = sum(row[x] not in gone for row in failed)
    if others:
        text += f"; {others} of {len(figures)} tows failed and are left out"
    return text + ("; open marks are doubtful" if any(row["verdict"] == DOUBTFUL for row in figures) else "")
