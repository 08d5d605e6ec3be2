"""What an ensemble varies: a YAML file, or the ranges of the layback's interval, and what each copy draws of them.

Copy k draws from a generator of its own, of (seed, k): it is the same whether 5 copies run or 500.

What is not known of a tow, declared once: half-widths of 95 % intervals, independent of each other.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Iterator, Mapping
from math import cos, radians, sin
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np

from ...errors import CableSimError
from ...io.scenes.document import Document, SceneError, SceneWarning
from ...io.scenes.load import scene_from_dict
from ...io.scenes.winch_plan import PlanError, WinchPlan
from ...physics.parameter import Block, choice, declared, quantity
from ...physics.towbody import BodyModel, Towbody
from ...physics.viv_amplification import StrumLaw
from ...physics.water import CurrentFrame, CurrentTable, Water
from ...runs.settings import apply_to_scene, of_intake
from ...sim.problem import Problem
from ...sim.scene import Scene
from ..sweeps.cases import within
from ..sweeps.sweep_file import Range, range_problems
from .limits import COPIES, LEAST_COPIES, MAX_COPIES, MAX_SEED, SEED, Ranges

LEAST_FACTOR, MOST_FACTOR = 0.1, 10.0  # on the drag, of a draw

SIGMAS = 1.959964  # half a 95 % interval of a normal distribution, in standard deviations
COMMANDS_AHEAD = 150  # that the ring of inputs has room for
B = TypeVar("B", bound=Block)
T = TypeVar("T", bound=Towbody)
OUTSIDE = ("drag", "speed", "east", "north", "turn_deg", "payout")  # of a Draw, that a twin may be given


class RangeError(CableSimError):
    """A range on the command line that cannot be."""


def ranges_of(words: Iterable[str], block: type[B]) -> tuple[B, list[str]]:
    """A Block of half-widths from words KEY=VALUE, and what it assumes, a line each. Raises RangeError."""
    rows, values = {row.key: row for row in declared(block)}, {}
    for word in words:
        key, _, text = word.partition("=")
        if key not in rows:
            raise RangeError(
                f"--range {word}: there is no range '{key}'; nothing was simulated. Known: {', '.join(rows)}"
            )
        try:
            values[key] = float(text)
            block(**{key: values[key]})
        except ValueError:  # also pydantic's
            row = rows[key]
            raise RangeError(
                f"--range {word}: '{text}' is no number in {row.interval} {row.unit} ({row.doc}); nothing was "
                f"simulated. Give the half-width of the 95 % interval"
            ) from None
    return (ranges := block(**values)), assumed(ranges, set(values))


def assumed(ranges: Block, chosen: set[str] | None = None) -> list[str]:
    """A line for each range with its size; chosen: those that a user chose are left out, of the others the option."""
    lines = []
    for row in declared(type(ranges)):
        if row.key not in (chosen or ()):
            unit = "" if row.unit == "1" else f" {row.unit}"
            how = "(95 %, normal)" if chosen is None else f"(95 %); --range {row.key}="
            lines.append(f"assumed: {row.doc} is within {getattr(ranges, row.key):g}{unit} {how}")
    return lines


def with_drag(scene: Scene, factor: float) -> Scene:
    """The scene with ``factor`` times the drag of its cable, as drag_amplification takes it, and of hull and wings of
    its bodies. Lift stays, and the drag that it induces. Unchecked: a number may come to lie beyond its bound."""
    if factor == 1.0:
        return scene
    sections = {
        name: section.model_copy(update={"drag_amplification": factor * section.drag_amplification})
        for name, section in scene.cable.sections.items()
    }
    new = {
        "cable": scene.cable.model_copy(update={"sections": sections}),
        "towbody": _dragged(scene.towbody, factor),
        "bodies": {name: _dragged(body, factor) for name, body in scene.bodies.items()},
    }
    return scene.model_copy(update=new)


def _dragged(body: T, factor: float) -> T:
    new: dict[str, Any] = {"drag_area": tuple(factor * area for area in body.drag_area)}
    if body.model is BodyModel.RIGID:
        new["crossflow_coefficient"] = factor * body.crossflow_coefficient
        new["wings"] = {
            name: wing.model_copy(update={"drag_coefficient": factor * wing.drag_coefficient})
            for name, wing in body.wings.items()
        }
    return body.model_copy(update=new)


class EnsembleError(SceneError):
    """An ensemble that cannot be made; every problem in one text each."""


class Ahead(Block):
    """The look-ahead."""

    seconds: float = quantity(60.0, "s", 0.0, 300.0, "how far ahead; 0: no look-ahead")
    every: float = quantity(30.0, "s", 1.0, 3600.0, "from one look-ahead to the next, at least")
    winch: str | None = choice(None, "winch plan from the start on, docs/winch.md#a-plan; none: the last command held")


class EnsemblePlan(Block):
    ensemble: str = choice("default", "name of the ensemble")
    copies: int = quantity(COPIES, "1", LEAST_COPIES, MAX_COPIES, "copies, beside the one with the scene's own numbers")
    seed: int = quantity(SEED, "1", 0, MAX_SEED, "of the draws: the same seed, the same copies")
    every: float = quantity(1.0, "s", 0.1, 10.0, "from one band to the next")
    half_widths: Ranges = choice(Ranges(), "of 95 %, normal, as of the layback's interval")
    ranges: dict[str, Range] = choice({}, "further ranges by key of the scene, as of a sweep")
    ahead: Ahead = choice(Ahead(), "look-ahead, beside a node")


def _problems(plan: EnsemblePlan) -> Iterator[Problem]:
    for key in of_intake(plan.ranges):
        yield Problem(f"ranges.{key}", "says how messages are taken in, and is not varied", "Leave it out")
    for key in [key for key in plan.ranges if key.startswith("solver.") or key in OF_THE_START]:
        text = "is the same in all copies: they have the ticks, the heading and the speed of the tow"
        yield Problem(f"ranges.{key}", text, "Leave it out; of speed half_widths.speed")
    yield from range_problems("ranges", plan.ranges)
    if not plan.ranges and not any(getattr(plan.half_widths, name) for name in Ranges.model_fields):
        yield Problem("half_widths", "are all 0 and there are no ranges: all copies are the same", "Give one")
    if plan.ahead.winch is not None:
        try:
            WinchPlan.of(plan.ahead.winch)
        except PlanError as error:
            yield Problem("ahead.winch", f"is no plan ({error})", "See docs/winch.md#a-plan")


PLANS = Document(EnsemblePlan, "an ensemble", "ensemble", "ensemble: mine", Path, list, _problems, error=EnsembleError)


def load_plan(path: str | os.PathLike | None, changed: Mapping[str, Any], scene: Scene | None = None) -> EnsemblePlan:
    """The ensemble of a YAML file, None: the default; changed: values in place of its own, by key at its top.

    Raises EnsembleError with every problem, also where a key is none of the scene's or it refuses an end of a range.
    """
    plan = PLANS.load(path) if path is not None else EnsemblePlan()
    origin = "the ensemble" if path is None else os.fspath(path)
    given = {key: value for key, value in changed.items() if value is not None}
    if given:
        plan = PLANS.check({**plan.model_dump(mode="json"), **given}, origin)
    if scene is not None:
        fits(plan, scene, origin)
    return plan


OF_THE_START = ("ship.heading_deg", "ship.tow_speed", "ship.start_blend")
MIDDLE = 0.3819660112501051  # of a range: a value of no round number
MOST_TICKS = 500  # from one band to the next


def fits(plan: EnsemblePlan, scene: Scene, origin: str) -> None:
    """Does the scene have the keys and take both ends of each range? Raises EnsembleError."""
    problems = []
    longest = COMMANDS_AHEAD * scene.winch.command_timeout
    if plan.ahead.seconds > longest:
        problems.append(
            f"{origin}: ahead.seconds = {plan.ahead.seconds:g} s is beyond {longest:.4g} s, {COMMANDS_AHEAD} times "
            f"winch.command_timeout = {scene.winch.command_timeout:g} s: a rate ahead takes more commands than are "
            "kept; nothing was started. Look less far ahead, or raise winch.command_timeout"
        )
    if plan.every / scene.solver.tick > MOST_TICKS:
        problems.append(
            f"{origin}: every = {plan.every:g} s is {plan.every / scene.solver.tick:.4g} ticks of solver.tick = "
            f"{scene.solver.tick:g} s, more than {MOST_TICKS} of which inputs are kept; nothing was started. Give "
            f"every of at most {MOST_TICKS * scene.solver.tick:g} s"
        )
    if scene.viv.law is not StrumLaw.OFF and plan.half_widths.drag:
        problems.append(
            f"{origin}: half_widths.drag = {plan.half_widths.drag:g} multiplies the drag amplification, which viv.law "
            f"= {scene.viv.law.value} computes; nothing was started. Give a file with half_widths: {{drag: 0}}, and "
            "ranges of cable.sections.<name>.drag_coefficient"
        )
    if scene.towbody.model is BodyModel.VEHICLE:
        problems.append(
            f"{origin}: towbody.model = vehicle is driven by poses, which the copies do not hear; nothing was started. "
            "Take a scene whose cable carries a body"
        )
    for key, one in plan.ranges.items():
        for value in (one.low, one.high, one.low + MIDDLE * (one.high - one.low)):
            try:
                apply_to_scene(scene, {key: value})
            except SceneError as error:
                problems += [f"{origin}: ranges.{key}: {text}" for text in error.problems]
                break
    if problems:
        raise EnsembleError(problems)


def doubts_when_joined(scene: Scene, plan: EnsemblePlan) -> list[str]:
    """Why the copies of a tow that is joined under way cannot be taken as they are."""
    water, found = scene.water, []
    there = {
        "waves": water.waves.height > 0.0,
        "turbulence": any(water.turbulence.deviation),
        "variation of the current": water.current_variation.time is not None,
    }
    if names := [name for name, yes in there.items() if yes]:
        found.append(
            f"joined under way: the copies count {' and '.join(names)} of the water from there, the tow from its "
            "start: they are in other water than the tow. Follow it from its start"
        )
    if "winch.scope" in plan.ranges:
        found.append(
            "joined under way: the cable out is that of the tow, so that ranges.winch.scope varies nothing. Vary "
            "half_widths.payout"
        )
    return found


class Draw(NamedTuple):
    """What a copy has in place of the scene's numbers. drag: factor on the drag of cable and bodies; speed [m/s]:
    through the water, more than the motion says; east, north [m/s]: of a current that the scene does not have;
    turn_deg: of the scene's current; payout [m]: cable out, more than the counter says; values: by key of the scene."""

    drag: float = 1.0
    speed: float = 0.0
    east: float = 0.0
    north: float = 0.0
    turn_deg: float = 0.0
    payout: float = 0.0
    values: Mapping[str, float] = {}

    def __str__(self) -> str:
        named = {name: getattr(self, name) for name in OUTSIDE} | dict(self.values)
        return ", ".join(f"{name} = {value:.4g}" for name, value in named.items())


NOMINAL = Draw()


def draw_of(plan: EnsemblePlan, number: int) -> Draw:
    """Draw of copy ``number`` (0: the scene's own numbers): half-widths as normal, ranges as they are spread."""
    if number == 0:
        return NOMINAL
    chance = np.random.default_rng([plan.seed, number])
    w = plan.half_widths
    widths = np.array([w.drag, w.speed, w.current, w.current, w.current_turn_deg, w.payout])
    drag, speed, east, north, turn, payout = (widths / SIGMAS * chance.standard_normal(len(widths))).tolist()
    values = within(plan.ranges, chance.random((1, len(plan.ranges))))[0] if plan.ranges else {}
    return Draw(min(max(1.0 + drag, LEAST_FACTOR), MOST_FACTOR), speed, east, north, turn, payout, values)


def scene_of(scene: Scene, draw: Draw, heading: float, scope: float | None = None) -> Scene:
    """The scene of a copy, checked. heading: of the start [rad]; scope: cable out there [m], None: the scene's.

    A speed that the motion does not show is a current against the heading of the start. Raises SceneError.
    """
    scene = apply_to_scene(scene, draw.values) if draw.values else scene
    scene = with_drag(scene, draw.drag)
    east, north = draw.east - draw.speed * cos(heading), draw.north - draw.speed * sin(heading)
    if east or north or draw.turn_deg:
        scene = scene.model_copy(update={"water": _moved(scene.water, (east, north), draw.turn_deg, heading)})
    out = scene.winch.scope if scope is None else scope
    if out is not None and (scope is not None or draw.payout):
        winch = scene.winch.model_copy(update={"scope": max(out + draw.payout, 0.0), "cable_on_drum": None})
        scene = scene.model_copy(update={"winch": winch})
    if draw is NOMINAL and scope is None:
        return scene
    with warnings.catch_warnings(action="ignore", category=SceneWarning):  # the scene itself has been warned of
        return scene_from_dict(scene.model_dump(mode="json"), f"{scene.name}, a copy")


def _moved(water: Water, more: tuple[float, float], turn_deg: float, heading: float) -> Water:
    """The water with its current turned, and ``more`` of it [m/s, east and north]."""
    back = -heading if water.current_frame is CurrentFrame.HEADING else 0.0
    add = complex(*more) * complex(cos(back), sin(back))
    turn = complex(cos(radians(turn_deg)), sin(radians(turn_deg)))
    steady, slope = complex(*water.current) * turn, complex(*water.current_gradient) * turn
    table = water.current_table
    if table.depth is None:
        steady += add
    else:
        rows = [add + turn * row for row in _rows(table)]
        table = CurrentTable(
            depth=table.depth, east=tuple(row.real for row in rows), north=tuple(row.imag for row in rows)
        )
    new = {"current": (steady.real, steady.imag), "current_gradient": (slope.real, slope.imag), "current_table": table}
    return water.model_copy(update=new)


def _rows(table: CurrentTable) -> list[complex]:
    if table.speed is not None and table.towards_deg is not None:
        ways = [radians(way) for way in table.towards_deg]
        return [speed * complex(cos(way), sin(way)) for speed, way in zip(table.speed, ways, strict=True)]
    return [complex(*row) for row in zip(table.east or (), table.north or (), strict=True)]
