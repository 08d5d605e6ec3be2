"""A CTD lowered to 1027 m on the cable of RV Meteor: does the swing of its depth rate grow with the cable out?

Only the pressure of the body was logged: no ship motion, no pay-out, no tension, no data of cable and body. So no curve
of the model can be laid on the record. What can be judged is a ratio in which sea and ship drop out if they stay the
same for the 50 minutes: the swing in the wave band (0.05 to 0.3 Hz) against depth. The body of `lowered_ctd` hangs on a
cable of steel, far from resonance, and follows the sheave whatever the length; a cable ten times softer would not.
"""

from __future__ import annotations

from math import exp, log
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.document import share_folder
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.plots.run import BLUE, FAINT, ORANGE, canvas
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.make_bags import read_csv

from ..shipped import quiet
from . import Comparison, Result, unjudged

RECORD, SOURCE = "meteor_ctd_2hz.csv", "RV Meteor, 2011-04-01"
BAND, WINDOW = (0.05, 0.3), 150.0  # Hz, s
CONSTANT = 0.15  # m/s: a window counts where the 20 s mean of the depth rate stays that near to its own mean
LENGTHS = (100.0, 400.0, 700.0, 1000.0)  # m of cable out
QUICK = f"two lengths of cable of {len(LENGTHS)}"
HEAVE, PERIOD = 0.35, 7.8  # m, s: makes 0.29 m/s of swing, as recorded; its spectral peak
SECONDS = 80.0
SOFT = 0.1  # of the axial stiffness


class Window(NamedTuple):
    """A stretch of constant winch speed: mean depth [m], mean depth rate, swing in the wave band [m/s]."""

    depth: float
    rate: float
    swing: float


def recorded() -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and depth [m]."""
    columns = read_csv(share_folder() / "bags" / "source" / RECORD)[1]
    return columns["t_s"], columns["depth_m"]


def windows(t: np.ndarray, depth: np.ndarray) -> list[Window]:
    """Stretches of WINDOW seconds in which the winch turned evenly, none overlapping another."""
    from scipy.signal import butter, sosfiltfilt

    rate, step = np.gradient(depth, t), float(t[1] - t[0])
    band = sosfiltfilt(butter(4, BAND, "bandpass", fs=1.0 / step, output="sos"), rate)
    slow = np.convolve(np.pad(rate, 20, "edge"), np.full(41, 1.0 / 41.0), "valid")
    n, k, found = round(WINDOW / step), 0, []
    while k + n <= len(t):
        part = slice(k, k + n)
        if np.abs(slow[part] - slow[part].mean()).max() < CONSTANT:
            found.append(Window(float(depth[part].mean()), float(rate[part].mean()), float(band[part].std())))
            k += n
        else:
            k += max(n // 10, 1)
    return found


def growth(found: list[Window]) -> tuple[float, float]:
    """Slope of the logarithm of the swing over depth [1/km], and half its 95 % interval."""
    from scipy.stats import linregress, t

    line = linregress([1e-3 * w.depth for w in found], [log(w.swing) for w in found])
    return float(line.slope), float(t.ppf(0.975, len(found) - 2) * line.stderr)


def gain(length: float, seconds: float, stiffness: float = 1.0) -> float:
    """Swing of the body's vertical speed over that of the sheave, with that length [m] of cable out."""
    with quiet():
        base = load_scene("lowered_ctd")
        values = {"winch.scope": length, "cable.axial_stiffness": base.cable.axial_stiffness * stiffness}
        scene = override(base, {"winch.most_scope": None} | values)
        f = offline.run(scene, heave=(HEAVE, PERIOD), duration=seconds).frames
    f = f[f.time > f.time[-1] - 4.0 * PERIOD * 1e9]
    return float(f.body_velocity[:, 2].std() / f.sheave_velocity[:, 2].std())


def slope(gains: dict[float, float]) -> float:
    """Slope of the logarithm of the gain over length [1/km]."""
    lengths = np.array(list(gains))
    return float(np.polyfit(1e-3 * lengths, np.log(list(gains.values())), 1)[0])


def experiment(progress, seconds: float, quick: bool = False) -> Result:
    """Growth of the swing in the record and in the model; seconds: of each run; quick: two lengths."""
    lengths = LENGTHS[:: len(LENGTHS) - 1] if quick else LENGTHS
    progress("record", 0, 3)
    t, depth = recorded()
    found = windows(t, depth)
    measured, half = growth(found)
    progress("lowered_ctd", 1, 3)
    gains = {length: gain(length, seconds) for length in lengths}
    progress("a softer cable", 2, 3)
    soft = {length: gain(length, seconds, SOFT) for length in lengths}
    swings = np.array([w.swing for w in found])
    rows = [
        unjudged("windows of constant winch speed", "1", float(len(found)), SOURCE),
        unjudged("swing of the depth rate, mean of the windows", "m/s", float(swings.mean()), SOURCE),
        unjudged("the same, its spread over the windows", "m/s", float(swings.std(ddof=1)), SOURCE),
        Comparison(
            "growth of the swing with cable out", "1/km", slope(gains), measured, half, f"{SOURCE}: 95 % interval"
        ),
        Comparison("the same, at 1000 m over at 0 m", "1", exp(slope(gains)), exp(measured), None, SOURCE),
        *(unjudged(f"gain, {length:g} m out", "1", value, "lowered_ctd") for length, value in gains.items()),
        unjudged("growth with an axial stiffness of a tenth", "1/km", slope(soft), "what the record would refute"),
    ]
    return Result("lowered", rows, [], lambda folder: draw(found, gains, soft, folder / "lowered.png"))


def draw(found: list[Window], gains: dict[float, float], soft: dict[float, float], path: Path) -> Path:
    """Swing of the windows over depth, with the model's growth through their mean. RuntimeError without matplotlib."""
    title = "Swing of the depth rate of a lowered CTD, 0.05 to 0.3 Hz"
    with canvas(path, (9.0, 5.5), title, f"record: {SOURCE}; scene lowered_ctd") as figure:
        axis = figure.subplots()
        for sign, marker, name in ((1.0, "v", "recorded, going down or held"), (-1.0, "^", "recorded, coming up")):
            part = [w for w in found if (w.rate > -0.1) == (sign > 0.0)]
            axis.plot([w.depth for w in part], [w.swing for w in part], marker, color=ORANGE, label=name)
        mean = float(np.mean([w.swing for w in found]))
        for of, colour, name in ((gains, BLUE, "simulated"), (soft, FAINT, "a tenth of the stiffness")):
            values = np.array(list(of.values()))
            axis.plot(list(of), mean * values / gains[min(gains)], "o-", color=colour, label=name)
        axis.set(xlabel="depth, cable out [m]", ylabel="standard deviation [m/s]", ylim=(0.0, 0.75))
        axis.legend(loc="upper left")
    return path
