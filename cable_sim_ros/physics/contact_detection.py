"""Contact detection: every contact point of every surface is visited once a step, and all that is asked of it read
off.

A contact point is a Gauss point of an element within reach of a surface. Groove clearance, a cable that entered its
sheave, depth on the drum, the tick output and its contact table are read from the table of contact points, see
contact_output.py.

Five points of an element of four metres pass a sheave of half a metre without noticing; slack cable brings such
elements onto it. Samples, denser towards its ends, tell: flag COARSE_AT_SURFACE. A load on the part inside, at sixteen
points, was tried: the element cannot bend round the sheave, and Newton fails where it is drawn over it.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from ..compiler.jit import driver, inline, link, opaque
from .contact import LOADED, rubs, touch
from .contact_surface import FLOOR, GROOVE, NO_TOP, beside, clearance, out_of_reach, place, solid
from .hermite import W5, X5, hermite_of, point_of, shape
from .state import ARC, NOW, STEP, Q, V
from .vec import axpy, cross, dot, row3, sub

NOT_ENTERED, DEEP, THROUGH = range(3)  # DETECTED.entered
LONG = 1.5  # radii; of longer elements so many samples are looked at
SAMPLES = 24


@inline
def crossed(s, r, side, h):
    """Was the point that is at ``side`` now on the other side of the sheave h [s] ago, at r?

    The sheave is taken back by its present speed and spin.
    """
    centre, axis = axpy(-h, s.speed, s.centre), axpy(-h, cross(s.spin, s.axis), s.axis)
    y, _, _, _, height = place(sub(r, centre), axis, s.radius)
    return side * beside(y, height, s) < 0.0


@inline
def note(contact_point, surface, element, s, r, touched):
    """Fill one CONTACT_POINT record but for its place and length."""
    contact_point.surface, contact_point.element = surface, element
    g = touched.gap
    rel = sub(r, s.centre)
    for k in range(3):
        contact_point.rel[k] = rel[k]
        contact_point.normal_own[k] = g.own.normal[k]
        contact_point.normal_other[k] = g.other.normal[k]
    contact_point.depth_own, contact_point.depth_other = g.own.depth, g.other.depth
    contact_point.load_own, contact_point.load_other = touched.own.load, touched.other.load
    contact_point.side, contact_point.height = g.side, g.height
    rub = rubs(s, touched) if s.friction > 0.0 else (0.0, 0.0, 0.0)
    for k in range(3):
        contact_point.rub[k] = rub[k]


@inline
def over_seat(s, n, a, b, c, d):
    """Height [m] over the seated radius of a Solid of a point of a cubic; 1 beside the groove.

    a to d: vectors of its Hermite data; n: N_i there.
    """
    rel = (
        n[0] * a[0] + n[1] * b[0] + n[2] * c[0] + n[3] * d[0],
        n[0] * a[1] + n[1] * b[1] + n[2] * c[1] + n[3] * d[1],
        n[0] * a[2] + n[1] * b[2] + n[2] * c[2] + n[3] * d[2],
    )
    rel = sub(rel, s.centre)
    across = dot(rel, s.axis)
    out = sqrt(dot(rel, rel) - across * across) - s.radius
    return 1.0 if s.kind == GROOVE and abs(across) > s.crest else out


@driver
def lies_in(s, limit, a, b, c, d):
    """Is a part of a long element deeper than ``limit`` [m] in a Solid that is round? a to d: its Hermite data."""
    for k in range(SAMPLES + 1):
        t = k / SAMPLES
        if over_seat(s, shape(t * t * (3.0 - 2.0 * t)), a, b, c, d) < -limit:
            return True
    return False


@driver
def lies_on(s, arc, q, e):
    """Is a part of element e in a round Solid, by more than a hundredth of its radius?"""
    x, y, z = hermite_of(arc, q, q, e, 0)[0], hermite_of(arc, q, q, e, 1)[0], hermite_of(arc, q, q, e, 2)[0]
    a, b = (x[1], y[1], z[1]), (x[3], y[3], z[3])
    return lies_in(s, 0.01 * s.radius, row3(q, e), a, row3(q, e + 1), b)


@driver
def rubbed(state):
    """Power [W] that friction on the surfaces takes from the cable and turns into heat, now."""
    arc, q, v, lost = state.nodes[NOW, ARC], state.nodes[NOW, Q], state.nodes[NOW, V], 0.0
    for i in range(state.surfaces.shape[0]):
        s = solid(state.surfaces[i])
        if s.friction == 0.0:
            continue
        for e in range(arc.shape[0] - 1):
            length = arc[e + 1, 0] - arc[e, 0]
            mid, _, _ = point_of(arc, q, v, e, 0.5)
            if out_of_reach(s, mid, 0.55 * length):
                continue
            for g in range(5):
                r, w, _ = point_of(arc, q, v, e, X5[g])
                touched = touch(s, s.stiffness, r, w)
                lost -= W5[g] * length * dot(rubs(s, touched), touched.gap.slip)
    return lost


@driver
def _detect_contact(state, h, everywhere) -> None:
    """Visit every contact point of every surface after a step of h [s]: state.contact_points and state.detected.

    h: 0 where there is no step to compare with, so that nothing can have gone through a surface; everywhere: out of
    reach too.
    """
    arc, q, v, old = state.nodes[NOW, ARC], state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[STEP, Q]
    count = 0
    for i in range(state.surfaces.shape[0]):
        s, found = solid(state.surfaces[i]), state.detected[i]
        found.first, found.entered, found.coarse, minimum = count, NOT_ENTERED, 0, NO_TOP
        for e in range(arc.shape[0] - 1):
            length = arc[e + 1, 0] - arc[e, 0]
            mid, _, _ = point_of(arc, q, v, e, 0.5)
            if not everywhere and out_of_reach(s, mid, 0.55 * length):  # 10 % for stretch and curvature
                continue
            if s.kind != FLOOR and length > LONG * s.radius and found.coarse == 0 and lies_on(s, arc, q, e):
                found.coarse = 1
            for g in range(5):
                r, w, _ = point_of(arc, q, v, e, X5[g])
                touched, contact_point = touch(s, s.stiffness, r, w), state.contact_points[count]
                note(contact_point, i, e, s, r, touched)
                contact_point.place, contact_point.length = arc[e, 0] + X5[g] * length, W5[g] * length
                count += 1
                if s.kind != GROOVE:
                    contact_point.clearance = NO_TOP
                    continue
                below = clearance(touched.gap, s)
                contact_point.clearance = below
                if touched.own.load + touched.other.load > LOADED and below > 0.0:
                    minimum = min(minimum, below)
                if touched.gap.own.depth > s.rim:
                    found.entered = max(found.entered, DEEP)
                side = beside(touched.gap.y, touched.gap.height, s)
                if h > 0.0 and side != 0.0:
                    was, _, _ = point_of(arc, old, v, e, X5[g])
                    if crossed(s, was, side, h):
                        found.entered = THROUGH
        found.clearance = -1.0 if minimum == NO_TOP else minimum
        found.end = count


detect_contact = opaque(_detect_contact)


def link_contact_detection(state) -> None:
    """Compile or load the detection and publish it; call before anything that uses it runs."""
    link(_detect_contact, state, 0.0, np.bool_(False))
