"""Numbers of a scene that a calibration may change: key, start, range, prior; and a scene with other values of them.

A key is dotted, as of ``--set``; ``[i]`` is a component of a vector, ``[*]`` all of them; ``*`` stands for every
section or body. What a ``*`` stands for has one value together.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from functools import reduce
from operator import getitem
from typing import Any, NamedTuple

from ...errors import CableSimError
from ...io.scenes.load import check_key
from ...physics.parameter import Declared, declaration
from ...sim.scene import Scene
from ...sim.static_gradients import split

NARROW, WIDE = 0.5, 2.0  # times the value of the scene: the range where none is given
CONSEQUENCE = "nothing was simulated"
GEOMETRY = re.compile(r"cable\.sections\.[^.]+\.length|(sheave|winch)\.position(\[[01]\])?")  # wrong on a held mesh
EXAMPLE = "cable.sections.bare.drag_amplification=1:3~0.2"


class CalibrateError(CableSimError, ValueError):
    """Nothing can be calibrated: what, why, remedy."""


class Free(NamedTuple):
    """A free number: key, unit, value of the scene, range, prior mean and standard deviation (None: no prior)."""

    key: str
    unit: str
    start: float
    low: float
    high: float
    mean: float | None = None
    sd: float | None = None

    def at(self, unit: float) -> float:
        """The value at a place in its range, from 0 to 1."""
        return self.low + unit * (self.high - self.low)

    def place(self, value: float) -> float:
        """The place of a value in its range."""
        return (value - self.low) / (self.high - self.low)


def number_of(text: str, of: str, what: str) -> float:
    """A finite number; CalibrateError names the option."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise CalibrateError(f"{of}: {text!r} is no {what}; {CONSEQUENCE}. Give a number, as in --free {EXAMPLE}")
    return value


def free_of(texts: Sequence[str], scene: Scene) -> list[Free]:
    """Free numbers of texts ``key[=low:high][~[mean:]sd]``. Raises CalibrateError, SceneError for an unknown key."""
    if not texts:
        raise CalibrateError(f"no number is free; {CONSEQUENCE}. Give one, as in --free {EXAMPLE}")
    found = [_free(text, scene) for text in texts]
    places: dict[str, str] = {}
    for one in found:
        for key in keys_of(scene, one.key):
            if key in places:
                raise CalibrateError(f"--free {key}: is free twice, by {places[key]} too; {CONSEQUENCE}. Keep one")
            places[key] = one.key
    return found


def _free(text: str, scene: Scene) -> Free:
    of = f"--free {text:.100}"
    rest, _, prior = text.partition("~")
    key, sign, limits = (part.strip() for part in rest.partition("="))
    if GEOMETRY.fullmatch(key):
        raise CalibrateError(
            f"{of}: {key} moves the line on its mesh, which a fit holds, so that its effect would be wrong; "
            f"{CONSEQUENCE}. Give it by --set {key}=VALUE, a fit for each value, and compare what is left"
        )
    start = value_of(scene, key)
    known = declaration(Scene, key)
    unit = known.unit if known is not None else ""
    low, high = _range(of, limits if sign else "", start, known)
    unit = "" if unit == "1" else unit
    if not low <= start <= high:
        had = f"{start:g} {unit}".strip()
        raise CalibrateError(
            f"{of}: the scene has {key} = {had}, outside its range [{low:g}, {high:g}]; {CONSEQUENCE}. "
            f"Widen the range, or begin elsewhere with --set {key.partition('[')[0]}=VALUE"
        )
    mean = sd = None
    if "~" in text:
        first, colon, last = prior.partition(":")
        sd = number_of(last if colon else first, of, "standard deviation of a prior")
        mean = number_of(first, of, "mean of a prior") if colon else start
        if not sd > 0.0:
            raise CalibrateError(f"{of}: the prior's standard deviation is {sd:g}; {CONSEQUENCE}. Give one above 0")
        if not low <= mean <= high:
            raise CalibrateError(
                f"{of}: the prior's mean {mean:g} is outside [{low:g}, {high:g}]; {CONSEQUENCE}. Give one inside"
            )
    return Free(key, unit, start, low, high, mean, sd)


def _range(of: str, limits: str, start: float, known: Declared | None) -> tuple[float, float]:
    least = -math.inf if known is None or known.low is None else known.low
    above = known is not None and known.above is not None
    if above:
        assert known is not None and known.above is not None
        least = known.above
    most = math.inf if known is None or known.high is None else known.high
    if not limits:
        if start == 0.0:
            raise CalibrateError(
                f"{of}: the scene has 0, and no range follows from it; {CONSEQUENCE}. Give one: KEY=LOW:HIGH"
            )
        low, high = sorted((NARROW * start, WIDE * start))
        low, high = max(low, least), min(high, most)
        if low < high:
            return low, high
    first, colon, last = limits.partition(":")
    if not colon:
        raise CalibrateError(f"{of}: {limits!r} is no range; {CONSEQUENCE}. Give LOW:HIGH, as in --free {EXAMPLE}")
    low, high = number_of(first, of, "lower bound"), number_of(last, of, "upper bound")
    if not low < high:
        raise CalibrateError(f"{of}: {low:g} is not below {high:g}; {CONSEQUENCE}. Give LOW:HIGH")
    if low < least or (above and low <= least) or high > most:
        unit = known.unit if known is not None and known.unit != "1" else ""
        allowed = f"{known.interval if known is not None else ''} {unit}".strip()
        raise CalibrateError(
            f"{of}: the range leaves {allowed}, which the key allows; {CONSEQUENCE}. Give a range inside"
        )
    return low, high


def keys_of(scene: Scene, key: str) -> list[str]:
    """The keys that a key with ``*`` stands for. Raises SceneError where there is none."""
    if "*" not in key:
        return [key]
    if key.endswith("[*]"):
        plain = key.removesuffix("[*]")
        values = _get(scene, plain)
        if not isinstance(values, list):
            raise CalibrateError(f"--free {key}: {plain} has no components; {CONSEQUENCE}. Give {plain}")
        return [f"{plain}[{k}]" for k in range(len(values))]
    head, _, tail = key.partition(".*.")
    block: Any = scene.model_dump(mode="json")
    for part in head.split("."):
        block = block.get(part) if isinstance(block, dict) else None
    if not isinstance(block, dict) or not block or not tail or "*" in tail:
        check_key(scene, head, "--free")
        raise CalibrateError(f"--free {key}: * stands for no name here; {CONSEQUENCE}. Give the whole key")
    return [f"{head}.{name}.{tail}" for name in block]


def value_of(scene: Scene, key: str) -> float:
    """The number of a key. Raises SceneError for a key that is not there, CalibrateError for what is no number."""
    values = {one: _get(scene, one) for one in keys_of(scene, key)}
    if len(set(map(repr, values.values()))) > 1:
        had = ", ".join(f"{one} = {value}" for one, value in values.items())
        raise CalibrateError(f"--free {key}: has several values ({had}); {CONSEQUENCE}. Free each, or set them equal")
    value = next(iter(values.values()))
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        kind = "has no value in the scene" if value is None else f"= {value!r:.60} is no number"
        remedy = f"Give one to begin from: --set {key}=VALUE" if value is None else "Free a number"
        if isinstance(value, list):
            remedy = f"Free a component: {key}[0]"
        raise CalibrateError(f"--free {key}: {kind}; {CONSEQUENCE}. {remedy}")
    return float(value)


def _get(scene: Scene, key: str) -> Any:
    plain, place = split(key)
    check_key(scene, plain, "--free")
    data: Any = reduce(getitem, plain.split("."), scene.model_dump(mode="json"))
    if place is None:
        return data
    if not isinstance(data, list) or not 0 <= place < len(data):
        count = f"{len(data)} components" if isinstance(data, list) else "no components"
        raise CalibrateError(f"--free {key}: {plain} has {count}; {CONSEQUENCE}. Count from 0")
    return data[place]


def data_with(scene: Scene, values: Mapping[str, float]) -> dict[str, Any]:
    """Plain data of the scene with other values by key, not checked."""
    data = scene.model_dump(mode="json")
    for key, value in values.items():
        for one in keys_of(scene, key):
            plain, place = split(one)
            *way, last = plain.split(".")
            block: Any = reduce(getitem, way, data)
            if place is None:
                block[last] = value
            else:
                block[last][place] = value
    return data


def flat(scene: Scene, values: Mapping[str, float]) -> dict[str, Any]:
    """The same as values by keys that a file has: a vector whole, each section by its name."""
    data, out = data_with(scene, values), {}
    for key in values:
        for one in keys_of(scene, key):
            plain = split(one)[0]
            out[plain] = reduce(getitem, plain.split("."), data)
    return out
