"""The load cell of the idle trawl winch of RVIB Nathaniel B. Palmer against the motion of the ship, NBP1406.

The same ten minutes, two computers. What hangs on the cell is not logged, neither is where. The model is fitted on one
half of the record and judged on the other, both ways round. The force is the mean of four samples (5 Hz); 1 Hz of
motion holds nothing above 0.4 Hz, the force hardly anything. A load cell that carries an unknown mass at an unknown
place of a ship:

    F(t) = F0 + m [ heave''(t - lag) - x pitch''(t - lag) + y roll''(t - lag) ]

heave up, pitch bow down, roll port side up, x forward and y to port of the point whose heave it is; small angles, the
cell upright, its weight tared away. A sign of the cell that is turned round is a negative m. The lag is that of the
cell's stamps behind those of the motion. For one lag the rest is linear (variable projection: Golub and Pereyra 1973,
SIAM J. Numer. Anal. 10, 413). Intervals are of the jackknife over blocks that are longer than a wave (Kunsch 1989, Ann.
Statist. 17, 1217), so they hold for a misfit that lasts; what the model leaves out is in them only as far as it varies.
"""

from __future__ import annotations

from math import hypot
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from cable_sim_ros.errors import CableSimError
from cable_sim_ros.io.scenes.document import share_folder
from cable_sim_ros.io.sources.motion_curves import Curve, Given, through
from cable_sim_ros.plots.run import canvas
from cable_sim_ros.runs.make_bags import read_csv
from cable_sim_ros.tools.compare.spectra import jackknife

from . import Comparison, Result

MOTION, FORCE = "nbp1406_seapath330_1hz.csv", "nbp1406_winch_trawl_20hz.csv"
MEAN_OF = 4  # samples of the force
HALVES = ("first", "second")
CELL, FITS = "trawl winch, LCI-90i", "intervals (95 %) of both halves"
MODELS = {0: "heave alone, no lever arm", 1: "lever arm forward only", 2: "lever arm forward and to port"}
MAX_LAG = 5.0  # s, either way
COARSE = 0.1  # s between the lags that are tried first
NEAR = 0.5  # s: so far about the lag of the whole record that of a part is looked for
MIN_EXPLAINED = 0.5  # of the variance: below it the model is not what the cell shows
BLOCKS = 10  # of the jackknife
LEAST_BLOCK = 8.0  # s, about one wave: shorter blocks are not independent


class LoadCellError(CableSimError, ValueError):
    """A recording that cannot tell what its load cell carries."""


class Moved(NamedTuple):
    """Motion of the ship: heave [m] up, roll [rad] port side up, pitch [rad] bow down."""

    heave: Curve
    roll: Curve
    pitch: Curve


class LoadCell(NamedTuple):
    """zero [N], mass [kg] with the sign of the cell, forward and port [m] of the point of the heave, lag [s]."""

    zero: float
    mass: float
    forward: float
    port: float
    lag: float

    def force(self, t: np.ndarray, motion: Moved) -> np.ndarray:
        """What it shows at times [s], N."""
        back = t - self.lag
        at = motion.heave(back, 2) - self.forward * motion.pitch(back, 2) + self.port * motion.roll(back, 2)
        return self.zero + self.mass * at


class Fitted(NamedTuple):
    """A fit: half widths of the 95 % intervals; explained: fraction of the variance; rms: of what is left [N]."""

    cell: LoadCell
    half_width: LoadCell
    explained: float
    rms: float


class Judged(NamedTuple):
    """A fit held against numbers that it has not seen: explained 1 - rms^2 / variance, rms [N], measured and predicted
    standard deviation [N]."""

    explained: float
    rms: float
    measured: float
    predicted: float


def fit(t: np.ndarray, force: np.ndarray, motion: Moved, *, levers: int = 2) -> Fitted:
    """Fit a load cell to its force [N] at times [s]; levers: 0 none, 1 forward, 2 port as well.

    The motion must reach MAX_LAG beyond t at both ends. Raises LoadCellError for a record that is too short, for a
    force that does not change, for a lag at the end of what is tried, and where the motion explains less than half.
    """
    length = float(t[-1] - t[0]) if len(t) > 1 else 0.0
    if length < BLOCKS * LEAST_BLOCK:
        raise LoadCellError(
            f"the record of the load cell lasts {length:.3g} s: no mass was fitted, its interval needs "
            f"{BLOCKS * LEAST_BLOCK:g} s. Give a longer record"
        )
    if np.ptp(force) == 0.0:
        raise LoadCellError(
            f"the load cell shows {force[0]:g} N throughout: no mass was fitted. Give a channel that has a sensor"
        )
    whole = _fit(t, force, motion, levers)
    judgement = judge(whole, t, force, motion)
    if judgement.explained < MIN_EXPLAINED:
        raise LoadCellError(
            f"the motion explains {100.0 * judgement.explained:.3g} % of what the load cell shows, less than "
            f"{100.0 * MIN_EXPLAINED:g} %: no mass was fitted. Align the two clocks to {MAX_LAG:g} s, or give the "
            f"motion of this ship"
        )
    edges = np.linspace(t[0], t[-1], BLOCKS + 1)
    block = np.clip(np.searchsorted(edges, t, side="right") - 1, 0, BLOCKS - 1)
    parts = np.array([_fit(t[block != k], force[block != k], motion, levers, whole.lag) for k in range(BLOCKS)])
    half = LoadCell(*jackknife(np.array(whole), parts).tolist())
    return Fitted(whole, half, judgement.explained, judgement.rms)


def judge(cell: LoadCell, t: np.ndarray, force: np.ndarray, motion: Moved) -> Judged:
    """Hold a load cell against a force [N] at times [s]."""
    ours = cell.force(t, motion)
    rms, measured = float(np.sqrt(np.mean((force - ours) ** 2))), float(force.std())
    return Judged(1.0 - (rms / measured) ** 2, rms, measured, float(ours.std()))


def _fit(t: np.ndarray, force: np.ndarray, motion: Moved, levers: int, about: float | None = None) -> LoadCell:
    def solved(lag: float) -> tuple[float, np.ndarray]:
        back = t - lag
        columns = (np.ones_like(t), motion.heave(back, 2), -motion.pitch(back, 2), motion.roll(back, 2))[: 2 + levers]
        a = np.column_stack(columns)
        x = np.linalg.lstsq(a, force, rcond=None)[0]
        return float(((force - a @ x) ** 2).sum()), x

    low, high = (-MAX_LAG, MAX_LAG) if about is None else (about - NEAR, about + NEAR)
    tried = np.arange(low, high + 0.5 * COARSE, COARSE)
    k = int(np.argmin([solved(float(lag))[0] for lag in tried]))
    if k in (0, len(tried) - 1):
        raise LoadCellError(
            f"the best lag of the load cell is at {tried[k]:+.3g} s, the end of what is tried: no mass was fitted. "
            f"Align the two clocks to {MAX_LAG:g} s"
        )
    near = (float(tried[k - 1]), float(tried[k + 1]))
    lag = float(minimize_scalar(lambda lag: solved(lag)[0], bounds=near, method="bounded").x)
    x = [*solved(lag)[1].tolist(), 0.0, 0.0][:4]
    return LoadCell(x[0], x[1], x[2] / x[1], x[3] / x[1], lag)


UNITS = LoadCell("N", "kg", "m", "m", "s")  # type: ignore[arg-type]
NAMES = LoadCell("zero", "mass, signed", "place forward", "place to port", "lag")  # type: ignore[arg-type]


def recorded() -> tuple[np.ndarray, np.ndarray, Moved]:
    """Times [s] and force [N] of the cell, and the motion, both on the logger's clock from 2014-08-01T00:00 UTC."""
    folder = share_folder() / "bags" / "source"
    ship, winch = read_csv(folder / MOTION)[1], read_csv(folder / FORCE)[1]
    n = len(winch["t_s"]) // MEAN_OF * MEAN_OF
    t, force = (winch[name][:n].reshape(-1, MEAN_OF).mean(axis=1) for name in ("t_s", "tension_n"))
    seconds = ship["t_s"]

    def curve(name: str, sign: float, angle: bool) -> Curve:
        given = Given(name, "rad" if angle else "m", 1.0, angle)
        return through(given, [(seconds, sign * ship[name], None)])[0][0]

    motion = Moved(curve("heave_down_m", -1.0, False), curve("roll_rad", 1.0, True), curve("pitch_rad", -1.0, True))
    inside = (t > seconds[0] + MAX_LAG) & (t < seconds[-1] - MAX_LAG)
    return t[inside], force[inside], motion


def experiment(progress) -> Result:
    """Fit and judge."""
    t, force, motion = recorded()
    middle = 0.5 * (t[0] + t[-1])
    halves = [(t[part], force[part]) for part in (t < middle, t >= middle)]
    rows, choices = list[Comparison](), []
    for levers, name in MODELS.items():
        progress(name, levers, len(MODELS))
        fits = [fit(*half, motion, levers=levers) for half in halves]
        judged = [judge(fits[k].cell, *halves[1 - k], motion) for k in (0, 1)]
        choices.append(
            {
                "choice": name,
                "mass, signed [kg]": fits[0].cell.mass,
                "explained of the second half [%]": 100.0 * judged[0].explained,
                "left of it, rms [N]": judged[0].rms,
                "explained of the first half [%]": 100.0 * judged[1].explained,
                "left of the first, rms [N]": judged[1].rms,
            }
        )
    for k in (0, 1):
        fitted, other = HALVES[k], HALVES[1 - k]
        head = f"fitted on the {fitted} half, {other} half"
        rows.append(Comparison(f"{head}: std of the force", "N", judged[k].predicted, judged[k].measured, None, CELL))
        rows.append(Comparison(f"{head}: variance left", "%", 100.0 * (1.0 - judged[k].explained), 0.0, None, CELL))
    for name, unit, one, two, a, b in zip(
        NAMES, UNITS, fits[0].cell, fits[1].cell, fits[0].half_width, fits[1].half_width
    ):
        rows.append(Comparison(f"{name}: second half against first", unit, two, one, hypot(a, b), FITS))
        rows.append(Comparison(f"{name}: half width, second against first", unit, b, a, None, "jackknife"))
    cell = fits[0].cell
    return Result("load_cell", rows, choices, lambda folder: _plot(folder, halves[1], cell, motion), "other models")


def _plot(folder: Path, half: tuple[np.ndarray, np.ndarray], cell: LoadCell, motion: Moved) -> Path:
    t, force = half
    ours = cell.force(t, motion)
    path = folder / "load_cell.png"
    with canvas(path, (10.0, 5.9), source="winch and motion logs of R/V N.B. Palmer, NBP1406") as figure:
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        upper.set_title("Idle trawl winch of NBP1406: the half that was not fitted")
        upper.plot(t, force, lw=2.2, label="load cell")
        upper.plot(t, ours, lw=1.2, label=f"{cell.mass:.0f} kg, {-cell.forward:.0f} m aft of the motion sensor")
        upper.set_ylabel("force [N]")
        upper.legend(loc="upper left", bbox_to_anchor=(0.0, -0.02), ncols=2)
        lower.plot(t, force - ours, lw=1.2)
        lower.set(ylabel="left [N]", xlabel="time from 2014-08-01T00:00 UTC [s]")
    return path
