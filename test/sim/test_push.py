"""Ship motion and winch commands by name: what reaches the rings, and every refusal."""

from math import nan, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cable_sim_ros.physics.inputs import COMMAND_ROWS, EPOCH, MOTION_ROWS, SOURCE, make_inputs
from cable_sim_ros.physics.ship import MOTION, quaternion, spin
from cable_sim_ros.physics.state import records
from cable_sim_ros.physics.tick_output import Source
from cable_sim_ros.sim.inputs import InputError, ShipMotion, WinchCommand, push
from cable_sim_ros.sim.tables.attitude import angle_rates, angles_of, body_rates, to_world

pytestmark = pytest.mark.trust

STILL = {"position": (0, 0, 0), "velocity": (0, 0, 0), "rate": (0, 0, 0), "attitude": (0, 0, 0)}
GAP = 1.5  # s
angle = st.floats(-1.2, 1.2)


def moved(time_ns=0, **values):
    return ShipMotion(time_ns=time_ns, **(STILL | values))


@given(st.tuples(angle, angle, st.floats(-3.0, 3.0)), st.tuples(angle, angle, angle))
def test_body_rates_become_the_rates_that_the_kernels_turn_by(angles, rate):
    rates = angle_rates(*angles[:2], rate)
    motion = records(1, MOTION)[0]
    motion.coord[3:], motion.rate[3:] = angles, rates
    omega, _ = spin(motion)
    assert omega == pytest.approx(to_world(angles, rate), abs=1e-9)
    assert body_rates(*angles[:2], rates) == pytest.approx(rate, abs=1e-9)
    assert angles_of(*quaternion((0.0, 0.0, 0.0, *angles))) == pytest.approx(angles, abs=1e-9)


def test_a_sample_becomes_the_fourteen_numbers():
    inputs, angles, rate = make_inputs(), (0.1, -0.2, 0.3), (0.01, 0.02, 0.03)
    push(inputs, moved(5, position=(1, 2, 3), velocity=[4, 5, 6], attitude=angles, rate=np.array(rate)), 0, GAP)
    turned = quaternion((0.0, 0.0, 0.0, *angles))
    push(inputs, ShipMotion(time_ns=9, quaternion=turned, position=(1, 2, 3), velocity=(4, 5, 6), rate=rate), 0, GAP)
    assert inputs.motion_time[:3].tolist() == [5, 9, 0] and inputs.motion_head[0] == 2
    row = (1, 2, 3, *angles, 4, 5, 6, *angle_rates(0.1, -0.2, rate), 1.0, float(Source.ODOMETRY))
    assert inputs.motion[0] == pytest.approx(row) and inputs.motion[1] == pytest.approx(row)


def test_yaw_goes_on_over_the_half_turn():
    inputs = make_inputs()
    for k, yaw in enumerate((3.1, -3.1, 3.1 + 4 * pi)):
        push(inputs, moved(k, attitude=(0, 0, yaw)), 0, GAP)
    assert inputs.motion[:3, 5] == pytest.approx((3.1, 2 * pi - 3.1, 3.1))


def test_jumps_begin_a_new_epoch():
    inputs, second = make_inputs(), 10**9
    for item in (
        moved(0),
        moved(second),
        moved(3 * second),  # gap
        moved(4 * second, jump=True),
        moved(5 * second, source=Source.IMU),
        moved(6 * second, source=Source.IMU),
    ):
        push(inputs, item, 0, GAP)
    assert inputs.motion[:6, EPOCH].tolist() == [1, 1, 2, 3, 4, 4]
    assert inputs.motion[:6, SOURCE].tolist() == [1, 1, 1, 1, 2, 2]


def test_commands_hold_from_now_or_from_their_time():
    inputs = make_inputs()
    push(inputs, WinchCommand(rate=0.5), 7, GAP)
    push(inputs, WinchCommand(payout=np.float64(2.0)), 7, GAP)
    push(inputs, WinchCommand(payout=1.0, rate=-0.5, time_ns=20), 7, GAP)
    assert inputs.command_time[:3].tolist() == [7, 8, 20]
    assert np.array_equal(inputs.command[:3], [(nan, 0.5), (2.0, nan), (1.0, -0.5)], equal_nan=True)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"time_ns": 0.5}, r"ShipMotion.time_ns = 0.5 is no whole number of nanoseconds in \[0, 2\^63\): nothing was "),
        ({"time_ns": -1}, "ShipMotion.time_ns = -1 is no whole number of nanoseconds"),
        ({"time_ns": True}, "ShipMotion.time_ns = True is no whole number"),
        ({"position": (0, 0)}, r"ShipMotion.position = \(0, 0\) is not 3 numbers in m: .* position=\(0.0, 0.0, 0.0\)"),
        ({"position": 1.0}, "ShipMotion.position = 1.0 is not 3 numbers in m"),
        ({"position": "abc"}, "ShipMotion.position = 'abc' is not 3 numbers in m"),
        ({"position": (0, nan, 0)}, r"ShipMotion.position\[1\] = nan m is not a number: .* in \[-1e\+07, 1e\+07\] m"),
        ({"position": (0, "1", 0)}, r"ShipMotion.position\[1\] = '1' m is not a number"),
        ({"position": (0, 0, -2e7)}, r"ShipMotion.position\[2\] = -2e\+07 m is outside \[-1e\+07, 1e\+07\] m"),
        ({"velocity": (float("inf"), 0, 0)}, r"ShipMotion.velocity\[0\] = inf m/s is infinite"),
        ({"velocity": (51, 0, 0)}, r"velocity\[0\] = 51 m/s is outside \[-50, 50\] m/s: .* Check its unit and axes"),
        ({"rate": (0, 6, 0)}, r"ShipMotion.rate\[1\] = 6 rad/s is outside \[-5, 5\] rad/s"),
        ({"attitude": (0, 1.5, 0)}, r"ShipMotion.attitude\[1\] = 1.5 rad is outside \[-1.396, 1.396\] rad"),
        ({"attitude": None}, "attitude = None and quaternion = None: exactly one of them is needed; nothing was push"),
        ({"quaternion": (0, 0, 0, 1)}, r"attitude = \(0, 0, 0\) and quaternion = \(0, 0, 0, 1\): exactly one"),
        ({"attitude": None, "quaternion": (0, 0, 0, 0.9)}, "has the norm 0.9, allowed 1 [+]- 0.01: .* w last"),
        ({"attitude": None, "quaternion": (0, 0.7071, 0, 0.7071)}, "is a pitch of 1.571 rad, outside"),
        ({"source": 3}, "ShipMotion.source = 3 is neither Source.ODOMETRY nor Source.IMU: nothing was pushed"),
    ],
)
def test_a_sample_that_cannot_be_is_refused_when_it_is_made(values, text):
    with pytest.raises(InputError, match=text):
        moved(**values)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({}, "WinchCommand has neither payout nor rate: nothing was pushed. .* rate=0.0 stops the winch"),
        ({"payout": nan}, r"WinchCommand.payout = nan m is not a number: .* in \[-1e\+05, 1e\+05\] m"),
        ({"rate": 2e5}, r"WinchCommand.rate = 200000 m/s is outside \[-1e\+05, 1e\+05\] m/s"),
        ({"rate": 1.0, "time_ns": "now"}, "WinchCommand.time_ns = 'now' is no whole number of nanoseconds"),
    ],
)
def test_a_command_that_cannot_be_is_refused_when_it_is_made(values, text):
    with pytest.raises(InputError, match=text):
        WinchCommand(**values)


def test_stamps_must_advance():
    inputs = make_inputs()
    push(inputs, moved(5), 0, GAP)
    with pytest.raises(InputError, match="ShipMotion.time_ns = 5 ns is not after the newest one, 5 ns: nothing was"):
        push(inputs, moved(5), 0, GAP)
    push(inputs, WinchCommand(rate=0.0, time_ns=5), 0, GAP)
    with pytest.raises(InputError, match="WinchCommand.time_ns = 4 ns is not after the newest one, 5 ns"):
        push(inputs, WinchCommand(rate=0.0, time_ns=4), 0, GAP)


@pytest.mark.parametrize(
    ("make", "rows", "what"),
    [(moved, MOTION_ROWS, "samples"), (lambda k: WinchCommand(rate=0.0, time_ns=k), COMMAND_ROWS, "commands")],
)
def test_a_ring_is_never_overrun(make, rows, what):
    inputs = make_inputs()
    for k in range(rows - 16):
        push(inputs, make(k + 1), 0, GAP)
    with pytest.raises(InputError, match=rf"{rows - 16} {what} lie ahead of the simulation at 0 ns already.* Tick in"):
        push(inputs, make(rows), 0, GAP)
    push(inputs, make(rows), 1, GAP)  # the first one is past


def test_anything_else_is_no_input():
    with pytest.raises(TypeError, match="'up' is a str: push a ShipMotion, VehicleMotion, WinchCommand or FlapCommand"):
        push(make_inputs(), "up", 0, GAP)
