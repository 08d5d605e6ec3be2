"""Copies of a tow whose uncertain numbers differ, driven by the same inputs, and the band that they give.

The copies share the inputs and nothing else. With n copies the ends of the band are the order statistics at 0.025 and
0.975 of (n + 1), so that a tow whose true numbers are drawn from the same ranges is inside 95 times in 100 on the mean
over ensembles; below 39 copies they are the least and the largest, which hold (n - 1) / (n + 1). Source: order
statistics of exchangeable draws. What all copies share, the model and the inputs, is not in it.

What the tick outputs of copies say against their figures: flags and overload, judged as those of a run.
"""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...errors import RunError
from ...io.scenes.document import SceneError
from ...physics.inputs import Inputs
from ...physics.tick_output import Flag
from ...sim.flag_rules import OK, RULES
from ...sim.inputs import ShipMotion, WinchCommand, push
from ...sim.scene import Scene
from ...sim.simulator import Simulator, SolverError
from ...sim.tables.attitude import angles_of
from ...sim.verdict import Reason, compensates, judge_counts, overload
from .plan import Draw, EnsemblePlan, draw_of, scene_of

LEVEL = 0.95
LEAST_KEPT = 0.9  # of the copies: a band of fewer is no band of the ranges
CHUNK = 100  # ticks that a copy runs at once
FIGURES = {  # name -> field of the tick output, component, factor, unit
    "tension": ("tension", -1, 1.0, "N"),
    "tension_drum": ("tension_drum", -1, 1.0, "N"),
    "body_x": ("body_position", 0, 1.0, "m"),
    "body_y": ("body_position", 1, 1.0, "m"),
    "body_depth": ("body_position", 2, -1.0, "m"),
    "layback": ("layback", -1, 1.0, "m"),
}
BODY = [list(FIGURES).index(name) for name in ("body_x", "body_y", "body_depth")]


@dataclass
class Seen:
    """Of one tow of a scene: ticks with each status word, the last one, the largest tension of the cable [N]."""

    scene: Scene
    statuses: Counter[int] = field(default_factory=Counter)
    last: int = 0
    tension_most: float = 0.0

    def take(self, frames: np.ndarray) -> None:
        """Count tick outputs."""
        if not len(frames):
            return
        words, ticks = np.unique(frames["status"], return_counts=True)
        counts = Counter(dict(zip(map(int, words), map(int, ticks), strict=True)))
        self.add(Seen(self.scene, counts, int(frames["status"][-1]), float(frames["tension_most"].max())))

    def add(self, later: Seen) -> None:
        """Count what was seen after this."""
        self.statuses += later.statuses
        self.last, self.tension_most = later.last, max(self.tension_most, later.tension_most)

    def reasons(self, any_tick: bool = False) -> tuple[Reason, ...]:
        """Why this tow's figures are in doubt; any_tick: a single tick is enough, whatever a run bears."""
        over, tick = overload(self.scene, self.tension_most), self.scene.solver.tick
        found = judge_counts(self.statuses, tick, self.last, scene=self.scene, others=over).reasons
        if not any_tick:
            return found
        total, told = sum(self.statuses.values()), {reason.flag for reason in found}
        for rule in RULES:
            ticks = sum(count for word, count in self.statuses.items() if word & int(Flag[rule.flag]))
            idle = rule.compensating and not compensates(self.scene)
            if ticks and rule.state != OK and rule.flag not in told and not idle:
                found += (Reason(rule.flag, ticks * tick, ticks / total, rule.metrics, rule.text),)
        return found


def flagged(seen: Mapping[int, Seen], copies: int, any_tick: bool = False) -> dict[str, str]:
    """Reason -> in how many of so many copies, in copy 0 (key 0 of seen), for how long at most, and what it means."""
    found: dict[str, dict[int, Reason]] = {}
    for number, one in sorted(seen.items()):
        for reason in one.reasons(any_tick):
            found.setdefault(reason.flag, {})[number] = reason
    return {flag: _line(reasons, copies) for flag, reasons in found.items()}


def of_recorded(tow: Seen, told: Mapping[str, str]) -> list[str]:
    """Lines for reasons that the recorded tow has and that were not told of its copies: they cannot have them, as where
    its motion was stale."""
    return [f"the recorded tow: {reason}" for reason in tow.reasons() if reason.flag not in told]


def _line(reasons: Mapping[int, Reason], copies: int) -> str:
    longest = max(reasons.values(), key=lambda reason: reason.seconds)
    count = sum(number > 0 for number in reasons)
    where = f"in {count} of {copies} copies" + " and in copy 0" * (0 in reasons) if count else "in copy 0 alone"
    lasted = f", for up to {longest.seconds:.3g} s ({100.0 * longest.fraction:.3g} %)" if longest.seconds > 0.0 else ""
    return f"{longest.flag} {where}{lasted}: {longest.text}"


class EnsembleEnded(RunError):
    """Too many copies were lost for a band."""


class Stopped(Exception):
    """A start was left because its caller is asked to end."""


class Band(NamedTuple):
    """time int64 [n] ns; low, median, high, nominal [n, FIGURES]: ends and middle of the band, and the copy with the
    scene's own numbers; values [copies, n, FIGURES]; members: copies in it."""

    time: np.ndarray
    low: np.ndarray
    median: np.ndarray
    high: np.ndarray
    nominal: np.ndarray
    values: np.ndarray

    @property
    def members(self) -> int:
        """Copies in the band."""
        return len(self.values)


class Lost(NamedTuple):
    """A copy that was given up: its number, its draw, why."""

    number: int
    draw: Draw
    why: str


Rows = tuple[np.ndarray, np.ndarray]  # times [ns] and figures of a copy


def level_of(members: int) -> float:
    """Share of the true tows that a band of so many copies holds, on the mean over ensembles."""
    return min(LEVEL, (members - 1) / (members + 1))


class Ensemble:
    """Copies 1 to plan.copies of a scene, and copy 0: the scene itself, which is in no band."""

    def __init__(
        self,
        scene: Scene,
        plan: EnsemblePlan,
        *,
        draws: Sequence[Draw] | None = None,
        alive: Callable[[], bool] = lambda: True,
    ) -> None:
        """draws: in place of the plan's, the first is copy 0; alive: asked before each static start, which takes a
        second."""
        self.alive = alive
        self.scene, self.plan = scene, plan
        self.draws = [draw_of(plan, number) for number in range(plan.copies + 1)] if draws is None else list(draws)
        self.lost: list[Lost] = []
        self.seen: dict[int, Seen] = {}  # of each copy, over all starts
        self.newest: dict[int, Seen] = {}  # of the newest run
        self.inputs: Inputs | None = None
        self.start_cpu = 0.0  # s, of the last start
        self._sims: dict[int, Simulator] = {}

    def start(
        self,
        time_ns: int = 0,
        position: tuple[float, float] = (0.0, 0.0),
        heading: float | None = None,
        scope: float | None = None,
    ) -> None:
        """Static start of every copy. heading: mean yaw [rad], None: the scene's; scope: cable out [m], None: the
        scene's. Raises EnsembleEnded where too many do not settle, Stopped where `alive` says no."""
        self._sims, self.newest, self.lost, self.inputs = {}, {}, [], None
        used = time.process_time()
        yaw = math.radians(self.scene.ship.heading_deg) if heading is None else heading
        for number, draw in enumerate(self.draws):
            if not self.alive():
                raise Stopped
            try:
                sim = Simulator(scene_of(self.scene, draw, yaw, scope))
                sim.start(time_ns, position, yaw)
            except (RunError, SceneError) as error:
                self._lose(number, error)
                continue
            if self.inputs is None:
                self.inputs = sim.inputs
            sim.inputs = self.inputs
            self._sims[number] = sim
        self.start_cpu = time.process_time() - used
        self._enough()

    @property
    def nominal(self) -> Simulator:
        """The copy with the scene's own numbers. Raises EnsembleEnded where it was lost."""
        if 0 not in self._sims:
            raise EnsembleEnded("the tow itself was given up: " + next(x.why for x in self.lost if x.number == 0))
        return self._sims[0]

    @property
    def now(self) -> int:
        """Simulation time of the copies, ns."""
        return int(self.nominal.frame["time"])

    def yaws(self) -> np.ndarray:
        """Yaw of the towbody of each copy in the band, now, rad."""
        turns = [sim.frame["body_quaternion"].tolist() for number, sim in sorted(self._sims.items()) if number]
        return np.array([angles_of(*turn)[2] for turn in turns])

    def push(self, item: ShipMotion | WinchCommand) -> None:
        """Give a sample of ship motion or a winch command to all copies. Raises InputError."""
        self.nominal.push(item)

    def run(self, count: int, every: int = 1, judged: bool = True) -> Band:
        """Advance all copies by ``count`` ticks; the band at each ``every``-th of them; judged: flags of these ticks
        count for the copies.

        Raises EnsembleEnded where the solver gives up in too many.
        """
        seen = {number: Seen(sim.scene) for number, sim in self._sims.items()}
        ran = {number: self._one(number, count, every, one) for number, one in seen.items()}
        self.newest = seen
        for number, one in seen.items() if judged else ():
            self.seen.setdefault(number, Seen(one.scene)).add(one)
        for number in [number for number, rows in ran.items() if rows is None]:
            del self._sims[number]
        self._enough()
        return _joined(ran)

    def flagged(self, newest: bool = False) -> dict[str, str]:
        """Flags of the copies by name, as flagged.flagged; newest: of any tick of the newest run."""
        return flagged(self.newest if newest else self.seen, len(self.draws) - 1, any_tick=newest)

    def figures(self, frames: np.ndarray) -> np.ndarray:
        """What a band is made of, of tick outputs [n, figures]."""
        return figures_of(frames)

    def _one(self, number: int, count: int, every: int, seen: Seen) -> Rows | None:
        sim, parts, done = self._sims[number], [], 0
        try:
            while done < count:
                frames = sim.run(min(CHUNK, count - done))
                seen.take(frames)
                parts.append(frames[(-done - 1) % every :: every])
                done += len(frames)
        except SolverError as error:
            self._lose(number, error)
            return None
        joined = np.concatenate(parts)
        return joined["time"].astype(np.int64), self.figures(joined)

    def ahead(
        self, count: int, motion: Iterable[ShipMotion], commands: Iterable[WinchCommand] = (), every: int = 1
    ) -> Iterator[Band | None]:
        """The band of the next ``count`` ticks under motion and commands that did not come yet, last; None after each
        copy before. The copies stay where they are, and may be run on in between.

        A copy whose solver gives up ahead is left out. Raises EnsembleEnded where too many do.
        """
        assert self.inputs is not None
        inputs = Inputs(*(ring.copy() for ring in self.inputs))
        items: list[ShipMotion | WinchCommand] = [*motion, *commands]
        for item in items:
            push(inputs, item, self.now, self.nominal.scene.ship.max_gap)
        rings = {f"inputs_{name}": ring for name, ring in inputs._asdict().items()}
        forks = {number: sim.snapshot() | rings for number, sim in self._sims.items()}
        ran: dict[int, Rows | None] = {}
        for number, fork in forks.items():
            if (sim := self._sims.get(number)) is None:
                continue  # given up since
            own, shared, lost = sim.snapshot(), sim.inputs, list(self.lost)
            try:
                sim.inputs = inputs
                sim.restore(fork)
                ran[number] = self._one(number, count, every, Seen(sim.scene))
            finally:
                sim.inputs, self.lost = shared, lost
                sim.restore(own)
            yield None
        kept = sum(rows is not None for rows in ran.values())
        if ran.get(0) is None or kept < LEAST_KEPT * len(forks):
            raise EnsembleEnded(f"{self.scene.name}: {len(forks) - kept} of {len(forks)} copies cannot be looked ahead")
        yield _joined(ran)

    def let_go(self, kept: int) -> None:
        """Keep copies 1 to ``kept``; the others are as they were with fewer copies from the beginning."""
        self.draws = self.draws[: kept + 1]
        self._sims = {number: sim for number, sim in self._sims.items() if number <= kept}
        self.lost = [lost for lost in self.lost if lost.number <= kept]
        for seen in (self.seen, self.newest):
            for number in [number for number in seen if number > kept]:
                del seen[number]

    def _lose(self, number: int, error: Exception) -> None:
        self.lost.append(Lost(number, self.draws[number], str(error)))

    def _enough(self) -> None:
        if 0 not in self._sims or len(self._sims) < LEAST_KEPT * len(self.draws):
            raise EnsembleEnded(
                f"{self.scene.name}: {len(self.lost)} of {len(self.draws)} copies were given up, the first "
                f"({self.lost[0].draw}): {self.lost[0].why}; there is no band. Narrow the ranges"
            )


def figures_of(frames: np.ndarray) -> np.ndarray:
    """FIGURES of tick outputs [n, FIGURES]."""
    columns = [
        factor * (frames[field] if part < 0 else frames[field][:, part]) for field, part, factor, _ in FIGURES.values()
    ]
    return np.array(columns, float).T


def _joined(ran: dict[int, Rows | None]) -> Band:
    kept = {number: rows for number, rows in ran.items() if rows is not None}
    return band_of(kept[0], [kept[number][1] for number in sorted(kept) if number])


def band_of(nominal: tuple[np.ndarray, np.ndarray], copies: Sequence[np.ndarray]) -> Band:
    """Band of the figures of copies, each [n, FIGURES]; nominal: times and figures of copy 0."""
    values = np.array(copies)
    ends = (0.5 - 0.5 * LEVEL, 0.5, 0.5 + 0.5 * LEVEL)
    low, median, high = np.quantile(values, ends, axis=0, method="weibull")
    return Band(nominal[0], low, median, high, nominal[1], values)
