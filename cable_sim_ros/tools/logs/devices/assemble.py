"""From rows of telegrams to a Log: which rows count, dates of times of day, and what is to be said of the log."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median_low

import numpy as np

from ..log import DAY, MONTH_FIRST, NO_ZONE, Builder, Log, Losses
from .lines import with_records

FEW_DATES, MANY_STAMPS = 3, 30  # fewer dates that agree are not believed against so many stamps of the logger


@dataclass(slots=True)
class Row:
    """A record of a source. logged: its stamp [ns], None without; clock: what its device tells [ns], since midnight
    where told is "time", None without; told: "date" and "time" of a sentence, "own": a clock that no other sets;
    bare: no checksum; fields: of its sentence; follows: a sample of the same telegram as the row before."""

    source: str
    kind: str
    values: Mapping[str, float]
    units: Mapping[str, str]
    line: int
    logged: int | None
    clock: int | None = None
    told: str = ""
    bare: bool = False
    fields: int = 0
    follows: bool = False


def assemble(path: Path, name: str, rows: list[Row], losses: Losses, notes: Counter[str]) -> Log:
    """The Log; LogError where nothing is left."""
    notices = _said(notes)
    rows = _whole(rows, losses, notices)
    _date(rows, notices)
    _compare(rows, notices)
    rows = _with_clock(rows, losses, notices, "logged", "record without the logger's stamp that its others have")
    rows = _with_clock(rows, losses, notices, "clock", "record without the time that its others tell")
    build = Builder()
    for row in rows:
        build.add(row.source, row.kind, row.values, logged=row.logged, device=row.clock, units=row.units)
    records = sum(not row.follows for row in rows)
    sources = build.sources()
    return with_records(Log(str(path), name, sources, records, losses, [*notices, *build.mixed]), "telegram")


SAID = {  # note: what is said of it, with its count
    f"stamp: {NO_ZONE}": "the logger's stamps tell no zone and are taken as UTC",
    f"stamp: {MONTH_FIRST}": "the logger's dates are taken as month/day/year",
    "joined": "{} sentences were cut in two by a line end and are joined, their checksums fit",
    "series": "{} series (TSPHA) have the times of the buoy; the logger's stamp is of their end",
    "tension": "the LCI-90i does not tell the unit of its tension (lb, kgf or daN)",
    "tss1": "TSS1 has no checksum: a wrong digit is not seen",
    "before": "{} lines have text in front of the sentence that is no stamp known here",
    "remark": "{} lines are remarks without a telegram",
}


def _said(notes: Counter[str]) -> list[str]:
    said = [text.format(notes[note]) for note, text in SAID.items() if notes[note]]
    letters: dict[str, list[str]] = defaultdict(list)
    for note, count in sorted(notes.items()):
        if note.startswith("letters: "):
            place, _, letter = note.removeprefix("letters: ").rpartition(" ")
            letters[place].append(f"{letter} ({count})")
    for place, found in letters.items():
        if len(found) > 1 or found[0].startswith("V"):
            said.append(
                f"{place} has the letters {', '.join(found)}: a sign or a validity may stand in them, the numbers of "
                f"this sentence are read without"
            )
    for note, count in notes.items():
        what, _, which = note.partition(": ")
        if what in ("not decoded", "without numbers"):
            said.append(
                f"{count} sentences {which} hold " + ("what is not read here" if what[0] == "n" else "no number")
            )
    return said


def _whole(rows: list[Row], losses: Losses, notices: list[str]) -> list[Row]:
    """Without the sentences that lack a checksum which most of their kind have, or fields that others have."""
    checked = Counter(row.source for row in rows if not row.bare)
    fields: dict[str, Counter[int]] = defaultdict(Counter)
    for row in rows:
        if row.bare:
            fields[row.source][row.fields] += 1
    if not fields:
        return rows
    usual = {source: counts.most_common(1)[0][0] for source, counts in fields.items()}
    kept = []
    for row in rows:
        if row.bare and checked[row.source] >= fields[row.source].total():
            losses.add("no checksum, which others of its kind have", f"line {row.line}")
        elif row.bare and row.fields < usual[row.source]:
            losses.add("sentence with too few fields", f"line {row.line}")
        else:
            kept.append(row)
    bare = Counter(row.source for row in kept if row.bare)
    if bare:
        notices.append(f"no checksums, so that a wrong digit is not seen: {_counted(bare)}")
    return kept


def _date(rows: list[Row], notices: list[str]) -> None:
    """Set each clock to ns since 1970: a time of day takes the day that brings it nearest to the date that its device,
    else any, told last, or to the logger's stamp. In a log without stamps a sentence without a time takes the one told
    before it."""
    timed = [row for row in rows if row.told in ("date", "time") and row.clock is not None]
    _vote(timed, notices)
    last: dict[str, int] = {}  # clock by device: each may be wrong in a way of its own
    for row in reversed(timed):
        if row.told == "date" and row.clock is not None:
            last[_device(row)] = last[""] = row.clock
    dated = "" in last
    for row in timed:
        if row.told == "time" and row.clock is not None:
            near = last.get(_device(row), last.get("")) if dated or row.logged is None else row.logged
            if near is not None:
                row.clock += (near - row.clock + DAY // 2) // DAY * DAY
        last[_device(row)] = last[""] = row.clock or 0
    if timed and not dated and any(row.logged is None for row in timed):
        notices.append("no sentence tells a date: times are of the first day of the log, from its midnight")
    if any(row.logged is not None for row in rows):
        return
    borrowed: Counter[str] = Counter()
    told = None
    for row in rows:
        if row.told in ("date", "time"):
            told = row.clock
        elif row.clock is None and told is not None:
            row.clock = told
            borrowed[row.source] += 1
    if borrowed:
        notices.append(
            f"no stamps of a logger: time of the sentence before, late by up to a burst, for {_counted(borrowed)}"
        )


def _vote(timed: list[Row], notices: list[str]) -> None:
    """Move dates that most others contradict to the day of these: few dates decide nothing against many stamps, nor one
    against the dates around it."""
    by_device: dict[str, list[Row]] = defaultdict(list)
    for row in timed:
        by_device[_device(row)].append(row)
    for device, rows in by_device.items():
        dates = [row for row in rows if row.told == "date" and row.clock is not None]
        stamped = sum(row.logged is not None for row in rows)
        if not dates:
            continue
        days = np.array([((row.clock or 0) - (row.logged or 0) + DAY // 2) // DAY for row in dates])
        if all(row.logged is not None for row in dates):
            (usual, count), *_ = Counter(days.tolist()).most_common(1)
            right = np.full(len(days), 0 if count < FEW_DATES and stamped >= MANY_STAMPS else usual)
            odd = days != right
        else:
            near = [days[max(0, k - 2) : k + 3] for k in range(len(days))]
            right = np.array([median_low(part.tolist()) for part in near])
            odd = (np.abs(days - right) > 1) & np.array([len(part) > 2 for part in near])
        for row, away in zip(dates, ((days - right) * odd).tolist()):
            row.clock = (row.clock or 0) - away * DAY
        if odd.any():
            against = "the logger's stamps" if stamped else "the others"
            notices.append(
                f"{int(odd.sum())} of {len(dates)} dates of {device} contradict {against} by "
                f"{abs(int((days - right)[np.argmax(odd)]))} days and are not used"
            )


def _with_clock(rows: list[Row], losses: Losses, notices: list[str], which: str, cause: str) -> list[Row]:
    """Without the rows that lack a clock which most of their source have; where most lack it, without that clock."""
    all_of = Counter(row.source for row in rows)
    have = Counter(row.source for row in rows if getattr(row, which) is not None)
    some = {source for source, count in have.items() if count < all_of[source]}
    if not some:
        return rows
    few = {source for source in some if 2 * have[source] < all_of[source]}
    for source in sorted(few):
        what = "logger's stamps" if which == "logged" else "times of the device"
        notices.append(f"{have[source]} of {all_of[source]} records of {source} have {what}, which are not used")
    kept = []
    for row in rows:
        if row.source in few:
            setattr(row, which, None)
        elif row.source in some and getattr(row, which) is None:
            losses.add(cause, f"line {row.line}")
            continue
        kept.append(row)
    return kept


def _compare(rows: list[Row], notices: list[str]) -> None:
    """Say of which sources the date is another one than that of the logger."""
    apart: dict[str, list[int]] = defaultdict(list)
    for row in rows:
        if row.told in ("date", "own") and row.clock is not None and row.logged is not None:
            apart[row.source].append(row.logged - row.clock)
    for source, differences in apart.items():
        days = median_low(differences) / DAY
        if abs(days) > 1:
            what = "ahead of" if days > 0 else "behind"
            notices.append(f"the logger's stamps are {abs(days):.1f} days {what} the dates that {source} tells")


def _device(row: Row) -> str:
    """Its sentences have one clock: the talker, with the name that the logger gives it."""
    device, slash, sentence = row.source.rpartition("/")
    return f"{device}{slash}{sentence[:2]}"


def _counted(counts: Counter[str]) -> str:
    shown = [f"{source} ({count})" for source, count in counts.most_common(8)]
    return ", ".join(shown) + (f" and {len(counts) - 8} more" if len(counts) > 8 else "")
