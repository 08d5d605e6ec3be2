"""Figures of a run that a sweep keeps: every single number of docs/json.md that the machine has no part in."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ...errors import CableSimError
from ...runs.metrics import METRICS
from ...runs.summary import SUMMARY

RULE, BROKEN = "rule.", ".broken"  # worst value of a rule on watch; 1 where it was broken
OWN = ("contact_resultant_min_n", "N", "least resultant of the cable on the sheave at the end of a tick")  # of sweeps
DEEPEST = (  # of the tick in which the towbody is deepest; of sweeps
    ("body_depth_max_m", "m", "largest depth of the towbody below the mean water surface, at the end of a tick"),
    ("departure_angle_deepest_deg", "deg", "angle of the cable at the sheave from the downward vertical in that tick"),
)
OF_THE_MACHINE = ("realtime_factor", "compile_s", "start_s", "stepping_s")  # differ from run to run
UNITS = {name: unit for name, unit, _ in (*SUMMARY, OWN, *DEEPEST, *METRICS) if name not in OF_THE_MACHINE}
MEANINGS = {name: meaning for name, _, meaning in (*SUMMARY, OWN, *DEEPEST, *METRICS) if name in UNITS}
FIGURES = tuple(UNITS)
NO_NUMBERS = frozenset(  # figures of a run that are texts, vectors or counts by cause: no row keeps them
    name for name, unit, _ in METRICS if not unit
) | {"body_position_m", "flags", "winch_modes", "motion_refused", "commands_refused", "commands_limited", "residuals"}
IN_EVERY_ROW = ("verdict", "flags")  # whatever figures are asked for


class FigureError(CableSimError, ValueError):
    """A figure that cannot be computed with."""


def refuse_texts(figures: Iterable[str], what: str) -> None:
    """Raise FigureError where one of the figures of a plan is no number; what: would be computed of them."""
    for name in figures:
        if name in NO_NUMBERS:
            raise FigureError(
                f"figures names '{name}', which is no number and has no {what}; nothing was simulated. Leave it out: "
                "verdict and flags are in every row"
            )


def numbers_of(metrics: Mapping[str, Any]) -> dict[str, float]:
    """Those of a run that are single numbers; NaN where a run has none."""
    found = {}
    for name in FIGURES:
        value = metrics.get(name)
        if isinstance(value, bool) or not isinstance(value, int | float | None):
            continue
        if name in metrics:
            found[name] = float("nan") if value is None else float(value)
    rules = metrics.get("rules") or {}
    unseen = {row["rule"] for row in rules.get("not_watched", ())}
    for rule in rules.get("rules", ()):
        found[f"{RULE}{rule['rule']}"] = float("nan") if rule["worst"] is None else float(rule["worst"])
        unread = rule["rule"] in unseen  # neither kept nor broken
        found[f"{RULE}{rule['rule']}{BROKEN}"] = float("nan") if unread else float(rule["broken"])
    return found


def significant(value: float, digits: int = 0) -> str:
    """A number for a table: so many digits behind the point, or three that count where these are fewer."""
    return f"{value:.{digits}f}" if not value or abs(value) >= 10.0 ** (2 - digits) else f"{value:.3g}"


def unwatched(metrics: Mapping[str, Any]) -> list[str]:
    """A line for each rule of a run that was not watched."""
    return [
        f"rule {row['rule']} was not watched ({row['why']})"
        for row in (metrics.get("rules") or {}).get("not_watched", ())
    ]


def unit_of(name: str, rules: Mapping[str, str]) -> str:
    """Unit of a column of a row; rules: unit of each rule by name."""
    if name.endswith(BROKEN):
        return "1"
    return rules.get(name.removeprefix(RULE), "") if name.startswith(RULE) else UNITS.get(name, "")
