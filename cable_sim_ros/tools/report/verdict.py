"""The verdict of a report: one sentence at its top, and the reasons for it."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ...sim.flag_rules import DOUBTFUL, FAILED, OK
from ...sim.verdict import Verdict
from .subject import Card, Section, Subject, Table, Text, counted, number, share, unit, without_paths

LONG = 140  # characters of a reason within the sentence
SENTENCE = {
    OK: "The simulation came to its end and none of its checks objects: its figures can be taken as they are.",
    DOUBTFUL: "The simulation came to its end, but some of its figures cannot be taken as they are: {why}.",
    FAILED: "The simulation did not come to its end, so that its figures are not those of a whole run: {why}.",
}
REPLAY = {
    OK: "The replay is the recorded run: what was simulated again agrees with what was recorded.",
    DOUBTFUL: "The replay came to its end, but it cannot be taken for the recorded run: {why}.",
    FAILED: "The replay did not come to its end, so that it says little of the recorded run: {why}.",
}
CHECKED = (
    "Every tick of the simulation was checked: convergence of the solver, slack cable, contact with sheave and drum, "
    "age of the motion, limits of the winch, damping by the time steps. No check objected."
)
CARDS = (
    ("tension_mean_n", "mean tension at the sheave", "N"),
    ("tension_std_n", "standard deviation of the tension", "N"),
    ("tension_max_n", "largest tension after the start-up", "N"),
    ("tension_min_n", "least tension after the start-up", "N"),
    ("body_depth_m", "mean depth of the towbody", "m"),
    ("body_depth_std_m", "standard deviation of the depth", "m"),
    ("layback_max_m", "largest layback", "m"),
    ("sheave_heave_std_m", "standard deviation of the sheave's heave", "m"),
)
CARDS_OF_A_HAUL = (
    ("tension_max_n", "largest tension", "N"),
    ("tension_min_n", "least tension", "N"),
    ("scope_start_m", "scope at the start", "m"),
    ("scope_end_m", "scope at the end", "m"),
    ("body_depth_start_m", "depth at the start", "m"),
    ("body_depth_end_m", "depth at the end", "m"),
    ("winch_rate_max_m_s", "largest speed of the winch", "m/s"),
    ("winch_power_max_w", "largest power into the cable", "W"),
)


def is_replay(subject: Subject) -> bool:
    """Was a recording simulated again?"""
    return "largest_difference" in subject.metrics


def sentence(subject: Subject, missed: Sequence[str] = ()) -> str:
    """The verdict in one sentence; missed: limits on the scores that are not kept."""
    found = subject.result.verdict
    if missed and found.state != FAILED:
        limits = "1 limit on the scores is" if len(missed) == 1 else f"{len(missed)} limits on the scores are"
        return f"The replay came to its end, but {limits} not kept: {cut(missed[0])}."
    said = (REPLAY if is_replay(subject) else SENTENCE)[found.state]
    if not found.reasons:
        return said.format(why=without_paths(subject.result.problem, subject) or "no reason is known")
    first = found.reasons[0]
    lasted = f", for {number(first.seconds, 3)} s" if first.seconds > 0.0 else ""
    more = f", and {counted(len(found.reasons) - 1, 'more reason')}" if len(found.reasons) > 1 else ""
    return said.format(why=f"{cut(without_paths(first.text, subject))} ({first.flag}{lasted}){more}")


def cut(text: str) -> str:
    """The first sentence of a reason, of a long one what stands before its first colon or semicolon."""
    text = text.partition(". ")[0].rstrip(".")
    return text if len(text) <= LONG else re.split(r"[:;] ", text)[0]


def beside(subject: Subject) -> list[str]:
    """What else a reader must know before any figure: the run behind a replay, broken rules, a controller."""
    said = []
    run_verdict = subject.result.run_verdict
    if run_verdict is not None:
        said.append(f"The run itself, simulated again: {run_verdict.headline}.")
    imported = subject.metrics.get("imported")
    if imported:
        lost, records = number(imported.get("lost")), number(imported.get("records"))
        said.append(
            f"The ship motion is imported from logs ({records} records read, {lost} lost); what was assumed of them "
            "stands under Inputs."
        )
    rules = subject.metrics.get("rules")
    if rules:
        broken, watched = rules["broken"], counted(len(rules["rules"]), "rule")
        names = f": {', '.join(broken)}" if broken else ""
        were = "was" if len(broken) == 1 else "were"
        said.append(f"{len(broken)} of {watched} on watch {were} broken{names}.")
    if subject.scores:
        failed = [one for one in subject.scores if one.get("passed") is False or one.get("within") is False]
        said.append(f"{len(failed)} of {counted(len(subject.scores), 'score')} outside the limits.") if failed else None
    return said


def cards(subject: Subject) -> list[Card]:
    """The figures that are asked for first."""
    wanted = CARDS_OF_A_HAUL if subject.hauled else CARDS
    rows = [(name, label, subject.metrics.get(name), what) for name, label, what in wanted]
    for need in subject.plan["plan"] if subject.plan else ():  # one least tension on a page: that of the plan
        if need["need"] == "least_tension":
            least = "least_tension", "least tension along the cable", need["needed"], need["unit"]
            rows = [least if row[0] == "tension_min_n" else row for row in rows]
    return [Card(name, label, number(value, 4), unit(what)) for name, label, value, what in rows if value is not None]


def section(subject: Subject) -> Section:
    """Reasons of the verdict, and of that on a run behind a replay."""
    found = Section("verdict", "Verdict and its reasons")
    own = "Why the figures cannot be taken as they are"
    if is_replay(subject):
        own = "Why this may not be the recorded run"
    elif subject.result.verdict.state == FAILED:
        own = "Why the run did not come to its end"
    pairs = [(own, subject.result.verdict)]
    if subject.result.run_verdict is not None:
        pairs.append(("What is to be said of the run itself", subject.result.run_verdict))
    for caption, verdict in pairs:
        if verdict.reasons:
            found.parts.append(reasons(caption, verdict, subject))
    inputs = (subject.metrics.get("imported") or {}).get("notes", ())  # they stand there
    notes = [without_paths(note, subject) for note in subject.result.verdict.notes if note not in inputs]
    found.parts += [Text(notes, note=True)] if notes else []
    if not found.parts:
        found.parts.append(Text([CHECKED]))
    return found


def reasons(caption: str, verdict: Verdict, subject: Subject) -> Table:
    """A row for each reason."""
    rows = [
        (
            reason.flag,
            number(reason.seconds, 3) if reason.seconds > 0.0 else "-",
            share(reason.fraction) if reason.fraction > 0.0 else "-",
            without_paths(reason.text, subject),
            ", ".join(reason.metrics) or "-",
        )
        for reason in verdict.reasons
    ]
    head = ("reason", "time [s]", "share of the run", "what it means", "figures concerned")
    return Table(caption, head, rows, right=(1, 2))
