"""What the command line says of a scenario of faults: function, failure mode, expected, found."""

from __future__ import annotations

from typing import Any

from ..terminal import plain_console


def tell_faults(name: str, rows: list[dict[str, Any]]) -> None:
    """Table of the failure modes of a scenario; of the figures found, those before the fault in brackets."""
    from rich.table import Table

    table = Table(title=f"Scenario: {name} (in brackets: before the fault)", title_justify="left")
    for column in ("name", "function", "failure mode", "time s", "expected", "found"):
        table.add_column(column)
    for row in rows:
        until = "" if row["until_s"] is None else f"{row['until_s']:g}"
        words = (row["name"], row["function"], row["failure_mode"], f"{row['at_s']:g} to {until}", row["expected"])
        beside = f"; beside {', '.join(row['beside'])}" if row["beside"] else ""
        table.add_row(*words, _found(row["found"], row["before"]) + beside)
    plain_console(120).print(table)


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
