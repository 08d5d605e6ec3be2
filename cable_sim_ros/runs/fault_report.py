"""What a run did while each fault of a scenario was there: the column `found` of a report on failure modes."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from ..io.scenes.fault_plan import PLANS, FaultPlan, load_faults, timed
from ..physics.tick_output import Flag
from .live_changes import Change

AFTER = 30.0  # s that are looked at after a fault is mended
BEFORE = 30.0  # s before it, that it is compared with


def scenario_of(given: FaultPlan | Mapping | str | os.PathLike | None) -> FaultPlan | None:
    """A scenario, or that of plain data or a file. Raises FaultError."""
    if isinstance(given, Mapping):
        return PLANS.check(given, "faults")
    return given if given is None or isinstance(given, FaultPlan) else load_faults(given)


def in_order(changes: Iterable[Change], plan: FaultPlan | None) -> tuple[Change, ...]:
    """Changes and those that a scenario makes, in order of time."""
    made = () if plan is None else (Change(*row) for row in timed(plan))
    return tuple(sorted((*changes, *made), key=lambda one: one.time))


def found(plan: FaultPlan, frames: np.ndarray) -> list[dict[str, Any]]:
    """One dict a failure mode: function, failure mode, expected, found, and before it; frames: of the whole run.

    beside: failure modes that these figures have too; found: of the time from ``at`` to AFTER past ``until``;
    before: of the BEFORE seconds before.
    """
    times = frames["time"]
    seconds = (times - 2 * times[:1] + times[1:2]) * 1e-9 if len(times) > 1 else np.zeros(len(times))
    rows = []
    for name, case in sorted(plan.faults.items(), key=lambda item: item[1].at):
        end = np.inf if case.until is None else case.until + AFTER
        during, before = (seconds > case.at) & (seconds <= end), (seconds > case.at - BEFORE) & (seconds <= case.at)
        row: dict[str, Any] = {
            "name": name,
            "function": case.function,
            "failure_mode": f"{case.target} {case.kind.value}" + (f" {case.size:g}" if case.size else ""),
            "at_s": case.at,
            "until_s": case.until,
            "expected": case.expected,
        }
        row["beside"] = [
            other
            for other, one in plan.faults.items()
            if other != name and one.at <= end and (one.until is None or one.until > case.at - BEFORE)
        ]
        row["found"] = _figures(frames[during]) if during.any() else None
        row["before"] = _figures(frames[before]) if before.any() else None
        rows.append(row)
    return rows


def _figures(frames: np.ndarray) -> dict[str, Any]:
    words = int(np.bitwise_or.reduce(frames["status"]))
    return {
        "seconds": float(np.diff(frames["time"][[0, -1]])[0]) * 1e-9,
        "tension_min_n": float(frames["tension_tick_min"].min()),
        "tension_max_n": float(frames["tension_tick_max"].max()),
        "tension_std_n": float(frames["tension"].std()),
        "payout_travel_m": float(np.ptp(frames["payout"])),
        "payout_rate_max_m_per_s": float(frames["payout_rate_tick_max"].max()),
        "depth_std_m": float(frames["body_position"][:, 2].std()),
        "flags": [flag.name for flag in Flag if flag and words & flag],
    }
