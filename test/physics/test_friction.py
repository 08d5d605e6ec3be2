"""Friction on sheave and drum: one law for every surface, against the slip alone, with its exact derivative."""

from __future__ import annotations

import numpy as np
import pytest
from bench_cable import Bench, floor_under, record, touching
from hypothesis import given, settings
from hypothesis import strategies as st

from cable_sim_ros.physics.contact import acts, rubs, touch
from cable_sim_ros.physics.contact_detection import rubbed
from cable_sim_ros.physics.contact_surface import Sheave, floor_row, sheave_friction, solid, surface_row
from cable_sim_ros.physics.state import ARC, NOW
from cable_sim_ros.physics.vec import dot
from cable_sim_ros.physics.workspace import SURFACES

THROATS = {"drum": None, "groove": np.pi / 3}
speeds = st.tuples(*[st.floats(-5.0, 5.0)] * 3)


def rubbing(bench: Bench, node: int, kind: str, friction: float = 0.3, slip: float = 0.01) -> np.ndarray:
    """A moving, turning surface of a kind that the cable presses at ``node``, with friction."""
    row = floor_under(bench, node) if kind == "floor" else touching(bench, node, THROATS[kind])
    row["friction"], row["slip"] = friction, slip
    return row


@given(
    st.sampled_from(["drum", "groove", "floor"]),
    st.tuples(st.floats(-0.05, 0.05), st.floats(-0.03, 0.03)),
    speeds,
    speeds,
    speeds,
    st.floats(0.0, 2.0),
    st.floats(1e-5, 1.0),
)
@settings(max_examples=60)
def test_friction_acts_along_the_surface_against_the_slip_and_within_its_cone(kind, at, v, moves, spin, mu, slip):
    """However the surface moves and turns: it takes power from the slip, never gives, and is at most mu f."""
    if kind == "floor":
        row = floor_row(0.25, 1e6, 0.3, mu, slip)
    else:
        row = surface_row((0, 0, 0), 0.25, THROATS[kind], 0.05, 0.03, 1e6, 0.3, mu, slip)
    row["speed"], row["spin"] = moves, spin
    s = solid(record(row))
    touched = touch(s, s.stiffness, (0.0, at[0], 0.25 + at[1]), v)
    rub, pressed = np.array(rubs(s, touched)), touched.own.load + touched.other.load
    assert dot(rub, touched.gap.slip) <= 0.0
    assert np.linalg.norm(rub) <= mu * pressed * (1.0 + 1e-12)
    for half, press in ((touched.gap.own, touched.own), (touched.gap.other, touched.other)):
        force, n = np.array(acts(s, half, press)), np.array(half.normal)
        assert force @ n == pytest.approx(press.load, rel=1e-9, abs=1e-9), "the normal load is the law's"


@pytest.mark.parametrize("slip", [0.01, 0.5, 5.0], ids=["slides", "between", "creeps"])
@pytest.mark.parametrize("kind", ["drum", "groove", "floor"])
def test_tangent(kind, slip):
    bench = Bench(6, 7)
    bench.wander(top=5.0, slope=0.05)
    bench.surfaces = rubbing(bench, 3, kind, slip=slip)[None]
    with_it = bench.residual()
    bench.surfaces["friction"] = 0.0
    assert np.abs(with_it - bench.residual()).max() > 1.0, "friction must matter"
    bench.surfaces["friction"] = 0.3
    assert bench.worst() < 1e-6


@pytest.mark.parametrize("kind", ["drum", "groove"])
def test_tangent_where_the_material_runs_through_the_mesh(kind):
    """The slip is that of the material, which changes with the slope of the mesh where it runs along it."""
    bench = Bench(6, 7)
    bench.wander(top=5.0)
    bench.surfaces = rubbing(bench, 3, kind, slip=0.2)[None]
    still = rubbed(bench.state)
    bench.state.nodes[NOW, ARC, :, 1], bench.state.nodes[NOW, ARC, :, 2] = 0.8, 3.0
    assert abs(rubbed(bench.state) - still) > 0.1 * still, "the slip must know of it"
    assert bench.worst(0.0) < 1e-6


@pytest.mark.parametrize("kind", ["drum", "groove"])
def test_the_loops_without_friction_are_the_same_law(kind):
    """Next to no friction takes the loops with it: force and tangent of the others to rounding."""
    bench = Bench(6, 7)
    bench.wander(top=5.0)
    found = []
    for friction, slip in ((0.0, 0.01), (0.0, 0.5), (1e-300, 0.01)):
        bench.surfaces = rubbing(bench, 3, kind, friction, slip)[None]
        found.append((bench.tangent(), bench.residual()))
    for off, other_slip, next_to_none in zip(*found, strict=True):
        np.testing.assert_array_equal(off, other_slip)
        np.testing.assert_allclose(next_to_none, off, rtol=0.0, atol=1e-12 * np.abs(off).max())


@pytest.mark.parametrize("kind", ["drum", "groove", "floor"])
def test_heat_is_what_friction_takes(kind):
    """Power of the surface on the cable with friction, less that without, where the surface stands: minus the heat."""
    bench = Bench(6, 7)
    bench.wander(top=5.0, slope=0.05)
    power = []
    for friction in (0.0, 0.3):
        row = rubbing(bench, 3, kind, friction)
        row["speed"], row["spin"] = 0.0, 0.0
        bench.surfaces = row[None]
        bench.residual()
        power.append(float(bench.power[SURFACES]))
    heat = rubbed(bench.state)
    assert heat > 0.0 and power[0] - power[1] == pytest.approx(heat, rel=1e-9)
    bench.surfaces["friction"] = 0.0
    assert rubbed(bench.state) == 0.0


@pytest.mark.parametrize(
    "groove, bearing, acts_as",
    [(0.1, 0.0, 0.0), (0.0, 0.5, 0.0), (0.1, 0.02, 0.01), (0.1, 0.2, 0.1), (0.1, 100.0, 0.1)],
)
def test_the_weaker_of_groove_and_bearing_acts(groove, bearing, acts_as):
    """Throat 60 deg: a bearing of 0.02 per radian is 0.01 of the load on the flanks."""
    sheave = Sheave(position=(0.0, 0.0, 0.0), radius=0.25, friction=groove, bearing_friction=bearing)
    assert sheave_friction(sheave) == pytest.approx(acts_as)
