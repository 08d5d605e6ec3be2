"""Cautions about numbers that do not do what they seem to: damping without effect, a body that may swing by itself."""

from __future__ import annotations

from ..physics.cable import Cable
from ..physics.section import material_of
from .problem import Problem
from .scene import Scene

SWING = 2.0  # rad/s; swings of a tow are slower


def damping_cautions(cable: Cable) -> list[Problem]:
    """Bending damping without bending stiffness: it is that stiffness times a time, so there is none."""
    limp = dict[str, float]()
    for name, section in cable.sections.items():
        own = material_of(cable, section)
        if own.bending_damping > 0.0 and own.bending_stiffness == 0.0:
            limp["cable" if section.bending_damping is None else f"cable.sections.{name}"] = own.bending_damping
    return [
        Problem(
            f"{key}.bending_damping",
            f"= {damping:g} N m^2 s has no effect where bending_stiffness is 0 N m^2: the damping acts on the rate of "
            "the bending energy, and there is none",
            "Give bending_stiffness above 0 N m^2, or leave bending_damping out",
        )
        for key, damping in limp.items()
    ]


def swing_cautions(scene: Scene, speed: float) -> list[Problem]:
    """Bodies whose added mass across drives a swing by more than their drag across damps it; speed past them [m/s].

    A body that swings with v sin(w t) turns into the flow a little late, and the turning of its axes pulls it on with
    (m_y - m_x) w^2 t/(1 + w^2 t^2) v, t its time constant: theory.md, section 7.
    """
    found = []
    for key, body in (("towbody", scene.towbody), *((f"bodies.{k}", body) for k, body in scene.bodies.items())):
        lag = SWING * body.flow_time_constant
        drives = (body.added_mass[1] - body.added_mass[0]) * SWING * lag / (1.0 + lag**2)
        damps = 0.5 * scene.water.density * body.drag_area[1] * speed
        if speed > body.least_flow_speed and drives > damps:
            found.append(
                Problem(
                    f"{key}.added_mass",
                    f"across is {body.added_mass[1]:g} kg, {body.added_mass[1] - body.added_mass[0]:g} kg more than "
                    f"ahead: while it turns into the flow in {key}.flow_time_constant = {body.flow_time_constant:g} s "
                    f"that drives a swing to the side with up to {drives:.3g} N s/m, more than the {damps:.3g} N s/m "
                    f"that its drag_area across damps at {speed:.3g} m/s: it may swing by itself",
                    "Check added_mass and drag_area of the same body, or make flow_time_constant longer",
                )
            )
    return found
