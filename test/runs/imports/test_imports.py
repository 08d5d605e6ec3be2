"""Imports: what a log lacks is put in and said, gaps stay gaps, and no number in a log makes a bag of any size."""

import tracemalloc

import numpy as np
import pytest
from made_tables import imported, ship, told

from cable_sim_ros.io.messages.messages import decode_odometry
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.sources.recorded_tow import odometry_of
from cable_sim_ros.ros.play.player import PlayError, load
from cable_sim_ros.runs.sources import motion_of
from cable_sim_ros.sim.tables.attitude import to_world
from cable_sim_ros.tools.logs.log import LogError

T = np.arange(0.0, 60.0, 0.1)
HEAVE = 0.8 * np.sin(0.7 * T)
ROLL, PITCH = np.radians(4.0) * np.sin(0.5 * T), np.radians(2.0) * np.cos(0.6 * T)
SPLINE = 2e-4  # of a cubic spline through 10 Hz of waves of 9 s, m and rad, with its ends


def test_heave_alone_makes_a_level_ship_on_a_mean_track(tmp_path):
    done, t, motion = imported(ship(tmp_path / "a.csv", T, h=-HEAVE), "heave_down h m", heading=0.0, height=1.5)
    assert done.figures["motion"] == "odometry" and done.figures["given"] == ["heave"]
    assert np.diff(t).max() <= 0.0201 and t[0] == pytest.approx(0.0, abs=1e-6) and t[-1] > 59.8
    known = 0.8 * np.sin(0.7 * t)
    np.testing.assert_allclose(motion[:, 2], known - known.mean() + 1.5, atol=SPLINE)
    assert not motion[:, :2].any(), "a run takes the speed of its scene"
    assert not motion[:, 3:].any()
    for words in (("roll, pitch", "the ship is level"), ("speed: not in the log", "takes ship.tow_speed"),
                  ("surge and sway: not in the log",), ("lever arm",), ("mean put at 1.5 m",)):  # fmt: skip
        assert told(done.assumed, *words), (words, done.assumed)


ANGLES = ("roll r deg", "pitch_bow_up p deg", "heading h deg")


def turning(tmp_path, **more):
    return ship(tmp_path / "a.csv", T, r=np.degrees(ROLL), p=-np.degrees(PITCH), h=350.0 + 0.5 * T, **more)


def test_angles_without_a_position_are_reckoned_by_speed_or_go_along_the_mean_heading(tmp_path):
    done, t, motion = imported(turning(tmp_path, v=np.full(len(T), 4.0)), *ANGLES, "speed v kn")
    np.testing.assert_allclose(motion[:, 3], np.radians(4.0) * np.sin(0.5 * t), atol=SPLINE)
    np.testing.assert_allclose(motion[:, 4], np.radians(2.0) * np.cos(0.6 * t), atol=SPLINE)
    yaw = np.radians(100.0 - 0.5 * t)
    np.testing.assert_allclose(np.unwrap(motion[:, 5]), yaw, atol=1e-6)
    speed = 4.0 * 1852.0 / 3600.0
    way = speed / np.radians(0.5) * np.column_stack([np.sin(yaw[0]) - np.sin(yaw), np.cos(yaw) - np.cos(yaw[0])])
    np.testing.assert_allclose(motion[:, :2], way, atol=0.01)  # a circle of 236 m; steps of 20 ms by their middle
    assert told(done.assumed, "position: not in the log, reckoned from speed and heading")
    done, t, motion = imported(turning(tmp_path), *ANGLES, speed=1.0)
    assert np.hypot(*motion[-1, :2]) == pytest.approx(t[-1], abs=1e-6)
    assert told(done.assumed, "heave: not in the log") and told(done.assumed, "speed: 1 m/s along")


def test_a_ship_that_turns_is_not_drawn_straight_but_by_choice(tmp_path):
    """A circle in 90 s without position and speed: it goes where it points; --track mean takes the turn out."""
    t = np.arange(0.0, 150.0, 0.5)
    log = ship(tmp_path / "a.csv", t, h=4.0 * t + np.sin(0.9 * t), r=np.sin(t))
    done, stamps, motion = imported(log, "heading h deg", "roll r deg", speed=2.2)
    way = np.diff(motion[:, :2], axis=0)
    ahead = np.column_stack([np.cos(motion[1:, 5]), np.sin(motion[1:, 5])])
    assert (way * ahead).sum() == pytest.approx(np.hypot(*way.T).sum(), rel=1e-4)
    assert told(done.assumed, "speed: 2.2 m/s along the heading put in")
    done, stamps, motion = imported(log, "heading h deg", "roll r deg", track="mean")
    assert stamps[0] == pytest.approx(30.0, abs=0.03) and stamps[-1] == pytest.approx(119.0, abs=1.1)
    fast = np.unwrap(motion[:, 5])
    expected = np.radians(-np.sin(0.9 * stamps))
    middle = (stamps > 60.0) & (stamps < 90.0)  # 30 s more: what the ends of the filter need
    assert np.abs(fast - fast[middle].mean() - expected)[middle].max() < np.radians(0.15)
    assert told(done.assumed, "yaw: that above 1/30 Hz of the heading, which turns over 599 deg")
    with pytest.raises(LogError, match="--track mean takes 30 s off at each end, and position and heading last 59 s"):
        imported(turning(tmp_path), *ANGLES, track="mean")


@pytest.mark.parametrize("columns, entries, turns", [
    (dict(h=-HEAVE), ("heave_down h m",), 0.0),
    (dict(h=10.0 + 0.0 * T, u=HEAVE, p=PITCH), ("heading h deg", "surge u m", "pitch_bow_up p rad"), 0.0),
    (dict(h=350.0 + 3.0 * T, p=PITCH), ("heading h deg", "pitch_bow_up p rad"), 180.0),
])  # fmt: skip
def test_a_log_without_a_speed_has_that_of_the_scene_of_each_run(tmp_path, columns, entries, turns):
    imported(ship(tmp_path / "a.csv", T, **columns), *entries)
    for speed in (0.8, 3.0):
        scene = override(load_scene("full_scale"), {"ship.tow_speed": speed, "ship.heading_deg": 80.0})
        tow = motion_of(scene, tmp_path / "bag", None, None, False)
        t, value = odometry_of(tow)
        way = np.hypot(*np.diff(value[:, :2], axis=0).T).sum() if turns else np.hypot(*(value[-1, :2] - value[0, :2]))
        wave = 0.0 if turns or "u" not in columns else np.interp(t[-1] / 1e9 - t[0] / 1e9, T, HEAVE) - HEAVE[0]
        assert way == pytest.approx(speed * 1e-9 * (t[-1] - t[0]) + wave, rel=1e-3)
        assert abs(np.degrees(np.unwrap(value[:, 5]))[-1] - np.degrees(value[0, 5])) == pytest.approx(turns, abs=4.0)
        rows = [decode_odometry(event.data) for event in tow.events]
        world = np.array([to_world(row.angles, row.velocity) for row in rows])
        rate = np.gradient(value[:, :3], 1e-9 * t, axis=0)
        assert np.abs(rate - world)[2:-2].max() < 2e-3 * max(speed, 1.0), "the twist is the slope of the places"
    with pytest.raises(PlayError, match="its log has no speed.*give --speed M/S"):
        load(tmp_path / "bag")
    played = np.array([decode_odometry(event.data).position for event in load(tmp_path / "bag", speed=3.0)])
    np.testing.assert_allclose(played[:, :2], value[:, :2], atol=1e-9)


def test_a_measured_vertical_speed_is_the_heave_of_a_log_without_one(tmp_path):
    t = np.arange(0.0, 180.0, 0.1)
    log = ship(tmp_path / "a.csv", t, v=0.7 * 0.8 * np.cos(0.7 * t) + 0.02, r=np.sin(t))
    done, stamps, motion = imported(log, "heave_rate v m/s", "roll r deg", height=1.0)
    middle = (stamps > 60.0) & (stamps < 120.0)
    np.testing.assert_allclose(motion[middle, 2], 1.0 + 0.8 * np.sin(0.7 * stamps[middle]), atol=0.02)
    assert told(done.assumed, "heave: not in the log, made of its measured vertical speed")


def test_a_height_that_is_there_at_the_ends_of_a_mean_track_alone_is_refused(tmp_path):
    """What is taken off at the ends of the heading is all that there is of the heave."""
    t = np.arange(0.0, 90.0, 0.5)
    log = ship(tmp_path / "a.csv", t, h=90.0 + np.sin(t), z=np.where(t < 20.0, np.sin(0.5 * t), np.nan))
    with pytest.raises(LogError, match="yaw less 30 s at each end, and height and attitude have no time in common"):
        imported(log, "heading h deg", "heave z m", track="mean")


def test_gaps_stay_gaps_for_height_and_for_position(tmp_path):
    """20 s without heave; 10 s later 5 s without a position, where a curve would run away."""
    t = np.arange(0.0, 120.0, 0.2)
    there = np.where((t < 30.0) | (t >= 50.0), np.sin(t), np.nan)
    at = np.where((t < 60.0) | (t >= 65.0), 3.0 * t + 0.5 * np.sin(t), np.nan)
    log = ship(tmp_path / "a.csv", t, heave=there, x=at, y=0.0 * t)
    done, stamps, motion = imported(log, "heave heave m", "x x m", "y y m")
    for begin, end in ((29.9, 50.0), (59.9, 65.0)):
        assert not ((stamps > begin) & (stamps < end - 1e-6)).any()
    np.testing.assert_allclose(motion[:, 0], 3.0 * stamps + 0.5 * np.sin(stamps), atol=2e-3)  # 5 Hz
    assert told(done.said, "heave: 1 gaps, the longest of 20.2 s") and told(done.assumed, "position: it has gaps")
    done, stamps, motion = imported(log, "heave heave m", "x x m", "y y m", track="mean")
    assert np.abs(motion[:, 1]).max() < 1.0 and told(done.assumed, "surge and sway")


def test_a_slow_log_says_which_waves_are_lost_and_a_minute_is_refused(tmp_path):
    t = np.arange(0.0, 120.0, 10.0)
    done, _, _ = imported(ship(tmp_path / "a.csv", t, h=np.sin(0.01 * t)), "heave h m")
    assert told(done.said, "comes every 10 s", "below 20 s is not in it", "below 80 s it is too small")
    with pytest.raises(LogError, match="comes every 100 s, above 60 s there is no motion .* nothing was imported"):
        imported(ship(tmp_path / "a.csv", 10.0 * t, h=np.sin(t)), "heave h m")


def test_a_clock_that_is_set_back_is_joined(tmp_path):
    t = T - np.where(T >= 30.0, 7.0, 0.0)
    done, stamps, motion = imported(ship(tmp_path / "a.csv", t, h=HEAVE), "heave h m")
    assert told(done.said, "the clock was set back 1 times, by 7 s together") and len(stamps) > 2990
    known = 0.8 * np.sin(0.7 * stamps)
    np.testing.assert_allclose(motion[:, 2], known - known.mean(), atol=SPLINE)


def test_a_clock_that_jumps_ahead_costs_no_memory(tmp_path):
    """By 30 days, which the gap of a log may be: 10^8 samples of its time are not made. By a year it is no tow."""
    t = T[:100] + np.where(T[:100] >= 5.0, 2.6e6, 0.0)
    log = ship(tmp_path / "a.csv", t, h=HEAVE[:100], x=2.0 * T[:100], y=0.0 * t)
    for entries in (("heave h m",), ("x x m", "y y m")):
        tracemalloc.start()
        done, stamps, _ = imported(log, *entries)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert len(stamps) < 510 and most < 60e6
        assert told(done.said, "1 gaps, the longest of 2.6e+06 s")
    log = ship(tmp_path / "a.csv", t + np.where(T[:100] >= 5.0, 3e7, 0.0), h=HEAVE[:100])
    with pytest.raises(LogError, match="above 1e\\+07 m, and the log has a gap of .* Was its clock set"):
        imported(log, "heave h m", speed=2.2)


def test_bursts_make_no_more_samples_than_records(tmp_path):
    """A microsecond between most records, a second between some: even times at the median step would be 10^7."""
    t = np.cumsum(np.where(np.arange(200) % 4, 1e-6, 1.0))
    done, stamps, _ = imported(ship(tmp_path / "a.csv", t, h=np.sin(t)), "heave h m")
    assert len(stamps) < 10_000 and told(done.said, "off even times: interpolated")
