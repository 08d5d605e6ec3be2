"""Fairing: what is clamped or woven onto a cable to lower its drag or to keep it from strumming.

A preset gives the drag law, its coefficients and what the fairing weighs; a key of the section that is given stands
above it. Sources, and what is judgement because no measurement was at hand:

* RIBBON: loading functions of Folb and Nelligan (1982), Westin (145), with C_D(Re) of the bare cable as there. Its
  volume and density are a judgement (two tails six diameters long, a tenth thick, on two fifths of the length).
* AIRFOIL: Packwood (1990) measured swept fairing elements: the crossflow principle holds, and the loading functions in
  use over-predict, hence f_n = sin^2 eta. C_D = 0.2 on the thickness is that of elements at sea with their gaps and
  misalignments, a judgement; a closed section of thickness ratio 0.25 in a basin has 0.02 on the chord, 0.08 here
  (Hoerner (1965): 2 C_f (1 + 2 t/c + 60 (t/c)^4), C_f = 0.0055). C_t = 2.1 c/t C_f by Packwood's perimeter of 2.1
  chords. Thickness, solid filling and density are a judgement.
* HAIR: no measurement at hand: all numbers are a judgement. A fringe that trails in the stream is taken to load like
  ribbon, and its C_D of 1.6 to be that of a cable kept still with the wetted surface of its hair added.
"""

from __future__ import annotations

from enum import Enum
from math import pi
from typing import NamedTuple

from .ancf import ADDED_MASS, BUOYANCY, DISPLACED, HALF_RHO_D, RE_FACTOR
from .drag_laws import DragLaw


class Fairing(str, Enum):
    """Fairing of a section."""

    NONE = "none"
    RIBBON = "ribbon"
    AIRFOIL = "airfoil"
    HAIR = "hair"


class Preset(NamedTuple):
    """Numbers of a fairing; its reference length is the thickness across the stream."""

    law: DragLaw
    drag_coefficient: float | None  # on the thickness; none: C_D(Re)
    tangential_coefficient: float  # on the thickness; 0: that of the law
    thickness: float  # over the diameter of the cable
    volume: float  # of the fairing alone, over that of the cable
    density: float  # kg/m^3 of its material


THICK, CHORD = 1.25, 4.0  # of the airfoil: thickness over the cable's diameter, chord over the thickness
FILLED = 0.68  # area of a streamlined section over chord times thickness
FRICTION = 0.0055  # C_f of a turbulent plate at Re = 3e5 to 1e6
PERIMETER = 2.1  # of the section over its chord
PRESETS = {
    Fairing.NONE: Preset(DragLaw.DRISCOLL_NAHON, None, 0.0, 1.0, 0.0, 0.0),
    Fairing.RIBBON: Preset(DragLaw.RIBBON, None, 0.0, 1.0, 0.6, 1200.0),
    Fairing.AIRFOIL: Preset(
        DragLaw.CROSSFLOW, 0.2, PERIMETER * CHORD * FRICTION, THICK, FILLED * CHORD * THICK**2 * 4.0 / pi - 1.0, 1100.0
    ),
    Fairing.HAIR: Preset(DragLaw.RIBBON, 1.6, 0.0, 1.0, 0.5, 1380.0),
}


def dressed(section):
    """A Section with every drag key of its own: what it leaves out is that of its fairing."""
    preset = PRESETS[section.fairing]
    given = {"drag_law": preset.law, "drag_coefficient": preset.drag_coefficient}
    if section.friction_coefficient is not None:
        given["tangential_coefficient"] = pi * section.friction_coefficient
    elif preset.tangential_coefficient > 0.0:
        given["tangential_coefficient"] = preset.tangential_coefficient
    return section.model_copy(update={key: value for key, value in given.items() if getattr(section, key) is None})


def fairing_weight(section, diameter: float, density: float, gravity: float) -> tuple[float, float]:
    """Dry mass [kg/m] and net weight in water [N/m] of the fairing of a Section on a cable of ``diameter`` [m].

    density: of the water [kg/m^3]. A mass without a net weight displaces the volume of the preset's material.
    """
    preset = PRESETS[section.fairing]
    mass = 0.25 * pi * diameter**2 * preset.volume * preset.density
    if section.fairing_mass is not None:
        mass = section.fairing_mass
    floating = 1.0 - density / preset.density if preset.density > 0.0 else 1.0
    return mass, mass * gravity * floating if section.fairing_net_weight is None else section.fairing_net_weight


def put_on(rows: dict[int, float], section, diameter: float, density: float, gravity: float) -> dict[int, float]:
    """Hydrodynamic rows of the bare cable (drag.element_rows) with the fairing of the Section on it."""
    thickness = PRESETS[section.fairing].thickness
    mass, net = fairing_weight(section, diameter, density, gravity)
    return rows | {
        HALF_RHO_D: rows[HALF_RHO_D] * thickness,
        RE_FACTOR: rows[RE_FACTOR] * thickness,
        ADDED_MASS: rows[ADDED_MASS] * thickness**2,
        BUOYANCY: rows[BUOYANCY] + (mass * gravity - net),
        DISPLACED: rows[DISPLACED] + ((mass * gravity - net) / gravity if gravity > 0.0 else 0.0),
    }
