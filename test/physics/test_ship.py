"""Ship motion: hull points against differences and rotations, C1 interpolation, staleness, changed and late sources."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cable_sim_ros.physics.inputs import make_inputs, push_motion
from cable_sim_ros.physics.ship import (
    MOTION,
    NO_EPOCH,
    SHIP_TIMES,
    evaluate,
    follow,
    hull_point,
    quaternion,
    rotate,
    ship_ring,
    unrotate,
)
from cable_sim_ros.physics.state import MEMORY, records
from cable_sim_ros.sim.loop import look

pytestmark = pytest.mark.check

ARM = (-36.8, 0.4, 3.7)
AMPLITUDE = np.array([0.8, 0.5, 1.5, 0.21, 0.087, 0.052])
OMEGA = np.array([0.55, 0.43, 0.62, 0.5, 0.6, 0.2])
PHASE = np.array([0.2, 1.1, 0.0, 0.7, 1.9, 0.4])


def motion(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Six harmonics: coordinates, rates, accelerations."""
    a = OMEGA * t + PHASE
    return AMPLITUDE * np.sin(a), AMPLITUDE * OMEGA * np.cos(a), -AMPLITUDE * OMEGA**2 * np.sin(a)


def sheave(t: float, slide: float):
    """Hull point that slides along x of base_link at ``slide`` m/s."""
    now = records(1, MOTION)[0]
    now.coord[:], now.rate[:], now.accel[:] = motion(t)
    return hull_point(now, (ARM[0] + slide * t, ARM[1], ARM[2]), (slide, 0.0, 0.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("t", [3.0, 17.5])
@pytest.mark.parametrize("slide", [0.0, 1.3])
def test_hull_point_against_rotation_and_differences(t, slide):
    c, _, _ = motion(t)
    turn = Rotation.from_euler("ZYX", c[[5, 4, 3]])
    p, v, a = (np.array(x) for x in sheave(t, slide))
    np.testing.assert_allclose(p, c[:3] + turn.apply((ARM[0] + slide * t, ARM[1], ARM[2])), atol=1e-12)
    h = 1e-4
    before, after = (np.array(sheave(t + s, slide)[0]) for s in (-h, h))
    np.testing.assert_allclose(v, (after - before) / (2 * h), atol=1e-6)
    before, after = (np.array(sheave(t + s, slide)[1]) for s in (-h, h))
    np.testing.assert_allclose(a, (after - before) / (2 * h), atol=1e-6)
    got = np.array(quaternion(c))
    assert abs(abs(got @ turn.as_quat()) - 1.0) < 1e-12


@given(st.tuples(*[st.floats(-3, 3)] * 6), st.tuples(*[st.floats(-50, 50)] * 3))
@settings(max_examples=50)
def test_rotation_there_and_back(c, s):
    np.testing.assert_allclose(unrotate(np.array(c), rotate(np.array(c), s)), s, atol=1e-12)


class Ship:
    """A ship that is ticked every 10 ms, with a tow frame at rest in the origin."""

    def __init__(self, start_blend=1.0, samples=0):
        """With so many samples of its motion pushed at 50 Hz."""
        self.inputs, self.memory, self.times = make_inputs(), records(1, MEMORY)[0], records(1, SHIP_TIMES)[0]
        self.memory.ship.epoch = NO_EPOCH
        self.times.stale_decay, self.times.start_blend, self.times.source_blend = 3.0, start_blend, 0.5
        for k in range(samples):
            self.push(0.02 * k)

    def push(self, t: float, epoch: float = 1.0, shift: float = 0.0) -> None:
        c, d, _ = motion(t)
        push_motion(self.inputs, round(t * 1e9), [c[0] + shift, *c[1:], *d, epoch, 1.0])
        look(self.inputs)

    def tick(self) -> np.ndarray:
        now = self.memory.time
        end = now.now + 10_000_000
        ring, ship = ship_ring(self.inputs), self.memory.ship
        follow(now.now, end, ring, ship, self.memory, self.times)
        evaluate(end, ring, ship, self.memory, self.times.stale_decay)
        now.now = end
        return np.concatenate((ship.motion.coord, ship.motion.rate))

    def ticks(self, count: int) -> np.ndarray:
        """Rows of coordinates and rates after each of so many ticks."""
        return np.array([self.tick() for _ in range(count)])


def smooth(rows: np.ndarray) -> float:
    """Largest mismatch between the step of the coordinates and the mean of their rates: C1 means of order dt^2."""
    step = np.diff(rows[:, :6], axis=0)
    return float(np.abs(step - 0.005 * (rows[1:, 6:] + rows[:-1, 6:])).max())


def test_interpolation_between_samples_is_exact_to_fourth_order_and_c1():
    rows = Ship(start_blend=0.1, samples=60).ticks(100)
    for k in (30, 55, 99):
        np.testing.assert_allclose(rows[k, :6], motion(0.01 * (k + 1))[0], atol=1e-9)
        np.testing.assert_allclose(rows[k, 6:], motion(0.01 * (k + 1))[1], atol=1e-6)
    assert smooth(rows[12:]) < 2e-4  # after the short start blend


def test_start_is_taken_up_without_a_step():
    rows = Ship(samples=150).ticks(200)
    assert np.abs(rows[0, :6]).max() < 2e-3 and np.abs(rows[0, 6:]).max() < 0.1, "begins on the mean track, at rest"
    np.testing.assert_allclose(rows[-1, :6], motion(2.0)[0], atol=1e-9)
    assert smooth(rows) < 1e-3


def test_after_the_last_sample_the_ship_comes_to_its_mean():
    rows = Ship(start_blend=0.1, samples=60).ticks(3300)
    assert smooth(rows[12:]) < 2e-4  # after the short start blend
    assert np.abs(rows[-1, 2:5]).max() < 1e-3, "heave, roll and pitch have died out"
    assert np.abs(rows[-1, 8:]).max() < 1e-3
    assert np.isfinite(rows).all()


@pytest.mark.parametrize("cut, speed", [(24.0, (3.0, -1.0)), (27.0, (0.0, 0.0)), (30.0, (3.0, -1.0))])
def test_stale_motion_goes_on_at_the_mean_speed_and_does_not_drift(speed, cut):
    """Only what the waves add dies out: it was the whole speed, which carried the ship v T / e off and back again."""
    ship = Ship(start_blend=0.1)

    def true(t):
        c, d, _ = motion(t)
        return np.array([*(c[:2] + np.multiply(speed, t)), *c[2:]]), np.array([*(d[:2] + speed), *d[3 - 1 :]])

    for k in range(round(50 * cut) + 1):
        c, d = true(0.02 * k)
        push_motion(ship.inputs, round(0.02 * k * 1e9), [*c, *d, 1.0, 1.0])
        look(ship.inputs)
        if k > 2:
            ship.tick(), ship.tick()
    wave = AMPLITUDE[:2] * OMEGA[:2]  # m/s
    begin = ship.memory.time.now * 1e-9
    rows = ship.ticks(1200)
    end = true(cut)[0][:2]
    tau = 0.01 * np.arange(1, 1201)[:, None] - (cut - begin)
    assert np.abs(rows[:, 6:8] - speed).max(axis=0) == pytest.approx(0.0, abs=1.15 * wave.max())
    late = rows[600:, 6:8]
    assert np.abs(late - speed).max() < 0.1, "the mean speed goes on"
    assert np.abs(rows[:, :2] - end - np.multiply(speed, tau)).max() < 1.2 * wave.max() * 3.0 / np.e + 0.1 * 12
    assert smooth(rows) < 2e-4


@pytest.mark.parametrize("gap", [0.05, 0.2, 0.4, 1.0])
def test_late_samples_make_no_jump(gap):
    """The stream stalls, the ticks go on, then all samples come at once: no step, and back on the motion afterwards."""
    ship = Ship(start_blend=0.1, samples=101)
    before = ship.ticks(200 + round(gap * 100))
    for k in range(101, 300):
        ship.push(0.02 * k)
    rows = np.concatenate((before, ship.ticks(200)))
    assert smooth(rows) < 1e-3
    now = 0.01 * len(rows)
    np.testing.assert_allclose(rows[-1, :6], motion(now)[0], atol=1e-9)


def test_a_changed_source_is_taken_up_smoothly():
    ship = Ship(start_blend=0.1)
    for k in range(100):
        ship.push(0.02 * k, epoch=1.0 if k < 50 else 2.0, shift=0.0 if k < 50 else 0.3)
    rows = ship.ticks(190)
    assert smooth(rows) < 1e-3
    assert rows[-1, 0] == pytest.approx(motion(1.9)[0][0] + 0.3, abs=1e-9)


@pytest.mark.parametrize(
    "sample, time, text",
    [
        ([np.nan] + [0.0] * 13, 10, "14 finite numbers"),
        ([0.0] * 13, 10, "14 finite numbers"),
        ([0.0] * 14, 5, "does not advance past 5 ns"),
    ],
)
def test_bad_samples_are_refused(sample, time, text):
    inputs = make_inputs()
    push_motion(inputs, 5, [0.0] * 14)
    with pytest.raises(ValueError, match=text):
        push_motion(inputs, time, sample)
    assert inputs.motion_head[0] == 1
