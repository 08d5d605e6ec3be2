"""The one evaluator of the rules on watch: takes tick outputs in pieces, says which rule was broken, when and how far.

Offline runs, replays and the node use it alike. Its result does not depend on how a run is cut: ticks are counted,
sums are made one by one in their order, everything else is a largest, a least or a first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import exp, inf
from typing import Any

import numpy as np

from ...physics.section import material_of
from ...physics.winch_drive import DriveModel
from ..layout import layout_of
from ..rule_blocks import Rules, RuleSet, sheave_ratios, tension_rate
from ..scene import Scene
from .latch import RULE, Latch
from .rainflow import PIECE, Bends, Rainflow

BINS = 100  # of the histogram of the tension, up to the breaking load
FULL_POWER = 0.999  # of drive.max_power: what counts as all of it
OF_TICK = {  # rules that look at every tick, and the field that is compared; "": what is made of several
    "turns_left": "drum_turns",
    "slack": "tension_least",
    "snap": "",
    "lift_off": "lifted_fraction",
    "climb_out": "groove_margin",
    "rate_saturated": "rate_limited",
    "brake_rise": "",
}


def breaking_load(scene: Scene) -> float | None:
    """Breaking load [N] of the weakest section; None where that of a section is not known."""
    if scene.rules.breaking_load is not None:
        return scene.rules.breaking_load
    sections = scene.cable.sections.values()
    known = [load for section in sections if (load := material_of(scene.cable, section).breaking_load) is not None]
    return min(known) if known and len(known) == len(sections) else None


def working_load(scene: Scene) -> float | None:
    """Largest tension in work [N], None where the scene does not say."""
    rules, breaks = scene.rules, breaking_load(scene)
    if rules.working_load is not None:
        return rules.working_load
    return None if rules.factor_of_safety is None or breaks is None else breaks / rules.factor_of_safety


def damage_of(rules: Rules, breaks: float) -> Callable[[float], float]:
    """Damage of one cycle of a range [N] by the curve of the scene, R^m/K; 0 without one."""
    constant, power = rules.cycle_constant, rules.cycle_exponent
    if constant is None or power is None:
        return lambda size: 0.0
    return lambda size: (size / breaks) ** power / constant


class RuleWatch:
    """Rules of a scene over the tick outputs given to `add`."""

    def __init__(self, scene: Scene) -> None:
        self.scene, self.rules = scene, scene.rules
        self.tick = scene.solver.tick
        self._tick_ns = round(1e9 * self.tick)
        self.ticks, self._stamp = 0, 0
        self._count = -1  # ticks since the start, of the newest tick output
        self.latches: dict[str, Latch] = {}
        self.not_watched: list[dict[str, str]] = []
        self._rate = tension_rate(self.rules)
        self._slack_at = -(10**12)  # tick with slack, the newest
        self._heat: float | None = None  # J, of the tick before
        self._rise = 0.0  # K
        self._cycles: Rainflow | None = None
        self._bends: Bends | None = None
        self._fixed: list[tuple[Latch, float]] = []
        self._declare()

    def _declare(self) -> None:
        rules, scene, breaks = self.rules, self.scene, breaking_load(self.scene)
        root = 2.0 * scene.sheave.radius
        load = working_load(scene)
        if load is not None:
            self._latch("working_load", load, self.tick if self._rate is None else 1.0 / self._rate)
        thinnest, wires = sheave_ratios(rules)
        if thinnest is not None:
            thickest = max(material_of(scene.cable, section).diameter for section in scene.cable.sections.values())
            self._fixed.append((self._latch("sheave_ratio", thinnest), root / thickest))
        if wires is not None and rules.wire_diameter is None:
            self._not("wire_ratio", "rules.wire_diameter is not given")
        elif wires is not None and rules.wire_diameter is not None:
            self._fixed.append((self._latch("wire_ratio", wires), root / rules.wire_diameter))
        if rules.bend_radius is not None:
            radius = min(scene.sheave.radius, scene.winch.drum_radius) + 0.5 * scene.cable.diameter
            self._fixed.append((self._latch("bend_radius", rules.bend_radius), radius))
        for name in OF_TICK:
            if (limit := getattr(rules, RULE[name].key)) is not None:
                self._latch(name, limit)
        if rules.saturated_share is not None:
            motor, power = scene.drive.model is DriveModel.MOTOR, scene.drive.max_power
            for name, known, key in (
                ("torque_saturated", motor, "drive.model is not motor"),
                ("power_saturated", motor and power is not None, "there is no drive.max_power of a motor"),
            ):
                if known:
                    self._latch(name, rules.saturated_share)
                else:
                    self._not(name, key)
        if breaks is not None:
            self._cycles = Rainflow(damage_of(rules, breaks), rules.cycle_least * breaks, breaks / BINS)
            if rules.cycle_constant is not None:
                self._latch("tension_damage", rules.damage)
        layout = layout_of(scene)
        self._bends = Bends(layout.leaves - layout.tangent)
        if rules.bend_life is not None:
            self._latch("bend_damage", rules.damage)

    def _latch(self, name: str, limit: float, seconds: float | None = None) -> Latch:
        self.latches[name] = Latch(name, limit, self.tick if seconds is None else seconds)
        return self.latches[name]

    def _not(self, name: str, why: str) -> None:
        self.not_watched.append({"rule": name, "why": why})

    # ---- tick outputs

    def add(self, frames: np.ndarray) -> None:
        """The next tick outputs, as many as there are."""
        if not len(frames):
            return
        count = np.concatenate(([self._count], frames["tick"]))
        starts = np.flatnonzero(np.diff(count) <= 0)  # ticks since a start
        for part in np.split(frames, starts):
            if len(part) and starts.size and part["tick"][0] <= self._count:
                self._begin_again()
            self._take(part)

    def _begin_again(self) -> None:
        """The tow was started anew: what jumps is no motion."""
        self._heat = None
        if self._bends is not None:
            self._bends.moved()

    def _take(self, frames: np.ndarray) -> None:
        if not len(frames):
            return
        ticks = np.arange(self.ticks + 1, self.ticks + 1 + len(frames))
        stamps = frames["time"]
        for latch, value in self._fixed:
            latch.take(np.full(len(frames), value), ticks, stamps)
        for name, values in self._values(frames, ticks):
            self.latches[name].take(values, ticks, stamps)
        self._working_load(frames, ticks)
        self._sums(frames, ticks)
        self.ticks, self._stamp, self._count = int(ticks[-1]), int(stamps[-1]), int(frames["tick"][-1])

    def _values(self, frames: np.ndarray, ticks: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
        """(rule, its values) of the rules that look at every tick."""
        there, drive = self.latches, self.scene.drive
        for name, field in OF_TICK.items():
            if field and name in there:
                yield name, frames[field]
        if "snap" in there:
            slack = np.where(frames["tension_least"] < self.rules.slack_tension, ticks, self._slack_at)
            since = np.maximum.accumulate(slack)
            self._slack_at = int(since[-1])
            lately = ticks - since <= round(1e9 * self.rules.snap_time) // self._tick_ns
            yield "snap", np.where(lately, frames["tension_tick_max"], np.nan)
        if "torque_saturated" in there:
            full = np.abs(frames["motor_power"]) >= FULL_POWER * (drive.max_power or inf)
            yield "torque_saturated", np.where(full, 0.0, frames["motor_limited"])
            if "power_saturated" in there:
                yield "power_saturated", np.where(full, frames["motor_limited"], 0.0)
        if "brake_rise" in there:
            yield "brake_rise", self._warmed(frames["brake_heat"])

    def _warmed(self, heat: np.ndarray) -> np.ndarray:
        """Rise of the brake's temperature [K] after each tick, its heat since the start [J]: a lump that cools."""
        rules, rise = self.rules, np.empty(len(heat))
        kept = 1.0 if rules.brake_cooling_time is None else exp(-self.tick / rules.brake_cooling_time)
        capacity = rules.brake_heat_capacity or inf
        for k, total in enumerate(heat.tolist()):
            gained = 0.0 if self._heat is None else max(0.0, total - self._heat)  # a new start begins at 0
            self._rise, self._heat = self._rise * kept + gained / capacity, total
            rise[k] = self._rise
        return rise

    def _working_load(self, frames: np.ndarray, ticks: np.ndarray) -> None:
        if "working_load" not in self.latches:
            return
        latch, stamps = self.latches["working_load"], frames["time"]
        if self._rate is None:
            latch.take(frames["tension_most"], ticks, stamps)
            return
        period = round(1e9 / self._rate)
        read = ticks * self._tick_ns // period > (ticks - 1) * self._tick_ns // period
        if read.any():
            latch.take(frames["tension"][read], ticks[read], stamps[read])

    def _sums(self, frames: np.ndarray, ticks: np.ndarray) -> None:
        """Cycles of the tension, bendings, and their damage."""
        stamps, known = frames["time"], np.isfinite(frames["tension"])
        if self._cycles is not None:
            latch = self.latches.get("tension_damage")
            limit = latch.limit if latch is not None and latch.first is None else inf
            at = self._cycles.add(frames["tension"][known].tolist(), limit)
            if latch is not None and at is not None:
                latch.reached(int(ticks[known][at]), int(stamps[known][at]))
        known = np.isfinite(frames["payout"])
        if self._bends is not None:
            latch, life = self.latches.get("bend_damage"), self.rules.bend_life
            for at, halves in self._bends.add(frames["payout"][known].tolist()):
                if latch is not None and life is not None and 0.5 * halves / life > latch.limit:
                    latch.reached(int(ticks[known][at]), int(stamps[known][at]))

    # ---- what it says

    @property
    def broken(self) -> tuple[str, ...]:
        """Rules broken so far, by name."""
        return tuple(name for name, latch in self.latches.items() if latch.first is not None)

    def report(self) -> dict[str, Any]:
        """For the JSON, docs/rules.md."""
        last, damage, rows = (self.ticks, self._stamp), self._damage(), []
        unseen = list(self.not_watched)
        for name, latch in self.latches.items():
            row = latch.report(self.tick, damage.get(name), last)
            if row["worst"] is None and self.ticks and name != "snap":
                unseen.append({"rule": name, "why": "no reading, or none in the recording"})
            rows.append(row)
        return {
            "set": self.rules.set.value,
            "duration_s": round(self.ticks * self.tick, 9),
            "tension_rate_hz": self._rate,
            "breaking_load_n": breaking_load(self.scene),
            "broken": [row["rule"] for row in rows if row["broken"]],
            "rules": rows,
            "not_watched": unseen,
            "cycles": self._cycle_figures(damage),
        }

    def _damage(self) -> dict[str, float]:
        found = {}
        if "tension_damage" in self.latches and self._cycles is not None:
            found["tension_damage"] = self._cycles.damage
        if "bend_damage" in self.latches and self._bends is not None and self.rules.bend_life is not None:
            found["bend_damage"] = 0.5 * self._bends.most / self.rules.bend_life
        return found

    def _cycle_figures(self, damage: dict[str, float]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        if self._cycles is not None:
            count, largest, table = self._cycles.totals()
            found["tension"] = {
                "cycles": count,
                "largest_range_n": largest,
                "ranges": [{"up_to_n": upper, "cycles": cycles} for upper, cycles in table],
                "damage": damage.get("tension_damage"),
                "shed": self._cycles.shed,
            }
        if self._bends is not None:
            found["bending"] = {
                "most": 0.5 * self._bends.most,
                "most_at_payout_m": round(self._bends.most_at * PIECE, 9) if self._bends.most else None,
                "damage": damage.get("bend_damage"),
            }
        return found


def rule_watch(scene: Scene) -> RuleWatch | None:
    """The rules of a scene, None where it watches none."""
    return None if scene.rules.set is RuleSet.NONE else RuleWatch(scene)


def watched(scene: Scene, frames: np.ndarray) -> dict[str, Any]:
    """{"rules": ...} over a whole run, for the figures; {} where the scene watches none."""
    watch = rule_watch(scene)
    if watch is None:
        return {}
    watch.add(frames)
    return {"rules": watch.report()}
