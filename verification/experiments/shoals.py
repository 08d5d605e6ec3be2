"""Does a towbody strike where `cable-sim clear` said that it clears? Synthetic passes whose truth is another tow.

Each pass: a steady tow, soundings of one or two shoals ahead, and what the tool says to both. The truth has another
drag and speed and another depth of the ground, drawn from the ranges that the tool allows for (normal, half-widths are
95 %; of the ground one error a pass, as of a tide), and does what was advised at the last moment that was given.
"""

from __future__ import annotations

from math import ceil
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.terminal import markdown_table
from cable_sim_ros.tools.clear.advice import Allowances, Passage, actions_of, advise
from cable_sim_ros.tools.clear.profile import Profile, profile_of
from cable_sim_ros.tools.clear.towed import Action, Copy, Tow, copies_of, sail
from cable_sim_ros.tools.ensemble.plan import with_drag

from ..shipped import quiet
from . import Comparison, Result
from .workers import Over, here

SCENES = {"side_scan": (100.0, 250.0), "side_scan_fish": (100.0, 250.0), "full_scale": (200.0, 500.0)}  # scope, m
SETS = {  # name -> what is allowed for, and drawn from
    "as assumed": Allowances(),
    "calibrated": Allowances(drag=0.05, speed=0.05),
}
TOWS, PASSES, SEED = 4, 125, 5
QUICK = f"one tow with 20 of {len(SETS) * TOWS * PASSES} passes"
MARGIN, ALLOWED = 5.0, 5.0  # m; % of false alarms
COVERAGE = 1.96


class Passed(NamedTuple):
    """One pass: what was said; least clearance of the truth held and as advised [m], None: nothing was to be done."""

    name: str
    state: str
    way: str
    held: float
    advised: float | None

    @property
    def end(self) -> float:
        """Clearance of the truth that follows the advice [m]."""
        return self.held if self.advised is None else self.advised


def tow_of(number: int) -> Tow:
    """A tow of the study."""
    chance = np.random.default_rng([SEED, number])
    name = list(SCENES)[number % len(SCENES)]
    return Tow(
        load_scene(name), chance.uniform(*SCENES[name]), chance.uniform(1.5, 2.5), chance.uniform(0.3, 1.0), 0.02
    )


def ground_of(chance: np.random.Generator, depth: float, behind: float) -> Profile:
    """Ground with one or two shoals, their tops at 0.3 to 1.8 times the depth of the towbody [m]."""
    distance = np.arange(behind - 50.0, 1400.0, chance.uniform(10.0, 40.0))
    flat = depth * chance.uniform(1.9, 3.0)
    ground = np.full_like(distance, flat)
    for _ in range(1 + int(chance.integers(2))):
        top, at, wide = depth * chance.uniform(0.3, 1.8), chance.uniform(200.0, 1000.0), chance.uniform(40.0, 300.0)
        ground = np.minimum(ground, flat - (flat - top) * np.exp(-(((distance - at) / wide) ** 2)))
    return profile_of(distance, ground + chance.normal(0.0, 0.3, len(distance)), 100.0, "pass")


def passed(name: str, tow: Tow, copies: dict[str, Copy], known: Allowances, number: tuple[int, int]) -> Passed:
    """One pass, simulated as it truly goes."""
    chance = np.random.default_rng([SEED, *number, 1])
    itself = copies["itself"]
    ground = ground_of(chance, itself.depth, itself.behind)
    passage = Passage(copies, ground, MARGIN, known)
    report = advise(passage)
    drag, speed, tide = (chance.normal(0.0, 1.0 / COVERAGE, 3) * (known.drag, known.speed, 1.0)).tolist()
    true = ground._replace(depth=ground.depth + tide * np.hypot(known.sounding, known.sounding_share * ground.depth))
    scene, sailed = with_drag(tow.scene, 1.0 + drag), itself.tow._replace(speed=tow.speed + speed)
    seconds = int((ground.distance[-1] - itself.behind) / sailed.speed) + 1

    def least(action: Action, begin: float, out: float | None) -> float:
        out = None if out is None else out - begin + 1.0  # it is at rest before
        way = sail(sailed, action, 1.0, out, ceil(seconds - begin) + 1, scene)
        return min(of(way.depth, way.place + sailed.speed * (begin - 1.0)), steady(t[t <= begin]))

    def of(depth: np.ndarray, place: np.ndarray) -> float:
        gap = true.ground(place) - depth
        return float(gap[np.isfinite(gap)].min())

    def steady(t: np.ndarray) -> float:
        return of(0.0 * t + rest.depth[0], rest.place[0] + sailed.speed * t)

    rest = sail(sailed, Action(0.0, 0.0), 0.0, None, 1, scene)  # held it stays as it is
    t = np.arange(0.0, seconds, 0.5)
    ways = [way for way in report["ways"] if way["clears"]]
    held, advised, way = steady(t), None, ""
    if ways:
        one = ways[int(chance.integers(len(ways)))]
        action = Action(one["haul_m"], one["speed_more_mps"])
        way, advised = one["way"], least(action, one["begin_by_s"], one["let_out_from_s"])
    return Passed(f"{name} {number[0]}.{number[1]}", report["state"], way, held, advised)


def study(name: str, number: int, passes: int) -> list[Passed]:
    """The passes of one tow."""
    known = SETS[name]
    with quiet():
        tow = tow_of(number)
        actions = actions_of(tow, 0.25 * tow.scope, tow.speed + 0.5 if number % 2 else None)  # or the winch alone
        copies = copies_of(tow, actions, known.drag, known.speed, lambda *_: None)
        return [passed(name, tow, copies, known, (number, k)) for k in range(passes)]


def experiment(progress, quick: bool = False, over: Over = here) -> Result:
    """All passes; over: what tows are handed to."""
    asked = [(name, k, PASSES) for name in SETS for k in range(TOWS)]
    if quick:
        asked = [("calibrated", 0, 20)]
    found: list[Passed] = []
    for k, one in enumerate(over(study, asked)):
        found += one
        progress("shoals", k + 1, len(asked))
    rows = []
    for name in dict.fromkeys(name for name, *_ in asked):
        mine = [one for one in found if one.name.startswith(name)]
        cleared = [one for one in mine if one.state in ("clear", "act")]
        strikes = float(sum(one.end <= 0.0 for one in cleared))
        alarms = 100.0 * sum(false_alarm(one) for one in mine) / len(mine)
        kept = 100.0 * sum(one.end >= MARGIN for one in cleared) / max(len(cleared), 1)
        why = f"of {len(cleared)} passes; {kept:.1f} % keep the whole margin"
        rows.append(Comparison(f"{name}: strikes where it clears", "1", strikes, 0.0, 0.0, "none allowed", why))
        why = f"of {len(mine)} passes; an alarm: act or cannot, where the truth held keeps {MARGIN:g} m"
        rows.append(Comparison(f"{name}: false alarms", "%", alarms, 0.0, ALLOWED, "below 5 %", why))

    def page() -> list[str]:
        return markdown(found)

    return Result("shoals", rows, [], lambda folder: _plot(found, folder), tables=page, shown=page)


def false_alarm(one: Passed) -> bool:
    """Was it told to act where nothing was needed?"""
    return one.state in ("act", "cannot") and one.held >= MARGIN


def markdown(found: list[Passed]) -> list[str]:
    """Counts by what was said, and every miss: a strike after it said clear."""
    lines = [["set", "said", "passes", "held strikes", "strikes as advised", "below the margin", "false alarms"]]
    for name in dict.fromkeys(one.name.rpartition(" ")[0] for one in found):
        for state in ("clear", "act", "cannot"):
            mine = [one for one in found if one.name.startswith(name) and one.state == state]
            followed = state != "cannot"
            lines.append(
                [
                    name,
                    state,
                    str(len(mine)),
                    str(sum(one.held <= 0.0 for one in mine)),
                    str(sum(one.end <= 0.0 for one in mine)) if followed else "",
                    str(sum(one.end < MARGIN for one in mine)) if followed else "",
                    str(sum(false_alarm(one) for one in mine)) if state != "clear" else "",
                ]
            )
    missed = [one for one in found if one.state != "cannot" and one.end <= 0.0]
    told = [f"{one.name} ({one.state} {one.way}): {one.end:.2f} m" for one in missed]
    return [
        f"Margin {MARGIN:g} m, to the last moment that was given; strikes after it said clear: "
        + ("none." if not told else "; ".join(told) + "."),
        markdown_table(lines),
    ]


def _plot(found: list[Passed], folder: Path) -> Path:
    from cable_sim_ros.plots.run import canvas

    path = folder / "shoals.png"
    with canvas(path, (12.0, 7.0), "Passes over shoals: clearance of the truth", "cable-sim validate shoals") as figure:
        axes = figure.subplots()
        for state, colour in (("clear", "#1a9850"), ("act", "#0b3c5d"), ("cannot", "#c23b33")):
            mine = [one for one in found if one.state == state]
            axes.plot([one.held for one in mine], [one.end for one in mine], ".", color=colour, label=state)
        axes.axhline(MARGIN, color="#5c6873", ls="--", label="margin")
        axes.axhline(0.0, color="#222222")
        axes.set_xlabel("held as it is [m]")
        axes.set_ylabel("as advised [m]")
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    return path
