"""The contact law and the groove by themselves: a bounce, and the heel at which a slack cable climbs out."""

from __future__ import annotations

from math import cos, pi, radians, sin, sqrt

import numpy as np

from cable_sim_ros.sim.rig.rig import Rig, RigError, cable_of, load_of

from ..bend import Bend, Walk, distributed, drum
from ..cables import uniform
from ..contact_points import contact_points
from .family import Case, Level, Values, family

LENGTH = 1.0  # m of the straight cable that falls flat
SAMPLES = 50  # steps of the coarsest mesh over the time scale of the contact
PATCH = 0.02  # cable on the crest of the groove over the radius
SEATED = 1e-3  # penetration over radius of the groove's flanks
CLIMBED = 0.05  # height over radius that counts as climbing out
CLOSE = 0.02  # deg to which the heel is bisected on the coarsest level


@family(
    "bounce",
    "mass_kg stiffness_N_m1p5 approach_speed_m_s D_s_m",
    how="a straight cable of 1 m falls flat along the axis of a drum of 1000 m radius: uniform penetration, so "
    "that mass and contact stiffness per length times the length are those of the point mass; step 1/50 of the "
    "contact's time scale, in real time too (the shipped step is longer than the contact)",
)
def bounce(case: Case, level: Level) -> Values:
    """Rebound speed, largest penetration and time of contact of one bounce."""
    if case.number("exponent", 1.5) != 1.5:
        return Values({}, 0, 0.0, ["the product's contact law has the exponent 1.5 only"])
    mass, k, speed = case.numbers("mass_kg stiffness_N_m1p5 approach_speed_m_s")
    radius = 1000.0
    surface = drum(radius, 1.0)
    surface["stiffness"], surface["damping"] = k / LENGTH, case.number("D_s_m")
    cable = cable_of([{"length": LENGTH, "elements": 1}], mass_per_length=mass / LENGTH, axial_stiffness=1e3 * mass)
    scale = (mass * mass / (k * k * speed)) ** 0.2  # s, of the undamped bounce
    rig = Rig(
        cable, held={}, tension=k * (speed * scale) ** 1.5, gravity=case.number("gravity", 0.0), surfaces=[surface]
    )
    y, each = rig.arc - 0.5 * LENGTH, (rig.nodes, 1)
    crosswise = np.stack([0.0 * y, y, 0.0 * y + radius], 1)
    rig.place(crosswise, np.tile((0.0, 1.0, 0.0), each), v=np.tile((0.0, 0.0, -speed), each))
    rig.balance()
    step = scale / (SAMPLES << level.k)
    walk, deep, seen = Walk(rig), 0.0, [(0.0, 0.0, -speed)]
    while walk.time < 20.0 * scale:
        walk.step(step)
        depth, rise = -float(contact_points(rig).gap.mean()), float(rig.state.v[0, 2])
        seen.append((walk.time, depth, rise))
        deep = max(deep, depth)
        if depth <= 0.0:
            break
    else:
        return Values({}, 1, step, ["the mass did not come off the surface again"])
    (t0, d0, v0), (t1, d1, v1) = seen[-2:]
    fraction = d0 / (d0 - d1)
    # largest penetration: the cubic through position and speed of the two samples about the turn
    i = next(n for n in range(1, len(seen)) if seen[n][2] >= 0.0)
    report = {
        "rebound speed": v0 + fraction * (v1 - v0),
        "largest penetration": turn(seen[i - 1], seen[i], deep),
        "contact time": t0 + fraction * (t1 - t0),
    }
    return Values(report, 1, step, walk.note(step))


def turn(before: tuple, after: tuple, deep: float) -> float:
    """Largest depth between two samples (time, depth, rise) by Hermite interpolation."""
    (t0, d0, v0), (t1, d1, v1) = before, after
    h, x = t1 - t0, np.linspace(0.0, 1.0, 201)
    depth = (
        (1 + 2 * x) * (1 - x) ** 2 * d0
        - h * x * (1 - x) ** 2 * v0
        + x * x * (3 - 2 * x) * d1
        - h * x * x * (x - 1) * v1
    )
    return max(deep, float(depth.max()))


@family(
    "groove climb",
    "groove_half_angle_deg mass_per_length_kg_m radius_to_centreline_m tension_N",
    how="a piece of cable of 2 % of the radius on the crest of a groove as deep as four radii, held along the "
    "groove only; the sheave is heeled (or a line load across grows) and the piece settled anew, bisected "
    "between rest and climbing by 5 % of the radius",
    growth=2.0,
)
def climb(case: Case, level: Level) -> Values:
    """Heel and line loads beyond which a cable does not stay in its groove."""
    half, radius = radians(case.number("groove_half_angle_deg")), case.number("radius_to_centreline_m")
    mass, gravity = case.number("mass_per_length_kg_m"), case.gravity
    of, close, elements = {}, CLOSE / (1 << level.k), 2 << level.k
    rest = Crest(radius, half, mass, gravity, case.number("tension_N"), elements)

    def heeled(angle: float) -> bool:
        return rest.stays(angle, 0.0)

    names = {o.name: o.name for o in case.outputs}
    if any("heel" in n or "ratio" in n for n in names):
        low, _ = bisect(heeled, 0.0, 0.5 * pi, radians(close))
        heeled(low)
        ratio = rest.ratio()
        for name in names:
            if name.startswith("heel angle at climb-out"):
                of[name] = float(np.degrees(low)) + 0.5 * close
            elif "ratio" in name:
                of[name] = ratio
    for name, found in case.asked(r"lateral line load that climbs out at ([\d.eE+-]+) N tension.*"):
        tension = float(found[1])
        loaded = Crest(radius, half, mass, gravity, tension, elements)
        weight = tension / radius + mass * gravity
        low, high = bisect(
            lambda p, crest=loaded: crest.stays(0.0, p), 0.0, 100.0 * weight, 1e-3 * weight / (1 << level.k)
        )
        of[name] = 0.5 * (low + high)
    return Values(of, elements, 0.0)


def bisect(stays, low: float, high: float, close: float) -> tuple[float, float]:
    """Largest load that stays and smallest that does not, ``close`` to each other."""
    while high - low > close:
        middle = 0.5 * (low + high)
        if stays(middle):
            low = middle
        else:
            high = middle
    return low, high


class Crest:
    """A piece of cable on the crest of a heeled groove."""

    def __init__(self, radius: float, half: float, mass: float, gravity: float, tension: float, elements: int):
        arc = PATCH * radius
        self.bend = Bend(radius, -0.5 * PATCH, 0.5 * PATCH, 0.0)
        line_load = tension / radius + mass * gravity
        cable = uniform(arc, elements, mass, 1e4 * line_load * radius)
        self.rig = Rig(
            cable,
            # along the groove: there is no friction, and the crest is a hill
            held={n: "x" for n in range(elements + 1)},
            tension=line_load * arc,
            gravity=gravity,
            surfaces=[drum(radius, line_load * radius, half_angle=half, depth=4.0 * radius, penetration=SEATED)],
        )
        self.radius, self.tension = radius, tension
        self.wait = 8.0 * sqrt(radius * mass / max(line_load, 1e-9))

    def stays(self, heel: float, across: float) -> bool:
        """Does the piece, settled from its seat, rest there under this heel [rad] and line load across [N/m]?"""
        rig, surface = self.rig, self.rig.state.surfaces[0]
        ey, ez = np.array((0.0, cos(heel), -sin(heel))), np.array((0.0, sin(heel), cos(heel)))
        surface["axis"] = ey
        r, g = self.bend.nodes(rig.arc)
        turned = np.stack([np.array((1.0, 0.0, 0.0)), ey, ez])
        r, g = r @ turned, g @ turned
        rig.place(r, g)
        rows = distributed(rig.arc, np.tile(across * ey, (rig.nodes, 1)))
        for node, sign in ((0, -1.0), (rig.nodes - 1, 1.0)):
            # the lumped line load turns an end: the moment of the consistent load against it
            moment = -sign * across * (rig.arc[1] - rig.arc[0]) ** 2 / 12.0 * np.cross(g[node], ey)
            rows.append(load_of(node, sign * self.tension * g[node], moment))
        rig.reload(rows)
        try:
            rig.settle(longest=self.wait, steps=60)
        except RigError:
            pass  # still moving: how far it came decides
        gap = contact_points(rig).gap
        return bool(np.isfinite(gap).all() and np.abs(gap).max() < CLIMBED * self.radius)

    def ratio(self) -> float:
        """Line load across over line load outward of the state at hand, as the groove gives it."""
        force, ey = contact_points(self.rig).resultant, self.rig.state.surfaces["axis"][0]
        across = float(force @ ey)
        return abs(across) / float(np.linalg.norm(force - across * ey))
