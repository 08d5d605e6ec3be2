"""A block that swivels: its sheave turns about the line of the cable that comes from the drum, after the one that
leaves it.

A block that hangs from one point, or turns on a hollow pin, comes to rest where its plane holds both cables; as the
inboard one stays where it is, the block turns about it. Statics, without mass: an outboard tension T that leads w out
of that line acts at R (1 - cos w) from it and turns the block with M = T R (1 - cos w) sin w sin(phi), phi: the angle
about the line from the plane of the block to the cable. Dry friction of the swivel holds up to M = a F, F: the
resultant of the cable on the sheave, a: coefficient times radius of the bearing (Coulomb; Feyrer (2007) 3.5.1 of a
journal). The block stays while phi is within what friction holds, else it comes after the cable up to there, as
exp(-t / swivel_time).

Angles are positive where the cable leads to port; zero: the block stands in the plane of the ship.
"""

from __future__ import annotations

from math import asin, atan2, cos, exp, floor, pi, sin, sqrt

import numpy as np

from ..compiler.jit import inline
from .ship import unrotate
from .vec import add, at3, axpy, cross, dot, scale, sub

SWIVEL = np.dtype(
    [
        ("on", "i8"),
        ("point", "f8", 3),  # m, base_link: where the inboard cable comes to the sheave
        # unit vectors in base_link: of the inboard cable outward, down in the block at angle zero, to port
        ("along", "f8", 3),
        ("down", "f8", 3),
        ("port", "f8", 3),
        ("radius", "f8"),  # m, of the seated centreline
        ("friction", "f8"),  # m
        ("time", "f8"),  # s
    ],
    align=True,
)
SWUNG = np.dtype(
    [
        ("angle", "f8"),  # rad, rad/s: of the block
        ("rate", "f8"),
        ("cable", "f8"),  # rad: where the cable leads, and up to which angle from there friction holds the block
        ("hold", "f8"),
    ]
)


def swivel_record(ends: np.ndarray, centre: np.ndarray, radius: float, friction: float, time: float) -> np.ndarray:
    """SWIVEL [] of a sheave at ``centre`` [3] to which the inboard cable comes between the points ``ends`` [2, 3], m
    in base_link; radius [m], friction [m], time [s]."""
    row, arm, way = np.zeros((), SWIVEL), centre - ends[1], ends[1] - ends[0]
    along = way / np.sqrt((way * way).sum())
    down = arm - (arm * along).sum() * along
    down /= np.sqrt((down * down).sum())
    port = np.cross(along, down)
    row["along"], row["down"], row["port"] = along, down, port if port[1] > 0.0 else -port
    row["on"], row["point"], row["radius"], row["friction"], row["time"] = 1, ends[1], radius, friction, time
    return row


@inline
def rolled(rules, angle, v):
    """A vector of base_link turned with a block by ``angle`` [rad]; rules: SWIVEL."""
    along, down, port = at3(rules.along, 0), at3(rules.down, 0), at3(rules.port, 0)
    d, p, c, s = dot(v, down), dot(v, port), cos(angle), sin(angle)
    return axpy(dot(v, along), along, axpy(c * d - s * p, down, scale(s * d + c * p, port)))


@inline
def hinge(rules):
    """Unit vector of base_link about which a positive angle turns."""
    return cross(at3(rules.down, 0), at3(rules.port, 0))


@inline
def swung_to(rules, swung, body):
    """Place [m] and velocity [m/s] in base_link of the point of a block that is at ``body`` at angle zero."""
    arm = rolled(rules, swung.angle, sub(body, at3(rules.point, 0)))
    return add(at3(rules.point, 0), arm), scale(swung.rate, cross(hinge(rules), arm))


@inline
def leads(rules, out):
    """Angle [rad] about the line of the inboard cable at which a cable leads, and sine and cosine of the way out of
    that line; out: unit vector in base_link."""
    d, p = dot(out, at3(rules.down, 0)), dot(out, at3(rules.port, 0))
    return atan2(p, d), sqrt(d * d + p * p), dot(out, at3(rules.along, 0))


@inline
def aim_block(rules, swung, coord, out, tension, load):
    """Take the departing cable in: its direction in the world, its tension [N], its resultant on the sheave [N]."""
    if load > 0.0:
        swung.cable, sine, cosine = leads(rules, unrotate(coord, out))
        held, lever = rules.friction * load, tension * rules.radius * (1.0 - cosine) * sine
        swung.hold = asin(held / lever) if lever > held else pi


@inline
def swing(h, rules, before, swung):
    """Turn a block over a step of h [s]; before: SWUNG at its beginning. One without load stays."""
    off = swung.cable - before.angle
    off -= 2.0 * pi * floor(0.5 * off / pi + 0.5)
    way = off - swung.hold if off > swung.hold else (off + swung.hold if off < -swung.hold else 0.0)
    swung.angle = before.angle + (1.0 - exp(-h / rules.time)) * way
    swung.rate = (swung.angle - before.angle) / h
