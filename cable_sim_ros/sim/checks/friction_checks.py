"""Friction of the cable on sheave and drum: numbers that act on nothing, and a slip speed too coarse for the winch."""

from __future__ import annotations

from collections.abc import Iterator
from math import exp, radians, sin

from ...physics.contact_surface import sheave_friction
from ...physics.winch import DrumModel
from ..layout import layout_of
from ..problem import Problem
from ..scene import Scene
from ..verdict import Reason, check

# slip speeds: from there on 95 % of the friction acts; part of the run, and of the tension, for which less is borne
IN_PART, BORNE, SEEN = 3.0, 0.05, 1e-3
COARSE_SLIP = 0.05  # of winch.max_rate: a slip speed above it leaves a haul at a fifth of that rate 3 % less friction


def friction_problems(scene: Scene) -> Iterator[Problem]:
    """Friction on a drum that carries no cable."""
    winch = scene.winch
    if winch.drum_friction == 0.0 or winch.drum is DrumModel.CONTACT:
        return
    yield Problem(
        "winch.drum_friction",
        f"= {winch.drum_friction:g} has no cable to act on: with winch.drum = feed the mesh ends where the cable "
        "leaves the drum, which holds it there without slip, and what is wound is no part of it",
        "Leave it out; winch.drum = contact, for travel of a few metres, lays the cable on the drum",
    )


def may_miss(scene: Scene) -> float:
    """Tension at the drum [N] that is missing, at contact.working_tension, where no friction acts; 0: there is none."""
    sheave, winch, tension = scene.sheave, scene.winch, scene.contact.working_tension
    of_drum = tension * (1.0 - exp(-winch.drum_friction * winch.wrap))
    flank = sheave_friction(sheave) / sin(radians(0.5 * sheave.throat_angle_deg))
    if flank == 0.0:
        return of_drum
    layout = layout_of(scene)
    return of_drum + tension * (exp(flank * (layout.leaves - layout.tangent) / layout.route.sheave) - 1.0)


def slow(scene: Scene) -> float:
    """Speed of the pay-out [m/s] below which friction acts in part."""
    return IN_PART * scene.contact.slip_speed


def in_part(scene: Scene, fraction: float) -> tuple[Reason, ...]:
    """Reason where the cable ran slower than `slow` for more than BORNE of a run; fraction: of the run."""
    missing = may_miss(scene)
    if fraction <= BORNE or missing <= SEEN * scene.contact.working_tension:
        return ()
    return (
        check(
            "FRICTION_SLIP",
            f"the winch paid out or hauled in at less than {slow(scene):.3g} m/s for {100.0 * fraction:.3g} % of the "
            f"run (3 times contact.slip_speed), where friction on sheave and drum acts in part: up to {missing:.3g} N "
            f"are missing in the tension at the drum",
        ),
    )


def friction_warnings(scene: Scene) -> Iterator[Problem]:
    """Friction that never acts, or only in part."""
    sheave = scene.sheave
    stands = sheave.friction / sin(radians(0.5 * sheave.throat_angle_deg))
    if sheave.friction > 0.0 and sheave.bearing_friction == 0.0:
        yield Problem(
            "sheave.friction",
            f"= {sheave.friction:g} has no effect: with sheave.bearing_friction = 0 the sheave turns with the "
            "cable, which never slides in its groove",
            f"Give sheave.bearing_friction, for a sheave that stands {stands:.3g} or more, or leave both out",
        )
    if sheave.bearing_friction > 0.0 and sheave.friction == 0.0:
        yield Problem(
            "sheave.bearing_friction",
            f"= {sheave.bearing_friction:g} has no effect: with sheave.friction = 0 the cable slides through a "
            "groove that does not turn, without friction",
            "Give sheave.friction, 0.1 of steel on steel, or leave both out",
        )
    if sheave.swivel_friction > 0.0 and not sheave.swivel:
        yield Problem(
            "sheave.swivel_friction",
            f"= {sheave.swivel_friction:g} m has no effect: the block does not swivel",
            "Give sheave.swivel: true, or leave it out",
        )
    acts, coarse = sheave_friction(sheave) > 0.0 or scene.winch.drum_friction > 0.0, COARSE_SLIP * scene.winch.max_rate
    if acts and scene.contact.slip_speed > coarse:
        yield Problem(
            "contact.slip_speed",
            f"= {scene.contact.slip_speed:g} m/s is above {coarse:.3g} m/s, {COARSE_SLIP:g} of winch.max_rate = "
            f"{scene.winch.max_rate:g} m/s: friction acts in part at most speeds of the winch",
            f"Make it {coarse:.3g} m/s or less",
        )
    elif acts and scene.setpoint.algorithm == "hold":
        yield Problem(
            "contact.slip_speed",
            f"= {scene.contact.slip_speed:g} m/s: while the winch is held (setpoint.algorithm = hold) the cable "
            f"slips no faster than that, and friction acts in part: up to {may_miss(scene):.3g} N at "
            f"contact.working_tension are missing in the tension at the drum",
            "Take the tension at the drum while the winch runs, or make it smaller (docs/limits.md, creep)",
        )
