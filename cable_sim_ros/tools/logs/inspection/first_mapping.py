"""A first mapping of a log: that of the ready one that fits, else by the names of the fields, to be read and mended."""

from __future__ import annotations

import re

from ....files import read_text
from ....io.scenes.document import find_mapping, shipped_mappings
from ....io.scenes.yaml12 import dump
from ..log import Log
from ..mapping.mapping_file import load_mapping
from ..mapping.units import UNITS, named
from ..mapping.words import WORDS, find_sources
from ..read_signals import best_of
from .inspect_log import Finding

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
            word = _word(name)
            if f"{source.name}.{name}" in dead:
                continue  # 0 throughout is what a channel without a sensor has
            if word == "heave" and f"{source.name}.{name}" in down:
                word = "heave_down"
            if word is None or WORDS[word].quantity in given:
                continue
            given.add(WORDS[word].quantity)
            entry: dict[str, object] = {"source": source.name, "field": name}
            unit = _unit(name, source.units.get(name, ""), word, f"{source.name}.{name}", findings)
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


def _word(name: str) -> str | None:
    return next((word for pattern, word in NAMES if re.match(pattern, name, re.I)), None)


def _unit(name: str, told: str, word: str, where: str, findings: list[Finding]) -> str:
    if named(told):
        return told if UNITS[named(told) or ""].dimension == WORDS[word].unit else ""
    for suffix, unit in SUFFIXES.items():
        if name.lower().endswith(suffix) and UNITS[unit].dimension == WORDS[word].unit:
            return unit
    probable = next((f.text.rpartition("probably ")[2] for f in findings if f.where == where and f.what == "unit"), "")
    return probable if named(probable) else "lb" if word == "tension" and probable else ""


def _short(path: str) -> str:
    return path.rpartition("/")[2][:80]
