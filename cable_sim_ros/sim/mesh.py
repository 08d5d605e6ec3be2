"""Mesh of a tow whose winch feeds cable, made from an accuracy: how many elements, how long, where, and why.

From the static shape of the tow (sim/tow_shape.py) at several lengths of scope, the bending length sqrt(EI/T), the sheave
and the band of ship motion. Numbers that the scene writes under ``mesh`` stand; the rest is made. docs/mesh.md.
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil, log, pi, radians, sqrt
from typing import NamedTuple

import numpy as np

from ..physics.feed import at_least as _at_least
from .mesh_blocks import SheaveAnswer
from .scene import Scene
from .statics import Route
from .tow_shape import TowShape, fourth_derivative, tow_shape

SHORTEST_PERIOD = 4.0  # s, of ship motion at a sheave: shorter waves do not move a ship
SWING = radians(10.0)  # departure angle against the static one under way in waves
SCOPES = (1.0, 0.3, 0.1)  # of the scope at the start; the largest that the winch pays out besides
RADII_PER_TENSION = 80.0  # sheave element over its radius, per relative error of tension; 0.4 radii at 0.005
FINEST = 0.04  # radii; what 0.0005 asks for
COARSEST = 0.4
PER_BENDING = {SheaveAnswer.DISTRIBUTION: 1.5, SheaveAnswer.ENDS: 0.75}  # element over sqrt(EI/T)
SOFTEST_ENDS = 0.01  # penetration limit with which the ends of the contact are those of a rigid sheave
NO_BENDING = 0.2  # radii: element where a load along the sheave is wanted of a cable without bending stiffness
LAYER = 4.0  # bending lengths of fine mesh beside the sheave
GROWTH = 4.0  # element at x from the fine mesh: at most its size + GROWTH x
SPREAD = 20.0  # shortest element of a section over its mean
# error of the body's place per sum of h^4 |d4r/ds4| over the elements, and per h^2 times a jump of the curvature inside
# one: the largest found over 22 tows of 8 m to 6 km on 5 meshes each; most are a fifth of it (docs/mesh.md)
PER_SHAPE, PER_KINK = 1.0 / 700.0, 1.0 / 180.0
MOST_ELEMENTS = 600
SHORTEST = 0.25  # of a sheave element: shorter ones are not made


class MeshError(ValueError):
    """No mesh as asked for; key, text and remedy as in a Problem."""

    def __init__(self, key: str, text: str, remedy: str):
        super().__init__(f"{key} {text}. {remedy}")
        self.key, self.text, self.remedy = key, text, remedy


class FeedMesh(NamedTuple):
    """Where the nodes stand, see physics/feed.py."""

    aboard: np.ndarray  # [n] m from the drum's tangent point, the first 0
    shares: tuple[np.ndarray, ...]  # of each section's zone: shares of its length, ascending, the last 1
    least: np.ndarray  # [sections] m from the last node aboard, nearer the end of a zone does not come

    @property
    def boundaries(self) -> np.ndarray:
        """Node at the outboard end of each section."""
        return len(self.aboard) - 1 + np.cumsum([len(s) for s in self.shares])

    @property
    def nodes(self) -> int:
        return int(self.boundaries[-1]) + 1

    @property
    def blend(self) -> float:
        """Way [m] over which the end of a zone lets go of the end of its section."""
        return 0.5 * float(self.least[0])


class Part(NamedTuple):
    """A row of the table of a mesh: lengths [m] of its shortest and longest element at the start, and why."""

    name: str
    elements: int
    shortest: float
    longest: float
    reason: str


class Expected(NamedTuple):
    """Error promised with ``scope`` [m] out: of the tension (relative) and of the body's place [m]."""

    scope: float
    tension: float
    position: float


class MeshPlan(NamedTuple):
    """A mesh with its reasons."""

    mesh: FeedMesh
    parts: tuple[Part, ...]
    expected: tuple[Expected, ...]
    tick: float  # s, that would do


def feed_mesh(scene: Scene) -> FeedMesh | None:
    """The scene's mesh; None where it is fixed to the material. Raises MeshError."""
    found = mesh_plan(scene)
    return None if found is None else found.mesh


def mesh_plan(scene: Scene) -> MeshPlan | None:
    """The scene's mesh with its reasons; None where it is fixed to the material. Raises MeshError."""
    return _plan(scene.model_dump_json()) if Route(scene).feeds else None


def arc_lengths_at_start(scene: Scene) -> np.ndarray:
    """Arc lengths [nodes] of a fed mesh at the start, m from the cable's inner end. Raises MeshError."""
    plan, route = mesh_plan(scene), Route(scene)
    if plan is None:
        raise ValueError("the mesh of winch.drum = contact is cable.sections.*.elements")
    out = places_outboard(
        plan.mesh, route.total, np.cumsum([s.length for s in scene.cable.sections.values()]), route.wound
    )
    return np.concatenate((route.wound + plan.mesh.aboard, out[1:]))


_smooth = getattr(_at_least, "py_func", _at_least)  # plain Python: a scene loads without compiling


def places_outboard(mesh: FeedMesh, total: float, boundaries: np.ndarray, tangent: float) -> np.ndarray:
    """Arc lengths from the last node aboard on, as physics/feed.py lays them, with ``tangent`` m on the drum."""
    last = tangent + mesh.aboard[-1]
    ends = np.array([_smooth(float(b - last), float(low), mesh.blend)[0] for b, low in zip(boundaries, mesh.least)])
    ends[-1] = total - last
    places, begin = [np.zeros(1)], 0.0
    for end, share in zip(ends, mesh.shares, strict=True):
        places.append(begin + share * (end - begin))
        begin = end
    return last + np.concatenate(places)


@lru_cache(32)
def _plan(text: str) -> MeshPlan:
    return Maker(Scene.model_validate_json(text)).plan()


def scope_range(scene: Scene) -> tuple[float, float, float]:
    """Scope [m] at the start, the least that the mesh is made for, and the largest that the winch pays out."""
    route, winch = Route(scene), scene.winch
    start = route.total - route.wound - route.inboard
    most = route.total - winch.dead_length - route.inboard
    if winch.most_scope is not None:
        most = min(most, winch.most_scope)
    low = max(SCOPES[-1] * start, winch.least_scope or 0.0)
    return start, min(low, start), max(most, start)


class Maker:
    """Makes the mesh of one scene."""

    def __init__(self, scene: Scene):
        self.scene, self.route = scene, Route(scene)
        self.names = list(scene.cable.sections)
        self.lengths = np.array([s.length for s in scene.cable.sections.values()])
        self.start, low, most = scope_range(scene)
        scopes = {most, *(max(share * self.start, low) for share in SCOPES)}
        self.shapes = {scope: tow_shape(scene, scope) for scope in sorted(scopes, reverse=True)}
        self.curves = {scope: fourth_derivative(shape) for scope, shape in self.shapes.items()}
        self.tension = max(float(shape.tension[-1]) for shape in self.shapes.values())
        self.bending = sqrt(scene.cable.bending_stiffness / self.tension)
        self.reasons: dict[str, str] = {}

    def plan(self) -> MeshPlan:
        """Mesh with as few elements as keep the promise at every scope."""
        size, accuracy = self.sheave_size(), self.scene.accuracy
        self.check_sections(size)
        aboard = self.aboard(size)
        share = accuracy.position / PER_SHAPE
        while True:
            mesh = self.outboard(aboard, size, share)
            expected = self.promise(mesh, size)
            if all(e.position <= accuracy.position and e.tension <= accuracy.tension * (1 + 1e-9) for e in expected):
                return MeshPlan(mesh, self.parts(mesh), expected, self.tick())
            if self.by_hand or mesh.nodes > MOST_ELEMENTS:
                break
            share *= 0.7
        if self.by_hand:
            return MeshPlan(mesh, self.parts(mesh), expected, self.tick())
        raise self.unreachable(expected, mesh.nodes - 1)

    def unreachable(self, expected: tuple[Expected, ...], elements: int) -> MeshError:
        """The error of an accuracy that no mesh of MOST_ELEMENTS keeps."""
        worst = max(e.position for e in expected)
        return MeshError(
            "accuracy.position",
            f"= {self.scene.accuracy.position:g} m cannot be met: with {elements} elements, and more than "
            f"{MOST_ELEMENTS} are not made, the towbody's place errs by {worst:.2g} m "
            f"with {max(expected, key=lambda e: e.position).scope:.4g} m of scope",
            f"Give {1.1 * worst:.2g} m or more, or limit the scope with winch.most_scope",
        )

    @property
    def by_hand(self) -> bool:
        """Is every section's number of elements written?"""
        written = self.scene.mesh.sections
        return all(name in written and written[name].elements is not None for name in self.names)

    # at the sheave

    def sheave_size(self) -> float:
        """Length [m] of the elements at the sheave."""
        accuracy, radius = self.scene.accuracy, self.route.sheave
        reach = FINEST / RADII_PER_TENSION
        if accuracy.tension < reach * (1 - 1e-9):
            raise MeshError(
                "accuracy.tension",
                f"= {accuracy.tension:g} cannot be promised: with elements of {FINEST:g} sheave radii the tension "
                f"of a tow with its winch working errs by {reach:g}, and nothing finer was measured",
                f"Give {reach:g} or more",
            )
        size = radius * min(COARSEST, RADII_PER_TENSION * accuracy.tension)
        reason = f"{size / radius:.2g} sheave radii: tension within {accuracy.tension:g}"
        if accuracy.sheave in PER_BENDING:
            factor = PER_BENDING[accuracy.sheave]
            limit = self.scene.contact.penetration_limit
            if accuracy.sheave is SheaveAnswer.ENDS and limit > SOFTEST_ENDS:
                raise MeshError(
                    "accuracy.sheave",
                    f"= ends cannot be met with contact.penetration_limit = {limit:g}: so soft a sheave spreads the "
                    f"reactions at the ends of the contact, whatever the mesh; {SOFTEST_ENDS:g} or less is needed",
                    f"Give contact.penetration_limit {SOFTEST_ENDS:g}, or accuracy.sheave distribution",
                )
            want = factor * self.bending if self.bending > 0.0 else NO_BENDING * radius
            if want < size:
                size = want
                reason = (
                    f"{factor:g} sqrt(EI/T) at {self.tension:.4g} N: {accuracy.sheave.value} of the contact"
                    if self.bending > 0.0
                    else f"{NO_BENDING:g} sheave radii: {accuracy.sheave.value} of the contact, no bending stiffness"
                )
        self.reasons["sheave"] = reason
        return size

    def aboard(self, size: float) -> np.ndarray:
        """Nodes from the drum to a little outboard of the sheave, m from the drum's tangent point."""
        mesh, route = self.scene.mesh, self.route
        layer = max(size, LAYER * self.bending)
        before = min(layer if mesh.before is None else mesh.before, 0.9 * route.span)
        least_angle = min(shape.angle for shape in self.shapes.values())
        if mesh.after is None:
            leaves = route.on_sheave(least_angle - SWING)
        else:
            leaves, layer = route.on_sheave(self.shapes[self.start].angle), mesh.after
        room = 0.5 * self.start
        end = route.span + min(leaves + layer, room)
        begin = route.span - before
        if mesh.sheave is not None:
            fine = np.linspace(begin, end, mesh.sheave + 1)
            self.reasons["sheave"] = "mesh.sheave, by hand"
        else:
            cap = max(size, 0.75 * self.bending)
            inner = graded(before, size, cap)[::-1]
            contact = even(min(leaves, room), size)
            outer = graded(max(end - route.span - leaves, 0.0), size, cap)
            fine = begin + np.concatenate(([0.0], np.cumsum(np.concatenate((inner, contact, outer)))))
        count = mesh.inboard
        if count is None:
            count = 1 if begin < 4.0 * size else 2
            self.reasons["inboard"] = "cable under tension, nearly straight"
        else:
            self.reasons["inboard"] = "mesh.inboard, by hand"
        if begin <= 1e-9:
            return fine
        return np.concatenate((np.linspace(0.0, begin, count + 1)[:-1], fine))

    # outboard

    def check_sections(self, size: float) -> None:
        """Refuse sections too short for their mesh."""
        shortest = SHORTEST * size
        for name, length in zip(self.names, self.lengths, strict=True):
            written = self.scene.mesh.sections.get(name)
            count = 1 if written is None or written.elements is None else written.elements
            if length < count * shortest:
                key, value = (f"cable.sections.{name}.length", f"{length:g} m")
                if count > 1:
                    key, value = f"mesh.sections.{name}.elements", f"{count} of {length:g} m"
                raise MeshError(
                    key,
                    f"= {value} makes elements of {length / count:.3g} m, shorter than {shortest:.3g} m, {SHORTEST:g} "
                    f"of an element at the sheave ({size:.3g} m): they are too stiff against those beside them",
                    f"Give at most {max(1, int(length / shortest))} elements"
                    if count > 1 and length >= shortest
                    else f"Make it {shortest:.3g} m or longer, or part of the section beside it",
                )

    def density(self, scope: float, size: float, share: float) -> np.ndarray:
        """Elements per length along the shape at ``scope``, from the body; share [m]: error by the shape."""
        shape, curve, cable = self.shapes[scope], self.curves[scope], self.scene.cable
        steep = (curve / max(share, 1e-12)) ** 0.25
        added = 0.25 * pi * cable.diameter**2 * self.scene.water.density * cable.added_mass_coefficient
        speed = np.sqrt(np.maximum(shape.tension, 1e-9) / (cable.mass_per_length + shape.wet * added))
        per_wave = (2.0 * pi) / (720.0 * self.scene.accuracy.tension) ** 0.25
        wave = per_wave / (speed * SHORTEST_PERIOD)
        far = shape.s[-1] - shape.s
        return np.maximum(np.maximum(steep, wave), 1.0 / (size + GROWTH * far))

    def outboard(self, aboard: np.ndarray, size: float, share: float) -> FeedMesh:
        """The whole mesh, with as many elements in each zone as the worst scope wants."""
        counts, shares = [], []
        densities = {scope: self.density(scope, size, share) for scope in self.shapes}
        scopes = list(self.shapes)
        for i, name in enumerate(self.names):
            best, chosen = 0.0, None
            for scope in (self.start, *scopes):
                shape = self.shapes[scope]
                here = np.flatnonzero(shape.section == i)
                if len(here) < 2:
                    continue
                s, n = shape.s[here], densities[scope][here]
                number = float(np.trapezoid(n, s))
                if chosen is None:
                    chosen = (s, n)
                best = max(best, number)
            written = self.scene.mesh.sections.get(name)
            count = 1 if chosen is None else max(1, ceil(best - 1e-6))
            count = min(count, max(1, int(self.lengths[i] / (SHORTEST * size))))
            if written is not None and written.elements is not None:
                count = written.elements
            if written is not None and written.grading is not None:
                shares.append(geometric(count, written.grading))
            elif chosen is None:
                shares.append(np.linspace(0.0, 1.0, count + 1)[1:])
            else:
                shares.append(equal_parts(chosen[0][-1] - chosen[0][::-1], chosen[1][::-1], count))
            counts.append(count)
        room = 0.1 * self.start / sum(counts)
        least = np.cumsum(np.array(counts) * min(size, room))
        return FeedMesh(aboard, tuple(shares), least)

    # what comes of it

    def arcs(self, mesh: FeedMesh, scope: float) -> np.ndarray:
        """Distance [m] of the outboard nodes from the body at ``scope``, from the last node aboard on."""
        total = self.route.total
        return total - places_outboard(mesh, total, np.cumsum(self.lengths), total - scope - self.route.inboard)

    def expected_position(self, mesh: FeedMesh, scope: float) -> float:
        """Error [m] of the body's place with ``scope`` out."""
        shape, curve = self.shapes[scope], self.curves[scope]
        nodes = self.arcs(mesh, scope)[::-1]
        h = np.diff(nodes)
        if (h <= 0.0).any():
            return np.inf
        at = [np.interp(x, shape.s, curve) for x in (nodes[1:], 0.5 * (nodes[1:] + nodes[:-1]), nodes[:-1])]
        error = PER_SHAPE * float((h**4 * np.maximum.reduce(at)).sum())
        for s, jump in kinks(shape):
            if np.abs(nodes - s).min() > 1e-6 * scope:
                error += PER_KINK * float(h[min(int(np.searchsorted(nodes, s)), len(h)) - 1]) ** 2 * jump
        return error

    def promise(self, mesh: FeedMesh, size: float) -> tuple[Expected, ...]:
        """Expected errors at the largest scope, at the start, and below it."""
        found, cable = [], self.scene.cable
        sheave = size / self.route.sheave / RADII_PER_TENSION
        stop = mesh.aboard[-1] + mesh.least[-1] - self.route.inboard  # hauling in ends there, see build.hauled_in
        for scope, shape in self.shapes.items():
            if scope < stop:
                continue
            position = self.expected_position(mesh, scope)
            load = cable.mass_per_length * self.scene.gravity + float(shape.drag.max())
            found.append(Expected(scope, max(sheave, load * position / float(shape.tension[-1])), position))
        return tuple(found)

    def parts(self, mesh: FeedMesh) -> tuple[Part, ...]:
        """Rows of the table, from the drum."""
        sizes = np.diff(mesh.aboard)
        begin = self.route.span
        first = int(np.searchsorted(mesh.aboard, begin - max(sizes[-1], LAYER * self.bending) - 1e-9))
        first = min(first, self.inboard_count(mesh))
        rows = []
        if first:
            rows.append(Part("inboard", first, *ends(sizes[:first]), self.reasons["inboard"]))
        rows.append(Part("sheave", len(sizes) - first, *ends(sizes[first:]), self.reasons["sheave"]))
        h, at = -np.diff(self.arcs(mesh, self.start)), 0
        for name, share in zip(self.names, mesh.shares, strict=True):
            part = h[at : at + len(share)]
            at += len(share)
            rows.append(Part(name, len(share), *ends(part), self.reason(name)))
        return tuple(rows)

    def inboard_count(self, mesh: FeedMesh) -> int:
        sizes = np.diff(mesh.aboard)
        return int((sizes > 1.5 * sizes[-1]).cumprod().sum()) or 0

    def reason(self, name: str) -> str:
        """Why a section has its elements."""
        written = self.scene.mesh.sections.get(name)
        if written is not None and written.elements is not None:
            return f"mesh.sections.{name}, by hand"
        return "static shape, waves along the cable"

    def tick(self) -> float:
        """Step [s] that follows the shortest motion and the first axial mode of the tow."""
        cable, body = self.scene.cable, self.scene.towbody
        mass = body.mass + body.added_mass[2] + 0.4 * cable.mass_per_length * self.start
        axial = 2.0 * pi * sqrt(mass * max(self.start, 1e-3) / cable.axial_stiffness)
        step = min(SHORTEST_PERIOD, max(axial, 0.2)) / 40.0
        return float(f"{min(step, 0.05):.1g}")


def kinks(shape: TowShape) -> list[tuple[float, float]]:
    """Where the curvature jumps, at the water surface and between sections: arc length [m] from the body and jump [1/m]."""
    jump = np.linalg.norm(np.diff(shape.bend, axis=0), axis=1)
    where = np.flatnonzero((np.diff(shape.wet.astype(int)) != 0) | (np.diff(shape.section) != 0))
    return [(float(shape.s[i]), float(jump[i])) for i in where]


def ends(sizes: np.ndarray) -> tuple[float, float]:
    """Shortest and longest."""
    return float(sizes.min()), float(sizes.max())


def even(length: float, size: float) -> np.ndarray:
    """Equal parts of ``length`` of at most ``size``."""
    count = max(0, ceil(length / size - 1e-6))
    return np.full(count, length / count) if count else np.zeros(0)


def graded(length: float, size: float, most: float) -> np.ndarray:
    """Parts of ``length`` that double from ``size`` to at most ``most``."""
    parts, done, part = [], 0.0, size
    while done < length - 1e-9 * (length + size):
        parts.append(part)
        done += part
        part = min(2.0 * part, most)
    return np.array(parts) * (length / done) if parts else np.zeros(0)


def geometric(count: int, ratio: float) -> np.ndarray:
    """Shares of elements whose last is ``ratio`` times as long as the first."""
    sizes = np.exp(np.linspace(0.0, log(ratio), count)) if count > 1 else np.ones(1)
    out = np.cumsum(sizes) / sizes.sum()
    out[-1] = 1.0
    return out


def equal_parts(s: np.ndarray, density: np.ndarray, count: int) -> np.ndarray:
    """Shares that cut the integral of ``density`` over s (from 0) into equal parts; no part below mean / SPREAD."""
    density = np.minimum(density, SPREAD * count / (s[-1] - s[0]))
    integral = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(s))))
    out = np.interp(np.linspace(0.0, 1.0, count + 1)[1:], integral / integral[-1], (s - s[0]) / (s[-1] - s[0]))
    out[-1] = 1.0
    return out


__all__ = ["FeedMesh", "MeshError", "MeshPlan", "TowShape", "feed_mesh", "mesh_plan"]
