"""Sources and fields of a log by the names and patterns of a mapping, with the nearest where there is none."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from fnmatch import fnmatchcase

from ..devices.sentences import by_place
from ..log import Log, Source

SHOWN = 8  # names in an error
MOST_SOURCES = 64  # of one entry
OF_TYPE = "type:"  # in front of a type of message, in place of a name


def find_sources(log: Log, patterns: Iterable[str]) -> list[Source]:
    """Sources of the names and patterns, in order of the log; MOST_SOURCES at most."""
    found = [
        source
        for name, source in log.sources.items()
        if len(source)
        and any(
            fnmatchcase(source.kind, one[len(OF_TYPE) :])
            if one.startswith(OF_TYPE)
            else name == one or fnmatchcase(name, one)
            for one in patterns
        )
    ]
    return found[:MOST_SOURCES]


def one_after_another(found: list[Source], fields: Iterable[str]) -> tuple[list[Source], list[Source]]:
    """Sources to take as one, which follow each other in time, and those that are left out: without the fields, or
    beside a longer one."""
    able = [s for s in found if all(column_of(s, name) for name in fields)] or found
    taken: list[Source] = []
    for source in sorted(able, key=len, reverse=True):
        if all(_apart(source, other) for other in taken):
            taken.append(source)
    return [s for s in found if any(s is t for t in taken)], [s for s in found if all(s is not t for t in taken)]


def _apart(one: Source, other: Source) -> bool:
    first, second = (s.stamps for s in (one, other))
    return first is not None and second is not None and bool(first[-1] <= second[0] or second[-1] <= first[0])


def column_of(source: Source, name: str) -> str | None:
    """Column of this name or place, else the first that fits it as a pattern."""
    name = by_place(source.name, name)
    if name in source.columns:
        return name
    return next((column for column in source.columns if fnmatchcase(column, name)), None)


def near(name: str, names: Iterable[str]) -> str:
    """The nearest of the names, and which there are, for an error."""
    names = list(names)
    close = difflib.get_close_matches(name, names, 1, 0.4) or [n for n in names if name.lower() in n.lower()][:1]
    return f"Did you mean {close[0]}? There are: {listed(names)}" if close else f"There are: {listed(names)}"


def listed(names: Iterable[str]) -> str:
    """Names in one line, the first SHOWN of them."""
    names = list(names)
    return ", ".join(n[:80] for n in names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
