"""Makes a fed mesh from an accuracy: from the static shape at several scopes, sqrt(EI/T), the sheave and the motion."""

from __future__ import annotations

from math import ceil, pi, radians, sqrt

import numpy as np

from .mesh_blocks import SheaveAnswer
from .mesh_kinds import (
    Expected,
    FeedMesh,
    MeshError,
    MeshPlan,
    Part,
    ends,
    equal_parts,
    even,
    geometric,
    graded,
    places_outboard,
)
from .scene import Scene
from .statics import ROUND_OFF, Route
from .tow_shape import TowShape, fourth_derivative, tow_shape

SHORTEST_PERIOD = 4.0  # s, of ship motion at a sheave: shorter waves do not move a ship
SWING = radians(10.0)  # departure angle against the static one under way in waves
SCOPES = (1.0, 0.3, 0.1)  # of the scope at the start; the largest that the winch pays out besides
RADII_PER_TENSION = 50.0  # sheave element over its radius, per relative error of tension; 0.25 radii at 0.005
FINEST = 0.025  # radii; what 0.0005 asks for
COARSEST = 0.4
PER_BENDING = {SheaveAnswer.DISTRIBUTION: 1.5, SheaveAnswer.ENDS: 0.75}  # element over sqrt(EI/T)
SOFTEST_ENDS = 0.01  # penetration limit with which the ends of the contact are those of a rigid sheave
NO_BENDING = 0.2  # radii: element where a load along the sheave is wanted of a cable without bending stiffness
LAYER = 4.0  # bending lengths of fine mesh beside the sheave
PER_WAVE = 2.0  # elements per wave along the cable; of 2 and of 5 the tension's deviation is the same to 1e-3
LAYERS = 2.0  # first element outboard over the length within which drag damps the cable's sideways motion
BROADSIDE_DRAG = 1.2  # C_D of that estimate
HEAVE_MOST, HEAVE_PER_SCOPE = 1.0, 0.01  # m; and of the scope where that is less
SMOOTH = 2.0  # an element beside one of length h is no longer than h + SMOOTH times the way between
KINK_SHARE = 0.3  # of the error of the place may come from one jump of the curvature
PER_TOLERANCE = 0.5  # error of the body's place per residual of every node below, over the tension along the cable
# error of the body's place per sum of h^4 |d4r/ds4| over the elements, and per h^2 times a jump of the curvature inside
# one: the largest found over 22 tows of 8 m to 6 km on 5 meshes each; most are a fifth of it (docs/mesh.md)
PER_SHAPE, PER_KINK = 1.0 / 1500.0, 1.0 / 120.0
OUTBOARD_LEAST = 0.1  # of the scope at the start: all zones pressed together are no longer
LEAST_POSITION, POSITION_PER_SCOPE = 0.01, 1e-5  # m, and of the scope: what is promised where nothing is said
MOST_ELEMENTS = 600
LEAST_PROMISE = 0.2  # of the place asked for: no estimate from a static shape is better than that in waves
SOLVER_SHARE = 0.6  # of the error of the place may be the solver's
SHORTEST = 0.25  # of a sheave element: shorter ones are not made


def scope_range(scene: Scene) -> tuple[float, float, float]:
    """Scope [m] at the start, the least that the mesh is made for, and the largest that the winch pays out."""
    route, winch = Route(scene), scene.winch
    start = route.total - route.wound - route.inboard
    most = route.total - winch.dead_length - route.inboard
    if winch.most_scope is not None:
        most = min(most, winch.most_scope)
    low = max(SCOPES[-1] * start, winch.least_scope or 0.0)
    return start, min(low, start), max(most, start)


def heave_amplitude(scope: float) -> float:
    """Heave [m] that a mesh is made for and checked with, for a scope [m] at the start."""
    return min(HEAVE_MOST, HEAVE_PER_SCOPE * scope)


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
        self.position = scene.accuracy.position or max(LEAST_POSITION, POSITION_PER_SCOPE * most)
        self.reasons: dict[str, str] = {}

    def plan(self) -> MeshPlan:
        """Mesh with as few elements as keep the promise at every scope."""
        size, accuracy = self.sheave_size(), self.scene.accuracy
        self.check_sections(size)
        aboard = self.aboard(size)
        share = 100.0 * self.position / PER_SHAPE
        while True:
            mesh = self.outboard(aboard, size, share)
            self.check_solver(mesh.nodes)
            expected = self.promise(mesh, size)
            if all(e.position <= self.position and e.tension <= accuracy.tension * (1 + 1e-9) for e in expected):
                return MeshPlan(mesh, self.parts(mesh), expected, self.tick())
            if self.by_hand or mesh.nodes > MOST_ELEMENTS:
                break
            share *= 0.75
        if self.by_hand:
            return MeshPlan(mesh, self.parts(mesh), expected, self.tick())
        raise self.unreachable(expected, mesh.nodes - 1)

    def unreachable(self, expected: tuple[Expected, ...], elements: int) -> MeshError:
        """The error of an accuracy that no mesh of MOST_ELEMENTS keeps."""
        worst = max(e.position for e in expected)
        return MeshError(
            "accuracy.position",
            f"= {self.position:g} m cannot be met: with {elements} elements, and more than "
            f"{MOST_ELEMENTS} are not made, the towbody's place errs by {worst:.2g} m "
            f"with {max(expected, key=lambda e: e.position).scope:.4g} m of scope",
            f"Give {1.1 * worst:.2g} m or more, or limit the scope with winch.most_scope",
        )

    @property
    def by_hand(self) -> bool:
        """Is every section's number of elements written?"""
        written = self.scene.mesh.sections
        return all(name in written and written[name].elements is not None for name in self.names)

    def check_solver(self, nodes: int) -> None:
        """Refuse a place finer than the forces are solved to."""
        worst = max(self.shapes, key=lambda scope: self.floor(scope, nodes))
        floor, solver = self.floor(worst, nodes), self.scene.solver
        if floor > SOLVER_SHARE * self.position:
            tolerance = 0.9 * solver.tolerance * SOLVER_SHARE * self.position / floor
            raise MeshError(
                "accuracy.position",
                f"= {self.position:g} m cannot be met: forces are solved to {self.tolerance:.2g} N (solver.tolerance = "
                f"{solver.tolerance:g} of contact.working_tension = {self.scene.contact.working_tension:g} N), "
                f"which with {worst:.4g} m of scope is {floor:.2g} m of the towbody's place",
                f"Give {1.1 * floor / SOLVER_SHARE:.2g} m or more, or solver.tolerance {tolerance:.1g} or less",
            )

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

    def density(self, scope: float, share: float) -> np.ndarray:
        """Elements per length along the shape at ``scope``, from the body; share [m]: h^4 |d4r/ds4| of an element."""
        shape, curve, cable = self.shapes[scope], self.curves[scope], self.scene.cable
        steep = (curve / max(share, 1e-12)) ** 0.25
        added = 0.25 * pi * cable.diameter**2 * self.scene.water.density * cable.added_mass_coefficient
        speed = np.sqrt(np.maximum(shape.tension, 1e-9) / (cable.mass_per_length + shape.wet * added))
        n = np.maximum(steep, PER_WAVE / (speed * SHORTEST_PERIOD))
        far = shape.s[-1] - shape.s
        n = np.maximum(n, 1.0 / (LAYERS * self.damped_length(shape) + SMOOTH * far))
        for place, jump in kinks(shape):
            if jump > 0.0:
                here = sqrt(PER_KINK * jump / (KINK_SHARE * self.position))
                i = int(np.searchsorted(shape.s, place))
                rise = abs(float(shape.force[i, 2])) / float(shape.tension[i])
                travel = self.heave / max(rise, 1e-3) if shape.wet[i] != shape.wet[min(i + 1, len(far) - 1)] else 0.0
                n = np.maximum(n, here * (np.abs(shape.s - place) < 0.5 / here + travel))
        return n

    @property
    def heave(self) -> float:
        """Heave [m] that the mesh is made for: a sea for a ship, ripples for a tow of a few metres."""
        return heave_amplitude(self.start)

    def damped_length(self, shape: TowShape) -> float:
        """Length [m] within which drag damps the sideways motion that the sheave gives the cable: sqrt(T/(b omega))."""
        cable, water = self.scene.cable, self.scene.water
        omega = 2.0 * pi / SHORTEST_PERIOD
        drag = water.density * cable.diameter * BROADSIDE_DRAG * max(shape.speed, omega * self.heave)
        return sqrt(float(shape.tension[-1]) / (drag * omega))

    def outboard(self, aboard: np.ndarray, size: float, share: float) -> FeedMesh:
        """The whole mesh: shares of each zone that serve at every scope."""
        shares = []
        densities = {scope: self.density(scope, share) for scope in self.shapes}
        for i, name in enumerate(self.names):
            written = self.scene.mesh.sections.get(name)
            x, n = self.envelope(i, densities)
            count = max(1, ceil(float(np.trapezoid(n, x)) - 1e-6))
            count = min(count, max(1, int(self.lengths[i] / (SHORTEST * size))))
            if written is not None and written.elements is not None:
                count = written.elements
            if written is not None and written.grading is not None:
                shares.append(geometric(count, written.grading))
            else:
                shares.append(equal_parts(x, n, count))
        counts = np.array([len(s) for s in shares])
        room = OUTBOARD_LEAST * self.start / counts.sum()
        return FeedMesh(aboard, tuple(shares), np.cumsum(counts * min(size, room)))

    def envelope(self, section: int, densities: dict[float, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Elements per share of a section's zone, the most that any scope wants, over the share from the inboard end."""
        wanted = []
        for scope, density in densities.items():
            shape = self.shapes[scope]
            here = np.flatnonzero(shape.section == section)
            if len(here) > 1:
                s = shape.s[here][::-1]
                length = s[0] - s[-1]
                wanted.append(((s[0] - s) / length, density[here][::-1] * length))
        if not wanted:  # never outboard
            return np.array([0.0, 1.0]), np.ones(2)
        x = np.unique(np.concatenate([places for places, _ in wanted]).round(12))
        n = np.max([np.interp(x, places, density) for places, density in wanted], axis=0)
        size = 1.0 / np.maximum(n, 1.0)
        for i in range(1, len(x)):
            size[i] = min(size[i], size[i - 1] + SMOOTH * (x[i] - x[i - 1]))
        for i in reversed(range(len(x) - 1)):
            size[i] = min(size[i], size[i + 1] + SMOOTH * (x[i + 1] - x[i]))
        return x, 1.0 / size

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
        error += self.floor(scope, mesh.nodes)
        for s, jump in kinks(shape):
            if np.abs(nodes - s).min() > 1e-6 * scope:
                error += PER_KINK * float(h[min(int(np.searchsorted(nodes, s)), len(h)) - 1]) ** 2 * jump
        return error

    def floor(self, scope: float, nodes: int) -> float:
        """Error [m] of the body's place that the solver leaves whatever the mesh: its residual turns the tension."""
        shape = self.shapes[scope]
        below = nodes * shape.s / shape.s[-1]
        return PER_TOLERANCE * self.tolerance * float(np.trapezoid(below / shape.tension, shape.s))

    @property
    def tolerance(self) -> float:
        """Largest residual of a solved step [N]."""
        scene = self.scene
        return max(scene.solver.tolerance * scene.contact.working_tension, ROUND_OFF * scene.cable.axial_stiffness)

    def promise(self, mesh: FeedMesh, size: float) -> tuple[Expected, ...]:
        """Expected errors at the largest scope, at the start, and below it."""
        found, cable = [], self.scene.cable
        sheave = size / self.route.sheave / RADII_PER_TENSION
        for scope, shape in self.shapes.items():
            position = self.expected_position(mesh, scope)
            load = cable.mass_per_length * self.scene.gravity + float(shape.drag.max())
            tension = max(sheave, load * position / float(shape.tension[-1]))
            found.append(Expected(scope, tension, max(position, LEAST_PROMISE * self.position)))
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
