"""Checks of strumming: what would count twice, what has no effect, what is far from the data behind it."""

from __future__ import annotations

import numpy as np

from ..physics.strum import RE_SHEDDING
from .problem import Problem
from .scene import Scene
from .statics import Route
from .strumming import on, strum_sections, strums
from .tow_shape import tow_shape

FITTED = 500.0, 33000.0  # Reynolds numbers of the data of Govardhan & Williamson
STEEP_DEG = 35.0  # inclination to the flow below which the flow across the cable says too much


def strum_problems(scene: Scene) -> list[Problem]:
    """Sections whose drag factor is both given and computed."""
    if not on(scene):
        return []
    return [
        Problem(
            f"cable.sections.{name}.drag_amplification",
            f"= {section.drag_amplification:g} is a drag factor found by hand, which holds strumming, and viv.law = "
            f"{scene.viv.law.value} computes that of this section: it would count twice, must be 1",
            "Leave it out (a rougher cable has its drag_coefficient, stronger or weaker strumming viv_multiplier), or "
            "switch viv.law off",
        )
        for name, section in scene.cable.sections.items()
        if strums(section) and section.drag_amplification != 1.0
    ]


def strum_cautions(scene: Scene) -> list[Problem]:
    """Strumming without effect or far from the data behind it."""
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
    if not any(strums(section) for section in sections.values()):
        return [
            Problem(
                "viv.law",
                f"= {scene.viv.law.value} has no effect: every section is faired, has no drag or has viv_multiplier 0",
                "Leave it out, or take the fairing off",
            )
        ]
    return _far_cautions(scene)


def _far_cautions(scene: Scene) -> list[Problem]:
    """Reynolds numbers and angles to the flow of the tow at rest that the laws were not made for."""
    route, rows = Route(scene), strum_sections(scene)
    shape = tow_shape(scene, route.total - route.wound - route.inboard)
    strumming = shape.wet & (rows["strums"][shape.section] > 0)
    if not strumming.any():
        return []
    re = (rows["reynolds"][shape.section] * shape.across)[strumming]
    if re.max() <= RE_SHEDDING:
        text = (
            f"= {scene.viv.law.value} has no effect: the Reynolds number of the flow across the cable is "
            f"{re.max():.3g} at most, and below {RE_SHEDDING:g} no vortices are shed"
        )
        return [Problem("viv.law", text, "Leave it out, or check ship.tow_speed and water.viscosity")]
    found = []
    if re.min() < FITTED[0] or re.max() > FITTED[1]:
        text = (
            f"= {scene.viv.law.value} is used at Reynolds numbers of {re.min():.3g} to {re.max():.3g}, its data are of "
            f"{FITTED[0]:g} to {FITTED[1]:g}: there the drag factor is an extrapolation"
        )
        remedy = "Take it as an estimate, try others by viv.multiplier, or give a measured drag_amplification"
        found.append(Problem("viv.law", text, remedy))
    speed = np.maximum(shape.past[strumming], 1e-9)
    angles = np.degrees(np.arcsin(np.minimum(shape.across[strumming] / speed, 1.0)))
    angle = float(np.average(angles, weights=np.gradient(shape.s)[strumming]))
    if angle < STEEP_DEG and scene.viv.multiplier == 1.0:
        text = (
            f"= 1 with cable that is inclined by {angle:.3g} deg on average to the flow, less than {STEEP_DEG:g} deg: "
            f"there a cable strums less than the flow across it says"
        )
        found.append(Problem("viv.multiplier", text, "Try 0.6 beside it, docs/strumming.md"))
    return found
