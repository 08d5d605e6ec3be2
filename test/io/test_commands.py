"""Winch commands into Inputs: they count from arrival, are refused by cause, and a bag decides as a topic does."""

import os
import shutil
from math import inf, nan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.rosbag2 import StoragePlugin, Writer
from test_motion import STEP, T0, S, imu, odometry, serialized

from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.messages.cdr import JointState, header
from cable_sim_ros.io.messages.commands import CommandIngest
from cable_sim_ros.io.messages.messages import (
    CAUSES,
    KINDS,
    Event,
    Refused,
    decode_command,
    decode_imu,
    decode_odometry,
    stamp_of,
)
from cable_sim_ros.io.motion.arrival_order import DataClock, Stamp
from cable_sim_ros.io.motion.motion import MotionIngest
from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.sources.recorded_tow import Feeder, RecordedTow, read_tow
from cable_sim_ros.physics.heave_filter import Heave
from cable_sim_ros.physics.inputs import COMMAND_ROWS, make_inputs
from cable_sim_ros.physics.ship import Ship
from cable_sim_ros.physics.state import records
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.winch import DRUM, WINCH
from cable_sim_ros.physics.winch_command import command as carry

pytestmark = pytest.mark.check

NOW = T0 + 100 * S


class Scene:
    """What a Feeder asks of a scene."""

    ship, gravity = Ship(), 9.81
    towbody, bodies = Towbody(mass=1.0, net_weight=1.0), {}


def command(stamp, position=(), velocity=(), names=("payout",), effort=(), frame="", little_endian=True):
    """CDR bytes of a JointState."""
    arrays = (np.array(values, float) for values in (position, velocity, effort))
    return serialized(JointState(header(stamp, frame), list(names), *arrays), little_endian)


def pushed(inputs, since=0):
    """Commands in the ring: (stamp, pay-out, rate)."""
    return [
        (int(inputs.command_time[i]), *inputs.command[i].tolist()) for i in range(since, int(inputs.command_head[0]))
    ]


# decoding


@given(
    st.floats(-1e5, 1e5),
    st.floats(-1e5, 1e5),
    st.lists(st.text("abp_", max_size=9), max_size=4),
    st.integers(0, 4),
    st.integers(0, 7),
    st.text("abc_/", max_size=9),
    st.booleans(),
)
def test_numbers_come_out_of_any_layout(payout, rate, others, place, given_arrays, frame, little_endian):
    names = [*others[:place], "payout", *others[place:]]
    index = names.index("payout")
    arrays = [[9.0] * len(names) if given_arrays & (1 << k) else [] for k in range(3)]
    for array, value in zip(arrays, (payout, rate)):
        array[index : index + 1] = [value] if array else []
    data = command(T0, arrays[0], arrays[1], names, arrays[2], frame, little_endian)
    if given_arrays == 4:
        with pytest.raises(Refused, match="only effort is a number"):
            decode_command(data)
        return
    wanted = T0, payout if arrays[0] else nan, rate if arrays[1] else nan
    for padding in (b"", bytes(8)):  # as rclpy leaves it
        assert np.array_equal(decode_command(data + padding), wanted, equal_nan=True)


def test_what_rclpy_serializes_is_read():
    pytest.importorskip("rclpy")
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import JointState

    for position, velocity, effort in (([1.5], [], []), ([], [-0.5], []), ([1.5], [-0.5], [7.0]), ([], [-0.5], [7.0])):
        message = JointState(name=["payout"], position=position, velocity=velocity, effort=effort)
        message.header.stamp.sec = 5
        wanted = 5 * S, position[0] if position else nan, velocity[0] if velocity else nan
        assert np.array_equal(decode_command(serialize_message(message)), wanted, equal_nan=True)


@pytest.mark.parametrize("decode", [decode_command, decode_imu, decode_odometry])
@given(data=st.data())
def test_random_bytes_are_refused_and_nothing_else_is_raised(decode, data):
    start = data.draw(st.sampled_from([b"", b"\0\1\0\0", b"\0\0\0\0", command(NOW, [1.0], [2.0], ["a", "payout"])]))
    cut = data.draw(st.integers(0, len(start)))
    raw = start[:cut] + data.draw(st.binary(max_size=200))
    try:
        decode(raw)
    except Refused as refusal:
        assert CAUSES[refusal.cause]


def test_a_message_without_room_for_a_stamp_has_none():
    assert stamp_of(imu(T0)[:11]) is None and stamp_of(imu(T0)[:12]) == T0
    assert stamp_of(imu(T0, little_endian=False)) == T0


# refusals: cause -> bytes that come at NOW

BAD = [
    ("size", b""),
    ("size", command(NOW, [1.0])[:-1]),
    ("size", imu(NOW)[:40]),
    ("encoding", b"\0\7" + command(NOW, [1.0])[2:]),
    ("joint_name", command(NOW, [1.0], names=["drum"])),
    ("joint_name", command(NOW, [1.0, 1.0], names=["payout", "payout"])),
    ("joint_name", command(NOW, names=[])),
    ("array_length", command(NOW, [1.0, 2.0])),
    ("array_length", command(NOW, [1.0], [1.0], names=["payout", "brake"])),
    ("array_length", command(NOW, [1.0], [1.0, 2.0])),
    ("not_finite", command(NOW, [inf])),
    ("not_finite", command(NOW, [1.0], [-inf])),
    ("array_length", command(NOW, [], [1.0], names=["payout", "crane"])),
    ("array_length", command(NOW, [1.0], [2.0], names=["payout", "crane"])),
    ("array_length", command(NOW, [], [1.0], names=["payout", "drum", "crane"])),
    ("effort_only", command(NOW, effort=[1.0])),
    ("effort_only", command(NOW, [nan], [nan], effort=[1.0])),
    ("effort_only", command(NOW, [nan], [], effort=[5.0, nan], names=["payout", "drum"])),
    ("out_of_range", command(NOW, [1.1e5])),
    ("out_of_range", command(NOW, [1.0], [-1e6])),
]


def prepared():
    """An ingest that has taken a command which came at NOW - 1."""
    it = CommandIngest(make_inputs())
    assert it.take(command(NOW - 1, [7.0]), 0, NOW - 1) == ""
    return it


@pytest.mark.parametrize("cause, data", BAD)
def test_a_bad_command_is_refused_and_counted_by_cause(cause, data):
    it = prepared()
    assert it.take(data, 5, NOW) == cause
    assert dict(it.refused) == {cause: 1} and it.accepted == 1 and it.last_arrival == 0
    assert pushed(it.inputs) == [(NOW - 1, 7.0, pytest.approx(nan, nan_ok=True))]
    assert it.take(command(NOW, velocity=[0.5]), 6, NOW) == ""  # and the next good one is taken
    assert it.last_arrival == 6 and pushed(it.inputs)[1] == (NOW, pytest.approx(nan, nan_ok=True), 0.5)


def test_before_the_first_motion_a_command_has_no_time():
    it = CommandIngest(make_inputs())
    assert it.take(command(NOW, [1.0]), 5, None) == "before_motion"
    assert it.take(command(NOW, [nan]), 5, None) == "", "nothing is commanded, so nothing is refused"
    assert dict(it.refused) == {"before_motion": 1} and it.no_command == 1 and it.inputs.command_head[0] == 0


def test_every_cause_of_a_command_has_a_test_and_a_text():
    causes = {cause for cause, _ in BAD} | {"before_motion"}
    assert {"size", "encoding", "joint_name", "array_length", "effort_only", "out_of_range"} <= causes
    assert all("dropped" in CAUSES[cause] for cause in causes)
    assert "100000 m or m/s" in CAUSES["out_of_range"] and "80 deg pitch" in CAUSES["out_of_range"]


# stamps decide nothing


def commanded(stamps_off, arrivals, payload=lambda k: {"velocity": [0.001 * k]}):
    """The ingest, and what came into the ring, of commands that arrive at ``arrivals`` with stamps so much off."""
    it = CommandIngest(make_inputs())
    for k, (off, arrival) in enumerate(zip(stamps_off, arrivals)):
        assert it.take(command(max(arrival + off, 0), **payload(k)), arrival, arrival) == ""
    return it, pushed(it.inputs)


@pytest.mark.parametrize("off", [0, 0.4, -0.4, 0.9, -0.9, 1.0, -1.0, 5.0, -5.0, 3600.0, -3600.0, -NOW / S])
def test_a_command_counts_from_its_arrival_whatever_its_stamp(off):
    it, ring = commanded([round(off * S)] * 3, [NOW, NOW + S // 10, NOW + S // 5])
    assert [row[0] for row in ring] == [NOW, NOW + S // 10, NOW + S // 5] and it.accepted == 3 and not it.refused


def test_one_stamp_ahead_locks_nothing_out_and_a_stop_stops():
    """0.9 s ahead, then 49 others at 50 Hz, the last a stop: all act when they come."""
    arrivals = [NOW + k * S // 50 for k in range(50)]
    it, ring = commanded([9 * S // 10] + [0] * 49, arrivals, lambda k: {"velocity": [0.0 if k == 49 else 0.5]})
    assert [row[0] for row in ring] == arrivals and ring[-1][2] == 0.0 and it.accepted == 50


def test_jitter_of_the_stamps_loses_nothing():
    off = np.random.default_rng(3).integers(-3 * S // 10, 3 * S // 10, 415).tolist()
    arrivals = [NOW + k * S // 50 for k in range(415)]
    it = CommandIngest(make_inputs())
    for jitter, arrival in zip(off, arrivals):
        assert it.take(command(arrival + jitter, velocity=[0.5]), arrival, arrival) == ""
    assert it.accepted == it.inputs.command_head[0] == 415 and not it.refused
    assert sorted(it.inputs.command_time.tolist()) == arrivals[-COMMAND_ROWS:]
    assert 0.25 < abs(it.largest_lag) <= 0.3


def test_duplicates_and_swaps_act_as_they_come():
    stamps = [NOW, NOW, NOW + 40_000_000, NOW + 20_000_000, NOW + 40_000_000]
    arrivals = [NOW + k * 20_000_000 for k in range(5)]
    it, ring = commanded([s - a for s, a in zip(stamps, arrivals)], arrivals)
    assert [row[0] for row in ring] == arrivals and [row[2] for row in ring] == [0.0, 0.001, 0.002, 0.003, 0.004]


@given(st.lists(st.tuples(st.integers(-1_600_000, 30_000_000), st.integers(-(10**13), 10**13)), max_size=60))
def test_times_in_the_ring_go_up_though_the_map_of_the_clocks_moves_back(steps):
    it, arrival, now = CommandIngest(make_inputs()), 10**15, NOW
    for step, off in steps:
        arrival, now = arrival + max(step, 0), now + step
        assert it.take(command(max(NOW + off, 0), velocity=[1.0]), arrival, now) == ""
    times = [row[0] for row in pushed(it.inputs)]
    assert (np.diff(times) > 0).all() and it.accepted == len(steps)
    assert all(time >= NOW - 1_600_000 * len(steps) for time in times)


def test_a_stop_acts_at_once_though_the_clock_of_the_motion_stepped_back():
    it = CommandIngest(make_inputs())
    assert it.take(command(0, velocity=[0.5]), 0, NOW) == ""
    assert it.take(command(0, velocity=[0.0]), S, NOW + S - 19 * S // 10) == ""
    winch, drum, tick = records(1, WINCH)[0], records(1, DRUM)[0], S // 100
    drum.ramp, drum.max_rate, drum.timeout, drum.max_reach = 20.0, 5.0, 0.5, 9.0
    winch.command_rate = 0.1
    carry(NOW - 9 * S // 10 + tick, 0.01, drum, it.inputs, winch)
    assert winch.command_rate == 0.0 and winch.stale == 0
    carry(NOW + tick, 0.01, drum, it.inputs, winch)
    assert winch.command_rate == 0.0, "nor does the older one come back"


def test_after_a_jump_of_the_clock_commands_count_on_the_new_one():
    it = prepared()
    it.reset()
    assert it.take(command(NOW, [1.0]), 0, NOW - 50 * S) == ""
    assert pushed(it.inputs)[1][0] == NOW - 50 * S


def test_the_lag_is_arrival_less_stamp_on_the_clock_of_the_stamp():
    """Motion on a clock of its own, 1000 s before the wall clock; arrivals are neither."""
    it = CommandIngest(make_inputs(), wall=NOW + 1000 * S - 7)
    for arrival, stamp, lag, clock in (
        (7, NOW - S // 5, 0.2, "motion"),
        (S, NOW + 2 * S, -1.0, "motion"),
        (2 * S, NOW + 1002 * S - S // 2 - 7, 0.5, "wall"),
        (2 * S + 1, 0, nan, ""),
        (2 * S + 2, NOW - 3600 * S, nan, ""),
    ):
        assert it.take(command(stamp, [1.0]), arrival, NOW + arrival - arrival % S) == ""
        assert it.lag == pytest.approx(lag, abs=1e-8, nan_ok=True) and it.lag_clock == clock
    assert it.largest_lag == pytest.approx(0.5), "that of -1 s is older than a second"
    assert it.take(command(NOW + 4 * S, [1.0]), 4 * S, NOW + 4 * S) == "" and it.largest_lag == 0.0


# what asks for more than the winch can do


def test_what_is_clamped_is_counted_and_said():
    drum = records(1, DRUM)[0]
    drum.payout_0, drum.max_rate, drum.min_reach, drum.max_reach = 450.0, 2.0, -430.0, 15.0
    it = CommandIngest(make_inputs(), drum)
    for asked, what in (
        ({"velocity": [2.0]}, {}),
        ({"velocity": [-2.5]}, {"rate": 1}),
        ({"position": [465.0]}, {"rate": 1}),
        ({"position": [500.0]}, {"rate": 1, "length": 1}),
        ({"position": [100.0], "velocity": [9.0]}, {"rate": 1, "length": 1}),  # the length wins
        ({"position": [-3.0]}, {"rate": 1, "length": 2}),
    ):
        assert it.take(command(NOW, **asked), 0, NOW) == "" and dict(it.clamped) == what
    assert it.last_clamp == (
        "a length of -3 m is outside the travel, 20.00 to 465.00 m of pay-out: the winch goes to 20.00 m"
    )
    assert it.take(command(NOW, velocity=[1e4]), 0, NOW) == ""
    assert it.last_clamp == "a rate of 10000 m/s is beyond winch.max_rate = 2 m/s: carried out at that"
    assert it.travel(450.0) == (15.0, 430.0) and it.travel(465.1) == (0.0, pytest.approx(445.1))
    assert np.isnan(CommandIngest(make_inputs()).travel(1.0)).all()


# a bag


def odd_tow(offset=0):
    """Events of 4 s of motion and odd commands among them; arrivals are stamps plus offset and up to 8 ms."""
    delay = np.random.default_rng(8).integers(0, 8_000_000, 10_000).tolist()
    events = [Event(T0 - STEP, T0 - STEP + offset, "command", command(T0 - STEP, [1.0]))]  # before the first motion
    odd = [
        lambda now: command(now, velocity=[0.5]),
        lambda now: command(now, [1e9]),
        lambda now: command(now, [1.0, 2.0]),
        lambda now: command(now, [nan], [nan]),
        lambda now: command(now + 3600 * S, [2.0]),  # foreign stamp
        lambda now: command(now - S // 2, [3.0]),  # older than the ones before
        lambda now: command(0, [4.0], [nan]),
        lambda now: command(now, [nan, nan], [0.2, nan], ["payout", "drum"]),
        lambda now: command(now, [inf]),
        lambda now: command(now, [1.0], names=["drum"]),
        lambda now: b"\0\1\0\0",
    ]
    for k in range(200):
        now = T0 + k * STEP
        arrival = now + offset + delay.pop()
        data = odometry(now, (0.04 * k, 0, 0), velocity=(2.0, 0, 0))
        events.append(Event(now, arrival, "odometry", data))
        wild = now + (3600 * S if k == 60 else 0)
        events.append(Event(wild, arrival + 1, "imu", imu(wild)))  # one wild stamp
        if k % 3 == 0:
            sent = odd[k // 3 % len(odd)](now + 1_000_000)
            events.append(Event(now, arrival + 2_000_000, "command", sent))
    return RecordedTow("", events)


def decisions(tow, take):
    """Of every command: its cause of refusal, or what came into the ring. take(event) -> (cause, ring)."""
    found, head = [], 0
    for event in tow.events:
        cause, inputs = take(event)
        now = int(inputs.command_head[0])
        if event.kind == "command":
            found.append(cause or (pushed(inputs, now - 1)[0] if now != head else "nothing"))
        head = now
    return found


def test_a_bag_decides_as_the_ingest_of_the_node():
    """The rule of the live session in a few lines; test/ros/test_session.py holds the session itself against a bag."""
    inputs = make_inputs()
    motion, commands, clock = MotionIngest(inputs, Ship(), Heave()), CommandIngest(inputs), DataClock()

    def live(event):
        if event.kind == "command":
            return commands.take(event.data, event.arrival, clock.now(event.arrival)), inputs
        stamp, head = stamp_of(event.data), int(inputs.motion_head[0])
        if clock.judge(stamp, event.arrival) is Stamp.FITS:
            motion.take(event.kind, event.data, event.arrival)
            if inputs.motion_head[0] > head:
                clock.update(stamp, event.arrival)
        return "", inputs

    tow = odd_tow(offset=123_456_789)
    wanted = decisions(tow, live)
    feeder = Feeder(make_inputs(), tow, Scene)
    assert feeder.until(10**30) == tow.events and feeder.done
    assert feeder.intake.commands.refused == commands.refused and feeder.intake.commands.accepted == commands.accepted
    assert set(commands.refused) == {
        *("before_motion", "out_of_range", "array_length", "not_finite", "joint_name", "size")
    }
    assert feeder.intake.commands.no_command == commands.no_command > 3
    taken = [row for row in wanted if not isinstance(row, str)]
    assert len(taken) >= 20 and np.array_equal(pushed(feeder.inputs), taken, equal_nan=True)


def test_a_foreign_stamp_does_not_hold_up_what_comes_after_it():
    tow = odd_tow()
    feeder = Feeder(make_inputs(), tow, Scene)
    reached = feeder.until(T0 + 3 * S)
    assert all(event.arrival < T0 + 3 * S + 20_000_000 for event in reached)
    assert int(feeder.inputs.motion_time[(int(feeder.inputs.motion_head[0]) - 1)]) == T0 + 3 * S
    assert {"command"} <= {event.kind for event in reached[-8:]}


def test_a_command_in_a_gap_of_the_motion_comes_in_the_gap():
    motion = [Event(t, t, "odometry", odometry(t, velocity=(1, 0, 0))) for t in (T0, T0 + STEP, T0 + 2 * S)]
    events = [*motion[:2], Event(T0 + S, T0 + S, "command", command(T0 + S, velocity=[0.5])), motion[2]]
    feeder = Feeder(make_inputs(), RecordedTow("", events), Scene)
    assert feeder.until(T0 + S) == events[:3] and pushed(feeder.inputs)[0][0] == T0 + S
    assert feeder.until(T0 + 3 * S) == events[3:]


def test_the_time_a_bag_was_recorded_at_does_not_matter():
    """Log times a constant apart, as CLOCK_MONOTONIC of the run is from them: the same stamps, to the nanosecond."""
    rings = []
    for offset in (0, 987_654_321, -T0 + 5):
        feeder = Feeder(make_inputs(), odd_tow(offset), Scene)
        feeder.until(10**30)
        rings.append(pushed(feeder.inputs))
    for ring in rings[1:]:
        assert np.array_equal(ring, rings[0], equal_nan=True)


def test_the_map_of_arrivals_forgets_at_the_same_time_whatever_their_clock():
    """Over minutes, with the sender's clock drifting and the least delays leaving the memory of 30 s."""
    delays = np.random.default_rng(9).exponential(3e6, 5000).astype(int).tolist()
    runs = []
    for shift in (0, 370_000_000, 10**18 + 1):
        clock, offsets = DataClock(), []
        for k, delay in enumerate(delays):
            clock.update(T0 + k * STEP, T0 + k * STEP + delay + k * 1000 + shift)
            offsets.append(clock.offset - shift)
        runs.append(offsets)
    assert runs[0] == runs[1] == runs[2] and len(set(runs[0][2000:])) > 3, "the least delay must leave the memory"


def test_a_jump_of_the_clock_forgets_the_times_of_commands():
    events = [
        Event(T0 + k * STEP, T0 + k * STEP, "odometry", odometry(T0 + k * STEP, velocity=(1, 0, 0))) for k in range(9)
    ]
    events.append(Event(T0, T0 + 9 * STEP, "command", command(T0 + 9 * STEP, [1.0])))
    for k in range(10, 17):  # the stamps go back by 100 s
        stamp = T0 - 100 * S + k * STEP
        events.append(Event(stamp, T0 + k * STEP, "odometry", odometry(stamp, velocity=(1, 0, 0))))
        if k == 14:
            events.append(Event(stamp, T0 + k * STEP + 1, "command", command(stamp, [2.0])))
    feeder = Feeder(make_inputs(), RecordedTow("", events), Scene)
    feeder.until(10**30)
    assert feeder.jumped and not feeder.done, "what comes behind the jump waits"
    feeder.follow()
    feeder.until(10**30)
    assert feeder.intake.clock.jumps == 1 and dict(feeder.intake.commands.refused) == {"before_motion": 1}


def test_messages_that_are_cut_short_are_counted_and_do_not_end_a_replay(tmp_path):
    with Writer(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topics = {
            kind: writer.add_connection(f"/{topic}", msgtype, typestore=STORE)
            for kind, (msgtype, topic) in KINDS.items()
        }
        writer.write(topics["odometry"], T0, odometry(T0, velocity=(1, 0, 0)))
        writer.write(topics["imu"], T0 + 1, b"\0\1\0\0")
        writer.write(topics["command"], T0 + 2, b"\0\1\0\0\5")
    tow = read_tow(tmp_path / "bag")
    assert [event.time for event in tow.events] == [T0, T0 + 1, T0 + 2]
    feeder = Feeder(make_inputs(), tow, Scene)
    feeder.until(T0 + S)
    assert feeder.intake.refusals() == {"size": 1} and dict(feeder.intake.commands.refused) == {"size": 1}


def test_a_bag_is_read_anew_where_its_content_differs_and_nobody_writes_to_what_is_kept(tmp_path):
    """Even where the time of its files is the same."""
    path = shutil.copytree(find_bag("lmg1903"), tmp_path / "bag")
    first = read_tow(path)
    first.about["node"], first.events[0] = "another", first.events[-1]
    first.notices.append("a notice")
    again = read_tow(path)
    assert again.events[0].time < again.events[-1].time and "node" not in again.about and not again.notices
    (file,), (other,) = path.glob("*.mcap"), find_bag("nbp1406").glob("*.mcap")
    before = file.stat()
    shutil.copy(other, file)
    os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))
    assert read_tow(path).events[0] != again.events[0]
