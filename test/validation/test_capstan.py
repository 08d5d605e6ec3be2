"""Euler's capstan: ratio of the tensions of a cable drawn over a drum and through a groove that stand, and its heat.

T_1/T_2 = exp(mu theta/sin s), s half the throat angle, 90 deg of a drum. One end is drawn, the other bears a dead pull.
"""

from __future__ import annotations

from math import exp, log, pi, sin

import numpy as np
import pytest

from cable_sim_ros.physics.workspace import RUBBED
from cable_sim_ros.sim.rig.rig import Rig, cable_of
from verification.bend import MOVING, Bend, Walk, drum, pieces, pulls

pytestmark = pytest.mark.trust

RADIUS, WRAP, PULL, SPEED, SLIP = 0.25, 1.2, 1000.0, 0.3, 1e-3
LEAD, SIZE, STEP, RISE = 1.0, 0.02, 0.01, 0.1  # m, m, s, s
# contact spreads over the penetration's chord, 2 sqrt(2 x 1e-3) of 1.2 rad by contact points of 0.02 m; the regularised
# friction is short of mu by (SLIP/SPEED)^2/2 = 6e-6; the rope's weight and its momentum are nothing (mass 0.05 kg/m)
WITHIN = 1e-3  # of the ratio


def drawn(friction: float, half_angle: float | None, way: float, slip: float = SLIP):
    """A cable drawn over the surface at SPEED * way (1: towards the drawn end) until the tensions stand."""
    bend = Bend(RADIUS, -0.5 * WRAP, 0.5 * WRAP, LEAD)
    total = 2.0 * LEAD + bend.contact
    surface = drum(RADIUS, PULL, penetration=MOVING, half_angle=half_angle, depth=RADIUS)
    surface["friction"], surface["slip"] = friction, slip
    cable = cable_of(pieces((total, SIZE)), mass_per_length=0.05, axial_stiffness=1e6, axial_damping=500.0)
    nodes = 1 + sum(s.elements for s in cable.sections.values())
    _, g = bend.nodes(np.array([0.0, total]))
    rig = Rig(
        cable, held={0: "r"}, tension=PULL, gravity=0.0, surfaces=[surface], loads=pulls((nodes - 1, PULL * g[1]))
    )
    rig.place(*bend.nodes(rig.arc))
    rig.settle()
    start = rig.state.q[0, :3].copy()

    def motion(t: np.ndarray) -> np.ndarray:
        """From rest to the speed within RISE, then on with it."""
        u = np.minimum(t / RISE, 1.0)[:, None]
        v = u * u * (3.0 - 2.0 * u)
        r = RISE * (u**3 - 0.5 * u**4) + np.maximum(t - RISE, 0.0)[:, None]
        a = 6.0 * u * (1.0 - u) / RISE
        return np.concatenate((start - r * SPEED * way * g[0], -v * SPEED * way * g[0], -a * SPEED * way * g[0]), 1)[
            :, None, :
        ]

    rig.balance()
    walk = Walk(rig, moved=(0,), motion=motion)
    return rig, walk


def ratio(rig: Rig) -> float:
    """Tension on the drawn side over that on the other, in the middle of the straight parts."""
    total = rig.arc[-1]
    return rig.tension_at(0.5 * LEAD) / rig.tension_at(total - 0.5 * LEAD)


@pytest.mark.parametrize("way", [1.0, -1.0], ids=["hauled", "paid_out"])
@pytest.mark.parametrize("friction", [0.1, 0.3])
@pytest.mark.parametrize("half_angle", [None, pi / 6], ids=["drum", "groove"])
def test_the_ratio_of_the_tensions_is_eulers(half_angle, friction, way):
    rig, walk = drawn(friction, half_angle, way)
    walk.to(0.6, STEP)
    euler = exp(way * friction * WRAP / (1.0 if half_angle is None else sin(half_angle)))
    assert ratio(rig) == pytest.approx(euler, rel=WITHIN)
    heat = float(rig.state.now.account["power"][RUBBED])
    through = SPEED * abs(rig.tension_at(0.5 * LEAD) - rig.tension_at(rig.arc[-1] - 0.5 * LEAD))
    assert heat == pytest.approx(through, rel=0.01)


def test_without_friction_both_sides_pull_alike():
    rig, walk = drawn(0.0, pi / 6, 1.0)
    walk.to(0.6, STEP)
    assert ratio(rig) == pytest.approx(1.0, abs=WITHIN)
    assert float(rig.state.now.account["work"][RUBBED]) == 0.0


def test_creep_under_a_stopped_winch_ends_with_the_stretch_that_drives_it():
    """Smooth friction bears nothing at rest: the cable creeps until both sides pull alike, by the stretch of the part
    inboard under the difference, T (ratio - 1) L/EA, and no farther."""
    rig, walk = drawn(0.3, None, 1.0, slip=0.01)
    walk.to(0.6, STEP)
    before = ratio(rig)
    assert before == pytest.approx(exp(0.3 * WRAP), rel=WITHIN)
    stop, bend = rig.state.q[0, :3].copy(), RADIUS * WRAP
    inboard = LEAD + SPEED * (walk.time - 0.5 * RISE)
    hold = Walk(rig, moved=(0,), motion=lambda t: np.tile(np.concatenate((stop, np.zeros(6))), (len(t), 1, 1)))
    past = int(np.flatnonzero(rig.arc > inboard + bend)[0])  # the first node past the drum
    at, heat = rig.state.q[past, :3].copy(), float(rig.state.now.account["work"][RUBBED])
    hold.to(1.0, STEP)
    crept, strain = float(np.linalg.norm(rig.state.q[past, :3] - at)), PULL * (before - 1.0) / 1e6
    assert log(ratio(rig)) < 0.01 * log(before)
    assert 0.98 * strain * inboard < crept < strain * (inboard + bend)
    assert float(rig.state.now.account["work"][RUBBED]) > heat
