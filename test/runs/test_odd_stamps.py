"""Bags of any origin with odd stamps and log times: order of arrival decides, what is skipped is counted."""

from __future__ import annotations

import struct
import time

import numpy as np
import pytest

from cable_sim_ros.io.bags.bag import BagWriter
from cable_sim_ros.io.messages.commands import encode_command
from cable_sim_ros.io.messages.messages import Event, decode_odometry
from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.sources.motion_table import MotionError
from cable_sim_ros.io.sources.recorded_tow import RecordedTow, by_stamps, read_tow, usable_arrivals
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.message_run import MessageRun
from cable_sim_ros.sim.simulator import Simulator, StartError

S = 1_000_000_000
SECONDS = 4.0


@pytest.fixture(scope="module")
def events():
    """A little more of the shipped motion than is simulated, odometry alone."""
    tow = read_tow(find_bag("nbp1406"))
    return [e for e in tow.events if e.kind == "odometry" and e.time < tow.start + round((SECONDS + 1.0) * S)]


def driven(events: list[Event], scene=None):
    one = MessageRun(scene or load_scene("full_scale"), RecordedTow("", events))
    begun = time.process_time()
    frames = one.run(SECONDS, None).frames
    return one, frames, time.process_time() - begun


@pytest.fixture(scope="module")
def clean(events):
    return driven(events)


@pytest.mark.parametrize("shift", [3600 * S, -3600 * S, None], ids=["+1 h", "-1 h", "1970"])
@pytest.mark.parametrize("every", [0, 7], ids=["one", "one of seven"])
def test_odd_stamps_of_motion_are_dropped_and_counted(events, clean, shift, every):
    """None: a stamp of the year 1970. The others go on as if it had not come."""
    odd = [k for k in range(20, len(events)) if (every and k % every == 0) or (not every and k == 50)]
    given = list(events)
    for k in odd:
        given[k] = given[k].moved(86_400 * S - given[k].time if shift is None else shift)
    one, frames, _ = driven(given)
    read = [k for k in odd if given[k].arrival < frames["time"][-1]]
    dropped = one.feeder.intake.refusals()["stamp_off_clock"]
    assert len(read) <= dropped <= len(odd), "what comes after the end is not read"
    assert len(frames) == len(clean[1]) and one.feeder.intake.clock.jumps == 0
    assert np.abs(frames["tension"] - clean[1]["tension"]).max() < 0.02 * clean[1]["tension"].mean()


def test_an_odd_first_stamp_is_not_the_start(events, clean):
    one, frames, _ = driven([events[0].moved(3600 * S), *events[1:]])
    assert one.feeder.intake.clock.jumps == 1 and one.tow.start == events[5].time or one.tow.start == events[6].time
    assert frames["time"][0] < events[10].time and len(frames) > 0.9 * len(clean[1])


def test_a_command_stamped_an_hour_ahead_does_not_block_what_follows(events):
    start = events[0].time
    orders = [
        Event(start + S + 3600 * S, start + S, "command", encode_command(start + S + 3600 * S, None, 0.2)),
        Event(start + 2 * S, start + 2 * S, "command", encode_command(start + 2 * S, None, 0.0)),
    ]
    scene = override(load_scene("full_scale"), {"setpoint.algorithm": "hold"})
    one, frames, _ = driven(sorted([*events, *orders], key=lambda event: event.arrival), scene)
    rate = frames["payout_rate"]
    after = (frames["time"] - start) * 1e-9
    assert rate[(after > 1.3) & (after < 1.5)].max() > 0.1, "it counts from its arrival"
    assert abs(rate[after > 3.0]).max() < 0.02 and one.commands.accepted == 2


@pytest.mark.parametrize("jump", [1.5, -1.5, 40.0, -0.6])
def test_a_jump_of_the_clock_is_followed(events, clean, jump):
    half = len(events) // 2
    moved = [*events[:half], *(e.moved(round(jump * S)) for e in events[half:])]
    one, frames, _ = driven(moved)
    assert one.feeder.intake.clock.jumps == 1 and not np.any(frames["status"] & 1)
    steps = np.diff(frames["time"])
    assert (steps != 10_000_000).sum() == 1, "one step of the time, where the clock jumps"
    assert np.abs(np.diff(frames["tension"])).max() < 60.0, "the tow goes on as it hangs"
    assert one.tow.length == pytest.approx(events[-1].time - events[0].time, abs=2 * S)


def test_log_times_that_stand_still_are_no_arrivals(events, clean, tmp_path):
    flat = [event._replace(arrival=events[0].arrival) for event in events]
    assert usable_arrivals(events) and not usable_arrivals(flat)
    one, frames, _ = driven(by_stamps(flat))
    assert one.feeder.intake.clock.jumps == 0 and frames.tobytes() == clean[1].tobytes()


def test_a_bag_of_which_no_motion_can_be_used_is_refused(events):
    """Heights of a hundred metres: not a tow on the mean track that nobody asked for."""
    high = []
    for event in events[:50]:
        data = bytearray(event.data)
        struct.pack_into("<d", data, data.index(struct.pack("<d", decode_odometry(event.data).position[2])), 100.0)
        high.append(event._replace(data=bytes(data)))
    with pytest.raises(MotionError, match="no message of the ship's motion can be used .height 50.: nothing was simul"):
        MessageRun(load_scene("full_scale"), RecordedTow("high", high)).run(1.0, None)


def test_the_notice_of_log_times_that_stand_still(tmp_path):
    with BagWriter(tmp_path / "flat") as bag:
        for event in read_tow(find_bag("nbp1406")).events[:300]:
            if event.kind == "odometry":
                bag.add("/odom", "nav_msgs/msg/Odometry", 5, event.data)
    (notice,) = read_tow(tmp_path / "flat").notices
    assert "the log times do not run with the stamps of the motion" in notice
    assert "as if each had come at once" in notice


def test_a_start_that_fails_while_it_is_recorded_says_so(events, tmp_path, monkeypatch):
    """The recording that was begun does not hide why there is none."""
    ran = offline.run("side_scan", heave=(0.5, 8.0), duration=1.0, out=tmp_path / "run")
    starts = []

    def start(self, *given, **named):
        starts.append(self)
        if len(starts) > 1:  # the first is the warm-up's
            raise StartError("side_scan: no static equilibrium", 12.0)
        return begin(self, *given, **named)

    begin = Simulator.start
    monkeypatch.setattr(Simulator, "start", start)
    with pytest.raises(StartError, match="no static equilibrium"):
        offline.replay(ran.bag, out=tmp_path / "again")


def test_another_scene_begins_a_jump_from_rest_and_says_so(events, tmp_path):
    half = len(events) // 2
    moved = [*events[:half], *(e.moved(40 * S) for e in events[half:])]
    scene = load_scene("full_scale")
    MessageRun(scene, RecordedTow("", moved)).run(SECONDS, tmp_path / "bag")
    assert offline.replay(tmp_path / "bag").metrics["replay_faults"] == []
    other = offline.replay(tmp_path / "bag", override(scene, {"towbody.net_weight": 545.0}))
    (fault,) = other.metrics["replay_faults"]
    assert "(jump) is of another scene: begun there from the static equilibrium" in fault
