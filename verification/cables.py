"""Cables of the laboratory's lines."""

from __future__ import annotations

from typing import Any

from cable_sim_ros.physics.cable_assembly import Cable
from cable_sim_ros.sim.rig.rig import cable_of


def uniform(
    length: float, elements: int, mass: float, stiffness: float, section: dict | None = None, **numbers: Any
) -> Cable:
    """A cable of one section: length [m], mass [kg/m], EA [N]; section: its drag; numbers: the others."""
    sections = [{"length": length, "elements": elements} | (section or {})]
    return cable_of(sections, mass_per_length=mass, axial_stiffness=stiffness, **numbers)
