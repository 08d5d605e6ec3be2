"""N23, N24, N25: a winch that turns about for ten minutes, hauls in the last metre; its accounts of mass and energy."""

from __future__ import annotations

import numpy as np

from cable_sim_ros.physics.ancf import MASS_PER_LENGTH
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator

from ..shipped import started
from .n09_n10_n12_heavy_sea_and_energy import residual_fraction, turned_over
from .n20_n21_n22_winch_at_work import against
from .tows import HELD, Sea, finite, held, reel, sail, shipped
from .verdict import Found, Metric, holds, relative, stress

SWELL = {"heave": (1.5, 8.0, 0.0), "pitch": (0.04, 7.0, 1.0), "roll": (0.15, 9.0, 0.5)}
PATIENT = {"winch__command_timeout": 3600.0}


def mass_error(sim: Simulator) -> float:
    """Mass of the cable in the mesh and on the drum over that of its sections, less one."""
    state, sections = sim.state, sim.scene.cable.sections.values()
    linear = np.array(
        [sim.scene.cable.mass_per_length if s.mass_per_length is None else s.mass_per_length for s in sections]
    )
    ends = np.cumsum([s.length for s in sections])
    begins = ends - [s.length for s in sections]
    on_drum = float((linear * np.clip(state.arc[0] - begins, 0.0, ends - begins)).sum())
    rows = sim.model.line.elements[:, MASS_PER_LENGTH].ravel()[: sim.nodes - 1]
    return abs((on_drum + float(rows @ np.diff(state.arc))) / float(linear @ (ends - begins)) - 1.0)


class Account:
    """Energy residual over the work turned over, and the largest error of the mass, over parts of a run."""

    def __init__(self, sim: Simulator):
        self.sim, self.first, self.work, self.mass, self.good = sim, sim.frame.copy(), 0.0, mass_error(sim), True
        self.kept, self.tension = 0.0, []

    def look(self, frames: np.recarray) -> np.recarray:
        """Count a part; returns its tick outputs."""
        total = self.sim.model.settings["drum"]["total"][0]
        self.work += turned_over(frames)
        self.mass = max(self.mass, mass_error(self.sim))
        self.kept = max(self.kept, float(np.abs(frames.payout + frames.cable_on_drum - total).max() / total))
        self.good = self.good and finite(frames)
        self.tension.append(frames.tension)
        return frames

    def metrics(self, name: str, residual: float) -> list[Metric]:
        """What is judged; residual: limit of the energy residual over the work."""
        fraction = residual_fraction(self.first, self.sim.frame, self.work)
        return [
            holds(f"{name}, numbers finite", self.good),
            Metric(f"{name}, energy residual over work", fraction, "", residual),
            Metric(f"{name}, mass in mesh and drum against the whole", self.mass, "", 1e-9),
            Metric(f"{name}, cable off the drum and on it against the whole", self.kept, "", 1e-9),
        ]


def direct(scene_values: dict, payout: float, scene: Scene) -> Simulator:
    """A start with ``payout`` [m] off the drum."""
    total = sum(s.length for s in scene.cable.sections.values())
    return started(shipped(**scene_values | {"winch__scope": None, "winch__cable_on_drum": total - payout}))


@stress(
    "pay-out reversed every two seconds for ten minutes",
    "finite, residual <= 1 % of work as in N9, mass 1e-9, settles where it began within 0.5 N and 15 mm",
)
def reversing(quick: bool) -> Found:
    """2 m/s out and in, turn by turn, the winch compensating or held, in a sea or without."""
    seconds, metrics, notes = (40.0 if quick else 600.0), [], []
    for name, values, waves in (("held, still", HELD, None), ("compensation in a sea", {}, SWELL))[1 if quick else 0 :]:
        scene = shipped(**values | PATIENT)
        sim = started(scene)
        account, sea = Account(sim), None if waves is None else Sea(scene, **waves)
        begin = float(sim.frame.payout)
        for turn in range(round(seconds / 2.0)):
            rate = 1.0 if turn in (0, round(seconds / 2.0) - 1) else 2.0  # about where it began
            account.look(reel(sim, rate if turn % 2 == 0 else -rate, 2.0, sea))
        metrics += account.metrics(name, 1e-2)
        tension = np.concatenate(account.tension)
        if waves is None:
            account.look(reel(sim, 0.0, 60.0 if quick else 1800.0))
            metrics += against(f"{name}, settled", sim, direct(values | PATIENT, float(sim.frame.payout), scene))
            metrics.append(Metric(f"{name}, cable lost", abs(float(sim.frame.payout) - begin), "m", 1e-3))
        notes.append(f"{name}: {tension.min():.0f} to {tension.max():.0f} N")
    return Found(metrics, notes)


def material_fixed(scope: float) -> Scene:
    """The shipped tow with a mesh fixed to the material, 0.1 m all along, and ``scope`` [m] of faired cable out."""
    length = 5.2 + 8.04 + scope
    faired = {"length": length, "elements": round(length / 0.1), "drag_law": "ribbon"}
    faired |= {"drag_amplification": 2.37, "drag_amplification_of": "both"}
    wrap = (5.2 - 0.02) / 0.305
    return held("full_scale_contact", cable__sections={"faired": faired}, winch__wrap=wrap)


@stress(
    "hauled in to the last metre under way, and out again",
    "stops with flag DRUM_END, as a mesh fixed to the material within 1 %; back where it began within 0.5 N and 15 mm",
)
def last_metre(quick: bool) -> Found:
    """The shipped tow hauled in at 2 m/s until the winch stops, fairing and all; the rate stays commanded a while."""
    metrics, notes = [], []
    waves = {"heave": (0.5, 8.0, 0.0), "roll": (0.1, 9.0, 0.5)}
    for name, sea in (("still", {}), ("in a sea", waves))[: 1 if quick else 2]:
        scene = shipped(**HELD | PATIENT | ({"winch__scope": 30.0} if quick else {}))
        sim = started(scene)
        drum, swell = sim.model.settings["drum"][0], Sea(scene, **sea) if sea else None
        minimum, account = float(drum["payout_0"] + drum["min_length"]), Account(sim)
        way = float(sim.frame.payout) - minimum
        hauled = account.look(reel(sim, -2.0, way / 2.0 + 2.0, swell))
        rest = account.look(reel(sim, -2.0, 60.0, swell))
        metrics += [
            holds(
                f"{name}, flag DRUM_END while the rate stays commanded", bool(((rest.status & Flag.DRUM_END) > 0).all())
            ),
            Metric(f"{name}, pay-out below the stop", float(max(minimum - hauled.payout.min(), 0.0)), "m", 1e-9),
            Metric(f"{name}, scope that is left", float(rest.scope[-1]), "m"),
            Metric(
                f"{name}, largest tension hauling in over that of the start",
                float(hauled.tension.max() / account.first.tension),
            ),
        ]
        if not sea:
            fixed = started(material_fixed(float(rest.scope[-1]))).frame
            mean = float(rest.tension[-1000:].mean())
            metrics.append(
                relative(f"{name}, tension against a mesh fixed to the material", mean, float(fixed.tension), 0.01)
            )
        account.look(reel(sim, 2.0, way / 2.0, swell))
        again = account.look(reel(sim, 0.0, 60.0 if quick else 3000.0, swell))
        metrics += [
            holds(f"{name}, flag gone when paying out", not bool((again.status & Flag.DRUM_END).any())),
            *account.metrics(name, 1e-3),
        ]
        if not sea:
            metrics += against(f"{name}, paid out again", sim, started(scene), "the start")
        notes.append(f"{name}: {way:.1f} m hauled in, {sim.nodes - 1} elements")
    return Found(metrics, notes)


@stress("the account of a winch at work", "residual <= 1e-3 of work, mass 1e-9")
def account(quick: bool) -> Found:
    """Ten minutes of compensation; the same while 250 m are hauled in at 1 m/s and paid out again."""
    metrics = []
    for name, waves, rates in (
        ("compensation", SWELL, (0.0, 0.0)),
        ("compensation and 250 m of travel", SWELL, (-1.0, 1.0)),
        ("250 m of travel, still", None, (-1.0, 1.0)),
    ):
        scene = shipped(**PATIENT)
        sim, sea = started(scene), None if waves is None else Sea(scene, **waves)
        parts = Account(sim)
        for rate in rates:
            for _ in range(2 if quick else 25):
                parts.look(reel(sim, rate, 10.0, sea) if rate else sail(sim, sea, 10.0))
            parts.look(reel(sim, 0.0, 10.0 if quick else 50.0, sea))
        metrics += parts.metrics(name, 1e-3)
    return Found(metrics, ["work: what goes in and out through winch and hull, both counted positive"])
