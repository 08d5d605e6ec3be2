"""The part of a fed mesh that stays with the ship: from the drum over the sheave to a little outboard of it."""

from __future__ import annotations

from collections.abc import Callable
from math import degrees, pi, radians, sqrt

import numpy as np

from ...physics.ancf import ADDED_MASS, MASS_PER_LENGTH
from ...physics.integrate import TOLERANCE
from ...physics.section import CableModel
from ..mesh_blocks import SheaveAnswer
from ..problem import rounded_down
from ..scene import Scene
from ..statics.route import ROUND_OFF, Route
from ..statics.static_shape import TowShape
from ..tables.material import extreme, material_rows
from .mesh_corners import Corner, Zone
from .mesh_kinds import MeshError, even, graded
from .mesh_order import CUBICS, LINKS, MAX_SAGITTA, integral, kinks, longest_on
from .mesh_waves import wave_field

SWING = radians(10.0)  # departure angle against the static one under way in waves
SCOPES = (1.0, 0.3, 0.1)  # of the scope at the start; the largest that the winch pays out besides
MIN_SCOPE = 10.0  # sheave radii: nearer than that a body is hauled in, not towed
RADII_PER_TENSION = 50.0  # sheave element over its radius, per relative error of tension; 0.25 radii at 0.005
FINEST = 0.025  # radii; what 0.0005 asks for
COARSEST = 0.4
SLACK_RADII = 0.7  # element of slack cable of the span over the sheave's radius; overspeed, docs/stress.md N8
PER_BENDING = {SheaveAnswer.DISTRIBUTION: 1.5, SheaveAnswer.ENDS: 0.75}  # element over sqrt(EI/T)
SOFTEST_ENDS = 0.01  # penetration limit with which the ends of the contact are those of a rigid sheave
NO_BENDING = 0.2  # radii: element where a load along the sheave is wanted of a cable without bending stiffness
LAYER = 4.0  # bending lengths of fine mesh beside the sheave
MAX_HEAVE, HEAVE_PER_SCOPE = 1.0, 0.01  # m; and of the scope where that is less
MIN_OUTBOARD = 0.1  # of the scope at the start: all zones pressed together are no longer
USUAL_POSITION, PER_SCOPE = 0.01, (1e-5, 1e-3)  # m, kept within fractions of the scope: promised where nothing is said
PER_TOLERANCE = 0.5  # error of the body's place per residual of every node below, over the tension along the cable
SOLVER_FRACTION = 0.6  # of the error of the place may be the solver's


def scope_range(scene: Scene, route: Route) -> tuple[float, float, float]:
    """Scope [m] at the start, the least that the mesh is made for, and the largest that the winch pays out."""
    winch = scene.winch
    start = route.scope
    maximum = route.total - winch.dead_length - route.inboard
    if winch.most_scope is not None:
        maximum = min(maximum, winch.most_scope)
    low = max(SCOPES[-1] * start, winch.least_scope or 0.0, MIN_SCOPE * route.sheave)
    return start, min(low, start), max(maximum, start)


def heave_amplitude(scope: float) -> float:
    """Heave [m] that a mesh is made for and checked with, for a scope [m] at the start."""
    return min(MAX_HEAVE, HEAVE_PER_SCOPE * scope)


class SheaveMesh:
    """What a scene asks of its mesh, the static shapes it is made for, and the nodes aboard."""

    def __init__(self, scene: Scene, route: Route, shape: Callable[[float], TowShape]):
        """shape: static shape with so much scope [m]."""
        self.scene, self.route = scene, route
        self.names = list(scene.cable.sections)
        self.lengths = np.array([s.length for s in scene.cable.sections.values()])
        self.start, low, maximum = scope_range(scene, route)
        scopes = {maximum, *(max(fraction * self.start, low) for fraction in SCOPES)}
        self.shapes = {scope: shape(scope) for scope in sorted(scopes, reverse=True)}
        self.order = LINKS if scene.cable.model is CableModel.SEGMENTS else CUBICS
        self.curves = {scope: self.order.measure(shape) for scope, shape in self.shapes.items()}
        self.kinks = {scope: kinks(shape) for scope, shape in self.shapes.items()}
        self.fixed: dict[float, tuple[np.ndarray, np.ndarray]] = {}  # densities that no accuracy changes
        self.tension = max(float(shape.tension[-1]) for shape in self.shapes.values())
        self.bending = sqrt(extreme(scene.cable, "bending_stiffness")[1] / self.tension)
        rows = [material_rows(scene.cable, s, scene.water, scene.gravity) for s in scene.cable.sections.values()]
        self.masses = np.array([[row[MASS_PER_LENGTH], row[ADDED_MASS]] for row in rows]).T  # kg/m, own and added
        self.position = scene.accuracy.position or min(
            max(USUAL_POSITION, PER_SCOPE[0] * maximum), PER_SCOPE[1] * maximum
        )
        # of the working tension, to which forces are solved
        self.relative = TOLERANCE if scene.solver.tolerance is None else scene.solver.tolerance
        self.reasons: dict[str, str] = {}
        self.corners: list[Corner] = []
        self.waves = wave_field(scene)
        self.for_waves = {scope: np.zeros(len(shape.s)) for scope, shape in self.shapes.items()}  # elements per length
        self.zones: list[Zone] = []
        self.spare = 0  # elements aboard that only a tow that hangs straight down needs

    def check_solver(self, nodes: int) -> None:
        """Solve the forces to what the place asks for, and refuse one finer than the scene lets them be solved to; one
        that the scene does not ask for is then coarser."""
        worst = max(self.shapes, key=lambda scope: self.floor(scope, nodes))
        left, solver, working = self.floor(worst, nodes), self.scene.solver, self.scene.contact.working_tension
        if left <= SOLVER_FRACTION * self.position:
            return
        if self.scene.accuracy.position is None:
            self.position = 1.1 * left / SOLVER_FRACTION
            return
        takes, least = self.relative * SOLVER_FRACTION * self.position / left, self.round_off / working
        if takes > least and solver.tolerance is None:
            self.relative = max(rounded_down(takes), least)
            return
        can = left  # with round-off alone, by a mesh of up to six times the nodes
        if solver.tolerance is None:
            can *= 6.0 * self.round_off / self.tolerance
        less = f", or solver.tolerance {rounded_down(takes):g} or less"
        also = less if takes > least else "; round-off allows no less"
        raise MeshError(
            "accuracy.position",
            f"= {self.position:g} m cannot be met: forces are solved to {self.tolerance:.2g} N (solver.tolerance = "
            f"{self.relative:g} of contact.working_tension = {working:g} N), which with {worst:.4g} m of scope is "
            f"{left:.2g} m of the towbody's place",
            f"Give {1.1 * can / SOLVER_FRACTION:.2g} m or more{also}",
        )

    def floor(self, scope: float, nodes: int) -> float:
        """Error [m] of the body's place that the solver leaves whatever the mesh: its residual turns the tension."""
        shape = self.shapes[scope]
        below = nodes * shape.s / shape.s[-1]
        return PER_TOLERANCE * self.tolerance * integral(below / shape.tension, shape.s)

    @property
    def tolerance(self) -> float:
        """Largest residual of a solved step [N]."""
        return max(self.relative * self.scene.contact.working_tension, self.round_off)

    @property
    def round_off(self) -> float:
        """That which cannot be solved for [N]."""
        return ROUND_OFF * extreme(self.scene.cable, "axial_stiffness", max)[1]

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
        limit = self.scene.contact.penetration_limit * extreme(self.scene.cable, "diameter")[1]
        if self.order is LINKS and longest_on(radius, limit) < size:
            size = longest_on(radius, limit)
            reason = f"links whose middle is {MAX_SAGITTA:g} contact penetrations below their ends"
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
        shift = route.span * self.tension / extreme(self.scene.cable, "axial_stiffness")[1]
        # nodes stand at unstretched distances: tension moves them outboard
        shift = shift if shift > 0.25 * size else 0.0
        before = min((layer if mesh.before is None else mesh.before) + shift, 0.9 * route.span)
        min_angle = min(shape.angle for shape in self.shapes.values())
        if mesh.after is None:
            leaves = route.on_sheave(min_angle - SWING)
            hanging = max(route.on_sheave(0.0) - leaves, 0.0) + self.scene.accuracy.slack
        else:
            leaves, layer, hanging = route.on_sheave(self.shapes[self.start].angle), mesh.after, 0.0
        room = 0.5 * self.start
        if leaves <= 0.0:
            raise MeshError(
                "sheave.position",
                f"lets the cable pass over the sheave: from the drum it falls {degrees(-route.tilt):.3g} deg below the "
                f"horizontal, and the tow leads off {degrees(0.5 * pi - min_angle):.3g} deg below it, less by more "
                f"than the {degrees(SWING):.3g} deg that it swings in a seaway: nothing ever lies on the sheave",
                "Put the sheave higher against the drum (z is up), or tow with a steeper cable",
            )
        self.contact = (route.span * (1 + 1e-9), (route.span + min(leaves, room)) * (1 - 1e-9))  # m, on the sheave
        end = route.span + min(leaves + layer, room)
        begin = route.span - before
        if mesh.sheave is not None:
            fine = np.linspace(begin, end, mesh.sheave + 1)
            self.reasons["sheave"] = "mesh.sheave, by hand"
        else:
            cap = max(size, 0.75 * self.bending)
            inner = graded(before - shift, size, cap)[::-1]
            contact = even(min(leaves, room) + shift, size)
            outer = graded(max(end - route.span - leaves, 0.0), size, cap)
            # a ship that stops, and more still one that backs: the tow hangs straight down
            hanging = min(hanging, max(room - leaves - layer, 0.0))
            spare = even(hanging, COARSEST * self.scene.sheave.radius) if hanging > 0.25 * size else np.zeros(0)
            self.spare = len(spare)
            self.reasons["hanging"] = "a tow that hangs straight down wraps it round the sheave: the ship may stop"
            if self.scene.accuracy.slack > 0.0:
                self.reasons["hanging"] += f"; {self.scene.accuracy.slack:g} m of slack cable"
            fine = begin + np.concatenate(([0.0], np.cumsum(np.concatenate((inner, contact, outer, spare)))))
        count = mesh.inboard
        if count is None:
            count = 1 if begin < 4.0 * size else 2
            self.reasons["inboard"] = "cable under tension, nearly straight"
            if self.scene.accuracy.slack > 0.0:
                count = max(count, len(even(begin, SLACK_RADII * self.scene.sheave.radius)))
                self.reasons["inboard"] = (
                    f"{SLACK_RADII:g} sheave radii: slack cable of the span may come onto the sheave"
                )
        else:
            self.reasons["inboard"] = "mesh.inboard, by hand"
        self.inboard = 0 if begin <= 1e-9 else count
        if begin <= 1e-9:
            return fine
        return np.concatenate((np.linspace(0.0, begin, count + 1)[:-1], fine))

    def check_start(self, aboard: np.ndarray) -> None:
        """Refuse a start with less cable out than the mesh at the sheave holds."""
        off = self.start + self.route.inboard
        if aboard[-1] >= (1.0 - MIN_OUTBOARD) * off:
            minimum = aboard[-1] / (1.0 - MIN_OUTBOARD) - self.route.inboard
            raise MeshError(
                "winch.scope",
                f"of {self.start:.4g} m at the start ends on the mesh at the sheave, which reaches "
                f"{aboard[-1] - self.route.inboard:.3g} m outboard of the sheave's axis: nothing is left for the tow",
                f"Start with {1.1 * max(minimum, 0.0):.3g} m or more, or a shorter mesh.after",
            )
