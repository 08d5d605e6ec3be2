"""The trim of bodies with an attitude: is what a static start found one that a small turn comes back to?

The start is drawn to unstable trims too, for its long steps damp what grows. So the moments' derivative to the rotation
is asked, the tow point held: weight, buoyancy, Munk's moment, hull and wings together.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, hypot
from typing import TYPE_CHECKING

import numpy as np

from ..compiler.jit import YES, driver
from ..physics.attitude import axes, roll_pitch_yaw
from ..physics.line import residual
from ..physics.state import AT_REST, FLOW, NOW
from ..physics.towbody import BodyModel
from ..physics.water_kinematics import STILL
from ..physics.wind import wash
from .checks.attitude_checks import critical_speed
from .statics.route import StartError
from .tables.material import bodies_of
from .tables.rigid_tables import SLOPE_OF_A_TAIL

if TYPE_CHECKING:
    from .static_equilibrium import Tow

AXES = "roll", "pitch", "yaw"
FREE = 1e-3  # of what SLACK gives: less about the vertical is none at all, as of a body in the air
SLACK = 1e-3  # of the weight times the length: a stiffness below that is none


class UnstableTrim(StartError):
    """A body does not keep the trim that balances it; body: its key, axis: the one in which a small turn grows."""

    def __init__(self, message: str, body: str, axis: str):
        super().__init__(message, 0.0)
        self.body, self.axis = body, axis


@driver
def tangent_at_rest(line, state):
    """Residual and tangent of the present nodes and attitudes, at rest [N]."""
    wash(line, state, STILL)
    return residual(line, state, AT_REST, YES)


def rigid_names(sim: Tow) -> list[str]:
    """Keys of the bodies with an attitude, in their order."""
    return [key for key, body in bodies_of(sim.scene).items() if body.model is BodyModel.RIGID]


def trim(sim: Tow, i: int) -> tuple[float, float, float]:
    """Roll, pitch (nose down) and heading of rigid body i [rad]."""
    roll, pitch, yaw = roll_pitch_yaw(sim.state.attitude[NOW, i].quaternion)
    return float(roll), float(pitch), float(yaw)


def unstable(sim: Tow) -> Iterator[UnstableTrim]:
    """Errors of the bodies whose trim a small turn leaves: by the sign of the roots of det(D + x) = 0 (Routh)."""
    if not len(sim.model.line.rigid.bodies):
        return
    tangent_at_rest(sim.model.line, sim.state)
    for i, name in enumerate(rigid_names(sim)):
        row = sim.model.line.rigid.bodies[i]
        d = np.array(sim.state.attitude[NOW, i].stiffness)
        speed = hypot(*sim.state.nodes[NOW, FLOW, row.node, :2].tolist())
        least = SLACK * row.mass * row.gravity * row.length
        up = np.array(axes(sim.state.attitude[NOW, i].quaternion)[2])
        slow = speed < sim.model.line.bodies["min_flow"][sim.model.line.bodies["rigid"] == i][0]
        if slow or abs(float((up[:, None] * d * up[None, :]).sum())) < FREE * least:
            d = d + least * up[:, None] * up[None, :]  # nothing holds a heading in still water or in air, nor need it
        (a, b, c), (e, f, g), (h, j, k) = d
        minors = a * f - b * e + a * k - c * h + f * k - g * j
        whole = a * (f * k - g * j) - b * (e * k - g * h) + c * (e * j - f * h)
        if whole > 0.0 and a + f + k > 0.0 and (a + f + k) * minors > whole:
            continue
        worst = int(np.argmin(np.diag(d)))
        yield _unstable(sim, name, i, worst, float(d[worst, worst]), speed)


def _unstable(sim: Tow, name: str, i: int, worst: int, stiffness: float, speed: float) -> UnstableTrim:
    row, (roll, pitch, _) = sim.model.line.rigid.bodies[i], trim(sim, i)
    up = axes(sim.state.attitude[NOW, i].quaternion)[2]
    lever = row.mass * row.gravity * row.gravity_centre - row.buoyancy * row.buoyancy_centre
    still = float((lever * np.array(up)).sum()) if worst < 2 else 0.0  # of weight and buoyancy to roll and pitch
    cures = []
    critical = critical_speed(sim.scene, bodies_of(sim.scene)[name])
    if critical < speed:
        cures.append(
            f"tow below {critical:.3g} m/s, above which Munk's moment takes it out of its level trim, or give it level "
            "fins at its tail"
        )
    if worst > 0 and stiffness < 0.0 and speed > 0.0:
        arm = 0.5 * float(row.length) - float(row.hull_centre[0])
        area = -stiffness / (0.5 * sim.scene.water.density * SLOPE_OF_A_TAIL * speed**2 * max(arm, 1e-3))
        kind = "level" if worst == 1 else "upright"
        cures.append(f"give it {area:.2g} m^2 more of {kind} fins (aspect ratio 2) at its tail")
    cures.append("lower centre_of_gravity" if worst < 2 else "move the tow point ahead")
    return UnstableTrim(
        f"{sim.scene.name}: {name} would not keep the trim that balances it, roll {degrees(roll):.1f} and pitch "
        f"{degrees(-pitch):.1f} deg (nose up) at {speed:.3g} m/s: a small turn in {AXES[worst]} grows (moment "
        f"{stiffness:.3g} N m/rad, that of weight and buoyancy {-still:.3g}); nothing was started. "
        f"Remedy: {', or '.join(cures)}",
        name,
        AXES[worst],
    )
