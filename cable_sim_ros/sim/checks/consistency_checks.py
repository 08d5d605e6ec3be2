"""Numbers that contradict each other although each is in its range: weights and masses, diameter and mass, which way
the ship goes. What cannot be is a problem, what hardly can be a caution.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from ...physics.section import material_of
from ...physics.winch import DrumModel
from ..layout import Layout
from ..problem import Limit, Problem, holds, idle, said
from ..scene import Scene
from ..statics.route import first_angle
from ..tables.current import flow_of
from ..tables.material import bodies_of, termination_weight

ROUNDED = 1.02  # of a dry weight: a data sheet rounds
# kg/m^3 over the full circle of the diameter: floating fibre rope 500, nylon 1150, armoured cable 3000 to 5500, steel
# rope 4000 to 6500, solid steel 7850. A radius given for the diameter makes four times as much
MIN_DENSITY, MAX_DENSITY = 300.0, 9000.0
# kg/m^3, beyond which there is no material at all: foam, osmium. A mass per km or per 100 m is beyond it
NO_MATERIAL = 10.0, 23000.0
# displaced volume over that of the cylinder of length and diameter: a flooded frame, a box
MIN_FILL, MAX_FILL = 0.05, 4.0 / math.pi
MAX_FORWARD = math.radians(45.0)  # of a cable that leads forward under the ship, from the vertical


def weight_problems(scene: Scene) -> list[Problem]:
    """What hangs on the line and is heavier in water than its mass is in air."""
    bodies = bodies_of(scene).items()
    things = [(f"{key}.net_weight", f"{key}.mass", body.net_weight, body.mass) for key, body in bodies]
    for name, section in scene.cable.sections.items():
        key, net = f"cable.sections.{name}.termination", termination_weight(section, scene.gravity)
        things.append((f"{key}_net_weight", f"{key}_mass", net, section.termination_mass))
    return [
        Problem(
            key,
            f"= {net:g} N is more than the dry weight {mass * scene.gravity:.5g} N of {mass_key} = {mass:g} kg: "
            "nothing is heavier in water than in air",
            "Check the units of both" + ("" if "termination" in key else "; a depressor's down-force is its lift_area"),
        )
        for key, mass_key, net, mass in things
        if scene.gravity > 0.0 and mass > 0.0 and net > ROUNDED * mass * scene.gravity
    ]


def density_problems(scene: Scene) -> list[Problem]:
    """Cable lighter or heavier for its diameter than anything there is: a unit, judged before what follows of it."""
    low, high = NO_MATERIAL
    return [
        Problem(
            mass_key,
            f"= {mass:g} kg/m on {diameter_key} = {diameter:g} m makes a cable of {density:.4g} kg/m^3, outside "
            f"{low:g} to {high:g} kg/m^3: there is no such material",
            "Is it in kg/km, and are diameters in m? A steel rope of this diameter has about "
            f"{5000.0 * 0.25 * math.pi * diameter**2:.2g} kg/m",
        )
        for (diameter, mass), (density, diameter_key, mass_key) in _densities(scene).items()
        if not low <= density <= high
    ]


def _densities(scene: Scene) -> dict[tuple[float, float], tuple[float, str, str]]:
    """Of each kind of cable, by diameter and mass per length: density [kg/m^3] over the full circle, and the keys."""
    found: dict[tuple[float, float], tuple[float, str, str]] = {}
    for name, section in scene.cable.sections.items():
        own = material_of(scene.cable, section)
        diameter_key, mass_key = (
            f"cable.sections.{name}.{key}" if getattr(section, key) is not None else f"cable.{key}"
            for key in ("diameter", "mass_per_length")
        )
        density = own.mass_per_length / (0.25 * math.pi * own.diameter**2)
        found.setdefault((own.diameter, own.mass_per_length), (density, diameter_key, mass_key))
    return found


def density_warnings(scene: Scene) -> Iterator[Problem]:
    """Cable lighter or heavier than any material for its diameter."""
    for (diameter, mass), (density, diameter_key, mass_key) in _densities(scene).items():
        if MIN_DENSITY <= density <= MAX_DENSITY:
            continue
        wrong = "a radius, or mm" if density > MAX_DENSITY else "too large, perhaps mm"
        yield Problem(
            diameter_key,
            f"= {diameter:g} m and {mass_key} = {mass:g} kg/m make a cable of {density:.4g} "
            f"kg/m^3, outside {MIN_DENSITY:g} to {MAX_DENSITY:g} kg/m^3 (fibre rope 500 to 1500, steel rope "
            "4000 to 6500, solid steel 7850): its weight and drag in water are those of no cable",
            f"Check both: is the diameter {wrong}?",
        )


def body_warnings(scene: Scene, speed: float) -> Iterator[Problem]:
    """Bodies whose net weight may be in kg, or whose wing lifts; speed of the water past them [m/s]."""
    for key, body in bodies_of(scene).items():
        dry, net = body.mass * scene.gravity, body.net_weight
        if 0.0 < net < body.mass and scene.gravity > 1.0:
            yield Problem(
                f"{key}.net_weight",
                f"= {net:g} N is {100.0 * net / dry:.2g} % of the dry weight {dry:.4g} N of {key}.mass = "
                f"{body.mass:g} kg: a body that nearly floats, {dry / (dry - net):.3g} times as dense as water; "
                f"{net:g} kg would be {net * scene.gravity:.4g} N",
                "Give it in N",
            )
        if body.length is not None and body.diameter is not None and scene.gravity > 0.0:
            displaced = (dry - net) / (scene.gravity * scene.water.density)
            size = 0.25 * math.pi * body.diameter**2 * body.length
            if not MIN_FILL * size <= displaced <= MAX_FILL * size:
                yield Problem(
                    f"{key}.net_weight",
                    f"= {net:g} N and {key}.mass = {body.mass:g} kg displace {displaced:.3g} m^3, "
                    f"{displaced / size:.3g} times the {size:.3g} m^3 of a cylinder of {key}.length = "
                    f"{body.length:g} m and {key}.diameter = {body.diameter:g} m; expected {MIN_FILL:g} to "
                    f"{MAX_FILL:.3g}: weight in the tow and size in the pictures are of two bodies",
                    "Check all four, and their units",
                )
        lift = 0.5 * scene.water.density * body.lift_area * speed**2
        yield from Limit(f"{key}.lift_area", body.lift_area, "<=", 0.0, "m^2").problems(
            f"it lifts the body, with {lift:.4g} N at {speed:.3g} m/s through the water, against {key}.net_weight = "
            f"{net:g} N",
            "A wing that presses down, a depressor's, has a negative one; leave it so if it is to lift",
        )


def height_problems(scene: Scene) -> Iterator[Problem]:
    """Drum or sheave under the mean water surface: cable on them and between them is not modelled as wet."""
    for key, radius in (("winch", scene.winch.drum_radius), ("sheave", scene.sheave.radius)):
        height = getattr(scene, key).position[2] + scene.ship.reference_height
        lead = f"puts the centre of the {'drum' if key == 'winch' else 'sheave'} (radius {radius:g} m) at"
        yield from Limit(f"{key}.position", height, ">=", 0.0, "m", "the water surface", lead).problems(
            "water is not modelled on cable that lies on drum or sheave",
            "z is up from base_link, and ship.reference_height lifts it; check their signs",
        )


def astern(scene: Scene) -> tuple[str, float, float]:
    """What makes the cable lead forward: key, speed [m/s] of the water ahead past the ship, angle [rad] of the free
    cable from the vertical; speed and angle 0 where it leads aft or abeam."""
    yaw = math.radians(scene.ship.heading_deg)
    east, north = flow_of(scene.water, yaw)(0.0)
    ahead = float(east * math.cos(yaw) + north * math.sin(yaw)) - scene.ship.tow_speed
    current = "water.current" if scene.water.current_table.depth is None else "water.current_table"
    key = "ship.tow_speed" if scene.ship.tow_speed < 0.0 else current
    return (key, ahead, first_angle(scene, ahead)) if ahead > 0.0 else (key, 0.0, 0.0)


def astern_problems(scene: Scene) -> Iterator[Problem]:
    """A ship that goes astern so fast that the cable streams forward under it."""
    key, ahead, angle = astern(scene)
    lead = f"= {_value(scene, key)} sends the ship astern at {ahead:.3g} m/s, with the cable forward under it at"
    if key == "ship.tow_speed":
        maximum = math.degrees(MAX_FORWARD)
        yield from Limit(key, math.degrees(angle), "<=", maximum, "deg", "from the vertical", lead).problems(
            "there is no hull in the model for it to lie against",
            "Speed ahead is positive; check the sign, or go slower",
        )


def astern_warnings(scene: Scene) -> Iterator[Problem]:
    """A cable that leads forward: the ship goes slowly astern, or a current from astern overtakes it."""
    key, ahead, angle = astern(scene)
    if ahead <= 0.0:
        return
    if key != "ship.tow_speed":
        if angle <= MAX_FORWARD:
            return
        yield Problem(
            key,
            f"= {_value(scene, key)} overtakes the ship by {ahead:.3g} m/s: the cable leads forward under it, "
            f"about {math.degrees(angle):.0f} deg from the vertical, and nothing keeps it off the hull",
            "Check its direction: it is where the water goes, not where it comes from",
        )
        return
    yield Problem(
        key,
        f"= {scene.ship.tow_speed:g} m/s is the ship going astern: the cable leads forward under the ship, about "
        f"{math.degrees(angle):.0f} deg from the vertical, and nothing keeps it off the hull",
        "Speed ahead is positive; check the sign",
    )


def wrap_problems(layout: Layout) -> Iterator[Problem]:
    """With winch.drum = contact: elements wound whole on the drum that are too long to follow it."""
    winch, wound = layout.scene.winch, layout.route.wound
    maximum = 2.0 * winch.drum_radius
    long = next(
        ((a, b, name) for a, b, name in layout.elements if b <= wound and not holds(b - a, "<=", maximum)), None
    )
    if long is None:
        return
    first, last, name = long
    lead = f"= {winch.wrap:g} rad winds {wound:.4g} m of cable, and with it elements # long of cable.sections.{name}"
    remedy = f"Give cable.sections.{name} more elements, or the drum end a section of its own"
    if first > 0.0:
        remedy = f"Wind less than {first:.4g} m on it by a smaller wrap, or make the section at the drum end longer"
    yield from Limit("winch.wrap", last - first, "<=", maximum, "m", "twice winch.drum_radius", lead).problems(
        "they cannot follow the drum", f"{remedy}; the unit is rad, not deg or turns"
    )


def wrap_warnings(scene: Scene) -> Iterator[Problem]:
    """A wrap that says nothing, as the length that is out is given."""
    winch = scene.winch
    key = "scope" if winch.scope is not None else "cable_on_drum"
    if winch.drum == DrumModel.FEED and getattr(winch, key) is not None:
        yield from idle("winch", winch, ["wrap"], f"winch.{key} {said(winch, key)} says how much cable is out")


def _value(scene: Scene, key: str) -> str:
    if key == "ship.tow_speed":
        return f"{scene.ship.tow_speed:g} m/s"
    east, north = flow_of(scene.water, math.radians(scene.ship.heading_deg))(0.0)
    return f"{[round(east, 6), round(north, 6)]} m/s"
