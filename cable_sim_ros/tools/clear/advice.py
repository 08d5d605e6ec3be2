"""Does a steady tow clear the ground ahead, and what clears it: the least action, by when, and when to take it back.

Each way is judged by the tow itself and copies at the ends of what is not known of it: half the 95 % interval of the
least clearance is the root of the sum of squares of what drag, speed (the worse end of each) and soundings take from
it (law of propagation, JCGM 100:2008, 5.1.2). Clear means: the least clearance less that is the margin or more.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from math import ceil, hypot
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...physics.parameter import Block, quantity
from ...sim.scene import Scene
from ..ensemble.plan import Ranges
from .profile import Profile
from .towed import Action, Copy, Tow

HORIZON = 3600.0  # s that are looked ahead at most
SAMPLES = 200  # of a way; one a second, where these are fewer
DISPLAY = 1.0  # s, in which times are told
FINEST = 1.0 / 256.0  # of the largest action
LEAST = 0.25  # of the scope, to which is hauled where nobody says how far
GROUND, HELD = "#8c6d46", "#5c6873"
COLOURS = {"haul": "#0b3c5d", "speed": "#1a9850", "both": "#c23b33"}


def shared(name: str) -> Any:
    """The declaration of a number of Ranges."""
    return copy(Ranges.model_fields[name])


class Allowances(Block):
    """What is not known when the ground ahead is judged, half-widths of 95 %; a sounding's is its root of squares."""

    drag: float = shared("drag")
    speed: float = shared("speed")
    sounding: float = quantity(
        0.5,
        "m",
        0.0,
        100.0,
        "the same error of every depth of the ground",
        "IHO S-44 (2020) table 1, order 1: a = 0.5 m",
    )
    sounding_share: float = quantity(
        0.013,
        "1",
        0.0,
        0.5,
        "error of a depth of the ground, as a share of it",
        "IHO S-44 (2020) table 1, order 1: b = 0.013",
    )


class Wanted(NamedTuple):
    """What is asked of an answer. scope, least_scope [m], speed, max_speed, rate [m/s]: None: of scene, state or node;
    margin, hole and corridor [m], acceleration of the ship [m/s^2]; age [s] of a profile that is fresh."""

    scope: float | None
    speed: float | None
    margin: float
    rate: float | None
    least_scope: float | None
    max_speed: float | None
    acceleration: float
    hole: float
    corridor: float
    age: float

    def tow(self, scene: Scene, scope: float, speed: float) -> Tow:
        """The tow that is judged, of a scene with this scope [m] and speed [m/s] unless others are wanted."""
        rate = scene.winch.max_rate if self.rate is None else self.rate
        speed = speed if self.speed is None else self.speed
        return Tow(scene, self.scope or scope, speed, rate, self.acceleration)

    def least(self, scope: float) -> float:
        """How far is hauled in at most: cable that stays out [m]."""
        return LEAST * scope if self.least_scope is None else self.least_scope

    def deeper(self, copies: dict[str, Copy], depth: float | None) -> float:
        """How far a towbody at ``depth`` [m] is below that of its steady tow; one above it sinks."""
        if depth is None or self.scope is not None or self.speed is not None:
            return 0.0
        return max(depth - copies["itself"].depth, 0.0)


class Judged(NamedTuple):
    """Of one way over the ground: least clearance [m], what is taken from it for what is not known, where [m ahead of
    the ship's place at the beginning] and when [s]."""

    clearance: float
    allowance: float
    place: float
    time: float

    @property
    def sure(self) -> float:
        """Clearance that is kept in 97.5 of 100."""
        return self.clearance - self.allowance


class Found(NamedTuple):
    """An action that clears: its share, the latest begin, and the earliest time to take it back [s]; None: not before
    the end of the profile."""

    kind: str
    share: float
    begin: float
    out: float | None
    judged: Judged


class Passage:
    """A tow and the ground ahead of it."""

    def __init__(
        self, copies: dict[str, Copy], profile: Profile, margin: float, ranges: Allowances, deeper: float = 0.0
    ) -> None:
        """deeper: how far the towbody is below its steady depth now [m], which it keeps."""
        self.copies, self.profile, self.margin, self.ranges, self.deeper = copies, profile, margin, ranges, deeper
        itself = copies["itself"]
        self.depth, self.behind, self.speed = itself.depth + deeper, itself.behind, itself.tow.speed
        whole = (profile.distance[-1] - self.behind) / self.speed
        self.seconds = float(min(max(whole, 1.0), HORIZON))
        self.t = np.linspace(0.0, self.seconds, min(max(ceil(self.seconds), 2), SAMPLES) + 1)
        self._known: dict[Any, tuple[float, float, float]] = {}
        self.first = -np.inf  # m: ground before it is not judged
        self.notes = list(profile.notes)
        if profile.distance[0] > self.behind:
            self.notes.append(
                f"no depth is known from the towbody, {self.behind:.4g} m, to {profile.distance[0]:.4g} m: not judged"
            )
        if whole > HORIZON:
            self.notes.append(f"judged are {HORIZON:g} s, to {self.behind + self.speed * HORIZON:.5g} m")
        self.aground = float(-min(self._clearance(itself, None, 0.0, 0.0, None)[2][0], 0.0))
        if self.aground > 0.0:
            self._leave_out_the_start()

    def _leave_out_the_start(self) -> None:
        clearance = self._clearance(self.copies["itself"], None, 0.0, 0.0, None)[2]
        spread = max(one.depth for one in self.copies.values()) - self.copies["itself"].depth
        free = np.flatnonzero(clearance >= self.margin + hypot(spread, self._sounding(self.depth)))
        self.first = self.behind + self.speed * float(self.t[free[0]]) if len(free) else np.inf
        told = f"judged from {self.first:.4g} m on" if len(free) else "nothing further can be judged"
        self.notes.append(
            f"the towbody, {self.depth:.4g} m deep, is aground at the start by {self.aground:.3g} m after the profile: "
            f"{told}. Mind depth, datum and tide of both"
        )

    def _sounding(self, depth: float) -> float:
        return hypot(self.ranges.sounding, self.ranges.sounding_share * depth)

    def track(self, copy: Copy, kind: str | None, share: float, begin: float, out: float | None) -> tuple[Any, Any]:
        """Depth and place [m] of a copy at the times ``t``."""
        depth, place = copy.depth + self.deeper + 0.0 * self.t, copy.behind + copy.tow.speed * self.t
        if kind is not None and share > 0.0:
            more = copy.answers[kind].way(share, begin, out, self.t)
            depth, place = depth + more[0], place + more[1]
        return depth, place

    def _clearance(self, copy: Copy, *action: Any) -> tuple[Any, Any, Any]:
        """Times, places and clearances of a copy: at the times ``t``, then where the profile has points."""
        depth, place = self.track(copy, *action)
        rising = np.maximum.accumulate(place)
        points = self.profile.distance[(self.profile.distance > rising[0]) & (self.profile.distance < rising[-1])]
        at = np.interp(points, rising, self.t)
        where = np.concatenate([place, points])
        gap = self.profile.ground(where) - np.concatenate([depth, np.interp(at, self.t, depth)])
        return np.concatenate([self.t, at]), where, np.where(where < self.first, np.inf, gap)

    def _least(self, name: str, *action: Any) -> tuple[float, float, float]:
        """The least clearance of a copy, where and when."""
        if (name, action) not in self._known:
            t, where, gap = self._clearance(self.copies[name], *action)
            k = int(np.argmin(gap))
            self._known[name, action] = float(gap[k]), float(where[k]), float(t[k])
        return self._known[name, action]

    def judge(
        self, kind: str | None = None, share: float = 0.0, begin: float = 0.0, out: float | None = None
    ) -> Judged:
        """The least clearance of a way; infinite where no depth is known on it."""
        least = {name: self._least(name, kind, share, begin, out) for name in self.copies}
        itself, place, when = least["itself"]
        if not np.isfinite(itself):
            return Judged(itself, 0.0, place, when)
        lost = {name: max(itself - gap, 0.0) for name, (gap, *_) in least.items()}
        depth = float(self.profile.ground(np.array([place]))[0])
        taken = hypot(lost["drag"], max(lost["slower"], lost["faster"]), self._sounding(depth))
        return Judged(itself, taken, place, when)

    def clear(self, kind: str, share: float, begin: float, out: float | None = None) -> bool:
        """Does a way keep the margin?"""
        if any(self._least(name, kind, share, begin, out)[0] < self.margin for name in ("itself", "drag")):
            return False  # without a look at the other copies
        return self.judge(kind, share, begin, out).sure >= self.margin

    def found(self, kind: str) -> Found | None:
        """The least share of an action that clears, with its times; None where the whole of it, now, does not."""
        if not self.clear(kind, 1.0, 0.0):
            return None
        share = _edge(lambda part: self.clear(kind, part, 0.0), 1.0, 0.0, FINEST)
        begin = _edge(lambda when: self.clear(kind, share, when), 0.0, self.seconds, DISPLAY)
        answer = self.copies["itself"].answers[kind]
        done = begin + answer.tow.lasts(answer.part(share)) + answer.tow.starts(answer.action)
        out = None
        if done < self.seconds and self.clear(kind, share, begin, self.seconds):
            out = _edge(lambda when: self.clear(kind, share, begin, when), self.seconds, done, DISPLAY)
            out = out if out < self.seconds - DISPLAY else None
        return Found(kind, share, begin, out, self.judge(kind, share, begin, out))


def _edge(good: Callable[[float], bool], from_: float, to: float, finest: float) -> float:
    """The last value on the way from one that is good, towards another, that is; ``to`` where it is good itself."""
    if good(to):
        return to
    while abs(to - from_) > finest:
        middle = 0.5 * (from_ + to)
        from_, to = (middle, to) if good(middle) else (from_, middle)
    return from_


def actions_of(tow: Tow, least_scope: float, max_speed: float | None) -> dict[str, Action]:
    """What can be done: haul in to a least scope [m], go faster up to a speed [m/s], both at once."""
    haul = max(tow.scope - least_scope, 0.0)
    more = 0.0 if max_speed is None else max(max_speed - tow.speed, 0.0)
    asked = {"haul": Action(haul, 0.0), "speed": Action(0.0, more), "both": Action(haul, more)}
    named = {"haul": haul > 0.0, "speed": more > 0.0, "both": haul > 0.0 and more > 0.0}
    return {name: action for name, action in asked.items() if named[name]}


def deeper_than_the_wire(tow: Tow, profile: Profile, margin: float, ranges: Allowances) -> dict[str, Any] | None:
    """The answer without a simulation where no cable reaches the ground; None where it can."""
    shallowest = float(profile.depth.min())
    left = shallowest - hypot(ranges.sounding, ranges.sounding_share * shallowest) - margin - tow.scope
    if left < 0.0:
        return None
    notes = list(profile.notes)
    if profile.distance[0] > -tow.scope:
        notes.append(f"no depth is known from the towbody to {profile.distance[0]:.4g} m: not judged")
    why = f"the ground, {shallowest:.4g} m and deeper, is out of reach of {tow.scope:.4g} m of cable"
    return {"state": "clear", "margin_m": margin, "scope_m": tow.scope, "held": None, "why": why, "notes": notes}


def advise(passage: Passage) -> dict[str, Any]:
    """What is answered, for the JSON; state: clear, act, cannot or unknown."""
    held = passage.judge()
    itself = passage.copies["itself"]
    report: dict[str, Any] = {
        "margin_m": passage.margin,
        "scope_m": itself.tow.scope,
        "speed_mps": itself.tow.speed,
        "rate_mps": itself.tow.rate,
        "depth_m": passage.depth,
        "behind_m": passage.behind,
        "aground_m": passage.aground,
        "judged_s": passage.seconds,
        "notes": passage.notes,
        "ways": [],
    }
    if not np.isfinite(held.clearance):
        return report | {"state": "unknown", "held": None}
    report["held"] = _row(held)
    if held.sure >= passage.margin:
        return report | {"state": "clear"}
    for kind, answer in itself.answers.items():
        found = passage.found(kind)
        if found is None:
            report["ways"].append({"way": kind, "clears": False, "all_now": _row(passage.judge(kind, 1.0, 0.0))})
            continue
        part = answer.part(found.share)
        report["ways"].append(
            {
                "way": kind,
                "clears": True,
                "haul_m": part.haul,
                "scope_m": itself.tow.scope - part.haul,
                "speed_more_mps": part.speed,
                "begin_by_s": found.begin,
                "share": found.share,
                "let_out_from_s": found.out,
                **_row(found.judged),
            }
        )
    return report | {"state": "act" if any(way["clears"] for way in report["ways"]) else "cannot"}


def _row(judged: Judged) -> dict[str, float]:
    return {"clearance_m": judged.clearance, "allowance_m": judged.allowance, "at_m": judged.place, "at_s": judged.time}


def told(report: dict[str, Any]) -> str:
    """The answer in one line."""
    held, margin = report["held"], report["margin_m"]
    if report["state"] == "clear" and held is None:
        return f"clear: {report['why']}"
    if held is None:
        return "unknown: no depth is known where the towbody goes"
    at = f"at {held['at_m']:.5g} m in {held['at_s']:.4g} s"
    sure = f"{held['clearance_m']:.3g} m, less {held['allowance_m']:.3g} m for what is not known"
    if report["state"] == "clear":
        return f"clear: held as it is the towbody keeps {margin:g} m; least {at}: {sure}"
    line = f"held as it is the towbody does not keep {margin:g} m {at}: {sure}"
    ways = [way for way in report["ways"] if way["clears"]]
    if not ways:
        best = max((way["all_now"]["clearance_m"] for way in report["ways"]), default=None)
        more = "nothing can be done" if best is None else f"all that can be done, now, leaves {best:.3g} m"
        return f"cannot be cleared, {held['at_s']:.4g} s left: {line}; {more}. Turn away, or take the towbody up"
    return f"act: {line}; " + "; or ".join(_way(way) for way in ways)


def _way(way: dict[str, Any]) -> str:
    parts = [f"haul in {way['haul_m']:.1f} m to {way['scope_m']:.1f} m"] if way["haul_m"] else []
    parts += [f"go {way['speed_more_mps']:.2f} m/s faster"] if way["speed_more_mps"] else []
    out = way["let_out_from_s"]
    back = "not before the profile ends" if out is None else f"from {out:.0f} s on"
    return f"{' and '.join(parts)}, begun within {way['begin_by_s']:.0f} s, back {back}"


def plot(passage: Passage, report: dict[str, Any], path: Path) -> Path:
    """Draw the ground, the towbody's way held and with each action, and by when that must begin. RuntimeError where
    matplotlib is missing."""
    from ...plots.run import canvas

    itself = passage.copies["itself"]
    title = f"{report['scene']}: {report['answer'].partition(':')[0]}"
    with canvas(path, (14.0, 7.0), title, "docs/clear.md") as figure:
        axis = figure.subplots()
        ground = passage.profile
        bottom = 1.1 * max(float(ground.depth.max()), passage.depth)
        shown = np.unique(np.concatenate([ground.distance, 0.5 * (ground.gaps[:, 0] + ground.gaps[:, 1])]))
        depth = ground.ground(shown)
        axis.fill_between(shown, np.where(np.isfinite(depth), depth, np.nan), bottom, color=GROUND, label="ground")
        held_depth, held_place = passage.track(itself, None, 0.0, 0.0, None)
        axis.plot(held_place, held_depth, color=HELD, ls="--", lw=2, label="held as it is")
        taken = 0.0 if report["held"] is None else report["held"]["allowance_m"] + passage.margin
        label = "not known and margin"
        axis.fill_between(held_place, held_depth, held_depth + taken, color=HELD, alpha=0.15, label=label)
        for way in report["ways"]:
            if not way["clears"]:
                continue
            depth, place = passage.track(itself, way["way"], way["share"], way["begin_by_s"], way["let_out_from_s"])
            colour, begin = COLOURS[way["way"]], way["begin_by_s"]
            axis.plot(place, depth, color=colour, lw=2.5, label=f"{way['way']}, begun by {begin:.0f} s")
            axis.plot(np.interp(begin, passage.t, place), np.interp(begin, passage.t, depth), "o", color=colour, ms=9)
        axis.set(xlim=(passage.behind, float(max(held_place[-1], ground.distance[0]))), ylim=(bottom, 0.0))
        axis.set(xlabel="ahead of the ship as it is now [m]", ylabel="depth [m]")
        axis.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    return path
