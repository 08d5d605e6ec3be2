"""A cable bent over a sheave of the laboratory: straight, arc, straight, in the x-z plane, the sheave's axis along +y.

Angles are places round the sheave [rad], from its top towards +x; the cable runs that way. The sheave is centred at the
origin. All of this is a first shape, a mesh and a load for the start; the equilibrium is the solver's.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np

from cable_sim_ros.physics.contact_surface import END_LOAD, stiffness, surface_row
from cable_sim_ros.sim.rig.rig import Rig, cable_of, load_of

PENETRATION = 1e-4  # of the radius, under the line load T/R: does not show
MOVING = 1e-3  # the same where cable runs on: a fifth of the shipped one; stiffer contact only chatters more


class Bend(NamedTuple):
    """Route of a cable that meets the sheave at ``first`` after ``lead`` [m] and leaves it at ``last``."""

    radius: float  # of the centreline [m]
    first: float
    last: float
    lead: float

    @property
    def contact(self) -> float:
        """Length on the sheave [m]."""
        return self.radius * (self.last - self.first)

    def angle(self, s: np.ndarray) -> np.ndarray:
        """Angle of the tangent at arc length s."""
        return np.clip(self.first + (s - self.lead) / self.radius, self.first, self.last)

    def nodes(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Positions and unit tangents at arc lengths s [n, 3]."""
        psi = self.angle(s)
        g = np.stack([np.cos(psi), 0.0 * psi, -np.sin(psi)], 1)
        r = self.radius * np.stack([np.sin(psi), 0.0 * psi, np.cos(psi)], 1)
        ahead = np.minimum(s - self.lead, 0.0) + np.maximum(s - self.lead - self.contact, 0.0)
        return r + ahead[:, None] * g, g

    def turning(self, s: np.ndarray) -> np.ndarray:
        """Change of the unit tangent per length, inward [1/m, n, 3]; half of it where arc and straight meet."""
        psi, on = self.angle(s), s - self.lead
        eps = 1e-9 * self.radius
        fraction = 0.5 * ((on > eps) & (on < self.contact + eps)) + 0.5 * ((on > -eps) & (on < self.contact - eps))
        return -(fraction / self.radius)[:, None] * np.stack([np.sin(psi), 0.0 * psi, np.cos(psi)], 1)


def pieces(*parts: tuple[float, float]) -> list[dict]:
    """Sections of a cable from pairs (length, longest element) [m]."""
    return [{"length": length, "elements": max(int(ceil(length / size - 1e-9)), 1)} for length, size in parts]


def drum(
    radius: float,
    tension: float,
    damping: float = 0.3,
    penetration: float = PENETRATION,
    half_angle: float | None = None,
    depth: float = 0.0,
) -> np.ndarray:
    """Surface at the origin (a cylinder, or a groove of this half angle [rad] and depth [m]).

    penetration: of the radius, that the line load tension/radius presses in. damping: Hunt-Crossley D [s/m].
    """
    sine, flanks = (1.0, 1) if half_angle is None else (np.sin(half_angle), 2)
    k = stiffness(tension / END_LOAD, radius, sine, flanks, penetration * radius)
    throat = None if half_angle is None else 2.0 * half_angle
    return surface_row((0.0, 0.0, 0.0), radius, throat, depth, 0.0, k, damping)


def laid(
    parts: list[tuple[float, float]], mass: float, ea: float, radius: float, tension: float, give: float, **more
) -> Rig:
    """A rope without bending stiffness and its sheave; parts: length and longest element [m]; mass [kg/m], EA [N].

    give: penetration of drum(); more: of Rig.
    """
    cable = cable_of(pieces(*parts), mass_per_length=mass, axial_stiffness=ea)
    return Rig(cable, tension=tension, surfaces=[drum(radius, tension, penetration=give)], **more)


def pulls(*forces: tuple[int, tuple[float, float, float] | np.ndarray]) -> list[np.ndarray]:
    """Dead forces [N] on nodes, as LOAD records."""
    return [load_of(node, force) for node, force in forces]


def far_pulls(bend: Bend, total: float, tension: float) -> list[np.ndarray]:
    """Dead pull [N] on both ends of a cable of ``total`` [m], outward along its straight parts."""
    _, g = bend.nodes(np.array([0.0, total]))
    return pulls((0, -tension * g[0]), (-1, tension * g[1]))


def harden(rig: Rig, tension: float, penetrations: tuple[float, ...]) -> None:
    """Settle with a surface that gives way by each of these shares of its radius in turn: Newton's way is short."""
    surface = rig.state.surfaces[0]
    for p in penetrations:
        surface["stiffness"] = drum(float(surface["radius"]), tension, penetration=p)["stiffness"]
        rig.settle()


def distributed(arc: np.ndarray, per_length: np.ndarray) -> list[np.ndarray]:
    """A load per length [n, 3] lumped on the nodes [N]."""
    fraction = np.zeros(len(arc))
    fraction[:-1] += 0.5 * np.diff(arc)
    fraction[1:] += 0.5 * np.diff(arc)
    return pulls(*((n, fraction[n] * per_length[n]) for n in range(len(arc))))


class Walk:
    """The clock of a rig that is stepped one by one; a step that Newton cannot solve goes in halves."""

    def __init__(self, rig: Rig, moved: tuple[int, ...] = (), motion=None):
        """motion(t [times] since the beginning) -> [times, len(moved), 9] of r, v, a of the moved nodes."""
        self.rig, self.moved, self.motion = rig, moved, motion
        self.time, self.smallest = 0.0, np.inf

    def step(self, h: float) -> None:
        """Advance by h [s]. Raises RigError."""
        begin = self.time
        motion = None if self.motion is None else (lambda t: self.motion(begin + t))
        for piece in self.rig.steps(h, moved=self.moved, motion=motion):
            self.smallest = min(self.smallest, piece)
        self.time = begin + h

    def to(self, end: float, step: float, look=None) -> list:
        """Equal steps near ``step`` up to time ``end`` [s]; look(time) after each. Returns what it returned."""
        count = max(int(round((end - self.time) / step)), 1)
        h, seen = (end - self.time) / count, []
        for _ in range(count):
            self.step(h)
            if look is not None:
                seen.append(look(self.time))
        return seen

    def note(self, step: float) -> list[str]:
        """What is to be reported where steps were halved."""
        if self.smallest > 0.75 * step:
            return []
        return [f"Newton asked for steps down to {self.smallest:.2g} s"]
