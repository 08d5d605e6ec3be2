"""What can be fed, and when it is sent."""

from types import SimpleNamespace

import numpy as np
import pytest

from cable_sim_ros import ShipMotion
from cable_sim_ros.errors import TowError
from cable_sim_ros.io.messages.messages import Event, decode_odometry, stamp_of
from cable_sim_ros.io.scenes.document import ResourceError
from cable_sim_ros.physics.ship import Ship
from cable_sim_ros.testing.feeder import Feeder, messages

SHIP = Ship(tow_speed=2.0)
S = 1_000_000_000
NAN = float("nan")
LEVEL = {"position": (0.0, 0.0, 0.0), "velocity": (2.0, 0.0, 0.0), "attitude": (0.0, 0.0, 0.0), "rate": (0.0, 0.0, 0.0)}
STILL = ShipMotion(time_ns=0, **LEVEL)


def test_a_part_of_a_bag_in_order_of_stamps():
    found = messages("nbp1406", SHIP, start=10.0, duration=1.0)
    assert [m.kind for m in found] == ["imu", "odometry"] * 51
    assert all(stamp_of(m.data) == m.stamp for m in found) and found[-1].stamp - found[0].stamp == S
    imu = messages("nbp1406", SHIP, duration=1.0, imu_only=True)
    assert {m.kind for m in imu} == {"imu"} and len(imu) == 51


def test_a_sine_is_that_sine():
    found = messages(None, SHIP, heave=(1.0, 8.0), duration=8.0)
    heights = np.array([decode_odometry(m.data).position[2] for m in found])
    assert heights.max() == pytest.approx(1.0, abs=1e-3) and np.diff([m.stamp for m in found]).max() == S // 50


def test_samples_and_a_table_are_the_motion_they_say(tmp_path):
    samples = [
        ShipMotion(time_ns=S + k * S // 100, position=(0.02 * k, 0, 0.1), velocity=(2.0, 0, 0), attitude=(0, 0, 0),
                   rate=(0, 0, 0.01)) for k in range(5)
    ]  # fmt: skip
    found = messages(samples, SHIP)
    last = decode_odometry(found[-1].data)
    assert last.stamp == samples[-1].time_ns and last.position == pytest.approx((0.08, 0.0, 0.1))
    assert last.velocity == pytest.approx((2.0, 0.0, 0.0)) and last.rate == pytest.approx((0.0, 0.0, 0.01))
    table = tmp_path / "heave.csv"
    table.write_text("time_s,heave_m\n" + "".join(f"{k / 50},{k / 100}\n" for k in range(6)))
    assert decode_odometry(messages(table, SHIP)[-1].data).position[2] == pytest.approx(0.05)


@pytest.mark.parametrize(
    "given, text",
    [
        ({}, "give one source of motion: a bag, a CSV file, samples, or heave="),
        ({"source": "nbp1406", "heave": (1.0, 8.0)}, "give one source of motion"),
        ({"heave": (1.0, 8.0)}, r"heave needs duration=\.\.\. in s: nothing was sent"),
        ({"source": []}, "no motion in the part asked for"),
        ({"source": [1, 2]}, r"source\[0\] = 1 is no ShipMotion: nothing was sent; give a sequence"),
        ({"source": 42}, "source = 42 is no motion: nothing was sent; give a bag or a CSV file"),
        ({"source": [STILL, STILL]}, r"source\[1\].time_ns = 0 ns is not behind that of the sample before: nothing"),
        ({"source": "no_such"}, "no_such: no such bag file; .* shipped one: lmg1903, nbp1406"),
        ({"source": "/no/such.csv"}, "/no/such.csv: no such file; .* Give the path of a CSV file"),
        ({"heave": 1.0, "duration": 5.0}, "heave = 1.0 is no pair of numbers: nothing was sent"),
        (
            {"heave": (-1.0, 8.0), "duration": 5.0},
            r"heave of -1 m in 8 s: the amplitude is outside .* Give heave=\(amplitude, period\) in m and s",
        ),
        ({"heave": (1.0, 8.0), "duration": 1e9}, "a duration of 1e[+]09 s is outside .* Give a shorter duration"),
        ({"heave": (1.0, 8.0), "duration": 0.0}, "duration = 0.0 is no finite number above 0 s: nothing was sent"),
        ({"source": "nbp1406", "duration": NAN}, "duration = nan is no finite number above 0 s: nothing was sent"),
        ({"source": "nbp1406", "duration": -1}, "duration = -1 is no finite number above 0 s: nothing was sent"),
        ({"source": "nbp1406", "start": -1}, "start = -1 is no finite number from 0 s: nothing was sent; leave it out"),
        (
            {"source": "nbp1406", "start": 1e5},
            r"no motion in the part asked for \(from 100000 s on\): nothing was sent",
        ),
    ],
)
def test_what_cannot_be_fed_is_said(given, text):
    with pytest.raises(TowError, match=text):
        messages(given.pop("source", None), SHIP, **given)


def test_what_the_package_says_is_the_cause_of_what_is_said():
    with pytest.raises(TowError) as caught:
        messages("no_such", SHIP)
    assert isinstance(caught.value.__cause__, ResourceError)


def test_samples_may_begin_at_zero():
    assert [m.stamp for m in messages([STILL, ShipMotion(time_ns=S, **LEVEL)], SHIP)] == [0, S]


def test_a_message_moved_in_time_has_its_new_stamp():
    first = messages(None, SHIP, heave=(1.0, 8.0), duration=1.0)[0]
    moved = first.moved(5 * S + 7)
    assert moved.stamp == stamp_of(moved.data) == first.stamp + 5 * S + 7
    assert moved.data[12:] == first.data[12:] and moved.kind == first.kind


def test_in_lockstep_nothing_is_sent_before_the_clock_comes_to_it():
    sent = []
    feeder = Feeder(sent.append, lockstep=True)
    data = bytes([0, 1, 0, 0]) + bytes(8)
    try:
        assert feeder.add([Event(50 + k, 0, "imu", data) for k in range(4)], first=10) == 10
        assert feeder.add([Event(7, 0, "imu", data)], first=10) > 13, "behind what is queued"
        for now, count in ((9, 0), (11, 2), (13, 4)):
            feeder.clock(now)
            assert [message.stamp for message in sent] == list(range(10, 10 + count))
        assert feeder.waiting == 1
    finally:
        feeder.close()


def test_motion_may_be_sent_ahead_of_the_clock_but_nothing_past_a_command():
    sent = []
    feeder = Feeder(sent.append, lockstep=True)
    kinds = ("imu", "imu", "command", "imu")
    feeder.add([Event(10 * k, 0, kind, bytes([0, 1, 0, 0]) + bytes(8)) for k, kind in enumerate(kinds)], first=0)
    feeder.clock(0, ahead=30)
    assert [message.kind for message in sent] == ["imu", "imu"], "a command ahead of the clock would be refused"
    feeder.clock(20, ahead=30)
    assert [message.stamp for message in sent] == [0, 10, 20, 30] and feeder.sent == 4
    feeder.close()


def test_what_cannot_be_sent_is_kept_as_the_failure_and_the_rest_not_sent():
    tried = []

    def fail(message):
        tried.append(message.stamp)
        raise RuntimeError("no network")

    feeder = Feeder(fail, lockstep=True)
    feeder.add([Event(k, 0, "imu", bytes([0, 1, 0, 0]) + bytes(8)) for k in range(3)], first=0)
    feeder.clock(1)
    feeder.clock(2)
    assert tried == [0] and str(feeder.failure) == "no network"
    feeder.close()


@pytest.mark.parametrize("subscribers, sent", [(1, 7), (2, 3)], ids=["the node alone", "a controller too"])
def test_within_a_step_motion_is_ahead_of_the_clock_where_nobody_would_know_what_is_to_come(subscribers, sent):
    pytest.importorskip("rclpy")
    from cable_sim_ros.testing.node_topics import EARLY, Link

    heard, tick = [], EARLY // 4
    link = Link.__new__(Link)
    link.feeder, link.client = Feeder(heard.append, lockstep=True), SimpleNamespace(prompt=True)
    publisher = SimpleNamespace(get_subscription_count=lambda: subscribers)
    link._publishers, link._until = {"imu": publisher, "odometry": publisher}, 0
    link.feeder.add([Event(k * tick, 0, "imu", bytes([0, 1, 0, 0]) + bytes(8)) for k in range(20)], first=0)
    link.now = tick
    link._feed_on()
    assert len(heard) == 2 and link.client.prompt, "between two steps"
    link.now, link._until = 2 * tick, 10 * tick
    link._feed_on()
    assert len(heard) == sent and link.client.prompt == (subscribers > 1)
    link.now = 10 * tick
    link._feed_on()
    assert len(heard) == 11 and link.client.prompt, "at the end of the step"
    link.feeder.close()
