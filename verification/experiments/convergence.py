"""Convergence of mesh and step in the manner of Westin's figures 20, 33, 34 and 44 to 46, with CPU times.

He reads convergence off curves that lie on each other; here it is the difference to the finest of each family.
Figure 46, the load over the sheave, is in `full_scale`. CPU times are of this machine and of one core; his, in the
legends of his figures, are not legible.
"""

from __future__ import annotations

import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.plots.run import BLUE, ORANGE, canvas
from cable_sim_ros.sim.inputs import ShipMotion
from cable_sim_ros.sim.simulator import Simulator
from cable_sim_ros.terminal import markdown_table

from ..shipped import scene_with, started
from . import Comparison, Result, unjudged
from .flume import CHOSEN as WINCH
from .flume import moved, scene_of
from .full_scale import running
from .pulley import CHOSEN, ROPE, swing
from .workers import Over, here, warm

SOURCE = "Westin (2018)"
HEAVE, PERIOD, SAMPLE = 1.0, 8.0, 0.02  # m, s, s: of the sheave at full scale; his motion is only plotted
SECONDS, QUICK_SECONDS = 20.0, 4.0  # his, of figures 33 to 45
LONGEST_SWING = 1.0  # s, of the pulley: its runs part later by what they began with
QUICK = f"{QUICK_SECONDS:g} s of {SECONDS:g} s"
ROPES, LINES, STEPS = (10, 20, 40, 80), (4, 8, 12, 16, 32), (0.1, 0.05, 0.02, 0.01, 0.005)
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
    why: str = ""
    curves: dict[str, Curve] = {}


def timed(elements: int, run: Callable[[], np.ndarray]) -> Curve:
    """Samples and CPU time of a run, kernels loaded before; the static start of a tow lies before it."""
    warm()
    begun = time.process_time()
    samples = run()
    return Curve(samples, elements, time.process_time() - begun)


def heaved(sim: Simulator, seconds: float) -> np.ndarray:
    """Depth of the towbody [m] and tension [N] each 0.1 s, the ship heaving by a sinus after a start of a period."""
    tick, speed = sim.scene.solver.tick, sim.scene.ship.tow_speed
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
    return np.column_stack([-f.body_position[kept, 2], f.tension[kept]])


def tow(elements: dict[str, int] | None, seconds: float, tick: float = 0.02) -> Curve:
    """His tow with the cable running through the mesh, so that bare and faired elements alone are varied; the winch
    held, for a compensated towbody hardly moves."""
    sim = started(scene_with(running(elements, tick), {"setpoint.algorithm": "hold"}))
    return timed(sim.nodes - 1, lambda: heaved(sim, seconds))


def rope(elements: int, seconds: float) -> Curve:
    """Wrap angle [deg] and tension [N] of the fixed pulley, with that many elements on its rope."""

    def swung() -> np.ndarray:
        found = swing(1, min(seconds, LONGEST_SWING), CHOSEN._replace(element=ROPE / elements))
        return np.column_stack([found.wrap, found.smooth])

    return timed(elements, swung)


def sphere(elements: int, seconds: float) -> Curve:
    """Departure angle [mrad] and height [mm] in the flume under the simplified set-point, without turbulence; that many
    elements on the line out of the sheave."""
    sim = started(
        scene_with(scene_of("simplified_sheave", None, WINCH), {"mesh.sections": {"line": {"elements": elements}}})
    )

    def drifted() -> np.ndarray:
        f = moved(sim, seconds, WINCH)
        return np.column_stack([1e3 * f.departure_angle, 1e3 * f.body_position[:, 2]])

    return timed(sim.nodes - 1, drifted)


def families(seconds: float, progress, over: Over = here) -> list[Family]:
    """All of them; over: what runs are handed to."""
    tow_of = (("depth of the towbody", "m"), ("tension", "N"))
    rope_of = (("wrap angle", "deg"), ("tension below 10 Hz", "N"))
    line_of = (("departure angle", "mrad"), ("height of the sphere", "mm"))
    leave = f"{SOURCE} 4.3.2: 12 against 16 elements leave 0.27 mrad, 0.05 mm"
    contact = "The angle goes from one contact point to the next, 1 mrad: largest is one such step a tick apart"
    asked = (
        (
            Family("fig. 20, pulley", rope_of, f"{SOURCE} 4.1: 10 are enough"),
            rope,
            {f"{n} elements on the rope": (n, seconds) for n in ROPES},
        ),
        (
            Family("figs. 33, 34, flume", line_of, leave, contact),
            sphere,
            {f"{n} elements of the line": (n, seconds) for n in LINES},
        ),
        (
            Family("fig. 44, full scale", tow_of, f"{SOURCE} 5.4: six are enough"),
            tow,
            {f"{n} faired elements": ({"bare": BARES[-1], "faired": n}, seconds) for n in FAIREDS},
        ),
        (
            Family("fig. 45, full scale", tow_of, f"{SOURCE} 5.4: eight are enough"),
            tow,
            {f"{n} bare elements": ({"bare": n, "faired": FAIREDS[-1]}, seconds) for n in BARES},
        ),
        (
            Family("step, full scale", tow_of, "No figure of his varies the step"),
            tow,
            {f"steps of {1e3 * h:g} ms": (None, seconds, h) for h in STEPS},
        ),
    )
    # the finest of each last in its family, and first to be run: what takes longest is begun first
    handed = [iter(over(run, list(runs.values())[::-1])) for _, run, runs in asked]
    found, total = [], sum(len(runs) for _, _, runs in asked)
    for (family, _, runs), curves in zip(asked, handed, strict=True):
        kept = {}
        for name in list(runs)[::-1]:
            progress(f"{family.name}, {name}", sum(len(one.curves) for one in found) + len(kept), total)
            kept[name] = next(curves)
        found.append(family._replace(curves={name: kept[name] for name in runs}))
    return found


def apart(family: Family) -> dict[str, np.ndarray]:
    """Largest and rms difference to the finest [2, quantities] of every other run of a family."""
    finest, found = list(family.curves.values())[-1], {}
    for name, curve in list(family.curves.items())[:-1]:
        n = min(len(curve.samples), len(finest.samples))
        off = np.abs(curve.samples[:n] - finest.samples[:n])
        found[name] = np.stack([off.max(axis=0), np.sqrt(np.mean(off**2, axis=0))])
    return found


def rows_of(family: Family) -> list[Comparison]:
    """Largest and rms difference of every run to the finest, of every quantity."""
    return [
        unjudged(f"{family.name}, {name}: {what}, {how}", unit, value, family.source, family.why)
        for name, off in apart(family).items()
        for (what, unit), pair in zip(family.quantities, off.T.tolist(), strict=True)
        for how, value in zip(("largest", "rms"), pair, strict=True)
    ]


def experiment(progress, seconds: float, quick: bool = False, over: Over = here) -> Result:
    """Every family; seconds: of each run, of the pulley at most 1 s; quick: 4 s; over: what runs are handed to."""
    found = families(seconds, progress, over)
    rows = [row for family in found for row in rows_of(family)]

    def tables() -> list[str]:
        parts = [
            f"Largest difference to the finest of each family in {seconds:g} s (pulley: at most {LONGEST_SWING:g} s),\n"
            "in brackets its rms; CPU time of the steps alone, of the pulley with its start."
        ]
        for family in found:
            off = apart(family)
            heads = [f"{what} [{unit}]" for what, unit in family.quantities]
            lines = [(family.name, "elements", *heads, "CPU [s]")]
            for name, curve in family.curves.items():
                cells = [f"{a:.2g} ({b:.2g})" for a, b in off[name].T] if name in off else ["-"] * len(heads)
                lines.append((name, str(curve.elements), *cells, f"{curve.cpu:.2f}"))
            said = f"{family.source}{f'. {family.why}' if family.why else ''}."
            parts += [markdown_table(lines), textwrap.fill(said, 100)]
        return parts

    return Result("convergence", rows, [], lambda folder: draw(found, folder / "convergence.png"), tables=tables)


def draw(found: list[Family], path: Path) -> Path:
    """Difference over elements or step of every family. RuntimeError where matplotlib is missing."""
    with canvas(
        path,
        (14.0, 8.0),
        "Convergence of mesh and step",
        "difference to the finest of each family: largest (solid) and rms (dashed)",
    ) as figure:
        axes = figure.subplots(2, 3).ravel()
        for axis, family in zip(axes, found):
            off = np.array(list(apart(family).values()))
            for k, colour in enumerate((BLUE, ORANGE)):
                what, unit = family.quantities[k]
                axis.plot(range(len(off)), off[:, 0, k], "o-", color=colour, label=f"{what} [{unit}]")
                axis.plot(range(len(off)), off[:, 1, k], "--", color=colour)
            names = [name.removeprefix("steps of ").removesuffix(" of the line") for name in family.curves]
            names = [name.replace(" elements on the rope", "").replace(" elements", "") for name in names]
            axis.set_xticks(range(len(off)), names[:-1], fontsize="small")
            axis.set(yscale="log", title=family.name)
            axis.legend(fontsize="small")
        axes[-1].set_visible(False)
    return path
