"""Strumming of a scene: its numbers for the kernels (physics/strum.py), its checks, and its drag factor in plain Python."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, degrees, pi

import numpy as np

from ..physics import strum
from ..physics.drag import DragLaw
from ..physics.fairing import Fairing, dressed, fairing_weight
from ..physics.section import Section, material_of
from ..physics.state import STRUM_RULES, STRUM_SECTION
from ..physics.strum import RE_SHEDDING, StrumLaw, StrumRms
from .material import section_ends
from .problem import Problem
from .scene import Scene

FITTED = 500.0, 33000.0  # Reynolds numbers of the data of Govardhan & Williamson
STEEP_DEG = 35.0  # inclination to the flow below which the normal component says too much


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
    rules["law"], rules["formula"] = strum.LAWS.index(viv.law), strum.FORMULAS.index(viv.amplification)
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


def drag_factors(scene: Scene) -> list[Callable[[float], float]]:
    """By section: drag factor of strumming for a normal speed [m/s]; without the reduction by viv.lock_in_band."""
    rules, rows = strum_rules(scene), strum_sections(scene)
    if not on(scene):
        return [lambda speed: 1.0] * len(scene.cable.sections)
    law, formula, antinode = (int(rules[0][name]) for name in ("law", "formula", "antinode"))
    amplitude, amplification, onset = _plain(strum.amplitude), _plain(strum.amplification), _plain(strum.onset)

    def factor(row: np.ndarray) -> Callable[[float], float]:
        alpha, most, re_1 = float(row["mass_damping"]), strum.AMPLITUDE_MOST, float(row["reynolds"])
        multiplier = float(row["multiplier"]) * scene.viv.multiplier

        def at(speed: float) -> float:
            re = re_1 * speed
            if not row["strums"] or re <= RE_SHEDDING:
                return 1.0
            a = onset(re) * multiplier * min(max(amplitude(law, alpha, re), 0.0), most)
            return min(amplification(formula, antinode, a), strum.FACTOR_MOST) if a > 0.0 else 1.0

        return at

    return [factor(row) for row in rows]


def strum_problems(scene: Scene) -> list[Problem]:
    """Sections whose drag factor is both given and computed."""
    if not on(scene):
        return []
    return [
        Problem(
            f"cable.sections.{name}.drag_amplification",
            f"= {section.drag_amplification:g} is a drag factor found by hand, which holds strumming, and viv.law = "
            f"{scene.viv.law.value} computes that of this section: it would count twice, must be 1",
            "Leave it out (a rougher cable has its drag_coefficient, a stronger or weaker vibration viv_multiplier), or "
            "switch viv.law off",
        )
        for name, section in scene.cable.sections.items()
        if strums(section) and section.drag_amplification != 1.0
    ]


def strum_cautions(scene: Scene, speed: float, angle: float) -> list[Problem]:
    """Strumming without effect or far from the data behind it; speed [m/s] of the water past the cable, angle [rad] of
    the cable from the vertical."""
    sections = scene.cable.sections
    if not on(scene):
        given = {f"cable.sections.{n}.viv_multiplier": s.viv_multiplier for n, s in sections.items()}
        changed = [(key, f"{value:g}") for key, value in given.items() if value != 1.0]
        changed += [
            (f"cable.sections.{n}.viv_damping_ratio", f"{s.viv_damping_ratio:g}")
            for n, s in sections.items()
            if s.viv_damping_ratio is not None
        ]
        return [
            Problem(key, f"= {value} has no effect while viv.law is off", "Give viv.law, or leave it out")
            for key, value in changed
        ]
    rows = [row for row in strum_sections(scene) if row["strums"]]
    if not rows:
        return [
            Problem(
                "viv.law",
                f"= {scene.viv.law.value} has no effect: every section is faired, has no drag or has viv_multiplier 0",
                "Leave it out, or take the fairing off",
            )
        ]
    found, normal = [], speed * cos(angle)
    numbers = sorted(float(row["reynolds"]) * normal for row in rows)
    if numbers[-1] < RE_SHEDDING:
        text = f"has no effect: at {normal:.3g} m/s across the cable its Reynolds number is {numbers[-1]:.3g}, below 47"
        return [Problem("viv.law", text, "Leave it out; so slow a flow sheds no vortices")]
    if numbers[0] < FITTED[0] or numbers[-1] > FITTED[1]:
        span = " to ".join(dict.fromkeys(f"{number:.3g}" for number in (numbers[0], numbers[-1])))
        found.append(
            Problem(
                "viv.law",
                f"= {scene.viv.law.value} is used at Reynolds numbers of {span}, its data are of {FITTED[0]:g} to "
                f"{FITTED[1]:g}: drag factors are an extrapolation",
                "Take them as an estimate, try others by viv.multiplier, or give a measured drag_amplification",
            )
        )
    inclined = 90.0 - degrees(angle)
    if speed > 0.0 and inclined < STEEP_DEG and scene.viv.multiplier == 1.0:
        found.append(
            Problem(
                "viv.multiplier",
                f"= 1 with a cable inclined by about {inclined:.3g} deg to the flow, less than {STEEP_DEG:g} deg: there a "
                "cable strums less than the flow across it says",
                "Try 0.6 beside it, docs/strumming.md",
            )
        )
    return found
