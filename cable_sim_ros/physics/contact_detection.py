"""One survey of contact: every station of every surface is visited once a step, and all that is asked of it read off.

A station is a Gauss point of an element within reach of a surface. Groove clearance, a cable that entered its sheave,
depth on the drum, the Frame and its contact table are read from the table of stations, see contact_output.py.
"""

from __future__ import annotations

import numpy as np

from .coarse import LONG, lies_in
from .contact import LOADED, touch
from .contact_surface import FLOOR, GROOVE, NO_TOP, beside, clearance, out_of_reach, place, solid
from .hermite import W5, X5, hermite_of, point_of
from .jit import driver, inline, link, opaque
from .state import ARC, NOW, STEP, Q, V
from .vec import axpy, cross, row3, sub

NOT_ENTERED, DEEP, THROUGH = range(3)  # SURVEY.entered


@inline
def crossed(s, r, side, h):
    """Was the point that is at ``side`` now on the other side of the sheave h [s] ago, at r?

    The sheave is taken back by its present speed and spin.
    """
    centre, axis = axpy(-h, s.speed, s.centre), axpy(-h, cross(s.spin, s.axis), s.axis)
    y, _, _, _, height = place(sub(r, centre), axis, s.radius)
    return side * beside(y, height, s) < 0.0


@inline
def note(station, surface, element, s, r, touched):
    """Fill one STATION record but for its place and length."""
    station.surface, station.element = surface, element
    g = touched.gap
    rel = sub(r, s.centre)
    for k in range(3):
        station.rel[k] = rel[k]
        station.normal_own[k] = g.own.normal[k]
        station.normal_other[k] = g.other.normal[k]
    station.depth_own, station.depth_other = g.own.depth, g.other.depth
    station.load_own, station.load_other = touched.own.load, touched.other.load
    station.side, station.height = g.side, g.height


@driver
def lies_on(s, arc, q, e):
    """Is a part of element e in a round Solid, by more than a hundredth of its radius?"""
    x, y, z = hermite_of(arc, q, q, e, 0)[0], hermite_of(arc, q, q, e, 1)[0], hermite_of(arc, q, q, e, 2)[0]
    a, b = (x[1], y[1], z[1]), (x[3], y[3], z[3])
    return lies_in(s, 0.01 * s.radius, row3(q, e), a, row3(q, e + 1), b)


@driver
def _survey(state, h, everywhere):
    """Visit every station of every surface after a step of h [s]: state.stations and state.survey.

    h: 0 where there is no step to compare with, so that nothing can have gone through a surface; everywhere: out of
    reach too.
    """
    arc, q, v, old = state.nodes[NOW, ARC], state.nodes[NOW, Q], state.nodes[NOW, V], state.nodes[STEP, Q]
    count = 0
    for i in range(state.surfaces.shape[0]):
        s, found = solid(state.surfaces[i]), state.survey[i]
        found.first, found.entered, found.coarse, least = count, NOT_ENTERED, 0, NO_TOP
        for e in range(arc.shape[0] - 1):
            length = arc[e + 1, 0] - arc[e, 0]
            mid, _, _ = point_of(arc, q, v, e, 0.5)
            if not everywhere and out_of_reach(s, mid, 0.55 * length):  # 10 % for stretch and curvature
                continue
            if s.kind != FLOOR and length > LONG * s.radius and found.coarse == 0 and lies_on(s, arc, q, e):
                found.coarse = 1
            for g in range(5):
                r, w, _ = point_of(arc, q, v, e, X5[g])
                touched, station = touch(s, r, w), state.stations[count]
                note(station, i, e, s, r, touched)
                station.place, station.length = arc[e, 0] + X5[g] * length, W5[g] * length
                count += 1
                if s.kind != GROOVE:
                    station.clearance = NO_TOP
                    continue
                below = clearance(touched.gap, s)
                station.clearance = below
                if touched.own.load + touched.other.load > LOADED and below > 0.0:
                    least = min(least, below)
                if touched.gap.own.depth > s.rim:
                    found.entered = max(found.entered, DEEP)
                side = beside(touched.gap.y, touched.gap.height, s)
                if h > 0.0 and side != 0.0:
                    was, _, _ = point_of(arc, old, v, e, X5[g])
                    if crossed(s, was, side, h):
                        found.entered = THROUGH
        found.clearance = -1.0 if least == NO_TOP else least
        found.end = count


survey = opaque(_survey)


def link_survey(state) -> None:
    """Compile or load the survey and publish it; call before anything that uses it runs."""
    link(_survey, state, 0.0, np.bool_(False))
