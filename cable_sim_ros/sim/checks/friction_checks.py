"""Friction of the cable on sheave and drum: numbers that act on nothing, and a slip speed too coarse for the winch."""

from __future__ import annotations

from collections.abc import Iterator
from math import exp, radians, sin

from ...physics.contact_surface import sheave_friction
from ...physics.winch import DrumModel
from ..layout import layout_of
from ..problem import Limit, Problem, idle
from ..scene import Scene
from ..verdict import Reason, check

# slip speeds: from there on 95 % of the friction acts; part of the run, and of the tension, for which less is borne
IN_PART, BORNE, SEEN = 3.0, 0.05, 1e-3
COARSE_SLIP = 0.05  # of winch.max_rate: a slip speed above it leaves a haul at a fifth of that rate 3 % less friction


def friction_problems(scene: Scene) -> Iterator[Problem]:
    """Friction on a drum that carries no cable."""
    winch = scene.winch
    if winch.drum is DrumModel.FEED:
        why = "with winch.drum = feed the mesh ends where the cable leaves the drum, which holds it there without slip"
        yield from idle("winch", winch, ["drum_friction"], why, "winch.drum: contact, for travel of a few metres")


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
    if sheave.bearing_friction == 0.0:
        why = "with sheave.bearing_friction = 0 the sheave turns with the cable, which never slides in its groove"
        yield from idle(
            "sheave", sheave, ["friction"], why, f"sheave.bearing_friction, {stands:.3g} or more for one that stands"
        )
    if sheave.friction == 0.0:
        why = "with sheave.friction = 0 the cable slides through a groove that does not turn, without friction"
        yield from idle("sheave", sheave, ["bearing_friction"], why, "sheave.friction, 0.1 of steel on steel")
    if not sheave.swivel:
        yield from idle("sheave", sheave, ["swivel_friction"], "the block does not swivel", "sheave.swivel: true")
    if sheave_friction(sheave) == 0.0 and scene.winch.drum_friction == 0.0:
        return
    key, slip, bounds = "contact.slip_speed", scene.contact.slip_speed, f"{COARSE_SLIP:g} of winch.max_rate"
    coarse = Limit(key, slip, "<=", COARSE_SLIP * scene.winch.max_rate, "m/s", bounds).problems(
        "friction acts in part at most speeds of the winch", "Make it smaller"
    )
    yield from coarse
    if not coarse and scene.setpoint.algorithm == "hold":
        yield Problem(
            key,
            f"= {slip:g} m/s: while the winch is held (setpoint.algorithm = hold) the cable slips no faster than that, "
            f"and friction acts in part: up to {may_miss(scene):.3g} N at contact.working_tension are missing in the "
            "tension at the drum",
            "Take the tension at the drum while the winch runs, or make it smaller (docs/limits.md, creep)",
        )
