"""Everything of a log in one report: figures of sources and fields, findings with their evidence.

A finding says where, what, in words, and the numbers that show it. Of fields: range, rounding, repeated values, dead
channels, resets, jumps, probable units. Signs and axes that contradict each other: heave and antenna height, gravity,
roll and pitch against their rates.

A first mapping of a log: that of the ready one that fits, else by the names of the fields, to be read and mended.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ....files import read_text
from ....io.scenes.document import find_mapping, shipped_mappings
from ....io.scenes.yaml12 import dump
from ....io.sources.rounding import resolution
from ..log import SECOND, Log, Source
from ..mapping.mapping_file import load_mapping
from ..mapping.time_base import dated
from ..mapping.units import UNITS, named
from ..mapping.words import WORDS, find_sources
from ..not_valid import last_before, stamps_of_both
from ..read_signals import best_of

HEAVE = re.compile(r"(^|[^a-z])heave([^a-z]|$)", re.I)
HEIGHT = re.compile(r"^(alt|altitude|height.*|.*_height|hgt)$", re.I)
UP = re.compile(r"(accel.*(z|\[2\])$|^vertical$|.*acc_z$)", re.I)
FEWEST = 60  # records
SURE = 0.7  # correlation that says which sign
WINDOW = 60.0  # s of the mean that is taken off: tide and drift of the satellites
STALE = 2.0  # s

FEWEST_OF_FIELD = 30  # records, of fewer nothing is said
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

GAP, LEAST_GAP = 5.0, 1.0  # periods, and s: a longer step is a gap
JITTER = 0.2  # of the period, rms: worth a line
STEP = 0.5  # s by which the difference of two clocks steps where one of them was set
AGREE = 5  # records on both sides of such a step that say so
SLOW = 2.0  # s between records, above which a seaway is lost
OFFSET = 1.0  # s: two clocks further apart are not of one time

NAMES: tuple[tuple[str, str], ...] = (  # pattern of a field's name, word
    (r"^roll(_rad|_deg)?$", "roll"),
    (r"^pitch(_rad|_deg)?$", "pitch_bow_up"),
    (r"^(heading|hdg|headingt|gyro|shipgyro)(_rad|_deg)?$", "heading"),
    (r"^yaw(_rad|_deg)?$", "yaw"),
    (r"^heave_down(_m)?$", "heave_down"),
    (r"^heave(_m)?$", "heave"),
    (r"^(lat|latitude|rawycoordinate|sensorycoordinate)(_rad|_deg)?$", "latitude"),
    (r"^(lon|long|longitude|rawxcoordinate|sensorxcoordinate)(_rad|_deg)?$", "longitude"),
    (r"^(east|x)(_m)?$", "x"),
    (r"^(north|y)(_m)?$", "y"),
    (r"^(sog|sogn|speed_over_ground|speed)(_mps|_kn)?$", "speed"),
    (r"^(cog|cogt|course)(_rad|_deg)?$", "course_from_north"),
    (r"^(pay.?out|cable.?out|line.?out|wire.?out|cableout)(_m)?$", "payout"),
    (r"^(tension|load|line_?tension)(_n|_kn|_lb|_kgf)?$", "tension"),
    (r"^(pressure)(_dbar|_pa)?$", "pressure"),
    (r"^(depth|body_depth|sensordepth|fish_depth)(_m)?$", "body_depth"),
    (r"^layback(_m)?$", "layback"),
)
SUFFIXES = {"_rad": "rad", "_deg": "deg", "_m": "m", "_mps": "m/s", "_kn": "kn", "_n": "N", "_lb": "lb", "_kgf": "kgf"}
SUFFIXES |= {"_dbar": "dbar", "_pa": "Pa"}
EXAMPLES = 3  # findings of one kind in a field


class Finding(NamedTuple):
    """where: source, or source.field; what: its kind, a word; text: a line; evidence: numbers by name."""

    where: str
    what: str
    text: str
    evidence: dict[str, float]


def _fields(log: Log, pattern: re.Pattern) -> Iterator[tuple[Source, str]]:
    for source in log.sources.values():
        for name in source.columns:
            if pattern.search(name) and len(source) >= FEWEST and np.isfinite(source.columns[name]).sum() >= FEWEST:
                yield source, name


def paired(one: Source, field: str, other: Source, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time [s] and values of a field, and of another source's last record before each, where there is one."""
    stamps, at = stamps_of_both(one, other), last_before(one, other)
    if stamps is None or at is None:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    a, b = stamps
    usable = (at >= 0) & ((a - b[at]) / SECOND < STALE)
    first, second = one.columns[field], other.columns[name][at]
    usable &= np.isfinite(first) & np.isfinite(second)
    t = (a - a[0]) / SECOND
    usable &= np.concatenate(([True], np.diff(t) > 0))
    return t[usable], first[usable], second[usable]


def waves(t: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values less their mean over WINDOW."""
    period = float(np.median(np.diff(t)))
    n = max(3, round(WINDOW / max(period, 1e-9)) | 1)
    if n >= len(values):
        return values - values.mean()
    sums = np.cumsum(np.concatenate(([0.0], values)))
    k = np.arange(len(values))
    low, high = np.maximum(0, k - n // 2), np.minimum(len(values), k + n // 2 + 1)
    return values - (sums[high] - sums[low]) / (high - low)


def _heave(log: Log) -> Iterator[Finding]:
    for source, field in _fields(log, HEAVE):
        for other, name in _fields(log, HEIGHT):
            t, heave, height = paired(source, field, other, name)
            if len(t) < FEWEST:
                continue
            heave, height = waves(t, heave), waves(t, height)
            if not heave.std() or not height.std():
                continue
            correlation = float(np.corrcoef(heave, height)[0, 1])
            slope = float(heave @ height / (heave @ heave))
            if abs(correlation) > SURE:
                way = "up" if correlation > 0 else "DOWN"
                text = (
                    f"heave is positive {way}, proven by {other.name}.{name}: correlation {correlation:.4f}, slope "
                    f"{slope:.3f}, {len(t)} records"
                )
            else:
                text = (
                    f"the sign of heave is not provable by {other.name}.{name}: correlation {correlation:.2f} of "
                    f"{len(t)} records, height noise {float((height - slope * heave).std()):.2g} m, heave "
                    f"{float(heave.std()):.2g} m (std)"
                )
            evidence = {"correlation": correlation, "slope": slope, "records": len(t)}
            yield Finding(f"{source.name}.{field}", "heave_sign", text, evidence)
        for other, name in _fields(log, UP):
            t, heave, up = paired(source, field, other, name)
            if len(t) < FEWEST or np.median(np.diff(t)) > 1.0:
                continue
            bent = np.gradient(np.gradient(waves(t, heave), t), t)
            if not bent.std() or not up.std():
                continue
            correlation = float(np.corrcoef(bent, waves(t, up))[0, 1])
            if abs(correlation) > SURE:
                same = "the same sign as" if correlation > 0 else "the other sign than"
                text = f"heave has {same} {other.name}.{name}: correlation of the accelerations {correlation:.3f}"
                yield Finding(f"{source.name}.{field}", "heave_sign", text, {"correlation": correlation})


def _vertical(log: Log) -> Iterator[Finding]:
    for source, field in _fields(log, UP):
        mean = float(np.nanmean(source.columns[field]))
        for size, unit in ((9.81, "m/s^2"), (1.0, "g")):
            if abs(abs(mean) - size) < 0.15 * size:
                if mean < 0:
                    text = f"mean {mean:.3f} {unit}: z points down (NED), or gravity is taken for specific force"
                else:
                    text = f"mean {mean:.3f} {unit}: z points up, specific force"
                yield Finding(f"{source.name}.{field}", "vertical_axis", text, {"mean": mean})


def _exchanged(log: Log) -> Iterator[Finding]:
    """Roll whose slope is the rate about the other axis."""
    for source in log.sources.values():
        names = {name.lower(): name for name in source.columns}
        rates = next(
            ((r, p) for r, p in (("roll_rate", "pitch_rate"), ("rate_x", "rate_y")) if r in names and p in names), None
        )
        stamps = source.stamps
        if rates is None or stamps is None or not {"roll", "pitch"} <= names.keys() or len(source) < FEWEST:
            continue
        t = (stamps - stamps[0]) / SECOND
        if not (np.diff(t) > 0).all():
            continue
        roll = np.gradient(source.columns[names["roll"]], t)
        own, other = (source.columns[names[one]] for one in rates)
        if not all(np.isfinite(one).all() and one.std() for one in (roll, own, other)):
            continue
        with_own, with_other = (float(np.corrcoef(roll, one)[0, 1]) for one in (own, other))
        if abs(with_other) > SURE > abs(with_own):
            text = (
                f"roll follows {rates[1]} (correlation {with_other:.2f}), not {rates[0]} ({with_own:.2f}): roll "
                f"and pitch are probably exchanged"
            )
            evidence = {"with_own_rate": with_own, "with_other_rate": with_other}
            yield Finding(f"{source.name}.roll", "exchanged", text, evidence)


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
    if len(good) < FEWEST_OF_FIELD:
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
    steps, found = np.diff(good), list[Finding]()
    if TURN.search(name) and not RATE.search(name) and unit in ("deg", "rad"):
        turn = 360.0 if unit == "deg" else 2.0 * np.pi
        turned = (steps + 0.5 * turn) % turn - 0.5 * turn
        big = np.flatnonzero((np.abs(turned) > HEADING_JUMP * turn / 360.0) & (np.diff(t) < 2.0))
        for k in big[:EXAMPLES].tolist():
            text = f"turns by {turned[k]:.4g} {unit} in {t[k + 1] - t[k]:.3g} s after {t[k]:.4g} s"
            evidence = {"step": float(turned[k]), "after_s": float(t[k]), "times": len(big)}
            found.append(Finding(where, "heading_jump", text, evidence))
        return found
    moving = np.abs(steps[steps != 0.0])
    if not len(moving) or ANGLE.search(name):
        return []
    counter = bool(COUNTER.search(name))
    usual = float(np.quantile(moving, 0.99)) if len(moving) > 100 else float(np.median(moving))
    big = np.flatnonzero(np.abs(steps) > JUMP * usual)
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


def of_times(source: Source) -> tuple[dict[str, Any], list[Finding]]:
    """Figures and findings of a source."""
    ruling = source.stamps
    clocks = [name for name in ("logged", "device") if getattr(source, name) is not None]
    figures: dict[str, Any] = {"records": len(source), "clocks": clocks}
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
        text = f"stamps step back {back} times, first by {-steps[k]:.6g} s at record {k + 2}"
        found.append(Finding(source.name, "clock_jump", text, {"times": back, "first_s": float(steps[k])}))
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
        for begin, _, other in spans[k + 1 :]:
            if begin >= end and other.kind == one.kind and set(other.columns) == set(one.columns):
                silent = (begin - end) / SECOND
                text = f"ends, and {silent:.4g} s later {other.name} begins with the same fields: probably renamed"
                found.append(Finding(one.name, "renamed", text, {"silent_s": silent}))
                break
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
    sources: list[dict[str, Any]] = dataclasses.field(default_factory=list)
    findings: list[Finding] = dataclasses.field(default_factory=list)

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
    report.findings += [*renamed(log), *_heave(log), *_vertical(log), *_exchanged(log)]
    return report


def first_mapping(log: Log, findings: list[Finding]) -> str:
    """YAML text."""
    ready = best_of(log, {name: load_mapping(name) for name in shipped_mappings()})
    if ready is not None:
        head = f"# a copy of the ready mapping {ready}, which fits {_short(log.path)}\n"
        text = read_text(find_mapping(ready))
        for clock in {one.stamped_by for one in load_mapping(ready).signals.values() if one.stamped_by}:
            if not find_sources(log, [clock]):  # a mapping of one's own refuses a source that is not there
                text = text.replace(f', stamped_by: "{clock}"', "")
        return head + text
    entries: dict[str, dict[str, object]] = {}
    down = {one.where for one in findings if one.what == "heave_sign" and one.evidence["correlation"] < -0.7}
    dead = {one.where for one in findings if one.what == "constant"}
    given: set[str] = set()
    for source in sorted(log.sources.values(), key=len, reverse=True):
        for name in source.columns:
            word = next((word for pattern, word in NAMES if re.match(pattern, name, re.I)), None)
            if f"{source.name}.{name}" in dead:
                continue  # 0 throughout is what a channel without a sensor has
            if word == "heave" and f"{source.name}.{name}" in down:
                word = "heave_down"
            if word is None or WORDS[word].quantity in given:
                continue
            given.add(WORDS[word].quantity)
            entry: dict[str, object] = {"source": source.name, "field": name}
            unit = _unit_named(name, source.units.get(name, ""), word, f"{source.name}.{name}", findings)
            if unit:
                entry["unit"] = unit
            entries[word] = entry
    head = "# a first mapping by the names of the fields: check signs, units and clocks, docs/mapping.md\n"
    if not entries:
        names = ", ".join(list(log.sources)[:8])
        return (
            head
            + f"# no field has a name that is known; sources: {names}\n"
            + dump({"mapping": "first", "signals": {"heave": {"source": next(iter(log.sources), "?"), "field": "?"}}})
        )
    return head + dump({"mapping": "first", "about": f"of {_short(log.path)}", "signals": entries})


def _unit_named(name: str, told: str, word: str, where: str, findings: list[Finding]) -> str:
    if named(told):
        return told if UNITS[named(told) or ""].dimension == WORDS[word].unit else ""
    for suffix, unit in SUFFIXES.items():
        if name.lower().endswith(suffix) and UNITS[unit].dimension == WORDS[word].unit:
            return unit
    probable = next((f.text.rpartition("probably ")[2] for f in findings if f.where == where and f.what == "unit"), "")
    return probable if named(probable) else "lb" if word == "tension" and probable else ""


def _short(path: str) -> str:
    return path.rpartition("/")[2][:80]
