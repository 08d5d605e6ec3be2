"""ROS parameters of the node: every number of the scene, and what only the node needs.

Both are declared as Blocks (physics/parameter.py), so one walk gives names, descriptions, units, ranges and sources.
The values of a parameter file or `-p` stand above those of the scene file; the sum is checked as a Scene again.
"""

from __future__ import annotations

import difflib
import math
import warnings
from enum import Enum
from types import UnionType
from typing import Any, NamedTuple, Union, get_args, get_origin

from ..errors import CableSimError
from ..io.recordings.recording_place import name_problem, root_problem
from ..io.scenes.fault_plan import FaultError, load_faults, timed
from ..io.scenes.live_changes import CONSEQUENCE, SECOND, ChangeError, Timetable, fit, refuse_unacting, tick_of
from ..io.scenes.load import SceneError, SceneWarning, load_scene, override
from ..physics.parameter import Block
from ..sim.scene import Scene
from ..sim.tables.rigid_tables import flaps_of
from .blocks import NodeBlock
from .lockstep import rate_problem
from .parts import problem_of_parts

FOREIGN = ("use_sim_time", "start_type_description_service")  # declared by rclpy itself
# what stands for "none" in a parameter that may be none
NONE: dict[type, Any] = {float: math.nan, int: 0, str: "", list: [math.nan]}


class ParameterError(CableSimError, ValueError):
    """Parameters that cannot be used; the text names key, value, unit, bound and remedy."""


class Row(NamedTuple):
    """One parameter: dotted name, value as ROS holds it, and its declaration."""

    name: str
    value: Any
    kind: type  # float, int, bool, str or list (of floats)
    length: int  # of a list; 0: any
    choices: tuple[str, ...]
    nullable: bool  # NONE of its kind stands for "none"
    doc: str
    unit: str
    low: float | None
    high: float | None
    above: float | None
    source: str
    configure: bool

    @property
    def range_text(self) -> str:
        unit = f" {self.unit}" if self.unit not in ("", "1") else ""
        if self.choices:
            return "one of " + ", ".join(self.choices)
        low = self.above if self.above is not None else self.low
        word = "above" if self.above is not None else "from"
        bounds = [f"{word} {low:g}{unit}"] if low is not None else []
        bounds += [f"to {self.high:g}{unit}"] if self.high is not None else []
        return " ".join(bounds)


def rows(block: Block, prefix: str = "") -> list[Row]:
    """Every number of a Block and the Blocks in it, in order, under dotted names."""
    found: list[Row] = []
    for key, field in type(block).model_fields.items():
        value, name = getattr(block, key), prefix + key
        if isinstance(value, Block):
            found += rows(value, name + ".")
        elif isinstance(value, dict):
            for inner, item in value.items():
                found += rows(item, f"{name}.{inner}.")
        else:
            found.append(_row(name, value, field))
    return found


def _row(name: str, value: Any, field) -> Row:
    kind, length, choices, nullable = _kind(field.annotation)
    extra = field.json_schema_extra or {}
    if value is None:
        value = NONE[kind]
    elif isinstance(value, Enum):
        value = value.value
    elif isinstance(value, tuple):
        value = [float(part) for part in value]
    return Row(
        name,
        value,
        kind,
        length,
        choices,
        nullable,
        field.description or "",
        extra.get("unit", ""),
        extra.get("low"),
        extra.get("high"),
        extra.get("above"),
        extra.get("source", ""),
        extra.get("configure", True),
    )


def _kind(annotation) -> tuple[type, int, tuple[str, ...], bool]:
    if get_origin(annotation) in (Union, UnionType):
        inner = [part for part in get_args(annotation) if part is not type(None)]
        kind, length, choices, _ = _kind(inner[0])
        return kind, length, choices, True
    if get_origin(annotation) is tuple:
        parts = get_args(annotation)
        return list, 0 if parts[-1] is Ellipsis else len(parts), (), False
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return str, 0, tuple(item.value for item in annotation), False
    if annotation in (float, int, bool, str):
        return annotation, 0, (), False
    raise TypeError(f"no ROS parameter type for {annotation!r}: use float, int, bool, str, an Enum or floats")


class Settings(NamedTuple):
    """Checked parameters: scene with every override, the node's own block, all rows to declare, cautions,
    and the faults of `faults_file` by their ticks."""

    scene: Scene
    node: NodeBlock
    rows: list[Row]
    warnings: list[str]
    faults: Timetable = Timetable()  # without a row it has nothing to remember


def foreign(name: str) -> bool:
    """Is this a parameter of rclpy itself?"""
    return name in FOREIGN or name.startswith("qos_overrides.")


def settle(overrides: dict[str, Any]) -> Settings:
    """Scene and node parameters from the overrides of a parameter file and `-p` (dotted name -> value).

    Raises ParameterError with every problem of the scene, or the first of the parameters.
    """
    given = overrides.get("scene", NodeBlock().scene)
    with warnings.catch_warnings(record=True, action="always", category=SceneWarning) as caught:
        try:
            scene = load_scene(str(given))
            node_rows = {row.name: row for row in rows(NodeBlock())}
            table = node_rows | {row.name: row for row in rows(scene)}
            node_tree: dict = {}
            scene_values: dict = {}
            for name, value in overrides.items():
                if foreign(name):
                    continue
                if name not in table:
                    raise ParameterError(_unknown(name, value, table))
                value = checked(table[name], value)
                if name in node_rows:
                    _plant(node_tree, name, value)
                else:
                    scene_values[name] = value
            if scene_values:
                caught.clear()  # those of the file alone
                scene = override(scene, scene_values)
        except SceneError as error:
            wrong = ParameterError(str(error))
            wrong.lines = error.lines
            raise wrong from None
    if scene.solver.tension_error is not None:
        raise ParameterError(
            f"parameter 'solver.tension_error' = {scene.solver.tension_error:g}: steps chosen by their error take no "
            f"fixed time, the node needs one step a tick; nothing was started. Leave it out, or use cable-sim run"
        )
    node = NodeBlock.model_validate(node_tree)
    recording = node.recording
    problem = (
        name_problem("recording.path", recording.path, "started")
        or name_problem("state_file", node.state_file, "started")
        or rate_problem(node.lockstep.rate, "started")
        or _flaps_problem(node.lockstep.flap_period, scene)
        or problem_of_parts(node, scene)
    )
    if recording.enabled and not problem:
        problem = root_problem(recording.root, round(recording.least_free * 1e6), "started")
    if problem:
        raise ParameterError(problem)
    return Settings(
        scene,
        node,
        rows(node) + rows(scene),
        [str(item.message) for item in caught if issubclass(item.category, SceneWarning)],
        _faults(node.faults_file, scene),
    )


def _flaps_problem(period: float | None, scene: Scene) -> str:
    """What is wrong with commands of flaps that are announced, or ""."""
    if period is None or flaps_of(scene):
        return ""
    return (
        f"parameter 'lockstep.flap_period' = {period:g} s: the scene has no flaps, and every step would wait for their "
        f"commands; nothing was started. Leave it out, or give a wing of the scene a flap_share"
    )


def _faults(path: str, scene: Scene) -> Timetable:
    """The scenario of a file by the ticks of the simulation, none without a file. Raises ParameterError."""
    try:
        changes = fit(scene, timed(load_faults(path))) if path else ()
        rows = [(tick_of(one, round(scene.solver.tick * SECOND)), one) for one in changes]
        refuse_unacting(scene, rows)
    except (FaultError, ChangeError) as error:
        raise ParameterError(
            f"parameter 'faults_file': {str(error).replace(CONSEQUENCE, 'nothing was started')}"
        ) from None
    return Timetable(rows, scene)


def _unknown(name: str, value: Any, table: dict) -> str:
    near = difflib.get_close_matches(name, table, 1, 0.6)
    return f"parameter '{name}' = {value!r}: there is no such parameter; nothing was started. " + (
        f"Did you mean '{near[0]}'?" if near else "Known are those of the scene and the node: ros2 param list"
    )


def _plant(tree: dict, name: str, value: Any) -> None:
    *groups, leaf = name.split(".")
    for group in groups:
        if not isinstance(tree.get(group), dict):
            tree[group] = {}
        tree = tree[group]
    tree[leaf] = value


def checked(row: Row, value: Any) -> Any:
    """Value of a ROS parameter as the scene wants it; ParameterError when the type is wrong."""
    unit = f" in {row.unit}" if row.unit not in ("", "1") else ""
    if row.kind is list:
        plain = isinstance(value, (list, tuple)) or hasattr(value, "tolist")
        numbers: list[Any] = list(value) if plain else [None]
        whole = row.length in (0, len(numbers)) and all(isinstance(part, float) for part in numbers)
        if not whole:
            count = f"{row.length} " if row.length else ""
            raise ParameterError(
                f"parameter '{row.name}' must be {count}floating-point numbers{unit}, "
                f"got {value!r}; nothing was started; write each with a decimal point, as in {row.value!r}"
            )
        if row.nullable and len(numbers) == 1 and math.isnan(numbers[0]):
            return None
        _check_bounds(row, numbers)
        return numbers
    if row.kind is float and type(value) is int:
        _check_bounds(row, [value])  # no value is suggested that would be refused
        raise ParameterError(
            f"parameter '{row.name}' must be a floating-point number{unit}, got the integer {value}; "
            f"nothing was started; write {float(value)!r}"
        )
    if type(value) is not row.kind:
        word = {float: "a floating-point number", int: "an integer", bool: "true or false", str: "text"}[row.kind]
        raise ParameterError(
            f"parameter '{row.name}' must be {word}{unit}, got {value!r}; nothing was started"
            + (f". Give a value {row.range_text}" if row.range_text else "")
        )
    if row.nullable and (value == NONE[row.kind] or value != value):
        return None
    if row.choices and value not in row.choices:
        raise ParameterError(
            f"parameter '{row.name}' = '{value}' is not known ({row.doc}); nothing was started. Give {row.range_text}"
        )
    if row.kind in (float, int):
        _check_bounds(row, [value])
    return value


def _check_bounds(row: Row, numbers: list) -> None:
    for number in numbers:
        if (
            not math.isfinite(number)
            or (row.low is not None and number < row.low)
            or (row.high is not None and number > row.high)
            or (row.above is not None and number <= row.above)
        ):
            unit = f" {row.unit}" if row.unit not in ("", "1") else ""
            raise ParameterError(
                f"parameter '{row.name}' = {number:g}{unit} is out of range ({row.doc}); nothing was "
                f"started. Give a value {row.range_text}"
            )
