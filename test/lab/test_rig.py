"""The laboratory bench refuses or halves a step, as the product does."""

from __future__ import annotations

import numpy as np
import pytest

from cable_sim_ros.lab.cases.slack import stride
from cable_sim_ros.physics.integrate import TURN_MOST, TURN_STEP, Solver
from cable_sim_ros.sim.rig import Rig, RigError, cable_of

LENGTH, NODES = 2.0, 5


def rod(speed: float = 0.0, gravity: float = 0.0, iterations: int = 20) -> Rig:
    """A level rod that turns at ``speed`` [rad/s] about its first node."""
    rig = Rig(
        cable_of(
            [{"length": LENGTH, "elements": NODES - 1}], mass_per_length=0.4, axial_stiffness=1e6, bending_stiffness=1.0
        ),
        held={0: "r"},
        tension=1e3,
        gravity=gravity,
        solver=Solver(max_iterations=iterations),
    )
    s = rig.arc[:, None]
    rig.place(
        s * (1.0, 0.0, 0.0),
        np.tile((1.0, 0.0, 0.0), (NODES, 1)),
        v=speed * s * (0.0, 0.0, 1.0),
        vg=speed * np.tile((0.0, 0.0, 1.0), (NODES, 1)),
    )
    rig.balance()
    return rig


@pytest.mark.parametrize(
    ("turn", "step", "refused"),
    [
        (1.5 * TURN_MOST, 2.0 * TURN_STEP, True),
        (0.5 * TURN_MOST, 2.0 * TURN_STEP, False),
        (1.5 * TURN_MOST, 0.9 * TURN_STEP, False),
    ],
)
def test_a_step_that_turns_the_cable_far_is_taken_back(turn, step, refused):
    rig = rod(turn / step)
    before = rig.state.q.copy()
    rig.run(step, step)
    if refused:
        with pytest.raises(RigError, match=f"turned the cable by more than {TURN_MOST:g}.*a smaller step"):
            rig.refuse_whip(step)
        assert np.array_equal(rig.state.q, before)
    else:
        rig.refuse_whip(step)
        assert not np.array_equal(rig.state.q, before)


def test_a_step_that_turns_the_cable_far_goes_in_halves():
    rig, told = rod(2.5 * TURN_MOST / (4.0 * TURN_STEP)), []
    stride(rig, 4.0 * TURN_STEP, seen=told.append)
    assert told == [TURN_STEP] * 4


def test_a_step_that_newton_does_not_solve_is_halved_where_allowed():
    """Released level, four steps of 0.1 s: two corrections are too few for one."""
    with pytest.raises(RigError, match="could not be solved in 2 iterations; remedy: a smaller step"):
        rod(gravity=9.81, iterations=2).run(0.4, 0.1)
    halved, whole = rod(gravity=9.81, iterations=2), rod(gravity=9.81)
    told, other = halved.run(0.4, 0.1, halvings=8), whole.run(0.4, 0.1)
    assert told.steps == other.steps == len(told.time) == 4 and told.iterations > other.iterations
    assert np.abs(halved.state.q[:, :3] - whole.state.q[:, :3]).max() < 0.05 * LENGTH
