"""What the command line says of a run: figures, pictures, paths, rules on watch, faults, residuals of a replay."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..sim.flag_rules import OK
from ..terminal import plain_console, print_table, say
from .options import EVERYTHING, Answer, drawn

if TYPE_CHECKING:
    from ..io.sources.recorded_tow import Residual
    from ..runs.offline import Run


def answer_of(result: Run, out: Path | None) -> Answer:
    """Figures, residuals of a replay, pictures, paths and verdict of a run; out: its folder."""
    verdict = result.verdict.lines()
    if result.run_verdict is not None:
        verdict += result.run_verdict.lines("the run itself")
    files = [
        *pictures_of(result, out),
        ("recording", result.bag),
        ("figures", out / "summary.json" if out else None),
        ("state", result.metrics.get("saved")),
    ]
    problem = [f"error: {result.problem}; the figures are of the part before it"] if result.problem else []
    return Answer(result.metrics, lambda: _tell(result), None, files, problem, verdict, result.verdict.code)


def _tell(result: Run) -> None:
    from ..runs.short_summary import short_table
    from ..runs.summary import summary_table

    metrics, context = result.metrics, click.get_current_context(silent=True)
    table = summary_table if context is not None and context.meta.get(EVERYTHING) else short_table
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


def pictures_of(result: Run, out: Path | None) -> list[tuple[str, Path]]:
    """Draw the run, its haul where the winch had a plan, and the strumming of its cable where that was computed."""
    if out is None or result.bag is None or not len(result.frames):
        return []
    from ..io.recordings.recorded_run import load_run
    from ..plots.haul import draw_haul
    from ..plots.run import draw_run
    from ..plots.strumming import draw_strum

    run, skip = load_run(result.bag), result.metrics["skip_s"]
    judged = (result.verdict, result.run_verdict)  # of a replay, and of the run that it repeats
    stamp = "; ".join(one.headline for one in judged if one is not None and one.state != OK)
    draws = [lambda: draw_run(run, out / "run.png", skip_s=skip, stamp=stamp)]
    if "winch_plan" in run.custom_data:
        draws.append(lambda: draw_haul(run, out / "haul.png", stamp=stamp))
    if run.strums:
        draws.append(lambda: draw_strum(run, out / "strumming.png", skip_s=skip, stamp=stamp))
    return drawn(*draws)


def phase_table(rows: Sequence[dict[str, Any]]) -> None:
    """Table of the phases of a plan of the ship."""
    shown = []
    for row in rows:
        cells = [
            " ".join(f"{row[f'{name}_{what}_{unit}']:.4g}" for what in ("min", "mean", "max"))
            for name, unit in (("tension", "n"), ("body_depth", "m"), ("layback", "m"))
        ]
        lead = f"{row['lead_min_deg']:.3g} to {row['lead_max_deg']:.3g}"
        shown.append((f"{row['begin_s']:g}", f"{row['end_s']:g}", row["phase"], *cells, lead))
    columns = ("from s", "to s", "phase", "tension N", "depth m", "layback m", "cable to port deg")
    print_table("Phases of the ship plan: least, mean and largest", columns, shown, left=("phase",))


def residual_table(rows: Sequence[Residual], difference: dict[str, Any] | None) -> None:
    """Table of the residuals of a replay, and its largest difference."""
    if not rows and difference is None:
        say(
            "The bag recorded nothing of the tow (no sheave/tension, towbody/pose or winch/state): "
            "there is nothing to compare with."
        )
        return
    shown = [
        (row.channel, row.quantity, *(f"{x:.4g}" for x in (row.mean, row.rms, row.largest)), row.unit, str(row.count))
        for row in rows
    ]
    columns, left = ("topic", "quantity", "mean", "rms", "largest", "unit", "messages"), ("topic", "quantity", "unit")
    print_table("Residuals: simulated less recorded", columns, shown, left)
    if difference is not None:
        say(
            f"Largest difference of any figure of a tick output over {difference['ticks']} common ticks: "
            f"{difference['difference']:.3g}" + (f" ({difference['field']})" if difference["field"] else "")
        )


def tell_rules(report: dict[str, Any]) -> None:
    """Every rule with its limit, its worst value, and when and for how long it was broken; cycles below."""
    shown = []
    for row in report["rules"]:
        broken = row["broken"]
        shown.append(
            (
                row["rule"],
                f"{row['sense']} {row['limit']:.5g}",
                _number(row["worst"]),
                _number(row["worst_s"]),
                "" if row["unit"] == "1" else row["unit"],
                _number(row["first_s"]),
                f"{row['seconds']:.5g}" if broken else "",
                "BROKEN" if broken else "kept",
            )
        )
    for row in report["not_watched"]:
        shown.append((row["rule"], "", "", "", "", "", "", f"not watched: {row['why']}"))
    columns = ("rule", "limit", "worst", "at s", "unit", "first at s", "for s", "state")
    print_table(f"Rules on watch: {report['set']}", columns, shown, left=("rule", "unit", "state"))
    cycles = report["cycles"]
    if "tension" in cycles:
        found = cycles["tension"]
        damage = "" if found["damage"] is None else f", damage {found['damage']:.4g}"
        say(f"cycles of the tension: {found['cycles']:g}, the largest range {found['largest_range_n']:.5g} N{damage}")
    bending = cycles["bending"]
    if bending["most"]:
        damage = "" if bending["damage"] is None else f", damage {bending['damage']:.4g}"
        say(
            f"bendings over the sheave: {bending['most']:g} of the piece that runs on at a pay-out of "
            f"{bending['most_at_payout_m']:.5g} m{damage}"
        )


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.5g}"


def tell_faults(name: str, rows: list[dict[str, Any]]) -> None:
    """Table of the failure modes of a scenario; of the figures found, those before the fault in brackets."""
    shown = []
    for row in rows:
        until = "" if row["until_s"] is None else f"{row['until_s']:g}"
        words = (row["name"], row["function"], row["failure_mode"], f"{row['at_s']:g} to {until}", row["expected"])
        beside = f"; beside {', '.join(row['beside'])}" if row["beside"] else ""
        shown.append((*words, _found(row["found"], row["before"]) + beside))
    columns = ("name", "function", "failure mode", "time s", "expected", "found")
    print_table(f"Scenario: {name} (in brackets: before the fault)", columns, shown, left=columns)


def _found(now: dict[str, Any] | None, before: dict[str, Any] | None) -> str:
    if now is None:
        return "the run ended before it"

    def pair(key: str, digits: str) -> str:
        return f"{now[key]:{digits}}" + (f" ({before[key]:{digits}})" if before else "")

    new = [flag for flag in now["flags"] if before is None or flag not in before["flags"]]
    return (
        f"tension {pair('tension_min_n', '.0f')} to {pair('tension_max_n', '.0f')} N, deviation "
        f"{pair('tension_std_n', '.3g')} N; travel {pair('payout_travel_m', '.3g')} m; depth deviation "
        f"{pair('depth_std_m', '.2g')} m; of {pair('seconds', '.3g')} s" + (f"; {', '.join(new)}" if new else "")
    )
