"""Where each way of the trade puts a towbody wrong: five situations of two tows against the simulated tow.

The simulated tow stands for the truth, so this says nothing of its own error at sea. The ways are given its depth as an
exact pressure sensor would; they lay the towbody against the course made good. docs/layback.md.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from math import asin, cos, pi
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.terminal import markdown_table
from cable_sim_ros.tools.ensemble.plan import Ranges
from cable_sim_ros.tools.layback.by_log import interval_of, simulated
from cable_sim_ros.tools.layback.laid import WAYS, Laid, Tow, laid, samples_of, static_place
from cable_sim_ros.tools.layback.tow_log import STEP, TowLog
from cable_sim_ros.tools.layback.ways import Table

from ..shipped import quiet
from . import Result, unjudged

WRONG = 0.2  # of the drag
DRAG_ALONE = Ranges(drag=WRONG, speed=0.0, current=0.0, current_turn_deg=0.0)
RADIUS = 0.75  # of the turn, over the cable out
SLOWED = 0.75  # of the speed
CROSS = 0.5  # m/s
HAULED, HAUL = 0.25, 0.5  # of the cable out; m/s
AFTER = 3.0  # times the time in which the ship goes the length of the cable
BEFORE = 60.0  # s of a steady tow
QUICK_SITUATION = "turn"
QUICK = f"the {QUICK_SITUATION} of the shorter tow alone"
SITUATIONS = {
    "straight": "steady, straight, still water",
    "turn": f"90 deg to starboard on {RADIUS:g} cable lengths",
    "speed": f"slows down to {100 * SLOWED:g} % within 60 s",
    "cross": f"steady in a current of {CROSS:g} m/s from the side, crabbing along its line",
    "winch": f"hauls {100 * HAULED:g} % of the cable at {HAUL:g} m/s",
}


class Studied(NamedTuple):
    """Distances [m] of each way from the simulated towbody, mean and largest from the event on; and of the tow with a
    wrong drag, with the interval that the drag alone gives; cpu: s; shown: with the interval that a user has."""

    tow: str
    situation: str
    ways: dict[str, tuple[float, float]]
    wrong: tuple[float, float]
    interval: float
    cpu: float
    shown: Callable[[], Laid]


def tows() -> dict[str, Scene]:
    """The two tows by name."""
    shallow = load_scene("side_scan")
    deep = override(shallow, {"cable.sections.armoured.length": 1200.0, "winch.scope": 1000.0, "ship.tow_speed": 1.54})
    return {"200 m at 4 kn": shallow, "1000 m at 3 kn": deep}


def log_of(situation: str, cable: float, speed: float) -> TowLog:
    """The log of a situation whose event begins after BEFORE."""
    pass_by = cable / speed
    event = {"turn": 0.5 * pi * RADIUS * pass_by, "speed": 60.0, "winch": HAULED * cable / HAUL}.get(situation, 0.0)
    t = np.arange(0.0, BEFORE + event + AFTER * pass_by, STEP)
    gone = np.clip((t - BEFORE) / max(event, 1.0), 0.0, 1.0)
    yaw, fast, out = np.zeros_like(t), np.full_like(t, speed), np.full_like(t, cable)
    course = yaw.copy()
    if situation == "turn":
        yaw = course = -0.5 * pi * gone
    elif situation == "speed":
        fast *= 1.0 - (1.0 - SLOWED) * gone
    elif situation == "cross":
        yaw = np.full_like(t, -asin(CROSS / speed))  # against a current that sets to port
        fast *= cos(yaw[0])
    elif situation == "winch":
        out *= 1.0 - HAULED * gone
    return log_along(situation, t, fast, yaw, course, out)


def log_along(
    name: str, t: np.ndarray, speed: np.ndarray, yaw: np.ndarray, course: np.ndarray, cable: np.ndarray
) -> TowLog:
    """The log of a ship that goes at a speed [m/s] along a course [rad], each STEP."""
    rate = speed[:, None] * np.column_stack([np.cos(course), np.sin(course)])
    track = np.vstack([np.zeros(2), np.cumsum(0.5 * STEP * (rate[1:] + rate[:-1]), axis=0)])
    return TowLog(name, t, cable, track, yaw, None, None, None)


def table_of(scene: Scene) -> Table:
    """The static tows that `cable-sim table` lays out, over cable out and speed."""
    cables, speeds = (np.linspace(0.6, 1.1, 6) * at for at in (scene.winch.scope, scene.ship.tow_speed))
    rows = [[static_place(scene, Tow(cable, speed, 0.0, 0.0)).layback for speed in speeds] for cable in cables]
    return Table(cables, speeds, np.array(rows))


def study(tow: str, scene: Scene, situation: str) -> Studied:
    """Simulate one situation, and again with a wrong drag."""
    begun = time.process_time()
    table = table_of(scene)
    if situation == "cross":
        scene = override(scene, {"water.current": [0.0, CROSS]})
    log = log_of(situation, scene.winch.scope, scene.ship.tow_speed)
    true = simulated(log, scene, log.cable)
    samples = samples_of(true.run.frames[true.first :].view(np.recarray), STEP)
    one = laid(scene, samples, DRAG_ALONE, table=table)
    after = samples.seconds >= BEFORE
    ways = {name: _apart(places - samples.fish, after) for name, places in one.places.items()}
    if situation == "cross":
        pointed = laid(scene, samples, Ranges(drag=0.0, speed=0.0, current=0.0, current_turn_deg=0.0), by_heading=True)
        ways["pythagoras, against the heading"] = _apart(pointed.places["pythagoras"] - samples.fish, after)
    other = simulated(log, scene, log.cable, drag=1.0 + WRONG)
    wrong = samples_of(other.run.frames[other.first :].view(np.recarray), STEP)
    n = min(len(wrong.fish), len(samples.fish))
    off = _apart(wrong.fish[:n] - samples.fish[:n], after[:n])
    spread = float(np.hypot(*one.band[after, 1:3].T).max())

    def shown() -> Laid:
        return laid(scene, samples, Ranges(), copied=lambda: interval_of(true, Ranges()), table=table)

    return Studied(tow, situation, ways, off, spread, time.process_time() - begun, shown)


def _apart(gap: np.ndarray, after: np.ndarray) -> tuple[float, float]:
    size = np.hypot(*gap[after].T)
    return float(np.nanmean(size)), float(np.nanmax(size))


def experiment(progress, quick: bool = False) -> Result:
    """All situations of both tows; quick: the turn of the shorter tow."""
    found, all_of = [], [(tow, scene, name) for tow, scene in tows().items() for name in SITUATIONS]
    if quick:
        all_of = [one for one in all_of if one[2] == QUICK_SITUATION][:1]
    with quiet():
        for k, (tow, scene, name) in enumerate(all_of):
            progress(f"{tow}, {name}", k, len(all_of))
            found.append(study(tow, scene, name))
    rows = [
        unjudged(f"{one.tow}, {one.situation}: {way}, {what}", "m", value, "simulated tow")
        for one in found
        for way, pair in {**one.ways, f"drag {100 * WRONG:+g} %": one.wrong}.items()
        for what, value in zip(("mean", "largest"), pair, strict=True)
    ]

    def plot(folder: Path) -> Path:
        from cable_sim_ros.tools.layback.picture import plot as draw

        turn = next(one for one in found if one.situation == QUICK_SITUATION)
        with quiet():
            return draw(turn.shown(), folder / "layback.png", f"side_scan, {turn.tow}: turn of 90 deg", False)

    def shown() -> list[str]:
        return markdown([one for one in found if one.tow != found[0].tow])  # the first stands in docs/layback.md

    return Result("layback", rows, [], plot, tables=lambda: markdown(found), shown=shown)


def markdown(found: list[Studied]) -> list[str]:
    """A table for each tow: distance from the simulated towbody, mean and largest, m."""
    parts = []
    for tow in dict.fromkeys(one.tow for one in found):
        mine = [one for one in found if one.tow == tow]
        lines = [["way", *(one.situation for one in mine)]]
        names = [*WAYS, *(name for one in mine for name in one.ways if name not in WAYS)]
        for name in dict.fromkeys(names):
            lines.append([f"`{name}`", *(_pair(one.ways[name]) if name in one.ways else "" for one in mine)])
        lines.append([f"simulated, drag {100 * WRONG:+g} %", *(_pair(one.wrong) for one in mine)])
        lines.append(["its interval", *(f"{one.interval:.1f}" for one in mine)])
        parts.append(f"{tow}, `side_scan`: mean / largest distance from the simulated towbody, m")
        parts.append(markdown_table(lines))
    return parts


def _pair(pair: tuple[float, float]) -> str:
    return f"{pair[0]:.1f} / {pair[1]:.1f}"
