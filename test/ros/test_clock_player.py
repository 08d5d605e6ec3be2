"""A bag played by /clock: what is due when, and against a node that is paused, runs and is paused again."""

from __future__ import annotations

import pytest
from conftest import LONG, poll
from test_lockstep_node import Watcher

from cable_sim_ros.io.messages.messages import Event
from cable_sim_ros.ros.play.clock_player import Follower
from cable_sim_ros.ros.play.player import PlayError, play_bag

S = 1_000_000_000
MS = 1_000_000


def follower(stamps, **how):
    return Follower([Event(stamp * MS, due * MS, "imu", b"") for due, stamp in stamps], **how)


def given(player, clock: int) -> list[int]:
    """Stamps [ms] that are sent at a clock [ms]."""
    return [(item.stamp + shift) // MS for item, shift in player.due(clock * MS)]


EVEN = [(20 * k, 900_000 + 20 * k) for k in range(4)]


def test_what_the_clock_has_come_to_is_sent_moved_to_the_clock_of_the_first():
    player = follower(EVEN)
    assert given(player, 1000) == [1000] and given(player, 1000) == [] == given(player, 1019)
    assert given(player, 1045) == [1020, 1040] and not player.done
    assert given(player, 1060) == [1060] and player.done and given(player, 9000) == []


def test_kept_stamps_begin_at_once_and_wait_for_the_clock_to_come():
    player = follower(EVEN, keep_stamps=True)
    assert given(player, 1000) == [900_000], "it decides what the clock says"
    assert given(player, 1010) == [] and given(player, 900_030) == [900_020]
    assert given(player, 1000) == [900_040] and given(player, 900_060) == [900_060], "the node began again"


def test_an_odd_stamp_goes_in_its_place_and_a_node_that_begins_again_gets_the_rest():
    odd = [*EVEN[:2], (30, 5_000_000), *EVEN[2:]]
    player = follower(odd)
    assert given(player, 5000) == [5000] and given(player, 5035) == [5020, 4_105_000]
    assert given(player, 1000) == [1000] and given(player, 1020) == [1020] and player.done


def test_a_loop_goes_on_behind_its_end():
    player = follower(EVEN, loop=True)
    assert given(player, 1000) == [1000] and given(player, 1100) == [1020, 1040, 1060, 1080, 1100] and not player.done


def test_a_rate_beside_lockstep_is_refused():
    for rate in (2.0, 1.0):  # also the one that is the default
        with pytest.raises(PlayError, match=f"--rate {rate:g} with --lockstep.*lockstep.rate"):
            play_bag("nbp1406", rate=rate, lockstep=True)


def test_a_bag_reaches_a_paused_node_whole_and_through_a_pause(world, bag):
    watcher = Watcher(world)
    player = world.run("cable_sim_ros.cli", "play", str(bag), "--lockstep", "--duration", "2")
    node = world.node(time_mode="lockstep", lockstep__rate=0.0, lockstep__wait=600.0, lockstep__paused=True)
    node.until("waiting")
    poll(lambda: watcher.figure("motion_held") >= 1.0, "the first message")
    watcher.stands()
    assert watcher.ears.ask("pause", False)[0]
    watcher.more(50)
    assert watcher.ears.ask("pause", True)[0]
    poll(lambda: watcher.task()[1] == "paused", "paused")
    watcher.stands()
    assert player.code is None
    assert watcher.ears.ask("pause", False)[0]
    assert player.wait(LONG) == 0, player.text
    poll(lambda: watcher.figure("clock_s") > 3.0, "a clock behind the last sample")
    assert node.stop() == 0
    stamps = watcher.stamps()
    assert set(b - a for a, b in zip(stamps, stamps[1:])) == {10 * MS}
    metrics = node.state()
    assert metrics["received"] == {"imu": 101, "odometry": 101} and metrics["dropped"] == {}
    assert metrics["lockstep"]["imu_missed"] == 0 and "played 202 messages" in player.text
    assert metrics["ticks"] > 195
