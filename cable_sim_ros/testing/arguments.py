"""What a test gives, checked before anything happens: TowError with name, value, unit, bound, consequence, remedy."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import TowError
from ..io.messages.messages import KINDS
from ..physics.tick_output import Flag
from ..ros.services.policy import SPACE

COMMAND = KINDS["command"][1]
# motion of a test comes from reliable publishers: what a busy machine loses on the way is sent again
SENT_AGAIN = {
    f"qos_overrides.{SPACE}/{KINDS[kind][1]}.subscription.reliability": "reliable" for kind in ("imu", "odometry")
}
NOT_IN_TIME = ("missed", "late", "early", "unstamped")
WORDS = {  # what shared texts call what is a keyword here
    "--heave AMPLITUDE,PERIOD in m and s": "heave=(amplitude, period) in m and s",
    "--duration": "duration",
    "--imu-only": "imu_only",
}


def number(name: str, value: Any, unit: str, consequence: str, remedy: str, *, minimum: float | None = None) -> float:
    """The value as a finite float, above 0 or, where it is given, from `least` on; else TowError."""
    try:
        got = math.nan if isinstance(value, (bool, str)) else float(value)
    except (TypeError, ValueError, OverflowError):
        got = math.nan
    if math.isfinite(got) and (got > 0.0 if minimum is None else got >= minimum):
        return got
    bound = "above 0" if minimum is None else "" if minimum == -math.inf else f"from {minimum:g}"
    wanted = " ".join(filter(None, ["finite number", bound, unit]))
    raise TowError(f"{name} = {value!r} is no {wanted}: {consequence}; {remedy}")


@contextmanager
def refused() -> Iterator[None]:
    """What the package says of a file, a bag or a value, as a TowError with the same text."""
    from ..io.bags.bag_writer import BagError

    try:
        yield
    except TowError:
        raise
    except (BagError, ValueError) as error:  # MotionError, ResourceError, InputError are ValueErrors
        text = str(error)
        for word, here in WORDS.items():
            text = text.replace(word, here)
        raise TowError(text) from error


def agree(mode: str, scene: Any, parameters: Mapping[str, Any]) -> None:
    """TowError for a mode that there is not, or where a parameter says another mode or scene than the argument does."""
    if mode not in ("realtime", "lockstep"):
        raise TowError(f"mode = {mode!r} is not known: nothing was started; give 'realtime' or 'lockstep'")
    for name, value, ours in (("time_mode", mode, "mode"), ("scene", scene, "scene")):
        given = parameters.get(name, value)
        if given != value:
            raise TowError(
                f"parameters[{name!r}] = {given!r} and {ours} = {value!r} contradict each other: nothing was started; "
                f"give {ours} alone"
            )


def too_late(within: float, last: np.record) -> TowError:
    """That something was not so within so many s of simulation; last: the newest tick output."""
    return TowError(
        f"not within {within:g} s of simulation; at {last.time / 1e9:.2f} s: tension {last.tension:.0f} N, pay-out "
        f"{last.payout:.3f} m, rate {last.payout_rate:.3f} m/s, status {int(last.status)}"
    )


def with_motion(frames: np.recarray, end: int | None) -> np.recarray:
    """The tick outputs; TowError where some of them have no motion as it has run out, fed to the stamp ``end`` [ns]."""
    stale = frames["status"] & Flag.MOTION_STALE != 0
    if end is None or not stale[frames["time"] > end].any():
        return frames
    raise TowError(
        f"the motion that was fed ends at {end / 1e9:.2f} s, and {int(stale.sum())} of the {len(frames)} tick outputs "
        f"to {int(frames['time'][-1]) / 1e9:.2f} s are of a ship without motion; feed more, or give motion_may_end=True"
    )


def as_text(name: str, value: Any) -> str:
    """A parameter's value for the command line."""
    try:
        return json.dumps(value)
    except TypeError as error:
        raise TowError(
            f"parameter {name!r} = {value!r} is of a type that no parameter has: nothing was started; give a float, "
            f"int, bool, str or a list of floats"
        ) from error


def scene_text(scene: str | os.PathLike) -> str:
    """Name or absolute path of a scene."""
    try:
        path = Path(scene)
    except TypeError:
        raise TowError(
            f"scene = {scene!r} is neither a name nor a path: nothing was started; give 'full_scale' or a YAML file"
        ) from None
    return str(path.absolute()) if path.exists() else os.fspath(scene)


def process_of(command: Any, publishes: str | Sequence[str], within: float) -> list[str]:
    """Topics that a process will publish, as a list; TowError where it cannot be started or named so."""
    if isinstance(command, (str, bytes)) or not command:
        raise TowError(
            f"command = {command!r} is no list of a program and its arguments: nothing was started; give "
            f"[sys.executable, 'my_controller.py']"
        )
    number("within", within, "s", "nothing was started", "0 does not wait for commands", minimum=0.0)
    topics = [publishes] if isinstance(publishes, str) else list(publishes)
    if not topics or not all(isinstance(topic, str) and topic.strip("/") for topic in topics):
        raise TowError(
            f"publishes = {publishes!r} names no topic: nothing was started; give {COMMAND!r}, or what a node in "
            f"between publishes"
        )
    return topics


def unmet(values: Mapping[str, Any]) -> dict[str, int]:
    """From the task lockstep: inputs that did not come at their time, by what became of them, where there are any."""
    named = [key for key in values if key.endswith(NOT_IN_TIME) or key.startswith("refused: ")]
    return {key: count for key in named if (count := int(values[key]))}
