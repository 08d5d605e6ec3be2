"""The cases of a sweep: one run each, in an order of their own, each known by the hash of all that decides it."""

from __future__ import annotations

import hashlib
import itertools
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy
from scipy.stats import qmc

from ...files import read_bytes
from ...io.scenes.document import ResourceError, find_bag, find_scene
from ...io.scenes.winch_plan import WinchPlan
from ...version import __version__
from .sweep_file import Method, Range, Samples, ShipMotion, Spread, Steps, SweepPlan

RNG = "rng" if tuple(map(int, scipy.__version__.split(".")[:2])) >= (1, 15) else "seed"  # its name in qmc
CODE = Path(__file__).resolve().parents[2]
DECIDES = (
    "compiler",
    "physics",
    "sim",
    "io",
    "runs",
    "tools/sweeps/worker",
    "tools/sweeps/figures",
)  # what of the code decides a row


class Case(NamedTuple):
    """One run. number: its place in the order; varied: what tells it from the others, by key; settings: values of the
    scene by key; seed: of all that is random; winch: a plan in words; files: hashes of scene, bag and response
    operators as the case was made of them; key: of its row; ship: a plan in words."""

    number: int
    varied: dict[str, Any]
    scene: str
    settings: dict[str, Any]
    seed: int | None
    motion: ShipMotion
    winch: str | None
    setpoint: str | None
    duration: float | None
    step: str
    figures: tuple[str, ...]
    files: tuple[str, str, str]
    key: str
    ship: str | None = None


def cases_of(plan: SweepPlan, drawn: Sequence[dict[str, float]] | None = None) -> Iterator[Case]:
    """All cases, in the order: motions, winch plans, set-points, seeds, grid, samples last.

    drawn: samples in place of those that the plan draws.
    """
    grids = [[(key, value) for value in _values(one)] for key, one in plan.grid.items()]
    samples = drawn if drawn is not None else drawn_of(plan.samples) if plan.samples else [{}]
    seeds = [{}] if not plan.seeds else [{"seed": seed} for seed in range(1, plan.seeds + 1)]
    motions = [(motion, contents(plan.scene, motion)) for motion in plan.motions]  # each file is read once
    plans = [(winch, None if winch is None else str(WinchPlan.of(winch))) for winch in plan.plans]
    number = 0
    for (motion, files), (winch, words), setpoint, seed, grid in itertools.product(
        motions, plans, plan.setpoints, seeds, itertools.product(*grids)
    ):
        for sample in samples:
            values = {**dict(grid), **sample}
            varied = {**values, **seed}
            if len(plan.motions) > 1:
                varied["motion"] = motion.name
            if len(plan.plans) > 1:
                varied["plan"] = winch or "none"
            if len(plan.setpoints) > 1:
                varied["setpoint"] = setpoint.value if setpoint else "scene"
            settings = {**plan.settings, **values}
            law = None if setpoint is None else setpoint.value
            rest = (settings, seed.get("seed"), motion, words, law, plan.duration, plan.step, tuple(plan.figures))
            yield Case(number, varied, plan.scene, *rest, files, _key(files, *rest))
            number += 1


def case_of(
    number: int,
    scene: str,
    settings: dict[str, Any],
    winch: str,
    duration: float,
    figures: tuple[str, ...],
    ship: str | None = None,
) -> Case:
    """A case on the mean track, or a plan of the ship, by its own values, for tools that make no sweep of a file."""
    files = contents(scene, ShipMotion())
    rest = (settings, None, ShipMotion(), str(WinchPlan.of(winch)), None, duration, "chosen", figures)
    return Case(number, {}, scene, *rest, files, _key(files, *rest, *filter(None, [ship])), ship)


def _values(one: Steps | list[Any]) -> list[Any]:
    return np.linspace(one.first, one.last, one.count).tolist() if isinstance(one, Steps) else list(one)


def drawn_of(samples: Samples) -> list[dict[str, float]]:
    """Samples of ranges, a dict by key each."""
    made = qmc.Sobol if samples.method is Method.SOBOL else qmc.LatinHypercube
    unit = made(len(samples.ranges), **{RNG: np.random.default_rng(samples.seed)}).random(samples.count)
    return within(samples.ranges, unit)


def within(ranges: Mapping[str, Range], unit: np.ndarray) -> list[dict[str, float]]:
    """Points of ranges, of rows of the unit cube [n, ranges]."""
    rows = np.empty_like(unit)
    for k, one in enumerate(ranges.values()):
        if one.spread is Spread.LOG:
            rows[:, k] = one.low * (one.high / one.low) ** unit[:, k]
        else:
            rows[:, k] = one.low + (one.high - one.low) * unit[:, k]
    return [dict(zip(ranges, row)) for row in rows.tolist()]


def _key(files: Sequence[str], settings: dict, seed: int | None, motion: ShipMotion, *rest: Any) -> str:
    """Hash of what decides a row: contents of the files, values, version and physics; not where the files lie."""
    what = [files, settings, seed, motion.heave, *rest]
    text = json.dumps([*what, __version__, code_of()], sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:32]


@lru_cache(maxsize=1)
def code_of() -> str:
    """Hash of the program: a row of other code is another row."""
    found = hashlib.sha256()
    for file in sorted(path for path in CODE.rglob("*.py") if path.relative_to(CODE).as_posix().startswith(DECIDES)):
        found.update(file.relative_to(CODE).as_posix().encode() + file.read_bytes())
    return found.hexdigest()


def contents(scene: str, motion: ShipMotion) -> tuple[str, str, str]:
    """Hashes of the scene's file, of the motion's bag or table and of its response amplitude operators, as they are
    now."""
    return _content(scene, find_scene), _content(motion.bag, find_bag), _content(motion.rao, Path)


def _content(name: str | None, find: Callable[[str], Path]) -> str:
    """Hash of a file, of all files of a bag, or the word itself where it is neither."""
    if name is None:
        return ""
    try:
        path = find(name)
        files = sorted(p for p in path.rglob("*") if p.is_file()) if path.is_dir() else [path]
        stats = [(file, file.stat()) for file in files]
    except (ResourceError, OSError):
        return name
    return _hash(tuple((file, one.st_size, one.st_mtime_ns, one.st_ino) for file, one in stats))


@lru_cache(maxsize=1024)
def _hash(files: tuple[tuple[Path, int, int, int], ...]) -> str:
    """Hash of files; each with its size, time and number, by which a change is known without reading."""
    found = hashlib.sha256()
    for file, *_ in files:
        found.update(file.name.encode() + os.sep.encode() + hashlib.sha256(read_bytes(file)).digest())
    return found.hexdigest()
