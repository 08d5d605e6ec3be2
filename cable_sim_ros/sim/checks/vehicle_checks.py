"""Checks of a vehicle at the far end of the cable, ``towbody.model: vehicle``; problems stop a scene."""

from __future__ import annotations

from collections.abc import Iterator
from math import radians

from ...physics.towbody import BodyModel, Towbody
from ...physics.vehicle import Vehicle
from ..inputs import MAX_PITCH
from ..layout import Layout
from ..problem import Problem
from ..scene import Scene
from ..statics.vehicle_shape import attachment_of, max_tension, mean_compliance, pose_of, reach_problem

DRAWN = "length", "diameter"  # of a picture


def vehicle_problems(scene: Scene) -> Iterator[Problem]:
    """What makes a vehicle senseless, whatever the route of its cable is."""
    for name, body in scene.bodies.items():
        if body.model is BodyModel.VEHICLE:
            yield Problem(
                f"bodies.{name}.model",
                "= vehicle is a body on the line: only the far end of the cable is driven from outside",
                "Give towbody.model: vehicle, or make the cable end here",
            )
    if scene.towbody.model is not BodyModel.VEHICLE:
        if scene.vehicle != Vehicle():
            first = next(key for key, value in scene.vehicle if value != getattr(Vehicle(), key))
            yield Problem(
                f"vehicle.{first}",
                f"is given, and towbody.model = {scene.towbody.model.value}: there is no vehicle",
                "Give towbody.model: vehicle, or leave the block out",
            )
        return
    bare = Towbody.model_validate({"model": "vehicle"})
    if given := [key for key, value in scene.towbody if value != getattr(bare, key) and key not in DRAWN]:
        yield Problem(
            f"towbody.{given[0]}",
            f"is given to a body of model vehicle, of which the pose alone counts: {', '.join(given)} would do nothing",
            "Leave them out; the vehicle's weight and drag are those of its own simulator",
        )
    if scene.vehicle.position is None:
        yield Problem(
            "vehicle.position",
            "is missing (reference point at the start, from the ship: ahead, to port, up from the water surface)",
            "Give three numbers in m, for example `position: [-40.0, 0.0, -30.0]`",
        )
    if abs(radians(scene.vehicle.attitude_deg[1])) > MAX_PITCH:
        yield Problem(
            "vehicle.attitude_deg",
            f"has a pitch of {scene.vehicle.attitude_deg[1]:g} deg: roll and yaw have no meaning near 90 deg",
            "Give it in [-80, 80] deg",
        )


def driven_problems(layout: Layout) -> Iterator[Problem]:
    """A vehicle that begins where its cable does not reach, or in the seabed."""
    scene = layout.scene
    if scene.vehicle.position is None:
        return
    yaw = radians(scene.ship.heading_deg)
    strain = max_tension(scene) * mean_compliance(scene)
    found = reach_problem(scene, attachment_of(scene, pose_of(scene, yaw)), yaw, layout.route.scope, strain)
    if found:
        text, _, remedy = found.partition(": ")
        yield Problem("vehicle.position", f"cannot be: {text}", remedy[:1].upper() + remedy[1:])
