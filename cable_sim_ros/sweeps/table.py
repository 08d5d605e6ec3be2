"""`cable-sim table`: depth, tension and departure angle of static tows over scope, speed and more keys."""

from __future__ import annotations

import json
import sys
import tempfile
from math import isfinite, nan
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..errors import CODE_DOUBTFUL, CODE_FAILED, CODE_OK, CableSimError
from .command import WORKERS, stoppable

if TYPE_CHECKING:
    from .sweep import Swept

SCOPE, SPEED = "winch.scope", "ship.tow_speed"
MOST = 1000  # values of a key
SHOWN = (  # figure, title, unit, digits
    ("body_depth_m", "depth of the towbody", "m", 1),
    ("tension_mean_n", "tension at the sheave", "N", 0),
    ("departure_angle_deg", "departure angle from the downward vertical", "deg", 1),
)


class TableError(CableSimError, ValueError):
    """A table that cannot be made."""


def values_of(text: str, what: str) -> list[float]:
    """`1`, `1,2,3` or `FIRST:LAST:COUNT`. Raises TableError."""
    try:
        if ":" in text:
            first, last, count = text.split(":")
            begin, end, n = float(first), float(last), int(count)
            if not 1 <= n <= MOST:
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
@click.option("--speed", metavar="VALUES", help="Speeds over ground in m/s. Default: that of the scene.")
@click.option("--vary", multiple=True, metavar="KEY=VALUES", help="Another key of the scene; may be repeated.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="A value of the scene by its key.")
@click.option("--out", type=click.Path(file_okay=False, path_type=Path), help="Folder for table.csv and table.png.")
@WORKERS
@click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
def table(scene, scope, speed, vary, settings, out, workers, as_json) -> None:
    """Depth, tension and departure angle of SCENE for every scope and speed, as static tows."""
    from ..io.scenes.load import load_scene
    from ..runs.settings import apply_to_scene, settings_of
    from .sweep import sweep
    from .sweep_file import checked

    base = apply_to_scene(load_scene(scene), given := settings_of(settings))
    grid = {SCOPE: values_of(scope, "--scope")}
    grid[SPEED] = values_of(speed, "--speed") if speed is not None else [base.ship.tow_speed]
    for text in vary:
        key, sign, values = text.partition("=")
        if not sign or key in grid:
            raise TableError(f"--vary {text!r:.60}: is no KEY=VALUES of another key; nothing was simulated")
        grid[key] = values_of(values, f"--vary {key}")
    named = str(Path(scene)) if Path(scene).is_file() else scene
    plan = checked({"sweep": f"table of {base.name}", "scene": named, "settings": given, "grid": grid}, "the table")
    with stoppable(out), tempfile.TemporaryDirectory(prefix="cable_sim_table_") as scratch:
        swept = sweep(plan, out if out is not None else scratch, workers=workers)
    figures = [
        {**case.varied, **{name: row.get(name) for name, *_ in SHOWN}, "verdict": row["verdict"], "error": row["error"]}
        for case, row in zip(swept.cases, swept.rows)
    ]
    if out is not None:
        _write(swept, figures, out)
    if as_json:
        click.echo(json.dumps({"scene": base.name, "rows": figures}, indent=1))
    else:
        _tell(base.name, swept, figures)
        if out is not None:
            click.echo(f"table:     {out / 'table.csv'}\npicture:   {out / 'table.png'}")
    verdicts = {row["verdict"] for row in figures}
    sys.exit(CODE_FAILED if "failed" in verdicts else CODE_DOUBTFUL if "doubtful" in verdicts else CODE_OK)


def _tell(name: str, swept: Swept, figures: list[dict[str, Any]]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    console = Console(width=None if sys.stdout.isatty() else 120)
    scopes, speeds = _axis(figures, SCOPE), _axis(figures, SPEED)
    others = sorted({_others(row) for row in figures})
    for figure, title, unit, digits in SHOWN:
        for other in others:
            place = f", {other}" if other else ""
            shown = Table(title=escape(f"{name}{place}: {title} [{unit}]"), title_justify="left")
            shown.add_column(escape("scope [m], speed [m/s]"), justify="right")
            for speed in speeds:
                shown.add_column(f"{speed:g}", justify="right")
            for scope in scopes:
                cells = [_find(figures, scope, speed, other)[figure] for speed in speeds]
                shown.add_row(f"{scope:g}", *("-" if cell is None else f"{cell:.{digits}f}" for cell in cells))
            console.print(shown)
    for error in dict.fromkeys(row["error"] for row in figures if row["error"]):
        click.echo(f"- : {error}", err=True)
    doubtful = dict.fromkeys(row["reasons"] for row in swept.rows if row["verdict"] == "doubtful")
    for reason in doubtful:
        click.echo(f"doubtful: {reason}", err=True)


def _axis(figures: list[dict[str, Any]], key: str) -> list[float]:
    return sorted({row[key] for row in figures})


def _others(row: dict[str, Any]) -> str:
    fixed = {SCOPE, SPEED, "verdict", "error", *(name for name, *_ in SHOWN)}
    return ", ".join(f"{key} = {value:.12g}" for key, value in row.items() if key not in fixed)


def _find(figures: list[dict[str, Any]], scope: float, speed: float, other: str) -> dict[str, Any]:
    return next(row for row in figures if (row[SCOPE], row[SPEED], _others(row)) == (scope, speed, other))


def _write(swept: Swept, figures: list[dict[str, Any]], out: Path) -> None:
    import csv

    with (out / "table.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(figures[0]))
        writer.writeheader()
        writer.writerows(figures)
    _draw(swept.plan.sweep, figures, out / "table.png")


def _draw(title: str, figures: list[dict[str, Any]], path: Path) -> None:
    from ..plots.canvas import canvas

    scopes, speeds = _axis(figures, SCOPE), _axis(figures, SPEED)
    other = sorted({_others(row) for row in figures})[0]
    heading = f"{title[0].upper()}{title[1:]}{', ' + other if other else ''}"
    with canvas(path, (12.0, 5.2), heading, "`cable-sim table`, static tows") as figure:
        panels = figure.subplots(1, len(SHOWN))
        for panel, (name, words, unit, _) in zip(panels, SHOWN):
            for speed in speeds:
                values = [_find(figures, scope, speed, other)[name] for scope in scopes]
                panel.plot(scopes, [nan if v is None else v for v in values], marker="o", ms=4, label=f"{speed:g} m/s")
            panel.set_xlabel("scope [m]")
            panel.set_ylabel(f"{words} [{unit}]")
            if name == "body_depth_m":
                panel.invert_yaxis()
        panels[0].legend(fontsize=10)
