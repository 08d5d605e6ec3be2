"""Steps chosen by their error: the estimate, what it is good for, the grid, the same bits again, nothing ignored."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cable_sim_ros.physics.integrate import Solver
from cable_sim_ros.physics.substeps import NO_LIMIT
from cable_sim_ros.sim.build import StepRules
from cable_sim_ros.sim.inputs import WinchCommand
from cable_sim_ros.sim.rig.rig import Rig, cable_of
from cable_sim_ros.sim.simulator import Simulator, SolverError
from verification.shipped import scene_with, started

pytestmark = pytest.mark.check
LENGTH, MASS, GRAVITY, ANGLE, STIFFNESS = 10.0, 100.0, 9.81, 0.5, 1e7
CHOSEN = {
    "solver.tension_error": 0.005,
    "solver.tick": 0.1,
    "winch.command_timeout": 60.0,
    "setpoint.algorithm": "hold",
}


def pendulum(**solver) -> Rig:
    """A heavy body on a light cable, let go of at ANGLE from the vertical."""
    rig = Rig(
        cable_of([{"length": LENGTH, "elements": 2}], mass_per_length=1e-3, axial_stiffness=STIFFNESS),
        held={0: "r"},
        bodies={-1: MASS},
        tension=MASS * GRAVITY,
        solver=Solver(**solver),
    )
    rig.straight(
        (0.0, 0.0, 0.0), (np.sin(ANGLE), 0.0, -np.cos(ANGLE)), 1.0 + MASS * GRAVITY * np.cos(ANGLE) / STIFFNESS
    )
    rig.balance()
    return rig


def swing(t: np.ndarray) -> np.ndarray:
    """x of the body [m] at times t: a point on a massless spring, to 1e-8."""

    def rate(_, y):
        length = np.hypot(y[0], y[1])
        pull = STIFFNESS / MASS * (1.0 / LENGTH - 1.0 / length)
        return y[2], y[3], -pull * y[0], -pull * y[1] - GRAVITY

    reach = LENGTH * (1.0 + MASS * GRAVITY * np.cos(ANGLE) / STIFFNESS)
    start = (reach * np.sin(ANGLE), -reach * np.cos(ANGLE), 0.0, 0.0)
    return solve_ivp(rate, (0.0, t[-1]), start, "DOP853", t_eval=t, rtol=1e-10, atol=1e-10).y[0]


def error_of(tension_error: float, position_error: float) -> tuple[float, int]:
    """Largest error of the place of the body in 20 s [m] with tick outputs each 0.5 s, and the steps it took."""
    rig = pendulum(tension_error=tension_error, position_error=position_error)
    report = rig.run(20.0, 0.5, rules=StepRules(16, NO_LIMIT, NO_LIMIT))
    assert report.time[-1] == pytest.approx(20.0)
    return float(np.abs(report.q[:, -1, 0] - swing(report.time)).max()), int(rig.state.now.control.taken.sum())


def test_the_error_falls_with_the_tolerance():
    """Without damping the errors of the steps add up over the run: with h^2, so the tolerance to the power of 2/3."""
    tolerances = (1e-2, 1e-3, 1e-4, 1e-5)
    errors, steps = zip(*(error_of(0.1, e) for e in tolerances), strict=True)
    assert all(3.0 * fine < coarse for coarse, fine in zip(errors, errors[1:], strict=False)), errors
    assert errors[0] > 100.0 * errors[-1], errors
    assert list(steps) == sorted(steps), steps


def test_the_estimate_goes_with_the_third_power_of_the_step():
    estimates = []
    for h in (0.08, 0.04, 0.02):
        rig, found = pendulum(tension_error=0.1, position_error=10.0), []
        for _ in range(round(2.0 / h)):
            rig.run(h, h)
            found.append(float(rig.state.now.control.position))
        estimates.append(max(found))
    assert estimates[0] / estimates[1] == pytest.approx(8.0, rel=0.2)
    assert estimates[1] / estimates[2] == pytest.approx(8.0, rel=0.2)


def test_a_change_of_step_keeps_the_second_order():
    """Steps of h and 2 h in turn: without the lag of x stretched with the step the error would go with h."""
    errors = []
    for h in (0.02, 0.01):
        rig = pendulum(tension_error=0.1, position_error=10.0)
        for _ in range(round(6.0 / (3.0 * h))):
            rig.run(h, h)
            report = rig.run(2.0 * h, 2.0 * h)
        errors.append(abs(float(report.q[-1, -1, 0]) - swing(np.array((0.0, 6.0)))[-1]))
    assert errors[0] / errors[1] > 3.3, errors


@pytest.fixture(scope="module")
def tow():
    """A tow in chosen steps whose winch pays out from 1.0037 s to 1.5073 s, and its tick outputs of 3 s."""
    sim = begun()
    return sim, sim.run(30)


def begun(**changes) -> Simulator:
    sim = started(scene_with("full_scale", CHOSEN | changes))
    sim.push(WinchCommand(time_ns=1_003_700_000, rate=1.0))
    sim.push(WinchCommand(time_ns=1_507_300_000, rate=0.0))
    return sim


def test_frames_stand_on_the_grid_and_the_steps_add_up_to_it(tow):
    sim, frames = tow
    assert (frames.time == 100_000_000 * np.arange(1, 31)).all()
    assert sum(length * count for length, count in sim.steps.items()) == pytest.approx(3.0, rel=1e-12)
    assert sum(sim.steps.values()) == frames.substeps.sum() and len(sim.steps) > 2, "long at rest, short at the stop"
    assert max(sim.steps) == 0.1 and min(sim.steps) < 0.01


def test_a_command_holds_from_its_stamp_whatever_the_grid(tow):
    for changes in ({}, {"solver.tick": 0.5}, {"solver.tick": 0.025}):
        sim = begun(**changes)
        first = sim.frame.payout
        frames = sim.run(round(3.0 / sim.scene.solver.tick))
        assert frames.payout[-1] - first == pytest.approx(0.5036, abs=2e-5), "but for the lag of the servo"
        assert frames.command_age[-1] == pytest.approx(3.0 - 1.5073, abs=1e-9)
        assert frames.tension[-1] == pytest.approx(tow[1].tension[-1], abs=16.0), "0.005 of the working tension"
        assert np.linalg.norm(frames.body_position[-1] - tow[1].body_position[-1]) < 0.01


def test_the_same_run_gives_the_same_bits_and_so_does_one_that_was_interrupted(tow, tmp_path):
    again = begun()
    assert again.run(12).tobytes() == tow[1][:12].tobytes()
    saved = again.snapshot()
    again.save(tmp_path / "half.npz")
    rest = again.run(18).tobytes()
    assert rest == tow[1][12:].tobytes()
    again.restore(saved)
    assert again.run(18).tobytes() == rest
    assert Simulator.load(tmp_path / "half.npz").run(18).tobytes() == rest


def test_a_step_whose_error_cannot_be_met_halts_the_run():
    sim = begun(**{"solver.tension_error": 1e-6, "solver.max_halvings": 0, "solver.tick": 0.01})
    text = (
        r"could not be solved .*NEWTON_FAILED.* with 0 halvings, with cable.axial_stiffness = .* N and solver.tick = "
        r"0.01 s, in steps to solver.tension_error = 1e-06 and solver.position_error = 0.01 m; the run halted .* "
        r"Remedy: .*fixed steps \(cable-sim run --step fixed; "
    )
    with pytest.raises(SolverError, match=text) as report:
        sim.run(200)
    assert sim.state.now.halted != 0 and sim.frame.time < 1_510_000_000
    frames = report.value.frames
    assert 0 < len(frames) < 200 and frames[-1].tobytes() == sim.frame.tobytes(), "of the ticks before it"
    since = (sim.frame.time - sim.state.now.time.start) * 1e-9
    assert f"the tick after {since:.3f} s of simulation" in str(report.value)
