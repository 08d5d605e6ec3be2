"""What a test gives, checked before anything happens: TowError with name, value, unit, bound, consequence, remedy."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from .errors import TowError

WORDS = {  # what shared texts call what is a keyword here
    "--heave AMPLITUDE,PERIOD in m and s": "heave=(amplitude, period) in m and s",
    "--duration": "duration",
    "--imu-only": "imu_only",
}


def number(name: str, value: Any, unit: str, consequence: str, remedy: str, *, least: float | None = None) -> float:
    """The value as a finite float, above 0 or, where it is given, from `least` on; else TowError."""
    try:
        got = math.nan if isinstance(value, (bool, str)) else float(value)
    except (TypeError, ValueError, OverflowError):
        got = math.nan
    if math.isfinite(got) and (got > 0.0 if least is None else got >= least):
        return got
    bound = "above 0" if least is None else "" if least == -math.inf else f"from {least:g}"
    wanted = " ".join(filter(None, ["finite number", bound, unit]))
    raise TowError(f"{name} = {value!r} is no {wanted}: {consequence}; {remedy}")


@contextmanager
def refused() -> Iterator[None]:
    """What the package says of a file, a bag or a value, as a TowError with the same text."""
    from ..io.bag_writer import BagError

    try:
        yield
    except TowError:
        raise
    except (BagError, ValueError) as error:  # MotionError, ResourceError, InputError are ValueErrors
        text = str(error)
        for word, here in WORDS.items():
            text = text.replace(word, here)
        raise TowError(text) from error
