"""Links in the assembly: tangent, closed loads, material that runs through them, what reads directions."""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import dense, differences

from cable_sim_ros.physics import ancf
from cable_sim_ros.physics.hermite import LINK, point_of
from cable_sim_ros.physics.state import ARC, NOW, Change
from cable_sim_ros.physics.water import Water
from cable_sim_ros.sim.rig.rig import Rig, RigError, cable_of

pytestmark = pytest.mark.check

CHANGE = Change(30.0, 900.0, 0.0, 0.2)


def wandering(law="crossflow", top=-3.0, buoyancy="full", stiffness=1e4, bending=0.0, seed=1, **section) -> Rig:
    """Three links in any state, in a sheared current."""
    rng = np.random.default_rng(seed)
    if law == "crossflow":
        section |= {"tangential_coefficient": 0.05}
    cable = cable_of(
        [{"length": 3.0, "elements": 3, "drag_law": law, "drag_coefficient": 1.2, "drag_amplification": 1.5} | section],
        model="segments",
        link_buoyancy=buoyancy,
        diameter=0.02,
        mass_per_length=2.0,
        axial_stiffness=stiffness,
        bending_stiffness=bending,
        axial_damping=50.0,
    )
    water = Water(density=1000.0, current=(0.5, 0.3), current_gradient=(0.1, -0.05))
    rig = Rig(cable, held={0: "r"}, tension=20.0, water=water)
    rig.straight((0.0, 0.0, top), (1.0, 0.0, -0.4), stretch=1.01)
    rig.state.q[:, :3] += 0.1 * rng.standard_normal((4, 3))
    rig.state.v[:, :3] = 0.7 * rng.standard_normal((4, 3))
    rig.state.a[:, :3] = 2.0 * rng.standard_normal((4, 3))
    return rig


def forces(rig: Rig) -> np.ndarray:
    rig.residual(CHANGE)
    return -rig.state.work.band[:, :, 12].ravel()


def off(rig: Rig, free: list[int]) -> float:
    """Largest difference of the tangent from the derivative of the forces, of free unknowns, over its largest."""
    want = differences(rig.state, CHANGE, lambda: forces(rig), 1e-6)
    rig.residual(CHANGE, True)
    got = dense(rig.state.work.band, rig.state.work.lower)
    return float(np.abs(got - want)[np.ix_(free, free)].max() / np.abs(want).max())


FREE = [j for j in range(6, 24) if j % 6 < 3]


@pytest.mark.parametrize(
    "how, exact",
    [
        ({"law": "off"}, 1e-9),
        ({"law": "driscoll_nahon"}, 1e-9),
        ({"law": "driscoll_nahon", "top": 0.2}, 1e-9),  # across the surface
        ({"law": "driscoll_nahon", "buoyancy": "normal"}, 1e-9),
        ({"law": "crossflow"}, 2e-4),  # the tangent of four points beside the closed forms
        ({"law": "driscoll_nahon", "bending": 40.0}, 1e-9),
        ({"law": "off", "compression_share": 0.1, "stiffness": 1e5}, 1e-9),
    ],
)
def test_tangent_is_the_derivative_of_the_forces(how, exact):
    rig = wandering(**how)
    assert off(rig, [j for j in range(6, 24) if j % 6 < 3 or "bending" in how]) < exact


def test_tangent_of_material_that_runs_through_links():
    """But for the products of flow and added mass that no element's tangent holds (drag.py)."""
    rig = wandering("off")
    rig.model.elements[:, ancf.ADDED_MASS] = 0.0
    rig.state.nodes[NOW, ARC, :, 1] = (-0.6, -0.4, -0.1, 0.0)
    rig.state.nodes[NOW, ARC, :, 2] = (-0.3, -0.1, 0.05, 0.0)
    assert off(rig, FREE) < 1e-9


@pytest.mark.parametrize("of, along", [("both", 0.5), ("normal", 0.0)])
def test_closed_loads_are_those_of_many_points(of, along):
    """One link that turns in a stream, its stagnation point on it: the force on both ends against a fine sum."""
    rig = wandering(drag_amplification_of=of)
    fine = np.zeros(24)
    closed = forces(rig)
    rig.model.elements[:, [ancf.HALF_RHO_D, ancf.ADDED_MASS, ancf.BUOYANCY]] = 0.0
    dry = forces(rig)
    q, v, a, count = rig.state.q, rig.state.v, rig.state.a, 20_000
    x = (np.arange(count) + 0.5) / count
    d, rho = 0.02, 1000.0
    for e in range(3):
        chord = q[e + 1, :3] - q[e, :3]
        u = chord / np.linalg.norm(chord)
        r = q[e, :3] + x[:, None] * chord
        water = np.array((0.5, 0.3, 0.0)) - r[:, 2:] * (0.1, -0.05, 0.0)
        own = v[e, :3] + x[:, None] * (v[e + 1, :3] - v[e, :3])
        rate = a[e, :3] + x[:, None] * (a[e + 1, :3] - a[e, :3])
        mean = 0.2 * own
        load = np.tile((0.0, 0.0, rho * 9.81 * 0.25 * np.pi * d**2), (count, 1))
        load -= rho * 0.25 * np.pi * d**2 * (rate - (rate @ u)[:, None] * u)
        for factor, beside, speed in ((1.0, 1.0, water - own), (0.5, along, water - mean)):
            t = speed @ u
            w = speed - t[:, None] * u
            n = np.linalg.norm(w, axis=1)
            load += 0.5 * rho * d * (factor * 1.2 * n[:, None] * w + beside * 0.05 * (np.abs(t) * t)[:, None] * u)
        fine[6 * e : 6 * e + 3] += ((1.0 - x)[:, None] * load).mean(0)
        fine[6 * e + 6 : 6 * e + 9] += (x[:, None] * load).mean(0)
    got = (dry - closed)[FREE]
    assert got == pytest.approx(fine[FREE], rel=1e-6, abs=1e-6 * np.abs(fine).max())


def test_points_and_directions_of_a_chain_are_those_of_its_links():
    rig = wandering()
    forces(rig)
    q, arc = rig.state.q, rig.state.nodes[NOW, ARC]
    assert (arc[:, LINK] == 1.0).all()
    chords = np.diff(q[:, :3], axis=0) / np.diff(arc[:, 0])[:, None]
    assert q[1, 3:] == pytest.approx(0.5 * (chords[0] + chords[1]), rel=1e-12)
    assert q[-1, 3:] == pytest.approx(chords[-1], rel=1e-12)
    r, _, g = point_of(arc, q, rig.state.v, 1, 0.25)
    assert r == pytest.approx(0.75 * q[1, :3] + 0.25 * q[2, :3])
    assert g == pytest.approx(q[2, :3] - q[1, :3])


def test_a_joint_bears_no_moment():
    rig = wandering()
    with pytest.raises(
        RigError, match="node 0: 'rg' holds a gradient, and a joint of .* without bending_stiffness has none; "
    ):
        rig.hold({0: "rg"})
    with pytest.raises(RigError, match="a load on node 3 has a moment .* without bending_stiffness bears none; "):
        rig.load(-1, moment=(0.0, 1.0, 0.0))


def test_a_dry_chain_keeps_its_energy():
    """A pendulum of six links let go level, half a second, to a thousandth of what it turned over."""
    cable = cable_of([{"length": 3.0, "elements": 6}], model="segments", mass_per_length=1.0, axial_stiffness=1e5)
    rig = Rig(cable, held={0: "r"}, tension=30.0)
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rig.balance()
    run = rig.run(0.5, 0.0005)
    mass = np.full((6, 1), 0.5)
    v = run.v[-1, :, :3]
    moving = (mass / 6.0 * (v[1:] ** 2 + v[1:] * v[:-1] + v[:-1] ** 2)).sum()
    z = run.q[-1, :, 2]
    fallen = -9.81 * (mass[:, 0] * 0.5 * (z[1:] + z[:-1])).sum()
    assert moving + run.strain[-1] == pytest.approx(fallen, rel=2e-3)
