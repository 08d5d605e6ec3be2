"""What the sections of a scene are in numbers: element rows, weight in water, where they end, what they carry."""

from __future__ import annotations

from collections.abc import Callable
from itertools import accumulate
from math import pi
from typing import NamedTuple

import numpy as np

from ...physics import ancf
from ...physics.cable_assembly import Cable
from ...physics.drag_laws import element_rows, of_components
from ...physics.fairing import dressed, fairing_weight, put_on
from ...physics.section import CableModel, LinkBuoyancy, Section, material_of
from ...physics.towbody import Towbody
from ...physics.water import Water
from ..scene import Scene


def arc_lengths(cable: Cable) -> np.ndarray:
    """Places [nodes] of the nodes of a mesh fixed to the material, m from the cable's inner end."""
    lengths = [np.full(s.meshed, s.length / s.meshed) for s in cable.sections.values()]
    return np.concatenate(([0.0], np.cumsum(np.concatenate(lengths))))


def material_rows(cable: Cable, section: Section, water: Water, gravity: float) -> np.ndarray:
    """Rows of the element table (physics/ancf.py) of one section [ROWS]; the length is left at zero."""
    own, rows = material_of(cable, section), np.zeros(ancf.ROWS)
    mass = own.mass_per_length + fairing_weight(section, own.diameter, water.density, gravity)[0]
    rows[ancf.MASS_PER_LENGTH], rows[ancf.WEIGHT_PER_LENGTH] = mass, mass * gravity
    rows[ancf.EA], rows[ancf.EI] = own.axial_stiffness, own.bending_stiffness
    rows[ancf.COMPRESSION] = own.compression_share
    rows[ancf.AXIAL_DAMPING] = own.axial_damping
    if own.bending_stiffness > 0.0:
        rows[ancf.BENDING_TIME] = own.bending_damping / own.bending_stiffness
    bare = element_rows(dressed(section), own, water, gravity)
    hydro = put_on(bare, section, own.diameter, water.density, gravity)
    rows[list(hydro)] = list(hydro.values())
    if cable.model is CableModel.SEGMENTS:
        rows[ancf.CLOSED_DRAG] = float(of_components(dressed(section).drag_law))
        rows[ancf.AXIAL_LIFT] = rows[ancf.BUOYANCY] if cable.link_buoyancy is LinkBuoyancy.NORMAL else 0.0
    return rows


def wet_weight(scene: Scene, section: Section) -> float:
    """Weight of a section with its fairing in water, per length [N/m]."""
    own = material_of(scene.cable, section)
    bare = (own.mass_per_length - scene.water.density * 0.25 * pi * own.diameter**2) * scene.gravity
    return bare + fairing_weight(section, own.diameter, scene.water.density, scene.gravity)[1]


def section_ends(cable: Cable) -> dict[str, float]:
    """Unstretched arc length [m] from the drum end at which each section ends."""
    return dict(zip(cable.sections, accumulate(s.length for s in cable.sections.values()), strict=True))


def body_places(scene: Scene) -> tuple[float, ...]:
    """Unstretched arc length [m] from the drum end of each body on the line."""
    ends = section_ends(scene.cable)
    return tuple(ends[body.at] for body in scene.bodies.values())


def bodies_of(scene: Scene) -> dict[str, Towbody]:
    """The towbody and the bodies on the line, by their keys."""
    return {"towbody": scene.towbody} | {f"bodies.{name}": body for name, body in scene.bodies.items()}


class Hung(NamedTuple):
    """Something that hangs on the line at an arc length [m] with its net weight in water [N] and its mass [kg]."""

    key: str
    place: float
    net_weight: float
    mass: float

    def weight(self, gravity: float, z: float) -> float:
        """What pulls it down at height z [N]."""
        return self.net_weight if z < 0.0 else self.mass * gravity


def hung(scene: Scene) -> list[Hung]:
    """Terminations and bodies on the line, not the towbody."""
    ends = section_ends(scene.cable)
    found = [
        Hung(
            f"cable.sections.{name}.termination_mass",
            ends[name],
            termination_weight(section, scene.gravity),
            section.termination_mass,
        )
        for name, section in scene.cable.sections.items()
        if section.termination_mass > 0.0
    ]
    return found + [Hung(f"bodies.{name}", ends[b.at], b.net_weight, b.mass) for name, b in scene.bodies.items()]


def termination_weight(section: Section, gravity: float) -> float:
    """Net weight of a section's termination in water [N]."""
    given = section.termination_net_weight
    return section.termination_mass * gravity if given is None else given


def extreme(cable: Cable, number: str, choose: Callable[..., str] = min) -> tuple[str, float]:
    """Key and value of the least (or ``choose=max``: largest) ``number`` of a Material among the sections."""
    own = {name: getattr(section, number) for name, section in cable.sections.items()}
    values = {name: getattr(cable, number) if value is None else value for name, value in own.items()}
    name = choose(values, key=values.__getitem__)
    return (f"cable.{number}" if own[name] is None else f"cable.sections.{name}.{number}"), values[name]


def outboard(scene: Scene, start: float) -> list[tuple[float, Section]]:
    """Length [m] of every section past the arc length ``start`` [m], those without any left out."""
    ends, found = section_ends(scene.cable), []
    for name, section in scene.cable.sections.items():
        length = min(section.length, ends[name] - start)
        if length > 0.0:
            found.append((length, section))
    return found
