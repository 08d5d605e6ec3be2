"""A tick output as plain Python numbers, checked to be finite.

Reading a field of a numpy record costs 1 to 5 us and there are dozens; unpacking all of it at once costs 5 us.
"""

from __future__ import annotations

import struct
from math import isfinite
from types import SimpleNamespace

import numpy as np

from ...physics.tick_output import FIELDS, TICK_OUTPUT

_CODES = {"i8": "q", "f8": "d"}
_WORDS = struct.Struct("<" + "".join(_CODES[kind] * int(np.prod(shape)) for _, shape, kind, *_ in FIELDS))
if _WORDS.size != TICK_OUTPUT.itemsize:
    raise TypeError(
        f"TICK_OUTPUT has {TICK_OUTPUT.itemsize} bytes and its 8-byte fields {_WORDS.size}: "
        f"no channel could be written; declare every field i8 or f8"
    )


def _components(name: str, shape: tuple[int, ...]) -> list[str]:
    if not shape:
        return [name]
    axes = "xyzw" if shape[0] <= 4 else range(shape[0])
    return [f"{name}.{axis}" for axis, _ in zip(axes, range(shape[0]))]


# every number of a tick output in order: "tension", "body_position.x", ...
NAMES = tuple(part for name, shape, *_ in FIELDS for part in _components(name, shape))

PLACES = []  # field -> its place among the numbers: an index, or a slice for a vector
for _name, _shape, *_ in FIELDS:
    _first = NAMES.index(_components(_name, _shape)[0])
    PLACES.append((_name, slice(_first, _first + _shape[0]) if _shape else _first))


class FrameNumbers(SimpleNamespace):
    """Fields of a tick output as attributes: int, float, or tuple of floats; ``numbers``: all of them in order of
    NAMES."""


def numbers_of(frame: np.void) -> FrameNumbers:
    """Unpack one tick output (record of dtype TICK_OUTPUT).

    ValueError names the first field that is not finite: such a frame must not be published or recorded.
    """
    numbers = _WORDS.unpack(frame.tobytes())
    if not isfinite(sum(numbers)):  # one pass; only then look for the culprit, the sum alone may have overflowed
        for name, number in zip(NAMES, numbers):
            if not isfinite(number):
                raise ValueError(
                    f"frame field '{name}' is {number} at time {numbers[0]} ns: nothing of this tick is "
                    f"published; the tick must roll back and set NOT_FINITE instead"
                )
    result = FrameNumbers(**{name: numbers[place] for name, place in PLACES})
    result.numbers = numbers
    return result
