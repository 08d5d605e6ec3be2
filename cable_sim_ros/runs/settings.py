"""What a command line sets beside its scene and its bag: ``--set key=value``, ``--convention`` and ``--topic``.

The keys are those of the node's parameters: of the scene, and ``motion.`` and ``heave.`` for how messages are taken in.
"""

from __future__ import annotations

import difflib
import json
from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any

from pydantic import ValidationError

from ..io.messages.messages import KINDS
from ..io.scenes.load import override
from ..io.scenes.yaml12 import YamlError, parse
from ..io.sources.motion_table import MotionError
from ..io.sources.recorded_tow import RecordedTow, kept_in
from ..physics.heave_filter import Heave, MotionInput
from ..physics.parameter import Block, declared
from ..sim.scene import Scene

BLOCKS: dict[str, type[Block]] = {"motion": MotionInput, "heave": Heave}
CONVENTION = "motion.convention"
CONSEQUENCE = "nothing was simulated"
NOTHING: Mapping[str, Any] = MappingProxyType({})
Settings = Mapping[str, Any]  # dotted key -> value


def settings_of(pairs: Iterable[str], convention: str | None = None) -> dict[str, Any]:
    """Values by dotted key from texts ``key=value`` (YAML), with that of ``--convention``. Raises MotionError."""
    found: dict[str, Any] = {}
    for pair in pairs:
        key, sign, text = pair.partition("=")
        key = key.strip()
        if not sign or not key:
            raise MotionError(
                f"--set {pair}: is no key=value; {CONSEQUENCE}. Give for example --set water.density=1000"
            )
        try:
            value = parse(text)[0]
        except YamlError:
            raise MotionError(f"--set {pair:.80}: has no value; {CONSEQUENCE}. Give a number or a word") from None
        if key in found:
            raise MotionError(f"--set {key}: was given twice; {CONSEQUENCE}. Keep one of them")
        found[key] = value
    if convention is not None:
        if found.get(CONVENTION, convention) != convention:
            raise MotionError(
                f"--convention {convention} and --set {CONVENTION}={found[CONVENTION]} contradict each other; "
                f"{CONSEQUENCE}. Keep one of them"
            )
        found[CONVENTION] = convention
    return found


def topics_of(pairs: Iterable[str]) -> dict[str, str]:
    """Topics by kind (of messages.KINDS) from texts ``kind=name``. Raises MotionError."""
    found: dict[str, str] = {}
    for pair in pairs:
        kind, _, name = pair.partition("=")
        if kind not in KINDS or not name or kind in found:
            why = "was given twice" if kind in found else f"is none of {', '.join(f'{k}=/name' for k in KINDS)}"
            raise MotionError(f"--topic {pair}: {why}; {CONSEQUENCE}. Give for example --topic imu=/mru/imu")
        found[kind] = name
    return found


def of_intake(settings: Settings) -> dict[str, Any]:
    """Those of the settings that say how messages are taken in."""
    return {key: value for key, value in settings.items() if key.partition(".")[0] in BLOCKS}


def apply_to_scene(scene: Scene, settings: Settings) -> Scene:
    """The scene with those of the settings that are its own. Raises SceneError for a key that is neither's."""
    values = {key: value for key, value in settings.items() if key not in of_intake(settings)}
    return override(scene, values) if values else scene


def apply_to_bag(tow: RecordedTow, settings: Settings) -> None:
    """Note in what a bag says of itself how its messages are to be taken in; a recording of the run keeps it.

    Raises MotionError with key, value and bound.
    """
    given = of_intake(settings)
    if not given:
        return
    node = kept_in(tow.about, "node") or {}
    for key, value in given.items():
        name, _, rest = key.partition(".")
        block = BLOCKS[name]
        if rest not in block.model_fields:
            known = [f"{name}.{item.key}" for item in declared(block)]
            near = difflib.get_close_matches(key, known, 1)
            hint = f"Did you mean {near[0]}?" if near else f"Known: {', '.join(known)}"
            raise MotionError(f"--set {key}={value}: there is no such key; {CONSEQUENCE}. {hint}")
        try:
            checked = block.model_validate({rest: value})
        except ValidationError as error:
            raise MotionError(
                f"--set {key}={value}: {error.errors()[0]['msg']}; {CONSEQUENCE}. See cable-sim manual for its range"
            ) from None
        before = node.get(name)
        node[name] = {**(before if isinstance(before, dict) else {}), rest: checked.model_dump(mode="json")[rest]}
    tow.about["node"] = json.dumps(node)


def refuse_without_bag(settings: Settings, topics: Mapping[str, str], what: str) -> None:
    """Raise MotionError for what is said of messages where the motion is not from a bag; what: it is."""
    asked = [*of_intake(settings), *(f"--topic {kind}" for kind in topics)]
    if asked:
        raise MotionError(
            f"{', '.join(asked)}: says how messages of a bag are taken in, but the motion is {what}; {CONSEQUENCE}. "
            f"Leave it out"
        )


def recorded_intake(tow: RecordedTow) -> tuple[MotionInput, Heave]:
    """How the recording node took its motion in, where the bag says so; keys of other versions are left out."""
    try:
        node = json.loads(tow.about["node"])
        return (
            MotionInput.model_validate(_known(MotionInput, node.get("motion", {}))),
            Heave.model_validate(_known(Heave, node.get("heave", {}))),
        )
    except (KeyError, ValueError, TypeError, AttributeError):
        return MotionInput(), Heave()


def _known(block: type[Block], values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if key in block.model_fields}
