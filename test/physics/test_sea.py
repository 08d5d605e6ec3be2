"""Water beyond the linear current: waves and closed forms, tables and scipy, tangents and differences."""

import numpy as np
import pytest
from bench_cable import Bench, about_z, record
from scipy.interpolate import PchipInterpolator
from test_towbody import BODY, body_band

from cable_sim_ros.compiler.jit import LANES, NO, driver
from cable_sim_ros.physics.drag import POINT_ROWS
from cable_sim_ros.physics.sea import (
    ELEVATION,
    EXTRA,
    NODE_COLUMNS,
    ORBIT,
    RATE,
    SEA,
    SHEAR,
    STREAM_ROWS,
    decay,
    elevation,
    gust,
    look_up,
    pressure_head,
    sincos,
    wave_lanes,
)
from cable_sim_ros.physics.state import AT_REST
from cable_sim_ros.physics.towbody import body_record, load
from cable_sim_ros.physics.water import CurrentTable, Turbulence, Waves
from cable_sim_ros.physics.workspace import make_work
from cable_sim_ros.sim.tables.sea_tables import eddy_table, profile_table, wave_number, wave_table

pytestmark = pytest.mark.check

G, HEIGHT, PERIOD, TOWARDS = 9.81, 1.2, 6.0, 0.7


@driver
def series(x, out):
    """sincos and decay of every number of a table."""
    for i in range(x.shape[0]):
        out[i, 0], out[i, 1] = sincos(x[i])
        out[i, 2] = decay(-abs(x[i]))


def test_sine_cosine_and_decay_are_those_of_the_library():
    x, out = np.concatenate((np.linspace(-40.0, 40.0, 4001), [0.0, -300.0, 3e3])), np.zeros((4004, 3))
    series(x, out)
    np.testing.assert_allclose(out[:, 0], np.sin(x), atol=1e-11)
    np.testing.assert_allclose(out[:, 1], np.cos(x), atol=1e-11)
    near = np.abs(x) < 15.0
    np.testing.assert_allclose(out[near, 2], np.exp(-np.abs(x[near])), rtol=1e-10)
    assert (out[~near, 2] < 4e-7).all() and (out[:, 2] > 0.0).all()


def airy(t, depth):
    """The table of the wave, and its phases at time t."""
    table = wave_table(Waves(kind="airy", height=HEIGHT, period=PERIOD, towards_deg=np.degrees(TOWARDS)), G, depth)
    k, omega = table[0, 1], table[0, 2]
    return table, np.array([[k * np.cos(TOWARDS), k * np.sin(TOWARDS), -omega * t]])


def kinematics(points, t, depth=np.inf, fraction=(1.0, 0.0)):
    """Velocity and acceleration [n, 3] of the wave at points [n, 3] and time t, by the kernel."""
    table, phase = airy(t, depth)
    place, out = np.zeros((POINT_ROWS, LANES)), np.full((STREAM_ROWS, LANES), np.nan)
    place[:3, : len(points)] = np.transpose(points)
    wave_lanes(table, phase, np.array(fraction), max(p[2] for p in points), place, out)
    return out[ORBIT : ORBIT + 3, : len(points)].T, out[RATE : RATE + 3, : len(points)].T


@pytest.mark.parametrize("depth", [np.inf, 12.0, 3.0], ids=["deep", "finite", "shallow"])
def test_a_regular_wave_is_the_closed_form(depth):
    points = np.array([(3.0, -2.0, -0.5), (10.0, 40.0, -2.9), (-7.0, 1.0, -1.5), (0.0, 0.0, 0.0), (1.0, 2.0, 0.4)])
    t, w = 2.3, 2.0 * np.pi / PERIOD
    k = float(wave_number(np.array([w]), G, depth)[0])
    theta = k * (points[:, 0] * np.cos(TOWARDS) + points[:, 1] * np.sin(TOWARDS)) - w * t
    z = np.minimum(points[:, 2], 0.0)  # vertical stretching
    if np.isfinite(depth):
        up, across = np.sinh(k * (z + depth)) / np.sinh(k * depth), np.cosh(k * (z + depth)) / np.sinh(k * depth)
    else:
        up = across = np.exp(k * z)
    a = 0.5 * HEIGHT * w
    ahead = np.array((np.cos(TOWARDS), np.sin(TOWARDS), 0.0))
    u = (a * across * np.cos(theta))[:, None] * ahead + (a * up * np.sin(theta))[:, None] * (0.0, 0.0, 1.0)
    rate = (a * w * across * np.sin(theta))[:, None] * ahead - (a * w * up * np.cos(theta))[:, None] * (0.0, 0.0, 1.0)
    found = kinematics(points, t, depth)
    np.testing.assert_allclose(found[0], u, atol=1e-9)
    np.testing.assert_allclose(found[1], rate, atol=1e-9)


@pytest.mark.parametrize("depth", [np.inf, 5.0])
def test_the_flow_of_waves_has_no_source_no_turn_and_the_acceleration_that_it_says(depth):
    point, t, h = np.array((3.0, -2.0, -1.5)), 1.1, 1e-4
    ahead, behind = (kinematics([point + s * d for d in np.eye(3)], t, depth)[0] for s in (h, -h))
    jacobian = (ahead - behind) / (2.0 * h)  # [i, j] = d u_j / d x_i
    assert abs(np.trace(jacobian)) < 1e-7 < 1e-2 < np.abs(jacobian).max()
    np.testing.assert_allclose(jacobian, jacobian.T, atol=1e-7)
    rate = (kinematics([point], t + h, depth)[0] - kinematics([point], t - h, depth)[0]) / (2.0 * h)
    np.testing.assert_allclose(rate, kinematics([point], t, depth)[1], atol=1e-7)


def test_while_the_waves_grow_their_acceleration_holds_the_growth():
    whole, grown = kinematics([(0.0, 0.0, -1.0)], 1.0), kinematics([(0.0, 0.0, -1.0)], 1.0, fraction=(0.3, 0.05))
    np.testing.assert_allclose(grown[0], 0.3 * whole[0], rtol=1e-12)
    np.testing.assert_allclose(grown[1], 0.3 * whole[1] + 0.05 * whole[0], rtol=1e-12)


def test_components_that_do_not_reach_down_are_left_out_and_what_is_left_is_small():
    table = wave_table(Waves(kind="jonswap", height=3.0, period=9.0), G, np.inf)
    assert (np.diff(table[:, 7]) <= 0.0).all()
    place, phase = np.zeros((POINT_ROWS, LANES)), np.zeros((len(table), 3))
    phase[:, 0] = table[:, 1]
    for z in (-20.0, -80.0, -200.0, -400.0):
        place[2] = z
        some, every = np.zeros((STREAM_ROWS, LANES)), np.zeros((STREAM_ROWS, LANES))
        wave_lanes(table, phase, np.array((1.0, 0.0)), z, place, some)
        wave_lanes(table, phase, np.array((1.0, 0.0)), 0.0, place, every)
        left = 1e-5 * len(table) * np.sqrt(0.5 * ((table[:, 0] * table[:, 2]) ** 2).sum())
        assert np.abs(some - every).max() < left


@driver
def looked_up(table, x, out):
    """look_up at every x."""
    for i in range(x.shape[0]):
        out[i, 0], out[i, 1], out[i, 2], out[i, 3] = look_up(table, x[i])


def test_a_table_of_the_current_is_monotone_c1_and_held_beyond_its_ends():
    depth, east, north = (0.0, 10.0, 30.0, 100.0), (1.0, 0.4, 0.4, -0.3), (0.0, 0.5, 0.2, 0.1)
    table = profile_table(CurrentTable(depth=depth, east=east, north=north))
    z, out = np.linspace(-120.0, 5.0, 501), np.zeros((501, 4))
    looked_up(table, z, out)
    inside = np.clip(z, -100.0, 0.0)
    for column, values in ((0, east), (1, north)):
        exact = PchipInterpolator(-np.array(depth)[::-1], values[::-1])
        np.testing.assert_allclose(out[:, column], exact(inside), atol=1e-12)
        slope = np.where((z > -100.0) & (z < 0.0), exact.derivative()(inside), 0.0)
        np.testing.assert_allclose(out[:, 2 + column], slope, atol=1e-12)
    assert (np.diff(out[:, 0]) >= -1e-15).all(), "no overshoot between rows"


@driver
def gusts(eddies, now, out):
    """gust() for a record."""
    gust(eddies, now, out)


def test_turbulence_has_the_acceleration_of_its_velocity_and_turns_with_the_heading():
    eddies = eddy_table(Turbulence(deviation=(0.03, 0.02, 0.01), time_scale=0.5))
    now, h, out = np.zeros(1, SEA).view(np.recarray)[0], 1e-5, []
    now.fraction[0] = 1.0
    for t in (2.0 - h, 2.0 + h, 2.0):
        now.time = t
        out.append(np.zeros(6))
        gusts(eddies, now, out[-1])
    np.testing.assert_allclose((out[1] - out[0])[:3] / (2 * h), out[2][3:], atol=1e-6)
    now.current_yaw, turned = 0.5 * np.pi, np.zeros(6)
    gusts(eddies, now, turned)
    np.testing.assert_allclose(turned[:3], (-out[2][1], out[2][0], out[2][2]), atol=1e-15)


@pytest.mark.parametrize("what", ["wet", "crossing"])
def test_tangent_of_cable_in_moving_water(what):
    """Each point in its own stream, the surface aslant; the mean flow counts the current, not the waves."""
    bench = Bench(6, 7, current=(-1.0, 0.4, 0.02, -0.01))
    bench.wander(top={"wet": -5.0, "crossing": 0.25}[what])
    still, rng = bench.residual(), np.random.default_rng(3)
    bench.state = bench.state._replace(work=make_work(7, 0, True))
    work, rows = bench.state.work, rng.normal(size=STREAM_ROWS)
    along = np.linspace(1.0, 1.3, 4)[:, None, None] * np.linspace(1.0, 1.2, LANES)
    work.stream[0] = 0.2 * rows[None, :, None] * along
    if what == "crossing":
        work.around[:, ELEVATION] = 0.02 * np.arange(7)
    assert bench.worst() < 1e-6
    assert np.abs(bench.residual() - still).max() > 1e-3


def test_the_wet_part_ends_at_the_elevated_surface():
    """A straight slanted cable at rest in still water: buoyancy of the part below the raised surface."""
    bench = Bench(4, 0, lengths=0.5)
    bench.q[:, 0], bench.q[:, 2] = -0.6 * bench.arc, 0.9 - 0.8 * bench.arc
    bench.q[:, 3:] = (-0.6, 0.0, -0.8)
    bench.v, bench.a = 0.0, 0.0
    bench.state = bench.state._replace(work=make_work(5, 0, True))
    lift = []
    for rise in (0.0, 0.3, -0.25):
        bench.state.work.around[:, ELEVATION] = rise
        lift.append(-bench.residual()[:, 2].sum())
    per_length = (lift[1] - lift[0]) / (0.3 / 0.8)
    assert per_length > 0.0
    assert lift[0] - lift[2] == pytest.approx(per_length * 0.25 / 0.8, rel=1e-9)


def test_a_body_in_accelerating_water_bears_its_displaced_and_its_added_mass():
    water = np.zeros(NODE_COLUMNS)
    still = body_band(-50.0, water)[:3, 12]
    water[RATE : RATE + 3] = rate = np.array((0.3, 0.0, -0.2))
    more = body_band(-50.0, water)[:3, 12] - still
    displaced = 250.0 - 445.0 / 9.81
    yaw = np.arctan2(0.6, 1.0) + 0.1  # against the low-passed flow, and lagging behind
    turn = about_z(yaw)
    np.testing.assert_allclose(more, displaced * rate + turn @ np.diag(BODY.added_mass) @ turn.T @ rate, rtol=1e-9)


def test_water_that_moves_with_the_body_is_still_water_to_it():
    """Extra current, waves and the body's own velocity enter as one relative velocity."""
    water = np.zeros(NODE_COLUMNS)
    water[ORBIT : ORBIT + 3], water[EXTRA : EXTRA + 3] = (0.2, -0.1, 0.3), (0.4, 0.3, -0.2)
    water[SHEAR : SHEAR + 2] = 0.01, 0.02
    moved = body_band(-50.0, water)[:3, 12]
    band, q = np.zeros((6, 16)), np.array((0.0, 0.0, -50.0))
    v = np.array((1.2, 0.3, -0.5)) - (0.6 + 0.5, 0.2 + 1.0, 0.1)
    node = (q, v, np.array((0.5, -0.2, 0.8)), np.array((-1.0, -0.6, 0.1, 0, 0, 0.4)), np.zeros(NODE_COLUMNS))
    load(record(body_record(BODY, 9.81, 1026.0)), node, (-2.0, 0.4, 0.02, -0.01), AT_REST, NO, band)
    np.testing.assert_allclose(moved, band[:3, 12], rtol=1e-9)


def test_elevation_is_the_sum_of_the_components():
    table, rng = np.zeros((5, 8)), np.random.default_rng(2)
    table[:, 0], phase = rng.random(5), rng.random((5, 3))
    eta = elevation(table, phase, np.array((0.5, 0.0)), 3.0, 4.0)
    assert eta == pytest.approx(0.5 * (table[:, 0] * np.cos(phase @ (3.0, 4.0, 1.0))).sum(), abs=1e-10)


@pytest.mark.parametrize("depth", [np.inf, 12.0], ids=["deep", "finite"])
def test_the_pressure_of_waves_is_what_accelerates_the_water(depth):
    """Linear Euler: a = -g grad(head); at the surface the head is its elevation."""
    t, h, full, point = 1.3, 1e-4, np.array((1.0, 0.0)), np.array((2.0, -1.0, -5.0))
    table, phase = airy(t, depth)
    slope = [
        pressure_head(table, phase, full, *(point + d)) - pressure_head(table, phase, full, *(point - d))
        for d in h * np.eye(3)
    ]
    _, acceleration = kinematics([point], t, depth)
    np.testing.assert_allclose(-G * np.array(slope) / (2.0 * h), acceleration[0], rtol=1e-5)
    assert pressure_head(table, phase, full, 3.0, 4.0, 0.2) == pytest.approx(elevation(table, phase, full, 3.0, 4.0))
