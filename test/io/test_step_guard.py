"""A good stream that turns wrong under way: not one message of the fault may shake the ship, and good data passes."""

from dataclasses import replace

import numpy as np
import pytest
from test_drop_outs import HEADING, Ship
from test_motion import BAGS
from test_plausible import IMU, ODOMETRY, events, watched
from true_ship import sail, world

from cable_sim_ros.io.plausibility.plausibility import HeightGuard, RateGuard
from cable_sim_ros.io.sources.recorded_tow import read_motion

BEGIN, END = 12.0, 13.5  # s of the fault

# name: topic, what turns wrong, causes that it may be refused for
FAULTS = {
    "knots": ("odometry", ODOMETRY["knots"][0], {"velocity_misfit", "velocity_knots"}),
    "km/h": ("odometry", ODOMETRY["km/h"][0], {"velocity_misfit", "velocity_kmh", "velocity_knots"}),
    "twist in the world": (
        "odometry",
        lambda m: replace(m, velocity=world(m, m.velocity)),
        {"velocity_misfit", "velocity_world"},
    ),
    "rates deg/s": ("odometry", ODOMETRY["rates deg/s"][0], {"rate_misfit", "rate_degrees"}),
    "NED rates": ("odometry", ODOMETRY["NED rates"][0], {"rate_misfit", "rate_ned"}),
    "z + 3 m": ("odometry", ODOMETRY["z + 3 m"][0], {"height_step"}),
    "IMU rates deg/s": ("imu", IMU["rates deg/s"][0], {"rate_misfit", "rate_degrees"}),
}


def turning_wrong(name, beside, begin=BEGIN, **ship):
    """Events of 17 s with the fault from BEGIN to END, of the topic alone or beside the other, good one."""
    topic, fault, _ = FAULTS[name]
    m = sail(17.0, heading=HEADING, begin=begin - BEGIN, **ship)
    late, wrong = (m.t - m.t[0] >= BEGIN) & (m.t - m.t[0] < END), fault(m)
    sent = replace(
        m, **{k: np.where(late[:, None], getattr(wrong, k), getattr(m, k)) for k in ("position", "velocity", "rate")}
    )
    other = m if beside else None
    return events(other, sent) if topic == "odometry" else events(sent, other)


def towed(found):
    """Rows of the interpolated ship motion, 19 columns, and the ingest; times from the first event."""
    ship = Ship()
    for stamp, kind, data in found:
        ship.it.take(kind, data, stamp)
        ship.until(stamp)
    return np.array(ship.rows), ship.it


@pytest.mark.parametrize("beside", [pytest.param(False, marks=pytest.mark.nightly), True])
@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_under_way_does_not_shake_the_ship(name, beside):
    """Before: up to some 600 m/s^2 and 100 rad/s^2 until it was named."""
    rows, it = towed(turning_wrong(name, beside))
    t, accel = rows[:, 0], np.abs(rows[:, 13:19])
    usual = accel[(t > 8.0) & (t < BEGIN)]
    for part in (slice(0, 3), slice(3, 6)):
        assert accel[t >= BEGIN - 0.1, part].max() < 3.0 * usual[:, part].max()
    counted = {cause for cause, n in it.counts.items() if n} - {"source_change", "gap", "behind", "imu_gap"}
    assert counted and counted <= FAULTS[name][2] and it.source.name == ("IMU" if name == "IMU rates deg/s" and not
        beside else "ODOMETRY")  # fmt: skip


@pytest.mark.parametrize("name", ["knots", "rates deg/s", "z + 3 m", "IMU rates deg/s"])
def test_the_first_wrong_message_is_refused(name):
    found = turning_wrong(name, False)
    before = watched(found[: round(BEGIN * 50)])
    refused, _ = watched(found[: round(BEGIN * 50) + 1])
    assert before == ([], []) and len(refused) == 1 and refused[0] in FAULTS[name][2]


def test_a_single_wrong_message_costs_a_tenth_of_a_second():
    m = sail(10.0)
    velocity = m.velocity.copy()
    velocity[250] += 2.0
    refused, said = watched(events(None, replace(m, velocity=velocity)))
    assert set(refused) == {"velocity_misfit"} and len(refused) <= 7 and said == []


def test_a_step_that_stays_is_the_streams_new_way():
    """A bias of 1 m/s, a datum 1.5 m higher, both from 10 s on: refused for a while, then used."""
    m, guard, height = sail(40.0, speed=0.0), RateGuard(0.2, 1.0), HeightGuard(1.0)
    late, speed = m.t > 10.0, world(m, m.velocity)
    biased, higher = speed + late[:, None] * [0, 1.0, 0], m.position[:, 2] + 1.5 * late
    refused = [guard.take(tuple(x), tuple(v), 0.02) for x, v in zip(m.position, biased)]
    assert not any(refused[:501]) and all(refused[501:749]) and not any(refused[752:])
    refused = [height.take(z, v, 0.02) for z, v in zip(higher, speed[:, 2])]
    assert refused[501] and sum(refused) <= 1001 and not any(refused[:501]) and not any(refused[1503:])


@pytest.mark.parametrize("hertz", [1.0, 2.0, 5.0, 10.0, 50.0, 200.0])
@pytest.mark.parametrize("noise", [0.0, 0.02, 0.5])
def test_noisy_positions_and_low_rates_are_not_refused(hertz, noise):
    """noise: of the position, m (coarse GNSS)."""
    random, m = np.random.default_rng(8), sail(max(20.0, min(60.0, 60.0 / hertz)), hertz, sea=2.0)
    position = m.position + noise * random.standard_normal(m.position.shape)
    velocity = m.velocity + 0.05 * (noise > 0.0) * random.standard_normal(m.velocity.shape)
    assert watched(events(None, replace(m, position=position, velocity=velocity)))[0] == []


@pytest.mark.parametrize("change", [0.5, 3.0])
@pytest.mark.parametrize("within, maximum", [(0.0, 6), (0.2, 0)])
def test_a_blow_that_the_position_follows_is_used(change, within, maximum):
    """m/s lost in a collision within 0.2 s, or from one sample to the next, which takes 0.1 s to believe."""
    m, random = sail(20.0), np.random.default_rng(9)
    lost = np.clip((m.t - 10.0) / within, 0.0, 1.0) if within else 1.0 * (m.t > 10.0)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (lost[1:] + lost[:-1]) if within else lost[1:])]) / 50.0
    blow = -change * np.array([0.8, 0.6, 0.0])
    velocity = m.velocity + np.einsum("nji,nj->ni", m.turn, lost[:, None] * blow)
    position = m.position + way[:, None] * blow + 1e-4 * random.standard_normal(m.position.shape)
    refused, said = watched(events(None, replace(m, position=position, velocity=velocity)))
    assert len(refused) <= maximum and said == []


WHOLE = [pytest.param(name, None, marks=pytest.mark.nightly) for name in ("nbp1406", "lmg1903")]


@pytest.mark.parametrize("name, first", [("nbp1406", 8_000), *WHOLE])
def test_the_shipped_bags_are_not_refused(name, first):
    assert watched(list(read_motion(BAGS / name))[:first]) == ([], [])
