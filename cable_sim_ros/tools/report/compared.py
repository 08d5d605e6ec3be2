"""What was watched, planned and compared: rules, scenario of faults, plan of the winch, residuals, scores."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from .subject import Section, Subject, Table, Text, counted, number, share, unit, without_paths

SHOWN = ("bias", "gain", "rms", "lag_s", "coherence", "peak_ratio", "samples")  # scores of a quantity


def rules(subject: Subject) -> Section | None:
    """The rules on watch with the worst value of each."""
    report = subject.metrics.get("rules")
    if not report:
        return None
    rows = [
        (
            "BROKEN" if row["broken"] else "kept",
            row["rule"],
            f"{row['sense']} {number(row['limit'])}",
            number(row["worst"]),
            unit(row["unit"]),
            number(row["worst_s"]),
            number(row["first_s"]) if row["broken"] else "-",
            number(row["seconds"]) if row["broken"] else "-",
        )
        for row in report["rules"]
    ]
    head = ("state", "rule", "limit", "worst", "unit", "at [s]", "first broken at [s]", "broken for [s]")
    found = Section("rules", "Rules on watch")
    found.parts.append(Table(f"Set of rules: {report['set']}", head, rows, right=(3, 5, 6, 7)))
    if report["not_watched"]:
        found.parts.append(
            Text([f"Not watched: {row['rule']}, {row['why']}." for row in report["not_watched"]], note=True)
        )
    cycles = report["cycles"]
    lines = []
    if "tension" in cycles:
        one = cycles["tension"]
        damage = "" if one["damage"] is None else f", damage {number(one['damage'], 4)}"
        lines.append(
            f"Cycles of the tension: {number(one['cycles'])}, largest range {number(one['largest_range_n'])} N{damage}."
        )
    if cycles["bending"]["most"]:
        one = cycles["bending"]
        damage = "" if one["damage"] is None else f", damage {number(one['damage'], 4)}"
        lines.append(
            f"Bendings over the sheave: {number(one['most'])} of the piece that runs on at a pay-out of "
            f"{number(one['most_at_payout_m'])} m{damage}."
        )
    found.parts += [Text(lines)] if lines else []
    return found


def faults(subject: Subject) -> Section | None:
    """The failure modes of a scenario, with what was found before and after each."""
    cases = subject.metrics.get("faults")
    if not cases:
        return None
    rows = []
    for case in cases:
        until = "the end" if case["until_s"] is None else f"{number(case['until_s'])} s"
        now, before = case["found"], case["before"]
        pair = partial(_pair, now, before)
        rows.append(
            (
                case["name"],
                f"{case['function']}: {case['failure_mode']}",
                f"{number(case['at_s'])} s to {until}",
                case["expected"],
                f"{pair('tension_min_n')} to {pair('tension_max_n')}" if now else "the run ended before it",
                pair("tension_std_n", 3),
                pair("payout_travel_m", 3),
                pair("depth_std_m", 2),
                ", ".join(now["flags"]) if now else "-",
            )
        )
    head = (
        "name",
        "function and failure mode",
        "time",
        "expected",
        "tension [N]",
        "its deviation [N]",
        "pay-out travel [m]",
        "depth deviation [m]",
        "flags",
    )
    caption = (
        f"Scenario {subject.metrics['scenario']}: found during each fault and shortly after; in brackets before it"
    )
    return Section("faults", "Scenario of faults", [Table(caption, head, rows)])


def _pair(now: Mapping[str, Any] | None, before: Mapping[str, Any] | None, name: str, digits: int = 4) -> str:
    """A figure found with a fault, and in brackets before it."""
    if now is None:
        return "-"
    return number(now[name], digits) + (f" ({number(before[name], digits)})" if before else "")


def plan(subject: Subject) -> Section | None:
    """What the run needed of its winch, beside what the scene has."""
    report = subject.plan
    if not report:
        return None
    rows = [
        (
            row["need"].replace("_", " "),
            number(row["needed"]),
            "no limit" if row["has"] is None else number(row["has"]),
            number(row["margin"]),
            "-" if row["margin_share"] is None else share(row["margin_share"]),
            unit(row["unit"]),
            number(row["at_s"]),
            row["meaning"],
        )
        for row in report["plan"]
    ]
    head = ("need", "needed", "the scene has", "margin", "margin of it", "unit", "at [s]", "meaning")
    names = [row["need"] for row in report["plan"]]
    found = Section("plan", "What the winch needed")
    found.parts.append(
        Table("Largest need of the run beside what there is", head, rows, right=(1, 2, 3, 4, 6), names=names)
    )
    found.parts += [Text(list(report["notes"]), note=True)] if report["notes"] else []
    return found


def residuals(subject: Subject) -> Section | None:
    """A replay beside its recording."""
    metrics = subject.metrics
    if "largest_difference" not in metrics:
        return None
    found = Section("residuals", "Simulated again, beside what was recorded")
    rows = [
        (row.quantity, row.channel, *(number(x, 4) for x in (row.mean, row.rms, row.largest)), row.unit, str(row.count))
        for row in subject.result.residuals
    ]
    if rows:
        head = ("quantity", "topic", "mean", "rms", "largest", "unit", "messages")
        found.parts.append(Table("Residuals: simulated less recorded", head, rows, right=(2, 3, 4, 6)))
    else:
        found.parts.append(Text(["The bag recorded nothing of the tow: there is nothing to compare with."], note=True))
    most = metrics["largest_difference"]
    if most is not None:
        where = f" ({most['field']})" if most["field"] else ""
        over = counted(most["ticks"], "common tick")
        text = f"Largest difference of any quantity over {over}: {number(most['difference'], 3)}{where}."
        found.parts.append(Text([text]))
    said = [without_paths(text, subject) for text in metrics.get("replay_faults") or ()]
    found.parts += [Text(said, note=True)] if said else []
    return found


def scores(subject: Subject) -> Section | None:
    """Scores and limits of a replay; scores of a caller, whatever figures they have."""
    found = Section("scores", "Scores: measured beside simulated")
    comparison = subject.metrics.get("comparison")
    if comparison:
        found.parts += _compared(comparison, subject)
    found.parts += tables_of(subject.scores, subject)
    return found if found.parts else None


def violated(subject: Subject) -> list[str]:
    """What is said of each limit on the scores that is not kept."""
    judged = (subject.metrics.get("comparison") or {}).get("judged", ())
    return [without_paths(one["text"], subject) for one in judged if not one["passed"]]


def _compared(comparison: Mapping[str, Any], subject: Subject) -> Iterator[Table | Text]:
    """Limits first, then a row for each quantity, its intervals in brackets, then what is to be known of them."""
    judged = comparison["judged"]
    if judged:
        rows = [
            (
                "kept" if one["passed"] else "VIOLATED",
                one["quantity"],
                one["limit"].replace("_", " "),
                number(one["value"], 4),
                without_paths(one["text"], subject),
            )
            for one in judged
        ]
        bad = [k for k, one in enumerate(judged) if not one["passed"]]
        yield Table("Limits on the scores", ("state", "quantity", "limit on", "found", "in words"), rows, (3,), bad=bad)
    scored = [one for one in comparison["scores"] if one["scored"]]
    rows = [(one["quantity"], unit(one["unit"]), *(_score(one, name) for name in SHOWN)) for one in scored]
    head = ("quantity", "unit", "bias", "gain", "rms", "lag [s]", "coherence", "peaks", "samples")
    a, b = (without_paths(str(comparison[one]), subject) for one in ("a", "b"))
    if rows:
        yield Table(f"{b} less {a}; 95 % intervals in brackets", head, rows, right=range(2, len(head)))
    else:
        yield Text(["No quantity could be scored."], note=True)
    said = [f"{one['quantity']}: {note}" for one in comparison["scores"] for note in one["notes"]]
    said += (comparison.get("verdict") or {}).get("notes", [])
    alone = ("what was measured", comparison["only_a"]), ("what was simulated", comparison["only_b"])
    said += [f"Only in {one}, not compared: {', '.join(names)}" for one, names in alone if names]
    if said:
        yield Text([without_paths(text, subject) for text in said], note=True)


def _score(one: Mapping[str, Any], name: str) -> str:
    """A score with its interval."""
    value, interval = one["figures"].get(name), one["intervals"].get(name)
    if value is None or name == "samples":
        return "-" if value is None else f"{value:.0f}"
    return number(value, 4) + (f" [{number(interval[0], 3)}, {number(interval[1], 3)}]" if interval else "")


def tables_of(rows: Sequence[Mapping[str, Any]], subject: Subject) -> list[Table]:
    """One table a row of scores: name and value of each figure; what is itself a table comes as name.name."""
    found: list[Table] = []
    for k, row in enumerate(rows, 1):
        pairs = [(name, without_paths(number(value), subject)) for name, value in leaves(row)]
        title = next((str(row[name]) for name in ("quantity", "name", "title") if name in row), f"score {k}")
        found.append(Table(title, ("figure", "value"), pairs, right=(1,), names=[name for name, _ in pairs]))
    return found


def leaves(data: Mapping[str, Any], before: str = "") -> list[tuple[str, Any]]:
    """Dotted names and values of nested data."""
    out: list[tuple[str, Any]] = []
    for name, value in data.items():
        here = f"{before}{name}"
        if isinstance(value, Mapping):
            out += leaves(value, f"{here}.")
        elif isinstance(value, (list, tuple)) and any(isinstance(part, Mapping) for part in value):
            for k, part in enumerate(value, 1):
                out += leaves(part, f"{here}.{k}.") if isinstance(part, Mapping) else [(f"{here}.{k}", part)]
        else:
            out.append((here, value))
    return out
