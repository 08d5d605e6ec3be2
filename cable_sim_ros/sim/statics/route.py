"""Static start: the geometric route of the cable from drum to sheave and outboard, then equilibrium on it.

The route lies in the ship's vertical plane through drum and sheave: drum arc, outer tangent, sheave arc, straight line.
Westin's pull-through (5.3) is not needed: backward Euler with growing steps settles from here.
"""

from __future__ import annotations

from math import asin, atan2, cos, hypot, pi, sin, tan

import numpy as np

from ...errors import RunError
from ...physics.cable_assembly import Cable
from ...physics.fairing import PRESETS
from ...physics.section import Section, material_of
from ...physics.winch import DrumModel
from ..scene import Scene
from ..tables.material import extreme, hung, wet_weight

DRUM_RESERVE = 0.3  # rad of wrap that must stay on the drum
FIRST_DRAG = 1.2  # drag coefficient of the first guess
MAX_STEPS = 400
LAID_OUT = 1.22  # rad from the vertical, of a first guess that lies on the seabed
MAX_STRAIN = 0.01  # of the first guess
ROUND_OFF = 1e-12  # least residual that can be asked for, over EA
MAX_PUSH = 0.01  # push in a cable at rest over its largest tension: more is no state a cable stays in


class StartError(RunError):
    """No static equilibrium was found; ``residual`` [N] is what is left."""

    cause = "NO_START"

    def __init__(self, message: str, residual: float):
        super().__init__(message)
        self.residual = residual


def first_angle(scene: Scene, speed: float) -> float:
    """Angle [rad] from the vertical of the straight line the start begins with: the critical angle of the free cable.

    w cos b = q G sin^2 b for the angle b from the horizontal, mean G of the sections; speed of the water past it [m/s].
    """
    cable, water = scene.cable, scene.water
    sections = cable.sections.values()
    length = sum(s.length for s in sections)
    weight = wet_weight(scene, next(iter(sections)))  # and what the others weigh more
    weight += sum((wet_weight(scene, s) - weight) * s.length for s in sections) / length
    weight += sum(thing.net_weight for thing in hung(scene)) / length
    drag = 0.5 * FIRST_DRAG * water.density * cable.diameter * speed**2
    drag *= sum(s.length * s.drag_amplification * drag_fraction(cable, s) for s in sections) / length
    if drag < 1e-9 * abs(weight):
        return 0.0
    k = max(weight, 1e-9) / (2.0 * drag)
    return asin(hypot(k, 1.0) - k)


def drag_fraction(cable: Cable, section: Section) -> float:
    """Drag of the first guess of a section over that of the bare cable, without amplification [1]."""
    preset = PRESETS[section.fairing]
    faired = 1.0 if preset.drag_coefficient is None else preset.drag_coefficient / FIRST_DRAG
    return material_of(cable, section).diameter / cable.diameter * preset.thickness * faired


def laid_angle(scene: Scene, route: Route, angle: float) -> float:
    """The same angle, or a flatter one where that line would reach the seabed: cable that is laid out tight comes to
    rest, cable let down in a bight folds on the ground."""
    if scene.seabed.depth is None:
        return angle
    free = route.total - route.wound - route.span
    down = scene.seabed.depth + scene.sheave.position[2] + scene.ship.reference_height
    return max(angle, LAID_OUT) if free * cos(angle) > down else angle


def first_strain(scene: Scene) -> float:
    """Strain [1] of a stretched first guess: that of the working tension in the softest section."""
    return min(scene.contact.working_tension / extreme(scene.cable, "axial_stiffness")[1], MAX_STRAIN)


class Route:
    """Geometry of the route in coordinates X (from drum towards sheave) and Z (up), origin at the drum centre.

    drum, sheave: radii of the cable's centreline [m]; side: +1 where the sheave lies aft (-x) of the drum; tilt: rise
    of the outer tangent [rad]; wound: length on the drum at the start [m]; on_drum: that part of it which is meshed;
    span: length of the tangent [m].
    """

    def __init__(self, scene: Scene):
        half = 0.5 * scene.cable.diameter
        self.drum, self.sheave = scene.winch.drum_radius + half, scene.sheave.radius + half
        self.centre = np.array(scene.winch.position)
        across = scene.sheave.position[0] - scene.winch.position[0]
        self.side = 1.0 if across < 0.0 else -1.0
        self.away, self.rise = abs(across), scene.sheave.position[2] - scene.winch.position[2]
        self.offset = scene.sheave.position[1] - scene.winch.position[1]
        distance = hypot(self.away, self.rise)
        self.tilt = atan2(self.rise, self.away) - asin((self.drum - self.sheave) / distance)
        self.span = distance * cos(asin((self.drum - self.sheave) / distance))
        self.wrap = scene.winch.wrap
        wrapped = self.drum * (self.wrap - self.tilt)
        self.feeds = scene.winch.drum == DrumModel.FEED
        self.total = sum(s.length for s in scene.cable.sections.values())
        self.wound = wrapped
        if self.feeds and scene.winch.cable_on_drum is not None:
            self.wound = scene.winch.cable_on_drum
        elif self.feeds and scene.winch.scope is not None:
            self.wound = self.total - self.inboard - scene.winch.scope
        self.on_drum = 0.0 if self.feeds else wrapped
        bed = scene.seabed.depth
        self.bottom = -np.inf if bed is None else half - bed - scene.ship.reference_height - self.centre[2]

    @property
    def inboard(self) -> float:
        """Length [m] from leaving the drum to the point above the sheave's axis; the scope begins there."""
        return self.span + self.sheave * (self.tilt if self.tilt > 0.0 else tan(self.tilt))

    @property
    def scope(self) -> float:
        """Length [m] outboard at the start, from the point above the sheave's axis."""
        return self.total - self.wound - self.inboard

    def on_sheave(self, angle: float) -> float:
        """Length [m] that lies on the sheave under a line that leaves at ``angle`` [rad] from the vertical."""
        return max(self.sheave * (0.5 * pi - angle + self.tilt), 0.0)

    def place(self, s: float, angle: float) -> tuple[float, float, float, float]:
        """X, Z and direction at arc length s from the first node; a straight line leaves at ``angle`` [rad] from the
        vertical."""
        if s < self.on_drum:
            phi = self.wrap - s / self.drum
            return -self.drum * sin(phi), self.drum * cos(phi), cos(phi), sin(phi)
        s -= self.on_drum
        if s < self.span:
            return (
                -self.drum * sin(self.tilt) + s * cos(self.tilt),
                self.drum * cos(self.tilt) + s * sin(self.tilt),
                cos(self.tilt),
                sin(self.tilt),
            )
        s -= self.span
        leave = 0.5 * pi - angle
        psi = min(-self.tilt + s / self.sheave, leave)
        x, z = self.away + self.sheave * sin(psi), self.rise + self.sheave * cos(psi)
        rest = max(s - self.on_sheave(angle), 0.0)
        if z - rest * sin(psi) < self.bottom:  # laid down along the seabed
            down = (z - self.bottom) / sin(psi)
            return x + down * cos(psi) + rest - down, self.bottom, 1.0, 0.0
        return x + rest * cos(psi), z - rest * sin(psi), cos(psi), -sin(psi)

    def nodes(self, arc: np.ndarray, angle: float) -> tuple[np.ndarray, np.ndarray]:
        """Positions and unit tangents [nodes, 3] in base_link at arc lengths from the first node."""
        r, g = np.zeros((len(arc), 3)), np.zeros((len(arc), 3))
        for i, s in enumerate(arc):
            x, z, dx, dz = self.place(float(s), angle)
            fraction = min(max(x / self.away, 0.0), 1.0)
            r[i] = self.centre + (-self.side * x, self.offset * fraction, z)
            g[i] = (-self.side * dx, 0.0, dz)
        return r, g
