"""A winch that feeds cable: closed forms of material flow, mass and energy, and the drum that was beside it.

Euler's capstan: ratio of the tensions of a cable drawn over a drum and through a groove that stand, and its heat.

T_1/T_2 = exp(mu theta/sin s), s half the throat angle, 90 deg of a drum. One end is drawn, the other bears a dead pull.
"""

from __future__ import annotations

from math import exp, log, pi, sin

import numpy as np
import pytest

from cable_sim_ros import Simulator, WinchCommand
from cable_sim_ros.compiler.jit import LANES
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.ancf import MASS_PER_LENGTH
from cable_sim_ros.physics.workspace import RUBBED
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.rig.rig import Rig, cable_of
from verification.bend import MOVING, Bend, Walk, drum, pieces, pulls
from verification.shipped import started

pytestmark = pytest.mark.trust

RADIUS, WRAP, PULL, SPEED, SLIP = 0.25, 1.2, 1000.0, 0.3, 1e-3
LEAD, SIZE, STEP, RISE = 1.0, 0.02, 0.01, 0.1  # m, m, s, s
# contact spreads over the penetration's chord, 2 sqrt(2 x 1e-3) of 1.2 rad by contact points of 0.02 m; the regularised
# friction is short of mu by (SLIP/SPEED)^2/2 = 6e-6; the rope's weight and its momentum are nothing (mass 0.05 kg/m)
WITHIN = 1e-3  # of the ratio

MASS, BODY, GRAVITY = 0.389, 250.0, 9.81


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


def in_air(tick: float = 0.01, **values) -> Simulator:
    """A weight on a cable of two masses per length over the sheave, far above the water: no drag, no buoyancy."""
    scene = override(
        load_scene("full_scale"),
        {
            "ship.tow_speed": 0.0,
            "ship.reference_height": 50.0,
            "setpoint.algorithm": "hold",
            "solver.tick": tick,
            "winch.scope": 25.0,
            "winch.max_acceleration": 2.0,
            "cable.axial_damping": 1e5,
            "towbody.net_weight": BODY * GRAVITY,
        }
        | {f"cable.sections.{name}.length": length for name, length in (("bare", 100.0), ("faired", 30.0))}
        | values,
    )
    return started(scene)


def mass_out(sim) -> float:
    """Mass of the meshed cable, as the elements have it [kg]."""
    lengths = np.diff(sim.state.arc)
    rows = np.concatenate([group[MASS_PER_LENGTH] for group in sim.model.line.elements])[: len(lengths)]
    assert LANES * len(sim.model.line.elements) >= len(lengths)
    return float(rows @ lengths)


@pytest.mark.parametrize("pull", [0.6, -0.6], ids=["paying out", "hauling in"])
def test_the_drum_pulls_with_the_mass_outboard_times_its_acceleration(pull):
    """Vertical cable in air: T = (mu l + M) (g - P''), whatever runs through the mesh; here up to 2 m/s."""
    sim = in_air()
    report = []
    for i in range(400):
        t = 0.01 * (i + 1)
        sim.push(WinchCommand(rate=pull * t))
        f = sim.tick()
        hung = MASS * (f.scope - layout_of(sim.scene).route.sheave) + BODY
        report.append((f.tension, hung * (GRAVITY - pull), f.payout_rate))
    tension, expected, rate = np.array(report[150:350]).T  # the weight bounces at first
    assert abs(rate[-1]) > 1.9
    print(f"T over (mu l + M)(g - a) - 1: {tension.mean() / expected.mean() - 1:.1e}")
    assert tension.mean() == pytest.approx(expected.mean(), rel=2e-3)


def test_what_runs_out_is_what_the_drum_loses_and_weighs_what_it_should():
    """Pay-out and cable on the drum add up; the elements hold the mass of the material between the nodes."""
    sim = in_air(0.02, **{"cable.sections.faired.mass_per_length": 0.8})
    total, ends = 130.0, np.array([100.0, 130.0])
    for target in (12.0, 120.0):
        for _ in range(6):
            sim.push(WinchCommand(payout=target))
            frames = sim.run(100)
            assert frames.payout + frames.cable_on_drum == pytest.approx(total, abs=1e-9)
            arc = sim.state.arc
            assert (np.diff(arc) > 0.0).all() and arc[-1] == pytest.approx(total, abs=1e-9)
            bare = max(ends[0] - arc[0], 0.0)
            assert mass_out(sim) == pytest.approx(MASS * bare + 0.8 * (total - arc[0] - bare), rel=1e-9)


def swung(name: str, values: dict) -> np.ndarray:
    """Tension [N] and towbody from its own start [m], and that from the sheave, while the winch swings 0.4 m in 8 s."""
    tick, omega = 0.02, 2.0 * np.pi / 8.0
    sim = started(override(load_scene(name), {"setpoint.algorithm": "hold", "solver.tick": tick} | values))
    first, report = sim.frame.body_position - sim.frame.sheave_position, []
    for i in range(round(16.0 / tick)):
        sim.push(WinchCommand(rate=0.4 * omega * np.cos(omega * tick * (i + 0.5))))
        f = sim.tick()
        hung = f.body_position - f.sheave_position
        report.append([f.tension, *(hung - first), *hung])
    return np.array(report)[round(8.0 / tick) :]


def test_small_travel_is_that_of_a_cable_wound_on_a_surface():
    """Within 1 % of the swing of the tension and 5 mm. What remains is the other drum's: cable that is fixed 3 m before
    the tangent point, on a surface that it presses in, and elements of 0.24 m there. Less of all that, less remains."""
    base = load_scene("full_scale_contact")
    route = layout_of(base).route
    scope = route.total - route.wound - route.inboard
    fed = swung("full_scale", {"winch.scope": scope})
    swing = np.ptp(fed[:, 0])
    left = {}
    for wrap in (10.0, 3.0):
        length = base.cable.sections["drum"].length - (base.winch.wrap - wrap) * route.drum
        gap = swung("full_scale_contact", {"winch.wrap": wrap, "cable.sections.drum.length": length}) - fed
        left[wrap] = (
            np.abs(gap[:, 0]).max(),
            np.linalg.norm(gap[:, 1:4], axis=1).max(),
            np.linalg.norm(gap[:, 4:], axis=1).max(),
        )
    print(f"swing {swing:.0f} N; tension [N], way and place [m] by wrap: {left}")
    assert left[10.0][0] < 0.01 * swing and left[10.0][1] < 5e-3
    assert left[3.0][0] < 0.6 * left[10.0][0] and left[3.0][2] < 0.6 * left[10.0][2] < 5e-3
