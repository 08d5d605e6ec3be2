"""What the attributes of the objects that take inputs in may be, for notes that come from a file (`checkpoint.py`).

An attribute that always is one bool, int, float, text, enum, array or object needs no row: it stays of that kind, and
finite. Rows are for those that may be absent, hold several, must not be zero, or be a number that is none; `SAME` is
for what settings made, which the file must agree with.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import cache
from types import FunctionType
from typing import Annotated, Any

import numpy as np
from pydantic import Field, TypeAdapter, ValidationError

from ..messages.fault_hypotheses import DOUBTS
from ..messages.messages import CAUSES, VEHICLES, Command, Odometry
from .motion import IMU, ODOMETRY
from .time_sequencer import MAX, Held

MAX_WHOLE, MAX_REAL, MAX_TEXT = 2**62, 1e15, 10_000
Whole = Annotated[int, Field(ge=-MAX_WHOLE, le=MAX_WHOLE)]
Count = Annotated[int, Field(ge=0, le=MAX_WHOLE)]
Period = Annotated[int, Field(gt=0, le=MAX_WHOLE)]
Real = Annotated[float, Field(ge=-MAX_REAL, le=MAX_REAL, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, le=MAX_REAL, allow_inf_nan=False)]
Open = float  # may be infinite or no number
Text = Annotated[str, Field(max_length=MAX_TEXT)]
Three = tuple[Real, Real, Real]
Reals = tuple[Real, ...]


SAME = object()  # of the settings: as the object has it


def _rows(shape: tuple[int, ...], minimum: int = 1, maximum: int = 1, absent: bool = False) -> Callable[[Any], bool]:
    """A finite array, or a list of them."""

    def fits(value: Any) -> bool:
        if value is None:
            return absent
        several = value if isinstance(value, list) else [value]
        return minimum <= len(several) <= maximum and all(
            isinstance(part, np.ndarray) and part.shape == shape and np.isfinite(part).all() for part in several
        )

    return fits


def _in_order(value: Any) -> bool:
    """Held messages by topic, each in the order of their stamps."""
    return _fits(dict[Text, Annotated[list[Held], Field(max_length=MAX)]], value) and all(
        list(held) == sorted(held) and all(abs(message.stamp) <= MAX_WHOLE for message in held)
        for held in value.values()
    )


def _odometry(value: Any) -> bool:
    """Decoded odometry, or several, or none."""
    several = value if isinstance(value, list) else [] if value is None else [value]
    return len(several) <= 8 and all(_fits(Odometry, part) and _finite(part) for part in several)


def _finite(value: Any) -> bool:
    if isinstance(value, (list, tuple)):
        return all(_finite(part) for part in value)
    return not isinstance(value, (int, float)) or abs(value) <= MAX_WHOLE


def _named(*names: str) -> Callable[[Any], bool]:
    """One of these texts, or none: what is looked up in a table of texts."""
    return lambda value: isinstance(value, str) and (not value or value in names)


def _by_topic(inner: Callable[[Any], bool], both: bool = False) -> Callable[[Any], bool]:
    """A value for each topic of motion, or for some."""

    def fits(value: Any) -> bool:
        topics = {IMU, ODOMETRY}
        whole = isinstance(value, dict) and (value.keys() == topics if both else value.keys() <= topics)
        return whole and all(inner(part) for part in value.values())

    return fits


def _seconds(value: Any) -> bool:
    """By the cause of a refusal."""
    return _fits(dict[Text, Annotated[Real, Field(ge=0.0)]], value) and value.keys() <= CAUSES.keys()


Hint = Any  # a type, or a function that says whether a value fits


def _of(*rows: tuple[Hint, str]) -> dict[str, Hint]:
    """Hint by attribute, of rows of a hint and the attributes that have it."""
    return {name: hint for hint, names in rows for name in names.split()}


OF_INGEST = _of(
    (SAME, "_mounting"),
    (lambda value: _fits(dict[Text, Count], value) and set(CAUSES) <= set(value), "counts"),
    (deque[Text], "notices"),
    (set[Text], "_said"),
    (tuple[Whole, Real, Real, Real] | None, "first_pose"),
    (tuple[Real, Real], "origin _track_velocity"),
    (Whole | None, "_began"),
    (Real | None, "_yaw"),
    (tuple[Whole, Annotated[list[Real], Field(min_length=12, max_length=12)]] | None, "_last"),
    (Annotated[list[Real], Field(min_length=2, max_length=2)] | None, "_track"),
    (_odometry, "_before"),
    (lambda value: isinstance(value, list) and _odometry(value), "_waiting"),
)
REMEMBERED: dict[str, dict[str, Hint]] = {
    "Intake": _of((SAME, "wall vehicle"), (dict[Text, Count], "refused")),
    "DataClock": _of(
        (Whole | None, "offset last_stamp first"),
        (dict[Whole, Whole], "_buckets"),
        (list[tuple[Whole, Whole]], "_suspects"),
        (list[Whole], "_behind"),
    ),
    "HeaveFilter": _of((SAME, "gravity _tuning")),
    "MotionIngest": OF_INGEST,
    "VehicleIngest": OF_INGEST | {"kind": _named(*VEHICLES)},
    "HeaderWatch": _of((SAME, "_frames"), (dict[Text, tuple[bytes, ...]], "_seen")),
    "Watch": _of(
        (SAME, "jump"),
        (_by_topic(_named(*DOUBTS), both=True), "causes"),
        (dict[Text, tuple[Whole, Real]], "_last"),
        (Three | None, "_place"),
        (list[tuple[Real, Real, Real, Real, Real]], "_poses"),
    ),
    "CrossCheck": _of((SAME, "gravity arm"), (tuple[Whole, Three, Real] | None, "_imu")),
    "Refusals": _of(
        (_by_topic(_seconds, both=True), "_seconds"),
        (_by_topic(lambda value: _fits(Whole, value)), "_newest"),
        (_by_topic(_named(*CAUSES)), "_cause"),
    ),
    "Weighing": _of((SAME, "gravity"), (_named(*DOUBTS), "cause"), (tuple[Text, Real], "_held")),
    "Turning": _of(
        (SAME, "_world"), (Three | None, "_angles"), (Reals, "_before"), (list[Real], "_integral _misfit _mean _square")
    ),
    "Moving": _of(
        (SAME, "reference maximum"),
        (Reals, "_before"),
        (Three, "_first"),
        (list[Real], "_integral"),
        (Open, "_crest _trough _far"),
    ),
    "Comparison": _of(
        (SAME, "causes columns _own _squares _floor _drift"),
        (_named("absent", *DOUBTS), "cause"),
        (Open, "gain"),
        (Count, "_guess _count _end _in_block"),
        (list[Real], "_sum"),
        (list[tuple[Text, Count]], "_against"),
    ),
    "RateGuard": _of((SAME, "floor ramp"), (tuple[Three, Three] | None, "_before"), (Reals, "_kept"), (Three, "_off")),
    "HeightGuard": _of((SAME, "maximum"), (tuple[Real, Real] | None, "_before")),
    "Stream": _of((Whole | None, "stamp arrival used"), (Open, "period")),
    "RegularStamps": _of((SAME, "largest"), (Open, "period jitter"), (list[Whole], "_recent"), (Count, "_count")),
    "PositionRateFit": _of(
        (SAME, "pole _position _rate"),
        (_rows((6,), absent=True), "_x"),
        (_rows((6,), 0, 4), "_velocities"),
        (Annotated[list[Positive], Field(max_length=3)], "_steps"),
    ),
    "Slow": _of((SAME, "memory"), (Reals | None, "mean")),
    "CommandIngest": _of(
        (SAME, "wall columns"),
        (dict[Text, Count], "refused clamped"),
        (deque[tuple[Whole, Real]], "_lags"),
        (Command | None, "last"),
        (Whole | None, "last_arrival"),
        (Open, "lag"),
    ),
    "Lockstep": _of(
        (SAME, "period delay"),
        (Count, "steps steps_left"),
        (Whole | None, "_called"),
        (deque[Whole], "_stamps _flap_stamps"),
    ),
    "MotionGate": _of((SAME, "delay"), ({}, "cadence"), (_in_order, "_held _ahead")),
    "Cadence": _of(
        (SAME, "silent_after _given _shortest delay"),
        (Whole | None, "newest"),
        (Period | None, "period"),
        (Count, "slack in_row received_count _passed missed"),
        (deque[Period], "_gaps"),
        (tuple[Text, Count], "_suspect"),
    ),
}


@cache
def _adapter(hint: Hint) -> TypeAdapter:
    return TypeAdapter(hint)


def _fits(hint: Hint, value: Any) -> bool:
    try:
        _adapter(hint).validate_python(value, strict=True)
    except ValidationError:
        return False
    return True


def declared(kind: str, name: str) -> bool:
    """Has an attribute of a class a row?"""
    return name in REMEMBERED.get(kind, {})


def problem(kind: str, name: str, before: Any, value: Any) -> str:
    """ "" or why a value is none for an attribute that has another now, as a clause."""
    hint = REMEMBERED.get(kind, {}).get(name)
    if hint == {}:  # a table of objects, which are looked at one by one
        good = isinstance(value, dict) and value.keys() == before.keys()
    elif hint is SAME:
        good = _alike(before, value)
    elif hint is not None:
        good = hint(value) if isinstance(hint, FunctionType) else _fits(hint, value)
    else:
        good = _of_its_kind(before, value)
    return "" if good else f"{kind}.{name} = {value!r:.40} does not fit"


def _alike(before: Any, value: Any) -> bool:
    if isinstance(before, np.ndarray):
        return isinstance(value, np.ndarray) and before.shape == value.shape and before.tobytes() == value.tobytes()
    if isinstance(before, (list, tuple)):
        return (
            type(before) is type(value)
            and len(before) == len(value)
            and all(_alike(a, b) for a, b in zip(before, value))
        )
    return type(before) is type(value) and before == value


def _of_its_kind(before: Any, value: Any) -> bool:
    if isinstance(before, np.ndarray):
        if not isinstance(value, np.ndarray) or (value.shape, value.dtype) != (before.shape, before.dtype):
            return False
        names = value.dtype.names
        return all(np.isfinite(part).all() for part in ([value[name] for name in names] if names else [value]))
    if type(before) is float:
        return type(value) in (int, float) and abs(value) <= MAX_REAL
    if type(before) is int:
        return type(value) is int and abs(value) <= MAX_WHOLE
    if isinstance(before, str):
        return isinstance(value, str) and len(value) <= MAX_TEXT
    return before is None or type(before) is type(value)
