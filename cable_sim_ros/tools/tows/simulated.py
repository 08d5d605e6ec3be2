"""Tows simulated as they were made: paid out, held, hauled; the largest depth reached and the departure angle there.

A fit asks for many thousands of tows. So a design of tows (Sobol) over wire, rate, speed and the free numbers, in their
logarithms where these are positive, is simulated, and what lies between is interpolated: the tangents of the angles of
chord and cable, about drag over weight, by cubic radial basis functions with a polynomial of degree 2. One tow in eight
says how far that is off, and each tow of the table is simulated itself at the end.

A tow over time is made once: its design is of its own, over the mean of its speeds, which are scaled to it, and the
free numbers. Each of its tows in turn is left out to say how far it is off.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.stats import qmc

from ...sim.flag_rules import FAILED
from ...sim.scene import Scene
from ..calibrate.free import Free, flat
from ..sweeps.cases import RNG, Case, case_of
from ..sweeps.figures import DEEPEST
from .series import SHORTEST, Series
from .table import Tow, TowsError

MARGIN = 0.05  # of the range of the tows, by which the design is wider
SLOWER, FASTER = 0.6, 1.3  # times the speeds that 5 and 95 of 100 tows are faster than: those of the design
STEEPEST, FLATTEST = 0.01, 1.55  # rad, of chord and cable in the interpolation
APART = 8  # one in so many of a design is not fitted but compared with
SMALLER, FEW = 32, 8  # times is the design of a tow over time; tows of it at least; doubled by each free number
LIMITED = "COMMAND_LIMITED"  # the winch did less than it was told: another tow
OWN = ("ship.tow_speed", "winch.scope")  # keys that the table gives
ASKED = tuple(name for name, *_ in DEEPEST)  # figures of a tow
STATIC = 1.0  # s of a static tow
HAUL = 10.0  # s of the haul: a tow is deepest before
ENOUGH = 0.8  # of a design must be simulated
SEED = 1
Run = Callable[[Sequence[Case]], list[dict[str, Any]]]


class Made(NamedTuple):
    """How a tow was made: wire [m] from the water, rates of pay-out and haul [m/s], hold [s], mean speed [m/s]; series:
    what it was over time, in place of rates and hold."""

    wire: float
    rate_out: float
    rate_in: float
    hold: float
    speed: float
    series: Series | None = None


def made_of(tow: Tow, speed: float) -> Made:
    """How a tow of a table was made at a speed [m/s]."""
    return Made(tow.wire, tow.rate_out, tow.rate_in, tow.hold, speed, tow.series)


class Answered(NamedTuple):
    """Of simulated tows, arrays [n]: largest depth [m] and departure angle there [rad], NaN where one failed or was
    not made as it should be; why: texts of those; doubts: flags of doubtful verdicts, each with the number of tows."""

    depth: np.ndarray
    angle: np.ndarray
    why: list[str]
    doubts: dict[str, int]


class Setting(NamedTuple):
    """What all tows of a table share: name or file of the scene, the scene, settings of it, wire in the water at the
    beginning [m], height of the sheave over the water [m], free numbers."""

    name: str
    scene: Scene
    settings: dict[str, Any]
    begin: float
    height: float
    free: list[Free]


def height_of(scene: Scene) -> float:
    """Height of the sheave's axis over the mean water surface [m]: wire that hangs in the air at the start."""
    return scene.ship.reference_height + scene.sheave.position[2]


def cases_of(setting: Setting, tows: Sequence[Made], numbers: np.ndarray) -> list[Case]:
    """A case a tow; numbers [n, free]: values of the free numbers."""
    return [_case(setting, k, tow, row) for k, (tow, row) in enumerate(zip(tows, numbers.tolist(), strict=True))]


def _case(setting: Setting, number: int, tow: Made, values: list[float]) -> Case:
    rate, speed, begin, ship = max(tow.rate_out, tow.rate_in), tow.speed, setting.begin, None
    if tow.series is not None:
        winch, ship, speed = tow.series.plans(tow.speed)
        begin, lasts = tow.series.wire[0], tow.series.time[-1]
    else:
        lasts = (tow.wire - begin) / tow.rate_out
        end = lasts + tow.hold
        winch = f"0 rate {tow.rate_out:.6g}, {lasts:.3f} hold, {end + 0.001:.3f} rate {-tow.rate_in:.6g}"
        lasts = end + HAUL
    settings = {
        **setting.settings,
        **flat(setting.scene, {one.key: value for one, value in zip(setting.free, values)}),
        **dict(zip(OWN, (speed, setting.height + float(begin)))),
        "winch.max_rate": max(setting.scene.winch.max_rate, 1.01 * rate),
    }
    return case_of(number, setting.name, settings, winch, float(lasts), ASKED, ship)


def static_cases(setting: Setting, tows: Sequence[Made]) -> list[Case]:
    """The static tow with the wire out of each, with the numbers of the scene."""
    found = []
    for k, tow in enumerate(tows):
        settings = {**setting.settings, **dict(zip(OWN, (tow.speed, setting.height + tow.wire)))}
        found.append(case_of(k, setting.name, settings, "0 hold", STATIC, ASKED))
    return found


def answered(rows: Sequence[dict[str, Any]]) -> Answered:
    """What the runs of tows gave."""
    depth, angle = np.full(len(rows), np.nan), np.full(len(rows), np.nan)
    why: list[str] = []
    doubts: dict[str, int] = {}
    for k, row in enumerate(rows):
        if row["verdict"] == FAILED or row["error"] or LIMITED in row["reasons"]:
            why.append(row["error"] or row["reasons"])
            continue
        depth[k], angle[k] = row[DEEPEST[0][0]], np.radians(row[DEEPEST[1][0]])
        for text in filter(None, row["reasons"].split("; ")):
            word = text.split()[0].rstrip(":")
            if word.isupper():
                doubts[word] = doubts.get(word, 0) + 1
    return Answered(depth, angle, why, doubts)


class Design:
    """So many tows as ``made`` but for what has a range, by fields of Made, and the free numbers; depth and angle
    between them once they are simulated. off: of depth, share of it, and angle [rad] in those left out [2, n]."""

    def __init__(self, setting: Setting, made: Made, ranges: dict[str, tuple[float, float]], count: int) -> None:
        ends = np.array([*ranges.values(), *((free.low, free.high) for free in setting.free)])
        self.fields, self.logs = list(ranges), ends[:, 0] > 0.0
        ends[self.logs] = np.log(ends[self.logs])
        self.low, self.high = ends.T
        self.unit = qmc.Sobol(len(ends), **{RNG: np.random.default_rng(SEED)}).random(count)
        at = self.low + (self.high - self.low) * self.unit
        at[:, self.logs] = np.exp(at[:, self.logs])
        self.tows = [made._replace(**dict(zip(ranges, row))) for row in at.tolist()]
        self.numbers = at[:, len(ranges) :]

    def fit(self, found: Answered, name: str, left_out: Iterable[np.ndarray]) -> None:
        """Interpolate between what its tows gave; left_out: bool [tows] of what is compared with the others' fit.
        Raises TowsError."""
        count, good = len(self.tows), np.isfinite(found.depth)
        if good.sum() < ENOUGH * count:
            raise TowsError(
                f"{count - int(good.sum())} of {count} tows {name} cannot be simulated "
                f"({found.why[0]:.300}); nothing was fitted. Give the scene the winch, wire and mesh for all of them"
            )
        share = found.depth / np.array([tow.wire for tow in self.tows])
        values = _tangents(share, found.angle)
        off = []
        for apart in left_out:
            near, apart = good & ~apart, good & apart
            if apart.any():
                got, angle = _from_tangents(_between(self.unit[near], values[near])(self.unit[apart]))
                off.append(np.abs([got / share[apart] - 1.0, angle - found.angle[apart]]))
        self.off = np.hstack(off)
        self.inner = _between(self.unit[good], values[good])

    def __call__(self, tows: Sequence[Made], numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depth [m] and angle [rad] of tows with values of the free numbers [n, free]."""
        at = np.hstack([[[getattr(tow, field) for field in self.fields] for tow in tows], numbers])
        at[:, self.logs] = np.log(at[:, self.logs])
        share, angle = _from_tangents(self.inner(np.clip((at - self.low) / (self.high - self.low), 0.0, 1.0)))
        return share * np.array([tow.wire for tow in tows]), angle


class Between(NamedTuple):
    """What designs say between their tows, by the `id` of the series. error, over_time: largest and rms deviation of
    depth, share of it, and largest of the angle [rad], in tows that were left out, of the design of rows of their own
    numbers, and of those of tows over time; NaN: none; tows: simulated; failed: of them."""

    designs: dict[int, Design]
    error: tuple[float, float, float]
    over_time: tuple[float, float, float]
    tows: int
    failed: list[str]

    def __call__(self, tows: Sequence[Made], numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depth [m] and angle [rad] of tows with values of the free numbers [n, free]."""
        keys, out = np.array([id(tow.series) for tow in tows]), np.empty((2, len(tows)))
        for key in set(keys.tolist()):
            rows = np.flatnonzero(keys == key).tolist()
            out[:, rows] = self.designs[key]([tows[k] for k in rows], numbers[rows])
        return out[0], out[1]


def _tangents(share: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Logarithms of the tangents of the chord from surface to towbody, and of the cable at the sheave [n, 2]."""
    chord = np.arccos(np.clip(share, 0.0, 1.0))
    return np.log(np.tan(np.clip(np.column_stack([chord, angle]), STEEPEST, FLATTEST)))


def _from_tangents(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    chord, angle = np.arctan(np.exp(values)).T
    return np.cos(chord), angle


def speeds_around(tows: Sequence[Tow], scaled: frozenset[str]) -> tuple[float, float]:
    """Speeds through the water [m/s] between which a tow can have been made, by the speeds that are not scaled."""
    known = [v for tow in tows for name, v in tow.speeds.items() if name not in scaled and np.isfinite(v)]
    return SLOWER * float(np.quantile(known, 0.05)), FASTER * float(np.quantile(known, 0.95))


def surrogate(setting: Setting, tows: Sequence[Tow], speeds: tuple[float, float], count: int, run: Run) -> Between:
    """A design of ``count`` tows for rows of their own numbers, a small one for each tow over time, simulated by
    ``run``, and what lies between. Raises TowsError."""
    plain, few = [tow for tow in tows if tow.series is None], max(count // SMALLER, FEW) << len(setting.free)
    names, designs = {id(tow.series): f"by the series of {tow.name}" for tow in tows}, {}
    if plain:
        wire, rate = np.array([tow.wire for tow in plain]), np.array([tow.rate_out for tow in plain])
        haul, stay = (float(np.median([getattr(tow, name) for tow in plain])) for name in ("rate_in", "hold"))
        ranges = {
            "wire": (max((1.0 - MARGIN) * wire.min(), setting.begin + 0.5 * SHORTEST), (1.0 + MARGIN) * wire.max()),
            "rate_out": ((1.0 - MARGIN) * rate.min(), (1.0 + MARGIN) * rate.max()),
            "speed": speeds,
        }
        designs[id(None)] = Design(setting, Made(0.0, 0.0, haul, stay, 0.0), ranges, count)
        names[id(None)] = "between those of the table"
    for tow in tows:
        if tow.series is not None:
            designs[id(tow.series)] = Design(setting, made_of(tow, 0.0), {"speed": speeds}, few)
    numbers = np.vstack([one.numbers for one in designs.values()])
    rows = run(cases_of(setting, [tow for one in designs.values() for tow in one.tows], numbers))
    begun, failed = 0, list[str]()
    for key, one in designs.items():
        size = len(one.tows)
        found = answered(rows[begun : begun + size])
        left_out = np.eye(size, dtype=bool)  # each in turn, or one in so many
        one.fit(found, names[key], left_out if key != id(None) else [np.arange(size) % APART == APART - 1])
        begun, failed = begun + size, failed + found.why
    errors = [_errors([one.off for key, one in designs.items() if (key == id(None)) == own]) for own in (True, False)]
    return Between(designs, errors[0], errors[1], len(rows), failed)


def _errors(off: list[np.ndarray]) -> tuple[float, float, float]:
    if not off:
        return np.nan, np.nan, np.nan
    depth, angle = np.hstack(off)
    return float(depth.max()), float(np.sqrt(np.mean(depth**2))), float(angle.max())


def _between(at: np.ndarray, values: np.ndarray) -> RBFInterpolator:
    return RBFInterpolator(at, values, kernel="cubic", degree=2)
