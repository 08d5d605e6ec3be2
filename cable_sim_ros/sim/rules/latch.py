"""A rule that has been broken stays so: when first, for how long, how often, and how far."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

AT_MOST, AT_LEAST = "at most", "at least"


class Rule(NamedTuple):
    """Name, key of the scene that puts it on watch, unit, which side of the limit is allowed, and what is compared."""

    name: str
    key: str
    unit: str
    sense: str
    meaning: str


RULES = (
    Rule(
        "working_load",
        "working_load or factor_of_safety",
        "N",
        AT_MOST,
        "tension at the sheave as it is read; without a rate largest along the cable",
    ),
    Rule("sheave_ratio", "sheave_ratio", "1", AT_LEAST, "D/d: root diameter of the sheave over that of the cable"),
    Rule(
        "wire_ratio",
        "wire_ratio",
        "1",
        AT_LEAST,
        "D/d1: root diameter of the sheave over that of the largest strand or wire",
    ),
    Rule("bend_radius", "bend_radius", "m", AT_LEAST, "least radius of the centreline on drum and sheave"),
    Rule("turns_left", "turns_left", "1", AT_LEAST, "turns of cable left on the drum"),
    Rule("slack", "slack_tension", "N", AT_LEAST, "least tension along the cable in any time step"),
    Rule("snap", "snap_tension", "N", AT_MOST, "tension at the sheave in any time step, shortly after slack"),
    Rule("lift_off", "lifted_fraction", "1", AT_MOST, "part of the wrap on the sheave that carries no load"),
    Rule("climb_out", "groove_margin", "m", AT_LEAST, "distance of the cable below the top of the groove"),
    Rule("rate_saturated", "saturated_share", "1", AT_MOST, "share of the tick in which the rate is at its limit"),
    Rule(
        "torque_saturated",
        "saturated_share",
        "1",
        AT_MOST,
        "share of the tick in which the motor gives all that its curve allows",
    ),
    Rule(
        "power_saturated", "saturated_share", "1", AT_MOST, "share of the tick in which the motor gives all its power"
    ),
    Rule("brake_rise", "brake_rise", "K", AT_MOST, "rise of the brake's temperature"),
    Rule("tension_damage", "cycle_constant", "1", AT_MOST, "sum of damage by cycles of the tension at the sheave"),
    Rule("bend_damage", "bend_life", "1", AT_MOST, "bendings of the most bent piece over those it bears"),
)
RULE = {rule.name: rule for rule in RULES}


class Latch:
    """One rule; every value is given with the number of its tick and its stamp. seconds: that one value stands for."""

    def __init__(self, name: str, limit: float, seconds: float) -> None:
        self.rule, self.limit, self.seconds = RULE[name], limit, seconds
        self.first: tuple[int, int] | None = None  # tick, stamp [ns]
        self.worst: tuple[float, int] | None = None  # value, tick
        self.count = self.times = 0
        self.now = False

    def take(self, values: np.ndarray, ticks: np.ndarray, stamps: np.ndarray) -> None:
        """Values [n] of later ticks; one that is not finite is not judged."""
        known = np.isfinite(values)
        if not known.any():
            self.now = False  # as after one value that is not judged, wherever the ticks are cut
            return
        sign = 1.0 if self.rule.sense == AT_MOST else -1.0
        broken = known & (sign * values > sign * self.limit)
        if broken.any():
            at = int(np.argmax(broken))
            if self.first is None:
                self.first = int(ticks[at]), int(stamps[at])
            self.count += int(broken.sum())
            self.times += int(np.sum(broken & ~np.concatenate(([self.now], broken[:-1]))))
        self.now = bool(broken[-1])
        far = np.where(known, sign * values, -np.inf)
        at = int(np.argmax(far))
        if self.worst is None or far[at] > sign * self.worst[0]:
            self.worst = float(values[at]), int(ticks[at])

    def reached(self, tick: int, stamp: int) -> None:
        """A sum that only grows has gone beyond the limit."""
        if self.first is None:
            self.first, self.times, self.now = (tick, stamp), 1, True

    def report(self, tick: float, value: float | None = None, last: tuple[int, int] = (0, 0)) -> dict[str, Any]:
        """For the JSON; tick: s; value: of a sum as it is now; last: tick and stamp of now."""
        first, worst, seconds, times = self.first, self.worst, self.count * self.seconds, self.times
        if value is not None:
            worst = value, last[0]
            if first is None and value > self.limit:
                first, times = last, 1
            seconds = 0.0 if first is None else (last[0] - first[0] + 1) * tick
        return {
            "rule": self.rule.name,
            "unit": self.rule.unit,
            "sense": self.rule.sense,
            "limit": self.limit,
            "broken": first is not None,
            "first_s": None if first is None else round(first[0] * tick, 9),
            "first_ns": None if first is None else first[1],
            "seconds": round(seconds, 9),
            "times": times,
            "worst": None if worst is None else worst[0],
            "worst_s": None if worst is None else round(worst[1] * tick, 9),
        }


def said(row: dict[str, Any]) -> str:
    """A broken rule in words."""
    unit = "" if row["unit"] == "1" else f" {row['unit']}"
    return (
        f"{row['rule']} {row['worst']:.4g}{unit} at {row['worst_s']:.4g} s, {row['sense']} {row['limit']:.4g}{unit} "
        f"is allowed; broken first at {row['first_s']:.4g} s, for {row['seconds']:.3g} s in all"
    )
