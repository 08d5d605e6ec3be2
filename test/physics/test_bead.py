"""Beads: a point mass at a place of the material, its tangent, its energy, and the nodal mass it is at a node."""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import record

from cable_sim_ros.compiler.jit import NO, YES, prepare
from cable_sim_ros.physics.energy import energies
from cable_sim_ros.physics.point_mass import bead_record, carry
from cable_sim_ros.physics.sea import NODE_COLUMNS
from cable_sim_ros.physics.state import ARC, AT_REST, NOW, Change, make_state
from cable_sim_ros.physics.substeps import link_stepper
from cable_sim_ros.physics.towbody import Towbody, body_record, load
from cable_sim_ros.sim.build import lock
from cable_sim_ros.sim.rig.rig import Rig, cable_of

pytestmark = pytest.mark.check

MASS, NET, GRAVITY, DENSITY = 7.0, 40.0, 9.81, 1026.0


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
    k = np.zeros((30, 30))
    for i in range(5):
        k[6 * i : 6 * i + 6, 6 * i : 6 * i + 6] = state.work.band[i, :, :6]
        if i < 4:
            k[6 * i : 6 * i + 6, 6 * i + 6 : 6 * i + 12] = state.work.band[i, :, 6:12]
            k[6 * i + 6 : 6 * i + 12, 6 * i : 6 * i + 6] = state.work.lower[i + 1]
    return -state.work.band[:, :, 12].ravel().copy(), k, power


@pytest.mark.parametrize("place", [0.0, 0.9, 1.4, 2.8], ids=["first node", "inside", "node", "last node"])
@pytest.mark.parametrize("z", [-9.0, 0.03, 9.0], ids=["wet", "crossing", "dry"])
def test_tangent(place, z):
    state, change = wavy(z + place), Change(30.0, 900.0, 0.4, 0.0)
    exact = system(state, place, change, YES)[1]
    found = np.zeros((30, 30))
    for k in range(30):
        r = []
        for s in (1e-6, -1e-6):
            for row, c in ((state.q, 1.0), (state.v, change.velocity), (state.a, change.acceleration)):
                row.ravel()[k] += c * s
            r.append(system(state, place, change, NO)[0])
            for row, c in ((state.q, 1.0), (state.v, change.velocity), (state.a, change.acceleration)):
                row.ravel()[k] -= c * s
        found[:, k] = (r[0] - r[1]) / 2e-6
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
