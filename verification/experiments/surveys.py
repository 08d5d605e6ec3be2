"""Does the 95 % interval of a layback hold the truth while a tow manoeuvres? Synthetic surveys of five kinds.

A survey is a log of side_scan whose sizes are drawn: cable, speed, and those of its manoeuvre. Its truths are tows
under the same log whose drag, speed and current are drawn from the ranges that the interval assumes (normal,
half-widths of 95 %); GEOMETRIES logs a kind with TRUTHS truths each. Counted is every second from the manoeuvre on,
and of a line all.
The model is the same in truth and interval, so this says nothing of the model. Nothing was adjusted to it.
"""

from __future__ import annotations

import textwrap
from math import pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy import stats

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.terminal import markdown_table
from cable_sim_ros.tools.ensemble.plan import EnsemblePlan, Ranges, draw_of
from cable_sim_ros.tools.layback import by_log
from cable_sim_ros.tools.layback.laid import laid
from cable_sim_ros.tools.layback.tow_log import STEP, TowLog
from cable_sim_ros.tools.layback.towed import Copied, Towed

from ..shipped import quiet
from . import Comparison, Result
from .layback import AFTER, BEFORE, log_along
from .workers import Over, here

KINDS = {
    "line": "steady, straight, still water",
    "turn": "45 to 180 deg on 0.4 to 1.5 cable lengths",
    "stop": "slows down to 0 to 0.5 m/s within 30 to 90 s, lies for 60 to 180 s, goes on",
    "current": "0.1 to 0.4 m/s, known, that turns by up to 90 deg and grows or falls by up to half in 120 to 600 s",
    "winch": "hauls or pays out 10 to 40 % of the cable at 0.2 to 0.8 m/s",
}
GEOMETRIES, TRUTHS, SEED = 10, 10, 1
QUICK_KIND, QUICK_TRUTHS = "turn", 8
QUICK = f"one {QUICK_KIND} with {QUICK_TRUTHS} truths of {len(KINDS) * GEOMETRIES * TRUTHS} surveys"
PARTS = ("layback", "along", "across", "depth", "heading")
LEVEL, ALLOWED = 95.0, 2.0  # %
RANGES = Ranges()


class Surveyed(NamedTuple):
    """Share of the time inside [truths, PARTS] of one log: of the interval, and of that of steady tows alone; copies:
    share of the time whose interval is that of copies; width: mean half-widths [PARTS]."""

    kind: str
    inside: np.ndarray
    steady: np.ndarray
    copies: float
    width: np.ndarray


def survey_of(kind: str, number: int) -> tuple[Scene, TowLog]:
    """The log of a survey, and the scene that is towed."""
    chance = np.random.default_rng([SEED, list(KINDS).index(kind), number])
    cable, speed = chance.uniform(100.0, 200.0), chance.uniform(1.5, 2.5)
    size, rate, more, side = chance.random(4)
    sign = 1.0 if side < 0.5 else -1.0
    event = {
        "turn": 0.25 * pi * (1.0 + 3.0 * size) * (0.4 + 1.1 * rate) * cable / speed,
        "stop": 2.0 * (30.0 + 60.0 * rate) + 60.0 + 120.0 * more,
        "current": 120.0 + 480.0 * rate,
        "winch": (0.1 + 0.3 * size) * cable / (0.2 + 0.6 * rate),
    }.get(kind, 0.0)
    t = np.arange(0.0, BEFORE + event + AFTER * cable / speed, STEP)
    gone = np.clip((t - BEFORE) / max(event, 1.0), 0.0, 1.0)
    yaw, fast, out = np.zeros_like(t), np.full_like(t, speed), np.full_like(t, cable)
    values: dict[str, Any] = {}
    if kind == "turn":
        yaw = sign * 0.25 * pi * (1.0 + 3.0 * size) * gone
    elif kind == "stop":
        ramp = (30.0 + 60.0 * rate) / event
        fast = np.interp(gone, [0.0, ramp, 1.0 - ramp, 1.0], [speed, 0.5 * size, 0.5 * size, speed])
    elif kind == "winch":
        out = out * (1.0 + sign * (0.1 + 0.3 * size) * gone)
    elif kind == "current":
        towards, strong = 2.0 * pi * size, 0.1 + 0.3 * more
        values["water.current"] = [strong * np.cos(towards), strong * np.sin(towards)]
        values["water.current_variation.time"] = [BEFORE, BEFORE + event]
        values["water.current_variation.factor"] = [1.0, float(chance.uniform(0.5, 1.5))]
        values["water.current_variation.turn_deg"] = [0.0, float(chance.uniform(-90.0, 90.0))]
    scene = override(load_scene("side_scan"), values)
    return scene, log_along(f"{kind} {number}", t, fast, yaw, yaw, out)


def study(kind: str, number: int, truths: int) -> Surveyed:
    """One log: its interval, and its truths."""
    plan = EnsemblePlan(half_widths=RANGES, seed=1000 * (1 + list(KINDS).index(kind)) + number)
    with quiet():
        scene, log = survey_of(kind, number)
        run = by_log.simulated(log, scene, log.cable)
        twins = tuple(draw_of(plan, k) for k in range(1, truths + 1))
        towed = Towed(run.told.scene, RANGES, twins=twins)
        seconds, nominal, copies = by_log.copied(run, towed)
        made = Copied(seconds, towed.interval(nominal, copies), len(towed.ends), [])
        samples = by_log.samples_of_log(log, run, (0.0, 0.0))
        one, alone = (laid(scene, samples, RANGES, copied=there) for there in (lambda: made, None))
    counted = seconds >= (0.0 if kind == "line" else BEFORE)
    at = [
        np.column_stack([np.interp(seconds, samples.seconds, band.T[k]) for k in range(5)])
        for band in (one.band, alone.band)
    ]
    gaps = _gaps(nominal, copies[len(towed.ends) :])[:, counted]
    inside, steady = ((np.abs(gaps) <= band[counted]).mean(axis=1) for band in at)
    return Surveyed(kind, inside, steady, float(one.by_copies.mean()), at[0][counted].mean(axis=0))


def _gaps(nominal: np.ndarray, truths: np.ndarray) -> np.ndarray:
    """Truth less simulated [truths, n, PARTS]."""
    size = np.hypot(*nominal[:, :2].T)
    c, s = nominal[:, 0] / size, nominal[:, 1] / size
    east, north = truths[..., 0] - nominal[:, 0], truths[..., 1] - nominal[:, 1]
    turned = np.angle(np.exp(1j * (truths[..., 3] - nominal[:, 3])))
    layback = np.hypot(truths[..., 0], truths[..., 1]) - size
    return np.stack(
        [layback, east * c + north * s, north * c - east * s, truths[..., 2] - nominal[:, 2], turned], axis=-1
    )


def experiment(progress, quick: bool = False, over: Over = here) -> Result:
    """All surveys; quick: one turn; over: what logs are handed to."""
    asked = [(kind, k, TRUTHS) for kind in KINDS for k in range(GEOMETRIES)]
    if quick:
        asked = [(QUICK_KIND, 0, QUICK_TRUTHS)]
    found = []
    for k, one in enumerate(over(study, asked)):
        found.append(one)
        progress("surveys", k + 1, len(asked))
    rows = []
    for kind in dict.fromkeys(one.kind for one in found):
        mine = [one for one in found if one.kind == kind]
        for k, part in enumerate(PARTS):
            share, half = _share([one.inside[:, k] for one in mine])
            steady, _ = _share([one.steady[:, k] for one in mine])
            known = f"known to {half:.2g} % with so many surveys; " if np.isfinite(half) else ""
            why = f"{known}of steady tows alone {steady:.1f} %"
            rows.append(Comparison(f"{kind}: {part} inside", "%", share, LEVEL, ALLOWED, "the stated level", why))

    def page() -> list[str]:
        return markdown(found)

    return Result("surveys", rows, [], lambda folder: _plot(found, folder), tables=page, shown=page)


def _share(shares: list[np.ndarray]) -> tuple[float, float]:
    """Mean of all truths, %, and half of its 95 % interval from the logs, which are independent."""
    means = 100.0 * np.array([one.mean() for one in shares])
    if len(means) < 2:
        return float(means.mean()), float("inf")
    half = stats.t.ppf(0.975, len(means) - 1) * means.std(ddof=1) / np.sqrt(len(means))
    return float(means.mean()), float(half)


def markdown(found: list[Surveyed]) -> list[str]:
    """Shares of the time inside by kind, %, with their intervals."""
    lines = [["kind", "surveys", *PARTS, "copies", "half-widths along, across, depth"]]
    for kind in dict.fromkeys(one.kind for one in found):
        mine = [one for one in found if one.kind == kind]
        for words, key in ((kind, "inside"), ("steady tows alone", "steady")):
            cells = []
            for k in range(len(PARTS)):
                share, half = _share([getattr(one, key)[:, k] for one in mine])
                cells.append(f"{share:.1f}" + (f" ± {half:.1f}" if np.isfinite(half) else ""))
            count = sum(len(one.inside) for one in mine)
            width = np.mean([one.width for one in mine], axis=0)
            rest = [
                f"{100.0 * np.mean([one.copies for one in mine]):.0f} %",
                f"{width[1]:.1f}, {width[2]:.1f}, {width[3]:.1f} m",
            ]
            lines.append([words, str(count), *cells, *(rest if key == "inside" else ["", ""])])
    about = ", ".join(f"{kind}: {words}" for kind, words in KINDS.items())
    return [
        textwrap.fill(f"Share of the time inside the 95 % interval, %, with its own 95 % interval. {about}.", 100),
        markdown_table(lines),
    ]


def _plot(found: list[Surveyed], folder: Path) -> Path:
    from cable_sim_ros.plots.run import canvas

    kinds = list(dict.fromkeys(one.kind for one in found))
    path = folder / "surveys.png"
    with canvas(path, (14.0, 6.0), "Does the 95 % interval hold the truth?", "cable-sim validate surveys") as figure:
        axes = figure.subplots()
        axes.axhspan(LEVEL - ALLOWED, LEVEL + ALLOWED, color="#dddddd", label="93 to 97 %")
        for k, part in enumerate(PARTS):
            shares = [_share([one.inside[:, k] for one in found if one.kind == kind]) for kind in kinds]
            at = np.arange(len(kinds)) + 0.12 * (k - 2)
            spread = [half if np.isfinite(half) else 0.0 for _, half in shares]
            axes.errorbar(at, [share for share, _ in shares], spread, fmt="o", capsize=4, label=part)
        axes.set_xticks(range(len(kinds)), kinds)
        axes.set_ylabel("of the time inside [%]")
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    return path
