"""Corners of a tow: where a body or a termination pulls at the line, its direction jumps.

The two elements at a node share one gradient, so a corner is rounded over their lengths, and the node gives way to what
pulls it: by the error of the place theta l, l of first order in the element, where smooth cable errs by h^4. As a
tensioned beam (T w'' - EI w''''), each side resists a turn a of its end by the moment T K a, K [m] from the cubics on
it; both in series make l = K1 K2 / (K1 + K2). Exact is K = sqrt(EI/T), a string has 0, one long cubic h/9.

A short element on each side of about 2.3 sqrt(EI/T) comes within 3 % of the exact, without bending stiffness one on one
side is enough: it is the hinge that a gradient of its own on each side of the node would be, for the same unknowns, and
keeps the bending stiffness. Such elements are zones of their own, which move with the material: their lengths are the
same at every scope.
"""

from __future__ import annotations

from math import atan2, hypot, pi, sqrt
from typing import NamedTuple

import numpy as np

from ..scene import Scene
from ..statics.static_shape import TowShape
from ..tables.material import extreme, hung, material_of, section_ends

CORNER_FRACTION = 0.3  # of the error of the place may come from all corners together
DIAMETERS = 2.0  # a shorter element is no cable
GROWTH = 2.0  # of an element on its neighbour nearer to the corner
MAX_SIDE = 3  # short elements on a side
OF_SECTION = 0.45  # of its section, the elements of a corner on either end
TRIED = 20  # lengths
LONG = 100.0  # the element beyond, over the last short one, where it is not known yet
SEEN = 5  # elements on either side that decide the error of a corner


class Turn(NamedTuple):
    """A corner at one scope."""

    angle: float  # rad, of the static shape and of a heave
    at: float  # m from the towbody
    bending: tuple[float, float]  # m, sqrt(EI/T) inboard and outboard of it


class Corner(NamedTuple):
    """A corner at the outboard end of a section."""

    section: int
    what: str  # key of what hangs there
    turns: dict[float, Turn]  # by scope [m]

    @property
    def angle(self) -> float:
        """The largest of all scopes [rad]."""
        return max(turn.angle for turn in self.turns.values())


class Zone(NamedTuple):
    """A piece of the cable with elements of its own: a section, or short elements [m] beside a corner of it."""

    section: int
    length: float  # m
    sizes: tuple[float, ...]
    corner: Corner | None


def corners(scene: Scene, shapes: dict[float, TowShape], acceleration: float) -> list[Corner]:
    """Where what hangs on the line turns it; acceleration [m/s^2]: of a heave that the mesh is made for.

    Across a cable that is phi off the vertical a heave pulls with the mass there times its acceleration times sin phi.
    """
    stiff = [material_of(scene.cable, s).bending_stiffness for s in scene.cable.sections.values()]
    ends, found = list(section_ends(scene.cable).values()), []
    for i, end in enumerate(ends[:-1]):
        things = [thing for thing in hung(scene) if thing.place == end]
        if not things:
            continue
        keys = {thing.key for thing in things}
        mass = sum(thing.mass for thing in things)
        mass += sum(max(body.added_mass) for name, body in scene.bodies.items() if f"bodies.{name}" in keys)
        turns = {}
        for scope, shape in shapes.items():
            below = np.flatnonzero(shape.section == i + 1)
            if len(below) == 0 or not (shape.section == i).any():
                continue
            low, high = shape.force[below[-1]], shape.force[below[-1] + 1]
            tensions = [max(hypot(*force), 1e-9) for force in (high, low)]
            static = atan2(hypot(*np.cross(low, high)), float((low * high).sum()))
            heaved = atan2(mass * acceleration * hypot(low[0], low[1]) / tensions[1], min(tensions))
            bending = [sqrt(ei / t) for ei, t in zip(stiff[i : i + 2], tensions, strict=True)]
            turns[scope] = Turn(min(static + heaved, pi), float(shape.s[below[-1]]), (bending[0], bending[1]))
        if turns:
            found.append(Corner(i, max(things, key=lambda thing: abs(thing.net_weight)).key, turns))
    return found


def stiffness(sizes: tuple[float, ...], bending: float) -> float:
    """K [m]: moment over T that cubics of ``sizes`` [m], from the corner on, have against a turn of their end.

    The matrices of a cubic beam under tension, all over T, with every other displacement and slope free.
    """
    n = len(sizes)
    a = np.zeros((2 * n + 2, 2 * n + 2))
    for i, h in enumerate(sizes):
        p, q = 36.0 / (30.0 * h) + 12.0 * bending**2 / h**3, 0.1 + 6.0 * bending**2 / h**2
        r, s = 4.0 * h / 30.0 + 4.0 * bending**2 / h, 2.0 * bending**2 / h - h / 30.0
        a[2 * i : 2 * i + 4, 2 * i : 2 * i + 4] += ((p, q, -p, q), (q, r, -q, s), (-p, -q, p, -q), (q, s, -q, r))
    for k in range(2 * n + 1, 1, -1):  # one unknown after the other, from the far end: the matrix is positive definite
        a[:k, :k] -= a[:k, k, None] * (a[k, :k] / a[k, k])
    return float(a[1, 1])


def in_series(one: float, other: float) -> float:
    """K of two that share a turn."""
    return one * other / (one + other) if one + other > 0.0 else 0.0


def error_per_turn(turn: Turn, inboard: tuple[float, ...], outboard: tuple[float, ...]) -> float:
    """Error of the place [m] per rad of a corner between elements of these lengths [m], each from the corner on."""
    sides = [stiffness(sizes, bending) for sizes, bending in zip((inboard, outboard), turn.bending, strict=True)]
    return abs(in_series(*sides) - in_series(*turn.bending))


def short_elements(
    corner: Corner, minimum: float, room: tuple[float, float], allowed: float
) -> list[tuple[float, ...]]:
    """Lengths [m] of the short elements inboard and outboard of a corner, each from it on: as few as err by at most
    ``allowed`` [m] in all, of these the longest; where none do, the best.

    least: [m] of one; room: [m] on either side, 0: none.
    """
    turns = list(corner.turns.values())
    bending = [max(turn.bending[side] for turn in turns) for side in (0, 1)]
    ratio = bending[1] / bending[0] if min(bending) > 0.0 else 1.0
    longest = max(20.0 * max(bending), 12.0 * allowed / corner.angle, 2.0 * minimum)
    best: tuple[float, list[tuple[float, ...]]] = (np.inf, [(), ()])
    counts = sorted(((i, j) for i in range(MAX_SIDE + 1) for j in range(MAX_SIDE + 1)), key=lambda c: (sum(c), c))
    known: dict[tuple[int, int, float, float], float] = {}
    for count in counts:
        for first in [longest * (minimum / longest) ** (k / (TRIED - 1)) for k in range(TRIED)]:
            sides = []
            for n, size in zip(count, (first, max(first * ratio, minimum)), strict=True):
                sides.append(tuple(size * GROWTH**k for k in range(n)))
            if any(sum(sizes) > space for sizes, space in zip(sides, room, strict=True)):
                continue
            error = 0.0
            for turn in turns:
                k = []
                for side in (0, 1):
                    sizes = sides[side]
                    key = (side, len(sizes), sizes[0] if sizes else 0.0, turn.bending[side])
                    if key not in known:
                        beyond = LONG * (sizes[-1] if sizes else longest)
                        known[key] = stiffness((*sizes, beyond), turn.bending[side])
                    k.append(known[key])
                error = max(error, turn.angle * abs(in_series(*k) - in_series(*turn.bending)))
            if error <= allowed:
                return sides
            if error < best[0]:
                best = (error, sides)
    return best[1]


def zones(scene: Scene, found: list[Corner], position: float, by_hand: bool) -> list[Zone]:
    """The zones of a mesh for an error ``position`` [m]: sections, and the short elements beside their corners."""
    sections, minimum = list(scene.cable.sections.items()), DIAMETERS * extreme(scene.cable, "diameter", max)[1]
    room = []
    for name, section in sections:
        written = scene.mesh.sections.get(name)
        stands = by_hand and written is not None and (written.elements is not None or written.grading is not None)
        room.append(0.0 if stands else OF_SECTION * section.length)
    before, after = dict[int, Zone](), dict[int, Zone]()
    for corner in found:
        if corner.angle <= 0.0:
            continue
        i = corner.section
        inboard, outboard = short_elements(
            corner, minimum, (room[i], room[i + 1]), CORNER_FRACTION * position / len(found)
        )
        if inboard:
            before[i] = Zone(i, sum(inboard), inboard[::-1], corner)
        if outboard:
            after[i + 1] = Zone(i + 1, sum(outboard), outboard, corner)
    out = []
    for i, (_, section) in enumerate(sections):
        beside = [zone for zone in (after.get(i), before.get(i)) if zone is not None]
        middle = Zone(i, section.length - sum(zone.length for zone in beside), (), None)
        out += [zone for zone in (after.get(i), middle, before.get(i)) if zone is not None]
    return out


def corner_error(found: list[Corner], nodes: np.ndarray, scope: float) -> float:
    """Error [m] of the place that corners bring at ``scope``; nodes: m from the towbody, ascending."""
    error, h = 0.0, np.diff(nodes)
    for corner in found:
        turn = corner.turns.get(scope)
        if turn is None:
            continue
        i = int(np.abs(nodes - turn.at).argmin())
        if abs(nodes[i] - turn.at) < 1e-6 * scope and 0 < i < len(h):
            inboard, outboard = h[i : i + SEEN], h[max(i - SEEN, 0) : i][::-1]
            error += turn.angle * error_per_turn(turn, tuple(inboard.tolist()), tuple(outboard.tolist()))
        else:  # within an element
            error += turn.angle * float(h[min(max(int(np.searchsorted(nodes, turn.at)) - 1, 0), len(h) - 1)]) / 9.0
    return error
