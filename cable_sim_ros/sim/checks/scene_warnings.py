"""Cautions about numbers that do not do what they seem to: damping without effect, a body that may swing by itself,
a drag factor that does not say of what, a drag law outside the range of its source."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, hypot, radians, sin

import numpy as np

from ...physics.ancf import RE_FACTOR
from ...physics.cable_assembly import Cable
from ...physics.drag_laws import LAWS, AmplifiedDrag, DragLaw, Law
from ...physics.fairing import dressed
from ...physics.section import Section, material_of
from ...physics.towbody import BodyModel
from ..layout import layout_of
from ..problem import Problem
from ..scene import Scene
from ..statics.static_shape import TowShape
from ..tables.current import flow_of
from ..tables.material import bodies_of, material_rows

SWING = 2.0  # rad/s; swings of a tow are slower
STILL = 0.01  # m/s; slower water does not load a cable, whatever its law
NOTHING = 1e-3  # of tension or depth: what hangs on less is not said


def damping_warnings(cable: Cable) -> list[Problem]:
    """Bending damping without bending stiffness: it is that stiffness times a time, so there is none."""
    without_bending = dict[str, float]()
    for name, section in cable.sections.items():
        own = material_of(cable, section)
        if own.bending_damping > 0.0 and own.bending_stiffness == 0.0:
            without_bending["cable" if section.bending_damping is None else f"cable.sections.{name}"] = (
                own.bending_damping
            )
    return [
        Problem(
            f"{key}.bending_damping",
            f"= {damping:g} N m^2 s has no effect where bending_stiffness is 0 N m^2: the damping acts on the rate of "
            "the bending energy, and there is none",
            "Give bending_stiffness above 0 N m^2, or leave bending_damping out",
        )
        for key, damping in without_bending.items()
    ]


def swing_warnings(scene: Scene, speed: float) -> Iterator[Problem]:
    """Bodies whose added mass across drives a swing by more than their drag across damps it; speed past them [m/s].

    A body that swings with v sin(w t) turns into the flow a little late, and the turning of its axes pulls it on with
    (m_y - m_x) w^2 t/(1 + w^2 t^2) v, t its time constant: theory.md, section 7.
    """
    for key, body in bodies_of(scene).items():
        lag = SWING * body.flow_time_constant
        drives = (body.added_mass[1] - body.added_mass[0]) * SWING * lag / (1.0 + lag**2)
        damps = 0.5 * scene.water.density * body.drag_area[1] * speed
        if body.model is BodyModel.LEVEL and speed > body.least_flow_speed and drives > damps:
            yield Problem(
                f"{key}.added_mass",
                f"across is {body.added_mass[1]:g} kg, {body.added_mass[1] - body.added_mass[0]:g} kg more than "
                f"ahead: while it turns into the flow in {key}.flow_time_constant = {body.flow_time_constant:g} s "
                f"that drives a swing to the side with up to {drives:.3g} N s/m, more than the {damps:.3g} N s/m "
                f"that its drag_area across damps at {speed:.3g} m/s: it may swing by itself",
                "Check added_mass and drag_area of the same body, or make flow_time_constant longer",
            )


def _fastest(scene: Scene) -> float:
    """Speed [m/s] of the fastest water past the tow in its static start."""
    length = sum(section.length for section in scene.cable.sections.values())
    yaw, ahead = radians(scene.ship.heading_deg), scene.ship.tow_speed
    flow = flow_of(scene.water, yaw, (ahead * cos(yaw), ahead * sin(yaw)))
    depths = (0.0, length, *(min(depth, length) for depth in scene.water.current_table.depth or ()))
    return max(hypot(*flow(-depth)) for depth in depths)


def part_warnings(scene: Scene) -> Iterator[Problem]:
    """Drag factors by hand that do not say of what, with what hangs on it in the static shape."""
    sections = scene.cable.sections
    silent = {
        name: section.drag_amplification
        for name, section in sections.items()
        if section.drag_amplification != 1.0
        and section.drag_amplification_of is None
        and dressed(section).drag_law is not DragLaw.OFF
    }
    if not silent or _fastest(scene) <= STILL:
        return
    across = {"drag_amplification_of": AmplifiedDrag.NORMAL}
    other = {name: s.model_copy(update=across) if name in silent else s for name, s in sections.items()}
    cable = scene.cable.model_copy(update={"sections": other})
    shapes = [layout_of(one).shape() for one in (scene, scene.model_copy(update={"cable": cable}))]
    report = [(float(-shape.place[0, 2]), float(shape.tension[-1])) for shape in shapes]
    if all(abs(a - b) <= NOTHING * abs(a) for a, b in zip(*report, strict=True)):
        return
    (depth, tension), (depth_1, tension_1) = report
    names = ", ".join(f"{name} ({factor:g})" for name, factor in silent.items())
    yield Problem(
        f"cable.sections.{next(iter(silent))}.drag_amplification_of",
        f"is not given for the drag factor of {names}, which multiplies the drag along the cable too, as Westin's: "
        f"in the static shape {tension:.4g} N at the sheave and {depth:.4g} m deep, on the drag across alone "
        f"{tension_1:.4g} N and {depth_1:.4g} m",
        "Give drag_amplification_of: normal for a factor of a measured or printed C_D, both for one tuned so, "
        "docs/drag.md",
    )


def drag_warnings(scene: Scene, speed: float) -> Iterator[Problem]:
    """Drag laws outside the range that their source gives: kind of cable, constant C_D, Re and angle of the flow.

    Re and angle are those of the static shape of the start, computed where they can matter at all; speed [m/s] of the
    water past the ship.
    """
    asked = dict[int, Law]()
    fastest = _fastest(scene)
    for i, (name, section) in enumerate(scene.cable.sections.items()):
        own, key = dressed(section), f"cable.sections.{name}"
        law, constant = LAWS[own.drag_law], own.drag_coefficient
        if section.fairing.value not in law.fairing:
            yield Problem(
                f"{key}.drag_law",
                f"= {own.drag_law.value} is of a cable with fairing: {' or '.join(law.fairing)} ({law.source}), "
                f"the section has fairing: {section.fairing.value}, which it does not describe",
                "Leave drag_law out for that of the fairing, or correct one of the two",
            )
        if constant is not None and not law.min_drag <= constant <= law.max_drag:
            yield Problem(
                f"{key}.drag_coefficient",
                f"= {constant:g} is outside {law.min_drag:g} to {law.max_drag:g}, the range of {law.source}, "
                f"for the law {own.drag_law.value}",
                "Check it, or take drag_law: crossflow, which takes any constant",
            )
        fast = material_rows(scene.cable, section, scene.water, scene.gravity)[RE_FACTOR] * fastest
        of_re = constant is None and (law.min_re > 0.0 or fast > law.max_re)
        if of_re or law.min_angle > 0.0:
            asked[i] = law
    if asked and fastest > STILL:
        shape = layout_of(scene).shape()
        sections = list(scene.cable.sections.items())
        for i, law in asked.items():
            yield from _outside(scene, shape, i, *sections[i], law, speed)


def _outside(
    scene: Scene, shape: TowShape, i: int, name: str, section: Section, law: Law, speed: float
) -> list[Problem]:
    """Cautions of section i where Re or angle of the flow in the static shape is outside the law's range."""
    here = (shape.section == i) & shape.wet & (np.linalg.norm(shape.flow, axis=1) > STILL)
    if not here.any():
        return []
    flow, tangent = shape.flow[here], shape.force[here] / shape.tension[here, None]
    along = (flow * tangent).sum(1)
    across = np.linalg.norm(flow - along[:, None] * tangent, axis=1)
    re = material_rows(scene.cable, section, scene.water, scene.gravity)[RE_FACTOR] * across
    angle = np.degrees(np.arctan2(across, np.abs(along)))
    own, found = dressed(section), []
    if own.drag_coefficient is None and (re.min() < law.min_re or re.max() > law.max_re):
        given = f"{law.min_re:g} and more" if np.isinf(law.max_re) else f"up to {law.max_re:g}"
        found.append(f"Re of the flow across the cable is {re.min():.3g} to {re.max():.3g}, the range {given}")
    if angle.min() < law.min_angle:
        found.append(
            f"the angle between cable and flow is {angle.min():.3g} to {angle.max():.3g} deg, the range "
            f"{law.min_angle:g} to 90 deg"
        )
    return [
        Problem(
            f"cable.sections.{name}.drag_law",
            f"= {own.drag_law.value} is used outside its range ({law.source}): in the static shape at {speed:.3g} m/s "
            f"{text}: {law.outside}",
            "Take a law that covers it (docs/drag.md), or read what depends on this drag as an estimate",
        )
        for text in found
    ]
