"""Towbody: drag, lift and added mass along its axes, tangent against differences, turning into the flow."""

import numpy as np
import pytest
from bench_cable import about_z, body_slopes, record

from cable_sim_ros.compiler.jit import NO, YES
from cable_sim_ros.physics.contact_surface import floor_row
from cable_sim_ros.physics.line import AT_REST
from cable_sim_ros.physics.sea import ELEVATION, NODE_COLUMNS
from cable_sim_ros.physics.state import Change
from cable_sim_ros.physics.towbody import (
    Towbody,
    body_record,
    face_flow,
    heading,
    heading_held,
    lie,
    load,
    turn_into_flow,
)

pytestmark = pytest.mark.check

BODY = Towbody(
    mass=250.0, net_weight=445.0, added_mass=(11.0, 212.0, 200.0), drag_area=(0.0641, 0.9, 1.485), lift_area=-0.29836
)
STILL = (0.0, 0.0, 0.0, 0.0)
STILL_WATER = np.zeros(NODE_COLUMNS)


def body_band(z, water, change=AT_REST, tangent=NO, d=(0.0, 0.0, 0.0)):
    """The body's load at height z [6, 16], its node moved by d with velocity and acceleration following."""
    d, band = np.array(d), np.zeros((6, 16))
    q, v, a = np.array((0.0, 0.0, z)), np.array((1.2, 0.3, -0.5)), np.array((0.5, -0.2, 0.8))
    node = (q + d, v + change.velocity * d, a + change.acceleration * d, np.array((-1.0, -0.6, 0.1, 0, 0, 0.4)), water)
    load(record(body_record(BODY, 9.81, 1026.0)), node, (-2.0, 0.4, 0.02, -0.01), change, tangent, band)
    return band


def force(
    q=(0.0, 0.0, -50.0), v=(0.0, 0.0, 0.0), a=(0.0, 0.0, 0.0), current=STILL, flow=(-2.2, 0.0, 0.0), density=1000.0
):
    """Load on the body less its inertia, world axes [N]."""
    band = np.zeros((6, 16))
    node = tuple(np.array(x, float) for x in (q, v, a, np.resize((*flow, 0.0, 0.0, 0.0), 6)))
    load(record(body_record(BODY, 9.81, density)), (*node, STILL_WATER), current, AT_REST, NO, band)
    return band[:3, 12]


def test_lift_and_drag_of_the_thesis():
    """Westin 5.2: 722 N down at 2.2 m/s in fresh water; drag along x rho/2 A C U^2, net weight 445 N."""
    fx, fy, fz = force(current=(-2.2, 0.0, 0.0, 0.0))
    assert fz == pytest.approx(-445.0 - 722.02, abs=0.2)
    assert fx == pytest.approx(-0.5 * 1000.0 * 0.0641 * 2.2**2, rel=1e-6)
    assert fy == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("yaw", [0.0, 0.7, 2.5])
def test_axes_turn_with_the_flow(yaw):
    """The same motion relative to the body on another heading: the same force, turned."""
    turn = about_z(yaw)
    v, a = np.array((2.0, 0.3, -0.4)), np.array((0.5, -0.6, 0.7))
    straight = force(v=v, a=a)
    turned = force(v=turn @ v, a=turn @ a, flow=turn @ (-2.2, 0.0, 0.0))
    np.testing.assert_allclose(turned, turn @ straight, atol=1e-9)


def test_out_of_the_water_there_is_only_weight():
    np.testing.assert_allclose(force(q=(0, 0, 10.0), v=(1, 2, 3)), (0.0, 0.0, -250.0 * 9.81), atol=1e-9)


@pytest.mark.parametrize("moving", [0.0, 0.2])
@pytest.mark.parametrize("above", [-50.0, 0.05])
def test_tangent(above, moving):
    """Deep and in the surface, of still water and of water that moves beyond the current, its surface raised."""
    water, change = moving * np.random.default_rng(1).normal(size=NODE_COLUMNS), Change(30.0, 900.0, 0.4, 0.0)
    water[ELEVATION] = 2.0 * moving
    z = above + water[ELEVATION]
    exact = body_band(z, water, change, YES)[:3, :3]
    slopes = body_slopes(lambda d: body_band(z, water, change, NO, d), 1e-6)
    np.testing.assert_allclose(slopes, exact, atol=1e-6 * np.abs(exact).max())


@pytest.mark.parametrize("speed", [(0.9, -0.4, -0.1), (0.11, -0.201, 0.0)], ids=["sliding", "nearly at rest"])
def test_tangent_of_the_floor_under_the_body(speed):
    """Normal press and friction against a floor that drifts."""
    c1, floor = 30.0, record(floor_row(-50.0, 1e6, 0.2, 0.4, 0.05))
    floor.speed[:] = 0.1, -0.2, 0.0
    row = record(body_record(BODY, 9.81, 1026.0))
    row.floor_stiffness = 2e5
    q, v, zero = np.array((3.0, 1.0, -50.02)), np.array(speed), np.zeros(3)

    def pushed(d, tangent):
        band = np.zeros((6, 16))
        power = lie(row, floor, (q + d, v + c1 * d, zero, zero), Change(c1, 0.0, 0.0, 0.0), tangent, band)
        assert power == pytest.approx(band[:3, 12] @ (v + c1 * d), rel=1e-12)
        return band

    band = pushed(zero, YES)
    exact, load = band[:3, :3], band[:3, 12]
    assert load[2] > 100.0 and (np.hypot(load[0], load[1]) > 0.3 * load[2]) == (speed[0] > 0.5)
    np.testing.assert_allclose(body_slopes(lambda d: pushed(d, NO), 1e-7), exact, atol=1e-6 * np.abs(exact).max())


def test_body_turns_into_the_flow_and_tells_its_rate():
    row, flow = record(body_record(BODY, 9.81, 1026.0)), np.array((-2.0, 0.0, 0.0, 0.0, 0.0, 0.0))
    yaw, q, v = [0.0], np.array((0.0, 0.0, -50.0)), np.array((0.0, 2.0, -0.2))
    for _ in range(4000):
        before = heading(flow)
        turn_into_flow(row, (q, v, flow, STILL_WATER), STILL, 0.01)
        yaw.append(heading(flow))
        assert flow[5] == pytest.approx((yaw[-1] - before) / 0.01, abs=1e-9)
    assert yaw[-1] == pytest.approx(np.pi / 2, abs=0.01), "the nose points where the body goes"
    past = 0.01 * np.arange(4001)
    exact = np.arctan2(1.0 - np.exp(-past / 5.0), np.exp(-past / 5.0))
    np.testing.assert_allclose(yaw, exact, atol=2e-3)  # as the low-passed flow turns, for it may turn that fast


@pytest.mark.parametrize("h", [0.01, 0.1])
@pytest.mark.parametrize("across", [0.0, 1e-6, 0.02])
def test_the_heading_is_held_while_the_flow_passes_zero(h, across):
    """Astern after a stop: flow past it from -1 to 1 m/s in 60 s. 180 deg in one step were 314 rad/s."""
    row, flow = record(body_record(BODY, 9.81, 1026.0)), np.array((-1.0, across, 0.0, 0.0, 0.0, 0.0))
    q, rates, held, turned = np.array((0.0, 0.0, -50.0)), [], [], []
    for k in range(round(120.0 / h)):
        past = min(-1.0 + 2.0 * k * h / 60.0, 1.0)
        before = heading(flow)
        turn_into_flow(row, (q, np.array((-past, -across, 0.0)), flow, STILL_WATER), STILL, h)
        rates.append(flow[5])
        held.append(heading_held(row, flow))
        turned.append(heading(flow) - before)
        if held[-1]:
            assert flow[5] == 0.0 and abs(np.sin(turned[-1])) < 1e-12
    assert any(held) and not held[-1]
    assert np.abs(rates).max() <= 0.5 * np.pi / 5.0 + 1e-12
    assert abs(np.cos(heading(flow))) == pytest.approx(1.0, abs=1e-3) and np.cos(heading(flow)) < 0.0, "turned round"


def test_a_body_that_has_no_heading_is_not_reported():
    sphere = Towbody(mass=1.0, net_weight=5.0, added_mass=(0.5, 0.5, 0.4), drag_area=(0.1, 0.1, 0.1))
    still = np.zeros(6)
    assert heading_held(record(body_record(BODY, 9.81, 1026.0)), still)
    assert not heading_held(record(body_record(sphere, 9.81, 1026.0)), still)


def test_a_body_at_rest_faces_the_flow_where_it_is():
    """Current from the east at the surface, from the south at 50 m; hardly any at 25 m: as it was."""
    row, flow = record(body_record(BODY, 9.81, 1026.0)), np.array((-1.0, 0.0, 0.3, 0.0, 0.0, 0.0))
    current = (-1.0, 0.0, 0.02, 0.02)
    face_flow(row, (np.array((0.0, 0.0, -50.0)), flow, STILL_WATER), current)
    assert heading(flow) == pytest.approx(-0.5 * np.pi) and flow[2] == 0.0
    face_flow(row, (np.array((0.0, 0.0, -25.0)), flow, STILL_WATER), (-1.0, 0.0, 0.04, 0.0))
    assert heading(flow) == pytest.approx(-0.5 * np.pi)


def added_force(v, a, yaw, rate):
    """What added mass alone brings of the load, world axes: drag, lift, weight and mass taken away."""
    body = record(body_record(BODY, 9.81, 1026.0))
    body.drag[:], body.lift, body.gravity, body.buoyancy, body.mass = 0.0, 0.0, 0.0, 0.0, 0.0
    body.half_height = 0.1
    band, flow = np.zeros((6, 16)), np.array((-np.cos(yaw), -np.sin(yaw), 0.0, 0.0, 0.0, rate))
    node = (np.array((0.0, 0.0, -50.0)), np.array(v), np.array(a), flow, STILL_WATER)
    load(body, node, STILL, AT_REST, NO, band)
    return band[:3, 12]


def momentum(v, yaw):
    """Momentum of the water about the body, R M R^T v, world axes."""
    turn = about_z(yaw)
    return turn @ np.diag(BODY.added_mass) @ turn.T @ v


def test_added_mass_of_axes_that_turn_is_the_change_of_the_momentum_of_the_water():
    """F = -d/dt (R M R^T v), and with the work of the moment that turns it, F v + N r = -d/dt (v R M R^T v / 2)."""
    v, a, yaw, rate, e = np.array((1.3, -0.4, 0.2)), np.array((0.3, 0.5, -0.1)), 0.7, 0.35, 1e-6
    got = added_force(v, a, yaw, rate)
    ahead, behind = (momentum(v + s * e * a, yaw + s * e * rate) for s in (1.0, -1.0))
    np.testing.assert_allclose(got, -(ahead - behind) / (2 * e), atol=1e-5)
    c, s = np.cos(yaw), np.sin(yaw)
    along, across = c * v[0] + s * v[1], c * v[1] - s * v[0]
    moment = -(BODY.added_mass[1] - BODY.added_mass[0]) * along * across  # Munk
    after, before = (0.5 * (v + k * e * a) @ momentum(v + k * e * a, yaw + k * e * rate) for k in (1.0, -1.0))
    assert got @ v + moment * rate == pytest.approx(-(after - before) / (2 * e), abs=1e-5)


def test_in_a_steady_turn_it_is_the_added_mass_ahead_that_pulls_outward():
    """2.2 m/s round 100 m: 11 kg x 2.2^2 / 100 m = 0.53 N outward; without the turning of the axes 10.3 N."""
    speed, radius = 2.2, 100.0
    got = added_force((speed, 0.0, 0.0), (0.0, speed**2 / radius, 0.0), 0.0, speed / radius)
    np.testing.assert_allclose(got, (0.0, -11.0 * speed**2 / radius, 0.0), atol=1e-9)
