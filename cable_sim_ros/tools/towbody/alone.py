"""A body with an attitude alone, its tow point held in a stream: loads, small motions, and the fins it needs.

Every figure is of the product's own assembly. Pitch is nose up.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import radians

import numpy as np
from scipy.linalg import eigvals
from scipy.spatial.transform import Rotation

from ...physics.fluid import Fluid
from ...physics.state import AT_REST, NOW, Change
from ...physics.towbody import Towbody
from ...physics.wing import Wing
from ...sim.rig.rig import Rig, cable_of
from ...sim.scene import Scene
from ...sim.tables.rigid_tables import hull_centre

DEPTH = 50.0  # m, far from the surface
MOST_SCALE = 64.0  # of the area of the tail, where its least is sought
HALVINGS = 20
ROLL, PITCH, YAW = range(3)


class Alone:
    """The body in a stream of ``speed`` [m/s] from ahead, on a line that bears nothing."""

    def __init__(self, scene: Scene, body: Towbody, speed: float) -> None:
        cable = cable_of([{"length": 1e3, "elements": 1}], mass_per_length=1e-5, axial_stiffness=1.0, diameter=1e-4)
        water = Fluid(density=scene.water.density, current=(-speed, 0.0))
        self.body, self.weight = body, body.net_weight
        self.rig = Rig(cable, held={0: "r"}, bodies={-1: body}, tension=1.0, water=water, gravity=scene.gravity)
        self.rig.straight((0.0, 0.0, 1e3 - DEPTH), (0.0, 0.0, -1.0))

    def turn(self, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0) -> None:
        """Hold it at these angles [deg], pitch nose up, yaw from the stream."""
        self.rig.turn(Rotation.from_euler("ZYX", (yaw, -pitch, roll), degrees=True).as_quat())

    def drag_and_lift(self) -> tuple[float, float]:
        """Along the stream and up [N], without weight and buoyancy."""
        self.rig.residual()
        force = self.rig.state.work.band[-1, :3, 12]
        return -float(force[0]), float(force[2]) + self.weight

    def stiffness(self) -> np.ndarray:
        """Moments to the rotation [N m], the tow point held."""
        self.rig.residual(AT_REST, True)
        return np.array(self.rig.state.attitude[NOW, 0].stiffness)

    def modes(self, axes: Sequence[int] = (ROLL, PITCH, YAW)) -> np.ndarray:
        """Eigenvalues [1/s] of small turns about the held tow point, of these axes, the others held: lambda^2 M +
        lambda C + K, each of the tangent."""
        parts, keep = [], np.ix_(axes, axes)
        for change in (Change(1.0, 1.0, 0.0, 0.0), Change(2.0, 1.0, 0.0, 0.0), Change(1.0, 2.0, 0.0, 0.0)):
            self.rig.state.attitude["turned"][:] = 0.0
            self.rig.residual(change, True)
            parts.append(np.array(self.rig.state.attitude[NOW, 0].stiffness)[keep])
        c, m = parts[1] - parts[0], parts[2] - parts[0]
        k, zero, one = parts[0] - c - m, np.zeros_like(c), np.eye(len(c))
        found = eigvals(np.block([[zero, one], [-k, -c]]), np.block([[one, zero], [zero, m]]))
        return found[np.argsort(abs(found))]


def oscillations(modes: np.ndarray) -> list[dict[str, float]]:
    """Natural period [s] and damping ratio of the modes that swing, the slowest first."""
    return [
        {"period_s": float(2.0 * np.pi / abs(x)), "damping_ratio": float(-x.real / abs(x))}
        for x in modes
        if x.imag > 1e-9
    ]


def of_tail(body: Towbody, wing: Wing, axis: int = YAW) -> bool:
    """Is it behind the hull's centre, and stands so that it holds the body in yaw, or in pitch?"""
    across = (np.sin if axis == YAW else np.cos)(radians(wing.dihedral))
    return wing.place[0] < hull_centre(body)[0] and abs(across) > 0.5


def moved(body: Towbody, ahead: float, up: float = 0.0, scale: float = 1.0, axis: int = YAW) -> Towbody:
    """The body with its tow point so far ahead and up [m] of where it is, and the area of its tail times ``scale``."""
    shift, values = np.array([-ahead, 0.0, -up]), {}
    for name in ("centre_of_gravity", "centre_of_buoyancy", "hull_centre"):
        if (place := getattr(body, name)) is not None:
            values[name] = tuple((np.array(place) + shift).tolist())
    wings = {}
    for name, wing in body.wings.items():
        size = scale**0.5 if of_tail(body, wing, axis) else 1.0
        place = tuple((np.array(wing.place) + shift).tolist())
        wings[name] = wing.model_copy(update={"place": place, "span": wing.span * size, "chord": wing.chord * size})
    return body.model_copy(update=values | {"wings": wings})


def least_scale(scene: Scene, body: Towbody, speed: float, axis: int = YAW) -> float | None:
    """Least share of its tail that holds the body, level, in yaw or pitch, by halving; None: none up to MOST_SCALE."""

    def holds(scale: float) -> bool:
        return bool(Alone(scene, moved(body, 0.0, 0.0, scale, axis), speed).stiffness()[axis, axis] > 0.0)

    low, high = 1e-6, MOST_SCALE
    if holds(low):
        return 0.0
    if not holds(high):
        return None
    for _ in range(HALVINGS):
        middle = (low * high) ** 0.5
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high
