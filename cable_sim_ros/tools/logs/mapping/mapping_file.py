"""The mapping file: YAML, checked as scenes are. Each entry says what a field of a log is.

Units and words stand in their tables (`units.py`, `words.py`); docs/mapping.md is made of the declarations here.
"""

from __future__ import annotations

import difflib
import enum
from collections.abc import Iterator

from ....io.scenes.document import Document, SceneError, find_mapping, shipped_mappings
from ....physics.parameter import REQUIRED, Block
from ....physics.parameter import choice as plain_key
from ....physics.parameter import quantity as key
from ....sim.problem import Problem
from .units import UNITS, named, nearest
from .words import VECTORS, WORDS

EXAMPLE = "mapping: my winch"
FARTHEST = 1e10  # s, of a clock offset
ANGLES = ("roll", "pitch", "yaw")
LEVEL = ("roll", "pitch")
MOVED = {  # quantities that a lever arm moves, and the angles that this takes
    "x": ANGLES, "y": ANGLES, "z": LEVEL, "latitude": ANGLES, "longitude": ANGLES,
    "heave": LEVEL, "heave_rate": LEVEL, "surge": ANGLES, "sway": ANGLES,
}  # fmt: skip


class MappingError(SceneError):
    """A mapping that cannot be used; every problem in one text each."""


class Clock(enum.StrEnum):
    """Which stamps of a record count."""

    LOGGED = "logged"
    DEVICE = "device"
    ALIGNED = "aligned"


class Frame(enum.StrEnum):
    """Axes of a vector."""

    ENU = "enu"
    NED = "ned"
    FLU = "flu"
    FRD = "frd"


class Duplicates(enum.StrEnum):
    """Which of several records of one time counts."""

    FIRST = "first"
    LAST = "last"
    MEAN = "mean"


class Entry(Block):
    quantity: str = plain_key("", "word of the table below; empty: the name of the entry")
    source: str | tuple[str, ...] = plain_key(
        REQUIRED, "topic, sentence or table; with * and ?, `type:` and a type of message, or a list of such names"
    )
    field: str | tuple[str, ...] = plain_key(
        REQUIRED, "column of the source; three of a vector, four of a quaternion; names or patterns"
    )
    unit: str = plain_key("", "of the field; empty: what the log says, else SI, which is said")
    sign: int = key(1, "1", -1, 1, "-1 where the field runs against the word's sign, for what no word says")
    factor: float = key(1.0, "1", -1e9, 1e9, "on the values, in the field's unit")
    offset: float = key(0.0, "1", -1e9, 1e9, "added after the factor, in the field's unit")
    frame: Frame | None = plain_key(None, "axes of a vector: enu, ned: world; flu, frd: ship")
    lever_arm: tuple[float, float, float] | None = key(
        None, "m", -200.0, 200.0, "place of the sensor in base_link; position, displacement, velocity move to base_link"
    )
    time: Clock | None = plain_key(
        None, "logged: stamp of the logger; device: clock of the device; aligned: that, on the logger's"
    )
    stamped_by: str = plain_key("", "source whose device clock counts: its last record before this one")
    clock_offset: float = key(0.0, "s", -FARTHEST, FARTHEST, "added to the stamps")
    range: tuple[float, float] | None = key(None, "1", -1e12, 1e12, "values outside are left out, in the field's unit")
    quality_source: str = plain_key("", "source of the quality; empty: the entry's own")
    quality_field: str = plain_key("", "column that says whether a value is good")
    quality_accepted: tuple[float, ...] = key((), "1", -1e9, 1e9, "its values that are good")
    quality_refused: tuple[float, ...] = key((), "1", -1e9, 1e9, "its values that are bad, in place of accepted ones")
    after: float | None = key(None, "s", 0.0, FARTHEST, "records before this time of the log are left out")
    until: float | None = key(None, "s", 0.0, FARTHEST, "records after this time of the log are left out")
    duplicates: Duplicates = plain_key(
        Duplicates.FIRST, "which of several records of one time counts: first, last or mean"
    )
    every: float = key(0.0, "s", 0.0, 86400.0, "records closer to the last kept one are left out; 0: none")
    fresh_only: bool = plain_key(False, "leave values out that repeat the one before: a log faster than the sensor")
    optional: bool = plain_key(False, "a log without it is no finding")


class Mapping(Block):
    mapping: str = plain_key(REQUIRED, "name of the mapping")
    about: str = plain_key("", "what it is for, and where its conventions come from")
    density: float = key(1025.0, "kg/m^3", 900.0, 1100.0, "of the water, for depth from pressure")
    gravity: float = key(9.81, "m/s^2", 9.7, 9.9, "for depth from pressure")
    signals: dict[str, Entry] = plain_key(REQUIRED, "entries by word, or by any name with `quantity`")


def word_of(name: str, entry: Entry) -> str:
    """Word of an entry."""
    return entry.quantity or name


def fields_of(entry: Entry) -> tuple[str, ...]:
    """Fields of an entry."""
    return (entry.field,) if isinstance(entry.field, str) else entry.field


def sources_of(entry: Entry) -> tuple[str, ...]:
    """Names and patterns of the sources of an entry."""
    return (entry.source,) if isinstance(entry.source, str) else entry.source


def dimension_of(word: str) -> str:
    """SI unit of the fields of a word."""
    if word in WORDS:
        return WORDS[word].unit
    first = next(iter(VECTORS[word].words.values()))[0]
    return {"velocity": "m/s", "pull": "N", "quaternion": "1"}.get(word) or WORDS[first].unit


def _problems(mapping: Mapping) -> Iterator[Problem]:
    if not mapping.signals:
        yield Problem("signals", "has no entry: the log would give nothing", "Give one, docs/mapping.md")
    for name, entry in mapping.signals.items():
        yield from _of_entry(f"signals.{name}", name, entry)
    if not any(word in WORDS and WORDS[word].pressure for word in (word_of(*one) for one in mapping.signals.items())):
        text, remedy = "acts on pressure alone, and no entry is one", "Leave it out, or map pressure"
        yield from (Problem(one, text, remedy) for one in ("density", "gravity") if one in mapping.model_fields_set)


def _of_entry(where: str, name: str, entry: Entry) -> Iterator[Problem]:
    word, fields = word_of(name, entry), fields_of(entry)
    if word not in WORDS and word not in VECTORS:
        near = difflib.get_close_matches(word, [*WORDS, *VECTORS], 1, 0.5)
        text = f"= {word!r:.40} is no quantity of this product"
        remedy = f"Did you mean {near[0]}?" if near else f"Known: {', '.join([*WORDS, *VECTORS])}"
        yield Problem(f"{where}.quantity" if entry.quantity else where, text, remedy)
        return
    vector = VECTORS.get(word)
    wanted = vector.fields if vector else 1
    if len(fields) != wanted:
        yield Problem(f"{where}.field", f"names {len(fields)} columns, {word} has {wanted}", f"Give {wanted} names")
    if entry.unit:
        dimension, unit = dimension_of(word), named(entry.unit)
        if unit is None:
            text = f"= {entry.unit!r:.20} is no unit that is known"
            yield Problem(f"{where}.unit", text, nearest(entry.unit, dimension))
        elif UNITS[unit].dimension != dimension:
            text = f"= {entry.unit} does not fit: {word} is in {dimension}, {unit} in {UNITS[unit].dimension}"
            yield Problem(f"{where}.unit", text, nearest(entry.unit, dimension))
    if entry.sign == 0 or entry.factor == 0.0:
        which = "sign" if entry.sign == 0 else "factor"
        yield Problem(f"{where}.{which}", "= 0 would make every value the same", "Give another number")
    if entry.frame is not None and (vector is None or entry.frame.value not in vector.words):
        known = f"Known for {word}: {', '.join(vector.words)}" if vector else "Leave it out, or map a vector"
        yield Problem(f"{where}.frame", f"= {entry.frame.value} does not fit {word}", known)
    if entry.range is not None and entry.range[0] >= entry.range[1]:
        yield Problem(f"{where}.range", "leaves no value: the first is not below the second", "Give low, high")
    if entry.after is not None and entry.until is not None and entry.after >= entry.until:
        yield Problem(f"{where}.until", "is not after `after`: no record would be left", "Give a later time")
    if bool(entry.quality_field) != (bool(entry.quality_accepted) or bool(entry.quality_refused)):
        text = "stands without its other half: a quality is a field and its accepted or refused values"
        yield Problem(f"{where}.quality_field", text, "Give quality_field and quality_accepted, or neither")
    if entry.stamped_by and entry.time in (Clock.LOGGED, Clock.ALIGNED):
        text = f"is a device clock as it is, beside time: {entry.time.value}"
        yield Problem(f"{where}.stamped_by", text, "Leave one of them out")
    yield from _without_effect(where, word, entry)


def _without_effect(where: str, word: str, entry: Entry) -> Iterator[Problem]:
    """Keys that would do nothing to this word."""
    words = next(iter(VECTORS[word].words.values())) if word in VECTORS else (word,)
    if entry.lever_arm is not None and word != "velocity" and not MOVED.keys() >= {WORDS[w].quantity for w in words}:
        remedy = "Leave it out; a scene has heave.imu_position" if "acceleration" in word else "Leave it out"
        if word in ("speed", "course", "course_from_north"):
            remedy = "Map `velocity` with its vector, or leave it out"
        yield Problem(f"{where}.lever_arm", f"moves position and velocity, not {word}", remedy)
    if word in ("quaternion", "pull") and entry.sign < 0:
        text = "= -1 changes nothing: " + ("it turns as before" if word == "quaternion" else "the norm has no sign")
        yield Problem(f"{where}.sign", text, "Leave it out")
    if entry.quality_source and not entry.quality_field:
        yield Problem(f"{where}.quality_source", "stands without quality_field", "Give that, or neither")


MAPPINGS = Document(
    Mapping, "a mapping of a log", "mapping", EXAMPLE, find_mapping, shipped_mappings, _problems, error=MappingError
)
load_mapping = MAPPINGS.load  # of a YAML file or of the name of a ready one; MappingError with every problem of it
