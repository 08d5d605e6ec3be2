"""Scenes as a user might write them, drawn from a seed: both drums, soft and stiff cables, bodies, seabed, shear."""

from __future__ import annotations

from math import cos, pi, radians, sin

import numpy as np

from cable_sim_ros.physics.heave_compensation import LAWS

DENSITY, GRAVITY = 1026.0, 9.81
# name of the cable, density [kg/m^3] and Young's modulus [N/m^2] of its cross-section: steel, synthetic, umbilical
MATERIALS = (("steel", 6500.0, 8e10), ("fibre", 1300.0, 2e10), ("umbilical", 2200.0, 3e9), ("soft", 1400.0, 6e8))
LONGEST, SHORTEST = 600.0, 8.0  # m of scope
SPARE = 30.0  # m of cable on a drum that feeds
SEA_HEAVE, SEA_PERIOD = 3.0, (5.0, 14.0)  # m, s
MAX_RATE = 1.5  # m/s of a winch plan


def between(rng: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def rounded(value: float, digits: int = 3) -> float:
    """As a user writes it."""
    return float(f"{value:.{digits}g}")


def draw(rng: np.random.Generator) -> dict:
    """Plain data of a scene."""
    scope, speed = (
        rounded(between(rng, SHORTEST, LONGEST)),
        rounded(rng.choice((0.0, 1.0, 1.0)) * rng.uniform(0.3, 3.0)),
    )
    cable, drag = drawn_cable(rng), rounded(rng.uniform(1.0, 2.5))
    towbody = drawn_body(rng)
    feeds = rng.random() < 0.7
    sections = drawn_sections(rng, scope, feeds, drag)
    radius = rounded(max(rng.uniform(0.15, 0.6), 12.0 * cable["diameter"]))
    fall = rng.uniform(2.0, 6.0)
    heading = rounded(rng.uniform(-180.0, 180.0))
    current, gradient = drawn_current(rng, scope, heading)
    water = {"current": current, "current_gradient": gradient}
    push = 0.6 * DENSITY * cable["diameter"] * drag * scope * (speed + np.hypot(*current)) ** 2
    weight = towbody["net_weight"] + cable["mass_per_length"] * GRAVITY * scope
    scene = {
        "name": "drawn",
        "ship": {"tow_speed": speed, "heading_deg": heading},
        "water": water,
        "cable": cable | {"sections": sections},
        "winch": {"position": [-28.0, 0.0, 3.0], "drum_radius": rounded(rng.uniform(0.2, 0.8))},
        "setpoint": {"algorithm": LAWS[int(rng.choice(5, p=(0.6, 0.1, 0.1, 0.1, 0.1)))].value},
        "sheave": {
            "position": [-36.0, 0.0, rounded(fall)],
            "radius": radius,
            "groove_depth": rounded(cable["diameter"] * rng.uniform(1.5, 4.0)),
            "throat_angle_deg": rounded(rng.uniform(40.0, 70.0)),
        },
        "contact": {"working_tension": rounded(1.5 * (weight + 0.5 * push), 2)},
        "towbody": towbody,
        "solver": {"tick": float(rng.choice((0.01, 0.02)))},
    }
    if feeds:
        scene["winch"]["scope"] = scope
    else:
        scene["winch"] |= {"drum": "contact", "wrap": rounded(rng.uniform(5.0, 12.0))}
        length = scene["winch"]["wrap"] * scene["winch"]["drum_radius"] * 1.02
        sections["drum"] = {"length": rounded(length), "elements": 24}
        scene["cable"]["sections"] = {"drum": sections.pop("drum")} | sections
    if rng.random() < 0.2:
        scene["seabed"] = {"depth": rounded(scope * rng.uniform(0.3, 1.5))}
    if "faired" in sections and rng.random() < 0.3:
        scene["bodies"] = {"depressor": drawn_body(rng) | {"at": "bare"}}
    return scene


def drawn_cable(rng: np.random.Generator) -> dict:
    """Plain data of a cable without its sections."""
    _, density, modulus = MATERIALS[int(rng.choice(len(MATERIALS), p=(0.4, 0.25, 0.2, 0.15)))]
    diameter = rounded(between(rng, 0.006, 0.025))
    area = 0.25 * pi * diameter**2
    stiffness = rounded(modulus * area * between(rng, 0.5, 2.0))
    cable = {
        "diameter": diameter,
        "mass_per_length": rounded(density * area),
        "axial_stiffness": stiffness,
        "bending_stiffness": rounded(stiffness * diameter**2 / 16.0 * between(rng, 1e-3, 0.1)),
        "axial_damping": rounded(stiffness * rng.choice((0.0, 1e-4, 1e-3))),
    }
    if rng.random() < 0.15:
        cable["compression_share"] = float(rng.choice((0.0, 1e-7, 1e-3, 0.1)))
    return cable


def drawn_sections(rng: np.random.Generator, scope: float, feeds: bool, drag: float) -> dict:
    """Plain data of the sections outboard, and what is inboard of them."""
    faired = rounded(scope * rng.uniform(0.05, 0.5)) if rng.random() < 0.6 else 0.0
    plain, amplified = {"drag_amplification": drag, "drag_amplification_of": "both"}, {}
    if faired:
        amplified["faired"] = {"length": faired, "fairing": str(rng.choice(("ribbon", "airfoil", "hair")))}
    if feeds:
        return {"bare": {"length": rounded(scope - faired + SPARE, 4)} | plain} | amplified
    last = {name: section | {"elements": 12} for name, section in amplified.items()}
    span = {"span": {"length": 7.0, "elements": 3}, "sheave": {"length": 5.0, "elements": 80}}
    return span | {"bare": {"length": rounded(max(scope - faired, 4.0), 4), "elements": 16} | plain} | last


def drawn_body(rng: np.random.Generator) -> dict:
    """Plain data of a body that sinks."""
    mass = rounded(between(rng, 15.0, 1500.0))
    area = (mass / 1000.0) ** (2.0 / 3.0)
    return {
        "mass": mass,
        "net_weight": rounded(mass * GRAVITY * rng.uniform(0.1, 0.85)),
        "added_mass": [rounded(mass * fraction) for fraction in (0.1, 0.6, 0.8)],
        "drag_area": [rounded(area * fraction) for fraction in (0.1, 0.8, 1.0)],
        "lift_area": rounded(-0.3 * area * rng.choice((0.0, 0.0, 1.0))),
    }


def drawn_current(rng: np.random.Generator, scope: float, heading: float) -> tuple[list[float], list[float]]:
    """Current at the surface [m/s], within 60 deg of ahead or astern, and its gradient [1/s]: over the
    scope it grows by half of itself, by itself or not at all."""
    if rng.random() < 0.5:
        return [0.0, 0.0], [0.0, 0.0]
    speed, turn = rng.uniform(0.1, 0.8), radians(heading + rng.choice((0.0, 180.0)) + rng.uniform(-60.0, 60.0))
    east, north = speed * cos(turn), speed * sin(turn)
    fraction = rng.choice((0.0, 0.5, 1.0)) / scope
    return [rounded(east), rounded(north)], [rounded(east * fraction), rounded(north * fraction)]


def drawn_sea(rng: np.random.Generator) -> dict:
    """Heave, pitch and roll as `tows.Sea` takes them."""
    heave, period = rounded(rng.uniform(0.0, SEA_HEAVE)), rounded(rng.uniform(*SEA_PERIOD))
    return {
        "heave": (heave, period, 0.0),
        "pitch": (0.01 * heave, period, 1.0),
        "roll": (0.03 * heave, 1.1 * period, 0.5),
        "yaw": (0.01, 2.0 * period, 0.2),
    }


def drawn_winch(rng: np.random.Generator) -> list[float]:
    """Rates of pay-out [m/s], one for every five seconds; empty: no commands."""
    if rng.random() < 0.6:
        return []
    return [rounded(rate) for rate in rng.uniform(-MAX_RATE, MAX_RATE, 8)]
