"""Makes a fed mesh from an accuracy: from the static shape at several scopes, sqrt(EI/T), the sheave and the motion."""

from __future__ import annotations

from math import ceil, degrees, hypot, nan, pi, sqrt

import numpy as np

from ..statics.static_shape import TowShape
from ..tables.elementary import power
from ..tables.material import extreme
from .mesh_corners import DIAMETERS, corner_error, corners, zones
from .mesh_kinds import Expected, FeedMesh, MeshError, MeshPlan, Part, ends, equal_parts, geometric, places_outboard
from .mesh_order import CUBICS, integral
from .mesh_sheave import MIN_OUTBOARD, RADII_PER_TENSION, SheaveMesh, heave_amplitude
from .mesh_waves import MOST_OF_WAVES, TO_WAVES, wave_density, wave_error

SHORTEST_PERIOD = 4.0  # s, of ship motion at a sheave: shorter waves do not move a ship
PER_WAVE = 2.0  # elements per wave along the cable; of 2 and of 5 the tension's deviation is the same to 1e-3
LAYERS = 0.7  # first element outboard over the length within which drag damps the cable's sideways motion
AT_BODY = 1.0  # the same of the element at the towbody of a line with bodies; without it one of four erred by 70 mm
LEANS = 0.05  # of the tension, across: less is a cast
BROADSIDE_DRAG = 1.2  # C_D of that estimate
SMOOTH = 2.0  # an element beside one of length h is no longer than h + SMOOTH times the way between
KINK_FRACTION = 0.3  # of the error of the place may come from one jump of the curvature
# sheave elements for each element of a section that is hauled in; of 1 a section's end that came to the sheave at 1 m/s
# changed the tension by 3.5 N in one tick of 20 ms, of 3 by 0.6 N, of 6 by 0.4 N, as much as without one
PRESSED = 6.0
MAX_ELEMENTS = 600
FIRST_FRACTION = 100.0  # the search for as few elements as will do begins so coarse
MIN_WITH_BODIES = 0.5  # the same where bodies or terminations hang on the line: they move it as the towbody does
MIN_PROMISE = 0.2  # of the place asked for: no estimate from a static shape is better than that in waves
SHORTEST = 0.25  # of a sheave element: shorter ones are not made, but at a corner
MAX_CORNERS = 0.6  # of the error of the place may be of corners, with the shortest elements there


WANTS = (  # what asks for elements outboard, in the order of Maker.density
    "static shape, |d4r/ds4|",
    "waves along the cable",
    "sideways motion, damped by drag",
    "jump of the curvature at the water surface",
    "touchdown on the seabed",
    "waves of the water",
)
PER_HEIGHT = 15.0  # elements over the height from seabed to sheave: where cable comes down it turns level within that


class Maker(SheaveMesh):
    """Makes the mesh of one scene."""

    def plan(self) -> MeshPlan:
        """Mesh with as few elements as keep the promise at every scope; then what is written by hand."""
        size, accuracy = self.sheave_size(), self.scene.accuracy
        if self.order is CUBICS:
            self.corners = corners(self.scene, self.shapes, self.heave * (2.0 * pi / SHORTEST_PERIOD) ** 2)
        self.check_sections(size)
        aboard = self.aboard(size)
        self.check_start(aboard)
        fraction = FIRST_FRACTION * self.position / self.order.per_shape
        self.follow_waves(aboard, size, fraction)
        while True:
            mesh = self.outboard(aboard, size, fraction, False)
            self.check_solver(mesh.nodes)
            self.check_corners(mesh)
            if all(e.position <= self.position and e.tension <= accuracy.tension for e in self.errors(mesh)):
                break
            if mesh.nodes > MAX_ELEMENTS:
                raise self.unreachable(mesh)
            fraction *= 0.75
        mesh = self.outboard(aboard, size, fraction, True)
        return MeshPlan(mesh, self.parts(mesh), self.promise(mesh), self.tick(), self.relative)

    def follow_waves(self, aboard: np.ndarray, size: float, fraction: float) -> None:
        """What the waves ask for; less than for the accuracy where that is more than MOST_OF_WAVES elements."""
        error = TO_WAVES * self.scene.accuracy.tension
        while self.waves is not None:
            for scope, shape in self.shapes.items():
                if scope >= self.start:  # the elements near the surface are others with each scope
                    self.for_waves[scope] = wave_density(self.waves, shape, error)
            if self.outboard(aboard, size, fraction, False).nodes <= MOST_OF_WAVES:
                return
            error *= 1.5

    def unreachable(self, mesh: FeedMesh) -> MeshError:
        """The error of an accuracy that no mesh of MAX_ELEMENTS keeps."""
        errors, accuracy, count = self.errors(mesh), self.scene.accuracy, mesh.nodes - 1
        many = f"cannot be met: with {count} elements, and more than {MAX_ELEMENTS} are not made,"
        worst = max(errors, key=lambda e: e.position)
        if worst.position > self.position:
            return MeshError(
                "accuracy.position",
                f"= {self.position:g} m {many} the towbody's place errs by {worst.position:.2g} m with "
                f"{worst.scope:.4g} m of scope",
                f"Give {1.1 * worst.position:.2g} m or more, or limit the scope with winch.most_scope",
            )
        worst = max(errors, key=lambda e: e.tension)
        return MeshError(
            "accuracy.tension",
            f"= {accuracy.tension:g} {many} the tension errs by {worst.tension:.2g} of itself with {worst.scope:.4g} "
            "m of scope",
            f"Give {1.1 * worst.tension:.2g} or more, or limit the scope with winch.most_scope",
        )

    def check_corners(self, mesh: FeedMesh) -> None:
        """Refuse a place finer than the shortest elements at corners keep it; one not asked for is then coarser."""
        left = {}
        for scope in self.shapes:
            nodes = self.arcs(mesh, scope)[::-1]
            left[scope] = corner_error(self.corners, nodes, scope) if (np.diff(nodes) > 0.0).all() else 0.0
        scope = max(left, key=left.__getitem__)
        if left[scope] <= MAX_CORNERS * self.position:
            return
        if self.scene.accuracy.position is None:
            self.position = 1.1 * left[scope] / MAX_CORNERS
            return
        worst = max((c for c in self.corners if scope in c.turns), key=lambda c: c.turns[scope].angle)
        raise MeshError(
            "accuracy.position",
            f"= {self.position:g} m cannot be met: {worst.what} turns the line by "
            f"{degrees(worst.turns[scope].angle):.3g} deg, and with the shortest elements beside it, {DIAMETERS:g} "
            f"diameters of the cable, corners err by {left[scope]:.2g} m with {scope:.4g} m of scope",
            f"Give {1.1 * left[scope] / MAX_CORNERS:.2g} m or more",
        )

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

    def density(self, scope: float, fraction: float) -> np.ndarray:
        """Elements per length along the shape at ``scope``, from the body, that each of WANTS asks for [6, n].

        share [m]: h^4 |d4r/ds4| of an element, see mesh_order.py.
        """
        shape, curve = self.shapes[scope], self.curves[scope]
        steep = power(curve / max(fraction, 1e-12), 1.0 / self.order.power)
        if scope not in self.fixed:
            mass, added = self.masses[:, shape.section]
            speed = np.sqrt(np.maximum(shape.tension, 1e-9) / (mass + shape.wet * added))
            self.fixed[scope] = PER_WAVE / (speed * SHORTEST_PERIOD), self.layers(shape)
        far = shape.s[-1] - shape.s
        wants = [
            steep,
            *self.fixed[scope],
            np.zeros_like(far),
            np.full_like(far, self.touchdown),
            self.for_waves[scope],
        ]
        for place, jump in self.kinks[scope]:
            if jump > 0.0:
                here = sqrt(self.order.per_kink * jump / (KINK_FRACTION * self.position))
                i = int(np.searchsorted(shape.s, place))
                rise = abs(float(shape.force[i, 2])) / float(shape.tension[i])
                travel = self.heave / max(rise, 1e-3) if shape.wet[i] != shape.wet[min(i + 1, len(far) - 1)] else 0.0
                wants[3] = np.maximum(wants[3], here * (np.abs(shape.s - place) < 0.5 / here + travel))
        return np.array(wants)

    @property
    def touchdown(self) -> float:
        """Elements per length where the cable may come down on a seabed: anywhere along it, if it is long enough."""
        scene = self.scene
        if scene.seabed.depth is None:
            return 0.0
        height = scene.seabed.depth + scene.sheave.position[2] + scene.ship.reference_height
        return PER_HEIGHT / height if max(self.shapes) > height else 0.0

    @property
    def heave(self) -> float:
        """Heave [m] that the mesh is made for: a sea for a ship, ripples for a tow of a few metres."""
        return heave_amplitude(self.start)

    def layers(self, shape: TowShape) -> np.ndarray:
        """Elements per length [n] for sideways motion, from where it gets it: the sheave, and what hangs on it."""
        wants = 1.0 / (LAYERS * self.damped_length(shape, shape.tension[-1]) + SMOOTH * (shape.s[-1] - shape.s))
        leans = hypot(*shape.force[0, :2]) > LEANS * shape.tension[0]
        if self.corners and leans:  # straight down a heave moves nothing sideways
            layer = self.damped_length(shape, shape.tension[0])
            wants = np.maximum(wants, 1.0 / (AT_BODY * layer + SMOOTH * shape.s))
        for corner in self.corners:
            turn = corner.turns.get(shape.scope)
            if turn is not None:
                away = np.abs(shape.s - turn.at)
                layer = self.damped_length(shape, np.interp(turn.at, shape.s, shape.tension))
                wants = np.maximum(wants, 1.0 / (LAYERS * layer + SMOOTH * away))
        return wants

    def damped_length(self, shape: TowShape, tension: float) -> float:
        """Length [m] within which drag damps sideways motion of the cable under ``tension`` [N]: sqrt(T/(b omega))."""
        water, thickest = self.scene.water, extreme(self.scene.cable, "diameter", max)[1]
        omega = 2.0 * pi / SHORTEST_PERIOD
        drag = water.density * thickest * BROADSIDE_DRAG * max(shape.speed, omega * self.heave)
        return sqrt(float(tension) / (drag * omega))

    def outboard(self, aboard: np.ndarray, size: float, fraction: float, by_hand: bool) -> FeedMesh:
        """The whole mesh: fractions of each zone that serve at every scope; by_hand: with the numbers of the scene."""
        fractions = []
        wants = {scope: self.density(scope, fraction) for scope in self.shapes}
        densities = {scope: want.max(0) for scope, want in wants.items()}
        self.zones = zones(self.scene, self.corners, self.position, by_hand)
        for i, length, sizes, _ in self.zones:
            if sizes:
                fractions.append(np.append(np.cumsum(sizes[:-1]) / length, 1.0))
                continue
            name = self.names[i]
            written = self.scene.mesh.sections.get(name) if by_hand else None
            x, n = self.envelope(i, densities)
            count = max(1, ceil(integral(n, x) - 1e-6))
            count = min(count, max(1, int(length / (SHORTEST * size))))
            self.reasons[f"section {name}"] = self.why(i, wants)
            if written is not None and written.elements is not None:
                count = written.elements
                self.reasons[f"section {name}"] = "by hand: mesh.sections"
            fractions.append(
                equal_parts(x, n, count)
                if written is None or written.grading is None
                else geometric(count, written.grading)
            )
        pressed = np.array([len(s) * (PRESSED if i < len(fractions) - 1 else 1.0) for i, s in enumerate(fractions)])
        room = MIN_OUTBOARD * (self.start + self.route.inboard - aboard[-1]) / pressed.sum()
        ends, sections = np.cumsum([zone.length for zone in self.zones]), np.array([z.section for z in self.zones])
        ends[-1] = self.route.total
        return FeedMesh(aboard, tuple(fractions), np.cumsum(pressed * min(size, room)), ends, sections)

    def why(self, section: int, wants: dict[float, np.ndarray]) -> str:
        """What decides the elements of a section, at the start, or with the most cable out."""
        for scope in (self.start, max(self.shapes)):
            shape = self.shapes[scope]
            here = np.flatnonzero(shape.section == section)
            if len(here) < 2:
                continue
            want, s = wants[scope][:, here], shape.s[here]
            first = want.argmax(0)
            parts = [integral(np.where(first == k, want[k], 0.0), s) for k in range(len(WANTS))]
            names = (self.order.what, *WANTS[1:])
            texts = [text for text, part in zip(names, parts, strict=True) if part > 0.2 * sum(parts)]
            return "; ".join(texts)
        return "never outboard"

    def envelope(self, section: int, densities: dict[float, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Elements per share of a section's zone, the most that any scope wants, over the share from inboard."""
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
        size = (1.0 / np.maximum(n, 1.0)).tolist()  # as lists: a fifth of the time
        rise = (SMOOTH * np.diff(x)).tolist()
        for i in range(1, len(x)):
            size[i] = min(size[i], size[i - 1] + rise[i - 1])
        for i in reversed(range(len(x) - 1)):
            size[i] = min(size[i], size[i + 1] + rise[i])
        return x, 1.0 / np.array(size)

    # what comes of it

    def arcs(self, mesh: FeedMesh, scope: float) -> np.ndarray:
        """Distance [m] of the outboard nodes from the body at ``scope``, from the last node aboard on."""
        total = self.route.total
        return total - places_outboard(mesh, total, total - scope - self.route.inboard)

    def expected_position(self, mesh: FeedMesh, scope: float) -> float:
        """Error [m] of the body's place with ``scope`` out."""
        shape, curve = self.shapes[scope], self.curves[scope]
        nodes = self.arcs(mesh, scope)[::-1]
        h = np.diff(nodes)
        if (h <= 0.0).any():
            return np.inf
        at = [np.interp(x, shape.s, curve) for x in (nodes[1:], 0.5 * (nodes[1:] + nodes[:-1]), nodes[:-1])]
        error = self.order.per_shape * float((power(h, self.order.power) * np.maximum.reduce(at)).sum())
        error += self.floor(scope, mesh.nodes) + corner_error(self.corners, nodes, scope)
        for s, jump in self.kinks[scope]:
            if np.abs(nodes - s).min() > 1e-6 * scope:
                error += self.order.per_kink * float(h[min(int(np.searchsorted(nodes, s)), len(h)) - 1]) ** 2 * jump
        return error

    def errors(self, mesh: FeedMesh) -> list[Expected]:
        """What the mesh outboard and the solver leave, at every scope that leaves the mesh room."""
        found, weight = [], float(self.masses[0].max()) * self.scene.gravity
        pressed = float(mesh.aboard[-1] + mesh.minimum[-1]) - self.route.inboard
        for scope, shape in self.shapes.items():
            if scope < min(pressed, self.start):
                continue
            position = self.expected_position(mesh, scope)
            load = weight + float(shape.drag.max())
            found.append(Expected(scope, load * position / float(shape.tension[-1]), position))
        return found

    def promise(self, mesh: FeedMesh) -> tuple[Expected, ...]:
        """Expected errors at the largest scope, at the start, and below it."""
        begin, end = mesh.aboard[:-1], mesh.aboard[1:]
        size = float((end - begin)[(end > self.contact[0]) & (begin < self.contact[1])].max())
        sheave = size / self.route.sheave / RADII_PER_TENSION
        minimum = (MIN_WITH_BODIES if self.corners else MIN_PROMISE) * self.position
        found = []
        for scope, tension, position in self.errors(mesh):
            if self.shapes[scope].closed:
                waves = wave_error(self.waves, self.shapes[scope], self.arcs(mesh, scope)[::-1])
                tension, position = max(sheave, tension, waves), max(position, minimum)
            else:
                tension = position = nan
            found.append(Expected(scope, tension, position))
        return tuple(found)

    def parts(self, mesh: FeedMesh) -> tuple[Part, ...]:
        """Rows of the table, from the drum."""
        sizes, first = np.diff(mesh.aboard), self.inboard
        rows = []
        if first:
            rows.append(Part("inboard", "ship", first, *ends(sizes[:first]), self.reasons["inboard"]))
        last = len(sizes) - self.spare
        rows.append(Part("sheave", "ship", last - first, *ends(sizes[first:last]), self.reasons["sheave"]))
        if self.spare:
            rows.append(Part("hanging", "ship", self.spare, *ends(sizes[last:]), self.reasons["hanging"]))
        h, at = -np.diff(self.arcs(mesh, self.start)), 0
        for zone, fraction in zip(self.zones, mesh.fractions, strict=True):
            part = h[at : at + len(fraction)]
            at += len(fraction)
            name = self.names[zone.section]
            reason = self.reasons[f"section {name}"]
            if zone.corner is not None:
                reason = f"corner of {degrees(zone.corner.angle):.3g} deg at {zone.corner.what}"
                name = f"{name}, {'end' if zone.corner.section == zone.section else 'begin'}"
            rows.append(Part(name, "outboard", len(fraction), *ends(part), reason))
        return tuple(rows)

    def tick(self) -> float:
        """Step [s] that follows the shortest motion and the first axial mode of the tow."""
        body, stiff = self.scene.towbody, extreme(self.scene.cable, "axial_stiffness", max)[1]
        mass = body.mass + body.added_mass[2] + 0.4 * float(self.masses[0].min()) * self.start
        axial = 2.0 * pi * sqrt(mass * max(self.start, 1e-3) / stiff)
        step = min(SHORTEST_PERIOD, max(axial, 0.2)) / 40.0
        return float(f"{min(step, 0.05):.1g}")
