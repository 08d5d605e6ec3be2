"""Comparison of what was measured (A) with what was simulated (B): alignment, scores, limits, verdict.

Its picture: each quantity over time, and what is left between the two.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from ...errors import CableSimError
from ...files import write_text
from ...plots.heading import STAMP
from ...plots.run import BLUE, FAINT, INK, ORANGE, PURPLE, canvas, thinned
from ...sim.flag_rules import DOUBTFUL, FAILED, OK
from ...sim.verdict import Reason, Verdict, check
from ..logs.own_signals import QUANTITIES, Signal
from .alignment import SEARCH, Clock, clock_of
from .pairing import LINES, NotPaired, clean, paired
from .recordings import Recording
from .score import SLOPE, Judged, Limits, Score, ellipsoid, inside, judge, score
from .spectra import BAND
from .units import Finding, findings, floor_of, step_of

SCORED = (  # quantities of a comparison, in this order; the motion of the ship is what both are given
    *("tension", "tension_drum", "payout", "payout_rate", "departure_angle"),
    *("body_x", "body_y", "body_depth", "body_depth_rate", "layback"),
    *("body_pitch", "body_roll", "body_yaw"),
)
MOTION = ("z", "heave", "roll", "pitch", "yaw", "speed")  # scored too, where both have them
LATE = 30.0  # deg of a lag that nobody applied: it alone makes an rms of half the deviation
PLACE = ("body_x", "body_y", "body_depth")

MOST = 8  # rows


class CompareError(CableSimError, ValueError):
    """Nothing can be compared: what, why, remedy."""


class Align(StrEnum):
    NONE = "none"
    CLOCK = "clock"
    ALL = "all"


@dataclass
class Found:
    """What alignment found of one quantity."""

    quantity: str
    clock: Clock
    findings: list[Finding] = field(default_factory=list)
    applied: bool = False

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        return {**vars(self), "clock": self.clock.as_dict(), "findings": [one._asdict() for one in self.findings]}


@dataclass
class Comparison:
    """Scores of every quantity that both have; only_a, only_b: what one has; clock: that of all, None: not looked for.

    body: 95 % ellipsoids of the towbody; exact: of two runs; judged: limits; notes: what was assumed or left out;
    recordings: of A and B, what was read and lost, and how, for the JSON.
    """

    name_a: str
    name_b: str
    align: Align = Align.NONE
    scores: list[Score] = field(default_factory=list)
    only_a: list[str] = field(default_factory=list)
    only_b: list[str] = field(default_factory=list)
    clock: Clock | None = None
    clock_applied: bool = False
    found: list[Found] = field(default_factory=list)
    body: dict[str, Any] | None = None
    exact: Exact | None = None
    limits: str = ""
    judged: list[Judged] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    doubts: list[Reason] = field(default_factory=list)
    recordings: dict[str, Recording] = field(default_factory=dict)

    @property
    def verdict(self) -> Verdict:
        """failed: a limit is violated; doubtful: something was applied, or looks wrong; else ok."""
        names = tuple(one.quantity for one in self.judged if not one.passed)
        violated = [reason("LIMIT", one.text, one.quantity) for one in self.judged if not one.passed]
        reasons = (*violated, *self.doubts)
        state = FAILED if names else DOUBTFUL if reasons else OK
        return Verdict(state, reasons, tuple(self.notes))

    def as_dict(self) -> dict[str, Any]:
        """For the JSON and the report."""
        return {
            "a": self.name_a,
            "b": self.name_b,
            "recordings": {side: one.as_dict() for side, one in self.recordings.items()},
            "align": self.align.value,
            "clock": None if self.clock is None else {**self.clock.as_dict(), "applied": self.clock_applied},
            "found": [one.as_dict() for one in self.found],
            "scores": [one.as_dict() for one in self.scores],
            "only_a": self.only_a,
            "only_b": self.only_b,
            "body": self.body,
            "exact": None if self.exact is None else self.exact.as_dict(),
            "limits": self.limits,
            "judged": [one._asdict() for one in self.judged],
            "verdict": self.verdict.as_dict(),
        }


def compare_recordings(a: Recording, b: Recording, **more: Any) -> Comparison:
    """The same of two recordings, of which it says too what was assumed, lacks and was lost; more: as of `compare`."""
    ticks = None if a.frames is None or b.frames is None else exact(a.frames, b.frames)
    out = compare(a.signals, b.signals, a.name, b.name, exact=ticks, **more)
    out.recordings = {"a": a, "b": b}
    for side, one in (("A", a), ("B", b)):
        out.notes += [f"{side}: {text}" for text in one.notes]
        if one.damage:
            out.doubts.append(check("DAMAGE", f"{side}: {one.damage}"))
    return out


def reason(flag: str, text: str, *names: str) -> Reason:
    """Of a verdict on what lasts no time; names: of the figures in doubt."""
    return Reason(flag, 0.0, 0.0, names, text)


def compare(
    a: Sequence[Signal],
    b: Sequence[Signal],
    name_a: str,
    name_b: str,
    *,
    align: Align | str = Align.NONE,
    window: tuple[float, float] = (-np.inf, np.inf),
    band: tuple[float, float] = BAND,
    slope: float = SLOPE,
    search: float = SEARCH,
    limits: Limits | None = None,
    exact: Exact | None = None,
) -> Comparison:
    """Compare; window: s from the first stamp of A; align: what of the clock, signs and units is applied.

    CompareError where they share no quantity.
    """
    out = Comparison(name_a, name_b, Align(align), exact=exact)
    first, second = _by_quantity(a, out, "A"), _by_quantity(b, out, "B")
    order = [name for name in (*SCORED, *MOTION) if name in first or name in second]
    order += sorted((set(first) | set(second)) & set(QUANTITIES) - set(order))
    both = [name for name in order if name in first and name in second]
    out.only_a = [name for name in order if name in first and name not in second]
    out.only_b = [name for name in order if name in second and name not in first]
    if not both:
        had = f"A: {', '.join(first) or 'none'}; B: {', '.join(second) or 'none'}"
        raise CompareError(
            f"{name_a} and {name_b} share no quantity ({had}); nothing was compared. Give a mapping that names one, "
            "docs/mapping.md"
        )
    origin = min(int(first[name].time[0]) for name in first if len(first[name].time))
    if exact is None or not exact.common:
        _align(out, first, second, both, origin, window, band, search)
    for name in both:
        out.scores.append(score(first[name], second[name], origin=origin, window=window, band=band, slope=slope))
        _lag(out, out.scores[-1])
    if not any(one.scored for one in out.scores):
        why = next((note for note in out.scores[0].notes if note.startswith("not scored: ")), "")
        raise CompareError(
            f"{name_a} and {name_b}: nothing could be scored ({out.scores[0].quantity}: "
            f"{why.removeprefix('not scored: ')}). Clocks that differ: --align clock; else give --from and --to "
            "within both"
        )
    out.notes += [f"{one.quantity}: not scored, see its notes" for one in out.scores if not one.scored]
    out.body = _body(first, second, origin, window)
    if limits is not None:
        out.limits, out.judged = limits.limits, judge(limits, out.scores)
    return out


def _by_quantity(signals: Sequence[Signal], out: Comparison, side: str) -> dict[str, Signal]:
    found: dict[str, Signal] = {}
    for one in signals:
        out.notes += [f"{side}, {one.quantity}: {text.removeprefix(f'{one.quantity}: ')}" for text in one.assumed]
        if not len(one.time):
            continue
        if one.quantity in found:
            out.notes.append(f"{side} has {one.quantity} twice: {one.source} is left out")
        else:
            found[one.quantity] = one
    return found


def _align(
    out: Comparison,
    first: dict[str, Signal],
    second: dict[str, Signal],
    both: list[str],
    origin: int,
    window: tuple[float, float],
    band: tuple[float, float],
    search: float,
) -> None:
    """Find clock, signs and units; apply what was asked for; say the rest."""
    told, adrift = [], False
    clocks = {name: clock_of(first[name], second[name], origin, band, search) for name in both if name not in MOTION}
    clocks = clocks or {name: clock_of(first[name], second[name], origin, band, search) for name in both}
    usable = [one for one in clocks.values() if one.found and one.interval is not None]
    if usable:
        out.clock = min(usable, key=lambda one: one.interval[1] - one.interval[0])  # type: ignore[index]
        apart = [one for one in usable if not _agree(one, out.clock)]
        if apart:
            others = ", ".join(f"{one.quantity} {one.lag:+.3f} s" for one in apart)
            told.append(
                f"the quantities lag differently ({out.clock.quantity} {out.clock.lag:+.3f} s, {others}): no one "
                "clock explains it, so a part of it is the instruments' or the simulation's own"
            )
    else:
        out.clock = max(clocks.values(), key=lambda one: abs(one.correlation), default=None)
    if out.align is not Align.NONE:
        if out.clock is not None and out.clock.found:
            out.clock_applied = True
            for name in both:
                second[name] = out.clock.moved(second[name], origin)
            drift = f" and {out.clock.drift_ppm:+.1f} ppm" if out.clock.drift_ppm is not None else ""
            half = 0.5 * (out.clock.interval[1] - out.clock.interval[0]) if out.clock.interval else np.nan
            out.doubts.append(
                reason(
                    "CLOCK",
                    f"the clock of B was moved by {-out.clock.lag:+.4f} s (+- {half:.2g} s){drift}, as "
                    f"{out.clock.quantity} has it: a lag of the simulation itself is in it",
                )
            )
        else:
            why = out.clock.why if out.clock is not None else "nothing to go by"
            out.doubts.append(reason("CLOCK", f"the clocks cannot be aligned: {why}; nothing was moved"))
    for name in both:
        row = Found(name, clocks.get(name) or Clock(name, False, why="not looked for: it is motion"))
        row.findings, doubt = _findings(first[name], second[name], origin, window, row.clock, out)
        adrift = adrift or (doubt and name in clocks)
        out.found.append(row)
        if not row.findings:
            continue
        row.applied = out.align is Align.ALL and all(one.clear for one in row.findings)
        for one in row.findings:
            if row.applied:
                old = first[name]
                first[name] = Signal(name, old.time, old.value * one.factor, old.source, list(old.assumed))
            how = f"; A was multiplied by {one.factor:g} for the scores" if row.applied else "; not applied"
            text = f"{name}: {one.text}{how if one.factor != 1.0 else ''}"
            out.doubts.append(reason(one.kind.upper(), text, name))
    if adrift and out.align is Align.NONE and not usable and out.clock is not None:
        told.append(f"the clock of B was not found ({out.clock.quantity}): {out.clock.why}")
    for text in told:
        out.doubts.append(reason("CLOCK", text))


def _lag(out: Comparison, one: Score) -> None:
    """Where the clock was looked for, its lag: the phase alone knows it but for whole periods."""
    clock = next((row.clock for row in out.found if row.quantity == one.quantity), None)
    if clock is None or out.clock_applied or one.figures["lag_s"] is None:
        return
    if clock.rivals:
        period = abs(clock.rivals[0][0] - clock.lag)
        one.notes.append(f"lag_s is one of several: {clock.why}")
        one.intervals.pop("lag_s", None)
        if abs(clock.lag) > 0.5 * period:
            one.put("lag_s", None)
            one.put("phase_deg", None)
        return
    if not clock.found or clock.interval is None:
        return
    phase = 360.0 * (one.figures["peak_hz"] or 0.0)
    one.put("lag_s", clock.lag, 0.5 * (clock.interval[1] - clock.interval[0]))
    one.put("phase_deg", phase * clock.lag)
    if abs(phase * clock.lag) > LATE and one.quantity not in MOTION:
        text = f"{one.quantity}: B is {clock.lag:+.3f} s behind A, {abs(phase * clock.lag):.0f} deg of the waves"
        why = "gain, rms and coherence are those of series that are not aligned (--align clock)"
        out.doubts.append(reason("CLOCK", f"{text}; not applied: {why}", one.quantity))


def _agree(one: Clock, other: Clock) -> bool:
    assert one.interval is not None and other.interval is not None
    gap = abs(one.lag - other.lag)
    return gap <= 2.0 * (0.5 * (one.interval[1] - one.interval[0]) + 0.5 * (other.interval[1] - other.interval[0]))


def _findings(
    a: Signal, b: Signal, origin: int, window: tuple[float, float], clock: Clock, out: Comparison
) -> tuple[list[Finding], bool]:
    """Signs, units and steps, with the clock moved where that is known; is that clock in doubt?"""
    usable = (one for one in (clock, out.clock) if one is not None and (one.found or one.rivals))
    known = None if out.clock_applied else next(usable, None)
    one = score(a, b if known is None else known.moved(b, origin), origin=origin, window=window)
    if not one.scored or one.pair is None:
        return [], False
    f = one.figures
    r, *rest = (f[name] or 0.0 for name in ("correlation", "mean_a", "mean_b", "std_a", "std_b"))
    means, sizes = (rest[0], rest[1]), (rest[2], rest[3])
    rows = [] if a.quantity in LINES else step_of(one.unit, one.pair)  # lines lose their track, and their size
    rows = rows or findings(one.unit, f["gain"], one.intervals.get("gain"), r, means, sizes, bool(clock.rivals))
    moving = min(sizes) > floor_of(one.unit, means)
    return rows, moving and (bool(clock.rivals) or r < np.cos(np.radians(LATE)))


def _body(
    first: dict[str, Signal], second: dict[str, Signal], origin: int, window: tuple[float, float]
) -> dict[str, Any] | None:
    """95 % ellipsoids of the towbody about the straight track of A, where both have all three coordinates."""
    if not all(name in one for one in (first, second) for name in PLACE):
        return None
    try:
        pairs = [paired(name, clean(first[name], origin), clean(second[name], origin), window) for name in PLACE]
    except NotPaired:
        return None
    if len({(len(one.time), one.time[0], one.step) for one in pairs}) != 1:
        return None
    good = np.logical_and.reduce([one.good for one in pairs])
    if good.sum() < 10:
        return None
    places_a = np.stack([one.a[good] for one in pairs], axis=1)
    places_b = np.stack([one.b[good] for one in pairs], axis=1)
    a, b = ellipsoid(places_a), ellipsoid(places_b)
    return {
        "axes": list(PLACE),
        "a": a,
        "b": b,
        "offset_m": (places_b.mean(axis=0) - places_a.mean(axis=0)).tolist(),
        "volume_ratio": b["volume_m3"] / a["volume_m3"] if a["volume_m3"] > 0.0 else None,
        "a_in_b": inside(places_a, places_b),
        "b_in_a": inside(places_b, places_a),
    }


ILLEGAL = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # in XML 1.0


def junit(comparison: Comparison) -> str:
    """A test case for each limit, and one for each reason of a verdict beside them."""
    verdict = comparison.verdict
    cases = [(f"{one.quantity}.{one.limit}", "limit", one.text, one.passed) for one in comparison.judged]
    cases += [(f"verdict.{reason.flag}", "doubtful", str(reason), False) for reason in comparison.doubts]
    cases = cases or [("verdict", "verdict", verdict.state, True)]
    failures = sum(not passed for *_, passed in cases)
    name = f"compare {comparison.limits}".strip()
    counts = {"tests": str(len(cases)), "failures": str(failures), "errors": "0", "skipped": "0"}
    root = ElementTree.Element("testsuites", {"name": "cable-sim", **counts})
    suite = ElementTree.SubElement(root, "testsuite", {"name": _legal(name), **counts})
    for what, kind, text, passed in cases:
        case = ElementTree.SubElement(suite, "testcase", {"name": _legal(what), "classname": "cable_sim.compare"})
        if passed:
            ElementTree.SubElement(case, "system-out").text = _legal(text)
        else:
            failure = ElementTree.SubElement(case, "failure", {"type": kind, "message": _legal(text)})
            failure.text = _legal(f"{text}\nA: {comparison.name_a}\nB: {comparison.name_b}")
    if verdict.notes:
        ElementTree.SubElement(suite, "system-out").text = _legal("\n".join(verdict.notes))
    ElementTree.indent(root)
    return ElementTree.tostring(root, "unicode", xml_declaration=True) + "\n"


def write_junit(comparison: Comparison, path: Path) -> None:
    """Save it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, junit(comparison))


def _legal(text: str) -> str:
    return ILLEGAL.sub("?", text)


class FieldDifference(NamedTuple):
    """A field of the tick output that differs: when first [s from the first common tick], largest magnitude of B less
    A, and when; nan_ticks: where one of them alone is no number."""

    field: str
    first_s: float
    ticks: int
    largest: float
    largest_at_s: float
    nan_ticks: int


class Exact(NamedTuple):
    """common: ticks with equal stamps, of ticks_a and ticks_b; fields: what differs, by the time of its beginning."""

    ticks_a: int
    ticks_b: int
    common: int
    fields: list[FieldDifference]

    @property
    def same(self) -> bool:
        """Every field of every tick to the last bit."""
        return not self.fields and self.ticks_a == self.ticks_b == self.common

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        return {
            "ticks_a": self.ticks_a,
            "ticks_b": self.ticks_b,
            "common": self.common,
            "same": self.same,
            "fields": [one._asdict() for one in self.fields],
        }

    def line(self) -> str:
        """In a sentence."""
        if self.same:
            return f"the same run: every field of all {self.common} ticks is equal to the last bit"
        ticks = f"{self.common} common ticks of {self.ticks_a} and {self.ticks_b}"
        if not self.fields:
            return f"{ticks}: every field is equal to the last bit"
        first = self.fields[0]
        others = [one.field for one in self.fields if one.first_s == first.first_s]
        return f"{ticks}: {len(self.fields)} fields differ, first at {first.first_s:.4g} s: {', '.join(others[:6])}" + (
            f" and {len(others) - 6} more" if len(others) > 6 else ""
        )


def exact(a: np.ndarray, b: np.ndarray) -> Exact | None:
    """Differences of two runs, tick by tick; None without a common stamp. Stamps that come again are left out."""
    ours, i = np.unique(a["time"], return_index=True)
    theirs, j = np.unique(b["time"], return_index=True)
    common, k, m = np.intersect1d(ours, theirs, assume_unique=True, return_indices=True)
    if not len(common):
        return None
    one, other = a[i[k]], b[j[m]]
    seconds = (common - common[0]) * 1e-9
    found = []
    for name in a.dtype.names or ():
        if name == "time" or name not in (b.dtype.names or ()):
            continue
        mine, yours = (np.ascontiguousarray(run[name]).reshape(len(common), -1) for run in (one, other))
        x, y = mine.astype(float), yours.astype(float)
        unequal = (mine != yours) | (np.signbit(x) != np.signbit(y))
        unequal &= ~(np.isnan(x) & np.isnan(y))
        rows = unequal.any(axis=1)
        if not rows.any():
            continue
        gap = np.where(unequal, np.abs(y - x), 0.0)
        nan = np.isnan(gap)
        gap = np.where(nan, 0.0, gap).max(axis=1)
        first, at, alone = int(np.argmax(rows)), int(np.argmax(gap)), int(nan.any(axis=1).sum())
        largest = float(gap[at]), float(seconds[at])
        found.append(FieldDifference(name, float(seconds[first]), int(rows.sum()), *largest, alone))
    found.sort(key=lambda row: row.first_s)
    return Exact(len(a), len(b), len(common), found)


def draw_comparison(result: Comparison, path: Path) -> Path:
    """A and B, their difference, one row a quantity. RuntimeError where matplotlib is missing."""
    shown = [one for one in result.scores if one.pair is not None][:MOST]
    with canvas(path, (15.0, 1.9 + 2.5 * len(shown)), source="`cable-sim compare` of A and B") as figure:
        axes = figure.subplots(len(shown), 2, width_ratios=(1.6, 1.0), squeeze=False)
        verdict = result.verdict
        color = INK if verdict.state == OK else STAMP
        causes = ", ".join(dict.fromkeys(reason.flag for reason in verdict.reasons))
        told = f"verdict: {verdict.state}" + (f" ({causes})" if causes else "")
        figure.suptitle(f"A: {result.name_a}\nB: {result.name_b}\n{told}", x=0.01, ha="left", size=13, color=color)
        for (both, rest), one in zip(axes, shown, strict=True):
            pair = one.pair
            assert pair is not None
            time = pair.time - pair.time[0]
            both.plot(*thinned(time, pair.a), color=BLUE, lw=1.2, label="A")
            both.plot(*thinned(time, pair.b), color=ORANGE, lw=0.9, label="B")
            both.set_title(one.quantity + (", less the track of A" if pair.line else ""))
            both.set_ylabel(f"[{one.unit}]")
            low, high = both.get_ylim()
            both.set_ylim(low, high + 0.25 * (high - low))
            both.legend(loc="upper right", ncols=2, fontsize=10)
            rest.plot(*thinned(time, pair.b - pair.a), color=PURPLE, lw=0.8)
            rest.axhline(0.0, color=FAINT, lw=0.8)
            bias, rms = one.figures["bias"], one.figures["rms"]
            rest.set_title(f"B less A: mean {bias:.3g}, rms {rms:.3g} {one.unit}", fontsize=11)
        for axis in axes[-1]:
            axis.set_xlabel("time [s]")
    return path
