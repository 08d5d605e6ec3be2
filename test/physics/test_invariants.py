"""What must hold for any cable: rigid motion, force = -dU/dq, no pull of contact, bits, one
signature."""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import Bench, dense, hydro, record, touching
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cable_sim_ros.physics import contact_surface
from cable_sim_ros.physics.ancf import ROWS
from cable_sim_ros.physics.block_tridiagonal import (
    FACTOR_COLUMNS,
    apply,
    eliminate_with_exchange,
    factorise,
    solve,
    solve_again,
)
from cable_sim_ros.physics.contact import press, touch
from cable_sim_ros.physics.drag_laws import LAWS, DragLaw, choo_casarella, loading
from cable_sim_ros.physics.workspace import LOST_POWER, OWN, SURFACES, WATER

pytestmark = pytest.mark.check

angles = st.floats(-3.0, 3.0)


def bare(seed=2, **more) -> Bench:
    bench = Bench(8, seed, gravity=0.0, mass=0.5, **more)
    bench.wander(top=50.0)
    bench.v[:], bench.a[:] = 0.0, 0.0
    return bench


@given(st.tuples(angles, angles, angles), st.tuples(*[st.floats(-1e4, 1e4)] * 3))
@settings(max_examples=25)
def test_rigid_motion_turns_the_forces_and_leaves_the_energy(rotation, shift):
    bench = bare()
    force = bench.residual()
    energy = bench.energy
    turn = Rotation.from_rotvec(rotation).as_matrix()
    bench.q[:, :3] = bench.q[:, :3] @ turn.T + np.array(shift) + (0, 0, 2e4)
    bench.q[:, 3:] = bench.q[:, 3:] @ turn.T
    again = bench.residual()
    scale = np.abs(force).max()
    assert bench.energy == pytest.approx(energy, rel=1e-6)
    np.testing.assert_allclose(again[:, :3], force[:, :3] @ turn.T, atol=2e-6 * scale)
    np.testing.assert_allclose(again[:, 3:], force[:, 3:] @ turn.T, atol=2e-6 * scale)


@given(st.tuples(angles, angles, angles))
@settings(max_examples=25)
def test_internal_damping_is_objective(spin):
    """A rigid spin of a curved, strained cable meets no damping (trap T1: (55) brakes it)."""
    bench = bare(ca=200.0, tau=0.5)
    still = bench.residual()
    for c in (0, 3):
        bench.v[:, c : c + 3] = np.cross(spin, bench.q[:, c : c + 3])
    bench.v[:, :3] += (0.3, -0.2, 0.1)
    np.testing.assert_allclose(bench.residual(), still, atol=1e-9 * np.abs(still).max())


@pytest.mark.parametrize("seed", range(4))
def test_internal_damping_only_takes_energy(seed):
    bench = bare(seed, ca=200.0, tau=0.5)
    still = bench.residual()
    bench.v = bench.rng.normal(size=bench.v.shape)
    power = float(np.sum((bench.residual() - still) * bench.v))
    assert power > 0.0, "damping force must oppose the motion"


def gradient(bench: Bench, node: int, c: int) -> float:
    """Derivative of the energy to an unknown of a node, by central differences."""
    start, values = bench.q.copy(), []
    for step in (1e-6, -1e-6):
        bench.q[node, c] += step
        bench.residual()
        values.append(bench.energy)
        bench.q = start
    return (values[0] - values[1]) / 2e-6


@pytest.mark.parametrize("ei", [0.0, 1.4])
def test_elastic_force_is_the_gradient_of_the_energy(ei):
    bench = bare(ei=ei)
    force = bench.residual()
    for node, c in ((0, 1), (3, 0), (4, 4), (8, 5)):
        near = gradient(bench, node, c)
        assert near == pytest.approx(force[node, c], rel=1e-5, abs=1e-5 * np.abs(force).max())


def test_rigid_motion_of_a_straight_unstretched_cable_has_no_strain():
    bench = Bench(5, 1, gravity=0.0)
    direction = np.array([0.6, 0.0, 0.8])
    bench.q[:, :3] = bench.arc[:, None] * direction + (0, 0, 10.0)
    bench.q[:, 3:] = direction
    assert np.abs(bench.residual()).max() < 1e-8
    assert bench.energy < 1e-12
    assert np.abs(bench.tension).max() < 1e-9


def test_weight_and_inertia_are_exact():
    """Newton's law for the whole cable: a uniform acceleration needs m a, weight m g, whatever the mesh."""
    bench = Bench(7, 4)
    bench.wander(top=50.0)
    bench.v[:], bench.a[:] = 0.0, 0.0
    bench.a[:, 2] = 2.5
    total = bench.residual()[:, :3].sum(0)
    np.testing.assert_allclose(total, (0, 0, 0.389 * bench.arc[-1] * (9.81 + 2.5)), atol=1e-9)


def test_buoyancy_of_a_wet_cable_at_rest_is_exact():
    bench = Bench(7, 4, law=DragLaw.CROSSFLOW)
    bench.wander(top=-5.0)
    bench.v[:], bench.a[:] = 0.0, 0.0
    lift = 1026.0 * 0.25 * np.pi * 0.01**2 * 9.81 * bench.arc[-1]
    assert bench.residual()[:, 2].sum() == pytest.approx(0.389 * 9.81 * bench.arc[-1] - lift, rel=1e-9)


@given(st.floats(-1.0, 1.0), st.floats(-50.0, 50.0), st.floats(0.0, 100.0))
@settings(max_examples=200)
def test_contact_never_pulls(delta, closing, damping):
    assert press(delta, closing, 1e9, damping)[0] >= 0.0


@given(st.floats(-0.03, 0.03), st.floats(-0.02, 0.03), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
@settings(max_examples=100)
def test_groove_pushes_away_from_its_flanks_and_out(y, h, vy, vh):
    row = contact_surface.surface_row((0, 0, 0), 0.25, np.pi / 3, 0.01, 0.02, 1e9, 0.3)
    gap, own, other = touch(contact_surface.solid(record(row)), 1e9, (0.0, y, 0.25 + h), (0.0, vy, vh))
    f1, f2 = own.load, other.load
    assert f1 >= 0.0 and f2 >= 0.0
    assert f1 * gap.own.normal[2] + f2 * gap.other.normal[2] >= 0.0, "the radial part points out of the groove"
    if h >= 0.01:
        assert f1 == f2 == 0.0, "above the top there is nothing"


def test_tangential_loading_is_the_printed_quintic():
    """The trigonometric fit of (60b) against the quintic, and f_n against its printed values (docs/theory.md, section
    4)."""
    eta = np.linspace(0.0, np.pi / 2, 2001)
    quintic = 0.01 * np.polynomial.polynomial.polyval(eta, (2.009, -0.3858, 1.9159, -4.1615, 3.5064, -1.1873))
    c = LAWS[DragLaw.DRISCOLL_NAHON][1]
    fit = c[0] + sum(c[k] * np.cos(k * eta) + c[5 + k] * np.sin(k * eta) for k in range(1, 6))
    assert np.abs(fit - quintic).max() < 1e-7


@pytest.mark.parametrize(
    "law, angle, fn, ft",
    [
        (DragLaw.DRISCOLL_NAHON_PRINTED, 10, 0.0054, 0.0198),
        (DragLaw.DRISCOLL_NAHON_PRINTED, 5, -0.0039, 0.0199),
        (DragLaw.DRISCOLL_NAHON, 20, 0.1267, 0.0198),
        (DragLaw.DRISCOLL_NAHON, 60, 0.7271, 0.0165),
        (DragLaw.RIBBON, 10, 0.0627, 0.1276),
        (DragLaw.RIBBON, 45, 0.5006, 0.1153),
        (DragLaw.RIBBON, 90, 1.0, 0.0295),
        (DragLaw.CROSSFLOW, 30, 0.25, 0.0),
    ],
)
def test_loading_functions_against_the_table(law, angle, fn, ft):
    p = np.zeros((ROWS, 1))
    for row, value in hydro(law, None, 1.0).items():
        p[row, 0] = value
    eta = np.radians(angle)
    got = loading(np.cos(eta), np.sin(eta), p, 0)
    assert (got[0], got[2]) == pytest.approx((fn, ft), abs=6e-5)


def test_drag_coefficient_is_continuous_and_has_its_derivative():
    """Choo-Casarella blended at its printed jumps (9.83/10.00 at Re = 1, 1.850/1.830 at 30), held outside."""
    re = np.exp(np.linspace(np.log(2e-3), np.log(9e4), 4000))
    cd = np.array([choo_casarella(x) for x in re])
    assert (np.abs(np.diff(cd[:, 0])) < 0.02 * cd[:-1, 0]).all()
    for x in (0.05, 0.5, 1.0, 1.2, 5.0, 26.0, 30.0, 35.0, 500.0):
        d = (choo_casarella(x * (1 + 1e-6))[0] - choo_casarella(x * (1 - 1e-6))[0]) / (2e-6 * x)
        assert choo_casarella(x)[1] == pytest.approx(d, rel=1e-4)
    assert choo_casarella(10.0)[0] == pytest.approx(1.45 + 8.55 * 10**-0.9)
    assert choo_casarella(1e7) == choo_casarella(1e5)


def test_waterline_force_has_no_jump():
    """An element through the surface in 200 positions: the force moves no more than 1.5 times the smooth increment."""
    bench = Bench(1, 0, lengths=2.0, law=DragLaw.DRISCOLL_NAHON, current=(-2.2, 0.0, 0.0, 0.0))
    bench.q[:, 0], bench.q[:, 3], bench.q[:, 5] = -bench.arc * 0.8, -0.8, -0.6
    total = []
    for top in np.linspace(-0.1, 1.3, 201):
        bench.q[:, 2] = top - 0.6 * bench.arc
        total.append(bench.residual()[:, :3].sum(0))
    jumps = np.abs(np.diff(total, axis=0)).max(1)
    assert jumps.max() < 1.5 * np.percentile(jumps, 75)


def test_a_lane_does_not_depend_on_its_neighbours():
    """The same element alone and among others: the same bits."""
    many = Bench(20, 3, current=(-2.0, 0.0, 0.0, 0.0))
    many.wander(top=-3.0)
    force = many.residual()
    again = many.residual()
    assert (force == again).all()
    many.v[15:] = 0.0
    many.v[15:, 0] = -2.0  # lanes in the low branch of the drag coefficient
    other = many.residual()
    assert (other[:14] == force[:14]).all()


def test_solver_against_dense():
    rng = np.random.default_rng(0)
    n = 12
    band, lower = rng.normal(size=(n, 6, 16)), rng.normal(size=(n, 6, 6))
    band[3, 0, 0] = 0.0  # needs a row exchange
    whole = dense(band, lower)
    want = np.linalg.solve(whole, band[:, :, 12].ravel())
    x, factor, work = np.zeros((n, 6)), np.zeros((n, 6, FACTOR_COLUMNS)), band.copy()
    assert solve(work, lower, factor, x)
    np.testing.assert_allclose(x.ravel(), want, rtol=1e-8)
    work[:, :, 12] = rng.normal(size=(n, 6))
    solve_again(work, lower, factor, x)
    np.testing.assert_allclose(x.ravel(), np.linalg.solve(whole, work[:, :, 12].ravel()), rtol=1e-8)
    band[5] = 0.0
    lower[5] = 0.0
    assert not solve(band, lower, factor, x), "a singular block is told"


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 20.0))
def test_a_block_has_the_same_bits_by_numbers_and_by_rows(seed, dominance):
    rng = np.random.default_rng(seed)
    one = np.zeros((6, 16))
    one[:, :13] = rng.normal(size=(6, 13))
    one[:, :6] += dominance * np.eye(6)
    other, by_one, by_other = one.copy(), *np.zeros((2, 6, FACTOR_COLUMNS))
    assert eliminate_with_exchange(other, 0, by_other)
    exchanged = (by_other[:, -1] != np.arange(6)).any()
    assert factorise(one, 0, by_one) != exchanged
    if not exchanged:
        apply(one, 0, by_one)
        assert (by_one == by_other).all() and (one[:, 6:] == other[:, 6:]).all()


@pytest.mark.parametrize("seed", range(2))
def test_powers_are_the_forces_on_the_velocities(seed):
    """Work.power, with and without tangent: own = inertia + d(stored)/dt + lost, and the parts sum to R . v."""
    bench = Bench(20, seed, current=(-2.0, 0.3, 0.1, 0.05))
    bench.wander()
    bench.surfaces = touching(bench, 3, None)[None]
    r = bench.residual()
    powers = bench.power.copy()
    own, lost, water, pressed = powers[[OWN, LOST_POWER, WATER, SURFACES]]
    assert own - water - pressed == pytest.approx(float(np.sum(r * bench.v)), rel=1e-9)
    assert lost > 0.0 and water != 0.0 and pressed != 0.0
    bench.tangent()
    bench.residual()
    np.testing.assert_array_equal(bench.power, powers)
    step = 1e-6  # strain energy along the motion
    start, rate = bench.q.copy(), []
    for sign in (-1.0, 1.0):
        bench.q = start + sign * step * bench.v
        bench.residual()
        rate.append(bench.energy)
    bench.q, bench.a = start, np.zeros_like(bench.a)
    dry = Bench(20, seed, gravity=0.0, mass=0.0)
    dry.q, dry.v, dry.arc = start, bench.v, bench.arc
    dry.residual()
    stored = (rate[1] - rate[0]) / (2.0 * step)
    assert dry.power[OWN] - dry.power[LOST_POWER] == pytest.approx(stored, rel=1e-4)


def test_a_cable_folds_where_a_rod_would_push():
    """Shorter than unstretched an element resists with a share of EA, and its tangent is exact."""
    push = []
    for fraction in (1.0, 0.01):
        bench = Bench(1, 0, ea=1e4, ei=0.0, ca=0.0, tau=0.0, gravity=0.0, compression=fraction, lengths=1.0)
        bench.q[:, 0], bench.q[:, 2], bench.q[:, 3] = (0.0, 0.9), 10.0, 0.9
        push.append(bench.residual()[1, 0])
    assert push[0] == pytest.approx(-1e3, rel=1e-9) and push[1] == pytest.approx(-10.0, rel=1e-9)


def slack_and_taut(seed: int, fraction: float, ca: float = 20.0) -> Bench:
    """Dry elements in every state between folded and stretched, end gradients of any length."""
    bench = Bench(20, seed, compression=fraction, ca=ca, ei=0.01, tau=0.0, gravity=0.0, mass=0.0)
    bench.wander(top=50.0)
    bench.q[:, :3] += 0.03 * bench.rng.normal(size=(21, 3))
    return bench


@pytest.mark.parametrize("seed", range(5))
def test_a_cable_never_pushes(seed):
    """Without a share in compression no element pushes, however uneven its stretch and however fast it shortens."""
    rod, cable = slack_and_taut(seed, 1.0), slack_and_taut(seed, 0.0)
    rod.residual()
    cable.residual()
    assert rod.tension.min() < -1.0 and cable.tension.max() > 1.0, "the case must have slack and taut elements"
    assert cable.tension.min() >= -1e-9 * rod.tension.max()
    assert cable.power[LOST_POWER] >= 0.0


@pytest.mark.parametrize("seed", range(3))
def test_force_of_a_folding_cable_is_the_gradient_of_its_energy(seed):
    bench = slack_and_taut(seed, 0.01, ca=0.0)
    bench.v[:], bench.a[:] = 0.0, 0.0
    force = bench.residual()
    for node, c in ((3, 0), (7, 2), (9, 3), (12, 5), (15, 4)):
        assert force[node, c] == pytest.approx(gradient(bench, node, c), rel=1e-5, abs=1e-4)
