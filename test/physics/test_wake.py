"""The wake oscillator: its cycle, the sign that is printed, its order, its force on a held cable, where it points and
where it ends; halving, and a fluid without wind. docs/wake.md."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from cable_sim_ros.physics.fluid import Fluid
from cable_sim_ros.physics.hermite import shape
from cable_sim_ros.physics.state import NOW, WAKE
from cable_sim_ros.physics.substeps import NO_LIMIT
from cable_sim_ros.physics.wake_oscillator import SATURATION, WAKE_FLOW, WAKE_Q, WAKE_RATE, Wake, WakeLaw, oscillate
from cable_sim_ros.physics.wake_oscillator import _add_wake as add_wake
from cable_sim_ros.physics.wake_oscillator import _advance_wake as advance_wake
from cable_sim_ros.physics.water import Water
from cable_sim_ros.sim.build import StepRules
from cable_sim_ros.sim.rig.rig import Rig, RigError, cable_of
from cable_sim_ros.sim.wake_tables import STEPS
from cable_sim_ros.tools.spans.in_time.wake_run import frequency

pytestmark = pytest.mark.check

OM, A1 = 19.0, 0.3
DIAMETER, LENGTH, ELEMENTS, WIND = 0.02, 2.0, 4, 0.3
LAWS = [WakeLaw.BAI_QIN, WakeLaw.FACCHINETTI]


def cycle(a1, a2):
    """q over 30 s in steps of 5 ms, the first half left out."""
    q, s, report = 0.1, 0.0, []
    for _ in range(6000):
        q, s = oscillate(q, s, a1, a2, OM, 0.0, 0.0, 0.005)
        report.append(q)
    return 0.005 * np.arange(3000), np.array(report[3000:])


def rod(current=(0.0, WIND), law="bai_qin", held="rg", elements=ELEMENTS, water=None, **wake) -> Rig:
    """A level cable along x, from x = 0, all of it held, or what ``held`` names of its nodes."""
    block = {"law": law, **wake}
    cable = cable_of(
        [{"length": LENGTH, "elements": elements, "wake": block, "drag_law": "crossflow"}],
        mass_per_length=1.38,
        axial_stiffness=1e6,
        bending_stiffness=0.73,
        diameter=DIAMETER,
    )
    water = water or Fluid(current=current)
    rig = Rig(cable, held={n: held for n in range(elements + 1)}, tension=200.0, gravity=0.0, water=water)
    rig.straight((0.0, 0.0, -1.0), (1.0, 0.0, 0.0))
    return rig


@pytest.mark.parametrize("law", LAWS)
def test_alone_it_ends_on_its_cycle(law):
    a2 = SATURATION[law]
    time, q = cycle(A1, a2)
    assert np.abs(q).max() == pytest.approx(2.0 / np.sqrt(3.0 * a2), rel=2e-3)
    assert 2.0 * pi * frequency(time, q) == pytest.approx(18.896, rel=2e-4)


def test_with_the_sign_as_printed_a_wake_decays():
    """(A19) prints 1 - a2 ... with a plus before a1: damping of every small wake."""
    assert np.abs(cycle(-A1, 0.2)[1]).max() < 1e-12


def test_the_oscillator_is_of_second_order():
    """Against the finest step: driven near its own frequency, sub-steps as long as the steps."""

    def end(h):
        q, s, t = 0.5, 0.0, 0.0
        for _ in range(round(0.5 / h)):
            q, s = oscillate(q, s, A1, 0.2, OM, 20.0 * np.cos(17.0 * t), 20.0 * np.cos(17.0 * (t + h)), h)
            t += h
        return np.array((q, s))

    exact = end(0.5 / 8192)
    errors = [np.abs(end(0.5 / n) - exact).max() for n in (128, 256, 512)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert 1.9 < orders.min() and orders.max() < 2.1


@pytest.mark.parametrize("law", LAWS)
def test_a_held_cable_feels_the_lift_of_the_cycle(law):
    """C_L0/4 rho U^2 d q0 up and down, C_D0/8 rho U^2 d q0^2 along at twice the frequency, on all of its length."""
    rig, q0 = rod(law=law), 2.0 / np.sqrt(3.0 * SATURATION[law])
    period = DIAMETER / (0.2 * WIND)
    report = rig.run(30.0 * period, period / 60.0)
    last = report.time > 20.0 * period
    force = -report.reaction[last][:, :, :3].sum(1)
    pressure = 1.2 * WIND**2 * DIAMETER * LENGTH
    up, along = (force[:, k] - 0.5 * (force[:, k].max() + force[:, k].min()) for k in (2, 1))
    assert np.abs(up).max() == pytest.approx(0.3 / 4.0 * pressure * q0, rel=3e-3)
    # q q'/om is not quite that of a sine: 1 + a1/4 to first order
    assert np.abs(along).max() == pytest.approx(0.2 / 8.0 * pressure * q0**2, rel=0.1)
    ratio = frequency(report.time[last], along) / frequency(report.time[last], up)
    assert ratio == pytest.approx(2.0, rel=1e-3)
    assert np.abs(force[:, 0]).max() < 1e-12


@pytest.mark.parametrize(
    ("current", "way"), [((0.0, WIND), (0, 0, 1)), ((0.0, -WIND), (0, 0, -1)), ((0.1, WIND), (0, 0, 1))]
)
def test_the_lift_of_a_positive_wake_is_along_tangent_times_flow(current, way):
    rig = rod(current=current)
    advance_wake(rig.model, rig.state, 1e-3)
    load = rig.state.work.wake
    assert (rig.state.nodes[NOW, WAKE, :, WAKE_Q] > 0.0).all()
    up = load[:, :3] @ np.array(way, float)
    np.testing.assert_allclose(load[:, :3], up[:, None] * np.array(way, float), atol=1e-15)
    q = rig.state.nodes[NOW, WAKE, :, WAKE_Q]
    np.testing.assert_allclose(up, WIND**2 * q, rtol=1e-12)  # of the normal flow alone


def test_the_flow_follows_with_a_lag_of_ten_periods():
    rig = rod()
    advance_wake(rig.model, rig.state, 1e-3)
    rig.state.now.current[1] = 1.1 * WIND
    lag = 10.0 * 2.0 * pi / rig.state.nodes[NOW, WAKE, 2, WAKE_RATE]
    h = 0.01
    for _ in range(round(0.1 * lag / h)):
        advance_wake(rig.model, rig.state, h)
    flow = rig.state.nodes[NOW, WAKE, 2, WAKE_FLOW : WAKE_FLOW + 3]
    assert flow / WIND == pytest.approx((0.0, 1.1 - 0.1 * np.exp(-0.1), 0.0), abs=5e-4)


def test_nothing_is_shed_below_reynolds_47_nor_above_the_water_nor_within_a_long_step():
    slow = rod(current=(0.0, 46.0 * 1.8e-5 / (1.2 * DIAMETER)))
    advance_wake(slow.model, slow.state, 1e-3)
    assert np.abs(slow.state.work.wake).max() == 0.0 and (slow.state.nodes[NOW, WAKE, :, WAKE_RATE] > 0.0).all()
    water = Water(current=(0.0, WIND))
    dry = rod(water=water)
    dry.state.q[:, 2] = 0.1
    advance_wake(dry.model, dry.state, 1e-3)
    assert np.abs(dry.state.work.wake).max() == 0.0
    wet = rod(water=water)
    advance_wake(wet.model, wet.state, 1e-3)
    assert np.abs(wet.state.work.wake).max() > 0.0
    period = DIAMETER / (0.2 * WIND)
    for fraction, left in ((1.0 / STEPS, True), (0.21, False)):
        rig = rod()
        advance_wake(rig.model, rig.state, fraction * period)
        assert (np.abs(rig.state.work.wake).max() > 0.0) == left


def test_its_load_is_integrated_with_the_shape_functions():
    """Linear between two nodes, against quadrature."""
    rig = rod(current=(0.0, 0.05), elements=1)
    rig.state.work.wake[:] = [[0.1, 0.2, 0.3, -0.4, 0.5, 0.6], [0.7, -0.8, 0.9, 1.0, 1.1, -1.2]]
    rig.state.work.band[:] = 0.0
    add_wake(rig.model, rig.state)
    x, w = np.polynomial.legendre.leggauss(8)
    x, w = 0.5 + 0.5 * x, 0.5 * w
    lift, drag = 0.25 * 0.3 * 1.2 * DIAMETER, 0.25 * 0.2 * 1.2 * DIAMETER
    f = lift * rig.state.work.wake[:, :3] + drag * rig.state.work.wake[:, 3:]
    line = (1.0 - x)[:, None] * f[0] + x[:, None] * f[1]
    n = np.array([shape(xi) for xi in x])
    wanted = LENGTH * np.einsum("g,gi,gk->ik", w, n, line)
    wanted[[1, 3]] *= LENGTH
    np.testing.assert_allclose(rig.state.work.band[:, :, 12].reshape(4, 3), wanted, atol=1e-15)


def test_without_wind_what_rests_stays_at_rest():
    rig = rod(current=(0.0, 0.0), held="y")
    rig.run(1.0, 0.01)
    assert np.abs(rig.state.v).max() == 0.0 and np.array_equal(rig.state.q[:, 0], rig.arc)
    assert np.abs(rig.state.work.wake).max() == 0.0


def turning(rate) -> Rig:
    """A rod that turns at ``rate`` [rad/s] in the wind."""
    rig = rod(held="y")
    rig.state.v[:, 2], rig.state.v[:, 5] = rate * (rig.arc - 1.0), rate
    rig.balance()
    return rig


def test_a_refused_step_leaves_nothing_in_its_wake():
    """A rod that turns too far for one step: taken back to the bit; in halves it is two steps."""
    h, rate = 1e-3, 150.0
    turn = 0.75 * rate * h  # half a step turns it by 0.075, a whole one by 0.15
    halved, refused = turning(rate), turning(rate)
    before = refused.state.nodes[NOW].copy()
    with pytest.raises(RigError):
        refused.run(h, h, rules=StepRules(0, turn, NO_LIMIT))
    assert np.array_equal(refused.state.nodes[NOW, WAKE], before[WAKE])
    refused.run(h, 0.5 * h)
    assert list(halved.steps(h, rules=StepRules(4, turn, NO_LIMIT))) == [0.5 * h, 0.5 * h]
    assert np.array_equal(refused.state.nodes[NOW, WAKE], halved.state.nodes[NOW, WAKE])
    assert np.abs(halved.state.nodes[NOW, WAKE] - before[WAKE]).max() > 1e-3


def test_the_phases_of_the_start():
    def start(**wake):
        return rod(**wake).state.nodes[NOW, WAKE, :, :2]

    uniform, alternating, random = start(), start(phase="alternating"), start(phase="random", seed=3)
    assert np.array_equal(uniform, np.tile((0.1, 0.0), (ELEMENTS + 1, 1)))
    np.testing.assert_allclose(alternating[:, 0], 0.1 * (-1.0) ** np.arange(ELEMENTS + 1))
    np.testing.assert_allclose(np.hypot(*random.T), 0.1)
    assert np.array_equal(random, start(phase="random", seed=3)) and not np.array_equal(random, start(phase="random"))
    assert Wake().law is WakeLaw.OFF and np.abs(rod(law="off").state.nodes[NOW, WAKE]).max() == 0.0
