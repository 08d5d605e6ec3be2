"""Material that runs through a moving mesh: velocity, acceleration and tangent against differences."""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import Bench, floor_under, touching

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics.hermite import point_of, shape
from cable_sim_ros.physics.mesh_convection import material
from cable_sim_ros.physics.mesh_motion import lay_mesh
from cable_sim_ros.physics.state import ARC, NOW
from cable_sim_ros.sim.simulator import Simulator

pytestmark = pytest.mark.check


class Moving:
    """One coordinate of an element whose four unknowns and two arc lengths are cubics of time."""

    def __init__(self, seed: int):
        rng = np.random.default_rng(seed)
        self.q, self.s = rng.normal(size=(4, 4)), 0.3 * rng.normal(size=(2, 4))
        self.s[:, 0] = (2.0, 3.1)

    def at(self, table, t, order=0):
        return np.array([np.polynomial.Polynomial(c).deriv(order)(t) if order else np.polynomial.Polynomial(c)(t)
                         for c in table])  # fmt: skip

    def place(self, s: float, t: float) -> float:
        """Where the material point s is at t."""
        (a, b), (r1, g1, r2, g2) = self.at(self.s, t), self.at(self.q, t)
        return float(np.dot(shape((s - a) / (b - a)), (r1, (b - a) * g1, r2, (b - a) * g2)))


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("xi", [0.0, 0.3, 1.0])
def test_velocity_and_acceleration_are_those_of_a_point_of_material(seed, xi):
    """Against differences of its place at fixed arc length, with end points that move and an element that grows."""
    m, d = Moving(seed), 1e-4
    a, b = m.at(m.s, 0.0)
    length, s = b - a, a + xi * (b - a)
    scale = np.array([1.0, length, 1.0, length])
    p, q = m.at(m.s, 0.0, 1) / length, m.at(m.s, 0.0, 2) / length
    y, u, z = (scale * m.at(m.q, 0.0, k) for k in range(3))
    v, acc = material(tuple(p), tuple(q), tuple(y), tuple(u))
    n = shape(xi)
    before, here, after = (m.place(s, t) for t in (-d, 0.0, d))
    assert np.dot(n, u + v) == pytest.approx((after - before) / (2 * d), rel=1e-6, abs=1e-6)
    assert np.dot(n, z + acc) == pytest.approx((after - 2 * here + before) / d**2, rel=1e-5, abs=1e-5)


def test_the_velocity_read_at_a_point_is_that_of_the_elements():
    bench = Bench(3, 2)
    bench.wander()
    arc = bench.state.nodes[NOW, ARC]
    arc[:, 1] = (0.3, 0.2, -0.1, 0.0)
    for e in range(3):
        length = arc[e + 1, 0] - arc[e, 0]
        for k in range(3):
            scale = np.array([1.0, length, 1.0, length])
            y, u = (scale * (t[e, k], t[e, 3 + k], t[e + 1, k], t[e + 1, 3 + k]) for t in (bench.q, bench.v))
            v, _ = material((arc[e, 1] / length, arc[e + 1, 1] / length), (0.0, 0.0), tuple(y), tuple(u))
            for xi in (0.0, 0.37, 1.0):
                _, w, _ = point_of(arc, bench.q, bench.v, e, xi)
                assert w[k] == pytest.approx(np.dot(shape(xi), u + v), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("rates", ["uniform", "growing"])
@pytest.mark.parametrize("what", ["dry", "drum", "groove", "floor", "wet", "crossing"])
def test_tangent_with_flow(what, rates):
    """Exact but for what the growth of an element brings to drag and contact, and its curvature to the added mass."""
    bench = Bench(6, 7, current=(-1.0, 0.4, 0.02, -0.01))
    bench.wander(top={"wet": -5.0, "crossing": 0.25}.get(what, 5.0))
    if what in ("drum", "groove"):
        bench.surfaces = touching(bench, 3, None if what == "drum" else np.pi / 3)[None]
    if what == "floor":
        bench.surfaces = floor_under(bench, 3, slip=0.05)
    still = bench.residual()
    arc = bench.state.nodes[NOW, ARC]
    arc[:, 1], arc[:, 2] = 0.8, 3.0
    if rates == "growing":
        arc[:, 1] *= np.linspace(1.0, 0.0, 7)
        arc[:, 2] *= np.linspace(1.0, 0.0, 7)
    assert np.abs(bench.residual() - still).max() > 0.1, "the flow must matter"
    exact = what == "dry" or (rates == "uniform" and what in ("drum", "groove", "floor"))
    # left out is L'/L = 0.7 1/s beside c1 = 30 1/s; a haul of 1 m/s of 100 m of cable has 0.01 beside 40
    assert bench.worst(0.0) < (1e-6 if exact else 3e-2 if what == "floor" else 3e-3)


@pytest.mark.parametrize("hauled", [0.0, 294.0, 298.0, 299.2, 299.8, 320.0, 430.0])
def test_places_of_the_mesh_have_the_rates_they_say(hauled):
    """Through the blend in which the end of a section comes to the mesh aboard, and on either side of it."""
    sim = Simulator(load_scene("full_scale"))
    drum, winch, d = sim.model.settings[0].drum, sim.state.now.winch, 1e-3
    rate, accel = -1.7, 0.9

    def arcs(t: float) -> np.ndarray:
        winch.length, winch.flow[:2] = -hauled + rate * t + 0.5 * accel * t * t, (rate + accel * t, accel)
        table = np.zeros((sim.nodes, 6))
        lay_mesh(sim.model.feed, drum, winch, table, sim.model.line.elements)
        return table

    before, now, after = (arcs(t) for t in (-d, 0.0, d))
    assert (np.diff(now[:, 0]) > 0.0).all() and now[-1, 0] == 600.0
    assert now[:, 1] == pytest.approx((after[:, 0] - before[:, 0]) / (2 * d), abs=1e-5)
    assert now[:, 2] == pytest.approx((after[:, 0] - 2 * now[:, 0] + before[:, 0]) / d**2, abs=2e-3)
    if hauled < 290.0:
        assert np.isclose(now[:, 0], 450.0, atol=1e-12).any(), "a node is on the end of the bare section"
