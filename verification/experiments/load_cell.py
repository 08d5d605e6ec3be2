"""The load cell of the idle trawl winch of RVIB Nathaniel B. Palmer against the motion of the ship, NBP1406.

The same ten minutes, two computers. What hangs on the cell is not logged, neither is where. The model of
verification/load_cell.py is fitted on one half of the record and judged on the other, both ways round. The force is
the mean of four samples (5 Hz); 1 Hz of motion holds nothing above 0.4 Hz, the force hardly anything.
"""

from __future__ import annotations

from math import hypot
from pathlib import Path

import numpy as np

from cable_sim_ros.io.scenes.document import share_folder
from cable_sim_ros.io.sources.motion_curves import Curve, Given, through
from cable_sim_ros.plots.run import canvas
from cable_sim_ros.runs.make_bags import read_csv

from ..load_cell import MAX_LAG, LoadCell, Moved, fit, judge
from . import Comparison, Result

MOTION, FORCE = "nbp1406_seapath330_1hz.csv", "nbp1406_winch_trawl_20hz.csv"
MEAN_OF = 4  # samples of the force
HALVES = ("first", "second")
CELL, FITS = "trawl winch, LCI-90i", "intervals (95 %) of both halves"
UNITS = LoadCell("N", "kg", "m", "m", "s")  # type: ignore[arg-type]
NAMES = LoadCell("zero", "mass, signed", "place forward", "place to port", "lag")  # type: ignore[arg-type]
MODELS = {0: "heave alone, no lever arm", 1: "lever arm forward only", 2: "lever arm forward and to port"}


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
