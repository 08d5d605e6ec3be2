"""N4, N18: the cable on its sheave: climbing out, pressing in."""

from __future__ import annotations

import numpy as np

from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.simulator import SolverError

from ..cases import Fidelity
from ..shipped import started
from .n01_n02_slack_and_dead_stop import values
from .sheave_depth import Watch
from .tows import Sea, held, reel, sail
from .verdict import WITHIN, Found, Metric, holds, stress

TURN_ABOUT = 5.0  # s
ROLL, YAW = {"roll": (np.radians(70.0), 80.0, 0.0)}, {"yaw": (np.radians(60.0), 80.0, 0.0)}
WALL = 30.0  # deg, half of the shipped throat angle
HIGHEST = 4200.0  # N, contact.working_tension of the tows of N18: their highest static tension is 4.12 kN


@stress(
    "groove climb-out: fleet angle, heel +-70 deg",
    "threshold within 2 deg; latched flag in the next tick output; the cable never passes through the sheave",
)
def climb(quick: bool) -> Found:
    """A slack cable in a groove that heels; a tow whose ship slowly rolls to 70 deg and back, at rest and under way."""
    heel = "heel angle at climb-out, zero tension"
    got, notes = values(
        "climb",
        {
            "groove_half_angle_deg": WALL,
            "mass_per_length_kg_m": 0.389,
            "radius_to_centreline_m": 0.255,
            "tension_N": 0.0,
            "g": 9.81,
        },
        {heel: 0.01},
        Fidelity.REALTIME if quick else Fidelity.VERIFICATION,
    )
    away = None if got[heel] is None else got[heel] - (90.0 - WALL)
    metrics = [
        Metric("heel at climb-out of a slack cable against 90 deg less the half angle", away, "deg", 2.0, WITHIN)
    ]
    notes = notes[1:]
    for name, speed, sea in (
        ("towed, heel to 70 deg in 20 s", 2.2, ROLL),
        ("hanging, heel to 70 deg in 20 s", 0.0, ROLL),
        ("towed, fleet angle to 60 deg in 20 s", 2.2, YAW),
        ("towed, heel to -70 deg in 4 s", 2.2, {"roll": (np.radians(-70.0), 16.0, 0.0)}),
    )[: 3 if quick else 4]:
        found, report = heeled(speed, sea)
        metrics += [f._replace(name=f"{name}: {f.name}") for f in found]
        notes += [f"{name}: {note}" for note in report]
    return Found(metrics, notes)


def heeled(speed: float, waves: dict, rate: float = 0.0) -> tuple[list[Metric], list[str]]:
    """A tow at ``speed`` [m/s] whose ship turns as ``waves`` say, for 40 s: up and back, or more.

    rate: [m/s] at which its winch hauls in and pays out, turn by turn, TURN_ABOUT seconds each.
    """
    scene = held(ship__tow_speed=speed, winch__command_timeout=3600.0)
    sim, sea = started(scene), Sea(scene, **waves)
    watch = Watch(sim)
    missed, unlatched, out_at, last, notes = 0, 0, None, 0, []
    try:
        for part in range(80):
            way = 1.0 if int(0.5 * part / TURN_ABOUT) % 2 else -1.0
            for f in watch.look(reel(sim, way * rate, 0.5, sea) if rate else sail(sim, sea, 0.5)):
                flagged = bool(int(f.status) & Flag.DETACHED)
                out = f.groove_margin <= 0.0 or f.contact_total <= 0.0
                missed += bool(out and not flagged)
                unlatched += int(f.detachments) < last
                last = max(last, int(f.detachments))
                missed += bool(out and last == 0)
                if out and out_at is None:
                    angle = np.abs(2.0 * np.arcsin(f.ship_quaternion[:3])).max()
                    out_at = (f.time * 1e-9, float(np.degrees(angle)))
    except SolverError as error:
        notes.append(str(error))
    metrics = [
        Metric("tick outputs out of the groove without flag or event", missed, "", 0),
        Metric("events taken back", unlatched, "", 0),
        *watch.metrics(scene.cable.diameter),
        holds("ran to its end", not notes),
    ]
    notes.append(
        "stayed in the groove"
        if out_at is None
        else f"out of the groove after {out_at[0]:.1f} s at {out_at[1]:.1f} deg of the ship"
    )
    return metrics, notes


@stress("highest tension, least wrap", "penetration <= 0.1 diameter")
def pressed(quick: bool) -> Found:
    """Static tows at nearly the tension the contact is made for, the sheave raised until the cable hardly bends."""
    metrics, notes = [], []
    for speed, rise in ((2.2, 0.6), (2.6, 0.6), (2.6, -0.6), (2.6, -1.0), (2.6, -1.2), (2.6, 2.0))[: 3 if quick else 6]:
        scene = held(ship__tow_speed=speed, sheave__position=[-36.8, 0.0, 3.1 + rise], contact__working_tension=HIGHEST)
        frame = started(scene).frame
        name = f"{speed:g} m/s, sheave {rise:+g} m above the drum"
        metrics += [
            Metric(f"penetration over diameter, {name}", float(frame.penetration / scene.cable.diameter), "", 0.1),
            Metric(
                f"largest tension over contact.working_tension, {name}", float(frame.tension_most / HIGHEST), "", 1.0
            ),
        ]
        notes.append(
            f"{name}: {frame.tension:.0f} N at the sheave, largest {frame.tension_most:.0f} N, wrap "
            f"{np.degrees(frame.wrap_angle):.1f} deg, departure {np.degrees(frame.departure_angle):.1f} deg"
        )
    return Found(metrics, notes)
