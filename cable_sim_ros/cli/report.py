"""What the command line says of a run: figures, pictures, paths, residuals of a replay."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..sim.flag_rules import OK
from ..terminal import plain_console, say
from .faults import tell_faults
from .options import EVERYTHING
from .rules import tell_rules

if TYPE_CHECKING:
    from ..io.sources.recorded_tow import Residual
    from ..runs.offline import Run


def tell(result: Run, out: Path | None, as_json: bool) -> None:
    """Figures, residuals of a replay, picture, paths and verdict of a run; leaves with the code of its verdict."""
    pictures = pictures_of(result, out)
    if as_json:
        say(json.dumps(result.metrics, indent=1), lines=True)
    else:
        from ..runs.short_summary import short_table
        from ..runs.summary import summary_table

        metrics = result.metrics
        table = summary_table if click.get_current_context().meta.get(EVERYTHING) else short_table
        plain_console(120).print(table(metrics, f"{metrics.get('scene', '')}, motion {metrics.get('motion')}"))
        if "phases" in metrics:
            phase_table(metrics["phases"])
        if "rules" in metrics:
            tell_rules(metrics["rules"])
        if "faults" in metrics:
            tell_faults(metrics["scenario"], metrics["faults"])
        if "largest_difference" in metrics:
            residual_table(result.residuals, metrics["largest_difference"])
        for notice in (*metrics.get("notices", ()), *metrics.get("replay_faults", ())):
            say(f"note: {notice}")
        for what, path in (
            *(("picture", path) for path in pictures),
            ("recording", result.bag),
            ("figures", out / "summary.json" if out else None),
            ("state", metrics.get("saved")),
        ):
            if path is not None:
                say(f"{what + ':':11}{path}")
    if result.problem:
        say(f"error: {result.problem}; the figures are of the part before it", err=True)
    if not as_json or result.verdict.code:
        for line in result.verdict.lines():
            say(line, err=as_json)
    if result.run_verdict is not None and not as_json:
        for line in result.run_verdict.lines("the run itself"):
            say(line)
    if result.verdict.code:
        sys.exit(result.verdict.code)


def pictures_of(result: Run, out: Path | None) -> list[Path]:
    """Draw the run, its haul where the winch had a plan, and the strumming of its cable where that was computed."""
    if out is None or result.bag is None or not len(result.frames):
        return []
    from ..io.recordings.recorded_run import load_run
    from ..plots.haul import draw_haul
    from ..plots.run import draw_run
    from ..plots.strumming import draw_strum

    try:
        run = load_run(result.bag)
        judged = (result.verdict, result.run_verdict)  # of a replay, and of the run that it repeats
        stamp = "; ".join(one.headline for one in judged if one is not None and one.state != OK)
        hauls = [draw_haul(run, out / "haul.png", stamp=stamp)] if "winch_plan" in run.custom_data else []
        skip = result.metrics["skip_s"]
        strums = [draw_strum(run, out / "strumming.png", skip_s=skip, stamp=stamp)] if run.strums else []
        return [draw_run(run, out / "run.png", skip_s=skip, stamp=stamp), *hauls, *strums]
    except RuntimeError as error:  # matplotlib is an extra
        say(f"warning: {error}", err=True)
        return []


def phase_table(rows: Sequence[dict[str, Any]]) -> None:
    """Table of the phases of a plan of the ship."""
    from rich.table import Table

    table = Table(title="Phases of the ship plan: least, mean and largest", title_justify="left")
    for name in ("from s", "to s", "phase", "tension N", "depth m", "layback m", "cable to port deg"):
        table.add_column(name, justify="left" if name == "phase" else "right")
    for row in rows:
        cells = [
            " ".join(f"{row[f'{name}_{what}_{unit}']:.4g}" for what in ("min", "mean", "max"))
            for name, unit in (("tension", "n"), ("body_depth", "m"), ("layback", "m"))
        ]
        lead = f"{row['lead_min_deg']:.3g} to {row['lead_max_deg']:.3g}"
        table.add_row(f"{row['begin_s']:g}", f"{row['end_s']:g}", row["phase"], *cells, lead)
    plain_console(120).print(table)


def residual_table(rows: Sequence[Residual], difference: dict[str, Any] | None) -> None:
    """Table of the residuals of a replay, and its largest difference."""
    if not rows and difference is None:
        say(
            "The bag recorded nothing of the tow (no sheave/tension, towbody/pose or winch/state): "
            "there is nothing to compare with."
        )
        return
    from rich.console import JustifyMethod
    from rich.table import Table

    table = Table(title="Residuals: simulated less recorded", title_justify="left")
    columns: tuple[tuple[str, JustifyMethod], ...] = (
        ("topic", "left"),
        ("quantity", "left"),
        ("mean", "right"),
        ("rms", "right"),
        ("largest", "right"),
        ("unit", "left"),
        ("messages", "right"),
    )
    for name, justify in columns:
        table.add_column(name, justify=justify)
    for row in rows:
        table.add_row(
            row.channel,
            row.quantity,
            f"{row.mean:.4g}",
            f"{row.rms:.4g}",
            f"{row.largest:.4g}",
            row.unit,
            str(row.count),
        )
    plain_console(120).print(table)
    if difference is not None:
        say(
            f"Largest difference of any figure of a tick output over {difference['ticks']} common ticks: "
            f"{difference['difference']:.3g}" + (f" ({difference['field']})" if difference["field"] else "")
        )
