"""The task `rules` of /diagnostics: which rule on watch was broken, when first, for how long, how far."""

from __future__ import annotations

from ...sim.rules.latch import said
from ..rules import RuleKeeper
from ..status import OK, WARN, Status
from ..status import text_of as _text


def rule_status(keeper: RuleKeeper) -> Status:
    """A warning from the first break on, for as long as the node lives."""
    report = keeper.report()
    values = {"set": report["set"], "watched_s": _text(report["duration_s"])}
    for row in report["rules"]:
        name = row["rule"]
        values[f"{name}: worst"] = "none" if row["worst"] is None else f"{row['worst']:.6g}"
        values[f"{name}: {row['sense']}"] = f"{row['limit']:.6g}"
        if row["broken"]:
            values |= {
                f"{name}: worst_s": _text(row["worst_s"]),
                f"{name}: first_s": _text(row["first_s"]),
                f"{name}: first_ns": str(row["first_ns"]),
                f"{name}: seconds": _text(row["seconds"]),
                f"{name}: times": str(row["times"]),
            }
    values |= {f"not watched: {row['rule']}": row["why"] for row in report["not_watched"]}
    broken = [said(row) for row in report["rules"] if row["broken"]]
    if broken:
        return Status("rules", WARN, "; ".join(broken), values)
    return Status("rules", OK, f"{len(report['rules'])} rules kept", values)
