"""Fields of a source: range, rounding, repeated values, dead channels, resets, jumps, probable units."""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from ....io.sources.rounding import resolution
from ..log import SECOND, Source
from ..mapping.units import UNITS, named
from .axes import EXAMPLES, Finding

FEWEST = 30  # records, of fewer nothing is said
REPEATED = 0.3  # share of values that repeat the one before, which a log faster than its sensor has
JUMP = 20.0  # times the step that 99 % of the steps keep below
RESET = 0.02  # of the step: a counter that comes to rest so near zero was reset
COUNTER = re.compile(r"pay.?out|cable.?out|rope|length|count|encoder|line.?out|wire.?out", re.I)
PAYOUT = re.compile(r"(pay|cable|line|wire).?out", re.I)
ANGLE = re.compile(r"(^|[^a-z])(roll|pitch|yaw|heading|hdg|course|cog|cogt|headingt)([^a-z]|$)", re.I)
TURN = re.compile(r"yaw|heading|hdg|course|cog", re.I)
FORCE = re.compile(r"tension|load|force|pull", re.I)
RATE = re.compile(r"rate|vel|speed|covariance|accuracy|quality", re.I)
HEADING_JUMP = 20.0  # deg from one record to the next, within 2 s
MOST_FIELDS = 256  # of a source that are looked at


def of_fields(source: Source) -> tuple[list[dict[str, Any]], list[Finding]]:
    """Figures and findings of the fields of a source."""
    figures, found = [], []
    for name, values in list(source.columns.items())[:MOST_FIELDS]:
        row, more = _of_field(source, name, np.asarray(values, float))
        figures.append(row)
        found += more
    return figures, found


def _of_field(source: Source, name: str, values: np.ndarray) -> tuple[dict[str, Any], list[Finding]]:
    where, unit = f"{source.name}.{name}", source.units.get(name, "")
    there = np.isfinite(values)
    good = values[there]
    row: dict[str, Any] = {"field": name, "unit": unit, "missing": int(len(values) - len(good))}
    if not len(good):
        return row, []
    row |= {"least": float(good.min()), "most": float(good.max()), "mean": float(good.mean()), "std": float(good.std())}
    found: list[Finding] = []
    if len(good) < FEWEST:
        return row, found
    if PAYOUT.search(name) and good.max() < 0.0:
        text = f"negative throughout, {good.min():.6g} to {good.max():.6g} {unit}: counted the other way?"
        found.append(Finding(where, "negative", text, {"least": float(good.min()), "most": float(good.max())}))
    if not np.ptp(good):
        if not (unit or COUNTER.search(name) or FORCE.search(name) or ANGLE.search(name)) or RATE.search(name):
            return row, found  # a status
        text = f"{good[0]:.6g} {unit}".rstrip() + f" in all {len(good)} records: constant, or no sensor behind it"
        return row, [*found, Finding(where, "constant", text, {"value": float(good[0]), "records": len(good)})]
    row["resolution"] = resolution(good)
    same = float(np.mean(np.diff(good) == 0.0))
    row["repeated"] = same
    if row["resolution"] > 0.1 * row["std"]:
        text = f"steps of {row['resolution']:.4g} {unit} at a deviation of {row['std']:.4g}"
        found.append(Finding(where, "rounded", text, {"resolution": row["resolution"], "std": row["std"]}))
    if same > REPEATED and row["resolution"] < 0.2 * row["std"] and not RATE.search(name):
        text = f"{100 * same:.3g} % of the values repeat the one before"
        found.append(Finding(where, "repeated", text, {"share": same}))
    unit_row, unit_found = _unit(where, name, unit, good, row["resolution"])
    row |= unit_row
    return row, found + unit_found + _jumps(source, where, name, unit or row.get("probable_unit", ""), there, good)


def _unit(where: str, name: str, unit: str, good: np.ndarray, step: float) -> tuple[dict[str, str], list[Finding]]:
    """Probable unit of an angle or a force, by range and steps."""
    most = float(np.abs(good).max())
    known = named(unit) if unit else None
    if ANGLE.search(name) and not RATE.search(name):
        turn = bool(TURN.search(name))
        probable = "deg" if most > (2.1 * np.pi if turn else 0.5 * np.pi) else "rad" if most < 0.4 or turn else ""
        if known in ("deg", "rad") and probable and probable != known and (probable == "deg" or most < 0.02):
            text = f"the log says {unit}, but values up to {most:.4g} are probably {probable}"
            return {"probable_unit": probable}, [Finding(where, "unit", text, {"most": most})]
        if known is None and probable:
            text = f"no unit told; values up to {most:.4g} are probably {probable}"
            return {"probable_unit": probable}, [Finding(where, "unit", text, {"most": most})]
    if FORCE.search(name) and known is None and (not unit or unit not in UNITS):
        probable = "lb, kgf or daN" if step > 0.9 else "kN or t" if most < 1000.0 and step < 0.5 else "N"
        text = f"no unit told; steps of {step:.3g} up to {most:.5g} are probably {probable}"
        return {"probable_unit": probable}, [Finding(where, "unit", text, {"most": most, "step": step})]
    return {}, []


def _jumps(source: Source, where: str, name: str, unit: str, there: np.ndarray, good: np.ndarray) -> list[Finding]:
    """Resets of counters, and jumps of headings and heights."""
    stamps = source.stamps
    if stamps is None:
        return []
    t = (stamps[there] - stamps[0]) / SECOND
    steps = np.diff(good)
    if TURN.search(name) and not RATE.search(name) and unit in ("deg", "rad"):
        turn = 360.0 if unit == "deg" else 2.0 * np.pi
        turned = (steps + 0.5 * turn) % turn - 0.5 * turn
        big = np.flatnonzero((np.abs(turned) > HEADING_JUMP * turn / 360.0) & (np.diff(t) < 2.0))
        return [
            Finding(
                where,
                "heading_jump",
                f"turns by {turned[k]:.4g} {unit} in {t[k + 1] - t[k]:.3g} s after {t[k]:.4g} s",
                {"step": float(turned[k]), "after_s": float(t[k]), "times": len(big)},
            )
            for k in big[:EXAMPLES].tolist()
        ]
    moving = np.abs(steps[steps != 0.0])
    if not len(moving) or ANGLE.search(name):
        return []
    counter = bool(COUNTER.search(name))
    usual = float(np.quantile(moving, 0.99)) if len(moving) > 100 else float(np.median(moving))
    big = np.flatnonzero(np.abs(steps) > JUMP * usual)
    found = []
    for k in big[:EXAMPLES].tolist():
        evidence = {"from": float(good[k]), "to": float(good[k + 1]), "after_s": float(t[k]), "usual_step": usual}
        between = f"{good[k]:.6g} to {good[k + 1]:.6g} {unit}".rstrip()
        if counter and abs(good[k + 1]) <= RESET * abs(steps[k]):
            text = f"reset: from {between} after {t[k]:.4g} s"
            found.append(Finding(where, "reset", text, evidence))
        else:
            text = f"jumps from {between} after {t[k]:.4g} s, usual steps are up to {usual:.3g}"
            found.append(Finding(where, "jump", text, evidence))
    return found
