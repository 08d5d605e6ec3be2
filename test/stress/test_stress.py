"""A handful of the stress tests in their quick size; all of them at full size are `make stress`."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.physics.inputs import push_command
from cable_sim_ros.physics.integrate import coefficients
from cable_sim_ros.physics.tick_output import Flag
from verification.shipped import started
from verification.stress import STRESS
from verification.stress.n03_load_reversals import Impulse, changes, max_within
from verification.stress.n08_n14_overspeed_and_cold_start import LIGHT_FISH, OUTBOARD, WOUND, short_on_drum
from verification.stress.n20_n21_n22_winch_at_work import SOFT, undragged
from verification.stress.tows import finite, held
from verification.stress.verdict import IS, WITHIN, Metric

# one of a kind, and none that a clock judges; N19 comes by its command
QUICK = ["N1", "N5", "N12", "N13", "N15", "N16", "N17", "N20"]
BAGS = ["I10", "I11", "I12", "I14", "I16", "S1", "S2", "S3"]


@pytest.mark.parametrize("name", QUICK)
def test_quick(name):
    verdict = STRESS.run((name,), quick=True)[0]
    assert verdict.passed, [f"{f.name}: {f.value} ({f.bound})" for f in verdict.metrics if f.passed is False]


def test_all_are_in_the_table_and_each_module_is_named_by_its_numbers():
    assert list(STRESS.named) == [*(f"N{i}" for i in range(1, 29)), *BAGS]
    for name, place in STRESS.named.items():
        assert f"{name[0].lower()}{int(name[1:]):02d}_" in place.partition(".")[0], name


def test_a_figure_that_is_not_finite_never_passes():
    assert Metric("x", float("nan"), "", 1.0).passed is False
    assert Metric("x", -2.0, "", 1.0, WITHIN).passed is False
    assert Metric("x", True, "", True, IS).passed is True


def test_the_command_tells_measured_and_limit():
    done = CliRunner().invoke(commands.main, ["stress", "N19", "--quick", "--json"])
    assert done.exit_code == 0, done.output
    report = json.loads(done.stdout)[0]
    assert report["id"] == "N19" and report["passed"] is True and set(report["limits"]) <= set(report["measured"])


def test_impulse_is_what_the_time_integration_gives_to_the_velocity():
    """A mass under a jumping force: the impulse of the scheme closes to round-off, step times force does not."""
    rho, mass, force = 0.3, 2.0, np.where(np.arange(40) % 7 < 3, 50.0, -20.0)
    steps = np.where(np.arange(40) % 5 == 0, 0.5e-3, 1e-3)
    v, a, x = 0.0, force[0] / mass, force[0] / mass
    impulse = Impulse(force[:1], rho)
    for h, f in zip(steps[1:], force[1:], strict=True):
        am, af, _, gamma, _, _ = coefficients(h, rho)
        new = ((1.0 - af) * f / mass + af * a - am * x) / (1.0 - am)
        v, a, x = v + h * ((1.0 - gamma) * x + gamma * new), f / mass, new
        impulse.step(h, np.array([f]))
    assert impulse.total[0] == pytest.approx(mass * v, rel=1e-12)
    assert abs((steps[1:] * force[1:]).sum() / (mass * v) - 1.0) > 0.01


def test_changes_within_a_window():
    assert max_within(np.array((0.0, 0.01, 0.02, 0.05)), 0.02) == 3
    assert max_within(np.zeros(0)) == 0
    assert list(changes(np.array((True, True, False, True)))) == [2, 3]


def test_slack_cable_at_the_drum_is_solved_in_halved_steps():
    """Pay-out at five times the speed at which the fish sinks: without the limit on turning the run halts at 2.5 s."""
    sim = started(short_on_drum(OUTBOARD, WOUND, **LIGHT_FISH))
    push_command(sim.inputs, 1, np.nan, sim.scene.winch.max_rate)
    frames = sim.run(260)
    assert finite(frames)
    assert (frames.status & Flag.SLACK).any() and (frames.status & Flag.HALVED).any()


def test_a_soft_cable_starts_on_its_sheave():
    """From its unstretched length it settled beside it, hanging straight from the drum."""
    assert started(undragged(*SOFT[:4])).frame.contact_total > 0.0


def test_a_mesh_is_made_for_two_metres_of_scope():
    """A tenth of it lies inboard of the end stop: a promise asked for there was never kept."""
    assert held(winch__scope=2.0).winch.scope == 2.0
