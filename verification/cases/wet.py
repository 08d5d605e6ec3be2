"""What the cases under water share: drag laws given in words, wet weights, meshes finer near a body."""

from __future__ import annotations

import re
from math import pi

from cable_sim_ros.physics.ancf import BUOYANCY
from cable_sim_ros.physics.drag_laws import DragLaw
from cable_sim_ros.sim.rig.rig import Rig

from .family import Case, CaseError

NUMBER = r"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?"
DEEP = 100.0  # m below the surface where a case only asks for "submerged"
STRAIN = 1e-5  # strain under the working tension of a cable meant to be inextensible


def crossflow(cn: float, ct: float = 0.0) -> dict:
    """Section settings of drag 0.5 rho d Cn |V_n| V_n across and 0.5 rho d Ct |V_t| V_t along the cable."""
    return {"drag_law": DragLaw.CROSSFLOW, "drag_coefficient": cn, "tangential_coefficient": ct}


def drag_law(case: Case, key: str = "drag_law") -> dict:
    """Section settings for a drag law given in words. Raises CaseError where it is not understood."""
    text = str(case.inputs[key])

    def given(*names: str) -> float:
        for name in names:
            if found := re.search(rf"(?<![\w.]){name}\s*=\s*({NUMBER})", text):
                return float(found[1])
        raise CaseError(f"{case.path}: inputs.{key} = {text!r} gives none of {', '.join(names)}; the case was not run")

    def law(kind: DragLaw, ct: float = 0.0) -> dict:
        return {"drag_law": kind, "drag_coefficient": given("Cn", "c_d", "Cd"), "tangential_coefficient": ct}

    words = text.lower()
    if "ribbon" in words:
        return law(DragLaw.RIBBON)
    if "pode" in words:
        return law(DragLaw.PODE, given("f") * given("Cn", "c_d", "Cd"))
    if "loading function" in words:
        for constant, kind in ((r"0\.011", DragLaw.DRISCOLL_NAHON), (r"0\.11", DragLaw.DRISCOLL_NAHON_PRINTED)):
            if re.search(rf"(?<![\d.]){constant}(?!\d)", text):
                return law(kind)
    if "tangential" in words:  # a coefficient on the circumference is pi times as large on the diameter
        return law(DragLaw.CROSSFLOW, given("Ct", "c_f") * (pi if re.search(r"rho pi d\b", words) else 1.0))
    raise CaseError(
        f"{case.path}: inputs.{key} = {text!r} names no drag law known here (ribbon, Pode, loading "
        f"functions with 0.11 or 0.011, normal and tangential); the case was not run"
    )


def weigh(rig: Rig, wet_weight: float) -> list[str]:
    """Make weight less buoyancy that of the case [N/m]; a note where diameter and density give another one."""
    weight = rig.cable.mass_per_length * rig.gravity
    off = weight - rig.model.elements[0, BUOYANCY, 0] - wet_weight
    if abs(off) <= 1e-6 * weight:
        return []
    rig.change_elements({BUOYANCY: weight - wet_weight})
    return [
        f"the wet weight given is {off:.3g} N/m less than mass, diameter and density give; the buoyancy was set so "
        "that the given one holds"
    ]


def graded(length: float, elements: int, fine: float, **settings) -> list[dict]:
    """Two sections: half of the elements on the last ``fine`` [m], where a light end bends the cable most."""
    half = max(elements // 2, 1)
    fine = min(max(fine, 0.05 * length), 0.4 * length)
    return [{"length": length - fine, "elements": half, **settings}, {"length": fine, "elements": half, **settings}]
