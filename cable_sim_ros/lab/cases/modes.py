"""Natural frequencies: small motion about rest, from the product's own tangent stiffness and mass matrix."""

from __future__ import annotations

from ...physics.drag import DragLaw
from ...physics.towbody import Towbody
from ...physics.water import Water
from ..rig import Rig, cable_of
from .family import Case, Level, Values, family
from .measure import frequencies, inextensible

DEEP = -100.0        # m: everything is wet
HOW = "eigenvalues of the product's tangent and mass matrix about its static solution; no time step at either fidelity"


def _answer(case: Case, rig: Rig, n: int, notes: list[str] | None = None) -> Values:
    asked = [(name, int(m[1])) for name, m in case.asked(r"omega_(\d+)")]
    found = frequencies(rig, 0, max((k for _, k in asked), default=1))
    return Values({name: float(found[k - 1]) for name, k in asked if k <= len(found)}, n, 0.0, notes or [])


@family("hanging chain", "length_m", "mass_per_length_kg_m", "g", "modes", how=f"upper end held, EI = 0; {HOW}")
def chain(case: Case, level: Level) -> Values:
    """A free hanging chain."""
    length, mass, g = (case.number(k) for k in ("length_m", "mass_per_length_kg_m", "g"))
    n = level.mesh(16)
    rig = Rig(cable_of([{"length": length, "elements": n}], mass_per_length=mass,
                       axial_stiffness=inextensible(mass * g * length)), held={0: "r"}, tension=mass * g * length,
              gravity=g)
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    return _answer(case, rig, n)


@family("hanging submerged cable", "length_m", "diameter_m", "mass_per_length_kg_m", "fluid_density", "Ca_normal",
        "body_wet_weight_N", "body_mass_kg", "body_transverse_added_mass_kg",
        how=f"upper end held, in still water, no drag; {HOW}")
def submerged(case: Case, level: Level) -> Values:
    """A submerged cable with a body."""
    length, d, mass, g = (case.number(k) for k in ("length_m", "diameter_m", "mass_per_length_kg_m", "g"))
    n, added = level.mesh(16), case.number("body_transverse_added_mass_kg")
    weight = case.number("body_wet_weight_N") + mass * g * length
    rig = Rig(cable_of([{"length": length, "elements": n, "drag_law": DragLaw.OFF}], diameter=d, mass_per_length=mass,
                       axial_stiffness=inextensible(weight), added_mass_coefficient=case.number("Ca_normal")),
              held={0: "r"}, tension=weight, gravity=g, water=Water(density=case.number("fluid_density")),
              bodies={-1: Towbody(mass=case.number("body_mass_kg"), net_weight=case.number("body_wet_weight_N"),
                                  added_mass=(added, added, 0.0))})
    rig.straight((0.0, 0.0, DEEP), (0.0, 0.0, -1.0))
    rig.settle()
    return _answer(case, rig, n)


@family("string with linear tension", "length_m", "mass_per_length_kg_m", "T_low_N", "T_high_N",
        how=f"vertical, gravity chosen so that the weight makes the tension gradient, both ends held; {HOW}")
def string(case: Case, level: Level) -> Values:
    """A taut string whose tension grows linearly."""
    length, mass, low, high = (case.number(k) for k in ("length_m", "mass_per_length_kg_m", "T_low_N", "T_high_N"))
    n = level.mesh(16)
    rig = Rig(cable_of([{"length": length, "elements": n}], mass_per_length=mass,
                       axial_stiffness=inextensible(max(low, high))), held={0: "r"}, tension=max(low, high),
              gravity=(high - low) / (mass * length), loads=[(n, 0.0, 0.0, -low, 0.0, 0.0, 0.0)])
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    rig.hold({0: "r", -1: "r"})
    return _answer(case, rig, n)
