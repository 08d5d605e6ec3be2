"""Beads: a point mass at a place of the material, its tangent, its energy, and the nodal mass it is at a node.

The equivalent force system of a link: closed forms against their printed test values and against quadrature.
"""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import dense, differences, record

from cable_sim_ros.compiler.jit import NO, YES, prepare
from cable_sim_ros.physics.energy import energies
from cable_sim_ros.physics.link_loads import added_mass, integrals, normal_drag, tangential_drag
from cable_sim_ros.physics.point_mass import bead_record, carry
from cable_sim_ros.physics.sea import NODE_COLUMNS
from cable_sim_ros.physics.state import ARC, AT_REST, NOW, Change, make_state
from cable_sim_ros.physics.substeps import link_stepper
from cable_sim_ros.physics.towbody import Towbody, body_record, load
from cable_sim_ros.sim.build import lock
from cable_sim_ros.sim.rig.rig import Rig, cable_of

pytestmark = pytest.mark.check

MASS, NET, GRAVITY, DENSITY = 7.0, 40.0, 9.81, 1026.0


@pytest.mark.parametrize(
    "form, want",
    [
        ((0.0, 0.0, 1.0, 2.0), (1.0, 0.0, 0.5)),
        ((0.25, -1.0, 1.0, 2.0), (1.25, -0.4583333333333333, 0.5104166666666667)),
        ((4.0, 0.0, 0.0, 2.0), (4.0, 0.0, 4.0 / 3.0)),
        ((1.0, 3e-5, 1e-8, 2.0), (2.000000003258333, 9.99999997e-6, 0.666666668621666)),
    ],
)
def test_integrals_have_the_known_values(form, want):
    assert integrals(*form) == pytest.approx(want, rel=1e-14, abs=1e-14)


def quadrature(a, b, c, length):
    """I_k [n, 3] by Gauss rules on panels that halve towards the point of least speed."""
    h = 0.5 * length
    at = np.clip(np.where(c > 0.0, -0.5 * b / np.where(c > 0.0, c, 1.0), 0.0), -h, h)
    x, w = np.polynomial.legendre.leggauss(16)
    ends = np.concatenate(([0.0], 0.5 ** np.arange(50, -1, -1.0)))
    low, high = ends[:-1, None], ends[1:, None]
    u, weight = (low + 0.5 * (high - low) * (1.0 + x)).ravel(), (0.5 * (high - low) * w).ravel()
    total = np.zeros((len(a), 3))
    for side in (-1.0, 1.0):
        reach = np.abs(side * h - at)
        y = at[:, None] + side * reach[:, None] * u
        speed = np.sqrt(np.maximum(a[:, None] + b[:, None] * y + c[:, None] * y * y, 0.0))
        for k in range(3):
            total[:, k] += reach * ((y**k * speed) @ weight)
    return total


def test_integrals_of_4000_random_links():
    """Speeds over 20 decades, one third with the stagnation point on the link or next to it."""
    rng = np.random.default_rng(7)
    n, length = 4000, 1.7
    a, c = 10.0 ** rng.uniform(-10.0, 10.0, n), 10.0 ** rng.uniform(-10.0, 10.0, n)
    b = 2.0 * np.sqrt(a * c) * rng.uniform(-1.0, 1.0, n)
    still = np.arange(n) % 3 == 0
    at, minimum = rng.uniform(-1.0, 1.0, n) * length, c * 10.0 ** rng.uniform(-30.0, -6.0, n)
    a, b = np.where(still, minimum + c * at * at, a), np.where(still, -2.0 * c * at, b)
    want = quadrature(a, b, c, np.full(n, length))
    got = np.array([integrals(*row, length) for row in zip(a, b, c, strict=True)])
    scale = np.sqrt(np.maximum(a, c * 0.25 * length**2))[:, None] * (0.5 * length) ** np.arange(1, 4)
    assert np.isfinite(got).all()
    assert np.abs((got - want) / scale).max() < 1e-12


def test_integrals_where_the_printed_logarithm_is_not_a_number():
    """D = 4ac - b^2 just below zero by rounding, the stagnation point on the link, a link that does not turn."""
    for x0 in (0.0, 0.3, -0.99, 1.0):
        for c in (1e-300, 1e-18, 1.0, 1e12):
            form = (c * x0 * x0 * (1.0 - 1e-16), -2.0 * c * x0, c, 2.0)
            assert np.isfinite(integrals(*form)).all(), form
    assert integrals(0.0, 0.0, 0.0, 2.0) == (0.0, 0.0, 0.0)


def axis_and_turn():
    n, omega = np.array((1.0, 2.0, 2.0)) / 3.0, np.array((0.7, 1.1, -0.5))
    return n, omega


def test_normal_drag_has_the_known_force_and_moment():
    n, omega = axis_and_turn()
    v = np.array((0.377777778, -0.344444444, 0.155555556))
    force, moment = normal_drag(tuple(v), tuple(-np.cross(omega, n)), tuple(n), 6.2, 1.5)
    assert force == pytest.approx((3.87595255, -3.01971483, 1.08173855), rel=1e-7)
    assert np.cross(n, moment) == pytest.approx((-1.14911292, -1.19571961, 1.77027607), rel=1e-7)


def test_added_mass_has_the_known_force_and_moment():
    n, omega = axis_and_turn()
    a, alpha = np.array((0.2, 0.1, -0.4)), np.array((-0.3, 0.8, 0.6))
    turn = -(np.cross(alpha, n) + np.cross(omega, np.cross(omega, n)))
    force, moment = added_mass(tuple(a), tuple(turn), tuple(n), 3.1, 1.5)
    assert force == pytest.approx((1.13666667, 0.87833333, -1.44666667), rel=1e-7)
    assert np.cross(n, moment) == pytest.approx((1.09275, -0.56284375, 0.01646875), rel=1e-7)


@pytest.mark.parametrize("speed, stretch", [(0.7, 0.0), (0.7, 0.3), (-0.7, 0.3), (0.2, 1.3), (-0.2, 1.3), (0.0, 1.0)])
def test_tangential_drag_of_a_link_whose_ends_may_slide_apart(speed, stretch):
    """Against a fine sum; without stretch the source's F_T = C L |V_T| V_T and no moment."""
    n, length, c = np.array((0.6, 0.0, 0.8)), 1.5, 2.1
    force, moment = tangential_drag(tuple(speed * n), tuple(stretch * n), tuple(n), c, length)
    x = (np.arange(200_000) + 0.5) / 200_000 * length - 0.5 * length
    f = c * np.abs(speed + stretch * x) * (speed + stretch * x) * length / len(x)
    assert force == pytest.approx(f.sum() * n, rel=1e-8, abs=1e-10)
    assert moment == pytest.approx((f * x).sum() * n, rel=1e-8, abs=1e-10)


def wavy(top: float):
    """A state of four elements of 0.7 m, random but for the heights, which begin at ``top`` [m]."""
    rng = np.random.default_rng(3)
    state = make_state(0.7 * np.arange(5.0), [])
    state.q[:], state.v[:], state.a[:] = (0.3 * rng.normal(size=(5, 6)) for _ in range(3))
    state.q[:, 2] = top - state.arc
    return state


def system(state, place: float, change: Change, tangent) -> tuple[np.ndarray, np.ndarray, float]:
    """R [30], dR/dq [30, 30] and the water's power [W] of one bead."""
    state.work.band[:], state.work.lower[:] = 0.0, 0.0
    power = carry(record(bead_record(place, MASS, NET, GRAVITY, DENSITY)), state, change, tangent)
    return -state.work.band[:, :, 12].ravel().copy(), dense(state.work.band, state.work.lower), power


@pytest.mark.parametrize("place", [0.0, 0.9, 1.4, 2.8], ids=["first node", "inside", "node", "last node"])
@pytest.mark.parametrize("z", [-9.0, 0.03, 9.0], ids=["wet", "crossing", "dry"])
def test_tangent(place, z):
    state, change = wavy(z + place), Change(30.0, 900.0, 0.4, 0.0)
    exact = system(state, place, change, YES)[1]
    found = differences(state, change, lambda: system(state, place, change, NO)[0], 1e-6)
    np.testing.assert_allclose(found, exact, atol=1e-6 * np.abs(exact).max())


@pytest.mark.parametrize("z", [-9.0, 0.03, 9.0])
def test_at_a_node_it_is_a_body_without_drag(z):
    state, node, change = wavy(z + 1.4), 2, Change(30.0, 900.0, 0.4, 0.0)
    force, k, power = system(state, 1.4, change, YES)
    band, body = np.zeros((6, 16)), record(body_record(Towbody(mass=MASS, net_weight=NET), GRAVITY, DENSITY))
    current = (0.0, 0.0, 0.0, 0.0)
    given = load(
        body,
        (state.q[node], state.v[node], state.a[node], np.zeros(6), np.zeros(NODE_COLUMNS)),
        current,
        change,
        YES,
        band,
    )
    np.testing.assert_allclose(force.reshape(5, 6)[node], -band[:, 12], atol=1e-12)
    np.testing.assert_allclose(k[12:18, 12:18], band[:, :6], atol=1e-9)
    assert np.abs(np.delete(force.reshape(5, 6), node, 0)).max() == 0.0
    assert power == pytest.approx(given, abs=1e-12)


def test_weight_and_buoyancy_act_at_the_place():
    """Still and wet: all of it adds up to the net weight; its moment about the ends is that of the place."""
    state = wavy(-9.0)
    state.v[:], state.a[:] = 0.0, 0.0
    force = system(state, 0.9, AT_REST, NO)[0].reshape(5, 6)
    assert force[:, 2].sum() == pytest.approx(NET, rel=1e-12)
    # a virtual lift of the straight line s about its first node moves the bead by its place
    assert (force[:, 2] * state.arc + force[:, 5]).sum() == pytest.approx(NET * 0.9, rel=1e-12)


def swinging(elements: int, place: float, as_body: bool = False) -> Rig:
    """A cable of 4 m held at its top that is let go level with 5 kg at ``place`` [m] on it."""
    cable = cable_of(
        [{"length": 4.0, "elements": elements}], mass_per_length=0.4, axial_stiffness=2e4, bending_stiffness=2.0
    )
    bodies = {round(place * elements / 4.0): 5.0} if as_body else None
    rig = Rig(cable, held={0: "r"}, tension=100.0, bodies=bodies)
    if not as_body:
        bead = bead_record(place, 5.0, 5.0 * GRAVITY, GRAVITY, DENSITY)
        rig.model = rig.model._replace(beads=lock(bead.reshape(1), bead.dtype))
        prepare(link_stepper, (rig.model, rig.state))
    rig.straight((0.0, 0.0, 10.0), (1.0, 0.0, 0.0))
    rig.balance()
    return rig


def test_a_swing_with_a_bead_at_a_node_is_that_with_a_nodal_mass():
    bead, body = (swinging(8, 2.5, as_body) for as_body in (False, True))
    a, b = bead.run(1.0, 0.005), body.run(1.0, 0.005)
    np.testing.assert_allclose(a.q, b.q, atol=1e-8)
    np.testing.assert_allclose(a.tension, b.tension, atol=1e-4)
    assert energies(bead.model, bead.state) == pytest.approx(energies(body.model, body.state), rel=1e-9)


def test_a_bead_inside_an_element_swings_as_on_a_fine_mesh():
    coarse, fine = swinging(8, 2.25), swinging(64, 2.25)
    a, b = coarse.run(0.6, 0.002), fine.run(0.6, 0.002)
    np.testing.assert_allclose(a.q[-1, :, :3], b.q[-1, ::8, :3], atol=0.01)
    pull = [np.linalg.norm(run.reaction[100:, 0, :3], axis=1).mean() for run in (a, b)]  # it vibrates along itself
    assert pull[0] == pytest.approx(pull[1], rel=5e-3) and pull[1] > 50.0
    moved = np.abs(b.q[-1, -1, :3] - (4.0, 0.0, 10.0)).max()
    assert moved > 1.0, "it must have swung"


def test_energy_of_a_swing_is_kept():
    """Held, in air, without damping: what the integrator loses is little of what the bead fell."""
    rig = swinging(8, 2.25)
    begin = sum(energies(rig.model, rig.state)[:2]) + float(rig.state.now.health.strain)
    rig.run(0.5, 0.001)
    kinetic, potential, _ = energies(rig.model, rig.state)
    rig.residual()
    end = kinetic + potential + float(rig.state.now.health.strain)
    assert kinetic > 30.0
    assert end == pytest.approx(begin, abs=2e-3 * kinetic)


def test_a_bead_finds_its_element_when_the_arc_lengths_move():
    """The place is of the material: with another mesh it loads other nodes."""
    state = wavy(-9.0)
    before = system(state, 0.9, AT_REST, NO)[0].reshape(5, 6)
    state.nodes[NOW, ARC, :, 0] -= 0.7
    after = system(state, 0.2, AT_REST, NO)[0].reshape(5, 6)
    np.testing.assert_allclose(before, after, atol=1e-12)
