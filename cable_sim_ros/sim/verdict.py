"""Verdict on a run: ok, doubtful or failed, why, for how long and for which figures. The bounds: flag_rules.py.

Made from counts of status words, which a node has too; what needs the tick outputs of a run is in runs/verdict.py. The
JSON, the last lines on the terminal, the exit code, the stamp on the pictures and the end of the node are made from it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from ..errors import CODE_DAMAGED, CODE_DOUBTFUL, CODE_FAILED, CODE_OK
from ..physics.heave_compensation import SetpointLaw
from ..physics.section import material_of
from ..physics.tick_output import Flag
from ..physics.towbody import SLAM
from .flag_rules import CHECKS, DAMAGE, DOUBTFUL, FAILED, MAX_STRESS, OK, REFUSED, REFUSED_S, RULES
from .scene import Scene

OF_A_RUN = {
    DOUBTFUL: "the run came to its end, but figures cannot be taken as they are",
    FAILED: "the run did not come to its end",
}
SURFACE_CROSSED = Flag.SURFACE_CROSSED.name
METRICS_OF = {check.name: check.metrics for check in CHECKS}
STATE_OF = {rule.flag: rule.state for rule in RULES} | {check.name: check.state for check in CHECKS}


class Reason(NamedTuple):
    """Why a run is not ok: flag of the tick output or name of CHECKS, for how long [s], share of the run, names of the
    figures in the JSON, meaning in words."""

    flag: str
    seconds: float
    fraction: float
    metrics: tuple[str, ...]
    text: str

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        return {
            "flag": self.flag,
            "seconds": self.seconds,
            "share": self.fraction,
            "figures": list(self.metrics),
            "text": self.text,
        }

    def __str__(self) -> str:
        lasted = f" for {self.seconds:.3g} s ({100.0 * self.fraction:.3g} % of the run)" if self.seconds > 0.0 else ""
        return f"{self.flag}{lasted}: {self.text}"


class Verdict(NamedTuple):
    """State of a run and the reasons for it; notes: what was chosen for it, which makes it no other state."""

    state: str = OK
    reasons: tuple[Reason, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def code(self) -> int:
        """Exit code of a command that ends so."""
        if self.state == FAILED:
            return CODE_FAILED
        if any(reason.flag == DAMAGE for reason in self.reasons):
            return CODE_DAMAGED
        return CODE_OK if self.state == OK else CODE_DOUBTFUL

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        found = {"state": self.state, "reasons": [reason.as_dict() for reason in self.reasons]}
        return found | ({"notes": list(self.notes)} if self.notes else {})

    @property
    def headline(self) -> str:
        """State and causes in a few words, for a stamp."""
        if not self.reasons:
            return self.state
        lasted = [f"{r.flag} {r.seconds:.3g} s" if r.seconds > 0.0 else r.flag for r in self.reasons]
        return f"{self.state.upper()}: {', '.join(lasted)}"

    def lines(self, of: str = "verdict", what: Mapping[str, str] = OF_A_RUN, page: str = "docs/flags.md") -> list[str]:
        """What the terminal says last; of: what is judged; what: a state means, explained on a page."""
        notes = [f"  note: {note}" for note in self.notes]
        if self.state == OK:
            return [f"{of}: ok", *notes]
        reasons = [f"  {reason}" for reason in self.reasons]
        return [f"{of}: {self.state}: {what[self.state]} ({page})", *reasons, *notes]


def verdict_of(reasons: Iterable[Reason]) -> Verdict:
    """The verdict that these reasons make together."""
    reasons = tuple(reasons)
    states = {STATE_OF.get(reason.flag, DOUBTFUL) for reason in reasons}
    return Verdict(FAILED if FAILED in states else DOUBTFUL if reasons else OK, reasons)


def check(name: str, text: str, seconds: float = 0.0, fraction: float = 0.0) -> Reason:
    """A reason that is one of CHECKS."""
    return Reason(name, float(seconds), float(fraction), METRICS_OF[name], text)


def judge_counts(
    statuses: Mapping[int, int],
    tick: float,
    last: int,
    *,
    scene: Scene | None = None,
    others: Iterable[Reason] = (),
    problem: str = "",
    slam: float | None = None,
) -> Verdict:
    """Verdict on a run of which only the ticks with each status word are known.

    statuses: status word of the tick outputs -> ticks; tick: length [s]; last: status of the last tick; others:
    reasons that are not flags; problem: why it ended early; slam: the largest that was left out, N, where known.
    """
    total = sum(statuses.values())
    reasons = [check("HALTED", problem)] if problem else []
    for rule in RULES:
        bit = int(Flag.__members__.get(rule.flag, Flag.NONE))
        ticks = sum(count for status, count in statuses.items() if status & bit)
        if not ticks or rule.state == OK or (rule.compensating and scene is not None and not compensates(scene)):
            continue
        seconds = ticks * tick
        if seconds > max(rule.seconds, rule.fraction * total * tick) * (1.0 + 1e-9) or (rule.at_end and last & bit):
            text = rule.text + (_left_out(slam) if rule.flag == SURFACE_CROSSED and slam is not None else "")
            reasons.append(Reason(rule.flag, seconds, ticks / total, rule.metrics, text))
    return verdict_of([*reasons, *others])


def _left_out(slam: float) -> str:
    """The size of the slam that a body in the water surface lacks; slam: N."""
    if slam == 0.0:
        return "; none went under fast enough for more of a slam than the growing added mass gives"
    return (
        f"; about {slam:.3g} N of the slam: rho/2 C_s A w^2 with C_s = {SLAM:g} (DNV-RP-H103 4.3.5), w the largest "
        "speed into the water, A the larger of the drag area along z and the side of a cube of the displaced volume, "
        "less what the growing added mass gives. Add it to the peaks, or keep the body under water"
    )


def compensates(scene: Scene) -> bool:
    """Does a set-point law drive the winch?"""
    return scene.setpoint.algorithm != SetpointLaw.HOLD


def strength(scene: Scene) -> float:
    """Tension [N] that no section of the cable carries."""
    limits = []
    for section in scene.cable.sections.values():
        own = material_of(scene.cable, section)
        limits.append(own.breaking_load or 0.25 * math.pi * own.diameter**2 * MAX_STRESS)
    return max(limits)


def overload(scene: Scene, maximum: float, seconds: float = 0.0, fraction: float = 0.0) -> tuple[Reason, ...]:
    """Reason where the largest tension [N] is above the strength; seconds, share: how long, 0 where not known."""
    limit = strength(scene)
    if not maximum > limit:
        return ()
    stretch = 100.0 * maximum / min(material_of(scene.cable, s).axial_stiffness for s in scene.cable.sections.values())
    known = any(material_of(scene.cable, s).breaking_load for s in scene.cable.sections.values())
    bound = (
        f"the breaking load of {limit:.4g} N"
        if known
        else f"{limit:.4g} N, {MAX_STRESS / 1e6:g} MPa of its full circle, which no steel or fibre rope carries"
    )
    return (
        check(
            "OVERLOAD",
            f"tension went up to {maximum:.4g} N, a strain of {stretch:.2g} %: above {bound}. The cable would "
            "have parted; what follows is no tow",
            seconds,
            fraction,
        ),
    )


def refused_motion(refusals: Iterable[tuple[str, float]], length: float) -> tuple[Reason, ...]:
    """Reasons where a source of motion was refused for long; refusals: text and s; length: of the run, s."""
    minimum = max(REFUSED_S, REFUSED * length)
    return tuple(
        check("MOTION_REFUSED", text, seconds, min(1.0, seconds / max(length, 1e-9)))
        for text, seconds in refusals
        if seconds > minimum
    )


def of_node(metrics: Mapping[str, Any]) -> tuple[Reason, ...]:
    """Reasons that the final figures of a node give beside its tick outputs."""
    found, recorder = [], metrics.get("recorder") or {}
    if metrics.get("skips_ahead"):
        times = f"{metrics['skips_ahead']} time{'s' * (metrics['skips_ahead'] > 1)}"
        found.append(check("BEHIND", f"the node did not hold real time and was taken to the present, {times}"))
    if recorder.get("dropped"):
        found.append(check("NOT_RECORDED", f"{recorder['dropped']} messages were not recorded: the disk is too slow"))
    found += refused_motion(map(tuple, metrics.get("motion_refusals") or ()), metrics.get("motion_s") or 0.0)
    return tuple(found)
