"""Everything of a log in one report: figures of sources and fields, findings with their evidence."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..log import SECOND, Log, Source
from ..mapping.time_base import dated
from .axes import EXAMPLES, Finding, of_axes, of_fields

GAP, LEAST_GAP = 5.0, 1.0  # periods, and s: a longer step is a gap
JITTER = 0.2  # of the period, rms: worth a line
STEP = 0.5  # s by which the difference of two clocks steps where one of them was set
AGREE = 5  # records on both sides of such a step that say so
SLOW = 2.0  # s between records, above which a seaway is lost
OFFSET = 1.0  # s: two clocks further apart are not of one time


def of_times(source: Source) -> tuple[dict[str, Any], list[Finding]]:
    """Figures and findings of a source."""
    ruling = source.stamps
    figures: dict[str, Any] = {"records": len(source), "clocks": _clocks(source)}
    found: list[Finding] = []
    if ruling is None or len(ruling) < 2:
        return figures, found
    steps = np.diff(ruling) / SECOND
    forward = steps[steps > 0]
    period = float(np.median(forward)) if len(forward) else 0.0
    figures |= {
        "start_ns": int(ruling[0]),
        "seconds": float((ruling[-1] - ruling[0]) / SECOND),
        "period_s": period,
        "rate_hz": 1.0 / period if period else 0.0,
    }
    back = int((steps < 0).sum())
    if back:
        k = int(np.argmax(steps < 0))
        found.append(
            Finding(
                source.name,
                "clock_jump",
                f"stamps step back {back} times, first by {-steps[k]:.6g} s at record {k + 2}",
                {"times": back, "first_s": float(steps[k])},
            )
        )
    if not period:
        return figures, found
    usual = steps[(steps > 0) & (steps < 1.5 * period)]
    jitter = float(np.sqrt(np.mean((usual - usual.mean()) ** 2))) if len(usual) else 0.0
    figures |= {"jitter_s": jitter, "equal_stamps": int((steps == 0).sum())}
    if jitter > JITTER * period:
        text = f"steps of {period:.4g} s jitter by {1e3 * jitter:.3g} ms (rms)"
        found.append(Finding(source.name, "jitter", text, {"jitter_s": jitter, "period_s": period}))
    if period > SLOW:
        text = f"a record every {period:.4g} s: waves below {2 * period:.3g} s are not in it"
        found.append(Finding(source.name, "slow", text, {"period_s": period}))
    long = np.flatnonzero(steps > max(GAP * period, LEAST_GAP))
    figures["gaps"] = len(long)
    for k in long[np.argsort(-steps[long], kind="stable")][:EXAMPLES].tolist():
        at = float((ruling[k] - ruling[0]) / SECOND)
        text = f"no record for {steps[k]:.4g} s after {at:.4g} s"
        found.append(Finding(source.name, "gap", text, {"seconds": float(steps[k]), "after_s": at}))
    return figures, found + _of_clocks(source, figures)


def _clocks(source: Source) -> list[str]:
    return [name for name in ("logged", "device") if getattr(source, name) is not None]


def _of_clocks(source: Source, figures: dict[str, Any]) -> list[Finding]:
    """The device's clock against the logger's."""
    if source.logged is None or source.device is None or len(source) < AGREE:
        return []
    ahead = (dated(source.device, source.logged) - source.logged) / SECOND
    steps = np.diff(ahead)
    found = []
    jumps = [
        k
        for k in np.flatnonzero(np.abs(steps) > STEP).tolist()
        if k + 1 >= AGREE
        and k + 1 + AGREE <= len(ahead)
        and np.ptp(ahead[k + 1 - AGREE : k + 1]) < STEP
        and np.ptp(ahead[k + 1 : k + 1 + AGREE]) < STEP
    ]
    for k in jumps[:EXAMPLES]:
        text = f"the device's clock steps by {steps[k]:.4g} s against the logger's at record {k + 2}"
        found.append(Finding(source.name, "clock_jump", text, {"seconds": float(steps[k]), "record": k + 2}))
    offset = float(np.median(ahead))
    t = (source.logged - source.logged[0]) / SECOND
    drift = float(np.polyfit(t, ahead, 1)[0]) if t[-1] > 0 and not jumps else 0.0
    spread = float(np.ptp(np.percentile(ahead, (5, 95))))
    figures["device_ahead_s"], figures["device_drift_ppm"], figures["device_spread_s"] = offset, 1e6 * drift, spread
    if abs(offset) > OFFSET:
        way = "ahead of" if offset > 0 else "behind"
        text = (
            f"the device's clock is {abs(offset):.4f} s {way} the logger's, drift {1e6 * drift:.3g} ppm, "
            f"5 to 95 % within {spread:.3g} s"
        )
        found.append(Finding(source.name, "clock", text, {"ahead_s": offset, "drift_ppm": 1e6 * drift}))
    return found


def renamed(log: Log) -> list[Finding]:
    """Sources that end where another one with the same fields begins."""
    found = []
    spans = []
    for source in log.sources.values():
        stamps = source.stamps
        if stamps is not None and len(stamps):
            spans.append((int(stamps[0]), int(stamps[-1]), source))
    spans.sort(key=lambda one: one[0])
    for k, (_, end, one) in enumerate(spans):
        later = [
            (begin, other)
            for begin, _, other in spans[k + 1 :]
            if begin >= end and other.kind == one.kind and set(other.columns) == set(one.columns)
        ]
        if later:
            begin, other = later[0]
            silent = (begin - end) / SECOND
            text = f"ends, and {silent:.4g} s later {other.name} begins with the same fields: probably renamed"
            found.append(Finding(one.name, "renamed", text, {"silent_s": silent}))
    return found


@dataclass
class Report:
    """Of one log: sources with figures, findings."""

    path: str
    format: str
    records: int
    lost: dict[str, int]
    losses: str
    notices: list[str]
    sources: list[dict[str, Any]] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        return {**vars(self), "findings": [one._asdict() for one in self.findings]}


def inspect_log(log: Log) -> Report:
    """Report of a log."""
    report = Report(log.path, log.format, log.records, dict(log.losses.counts), str(log.losses), list(log.notices))
    for source in log.sources.values():
        figures, found = of_times(source)
        fields, more = of_fields(source)
        report.sources.append({"source": source.name, "kind": source.kind, **figures, "fields": fields})
        report.findings += [*found, *more]
    report.findings += renamed(log)
    report.findings += of_axes(log)
    return report
