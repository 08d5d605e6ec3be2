"""Checks of strumming: what would count twice, what has no effect, what is far from the data behind it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...physics.viv_amplification import MAX_AMPLITUDE, MAX_FACTOR, RE_FULL, RE_SHEDDING
from ..layout import Layout
from ..problem import Limit, Problem, changed, idle
from ..scene import Scene
from ..statics.static_shape import TowShape
from ..tables.viv_tables import on, strum_amplitude, strum_sections, strumming_of, strums, unbounded_factor

FITTED = 500.0, 33000.0  # Reynolds numbers of the data of Govardhan & Williamson
STEEP_DEG = 35.0  # inclination to the flow below which the flow across the cable says too much
MEANT = 0.8  # a smaller multiplier knows of the inclination
STILL = 0.02  # diameters: an amplitude that is none


def strum_problems(scene: Scene) -> Iterator[Problem]:
    """Sections whose drag factor is both given and computed."""
    if not on(scene):
        return
    yield from [
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


def strum_warnings(layout: Layout) -> Iterator[Problem]:
    """Strumming without effect or far from the data behind it."""
    scene = layout.scene
    sections = scene.cable.sections
    if not on(scene):
        yield from idle("viv", scene.viv, changed(scene.viv), "viv.law is off", "viv.law")
        for name, section in sections.items():
            names = "viv_multiplier", "viv_damping_ratio"
            yield from idle(f"cable.sections.{name}", section, names, "viv.law is off", "viv.law")
        return
    if not any(strums(section) for section in sections.values()):
        yield Problem(
            "viv.law",
            f"= {scene.viv.law.value} has no effect: every section is faired, has no drag or has viv_multiplier 0",
            "Leave it out, or take the fairing off",
        )
        return
    yield from _far_warnings(layout)


def _far_warnings(layout: Layout) -> Iterator[Problem]:
    """Reynolds numbers and angles to the flow of the tow at rest that the laws were not made for."""
    scene, shape = layout.scene, layout.shape()
    rows = strum_sections(scene)
    strumming = shape.wet & (rows["strums"][shape.section] > 0)
    if not strumming.any():
        return
    re = (rows["reynolds"][shape.section] * shape.across)[strumming]
    if re.max() <= RE_SHEDDING:
        text = (
            f"= {scene.viv.law.value} has no effect: the Reynolds number of the flow across the cable is "
            f"{re.max():.3g} at most, and below {RE_SHEDDING:g} no vortices are shed"
        )
        yield Problem("viv.law", text, "Leave it out, or check ship.tow_speed and water.viscosity")
        return
    if re.min() < FITTED[0] or re.max() > FITTED[1]:
        text = (
            f"= {scene.viv.law.value} is used at Reynolds numbers of {re.min():.3g} to {re.max():.3g}, its data are of "
            f"{FITTED[0]:g} to {FITTED[1]:g}: there the drag factor is an extrapolation"
        )
        remedy = "Take it as an estimate, try others by viv.multiplier, or give a measured drag_amplification"
        yield Problem("viv.law", text, remedy)
    laws = strumming_of(scene)
    a = np.array([strum_amplitude(laws[k], float(v)) for k, v in zip(shape.section, shape.across, strict=True)])
    yield from _still(scene, rows, a, shape, strumming)
    yield from _inclined(scene, rows, shape, strumming & (a > 0.0))
    yield from _bounds(scene, a[strumming])


def _still(scene: Scene, rows: np.ndarray, a: np.ndarray, shape: TowShape, strumming: np.ndarray) -> Iterator[Problem]:
    """Sections whose damping leaves no amplitude."""
    for k, (name, section) in enumerate(scene.cable.sections.items()):
        here = strumming & (shape.section == k)
        multiplier = scene.viv.multiplier * section.viv_multiplier
        shed = here & (rows["reynolds"][k] * shape.across > RE_FULL)
        if not shed.any() or a[shed].max() >= STILL * multiplier or not multiplier:
            continue
        own = section.viv_damping_ratio
        key = "viv.damping_ratio" if own is None else f"cable.sections.{name}.viv_damping_ratio"
        text = (
            f"= {scene.viv.damping_ratio if own is None else own:g} gives section {name} a mass damping of "
            f"{rows['mass_damping'][k]:.3g}, at which {scene.viv.law.value} has an amplitude of {a[shed].max():.2g} "
            "diameters: it does not strum, its drag factor is 1"
        )
        remedy = "Give it as a share of critical (0.01 is 1 %); cable that is not to strum has viv_multiplier 0"
        yield Problem(key, text, remedy)


def _inclined(scene: Scene, rows: np.ndarray, shape: TowShape, strumming: np.ndarray) -> Iterator[Problem]:
    """A multiplier that knows nothing of the small angle between cable and flow."""
    if not strumming.any():
        return
    speed = np.maximum(shape.past[strumming], 1e-9)
    angles = np.degrees(np.arcsin(np.minimum(shape.across[strumming] / speed, 1.0)))
    angle = float(np.average(angles, weights=np.gradient(shape.s)[strumming]))
    maximum = scene.viv.multiplier * float(rows["multiplier"][shape.section][strumming].max())
    if angle >= STEEP_DEG or maximum <= MEANT:
        return
    product = "" if maximum == scene.viv.multiplier else f" ({maximum:.3g} with the viv_multiplier of the section)"
    text = (
        f"= {scene.viv.multiplier:g}{product} with cable that is inclined by {angle:.3g} deg on average to the flow, "
        f"less than {STEEP_DEG:g} deg: there a cable strums less than the flow across it says"
    )
    yield Problem("viv.multiplier", text, "Try 0.6 beside it, docs/strumming.md")


def _bounds(scene: Scene, a: np.ndarray) -> Iterator[Problem]:
    """Amplitudes and drag factors beyond what is known; a: A/d of the strumming cable."""
    maximum = float(a.max())
    lead, by = f"= {scene.viv.multiplier:g} gives amplitudes of up to", "by which the laws are bounded"
    yield from Limit("viv.multiplier", maximum, "<=", MAX_AMPLITUDE, "diameters", by, lead).problems(
        "", "Give a smaller one; cables strum with one diameter or less"
    )
    law = strumming_of(scene)[0]  # the formula is that of all sections
    at_bound = float(np.mean([unbounded_factor(law, x) >= MAX_FACTOR for x in a.tolist()]))
    if at_bound > 0.0:
        text = (
            f"= {scene.viv.amplification.value} gives a drag factor of {unbounded_factor(law, maximum):.3g}, and "
            f"{100.0 * at_bound:.3g} % of the strumming cable is held at the bound of {MAX_FACTOR:g}: there the "
            "factor no longer answers to the flow"
        )
        yield Problem("viv.amplification", text, "Give a smaller viv.multiplier, or viv.amplification: vandiver")
