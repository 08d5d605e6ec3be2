"""What the time integration takes from ringing: against the energy of an oscillator, stepped by the same scheme."""

import numpy as np
import pytest

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics.integrate import coefficients
from cable_sim_ros.physics.ringing import damped
from cable_sim_ros.physics.state import GAIN, NOW, STEP, A, Q, V, X
from cable_sim_ros.sim.simulator import Simulator

pytestmark = pytest.mark.check
RHO = 0.3


def swing(frequency, h, count):
    """Generalised-alpha on q'' = -w^2 q from q = 1: places, velocities, accelerations, auxiliary ones."""
    am, af, beta, gamma, _, _ = coefficients.py_func(h, RHO)
    q, v, a = 1.0, 0.0, -(frequency**2)
    x, rows = a, [(q, v, a, a)]
    for _ in range(count):
        free = q + h * v + h * h * (0.5 - beta) * x
        # x1 (1 - am) = (1 - af) a1 + af a - am x, a1 = -w^2 (free + h^2 beta x1)
        given = (af * a - am * x - (1.0 - af) * frequency**2 * free) / (1.0 - am)
        new = given / (1.0 + (1.0 - af) * frequency**2 * h * h * beta / (1.0 - am))
        q, v = free + h * h * beta * new, v + h * ((1.0 - gamma) * x + gamma * new)
        a, x = -(frequency**2) * q, new
        rows.append((q, v, a, x))
    return np.array(rows)


@pytest.fixture(scope="module")
def tow():
    return Simulator(load_scene("lowered_ctd"))


def taken(tow, rows, h):
    """Energy [J] that the kernel finds taken from a towbody that goes up and down like that, out of the water."""
    nodes, n, total = tow.state.nodes, int(tow.model.line.body_nodes[0]), 0.0
    nodes[:] = 0.0
    nodes[:, Q, : n + 1, 2] = np.arange(n, -1, -1) + 10.0
    for k in range(1, len(rows)):
        for row, column in ((V, 1), (A, 2), (X, 3)):
            nodes[STEP, row, n, 2], nodes[NOW, row, n, 2] = rows[k - 1, column], rows[k, column]
        nodes[NOW, GAIN, n, 2] = rows[k - 1, 2] - rows[k - 2, 2] if k > 1 else 0.0
        total += damped(tow.model.line, tow.state, h)
    return total


@pytest.mark.parametrize("phase, count", [(0.3, 3000), (0.6, 500)])
def test_it_is_the_energy_that_an_undamped_oscillator_loses(tow, phase, count):
    """Until it has come to rest: on the way some of it comes and goes with the phase."""
    frequency = phase / 0.01
    rows = swing(frequency, 0.01, count)
    energy = 0.5 * tow.scene.towbody.mass * (rows[:, 1] ** 2 + frequency**2 * rows[:, 0] ** 2)
    assert energy[-1] < 0.05 * energy[0]
    assert taken(tow, rows, 0.01) == pytest.approx(energy[0] - energy[-1], rel=0.1)


def test_a_motion_that_steps_resolve_loses_nothing(tow):
    """A wave of 1.3 s at steps of 10 ms: what the formula gives there is no ringing that would die out."""
    assert taken(tow, swing(5.0, 0.01, 600), 0.01) < 1e-3 * taken(tow, swing(15.0, 0.01, 600), 0.01)
