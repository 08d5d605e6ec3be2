"""What a length of cable is made of: its material, its fairing, its mesh and what ends it.

A section may be of another cable than the rest: each of its material keys stands above that of the cable.
"""

from __future__ import annotations

from enum import Enum

from .drag_laws import AmplifiedDrag, DragLaw
from .fairing import Fairing
from .parameter import REQUIRED, Block, again, choice, quantity
from .viv_amplification import Viv
from .wake_oscillator import Wake


class CableModel(str, Enum):
    """What an element of the cable is."""

    ANCF = "ancf"  # gradient-continuous cubic elements with bending stiffness
    SEGMENTS = "segments"  # links with spherical joints, without bending stiffness


class LinkBuoyancy(str, Enum):
    """Buoyancy of a link."""

    FULL = "full"  # HK 53: all of it, upward; the joint force is the effective tension
    NORMAL = "normal"  # HK 55: its part across the link, as Huston and Kamman have it: wrong, see docs/segments.md


class Material(Block):
    """A cable per length of itself."""

    diameter: float = quantity(REQUIRED, "m", 1e-4, 1.0, "outer diameter", "Westin Table 8")
    mass_per_length: float = quantity(REQUIRED, "kg/m", 1e-5, 1e3, "dry mass per length", "Westin Table 8")
    axial_stiffness: float = quantity(REQUIRED, "N", 1.0, 1e11, "EA", "Westin 5.1")
    compression_share: float = quantity(
        1.0, "1", 0.0, 1.0, "share of EA that resists compression; small: a slack element folds where it would push"
    )
    bending_stiffness: float = quantity(0.0, "N m^2", 0.0, 1e8, "EI", "Westin (144)")
    axial_damping: float = quantity(0.0, "N s", 0.0, 1e8, "Kelvin-Voigt: axial force per strain rate", "Westin 5.1")
    bending_damping: float = quantity(0.0, "N m^2 s", 0.0, 1e6, "Kelvin-Voigt: bending moment per curvature rate")
    added_mass_coefficient: float = quantity(1.0, "1", 0.0, 5.0, "C_m of the normal motion", "Westin (66)")
    breaking_load: float | None = quantity(
        None,
        "N",
        1e-3,
        1e9,
        "load at which it breaks, of its data sheet; it breaks in no run, but one that goes beyond is not ok",
        "docs/flags.md",
    )


class Section(Block):
    """A length of cable, counted from the drum end. The last two keys are of what joins it to the next."""

    length: float = quantity(REQUIRED, "m", 1e-4, 2e4, "unstretched length")
    elements: int | None = quantity(
        None, "1", 1, 4000, "number of equal elements where winch.drum is contact; a winch that feeds has `mesh`"
    )
    diameter: float | None = again(Material, "diameter", "that of the cable")
    mass_per_length: float | None = again(Material, "mass_per_length", "that of the cable")
    axial_stiffness: float | None = again(Material, "axial_stiffness", "that of the cable")
    compression_share: float | None = again(Material, "compression_share", "that of the cable")
    bending_stiffness: float | None = again(Material, "bending_stiffness", "that of the cable")
    axial_damping: float | None = again(Material, "axial_damping", "that of the cable")
    bending_damping: float | None = again(Material, "bending_damping", "that of the cable")
    added_mass_coefficient: float | None = again(Material, "added_mass_coefficient", "that of the cable")
    breaking_load: float | None = again(Material, "breaking_load", "that of the cable")
    fairing: Fairing = choice(
        Fairing.NONE, "fairing: drag law, its coefficients and weight", "docs/theory.md, section 5"
    )
    fairing_mass: float | None = quantity(
        None, "kg/m", 0.0, 1e3, "dry mass of the fairing per length; none: that of the preset"
    )
    fairing_net_weight: float | None = quantity(
        None, "N/m", -1e4, 1e4, "weight less buoyancy of the fairing in water; none: that of its mass in the material"
    )
    drag_law: DragLaw | None = choice(
        None,
        "drag law: loading functions, C_N and C_T; none: that of the fairing, driscoll_nahon without one",
        "docs/drag.md",
    )
    drag_amplification: float = quantity(
        1.0, "1", 0.1, 10.0, "total drag factor G of a cable at rest, (58)-(65) with G the total", "Westin (64)"
    )
    drag_amplification_of: AmplifiedDrag | None = choice(
        None,
        "what drag_amplification multiplies: normal, the drag across the cable, for a factor of a measured or printed "
        "C_D; both, that along it too, for a factor tuned with (64); none: both, and a warning says what hangs on it",
        "docs/drag.md; Westin (64); Vandiver (1983), Blevins (1990)",
    )
    drag_coefficient: float | None = quantity(
        None,
        "1",
        0.0,
        10.0,
        "constant C_D; none: that of the fairing, without one that of the law, C_D(Re) of most; dymore needs one, laws "
        "named after their C_N(Re) take none",
        "docs/drag.md",
    )
    tangential_coefficient: float | None = quantity(
        None,
        "1",
        0.0,
        1.0,
        "C_t on the diameter, of the laws that have no f_t; pode needs a constant C_D above zero with it; none: that "
        "of the fairing, without one C_T(Re) of the huston_kamman laws, 0 of the others",
        "docs/drag.md; Pode: f C_D",
    )
    friction_coefficient: float | None = quantity(
        None,
        "1",
        0.0,
        0.3,
        "c_f on the surface pi d: tangential_coefficient is pi times it; give one of the two",
        "Dymore (12a), Capozucca (3.5)",
    )
    viv_damping_ratio: float | None = again(Viv, "damping_ratio", "viv.damping_ratio")
    viv_multiplier: float = quantity(
        1.0,
        "1",
        0.0,
        2.0,
        "factor on the amplitude of strumming beside viv.multiplier; 0: does not strum, as a faired one",
    )
    wake: Wake = choice(Wake(), "vortices that the section sheds")
    termination_mass: float = quantity(
        0.0, "kg", 0.0, 1e5, "dry mass of the termination at the outboard end, a point on the cable"
    )
    termination_net_weight: float | None = quantity(
        None, "N", -1e6, 1e6, "weight less buoyancy of the termination in water; none: its dry weight"
    )

    @property
    def meshed(self) -> int:
        """Elements of a hand-made mesh. Raises ValueError where the section gives none."""
        if self.elements is None:
            raise ValueError(
                "a section has no number of elements, and nobody makes a mesh here; nothing was built. Give it "
                "`elements`, 1 or more"
            )
        return self.elements


class Cable(Material):
    """The cable: its material where a section gives none of its own, the model of its elements, and its sections."""

    mean_flow_time: float = quantity(
        60.0,
        "s",
        1.0,
        36000.0,
        "time constant of the cable's own mean velocity, with which the mean flow past it acts "
        "on the extra drag of amplification; several waves long. Shorter for a while after a change of winch or ship",
        "docs/theory.md; Westin (64) in a steady tow",
    )
    model: CableModel = choice(
        CableModel.ANCF,
        "what an element is: ancf, a cubic with bending stiffness; segments, a straight link between spherical joints, "
        "without bending stiffness: the independent check",
        "docs/segments.md; Huston and Kamman (1980)",
    )
    link_buoyancy: LinkBuoyancy = choice(
        LinkBuoyancy.FULL,
        "of model segments: full buoyancy, or only its part across the link as printed, whose joint force is the wall "
        "tension and whose chain is too limp by pA/T",
        "docs/segments.md; Huston and Kamman (1980), equations 53 and 55",
    )
    sections: dict[str, Section] = choice(REQUIRED, "sections from the drum end to the towbody")


def material_of(cable: Material, section: Section) -> Material:
    """What a section is made of: its own numbers, those of the cable where it gives none."""
    own = {name: getattr(section, name) for name in Material.model_fields}
    return Material(**{name: getattr(cable, name) if value is None else value for name, value in own.items()})
