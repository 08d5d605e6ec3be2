"""Convergence of mesh and step in the manner of Westin's figures 20, 33, 34 and 44 to 46, with CPU times.

He reads convergence off curves that lie on each other; here it is the largest difference to the finest of each family.
Figure 46, the load over the sheave, is in `full_scale`. CPU times are of this machine and of one core; his, in the
legends of his figures, are not legible.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ...io.scenes.load import SceneWarning
from ...sim.inputs import ShipMotion
from ...sim.simulator import Simulator
from . import Comparison, Result
from .flume import CHOSEN as WINCH
from .flume import moved, scene_of
from .full_scale import quiet, running
from .pulley import CHOSEN, ROPE, swing

SOURCE = "Westin (2018)"
HEAVE, PERIOD, SAMPLE = 1.0, 8.0, 0.02  # m, s, s: of the sheave at full scale; his motion is only plotted
SECONDS = 20.0  # his, of figures 33 to 45
ROPES, POSITIONS, STEPS = (10, 20, 40, 80), (1e-2, 3e-3, 1e-3, 3e-4), (0.1, 0.05, 0.02, 0.01, 0.005)
BARES, FAIREDS = (4, 6, 8, 10, 20), (4, 6, 8, 16)


class Curve(NamedTuple):
    """One run: samples [n, quantities], elements, CPU time [s]."""

    samples: np.ndarray
    elements: int
    cpu: float


class Family(NamedTuple):
    """Runs by what is varied, coarse to fine; names, units of the quantities; what he says."""

    name: str
    quantities: tuple[tuple[str, str], ...]
    source: str
    why: str
    curves: dict[str, Curve]


def timed(run: Callable[[], tuple[np.ndarray, int]]) -> Curve:
    """Samples, elements and the CPU time of a run."""
    start = time.process_time()
    samples, elements = run()
    return Curve(samples, elements, time.process_time() - start)


def heaved(scene, seconds: float) -> tuple[np.ndarray, int]:
    """Depth of the towbody [m] and tension [N] each 0.1 s, the ship heaving by a sinus after a start of a period."""
    sim = Simulator(scene)
    sim.start()
    tick, speed = scene.solver.tick, scene.ship.tow_speed
    count, block = round(seconds / tick), max(round(0.5 / tick), 1)
    w, frames, pushed, level = 2.0 * np.pi / PERIOD, [], 0, (0.0, 0.0, 0.0)
    for k in range(0, count, block):
        while SAMPLE * pushed < (k + block + 2) * tick:
            pushed += 1
            t = SAMPLE * pushed
            x = min(t / PERIOD, 1.0)
            grown, rate = x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 30.0 * x**2 * (1.0 - x) ** 2 / PERIOD
            heave, up = HEAVE * grown * np.sin(w * t), HEAVE * (rate * np.sin(w * t) + grown * w * np.cos(w * t))
            place, speeds = (speed * t, 0.0, heave), (speed, 0.0, up)
            sim.push(ShipMotion(time_ns=round(t * 1e9), position=place, velocity=speeds, attitude=level, rate=level))
        frames.append(sim.run(min(block, count - k)).copy())
    f = np.concatenate(frames).view(np.recarray)
    every = max(round(0.1 / tick), 1)
    kept = slice(every - 1, None, every)
    return np.column_stack([-f.body_position[kept, 2], f.tension[kept]]), sim.nodes - 1


def tow(elements: dict[str, int] | None, seconds: float, tick: float = 0.02) -> Curve:
    """His tow with the cable running through the mesh, so that bare and faired elements alone are varied."""
    scene = running(elements, tick)
    return timed(lambda: heaved(scene, seconds))


def families(seconds: float, progress) -> list[Family]:
    """All of them."""
    names = "ropes", "flume", "faired", "bare", "steps"

    def said(k: int) -> None:
        progress(names[k], k, len(names))

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SceneWarning)
        said(0)
        tow_of = (("depth of the towbody", "m"), ("tension", "N"))
        ropes = {}
        for n in ROPES:
            one = timed(lambda n=n: (_swing(n, min(seconds, 1.0)), n))
            ropes[f"{n} elements on the rope"] = one
        said(1)
        sphere = {f"position within {1e3 * p:g} mm": timed(lambda p=p: _flume(p, seconds)) for p in POSITIONS}
        said(2)
        faired = {f"{n} faired elements": tow({"bare": BARES[-1], "faired": n}, seconds) for n in FAIREDS}
        said(3)
        bare = {f"{n} bare elements": tow({"bare": n, "faired": FAIREDS[-1]}, seconds) for n in BARES}
        said(4)
        steps = {f"steps of {1e3 * h:g} ms": tow(None, seconds, h) for h in STEPS}
    none = "no other figure of his says it"
    return [
        Family(
            "fig. 20, pulley",
            (("wrap angle", "deg"), ("tension below 10 Hz", "N")),
            f"{SOURCE} 4.1: 10 are enough",
            "",
            ropes,
        ),
        Family(
            "figs. 33, 34, flume",
            (("departure angle", "mrad"), ("height of the sphere", "mm")),
            f"{SOURCE} 4.3.2: 12 against 16 elements leave 0.27 mrad, 0.05 mm",
            "",
            sphere,
        ),
        Family("fig. 44, full scale", tow_of, f"{SOURCE} 5.4: six are enough", "", faired),
        Family("fig. 45, full scale", tow_of, f"{SOURCE} 5.4: eight are enough", "", bare),
        Family("step, full scale", tow_of, none, "", steps),
    ]


def _swing(elements: int, seconds: float) -> np.ndarray:
    found = swing(1, seconds, CHOSEN._replace(element=ROPE / elements))
    return np.column_stack([found.wrap, found.smooth])


def _flume(position: float, seconds: float) -> tuple[np.ndarray, int]:
    """Departure angle [mrad] and height [mm] under the simplified set-point, without turbulence."""
    scene = quiet(scene_of("simplified_sheave", 1, WINCH), {"accuracy.position": position})
    f, sim = moved(scene, seconds, WINCH)
    return np.column_stack([1e3 * f.departure_angle, 1e3 * f.body_position[:, 2]]), sim.nodes - 1


def rows_of(family: Family) -> list[Comparison]:
    """Largest difference of every run to the finest, of every quantity."""
    finest = list(family.curves.values())[-1]
    rows = []
    for name, curve in list(family.curves.items())[:-1]:
        n = min(len(curve.samples), len(finest.samples))
        apart = np.abs(curve.samples[:n] - finest.samples[:n]).max(axis=0)
        for (what, unit), value in zip(family.quantities, apart.tolist(), strict=True):
            rows.append(
                Comparison(f"{family.name}, {name}: {what}", unit, value, None, None, family.source, family.why)
            )
    return rows


def experiment(duration: float | None, progress, quick: bool = False) -> Result:
    """Every family; duration [s]: of each run, of the pulley at most 1 s; quick: 4 s."""
    seconds = (4.0 if quick else SECONDS) if duration is None else duration
    found = families(seconds, progress)
    rows = [row for family in found for row in rows_of(family)]

    def tables() -> list[str]:
        parts = [f"Largest difference to the finest of each family in {seconds:g} s (pulley: at most 1 s)."]
        for family in found:
            finest = list(family.curves.values())[-1].samples
            heads = [f"{what} [{unit}]" for what, unit in family.quantities]
            lines = [
                "| " + " | ".join((family.name, "elements", *heads, "CPU [s]")) + " |",
                "|---" * (3 + len(heads)) + "|",
            ]
            for name, curve in family.curves.items():
                n = min(len(curve.samples), len(finest))
                apart = np.abs(curve.samples[:n] - finest[:n]).max(axis=0)
                cells = ["-" if curve.samples is finest else f"{x:.2g}" for x in apart]
                lines.append("| " + " | ".join((name, str(curve.elements), *cells, f"{curve.cpu:.2f}")) + " |")
            parts += ["\n".join(lines), f"{family.source}."]
        return parts

    return Result("convergence", rows, [], lambda folder: draw(found, folder / "convergence.png"), tables=tables)


def draw(found: list[Family], path: Path) -> Path:
    """Difference over elements or step of every family. RuntimeError where matplotlib is missing."""
    from ...plots.canvas import canvas
    from ...plots.run import BLUE, ORANGE

    with canvas(path, (14.0, 8.0), "Convergence of mesh and step", "to the finest of each family") as figure:
        axes = figure.subplots(2, 3).ravel()
        for axis, family in zip(axes, found):
            curves = list(family.curves.values())
            finest = curves[-1].samples
            n = min(len(c.samples) for c in curves)
            apart = np.array([np.abs(c.samples[:n] - finest[:n]).max(axis=0) for c in curves[:-1]])
            for k, colour in enumerate((BLUE, ORANGE)):
                what, unit = family.quantities[k]
                axis.plot(range(len(apart)), apart[:, k], "o-", color=colour, label=f"{what} [{unit}]")
            names = [name.removeprefix("position within ").removeprefix("steps of ") for name in family.curves]
            names = [name.replace(" elements on the rope", "").replace(" elements", "") for name in names]
            axis.set_xticks(range(len(apart)), names[:-1], fontsize="small")
            axis.set_yscale("log")
            axis.set_title(family.name)
            axis.legend(fontsize="small")
        axes[-1].set_visible(False)
    return path
