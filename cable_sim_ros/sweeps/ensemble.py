"""An ensemble: copies of a tow whose uncertain numbers differ, driven by the same inputs, and the band that they give.

The copies share the inputs and nothing else. The band of a figure is from the 2.5 to the 97.5 percentile of the copies:
it holds a tow whose true numbers are drawn from the same ranges 95 times in 100, as far as the copies are enough (with
n of them the ends are known to about 1 / n) and the ranges are true. What all copies share, the model, is not in it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from scipy.stats import qmc

from ..errors import CableSimError, RunError
from ..physics.inputs import Inputs
from ..runs.settings import apply_to_scene
from ..sim.inputs import ShipMotion, WinchCommand
from ..sim.scene import Scene
from ..sim.simulator import Simulator, SolverError
from .cases import RNG, within
from .sweep_file import Range

LEVEL = 0.95
LEAST_MEMBERS, MAX_MEMBERS = 20, 1000  # fewer do not know the ends of a 95 % band
LEAST_KEPT = 0.9  # of the members: a band of fewer is no band of the ranges
FIGURES = {  # name -> field of the tick output, component, factor
    "tension": ("tension", -1, 1.0),
    "tension_drum": ("tension_drum", -1, 1.0),
    "body_x": ("body_position", 0, 1.0),
    "body_y": ("body_position", 1, 1.0),
    "body_depth": ("body_position", 2, -1.0),
    "layback": ("layback", -1, 1.0),
}


class EnsembleError(CableSimError, ValueError):
    """An ensemble that cannot be made."""


class EnsembleEnded(RunError):
    """Too many copies were lost for a band."""


class Band(NamedTuple):
    """time int64 [n] ns; of each figure of FIGURES [n]: low and high end of the band, and median; members: copies in
    it."""

    time: np.ndarray
    low: dict[str, np.ndarray]
    median: dict[str, np.ndarray]
    high: dict[str, np.ndarray]
    members: int


class Lost(NamedTuple):
    """A copy that was given up: its number, its values, why."""

    number: int
    values: Mapping[str, float]
    why: str


class Ensemble:
    """Copies of a scene with numbers drawn from ranges (Latin hypercube, seeded); the first is the scene itself."""

    def __init__(
        self, scene: Scene, ranges: Mapping[str, Range], members: int = 50, *, seed: int = 1, threads: int = 1
    ) -> None:
        """ranges: by key of the scene; threads: that advance copies side by side. Raises EnsembleError, and SceneError
        for a key or value that the scene refuses."""
        if not ranges:
            raise EnsembleError(f"{scene.name}: no range is given, all copies would be the same; nothing was started")
        if not LEAST_MEMBERS <= members <= MAX_MEMBERS:
            raise EnsembleError(
                f"{scene.name}: members = {members} is outside [{LEAST_MEMBERS}, {MAX_MEMBERS}]; nothing was started. "
                "Fewer copies do not know the ends of a 95 % band"
            )
        sampler = qmc.LatinHypercube(len(ranges), **{RNG: np.random.default_rng(seed)})
        self.values: list[Mapping[str, float]] = [{}, *within(ranges, sampler.random(members))]
        self.scenes = [apply_to_scene(scene, values) for values in self.values]
        self.lost: list[Lost] = []
        self.threads = threads
        self.inputs: Inputs | None = None
        self._sims: dict[int, Simulator] = {}

    def start(self, time_ns: int = 0, position: tuple[float, float] = (0.0, 0.0), heading: float | None = None) -> None:
        """Static start of every copy. Raises EnsembleEnded where too many do not settle."""
        self._sims, self.lost = {}, []
        for number, scene in enumerate(self.scenes):
            sim = Simulator(scene)
            if self.inputs is None or number == 0:
                self.inputs = sim.inputs
            try:
                sim.start(time_ns, position, heading)
            except RunError as error:
                self._lose(number, error)
                continue
            sim.inputs = self.inputs
            self._sims[number] = sim
        self._enough()

    @property
    def nominal(self) -> Simulator:
        """The copy with the scene's own numbers."""
        if 0 not in self._sims:
            raise EnsembleEnded("the tow itself was given up: " + next(x.why for x in self.lost if x.number == 0))
        return self._sims[0]

    def push(self, item: ShipMotion | WinchCommand) -> None:
        """Give a sample of ship motion or a winch command to all copies. Raises InputError."""
        self.nominal.push(item)

    def run(self, count: int, every: int = 1) -> Band:
        """Advance all copies by ``count`` ticks; the band at each ``every``-th of them.

        Raises EnsembleEnded where the solver gives up in too many.
        """

        def one(number: int) -> tuple[int, np.ndarray | None]:
            try:
                return number, self._sims[number].run(count)[every - 1 :: every]
            except SolverError as error:
                self._lose(number, error)
                return number, None

        with ThreadPoolExecutor(self.threads) as pool:
            frames = {number: rows for number, rows in pool.map(one, list(self._sims)) if rows is not None}
        for number in self._sims.keys() - frames.keys():
            del self._sims[number]
        self._enough()
        return band_of([frames[number] for number in sorted(frames)])

    def ahead(self, count: int, commands: Sequence[WinchCommand] = (), every: int = 1) -> Band:
        """The band of the next ``count`` ticks under commands that are not given yet; the copies stay where they are.

        The ship goes on as its motion does where no sample comes: see docs/motion.md on motion that ends.
        """
        assert self.inputs is not None
        kept = {number: sim.snapshot() for number, sim in self._sims.items()}
        rings = [ring.copy() for ring in self.inputs]
        sims, lost = dict(self._sims), list(self.lost)
        try:
            for command in commands:
                self.push(command)
            return self.run(count, every)
        finally:
            for ring, before in zip(self.inputs, rings):
                ring[...] = before
            self._sims, self.lost = sims, lost
            for number, sim in sims.items():
                sim.restore(kept[number])

    def _lose(self, number: int, error: Exception) -> None:
        self.lost.append(Lost(number, self.values[number], str(error)))

    def _enough(self) -> None:
        if len(self._sims) < LEAST_KEPT * len(self.scenes):
            raise EnsembleEnded(
                f"{len(self.lost)} of {len(self.scenes)} copies were given up, the first: {self.lost[0].why}; no "
                "band is told. Narrow the ranges"
            )


def band_of(frames: Sequence[np.ndarray]) -> Band:
    """Band of the tick outputs of copies, each [n]."""
    low, median, high = {}, {}, {}
    for name, (field, component, factor) in FIGURES.items():
        values = np.array([factor * (rows[field] if component < 0 else rows[field][:, component]) for rows in frames])
        low[name], median[name], high[name] = np.quantile(values, (0.5 - 0.5 * LEVEL, 0.5, 0.5 + 0.5 * LEVEL), axis=0)
    return Band(frames[0]["time"].astype(np.int64), low, median, high, len(frames))
