"""Contact read-out: what the detected contact points say of the sheave, and how deep drum and sheave are pressed
in."""

from __future__ import annotations

from math import atan2
from typing import NamedTuple

from ..compiler.jit import driver, inline
from .contact import LOADED
from .contact_surface import DRUM, ON_GROUND, ON_SHIP, gap, solid
from .instruments import drum_torque
from .ship import unrotate
from .state import ARC, NOW, Q
from .swivel import rolled
from .vec import at3, cross, dot, row3

NOT_MOVING = (0.0, 0.0, 0.0)
COARSE, COARSE_DRUM = 0.4, 1.0  # element length over radius of sheave and drum


class Reading(NamedTuple):
    """The sheave as its contact points show it; lengths are of unstretched cable."""

    rows: int  # of the contact table
    loaded: int  # contact points loaded in the groove
    force: tuple  # N, resultant on the sheave, world axes
    total: float  # N, of both halves, without direction
    first: float  # m, first and last loaded arc length
    last: float
    nearest: float  # m, arc length nearest to the sheave above its axis
    clearance: float  # m, groove clearance there
    deepest: float  # m
    coarse: bool
    length: float  # m, loaded


@inline
def in_block(model, state, v):
    """A vector of base_link in the axes of one that has turned with the block of the sheave."""
    swivel = model.settings[0].swivel
    return rolled(swivel, -state.memory[NOW].swung.angle, v) if swivel.on != 0 else v


@driver
def read_sheave(model, state, table):
    """Stations of the sheave into the rows of a contact table; returns a Reading."""
    i = model.settings[0].sheave
    surface, found, arc = state.surfaces[i], state.detected[i], state.nodes[NOW, ARC, :, 0]
    coord = state.memory[NOW].ship.motion.coord
    rows, loaded = 0, 0
    fx, fy, fz, total = 0.0, 0.0, 0.0, 0.0
    first, last, deepest, coarse, length = 0.0, 0.0, 0.0, found.coarse != 0, 0.0
    nearest, where, spare = 1e300, 0.0, -model.settings[0].groove_depth
    for j in range(found.first, found.end):
        s = state.contact_points[j]
        f1, f2, n1, n2, rub = s.load_own, s.load_other, s.normal_own, s.normal_other, s.rub
        rel = unrotate(coord, at3(s.rel, 0))
        own = in_block(model, state, rel)
        if abs(s.height) < nearest and own[2] > 0.0:
            nearest, where, spare = abs(s.height), s.place, s.clearance
        if f1 + f2 > LOADED:
            fx -= s.length * (f1 * n1[0] + f2 * n2[0] + rub[0])
            fy -= s.length * (f1 * n1[1] + f2 * n2[1] + rub[1])
            fz -= s.length * (f1 * n1[2] + f2 * n2[2] + rub[2])
            total += s.length * (f1 + f2)
            deepest = max(deepest, max(s.depth_own if f1 > 0.0 else 0.0, s.depth_other if f2 > 0.0 else 0.0))
            coarse = coarse or arc[s.element + 1] - arc[s.element] > COARSE * surface.radius
            if s.clearance > 0.0:
                first = s.place if loaded == 0 else first
                last = s.place
                loaded += 1
                length += s.length
        if rows < table.shape[0]:
            table[rows, 0], table[rows, 1], table[rows, 2] = rel
            table[rows, 3] = atan2(-own[0], own[2])
            table[rows, 4], table[rows, 5] = (f1, f2) if s.side > 0.0 else (f2, f1)  # port is at +e_y
            table[rows, 6] = s.height
            table[rows, 7] = s.place
            table[rows, 8] = s.length
            rows += 1
    return Reading(rows, loaded, (fx, fy, fz), total, first, last, where, spare, deepest, coarse, length)


@driver
def rub_moment(state, i):
    """Moment [N m] of the friction of round surface i on the cable about its axis."""
    axis, moment = at3(state.surfaces[i].axis, 0), 0.0
    for j in range(state.detected[i].first, state.detected[i].end):
        s = state.contact_points[j]
        moment += s.length * dot(cross(at3(s.rel, 0), at3(s.rub, 0)), axis)
    return moment


@inline
def pull_of(drum, state):
    """Torque of the cable on the drum [N m]: of its end, at the angle where its first node stands, and by friction."""
    angle = drum.tangent if drum.feeds != 0 else drum.angle_0 - state.memory[NOW].winch.length / drum.radius
    torque = drum_torque(drum, angle, state)
    for i in range(state.surfaces.shape[0]):
        s = state.surfaces[i]
        if s.kind == DRUM and s.carrier == ON_SHIP and s.friction > 0.0:
            torque += drum.side * rub_moment(state, i)
    return torque


@driver
def read_drums(state):
    """Deepest penetration of the drums [m], and whether an element too long for its drum lies on one."""
    deepest, coarse, arc = 0.0, False, state.nodes[NOW, ARC, :, 0]
    for i in range(state.surfaces.shape[0]):
        if state.surfaces[i].kind == DRUM:
            coarse = coarse or state.detected[i].coarse != 0
            for j in range(state.detected[i].first, state.detected[i].end):
                s = state.contact_points[j]
                if s.depth_own > 0.0:
                    deepest = max(deepest, s.depth_own)
                    length = arc[s.element + 1] - arc[s.element]
                    coarse = coarse or length > COARSE_DRUM * state.surfaces[i].radius
    return deepest, coarse


@driver
def read_ground(line, state):
    """Length of cable that lies on the ground [m], and whether a body does."""
    length, body = 0.0, False
    for i in range(state.surfaces.shape[0]):
        s = solid(state.surfaces[i])
        if state.surfaces[i].carrier == ON_GROUND:
            for j in range(state.detected[i].first, state.detected[i].end):
                length += state.contact_points[j].length if state.contact_points[j].depth_own > 0.0 else 0.0
            for k in range(line.bodies.shape[0]):
                if line.bodies[k].rigid >= 0:
                    body = body or state.attitude[NOW, line.bodies[k].rigid].ground > 0.0
                else:
                    body = body or gap(s, row3(state.nodes[NOW, Q], line.body_nodes[k]), NOT_MOVING).own.depth > 0.0
    return length, body
