"""The rules on watch as a table on the terminal."""

from __future__ import annotations

from typing import Any

from ..terminal import plain_console, say


def tell_rules(report: dict[str, Any]) -> None:
    """Every rule with its limit, its worst value, and when and for how long it was broken; cycles below."""
    from rich.table import Table

    table = Table(title=f"Rules on watch: {report['set']}", title_justify="left")
    table.add_column("rule")
    for name in ("limit", "worst", "at s", "unit", "first at s", "for s"):
        table.add_column(name, justify="left" if name == "unit" else "right")
    table.add_column("state")
    for row in report["rules"]:
        broken = row["broken"]
        table.add_row(
            row["rule"],
            f"{row['sense']} {row['limit']:.5g}",
            _number(row["worst"]),
            _number(row["worst_s"]),
            "" if row["unit"] == "1" else row["unit"],
            _number(row["first_s"]),
            f"{row['seconds']:.5g}" if broken else "",
            "BROKEN" if broken else "kept",
        )
    for row in report["not_watched"]:
        table.add_row(row["rule"], "", "", "", "", "", "", f"not watched: {row['why']}")
    plain_console(120).print(table)
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
