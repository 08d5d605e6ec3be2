"""Checks of the bodies with an attitude of their own, ``model: rigid``: what no body has, and what would surprise."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, inf, radians, sin, sqrt

import numpy as np

from ...physics.inputs import MAX_WINGS
from ...physics.towbody import BodyModel, Towbody
from ...physics.wing import Wing, flap_effect
from ..problem import Limit, Problem, idle
from ..scene import Scene
from ..tables.material import bodies_of
from ..tables.rigid_tables import SLOPE_OF_A_TAIL, added_of, extent, hull_centre, inertia_of, wings_of
from .added_mass_checks import added_mass_problems, added_mass_warnings, semidefinite
from .section_checks import name_problems

NEEDED = "inertia", "centre_of_gravity", "centre_of_buoyancy"
OF_RIGID = (
    *NEEDED,
    "products_of_inertia",
    "hull_centre",
    "added_inertia",
    "added_matrix",
    "added_matrix_point",
    "crossflow_coefficient",
    "wings",
)
FLAP = "flap", "flap_range", "flap_rate", "flap_timeout", "flap_neutral"
AT_CENTRE = 1e-3  # of the length: a tow point closer to both centres is at them


def attitude_problems(scene: Scene) -> Iterator[Problem]:
    """What makes a body with an attitude senseless, and keys of one given to a level body."""
    if len(wings := wings_of(scene)) > MAX_WINGS:
        text = f"and those before it are {len(wings)} wings on one line, at most {MAX_WINGS} are computed"
        yield Problem(f"{wings[-1].key}.wings.{wings[-1].name}", text, "Leave some out, or make one of several")
    for key, body in bodies_of(scene).items():
        if body.model is BodyModel.RIGID:
            yield from _rigid_problems(scene, key, body)
        else:
            yield from idle(
                key, body, OF_RIGID, "a body of model level is a point without attitude", f"{key}.model: rigid"
            )


def _rigid_problems(scene: Scene, key: str, body: Towbody) -> Iterator[Problem]:
    missing = [name for name in NEEDED if getattr(body, name) is None]
    for name in missing:
        about = type(body).model_fields[name].description
        yield Problem(f"{key}.{name}", f"is missing ({about}): a body of model rigid needs it", "Give three numbers")
    yield from name_problems(f"{key}.wings", "wing", body.wings)
    if missing:
        return
    inertia = inertia_of(body)
    if not semidefinite(0.5 * float(np.trace(inertia)) * np.eye(3) - inertia) or not semidefinite(inertia):
        yield Problem(
            f"{key}.inertia",
            f"= {list(body.inertia or ())} kg m^2 with products_of_inertia = {list(body.products_of_inertia)} kg m^2 "
            "is that of no body: each principal moment is at most the sum of the two others",
            "Check both, and the signs of the products: they are the integrals of xy, xz and yz themselves",
        )
    yield from added_mass_problems(scene, key, body)
    length, _ = extent(body, scene.gravity, scene.water.density)
    centres = np.array([body.centre_of_gravity, body.centre_of_buoyancy], float)
    farthest, lead = float(np.abs(centres).max()), "and centre_of_buoyancy are # off the tow point"
    yield from Limit(f"{key}.centre_of_gravity", farthest, ">=", AT_CENTRE * length, "m", lead=lead).problems(
        "neither weight nor cable would hold an attitude",
        "Give both from the tow point, x forward, y to port, z up; a body that hangs has them below it",
    )
    why = "a body of model rigid has its lift from its wings, by their angles to the flow"
    yield from idle(key, body, ["lift_area"], why, f"{key}.wings")
    for name, wing in body.wings.items():
        yield from _flap_problems(f"{key}.wings.{name}", wing)


def _flap_problems(place: str, wing: Wing) -> Iterator[Problem]:
    if wing.flap_share == 0.0:
        yield from idle(place, wing, FLAP, "it is of a wing without a flap", "flap_share")
        return
    worth = wing.stall_angle / flap_effect(wing.flap_share)
    share = f"which of a flap of {wing.flap_share:g} of the chord is worth stall_angle = {wing.stall_angle:g} deg"
    for name in ("flap", "flap_range", "flap_neutral"):
        angle = abs(getattr(wing, name) or 0.0)
        stall = Limit(f"{place}.{name}", angle, "<=", worth, "deg", share)
        reach = Limit(f"{place}.{name}", angle, "<=", wing.reach, "deg", "flap_range")
        yield from stall.problems("its lift is not known there", "Give a smaller angle") or reach.problems(
            "", "Give a smaller angle, or a larger flap_range"
        )


def attitude_warnings(scene: Scene, speed: float) -> Iterator[Problem]:
    """Bodies that would hang upside down or turn away from their way through the water; speed past them [m/s]."""
    for key, body in bodies_of(scene).items():
        if body.model is not BodyModel.RIGID or None in (body.centre_of_gravity, body.centre_of_buoyancy):
            continue
        assert body.centre_of_gravity is not None and body.centre_of_buoyancy is not None
        yield from added_mass_warnings(key, body)
        length, diameter = extent(body, scene.gravity, scene.water.density)
        if None in (body.length, body.diameter):
            yield Problem(
                f"{key}.length",
                f"or diameter is not given: drag across, added mass and slope of the moments are those of a hull of "
                f"{length:.3g} m by {diameter:.3g} m, a cylinder of the displaced volume, ten times as long as wide",
                "Give both",
            )
        buoyancy = body.mass * scene.gravity - body.net_weight
        holds = buoyancy * body.centre_of_buoyancy[2] - body.mass * scene.gravity * body.centre_of_gravity[2]
        if holds < 0.0:
            yield Problem(
                f"{key}.centre_of_gravity",
                f"= {body.centre_of_gravity[2]:g} m over the tow point and centre_of_buoyancy at "
                f"{body.centre_of_buoyancy[2]:g} m: weight and buoyancy turn it over with {-holds:.3g} N m/rad, it "
                "hangs upside down",
                "Check the sign of z, up from the tow point",
            )
        if speed > 0.0:
            lead, munk = "have # upright behind the hull's centre", "of aspect ratio 2 that Munk's moment takes in yaw"
            yield from Limit(f"{key}.wings", fin_area(body), ">=", least_fin(scene, body), "m^2", munk, lead).problems(
                "where the tow point is on its axis it may turn across the flow",
                "Give it upright fins at its tail, or a tow point further ahead",
            )


def fin_area(body: Towbody) -> float:
    """Area [m^2] of what holds a body in yaw, as fins of aspect ratio 2: upright, behind the centre of its hull."""
    behind = (wing for wing in body.wings.values() if wing.place[0] < hull_centre(body)[0])
    return sum(wing.area * wing.slope / SLOPE_OF_A_TAIL * sin(radians(wing.dihedral)) ** 2 for wing in behind)


def least_fin(scene: Scene, body: Towbody) -> float:
    """Least area [m^2] of upright fins of aspect ratio 2 at the body's tail: 2 (A_y - A_x)/(rho C_L l), Munk's moment
    against the lift of the fins, l from the tow point to half the length behind the hull's centre."""
    added = added_of(body, scene.gravity, scene.water.density)
    arm = 0.5 * extent(body, scene.gravity, scene.water.density)[0] - hull_centre(body)[0]
    return 2.0 * float(added[1, 1] - added[0, 0]) / (scene.water.density * SLOPE_OF_A_TAIL * max(arm, 1e-3))


def critical_speed(scene: Scene, body: Towbody) -> float:
    """Speed [m/s] above which Munk's moment turns a body over in pitch; infinite where its fins suffice.

    U_c^2 = k_h/(A_z - A_x - rho/2 sum(S C_L l)), k_h of weight and buoyancy, l from the tow point back to the wing: a
    body on its way level, the cable at its tow point.
    """
    assert body.centre_of_gravity is not None and body.centre_of_buoyancy is not None
    added, density = added_of(body, scene.gravity, scene.water.density), scene.water.density
    buoyancy = body.mass * scene.gravity - body.net_weight
    holds = buoyancy * body.centre_of_buoyancy[2] - body.mass * scene.gravity * body.centre_of_gravity[2]
    fins = sum(
        0.5 * density * wing.area * wing.slope * cos(radians(wing.dihedral)) ** 2 * -wing.place[0]
        for wing in body.wings.values()
    )
    turns = float(added[2, 2] - added[0, 0]) - fins
    return sqrt(max(holds, 0.0) / turns) if turns > 0.0 else inf
