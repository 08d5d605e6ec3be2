"""The cable: material, sections, and the assembly of residual and tangent."""

from __future__ import annotations

from .drag import DragLaw
from .quantity import REQUIRED, Block, quantity


class Section(Block):
    """A length of cable meshed with equal elements, counted from the drum end."""

    length: float = quantity(REQUIRED, "m", 1e-4, 2e4, "unstretched length")
    elements: int = quantity(REQUIRED, "1", 1, 4000, "number of equal elements")
    drag_law: DragLaw = quantity(DragLaw.DRISCOLL_NAHON, "", None, None, "loading functions", "Westin (60), (145)")
    drag_amplification: float = quantity(
        1.0, "1", 0.1, 10.0, "total drag factor G of a cable at rest, (58)-(65) with G the total", "Westin (64)")
    drag_coefficient: float | None = quantity(
        None, "1", 0.0, 10.0, "constant C_D; none: Choo-Casarella C_D(Re)", "Westin (61)")


class Cable(Block):
    diameter: float = quantity(REQUIRED, "m", 1e-4, 1.0, "outer diameter", "Westin Table 8")
    mass_per_length: float = quantity(REQUIRED, "kg/m", 1e-5, 1e3, "dry mass per length", "Westin Table 8")
    axial_stiffness: float = quantity(REQUIRED, "N", 1.0, 1e11, "EA", "Westin 5.1")
    bending_stiffness: float = quantity(0.0, "N m^2", 0.0, 1e8, "EI", "Westin (144)")
    axial_damping: float = quantity(0.0, "N s", 0.0, 1e8, "Kelvin-Voigt: axial force per strain rate", "Westin 5.1")
    bending_damping: float = quantity(0.0, "N m^2 s", 0.0, 1e6, "Kelvin-Voigt: bending moment per curvature rate")
    added_mass_coefficient: float = quantity(1.0, "1", 0.0, 5.0, "C_m of the normal motion", "Westin (66)")
    sections: dict[str, Section] = quantity(REQUIRED, "", None, None, "sections from the drum end to the towbody")
