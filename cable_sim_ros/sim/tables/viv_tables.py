"""Strumming of a scene: its numbers for physics/viv_amplification.py, and its drag factor by speed."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from ...compiler.jit import driver
from ...physics import viv_amplification
from ...physics.drag_laws import DragLaw
from ...physics.fairing import Fairing, dressed, fairing_weight
from ...physics.section import Section, material_of
from ...physics.state import STRUM_RULES, STRUM_SECTION
from ...physics.viv_amplification import (
    MAX_AMPLITUDE,
    MAX_FACTOR,
    RE_SHEDDING,
    StrumLaw,
    StrumRms,
    amplification,
    amplitude,
    onset,
)
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


class Strumming(NamedTuple):
    """What the drag factor of a section follows from; off where strums is 0."""

    strums: int
    law: int  # place in LAWS
    formula: int  # in FORMULAS
    antinode: int
    mass_damping: float
    reynolds: float  # of 1 m/s
    multiplier: float


def strumming_of(scene: Scene) -> list[Strumming]:
    """By section."""
    if not on(scene):
        return [Strumming(0, 0, 0, 0, 0.0, 0.0, 0.0)] * len(scene.cable.sections)
    one = strum_rules(scene)[0]
    return [
        Strumming(
            *(int(row["strums"]), int(one["law"]), int(one["formula"]), int(one["antinode"])),
            *(float(row["mass_damping"]), float(row["reynolds"]), float(row["multiplier"]) * scene.viv.multiplier),
        )
        for row in strum_sections(scene)
    ]


@driver
def strum_amplitude(one, speed):
    """A/d for a normal speed [m/s]; without the reduction by viv.lock_in_band."""
    re = one.reynolds * speed
    if one.strums == 0 or re <= RE_SHEDDING:
        return 0.0
    return onset(re) * one.multiplier * min(max(amplitude(one.law, one.mass_damping, re), 0.0), MAX_AMPLITUDE)


@driver
def unbounded_factor(one, a):
    """Drag factor of an amplitude A/d, before its bound."""
    return amplification(one.formula, one.antinode, a) if a > 0.0 else 1.0


@driver
def drag_factor(one, speed):
    """Drag factor of strumming for a normal speed [m/s]; without the reduction by viv.lock_in_band."""
    return min(unbounded_factor(one, strum_amplitude(one, speed)), MAX_FACTOR) if one.strums else 1.0
