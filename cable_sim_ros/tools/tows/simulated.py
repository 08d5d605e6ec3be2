"""Tows simulated as they were made: paid out, held, hauled; the largest depth reached and the departure angle there.

A fit asks for many thousands of tows. So a design of tows (Sobol) over wire, rate, speed and the free numbers, in their
logarithms where these are positive, is simulated, and what lies between is interpolated: the tangents of the angles of
chord and cable, about drag over weight, by cubic radial basis functions with a polynomial of degree 2. One tow in eight
says how far that is off, and each tow of the table is simulated itself at the end.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.stats import qmc

from ...sim.flag_rules import FAILED
from ...sim.scene import Scene
from ..calibrate.free import Free, flat
from ..sweeps.cases import RNG, Case, case_of
from ..sweeps.figures import DEEPEST
from .table import SHORTEST, Tow, TowsError

MARGIN = 0.05  # of the range of the tows, by which the design is wider
SLOWER, FASTER = 0.6, 1.3  # times the speeds that 5 and 95 of 100 tows are faster than: those of the design
STEEPEST, FLATTEST = 0.01, 1.55  # rad, of chord and cable in the interpolation
APART = 8  # one in so many of a design is not fitted but compared with
LIMITED = "COMMAND_LIMITED"  # the winch did less than it was told: another tow
OWN = ("ship.tow_speed", "winch.scope")  # keys that the table gives
STATIC = 1.0  # s of a static tow
HAUL = 10.0  # s of the haul: a tow is deepest before
ENOUGH = 0.8  # of a design must be simulated
SEED = 1
Run = Callable[[Sequence[Case]], list[dict[str, Any]]]


class Made(NamedTuple):
    """How a tow was made: wire [m] from the water, rates of pay-out and haul [m/s], hold [s], speed [m/s]."""

    wire: float
    rate_out: float
    rate_in: float
    hold: float
    speed: float


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
    lasts = (tow.wire - setting.begin) / tow.rate_out
    rate = max(tow.rate_out, tow.rate_in)
    settings = {
        **setting.settings,
        **flat(setting.scene, {one.key: value for one, value in zip(setting.free, values)}),
        **dict(zip(OWN, (tow.speed, setting.height + setting.begin))),
        "winch.max_rate": max(setting.scene.winch.max_rate, 1.01 * rate),
    }
    end = lasts + tow.hold
    winch = f"0 rate {tow.rate_out:.6g}, {lasts:.3f} hold, {end + 0.001:.3f} rate {-tow.rate_in:.6g}"
    return case_of(number, setting.name, settings, winch, end + HAUL, tuple(name for name, *_ in DEEPEST))


def static_cases(setting: Setting, tows: Sequence[Made]) -> list[Case]:
    """The static tow with the wire out of each, with the numbers of the scene."""
    return [
        case_of(
            k,
            setting.name,
            {**setting.settings, **dict(zip(OWN, (tow.speed, setting.height + tow.wire)))},
            "0 hold",
            STATIC,
            tuple(name for name, *_ in DEEPEST),
        )
        for k, tow in enumerate(tows)
    ]


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


class Surrogate(NamedTuple):
    """Depth and angle between the tows of a design. low, high: of its coordinates; logs: of which logarithms are taken;
    error: largest and rms deviation of depth, share of it, and largest of the angle [rad], in the tows that are only
    compared with; tows: simulated; failed: of them."""

    inner: RBFInterpolator
    low: np.ndarray
    high: np.ndarray
    logs: np.ndarray
    error: tuple[float, float, float]
    tows: int
    failed: list[str]

    def __call__(self, tows: Sequence[Made], numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Depth [m] and angle [rad] of tows with values of the free numbers [n, free]."""
        own = np.array([(tow.wire, tow.rate_out, tow.speed) for tow in tows]).reshape(-1, 3)
        at = np.hstack([own, np.asarray(numbers).reshape(len(own), -1)])
        at[:, self.logs] = np.log(at[:, self.logs])
        share, angle = _from_tangents(self.inner(np.clip((at - self.low) / (self.high - self.low), 0.0, 1.0)))
        return share * own[:, 0], angle


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


def surrogate(setting: Setting, tows: Sequence[Tow], speeds: tuple[float, float], count: int, run: Run) -> Surrogate:
    """A design of ``count`` tows, simulated by ``run``, and what it says between them. Raises TowsError."""
    wire, rate = np.array([tow.wire for tow in tows]), np.array([tow.rate_out for tow in tows])
    low = np.array(
        [(1.0 - MARGIN) * wire.min(), (1.0 - MARGIN) * rate.min(), speeds[0], *(f.low for f in setting.free)]
    )
    high = np.array(
        [(1.0 + MARGIN) * wire.max(), (1.0 + MARGIN) * rate.max(), speeds[1], *(f.high for f in setting.free)]
    )
    low[0] = max(low[0], setting.begin + 0.5 * SHORTEST)
    logs = low > 0.0
    low[logs], high[logs] = np.log(low[logs]), np.log(high[logs])
    unit = qmc.Sobol(len(low), **{RNG: np.random.default_rng(SEED)}).random(count)
    at = low + (high - low) * unit
    at[:, logs] = np.exp(at[:, logs])
    haul = float(np.median([tow.rate_in for tow in tows]))
    stay = float(np.median([tow.hold for tow in tows]))
    made = [Made(wire, rate, haul, stay, speed) for wire, rate, speed in at[:, :3].tolist()]
    found = answered(run(cases_of(setting, made, at[:, 3:])))
    good = np.isfinite(found.depth)
    if good.sum() < ENOUGH * count:
        raise TowsError(
            f"{count - int(good.sum())} of {count} tows between those of the table cannot be simulated "
            f"({found.why[0]:.300}); nothing was fitted. Give the scene the winch, wire and mesh for all of them"
        )
    share = found.depth / at[:, 0]
    values = _tangents(share, found.angle)
    apart = good & (np.arange(count) % APART == APART - 1)
    near = good & ~apart
    got, angle = _from_tangents(_between(unit[near], values[near])(unit[apart]))
    inner = _between(unit[good], values[good])
    off = np.abs(got / share[apart] - 1.0)
    error = float(off.max()), float(np.sqrt(np.mean(off**2))), float(np.abs(angle - found.angle[apart]).max())
    return Surrogate(inner, low, high, logs, error, count, found.why)


def _between(at: np.ndarray, values: np.ndarray) -> RBFInterpolator:
    return RBFInterpolator(at, values, kernel="cubic", degree=2)
