"""What the tick outputs of copies say against their figures: flags and overload, judged as those of a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from ...physics.tick_output import Flag
from ...sim.flag_rules import OK, RULES
from ...sim.scene import Scene
from ...sim.verdict import Reason, compensates, judge_counts, overload


@dataclass
class Seen:
    """Of one tow of a scene: ticks with each status word, the last one, the largest tension of the cable [N]."""

    scene: Scene
    statuses: Counter[int] = field(default_factory=Counter)
    last: int = 0
    tension_most: float = 0.0

    def take(self, frames: np.ndarray) -> None:
        """Count tick outputs."""
        if not len(frames):
            return
        words, ticks = np.unique(frames["status"], return_counts=True)
        counts = Counter(dict(zip(map(int, words), map(int, ticks), strict=True)))
        self.add(Seen(self.scene, counts, int(frames["status"][-1]), float(frames["tension_most"].max())))

    def add(self, later: Seen) -> None:
        """Count what was seen after this."""
        self.statuses += later.statuses
        self.last, self.tension_most = later.last, max(self.tension_most, later.tension_most)

    def reasons(self, any_tick: bool = False) -> tuple[Reason, ...]:
        """Why this tow's figures are in doubt; any_tick: a single tick is enough, whatever a run bears."""
        over, tick = overload(self.scene, self.tension_most), self.scene.solver.tick
        found = judge_counts(self.statuses, tick, self.last, scene=self.scene, others=over).reasons
        if not any_tick:
            return found
        total, told = sum(self.statuses.values()), {reason.flag for reason in found}
        for rule in RULES:
            ticks = sum(count for word, count in self.statuses.items() if word & int(Flag[rule.flag]))
            idle = rule.compensating and not compensates(self.scene)
            if ticks and rule.state != OK and rule.flag not in told and not idle:
                found += (Reason(rule.flag, ticks * tick, ticks / total, rule.metrics, rule.text),)
        return found


def flagged(seen: Mapping[int, Seen], copies: int, any_tick: bool = False) -> dict[str, str]:
    """Reason -> in how many of so many copies, in copy 0 (key 0 of seen), for how long at most, and what it means."""
    found: dict[str, dict[int, Reason]] = {}
    for number, one in sorted(seen.items()):
        for reason in one.reasons(any_tick):
            found.setdefault(reason.flag, {})[number] = reason
    return {flag: _line(reasons, copies) for flag, reasons in found.items()}


def of_recorded(tow: Seen, told: Mapping[str, str]) -> list[str]:
    """Lines for reasons that the recorded tow has and that were not told of its copies: they cannot have them, as where
    its motion was stale."""
    return [f"the recorded tow: {reason}" for reason in tow.reasons() if reason.flag not in told]


def _line(reasons: Mapping[int, Reason], copies: int) -> str:
    longest = max(reasons.values(), key=lambda reason: reason.seconds)
    count = sum(number > 0 for number in reasons)
    where = f"in {count} of {copies} copies" + " and in copy 0" * (0 in reasons) if count else "in copy 0 alone"
    lasted = f", for up to {longest.seconds:.3g} s ({100.0 * longest.fraction:.3g} %)" if longest.seconds > 0.0 else ""
    return f"{longest.flag} {where}{lasted}: {longest.text}"
