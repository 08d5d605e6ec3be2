"""The towed sphere in the turbulent flume without winch motion, Westin (2018) 4.3.3, Table 4 (experiment: Calnan).

The scene `flume` in a stream with the printed standard deviations. How fast the turbulence changes is not printed (it
is white noise through a Chebyshev filter whose corner is not given): the time scale is the one free number here, and
the table of choices shows what it decides. As in the thesis all the water moves alike; in a tank it does not.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.plots.run import BLUE, ORANGE, canvas
from cable_sim_ros.runs.summary import ellipsoid_volume

from ..shipped import scene_with, started
from . import Comparison, Result, unjudged

DEVIATION = [0.0300, 0.0262, 0.0152]  # m/s, 4.3
TIME_SCALE = 0.05  # s, see OTHERWISE
SECONDS, QUICK_SECONDS, SETTLING = 300.0, 40.0, 20.0
QUICK = f"{QUICK_SECONDS:g} s of {SECONDS:g} s, no choice made otherwise"
AXES = ("X_E", "Y_E", "Z_E")
MEASURED, HIS = (1.19, 0.78, 0.13), (1.56, 1.23, 0.07)  # cm
VOLUME = 4.82, 7.76  # cm^3, measured and his
CENTRE = (-0.708, -0.685)  # m, from the top of the winch
SOURCE = "Westin (2018) Table 4"
STILL = "how fast the turbulence changes is not printed, and all water moves alike"
TIME = "water.turbulence.time_scale"
LINE = "cable.sections.line"
OTHERWISE = {
    "time scale of 0.03 s": {TIME: 0.03},
    "time scale of 0.1 s": {TIME: 0.1},
    "time scale of 0.25 s": {TIME: 0.25},
    "time scale of 1 s": {TIME: 1.0},
    "another seed": {"water.turbulence.seed": 2},
    "step of 5 ms": {"solver.tick": 0.005},
    "amplification by the flow of 1 s in place of 60 s": {"cable.mean_flow_time": 1.0},
    "0.011 in (60a), factor 1.527": {f"{LINE}.drag_law": "driscoll_nahon", f"{LINE}.drag_amplification": 1.527},
    "no amplification": {f"{LINE}.drag_amplification": 1.0},
}


class Swarm(NamedTuple):
    """Where the sphere was after the settling: path [n, 3] from the top of the winch [m], deviations along the axes of
    the ellipsoid [cm], its volume [cm^3], deviation of the tension [mN]."""

    path: np.ndarray
    deviations: np.ndarray
    volume: float
    tension: float


def drift(seconds: float, changes: dict) -> Swarm:
    """The sphere in the turbulent stream for ``seconds`` after the settling."""
    values = {"water.turbulence.deviation": DEVIATION, TIME: TIME_SCALE, "water.ramp": 5.0, **changes}
    scene = scene_with("flume", values)
    sim = started(scene)
    tick, frames = scene.solver.tick, []
    for _ in range(max(round((SETTLING + seconds) / (500 * tick)), 1)):
        frames.append(sim.run(500).copy())
    f = np.concatenate(frames).view(np.recarray)
    f = f[f.time > min(SETTLING, 0.2 * f.time[-1] * 1e-9) * 1e9]
    top = f.sheave_position.mean(axis=0) + (0.0, 0.0, scene.sheave.radius)
    path = f.body_position - top
    deviations = 100.0 * np.sqrt(np.linalg.eigvalsh(np.cov(path.T))[::-1])
    volume = 1e6 * ellipsoid_volume(f.time * 1e-9, path)[1]
    return Swarm(path, deviations, volume, 1e3 * float(f.tension.std()))


def experiment(progress, seconds: float, quick: bool = False) -> Result:
    """Table 4 with the chosen time scale, and with every choice made otherwise; quick: shorter, no choices."""
    progress("turbulent flume", 0, 1 + len(OTHERWISE))
    base, rows, choices = drift(seconds, {}), [], []
    for axis, ours, measured, his in zip(AXES, base.deviations.tolist(), MEASURED, HIS, strict=True):
        name = f"standard deviation along {axis}"
        rows.append(Comparison(name, "cm", ours, measured, abs(his - measured), SOURCE, STILL))
        rows.append(Comparison(f"{name}, beside the thesis's simulation", "cm", ours, his, None, SOURCE))
    allowed = VOLUME[1] - VOLUME[0]
    rows.append(Comparison("ellipsoid volume", "cm^3", base.volume, VOLUME[0], allowed, SOURCE, STILL))
    for name, k, place in (("x", 0, CENTRE[0]), ("z", 2, CENTRE[1])):
        rows.append(Comparison(f"mean place {name}", "m", float(base.path[:, k].mean()), place, 0.0048, SOURCE))
    rows.append(unjudged("standard deviation of the tension", "mN", base.tension, "not printed"))
    for i, (name, change) in enumerate(() if quick else OTHERWISE.items()):
        progress(name, 1 + i, 1 + len(OTHERWISE))
        other = drift(seconds, change)
        changed = dict(zip(AXES, (other.deviations - base.deviations).tolist(), strict=True))
        choices.append({"choice": name, **{f"{axis} in cm": value for axis, value in changed.items()}})
    return Result("turbulence", rows, choices, lambda folder: draw(base, folder / "turbulence.png"))


def draw(swarm: Swarm, path: Path) -> Path:
    """The path of the sphere from the side and from behind. RuntimeError where matplotlib is missing."""
    with canvas(
        path,
        (11.0, 5.5),
        "Path of the towed sphere, from the top of the winch",
        f"scene flume; measured mean: {SOURCE}",
    ) as figure:
        for axis, (k, name) in zip(figure.subplots(1, 2), ((0, "x"), (1, "y")), strict=True):
            axis.plot(swarm.path[:, k], swarm.path[:, 2], color=BLUE, lw=0.4, label="simulated")
            axis.plot(CENTRE[0] if k == 0 else -0.008, CENTRE[1], "+", color=ORANGE, ms=14, label="measured mean")
            axis.set_aspect("equal", "datalim")
            axis.set(xlabel=f"{name} [m]", ylabel="z [m]")
            axis.legend(loc="lower right")
    return path
