"""A sweep: a YAML file that names a scene and what of it is varied, checked like a scene."""

from __future__ import annotations

import difflib
import os
import re
import warnings
from collections.abc import Iterable, Iterator, Mapping
from enum import Enum
from math import isfinite, prod
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, ValidationError

from ...errors import CableSimError
from ...io.scenes.document import Document, ResourceError, SceneError, find_bag
from ...io.scenes.live_changes import ChangeError
from ...io.scenes.load import load_scene
from ...io.scenes.winch_plan import PlanError, WinchPlan
from ...io.sources.motion_table import heave_problem, read_table
from ...io.sources.recorded_tow import read_tow
from ...io.sources.sea_motion import response_of, sea_motion
from ...limits import LONGEST_RUN
from ...physics.heave_compensation import SetpointLaw
from ...physics.parameter import REQUIRED, Block, choice, quantity
from ...runs.message_run import MessageRun
from ...runs.settings import apply_to_scene, of_intake
from ...runs.sources import in_the_sea
from ...runs.step_choice import overwritten
from ...sim.problem import Problem
from ...sim.scene import Scene
from .figures import FIGURES, IN_EVERY_ROW, NO_NUMBERS

TRIED = 1.0  # s of motion in the waves
MAX_CASES = 1_000_000
MAX_VALUES = 100_000  # of one key
MAX_SEEDS = 10_000
NOTHING_DONE = "nothing was simulated"
SEEDS = ("water.waves.seed", "water.turbulence.seed", "instruments.seed")
SETPOINT = "setpoint.algorithm"


class SweepError(SceneError):
    """A sweep that cannot be made; every problem in one text each."""


class Method(str, Enum):
    """How samples are drawn from their ranges (scipy.stats.qmc)."""

    SOBOL = "sobol"  # scrambled; counts that are no power of 2 lose its balance
    LATIN_HYPERCUBE = "latin_hypercube"


class Spread(str, Enum):
    """How a range is filled."""

    UNIFORM = "uniform"
    LOG = "log"


class Range(Block):
    low: float = quantity(REQUIRED, "1", None, None, "least value, in the unit of the key")
    high: float = quantity(REQUIRED, "1", None, None, "largest value, in the unit of the key")
    spread: Spread = choice(Spread.UNIFORM, "uniform, or log: uniform in the logarithm")


class Samples(Block):
    method: Method = choice(Method.SOBOL, "how the samples are drawn")
    count: int = quantity(REQUIRED, "1", 1, 2**20, "number of samples")
    seed: int = quantity(1, "1", 0, 2**31 - 1, "of the samples: the same seed, the same samples")
    ranges: dict[str, Range] = choice(REQUIRED, "ranges by key of the scene")


class Steps(Block):
    first: float = quantity(REQUIRED, "1", None, None, "first value, in the unit of the key")
    last: float = quantity(REQUIRED, "1", None, None, "last value, in the unit of the key")
    count: int = quantity(REQUIRED, "1", 2, MAX_VALUES, "number of values, evenly apart")


def _values(given: Any) -> Any:
    """Values of a key of the grid: a list, or Steps. One text for what is neither."""
    if isinstance(given, list | Steps):
        return given
    shown = repr(given) if len(repr(given)) <= 60 else f"{given!r:.57}..."
    wanted = f"write a list such as [1, 2, 3], or {{first: 1, last: 3, count: 5}} with a count of 2 to {MAX_VALUES}"
    if not isinstance(given, Mapping):
        raise ValueError(f"= {shown} is no list of values: {wanted}")
    try:
        return Steps.model_validate(given)
    except ValidationError as error:
        words = {"missing": "is missing", "extra_forbidden": "is none of first, last, count"}
        found = [(one["loc"][0], words.get(one["type"], f"= {one['input']!r:.30} cannot be")) for one in error.errors()]
        why = ", ".join(f"{key} {what}" for key, what in found)
        raise ValueError(f"= {shown}: {why}: {wanted}") from None


Values = Annotated[Steps | list[Any], BeforeValidator(_values)]


class ShipMotion(Block):
    """One motion: exactly one of bag, heave, rao; none of them is the mean track."""

    bag: str | None = choice(None, "a bag, a CSV table, or the name of a shipped bag")
    heave: tuple[float, float] | None = quantity(None, "m, s", 0.0, 600.0, "sinusoidal heave: amplitude, period")
    rao: str | None = choice(None, "response amplitude operators, a CSV file or simple")

    @property
    def name(self) -> str:
        """A word for tables."""
        if self.heave is not None:
            return f"heave {self.heave[0]:g} m, {self.heave[1]:g} s"
        return self.bag or (f"rao {self.rao}" if self.rao else "none")


class SweepPlan(Block):
    sweep: str = choice(REQUIRED, "name of the sweep")
    scene: str = choice(REQUIRED, "name or file of the scene; a file beside the sweep")
    settings: dict[str, Any] = choice({}, "other values of the scene, for all cases, by key")
    duration: float | None = quantity(None, "s", None, LONGEST_RUN, "of each run; none: as cable-sim run", above=0.0)
    step: str = choice("chosen", "chosen or fixed, as --step of cable-sim run")
    grid: dict[str, Values] = choice({}, "values by key of the scene: all combinations")
    samples: Samples | None = choice(None, "samples of ranges, each with all of the grid")
    seeds: int = quantity(0, "1", 0, MAX_SEEDS, "seeds 1 to n of all that is random; 0: those of the scene")
    motions: list[ShipMotion] = choice([ShipMotion()], "motions of the ship")
    plans: list[str | None] = choice([None], "winch plans, docs/winch.md#a-plan; none: no plan")
    setpoints: list[SetpointLaw | None] = choice([None], "set-point laws; none: that of the scene")
    figures: list[str] = choice([], "figures that are kept, docs/json.md; []: all")


def _keys(plan: SweepPlan) -> list[str]:
    return [*plan.grid, *(plan.samples.ranges if plan.samples else ())]


def count_of(plan: SweepPlan) -> int:
    """Number of cases."""
    grid = prod(one.count if isinstance(one, Steps) else len(one) for one in plan.grid.values())
    samples = plan.samples.count if plan.samples else 1
    return grid * samples * max(plan.seeds, 1) * len(plan.motions) * len(plan.plans) * len(plan.setpoints)


def _problems(plan: SweepPlan) -> list[Problem]:
    found = [*_of_lists(plan), *_of_keys(plan), *_of_samples(plan), *_of_motions(plan), *_twice_in(plan)]
    for name in plan.figures:
        if name not in FIGURES:
            near = difflib.get_close_matches(name, [one for one in FIGURES if one not in NO_NUMBERS], 1)
            remedy = f"Did you mean {near[0]}? See docs/json.md" if near else "See docs/json.md"
            found.append(Problem("figures", f"names '{name}', which no run gives", remedy))
        elif name in NO_NUMBERS and name not in IN_EVERY_ROW:
            text = f"names '{name}', which is no single number: no row keeps it"
            found.append(Problem("figures", text, "Leave it out"))
    if not found and count_of(plan) > MAX_CASES:
        found.append(Problem("grid", f"makes {count_of(plan):.3g} cases, more than {MAX_CASES}", "Vary less at once"))
    return found


def _of_lists(plan: SweepPlan) -> Iterator[Problem]:
    if plan.step not in ("chosen", "fixed"):
        yield Problem("step", f"= {plan.step!r:.40} is neither chosen nor fixed", "Give one of the two")
    for name in ("motions", "plans", "setpoints"):
        if not getattr(plan, name):
            yield Problem(name, "is empty: there would be no case", "Leave it out, or give one")
    for key, one in plan.grid.items():
        if isinstance(one, list) and not 0 < len(one) <= MAX_VALUES:
            yield Problem(f"grid.{key}", f"has {len(one)} values", f"Give 1 to {MAX_VALUES}")
        elif isinstance(one, list):
            yield from _twice(f"grid.{key}", map(_plain, one), one)
            yield from _not_finite(f"grid.{key}", one)
        elif one.first == one.last:
            text = f"= {one.first:g} to {one.last:g} has the same value {one.count} times"
            yield Problem(f"grid.{key}", text, "Give another last value, or the list of that one value")


def _of_keys(plan: SweepPlan) -> Iterator[Problem]:
    """Keys that are given twice, whose values would not be those of the runs, or that are none of the scene."""
    keys = _keys(plan)
    every = [*keys, *plan.settings]
    for key in sorted({key for key in keys if keys.count(key) > 1 or key in plan.settings}):
        yield Problem(f"grid.{key}", "stands twice, in grid, samples or settings", "Keep one of them")
    for key in [key for key in SEEDS if plan.seeds and key in every]:
        yield Problem(key, "is set by seeds, and stands in grid, samples or settings", "Keep one of the two")
    if SETPOINT in keys and plan.setpoints != [None] or SETPOINT in plan.settings and None not in plan.setpoints:
        yield Problem(SETPOINT, "is set by setpoints, and stands in grid, samples or settings", "Keep one of the two")
    for key in every:
        for block in [block for block in every if key.startswith(f"{block}.")]:
            yield Problem(key, f"is a part of {block}, which is given as well", "Keep one of the two")
    for key in [key for key in keys if of_intake({key: 0})]:
        yield Problem(f"grid.{key}", "says how messages are taken in, and is not varied here", "Vary keys of the scene")


def _of_samples(plan: SweepPlan) -> Iterator[Problem]:
    ranges = {} if plan.samples is None else plan.samples.ranges
    if plan.samples is not None and not ranges:
        yield Problem("samples.ranges", "is empty: all samples would be the same", "Give one by its key")
    yield from range_problems("samples.ranges", ranges)


def range_problems(block: str, ranges: Mapping[str, Range]) -> Iterator[Problem]:
    """Ranges without extent, and those without a logarithm."""
    for key, limits in ranges.items():
        if not limits.low < limits.high:
            yield Problem(f"{block}.{key}", f"= {limits.low:g} to {limits.high:g} is no range", "Give low below high")
        elif limits.spread is Spread.LOG and limits.low <= 0.0:
            text = f"= {limits.low:g} to {limits.high:g} has no logarithm"
            yield Problem(f"{block}.{key}", text, "Give low above 0, or spread: uniform")


def _of_motions(plan: SweepPlan) -> Iterator[Problem]:
    for i, motion in enumerate(plan.motions):
        if sum(one is not None for one in (motion.bag, motion.heave, motion.rao)) > 1:
            yield Problem(f"motions.{i}", "names more than one motion", "Keep one of bag, heave, rao")
        if motion.heave is not None and (why := heave_problem(*motion.heave)):
            text = f"= [{motion.heave[0]:g}, {motion.heave[1]:g}]: {why}"
            yield Problem(f"motions.{i}.heave", text, "Write amplitude in m and period in s, for example heave: [1, 8]")


def _twice_in(plan: SweepPlan) -> Iterator[Problem]:
    """Plans that are none, and the same run twice."""
    read = []
    for i, words in enumerate(plan.plans):
        if words is None or not _in_words(words):  # a file is looked for beside the sweep, later
            read.append(str(place_of(words)))
            continue
        try:
            read.append(str(WinchPlan.of(words)))
        except PlanError as error:
            yield Problem(f"plans.{i}", f"is no plan ({error})", "See docs/winch.md#a-plan")
            read.append(f"{i}")
    places = [(place_of(one.bag), one.heave, place_of(one.rao)) for one in plan.motions]
    yield from _twice("motions", places, [one.name for one in plan.motions])
    yield from _twice("plans", read, [words or "none" for words in plan.plans])
    yield from _twice("setpoints", plan.setpoints, [law.value if law else "null" for law in plan.setpoints])
    yield from _twice("figures", plan.figures, plan.figures)


def _not_finite(key: str, values: list[Any]) -> list[Problem]:
    """A problem where a value, or a part of one, is no finite number."""
    for value in values:
        parts = value if isinstance(value, list) else [value]
        if any(isinstance(part, float) and not isfinite(part) for part in parts):
            return [Problem(key, f"has {value!r:.60}, which is no finite number", "Give numbers")]
    return []


def _in_words(plan: str) -> bool:
    """Is a plan its text, which begins with a time and an order, and not a file?"""
    return not plan.strip() or re.match(r"\s*[-+.\d]\S*\s+\S", plan) is not None


def _plain(value: Any) -> Any:
    """A value as it is compared: 50 and 50.0 are the same run, 1 and true are not."""
    if isinstance(value, list | tuple):
        return repr([_plain(part) for part in value])
    return repr(float(value)) if isinstance(value, int | float) and not isinstance(value, bool) else repr(value)


def _twice(key: str, compared: Iterable[Any], shown: list[Any]) -> list[Problem]:
    """A problem where two of a list are the same; compared: what makes them so, shown: as they are written."""
    first: dict[Any, Any] = {}
    for one, words in zip(compared, shown, strict=True):
        if one in first:
            same = f"{words!s:.60}" if str(words) == str(first[one]) else f"{first[one]!s:.60} and {words!s:.60}"
            text = f"has a value twice ({same}): the same run would count as two that are independent"
            return [Problem(key, text, "Keep one")]
        first[one] = words
    return []


PLANS = Document(SweepPlan, "a sweep", "sweep", "sweep: scope_and_speed", Path, list, _problems, error=SweepError)


def load_sweep(path: str | os.PathLike) -> SweepPlan:
    """The sweep of a YAML file; scene, bags, tables and plans are looked for beside it first. Raises SweepError with
    every problem of the file, and SceneError where a key of grid, samples or settings is none of the scene's."""
    plan = PLANS.load(path)
    folder = Path(path).parent
    motions = [
        one.model_copy(update={"bag": _beside(folder, one.bag), "rao": _beside(folder, one.rao)})
        for one in plan.motions
    ]
    plans = [words if words is None or _in_words(words) else _beside(folder, words, True) for words in plan.plans]
    plan = plan.model_copy(update={"scene": _beside(folder, plan.scene, True), "motions": motions, "plans": plans})
    return _fitting(plan, os.fspath(path))


def _beside(folder: Path, name: str | None, file: bool = False) -> str | None:
    """A file or bag beside the sweep; the name itself where there is none, to be looked for elsewhere; file: no
    folder."""
    there = bool(name) and ((folder / str(name)).is_file() or not file and (folder / str(name)).exists())
    return os.fspath(folder / str(name)) if there else name


def checked(data: Mapping[str, Any], origin: str) -> SweepPlan:
    """The sweep of plain data; origin names it in errors, which are those of `load_sweep`."""
    return _fitting(PLANS.check(data, origin), origin)


def _fitting(plan: SweepPlan, origin: str) -> SweepPlan:
    with in_the_sea(all(motion.rao is not None for motion in plan.motions)):
        return _checked(plan, origin)


def _checked(plan: SweepPlan, origin: str) -> SweepPlan:
    base = load_scene(plan.scene)
    firsts = {key: one.first if isinstance(one, Steps) else one[0] for key, one in plan.grid.items()}
    firsts |= {key: limits.low for key, limits in (plan.samples.ranges if plan.samples else {}).items()}
    problems = []
    scene = _first_that_is(base, plan, firsts)  # settings may need what the grid gives: the kind of waves their height
    if scene is None:
        try:
            scene = apply_to_scene(base, plan.settings)
        except SceneError as error:
            raise SweepError([f"{origin}: settings: {text}" for text in error.problems]) from None
        for key, value in firsts.items():
            problems += _refused(scene, key, value, origin)
    problems += [f"{origin}: {text}" for text in overwritten(scene, {**plan.settings, **firsts}, plan.step)]
    if plan.seeds and not seeds_of(scene):
        problems.append(
            f"{origin}: seeds = {plan.seeds}: nothing of {scene.name} is random, so all would be the same run; "
            f"{NOTHING_DONE}. Leave seeds out, or give the scene waves, turbulence or instruments"
        )
    own = scene.setpoint.algorithm
    if None in plan.setpoints and own in plan.setpoints and SETPOINT not in firsts:
        problems.append(
            f"{origin}: setpoints has a value twice (null and {own.value}, which the scene has): the same run would "
            f"count as two that are independent; {NOTHING_DONE}. Keep one"
        )
    problems += [f"{origin}: {text}" for text in _inputs(plan, scene, base)]
    if not problems:  # two names of one file, or a file and its words
        read = [None if words is None else str(WinchPlan.of(words)) for words in plan.plans]
        shown = [words if words is None or _in_words(words) else Path(words).name for words in plan.plans]
        twice = _twice("plans", read, shown)
        problems += [f"{origin}: {one.key} {one.text}; {NOTHING_DONE}. {one.remedy}" for one in twice]
    if problems:
        raise SweepError(problems)
    return plan


def _first_that_is(base: Scene, plan: SweepPlan, firsts: Mapping[str, Any]) -> Scene | None:
    """The scene with the first values of all keys, else with the last; None where neither is a scene."""
    for values in (firsts, _lasts(plan)):
        try:
            return apply_to_scene(base, {**plan.settings, **values})
        except CableSimError:
            continue
    return None


def _lasts(plan: SweepPlan) -> dict[str, Any]:
    """The last value of each key."""
    found = {key: one.last if isinstance(one, Steps) else one[-1] for key, one in plan.grid.items()}
    return found | {key: limits.high for key, limits in (plan.samples.ranges if plan.samples else {}).items()}


def _inputs(plan: SweepPlan, scene: Scene, base: Scene) -> list[str]:
    """What of motions and plans no case can take; scene: with the first values of all keys."""
    waves = any(one.startswith("water.waves.") for one in _keys(plan))
    found = []
    for i, motion in enumerate(plan.motions):
        for key, name in (("bag", motion.bag), ("rao", motion.rao)):
            if name and (why := motion_problem(scene, key, name, waves)):
                found.append(f"motions.{i}.{key} = {name}: {why}")
    for i, words in enumerate(plan.plans):
        if words and (why := plan_problem(scene, words)):
            try:
                other = apply_to_scene(base, {**plan.settings, **_lasts(plan)})
            except CableSimError:
                other = scene
            if plan_problem(other, words):  # else some cases can carry it out, and the others are rows that failed
                found.append(f"plans.{i} = '{words:.60}': {why}")
    return found


def seeds_of(scene: Scene) -> list[str]:
    """Keys of the seeds from which anything of a scene is drawn."""
    devices = [getattr(scene.instruments, name) for name in type(scene.instruments).model_fields]
    drawn = (
        scene.water.waves.height > 0.0,
        any(scene.water.turbulence.deviation),
        any(getattr(device, "on", False) for device in devices),
    )
    return [key for key, there in zip(SEEDS, drawn, strict=True) if there]


def _refused(scene: Scene, key: str, value: Any, path: str) -> list[str]:
    """Why a key is none of the scene's; a value that a scene refuses is a case that fails, with its reason."""
    try:
        apply_to_scene(scene, {key: value})
    except SceneError as error:
        return [f"{path}: {text}" for text in error.problems if "there is no such key" in text]
    except CableSimError as error:
        return [f"{path}: {error}"]
    return []


def motion_problem(scene: Scene, kind: str, name: str, waves_vary: bool) -> str:
    """Why a bag, a table or response amplitude operators give no motion; kind: bag or rao, waves_vary: the waves of
    the scene are not those of every case. "" where they do."""
    try:
        with warnings.catch_warnings(action="ignore"):  # a row says what is odd
            if kind == "rao":
                response_of(name, scene)
                if not waves_vary:
                    sea_motion(name, scene, TRIED)
            elif name.lower().endswith(".csv"):
                read_table(name, scene.ship, scene.sheave.position)
            else:
                tow = read_tow(find_bag(name))
                if not any(event.is_motion for event in tow.events):
                    return "holds no motion of a ship; nothing was simulated. Give a bag with odometry or IMU"
    except (CableSimError, OSError) as error:
        return str(error).replace("--rao simple: ", "").replace("--rao simple", "rao: simple")  # as a sweep has it
    return ""


def plan_problem(scene: Scene, words: str) -> str:
    """Why the winch of a scene cannot carry out a plan, "" where it can."""
    try:
        MessageRun(scene, None, winch=WinchPlan.of(words))
    except (PlanError, ChangeError) as error:
        return str(error)
    except CableSimError:  # the scene itself: a row that fails
        return ""
    return ""


def place_of(name: str | None) -> str | None:
    """A file or bag by where it lies, so that two names of it are the same; other words as they are."""
    if name is None:
        return None
    try:
        return os.fspath(find_bag(name).resolve())
    except ResourceError:
        return os.fspath(Path(name).resolve()) if Path(name).exists() else name
