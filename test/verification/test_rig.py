"""A line of one's own: steps refused, halved and reported piece by piece; what is held, pulled and moved; contact."""

from __future__ import annotations

import numpy as np
import pytest

from cable_sim_ros.physics.contact_surface import surface_row
from cable_sim_ros.physics.integrate import Solver
from cable_sim_ros.physics.substeps import LEAVE_STEP, MAX_TURN, NO_LIMIT, TURN_STEP
from cable_sim_ros.sim.build import StepRules
from cable_sim_ros.sim.rig.rig import HALVED, WHIPPING, Rig, RigError, load_of
from verification.bend import Walk, drum, pulls
from verification.cables import uniform
from verification.contact_points import contact_points

LENGTH, NODES = 2.0, 5
REFUSING = StepRules(0, MAX_TURN, NO_LIMIT)


def rod(speed: float = 0.0, gravity: float = 0.0, iterations: int = 20) -> Rig:
    """A level rod that turns at ``speed`` [rad/s] about its first node."""
    cable = uniform(LENGTH, NODES - 1, 0.4, 1e6, bending_stiffness=1.0)
    rig = Rig(cable, held={0: "r"}, tension=1e3, gravity=gravity, solver=Solver(max_iterations=iterations))
    s, up = rig.arc[:, None], np.array((0.0, 0.0, speed))
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rig.state.v[:, :3], rig.state.v[:, 3:] = s * up, up
    rig.balance()
    return rig


@pytest.mark.parametrize(
    ("turn", "step", "refused"),
    [
        (1.5 * MAX_TURN, 2.0 * TURN_STEP, True),
        (0.5 * MAX_TURN, 2.0 * TURN_STEP, False),
        (1.5 * MAX_TURN, 0.9 * TURN_STEP, False),
    ],
)
def test_a_step_that_turns_the_cable_far_is_taken_back(turn, step, refused):
    rig = rod(turn / step)
    before = rig.state.q.copy()
    if refused:
        with pytest.raises(RigError, match=f"turning a gradient by more than {MAX_TURN:g}.*0 halvings.*a smaller step"):
            rig.run(step, step, rules=REFUSING)
        assert np.array_equal(rig.state.q, before)
    else:
        rig.run(step, step, rules=REFUSING)
        assert not np.array_equal(rig.state.q, before)


def test_a_step_that_turns_the_cable_far_goes_in_halves():
    rig = rod(2.5 * MAX_TURN / (4.0 * TURN_STEP))
    assert list(rig.steps(4.0 * TURN_STEP, rules=WHIPPING)) == [TURN_STEP] * 4


def test_a_step_that_newton_does_not_solve_is_halved_where_allowed():
    """Released level, four steps of 0.1 s: two corrections are too few for one."""
    with pytest.raises(RigError, match="not be solved in 2 iterations, 0 halvings allowed; remedy: a smaller step"):
        rod(gravity=9.81, iterations=2).run(0.4, 0.1)
    halved, whole = rod(gravity=9.81, iterations=2), rod(gravity=9.81)
    history, other = halved.run(0.4, 0.1, rules=HALVED), whole.run(0.4, 0.1)
    assert history.steps == other.steps == len(history.time) == 4 and history.iterations > other.iterations
    assert np.abs(halved.state.q[:, :3] - whole.state.q[:, :3]).max() < 0.05 * LENGTH


def test_what_is_held_stays_where_it_is():
    """Steps foresee by differences, which would carry the round-off of its first acceleration away, by 4e-7 m."""
    rig = rod(gravity=9.81)
    rig.run(3.0, 0.005, every=600, rules=HALVED)
    assert np.abs(rig.state.q[0, :3]).max() < 1e-12


def lifted(t: np.ndarray) -> np.ndarray:
    """The first node lifted by t^5 [m]."""
    rows = np.zeros((len(t), 1, 9))
    rows[:, 0, 2], rows[:, 0, 5], rows[:, 0, 8] = t**5, 5.0 * t**4, 20.0 * t**3
    return rows


def test_moved_nodes_are_where_they_should_be_in_every_piece_of_a_halved_step():
    rig, now, pieces = rod(gravity=9.81, iterations=2), 0.0, []
    for _ in range(4):
        begin = now
        for h in rig.steps(0.1, moved=(0,), motion=lambda t, begin=begin: lifted(begin + t), rules=HALVED):
            now, pieces = now + h, [*pieces, h]
            where = lifted(np.array([now]))[0, 0]
            found = np.concatenate((rig.state.q[0, :3], rig.state.v[0, :3], rig.state.a[0, :3]))
            assert found == pytest.approx(where, abs=1e-9)
    assert sum(pieces) == pytest.approx(0.4) and min(pieces) < 0.1


def test_a_walk_keeps_the_clock_and_the_smallest_piece():
    walk = Walk(rod(gravity=9.81, iterations=2))
    seen = walk.to(0.4, 0.1, lambda t: t)
    assert seen == pytest.approx([0.1, 0.2, 0.3, 0.4]) and walk.smallest < 0.1
    assert walk.note(0.1) == [f"Newton asked for steps down to {walk.smallest:.2g} s"] and walk.note(1e-9) == []


def test_components_are_held_by_name():
    rig = rod()
    rig.hold({0: "xy", -1: "rgy"})
    assert rig.model.held[0].tolist() == [1, 1, 0, 0, 0, 0] and rig.model.held[-1].tolist() == [1, 1, 1, 0, 1, 0]
    assert not rig.model.held[1:-1].any()
    with pytest.raises(ValueError, match="node 2: 'rw' holds nothing: components are x, y, z, r"):
        rig.hold({2: "rw"})


def test_loads_take_the_place_of_those_before():
    rig = rod()
    rig.load(-1, (1.0, 2.0, 3.0), (0.0, 4.0, 0.0))
    rig.load(1, (5.0, 0.0, 0.0))
    assert rig.model.loads["node"].tolist() == [NODES - 1, 1]
    assert rig.model.loads["force"].tolist() == [[1, 2, 3], [5, 0, 0]] and rig.model.loads["moment"][0, 1] == 4.0
    rig.reload([load_of(-2, (0.0, 0.0, 7.0))])
    assert rig.model.loads["node"].tolist() == [NODES - 2] and rig.model.loads["force"][0, 2] == 7.0
    rig.release_loads()
    assert len(rig.model.loads) == 0
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rig.reload(pulls((NODES - 1, (6.0, 0.0, 0.0))))
    rig.settle()
    assert rig.state.tension == pytest.approx(6.0, rel=1e-4)


def test_stations_of_each_surface_and_of_a_sample_of_a_run():
    """A cable pulled over a drum at the origin, and another drum out of reach."""
    radius, tension, wrap = 0.5, 1000.0, 0.4
    far = drum(radius, tension)
    far["centre"] = (0.0, 0.0, -50.0)
    along, down = tension * np.cos(0.5 * wrap), -tension * np.sin(0.5 * wrap)
    rig = Rig(
        uniform(2.0, 40, 0.4, 1e6, compression_share=1e-7),
        held={0: "x"},
        tension=tension,
        gravity=0.0,
        surfaces=[drum(radius, tension), far],
        loads=pulls((0, (-along, 0.0, down)), (40, (along, 0.0, down))),
    )
    s = rig.arc - 1.0
    angle = np.clip(s / radius, -0.5 * wrap, 0.5 * wrap)
    g = np.stack((np.cos(angle), 0.0 * s, -np.sin(angle)), 1)
    rest = (s - radius * angle)[:, None] * g
    rig.place(radius * np.stack((np.sin(angle), 0.0 * s, np.cos(angle)), 1) + rest, g)
    rig.settle()
    table, other = contact_points(rig), contact_points(rig, 1)
    assert len(table.s) == len(other.s) == 200 and table.weight.sum() == pytest.approx(2.0)
    assert np.all(np.diff(table.s) > 0.0) and np.all(np.diff(table.angle) > 0.0)
    assert table.resultant == pytest.approx((0.0, 0.0, 2.0 * tension * np.sin(0.5 * wrap)), abs=0.5)
    assert table.load == pytest.approx(table.flanks.sum(1)) and table.gap.min() < 0.0 < table.gap.max()
    assert not other.load.any() and other.gap.min() > 49.0
    q = rig.state.q.copy()
    q[:, 2] += 1.0
    lifted_off = contact_points(rig, q=q)
    assert not lifted_off.load.any() and lifted_off.gap.min() > 0.0
    assert np.array_equal(contact_points(rig).load, table.load), "the present is as it was"


def test_residual_is_what_is_out_of_balance():
    rig = rod()
    rig.reload([load_of(-1, (0.0, 0.0, 7.0))])
    assert rig.residual() == pytest.approx(7.0)
    assert rig.state.work.band[-1, 2, 12] == pytest.approx(7.0)


def test_the_rule_of_the_groove_lets_a_cable_be_that_is_in_none():
    """A step longer than leave_step must not leave a groove; a cable far from one leaves none."""
    cable = uniform(2.0, 4, 0.4, 1e5)
    groove = surface_row((5.0, 0.0, 0.0), 0.25, 1.0, 0.03, 0.005, 1e9, 0.3)
    rig = Rig(cable, held={0: "r"}, bodies={-1: 5.0}, tension=50.0, surfaces=[groove])
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    history = rig.run(0.1, 0.01, rules=StepRules(0, leave_step=LEAVE_STEP))
    assert history.steps == 10 and np.abs(history.q[-1, :, :3] - rig.state.q[:, :3]).max() == 0.0
