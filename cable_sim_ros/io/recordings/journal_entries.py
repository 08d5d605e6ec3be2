"""Entries of a journal as they are read: the bag may be anybody's, so each is checked before anything is made of it.

What an entry may be is declared here once; the writer is `Journal` of journal.py. Bounds are those of what a session
can have pushed (sim/inputs.py), and of the work that a replay may be made to do.
"""

from __future__ import annotations

import base64
import re
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from ...physics.inputs import COMMAND_ROWS, FLAP_ROWS, MAX_WINGS, MOTION_ROWS, make_inputs
from ...sim.saved.npz_bytes import Unfit, parts
from ...sim.saved.savefile import ARRAYS, exact
from ...sim.saved.state_values import MAX_COUNT, MAX_TIME, rings_problem
from ..bags.typestore import STORE

MSGTYPE = "std_msgs/msg/String"
MAX_ENTRY = 64_000_000  # bytes of one entry
MAX_STATE, MAX_STATES = 64_000_000, 1_000_000_000  # bytes of a state, and of all of them, unpacked
MAX_NUMBER = 1e9  # of any number of a sample, m and m/s and rad of a start and a command
# rings that an older recording has not
LATER = {f"inputs_{name}{part}" for name in ("vehicle", "flap") for part in ("", "_time", "_head", "_seen")}
NUMBER = re.compile(r'"n" *: *(\d{1,16})')  # of an entry that cannot be read as a whole
CAUSES = Literal["start", "reset", "jump", "behind", "recording", "restore"]

Number = Annotated[float, Field(ge=-MAX_NUMBER, le=MAX_NUMBER, allow_inf_nan=False)]
Time = Annotated[int, Field(ge=-MAX_TIME, le=MAX_TIME)]
Count = Annotated[int, Field(ge=0, le=MAX_COUNT)]
Commanded = Number | None
Name = Annotated[str, Field(max_length=100)]
Value = bool | Annotated[float, Field(allow_inf_nan=False)] | Name | None
N = Number
Sample = tuple[Time, N, N, N, N, N, N, N, N, N, N, N, N, N, N]  # stamp, and the columns of `physics.inputs`
Command = tuple[Time, Commanded, Commanded]
Flaps = tuple[Time, Annotated[list[Commanded], Field(min_length=MAX_WINGS, max_length=MAX_WINGS)]]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="ignore", strict=True)  # keys of later versions are left aside


class Begin(_Strict):
    """The simulation begins here."""

    cause: CAUSES
    time: Time
    position: tuple[Number, Number]
    heading: Number | None
    parameters: Annotated[dict[Name, Value], Field(max_length=1000)]
    layout: Name
    state: str


class Entry(_Strict):
    """One message of the journal; absent: None."""

    n: Count
    tick: Count
    start: Begin | None = None
    motion: Annotated[list[Sample], Field(max_length=MOTION_ROWS)] = []
    vehicle: Annotated[list[Sample], Field(max_length=MOTION_ROWS)] = []
    commands: Annotated[list[Command], Field(max_length=COMMAND_ROWS)] = []
    flaps: Annotated[list[Flaps], Field(max_length=FLAP_ROWS)] = []
    set: Annotated[dict[Name, Value], Field(max_length=1000)] = {}
    lost: Count = 0
    end: Name | None = None


class BadEntry(ValueError):
    """An entry that is left out; the text says which and why."""


def entry_of(data: bytes) -> Entry:
    """The entry of a message. Raises BadEntry."""
    if len(data) > MAX_ENTRY:
        raise BadEntry(f"an entry has {len(data)} bytes, at most {MAX_ENTRY} are read")
    try:
        message: Any = STORE.deserialize_cdr(data, MSGTYPE)
        text = str(message.data)
    except Exception as error:  # the reader of bytes fails in many ways
        raise BadEntry(f"an entry cannot be read ({type(error).__name__})") from None
    try:
        return Entry.model_validate_json(text)
    except ValidationError as error:
        number = NUMBER.search(text[:100])
        name = f"entry {number[1]}" if number else "an entry"
        raise BadEntry(f"{name} cannot be used ({_why(error)})") from None


def _why(error: ValidationError) -> str:
    first = error.errors(include_url=False, include_context=False)[0]
    return f"{'.'.join(map(str, first['loc'][:4]))}: {first['msg']:.100}, got {first.get('input')!r:.40}"


class State(NamedTuple):
    """The state in a `start` entry: its arrays as bytes for `savefile.fitting`, and its rings of inputs."""

    arrays: dict[str, bytes]
    rings: dict[str, np.ndarray]


def state_of(text: str) -> State:
    """Back from the text of a `start` entry; the rings have been looked at. Raises ValueError."""
    try:
        if len(text) > MAX_STATE:
            raise Unfit(f"it has {len(text)} bytes, at most {MAX_STATE} are read")
        arrays = parts(base64.b64decode(text, validate=True), ARRAYS, MAX_STATE, packed=True)
        known = {f"inputs_{name}": like for name, like in make_inputs()._asdict().items()}
        older = {name: known.pop(name) for name in list(known) if name in LATER and name not in arrays}
        rings = exact(arrays, known) | older
        if problem := rings_problem(rings):
            raise Unfit(problem)
        return State(arrays, rings)
    except ValueError as error:  # Unfit, and of base64
        raise ValueError(f"the state in the journal cannot be read ({error})") from None
