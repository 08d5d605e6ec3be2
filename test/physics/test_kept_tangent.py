"""Steps foreseen by differences of the acceleration, and solved with a tangent kept of a step before."""

import numpy as np
import pytest
from bench_cable import C1, C2, Bench
from hypothesis import given
from hypothesis import strategies as st

from cable_sim_ros.compiler.jit import NO, YES
from cable_sim_ros.physics.block_tridiagonal import RHS, solve
from cable_sim_ros.physics.integrate import trend
from cable_sim_ros.physics.kept_tangent import keep_tangent, look_round, solve_by_kept
from cable_sim_ros.physics.state import GAIN, GAIN_4, LINE_SETTINGS, NOW, STEP, A, Change
from cable_sim_ros.physics.towbody import BODY
from cable_sim_ros.sim.build import build_line

pytestmark = pytest.mark.check
CHANGE, H = Change(C1, C2, 0.0, 0.0), 0.01


def line_of(bench, held=None):
    nodes = bench.n + 1
    held = np.zeros((nodes, 6)) if held is None else held
    return build_line(bench.elements, held, np.zeros(0, BODY), [], np.zeros(1, LINE_SETTINGS))


def curved():
    """A cable without weight, at rest in the x-z plane, stretched and bent."""
    bench = Bench(12, 3, gravity=0.0)
    s = bench.arc / bench.arc[-1]
    bench.q[:, 0], bench.q[:, 2] = 1.003 * bench.arc, 50.0 + 0.3 * np.sin(2.0 * s)
    bench.q[:, 3:] = np.gradient(bench.q[:, :3], bench.arc, axis=0)
    return bench


def turn_about_y(bench, angle):
    c, s = np.cos(angle), np.sin(angle)
    for i in (0, 3):
        x, z = bench.q[:, i].copy(), bench.q[:, i + 2].copy()
        bench.q[:, i], bench.q[:, i + 2] = c * x + s * z, c * z - s * x


def corrections(bench, angle):
    """Of a cable that has turned since its tangent was kept: by that, and by the tangent where it is."""
    line = line_of(bench)
    bench.assemble(CHANGE, YES)
    work = bench.work
    assert solve(work.band, work.lower, work.factor, work.step)
    keep_tangent(bench.state, CHANGE)
    turn_about_y(bench, angle)
    bench.assemble(CHANGE, NO)
    solve_by_kept(line, bench.state, look_round(bench.state))
    by_kept = work.step.copy()
    bench.assemble(CHANGE, YES)
    assert solve(work.band, work.lower, work.factor, work.step)
    return by_kept, work.step.copy()


@given(st.floats(1e-3, 1.5), st.sampled_from((-1.0, 1.0)))
def test_a_cable_that_turns_is_corrected_by_the_tangent_of_before_as_by_its_own(angle, sense):
    by_kept, own = corrections(curved(), sense * angle)
    np.testing.assert_allclose(by_kept, own, rtol=0.0, atol=1e-6 * np.abs(own).max())


def test_a_slight_turn_is_not_followed():
    bench = curved()
    keep_tangent(bench.state, CHANGE)
    followed = []
    for _ in range(2):
        turn_about_y(bench, 2e-4)
        followed.append(look_round(bench.state))
    assert followed == [False, True]


@pytest.mark.parametrize("angle", [1.6, np.pi, -2.5])
def test_by_more_than_a_right_angle_it_is_not_followed_and_stays_finite(angle):
    by_kept, own = corrections(curved(), angle)
    assert np.isfinite(by_kept).all() and not np.allclose(by_kept, own, rtol=0.1)


@given(st.floats(-1.0, 1.0), st.sampled_from(range(6)))
def test_what_is_held_is_not_moved_by_a_turn(angle, component):
    """One component of a node, held, has no force in the system and gets no part of those beside it."""
    bench, node = curved(), 4
    held = np.zeros((bench.n + 1, 6))
    held[node, component] = 1.0
    bench.assemble(CHANGE, YES)
    work = bench.work
    row = work.band[node, component]
    row[:], work.lower[node, component] = 0.0, 0.0
    row[component] = 1.0
    assert solve(work.band, work.lower, work.factor, work.step)
    keep_tangent(bench.state, CHANGE)
    turn_about_y(bench, angle)
    bench.assemble(CHANGE, NO)
    work.band[node, component, RHS] = 0.0
    solve_by_kept(line_of(bench, held), bench.state, look_round(bench.state))
    assert work.step[node, component] == 0.0 and work.step[node].any()


def foreseen(accelerations, held=None):
    """Terms of the series that each step takes after the first, of accelerations [steps] along a straight cable."""
    bench = Bench(6, 1)
    bench.q[:, 3] = 1.0
    line, state, terms = line_of(bench, held), bench.state, []
    for before, now in zip(accelerations, accelerations[1:]):
        for slot, value in ((STEP, before), (NOW, now)):
            state.nodes[slot, A, :, 0] = value * np.arange(7)
        terms.append(trend(line, state, H))
    return terms, state.nodes[NOW, GAIN : GAIN_4 + 1, 1, 0].copy()


@given(st.integers(0, 4), st.integers(1, 9))
def test_as_many_differences_as_the_acceleration_has(degree, size):
    steps = np.arange(12.0)
    course = 3.0 + size * steps**degree  # whole numbers, without round-off
    terms, gained = foreseen(course)
    assert terms[0] == 0, "nothing is known of a step of another length"
    assert terms[-1] == degree
    wanted = [np.diff(course, n)[-1] for n in range(1, 5)]
    assert gained.tolist() == wanted


def test_after_a_jump_it_stays_and_what_rings_from_step_to_step_is_not_foreseen():
    assert foreseen([1.0] * 6 + [5.0])[0][-1] == 0
    assert foreseen([(-1.0) ** k for k in range(12)])[0][-1] == 0
