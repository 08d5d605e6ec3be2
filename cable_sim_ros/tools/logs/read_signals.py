"""Signals of whatever was recorded: a run of this product, an imported bag, or foreign logs with a mapping."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from functools import partial

from .log import Log, LogError, Losses, Source
from .mapping.apply import Applied, applied, covers, entries_covered
from .mapping.mapping_file import Mapping, fields_of, load_mapping, shipped_mappings, sources_of
from .mapping.words import column_of, find_sources
from .own_signals import Signal, signals_of_bag
from .several import Joined, Paths, paths_of, read_each

SHOWN = 5  # files in a notice


@dataclass
class Reading:
    """Signals and how they came about.

    mappings: name or file of each that was taken; said: what was done about times, values and files, a line each;
    missing: what of the mappings the logs do not give; files, records, losses: of what was read;
    empty: records without a number in a field that is mapped, of the field that has most.
    """

    signals: list[Signal]
    mappings: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    files: list[str] = field(default_factory=list)
    records: int = 0
    losses: list[Losses] = field(default_factory=list)
    empty: int = 0


def read(path: Paths, mapping: str | os.PathLike | None = None, format: str | None = None) -> Reading:
    """Signals of one or several files or folders, and what was done.

    A recording of this product and an imported bag need no mapping. mapping: name of a ready one, or a YAML file;
    None: the ready one that fits most of each file; format: of FORMATS, None: found from the first bytes.
    LogError if nothing can be used.
    """
    paths = paths_of(path)
    if mapping is None and format is None and len(paths) == 1:
        own = signals_of_bag(paths[0])
        if own:
            return Reading(own, files=[str(paths[0])], records=len(own[0].time))
    chosen = None if mapping is None else load_mapping(mapping)
    skipped: list[str] = []
    ready = {name: load_mapping(name) for name in shipped_mappings()} if chosen is None else {}
    groups: dict[str, Joined] = {}
    unfit: list[str] = []
    for log in read_each(paths, format, skipped):
        name = str(mapping) if chosen is not None else best_of(log, ready)
        if name is None:
            unfit.append(f"{log.path}: no ready mapping fits its sources ({', '.join(list(log.sources)[:SHOWN])})")
            continue
        if name not in groups:
            groups[name] = Joined(partial(_wanted, chosen or ready[name]))
        groups[name].add(log)
    if not groups:
        why = "; ".join([*unfit, *skipped][:SHOWN]) or f"{paths[0]}: no log is there"
        raise LogError(f"{why}; nothing was read. `cable-sim inspect {paths[0]} --mapping-out FILE` writes a mapping")
    out = Reading([], missing=unfit)
    if skipped:
        out.said.append(f"{len(skipped)} files that are no log were left out, the first: {skipped[0]}")
    problems = []
    for name, joined in groups.items():
        which = chosen or ready[name]
        log = joined.log()
        try:
            made = applied(log, which, ready=name in shipped_mappings())
        except LogError:
            if len(groups) == 1:
                raise
            problems.append(name)
            continue
        _take(out, name, log, joined, made)
        if chosen is None:
            out.said.append(f"{log.path}: read with the ready mapping {name}")
    if not out.signals:
        raise LogError(f"{paths[0]}: none of the mappings {', '.join(problems)} gives a signal; nothing was read")
    return out


def best_of(log: Log, ready: dict[str, Mapping]) -> str | None:
    """Name of the ready mapping that fits most of a log, None where none does."""
    fitting = [(entries_covered(log, one), name) for name, one in ready.items() if covers(log, one)]
    return max(fitting, key=lambda pair: pair[0])[1] if fitting else None


def _wanted(mapping: Mapping, source: Source) -> set[str] | None:
    """Columns of a source that a mapping takes, None where it does not name the source."""
    one = Log("", "", {source.name: source}, 0)
    fields: list[str] = []
    named = False
    for entry in mapping.signals.values():
        if find_sources(one, sources_of(entry)):
            named = True
            fields += [*fields_of(entry), entry.quality_field]
        if entry.quality_source and find_sources(one, [entry.quality_source]):
            named = True
            fields.append(entry.quality_field)
        named = named or bool(entry.stamped_by and find_sources(one, [entry.stamped_by]))
    return {column for name in fields if name and (column := column_of(source, name))} if named else None


def _take(out: Reading, name: str, log: Log, joined: Joined, made: Applied) -> None:
    there = {signal.quantity: signal for signal in out.signals}
    for signal in made.signals:
        if signal.quantity in there:
            out.missing.append(
                f"{signal.source}: {signal.quantity} is given by {there[signal.quantity].source} already; left out"
            )
        else:
            out.signals.append(signal)
    out.mappings.append(name)
    out.said += [*log.notices, *made.said]
    out.missing += made.missing
    out.files += joined.files
    out.records += log.records
    out.empty += made.empty
    if log.losses:
        out.losses.append(log.losses)
