"""Contact surfaces: gap, normal and surface speed of drum, V-groove sheave and seabed, Westin (2018) (94)-(102).

Geometry apart from law (contact.py). A surface is a record of a kind: centre, velocity, spin and axis in the world,
radius of the seated centreline, slope s of the flanks. With rel = r - c: y = rel.e_y, e_r and rho from the remainder,
h = rho - R.

GROOVE: two halves, mirror images, each a solid ring as the centreline meets it: its flank n = -+cos(s) e_y + sin(s)
e_r, delta = |y| cos s - h sin s, a round rim, and its cheek, delta = half width - |y|; (100) is printed in the wrong
plane. Flank and cheek meet inside below the crest, nowhere nearer to the outside than the rim is round. The rim is what
(105) cuts off, which makes Newton unsolvable (trap T4); on it the normal turns from that of the flank to that of the
cheek. DRUM: the groove with s = 90 deg, one flank and no rim. FLOOR: a level plane through the centre.
"""

from __future__ import annotations

from math import cos, radians, sin, sqrt
from typing import NamedTuple

import numpy as np

from ..compiler.jit import inline
from .parameter import REQUIRED, Block, choice, quantity
from .vec import at3, axpy, cross, dot, norm, scale, sub
from .winch import DrumModel

DRUM, GROOVE, FLOOR = range(3)  # kinds
ON_SHIP, ON_GROUND = range(2)  # what carries a surface
NO_TOP = 1e30
SHEAVE_ROW = 0  # of the surfaces of a scene

SURFACE = np.dtype(
    [
        ("kind", "i8"),
        ("carrier", "i8"),
        ("centre", "f8", 3),  # m, and its velocity [m/s], where the cable is simulated
        ("speed", "f8", 3),
        ("spin", "f8", 3),  # rad/s
        ("axis", "f8", 3),  # unit
        ("body", "f8", 3),  # m, the centre in axes of the carrier
        ("radius", "f8"),  # m, of the seated centreline
        ("slope_sin", "f8"),
        ("slope_cos", "f8"),
        ("rim", "f8"),  # m, radius of the round rim as the centreline meets it
        ("top", "f8"),  # m, height of the top of the groove over the seat
        ("crest", "f8"),  # m, |y| beyond which a point is beside the groove
        ("stiffness", "f8"),  # N/m^2.5
        ("damping", "f8"),  # s/m
        ("friction", "f8"),  # Coulomb fraction of the normal load
        ("grip", "f8"),  # that of the groove, and that of a bearing which bears all of the load; 0: of no bearing
        ("bearing", "f8"),
        ("slip", "f8"),  # m/s, slip at which 0.7 of the friction acts, above zero where there is friction
    ],
    align=True,
)


class Sheave(Block):
    position: tuple[float, float, float] = quantity(
        REQUIRED, "m", -200.0, 200.0, "sheave centre in base_link (x forward, y left, z up)", "Westin Table 8"
    )
    radius: float = quantity(REQUIRED, "m", 0.005, 10.0, "radius at the root of the groove", "Westin Table 8")
    groove_depth: float = quantity(0.01, "m", 1e-4, 1.0, "depth of the groove", "Westin Table 8")
    throat_angle_deg: float = quantity(60.0, "deg", 5.0, 170.0, "angle between the flanks", "Westin Table 8")
    rim_radius: float = quantity(
        0.005,
        "m",
        0.0,
        0.5,
        "rounding of the rim, from the flank into the cheek; reaching at most half-way down the groove",
        "no source: half the shipped cable's diameter",
    )
    friction: float = quantity(
        0.0,
        "1",
        0.0,
        1.0,
        "Coulomb friction of the cable in the groove, of the load on each flank: what holds it before it slides",
        "off: as Westin; no source for a value, 0.1 to 0.2 of steel on steel",
        configure=False,
    )
    bearing_friction: float = quantity(
        0.0,
        "1",
        0.0,
        100.0,
        "friction of the bearing, of the resultant that it bears: that of the journal times its radius over that of "
        "the sheave; where it is more than the groove holds, the sheave stands",
        "off: as Westin; journal 0.1 in a plain bearing, Feyrer (2007) 3.5.1",
        configure=False,
    )
    swivel: bool = choice(
        False, "does the block turn about the line of the inboard cable, after the one that leaves it"
    )
    swivel_friction: float = quantity(
        0.0,
        "m",
        0.0,
        1.0,
        "friction of the swivel: its coefficient times the radius of its bearing",
        "choice: it turns freely; a plain bearing of 30 mm with 0.1 has 0.003",
    )
    swivel_time: float = quantity(
        0.2,
        "s",
        0.01,
        60.0,
        "time constant with which the block comes after the cable",
        "choice: a quarter of the period of a block of 50 kg under 3 kN",
    )


class Seabed(Block):
    depth: float | None = quantity(
        None, "m", 0.1, 12000.0, "depth of the level seabed below the mean water surface; none: no seabed"
    )
    friction: float = quantity(
        0.3, "1", 0.0, 2.0, "Coulomb friction of cable and towbody on the seabed, of the normal load", "no source: sand"
    )
    slip_speed: float = quantity(
        0.01, "m/s", 1e-4, 1.0, "slip at which 0.71 of the friction acts; below it what lies there creeps"
    )
    penetration: float = quantity(
        0.05, "m", 1e-3, 1.0, "how deep cable and towbody settle under their own wet weight; it sets the stiffness"
    )
    damping: float = quantity(1.0, "s/m", 0.0, 100.0, "Hunt-Crossley damping of the seabed")


END_LOAD = 3.0  # line load at the ends of the arc over T/R: there bending adds a concentrated reaction


def stiffness(tension: float, radius: float, slope_sin: float, flanks: int, penetration: float) -> float:
    """k [N/m^2.5] for which END_LOAD times the line load T/(flanks R sin s) of a flank presses in ``penetration``."""
    return END_LOAD * tension / (flanks * radius * slope_sin) / penetration**1.5


def surface_row(
    position,
    seat_radius: float,
    throat_angle: float | None,
    groove_depth: float,
    rim: float,
    stiffness: float,
    damping: float,
    friction: float = 0.0,
    slip: float = 0.001,
) -> np.ndarray:
    """A drum or sheave as a SURFACE record: centre in base_link [m], radius of the seated centreline [m], throat angle
    [rad] (None: drum), SI units. It stands where its carrier's origin is the world's until it is placed.

    rim: radius of the round rim as the centreline meets it, the sheave's own and half a diameter; friction: of the load
    on each flank, against the slip past what the spin of the record turns; slip: at which 0.7 of it acts [m/s].
    """
    row = np.zeros((), SURFACE)
    row["kind"], row["carrier"] = (DRUM if throat_angle is None else GROOVE), ON_SHIP
    row["body"], row["centre"], row["axis"] = position, position, (0.0, 1.0, 0.0)
    row["radius"], row["stiffness"], row["damping"] = seat_radius, stiffness, damping
    row["friction"], row["slip"] = friction, slip
    if throat_angle is None:
        row["slope_sin"], row["rim"], row["top"], row["crest"] = 1.0, 0.0, NO_TOP, NO_TOP
    else:
        slope_sin, slope_cos = sin(0.5 * throat_angle), cos(0.5 * throat_angle)
        rim = min(rim, 0.5 * groove_depth / (1.0 - slope_sin))
        row["slope_sin"], row["slope_cos"], row["rim"], row["top"] = slope_sin, slope_cos, rim, groove_depth
        row["crest"] = (rim + (groove_depth - rim) * slope_sin) / slope_cos
    return row


def floor_row(height: float, stiffness: float, damping: float, friction: float, slip: float) -> np.ndarray:
    """A level floor as a SURFACE record: the height z [m] at which a centreline touches it; stiffness [N/m^2.5], SI."""
    row = np.zeros((), SURFACE)
    row["kind"], row["carrier"] = FLOOR, ON_GROUND
    row["body"] = row["centre"] = (0.0, 0.0, height)
    row["axis"], row["slope_sin"], row["top"], row["crest"] = (0.0, 0.0, 1.0), 1.0, NO_TOP, NO_TOP
    row["stiffness"], row["damping"], row["friction"], row["slip"] = stiffness, damping, friction, slip
    return row


def surfaces_of(scene) -> np.ndarray:
    """SURFACE records of a Scene: sheave, drum where cable lies on its surface, seabed where there is one.

    Stiffness from penetration limits.

    The sheave stands at SHEAVE_ROW.
    """
    c, d, bed = scene.contact, scene.cable.diameter, scene.seabed
    depth, tension = c.penetration_limit * d, c.working_tension
    drum, sheave = scene.winch.drum_radius + 0.5 * d, scene.sheave.radius + 0.5 * d
    throat = radians(scene.sheave.throat_angle_deg)
    k_drum = stiffness(tension, drum, 1.0, 1, depth)
    k_sheave = stiffness(tension, sheave, sin(0.5 * throat), 2, depth)
    rim = scene.sheave.rim_radius + 0.5 * d
    at, groove = scene.sheave.position, scene.sheave.groove_depth
    rows = [surface_row(at, sheave, throat, groove, rim, k_sheave, c.damping, slip=c.slip_speed)]
    rub_sheave(rows[0], scene.sheave)
    if scene.winch.drum == DrumModel.CONTACT:
        brake = scene.winch.drum_friction, c.slip_speed
        rows.append(surface_row(scene.winch.position, drum, None, 0.0, 0.0, k_drum, c.damping, *brake))
    if bed.depth is not None:
        area = 0.25 * np.pi * d**2
        weight = abs(scene.cable.mass_per_length - scene.water.density * area) * scene.gravity
        k = weight / bed.penetration**1.5
        rows.append(floor_row(0.5 * d - bed.depth, k, bed.damping, bed.friction, bed.slip_speed))
    return np.stack(rows)


def check_surfaces(surfaces: np.ndarray) -> np.ndarray:
    """The SURFACE records [n], as given. Raises ValueError for friction that would be no number."""
    for i, row in enumerate(surfaces):
        friction, slip = float(row["friction"]), float(row["slip"])
        if not friction >= 0.0:
            raise ValueError(
                f"surface {i}: friction = {friction:g} is below 0: it would drive the cable; nothing was made. "
                f"Give 0 or more"
            )
        if not slip > 0.0 and (friction > 0.0 or row["kind"] not in (DRUM, GROOVE)):
            raise ValueError(
                f"surface {i}: slip = {slip:g} m/s beside friction = {friction:g}: the friction of a point at rest "
                f"would be no number; nothing was made. Give a slip above 0, as the seabed's 0.01 m/s"
            )
    return surfaces


def sheave_friction(sheave: Sheave) -> float:
    """Friction on each flank along the cable, of the groove or of the bearing of a sheave that turns first, at a small
    wrap: the bearing bears the resultant alone."""
    return min(sheave.friction, _bearing(sheave))


def _bearing(sheave: Sheave) -> float:
    return sheave.bearing_friction * sin(radians(0.5 * sheave.throat_angle_deg))


def rub_sheave(row: np.ndarray, sheave: Sheave) -> None:
    """Friction of groove and bearing into a SURFACE record."""
    row["friction"], row["grip"], row["bearing"] = sheave_friction(sheave), sheave.friction, _bearing(sheave)


class Solid(NamedTuple):
    """A SURFACE record as plain numbers: what is read once before a loop over points."""

    kind: int
    centre: tuple
    speed: tuple
    spin: tuple
    axis: tuple
    radius: float
    slope_sin: float
    slope_cos: float
    rim: float
    top: float
    crest: float
    stiffness: float
    damping: float
    friction: float
    slip: float


@inline
def solid(s):
    """A SURFACE record as a Solid."""
    return Solid(
        s.kind,
        at3(s.centre, 0),
        at3(s.speed, 0),
        at3(s.spin, 0),
        at3(s.axis, 0),
        s.radius,
        s.slope_sin,
        s.slope_cos,
        s.rim,
        s.top,
        s.crest,
        s.stiffness,
        s.damping,
        s.friction,
        s.slip,
    )


class Half(NamedTuple):
    """One half of a surface and a point: penetration [m], unit normal, curvature [1/m] across the groove."""

    depth: float
    normal: tuple
    bend: float


class Gap(NamedTuple):
    """Where a point is to a surface, without forces. A drum or floor has its own half only."""

    own: Half
    other: Half
    slip: tuple  # m/s, velocity of the point relative to the surface
    radial: tuple  # e_r; floor: its normal
    around: tuple  # t = e_y x e_r: the way along which the normal of a round surface turns
    turn: float  # 1/m, how much it does
    rho: float  # m, distance from the axis
    height: float  # m, over the seat
    side: float  # 1 where the point is at +e_y, -1 at -e_y
    y: float  # m, along the axis


NOWHERE = (0.0, 0.0, 0.0)


@inline
def place(rel, ey, radius):
    """Cylinder coordinates of a point relative to a surface: y, e_r, t = e_y x e_r, rho, h."""
    y = dot(rel, ey)
    radial = axpy(-y, ey, rel)
    rho = sqrt(dot(radial, radial) + 1e-30)
    er = scale(1.0 / rho, radial)
    return y, er, cross(ey, er), rho, rho - radius


@inline
def own_half(side, y, h, er, s):
    """The half on the point's own side: flank, rim or cheek."""
    u, w = side * y - s.crest, h - (s.top - s.rim)  # from the middle of the round rim
    reach = sqrt(u * u + w * w + 1e-30)
    rim, cheek = w > 0.0 and u * s.slope_sin + w * s.slope_cos > 0.0, u > 0.0
    across = u / reach if rim else (1.0 if cheek else -s.slope_cos)
    out = w / reach if rim else (0.0 if cheek else s.slope_sin)
    flat = s.rim - u if cheek else side * y * s.slope_cos - h * s.slope_sin
    return Half(
        s.rim - reach if rim else flat, axpy(side * across, s.axis, scale(out, er)), (1.0 / reach if rim else 0.0)
    )


@inline
def other_half(side, y, h, er, s):
    """The half across the groove: its flank, up to the crest of the own half."""
    delta = -(side * y * s.slope_cos + h * s.slope_sin)
    normal = axpy(side * s.slope_cos, s.axis, scale(s.slope_sin, er))
    return Half(delta if side * y < s.crest else 0.0, normal, 0.0)


@inline
def groove_gap(s, r, v):
    """Both halves of a groove at a point r with velocity v."""
    rel = sub(r, s.centre)
    y, er, t, rho, h = place(rel, s.axis, s.radius)
    slip = sub(sub(v, s.speed), cross(s.spin, rel))
    side = 1.0 if y > 0.0 else -1.0
    return Gap(own_half(side, y, h, er, s), other_half(side, y, h, er, s), slip, er, t, 1.0 / rho, rho, h, side, y)


@inline
def drum_gap(s, r, v):
    """A surface without a groove at a point r with velocity v."""
    rel = sub(r, s.centre)
    y, er, t, rho, h = place(rel, s.axis, s.radius)
    slip = sub(sub(v, s.speed), cross(s.spin, rel))
    return Gap(Half(-h, er, 0.0), Half(0.0, NOWHERE, 0.0), slip, er, t, 1.0 / rho, rho, h, 1.0, y)


@inline
def floor_gap(s, r, v):
    """A level plane at a point r with velocity v."""
    h = dot(sub(r, s.centre), s.axis)
    none = Half(0.0, NOWHERE, 0.0)
    return Gap(Half(-h, s.axis, 0.0), none, sub(v, s.speed), s.axis, NOWHERE, 0.0, 1e30, h, 1.0, 0.0)


@inline
def gap(s, r, v):
    """Gap of a Solid of any kind at a point r with velocity v."""
    if s.kind == GROOVE:
        return groove_gap(s, r, v)
    if s.kind == DRUM:
        return drum_gap(s, r, v)
    return floor_gap(s, r, v)


@inline
def out_of_reach(s, middle, reach):
    """Is everything within ``reach`` [m] of a point out of reach of a Solid?"""
    rel = sub(middle, s.centre)
    if s.kind == GROOVE:
        return norm(rel) - reach > s.radius + s.top
    if s.kind == DRUM:
        return norm(axpy(-dot(rel, s.axis), s.axis, rel)) - reach > s.radius
    return dot(rel, s.axis) > reach


@inline
def clearance(gap, s):
    """Distance [m] of a centreline below the top of its groove; beyond a crest minus the distance from it."""
    below = s.top - gap.height
    beyond = s.crest - abs(gap.y)
    return below if beyond >= 0.0 else min(below, beyond)


@inline
def beside(y, h, s):
    """1 or -1 where a centreline is beside the sheave, beyond a crest and nearer the axis than the seat; else 0."""
    if h >= 0.0 or abs(y) <= s.crest:
        return 0.0
    return 1.0 if y > 0.0 else -1.0
