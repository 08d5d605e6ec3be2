"""Strumming of a scene: its numbers for physics/viv_amplification.py, and its drag factor in plain Python."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from ...physics import viv_amplification
from ...physics.drag_laws import DragLaw
from ...physics.fairing import Fairing, dressed, fairing_weight
from ...physics.section import Section, material_of
from ...physics.state import STRUM_RULES, STRUM_SECTION
from ...physics.viv_amplification import RE_SHEDDING, StrumLaw, StrumRms
from ..scene import Scene
from .material import section_ends


def on(scene: Scene) -> bool:
    """Is strumming computed?"""
    return scene.viv.law is not StrumLaw.OFF


def strums(section: Section) -> bool:
    """Can a section strum? A fairing holds it still."""
    own = dressed(section)
    bare = section.fairing is Fairing.NONE and own.drag_law not in (DragLaw.RIBBON, DragLaw.OFF)
    return bare and section.viv_multiplier > 0.0


def strum_rules(scene: Scene) -> np.ndarray:
    """STRUM_RULES [1], or none where viv is off."""
    viv = scene.viv
    rules = np.zeros(1 if on(scene) else 0, STRUM_RULES)
    rules["law"], rules["formula"] = (
        viv_amplification.LAWS.index(viv.law),
        viv_amplification.FORMULAS.index(viv.amplification),
    )
    rules["antinode"] = viv.rms is StrumRms.ANTINODE
    rules["every"] = max(1, round(viv.period / scene.solver.tick))
    rules["multiplier"], rules["band"], rules["rate"] = viv.multiplier, viv.lock_in_band, viv.rate
    return rules


def strum_sections(scene: Scene) -> np.ndarray:
    """STRUM_SECTION [sections], or none where viv is off."""
    cable, water = scene.cable, scene.water
    if not on(scene):
        return np.zeros(0, STRUM_SECTION)
    rows = np.zeros(len(cable.sections), STRUM_SECTION)
    for row, section, end in zip(rows, cable.sections.values(), section_ends(cable).values(), strict=True):
        own = material_of(cable, section)
        pushed = water.density * 0.25 * pi * own.diameter**2
        mass = own.mass_per_length + fairing_weight(section, own.diameter, water.density, scene.gravity)[0]
        zeta = scene.viv.damping_ratio if section.viv_damping_ratio is None else section.viv_damping_ratio
        row["end"], row["strums"], row["multiplier"] = end, strums(section), section.viv_multiplier
        row["mass_damping"] = (mass / pushed + own.added_mass_coefficient) * zeta
        row["reynolds"], row["diameter"] = water.density * own.diameter / water.viscosity, own.diameter
        row["mass"], row["added"] = mass, own.added_mass_coefficient * pushed
    return rows


def _plain(function: Callable) -> Callable:
    """A formula of the kernels as plain Python."""
    return getattr(function, "py_func", function)


def strum_amplitudes(scene: Scene) -> list[Callable[[float], float]]:
    """By section: A/d for a normal speed [m/s]; without the reduction by viv.lock_in_band."""
    rules, rows = strum_rules(scene), strum_sections(scene)
    if not on(scene):
        return [lambda speed: 0.0] * len(scene.cable.sections)
    law, amplitude, onset = int(rules[0]["law"]), _plain(viv_amplification.amplitude), _plain(viv_amplification.onset)

    def of(row: np.ndarray) -> Callable[[float], float]:
        alpha, maximum, re_1 = float(row["mass_damping"]), viv_amplification.MAX_AMPLITUDE, float(row["reynolds"])
        multiplier = float(row["multiplier"]) * scene.viv.multiplier

        def at(speed: float) -> float:
            re = re_1 * speed
            if not row["strums"] or re <= RE_SHEDDING:
                return 0.0
            return onset(re) * multiplier * min(max(amplitude(law, alpha, re), 0.0), maximum)

        return at

    return [of(row) for row in rows]


def unbounded_factor(scene: Scene, amplitude: float) -> float:
    """Drag factor of an amplitude A/d, before its bound."""
    formula = viv_amplification.FORMULAS.index(scene.viv.amplification)
    antinode = int(scene.viv.rms is StrumRms.ANTINODE)
    return _plain(viv_amplification.amplification)(formula, antinode, amplitude) if amplitude > 0.0 else 1.0


def drag_factors(scene: Scene) -> list[Callable[[float], float]]:
    """By section: drag factor of strumming for a normal speed [m/s]; without the reduction by viv.lock_in_band."""
    if not on(scene):
        return [lambda speed: 1.0] * len(scene.cable.sections)

    def factor(amplitude: Callable[[float], float]) -> Callable[[float], float]:
        return lambda speed: min(unbounded_factor(scene, amplitude(speed)), viv_amplification.MAX_FACTOR)

    return [factor(amplitude) for amplitude in strum_amplitudes(scene)]
