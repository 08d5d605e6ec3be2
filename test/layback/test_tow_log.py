"""Logs of pay-out, speed, heading and depth: what is read, what is said, and what is refused in one line."""

import random

import numpy as np
import pytest

from cable_sim_ros.errors import CableSimError
from cable_sim_ros.io.geodesy import on_earth
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.tools.ensemble.plan import Ranges
from cable_sim_ros.tools.layback.by_log import adjusted, before_run, checked_cable
from cable_sim_ros.tools.layback.tow_log import moment_of, read_log

N = 60
GOOD = {
    "time_s": 1_772_366_400.0 + np.arange(N),
    "payout_m": np.full(N, 200.0),
    "speed_mps": np.full(N, 2.0),
    "heading_deg": np.full(N, 90.0),
    "depth_m": np.full(N, 54.0),
}
POSITIONS = dict(
    zip(("latitude", "longitude"), on_earth((60.0, 5.0), np.column_stack([2.0 * np.arange(N), 0 * np.arange(N)])))
)


def written(path, **columns):
    """A log with other columns than GOOD; None: without."""
    data = {name: values for name, values in {**GOOD, **columns}.items() if values is not None}
    rows = [",".join(data), *(",".join(repr(float(v)) for v in row) for row in zip(*data.values(), strict=True))]
    path.write_text("\n".join(rows) + "\n", "utf-8")
    return path


def with_(name, at, value):
    values = {**GOOD, **POSITIONS}[name].copy()
    values[at] = value
    return {name: values}


def test_a_ship_goes_where_it_points(tmp_path):
    log = read_log(written(tmp_path / "log.csv"))
    assert log.began == GOOD["time_s"][0] and log.origin is None
    assert log.track[-1] == pytest.approx([2.0 * (N - 1), 0.0], abs=1e-6)  # 90 deg from north: east
    assert log.yaw == pytest.approx(np.zeros(N)) and log.depth == pytest.approx(np.full(N, 54.0))
    assert any("goes where it points" in line for line in log.assumed)


def test_positions_say_where_it_went_and_the_speed_is_compared(tmp_path):
    log = read_log(written(tmp_path / "log.csv", **POSITIONS, speed_mps=np.full(N, 2.5)))
    assert log.origin == pytest.approx((60.0, 5.0))
    assert log.track[-1] == pytest.approx([2.0 * (N - 1), 0.0], abs=1e-3)
    assert any("0.5 m/s rms" in note for note in log.notes)


def test_without_a_heading_it_points_along_its_track(tmp_path):
    log = read_log(written(tmp_path / "log.csv", **POSITIONS, heading_deg=None))
    assert log.yaw == pytest.approx(np.zeros(N), abs=1e-6)
    assert any("no heading_deg was logged" in line for line in log.assumed)


def test_a_heading_goes_through_north(tmp_path):
    log = read_log(written(tmp_path / "log.csv", heading_deg=(350.0 + np.arange(N) / 3.0) % 360.0))
    assert np.ptp(np.diff(log.yaw)[20:40]) < 1e-9 and np.diff(log.yaw)[30] == pytest.approx(-np.radians(1.0 / 3.0))


def test_a_depth_that_is_negative_throughout_is_turned_and_said(tmp_path):
    log = read_log(written(tmp_path / "log.csv", depth_m=-GOOD["depth_m"]))
    assert log.depth == pytest.approx(np.full(N, 54.0))
    assert any("negative down (-54 to -54 m): its sign was turned" in line for line in log.assumed)


def test_one_position_that_jumps_is_left_out_and_said(tmp_path):
    log = read_log(written(tmp_path / "log.csv", **{**POSITIONS, **with_("latitude", 30, 61.0)}))
    assert log.track[-1] == pytest.approx([2.0 * (N - 1), 0.0], abs=1e-3)
    assert any("1 positions that jump were left out" in note and "csv:32" in note for note in log.notes)


def test_a_gap_is_bridged_and_said_and_a_ship_that_lies_still_is_said(tmp_path):
    keep = np.r_[0:20, 40:60]
    log = read_log(written(tmp_path / "log.csv", **{name: values[keep] for name, values in GOOD.items()}))
    assert len(log.seconds) == N and any("1 gaps bridged" in note and "21 s" in note for note in log.notes)
    still = read_log(written(tmp_path / "still.csv", speed_mps=np.zeros(N)))
    assert any("lies still" in note and "100 %" in note for note in still.notes)


REFUSED = {
    "no heading": ({"heading_deg": None}, "has no heading_deg, and no latitude and longitude"),
    "no speed": ({"speed_mps": None}, "has no speed_mps, and no latitude"),
    "no pay-out": ({"payout_m": None}, "payout_m must be there once"),
    "unknown column": ({"payout_ft": np.full(N, 1.0)}, "no column 'payout_ft'"),
    "one coordinate": ({"latitude": POSITIONS["latitude"]}, "one of latitude and longitude without the other"),
    "still and no heading": (
        {"heading_deg": None, "latitude": np.full(N, 60.0), "longitude": np.full(N, 5.0)},
        "never moves at 0.2 m/s",
    ),
    "not in order": (with_("time_s", 5, GOOD["time_s"][4]), r"csv:7: time_s .* does not advance"),
    "not a number": (with_("depth_m", 5, np.nan), "csv:7: depth_m = nan is no finite number"),
    "gap": ({"time_s": GOOD["time_s"] + np.where(np.arange(N) > 30, 100.0, 0.0)}, "nothing was logged for 101 s"),
    "counter reset": (
        {"payout_m": np.where(np.arange(N) > 30, 0.0, 200.0)},
        "csv:33: payout_m goes from 200 to 0 m within 1 s.*the counter was set anew",
    ),
    "depth of both signs": (with_("depth_m", 5, -54.0), "csv:7: depth_m = -54 m, and 54 m elsewhere"),
    "speed in knots of a train": (with_("speed_mps", 5, 40.0), r"csv:7: speed_mps = 40 m/s is outside \[-15, 15\]"),
    "positions that jump": (
        {"latitude": 60.0 + np.arange(N) % 2 * 0.1, "longitude": np.full(N, 5.0)},
        "the position jumps by 1.1.*e\\+04 m, and 30 of 60",
    ),
    "too long": ({"time_s": GOOD["time_s"][0] + 1e4 * np.arange(N)}, "more than 86400 s"),
    "too short": ({name: values[:3] for name, values in GOOD.items()}, "has 3 rows, at least 4"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_what_cannot_be_used_is_refused_in_one_line(tmp_path, what):
    columns, text = REFUSED[what]
    with pytest.raises(CableSimError, match=text) as caught:
        read_log(written(tmp_path / "log.csv", **columns))
    assert "\n" not in str(caught.value) and "nothing was simulated" in str(caught.value)


def test_another_format_without_a_mapping_and_a_time_without_a_zone(tmp_path):
    with pytest.raises(CableSimError):
        read_log(tmp_path / "log.bin")
    assert moment_of("2026-03-01T12:00:00") == moment_of("2026-03-01T13:00:00+01:00") == GOOD["time_s"][0]


def test_cable_that_the_drum_does_not_have(tmp_path):
    scene = load_scene("side_scan")
    log = read_log(written(tmp_path / "log.csv"))
    assert checked_cable(log, scene, -50.0) == pytest.approx(np.full(N, 150.0))
    with pytest.raises(CableSimError, match="300 m of cable, of which .* can be out"):
        checked_cable(log, scene, 95.0)
    with pytest.raises(CableSimError, match="cable out goes down to 0 m"):
        checked_cable(log, scene, -200.0)
    with pytest.raises(CableSimError, match="full_scale_contact: winch.drum = contact .* cannot pay out"):
        checked_cable(log, load_scene("full_scale_contact"), 0.0)


def test_the_drag_is_adjusted_to_the_depth_and_its_end_is_said(tmp_path):
    """More drag lifts the fish: 48.1 m deep with 1.2 times the drag, 54.1 m with that of the scene."""
    scene, ranges = load_scene("side_scan"), Ranges()
    for depth, factor, at_end in ((51.0, (1.08, 1.12), False), (30.0, (1.2, 1.2), True)):
        log = read_log(written(tmp_path / "log.csv", depth_m=np.full(N, depth), speed_mps=np.full(N, 2.06)))
        cable = checked_cable(log, scene, 0.0)
        fit = adjusted(log, scene, cable, before_run(log, scene, cable, (0.0, 0.0)), ranges)
        assert factor[0] - 1e-9 <= fit.factor <= factor[1] + 1e-9 and fit.at_end == at_end and fit.after < fit.before
    with pytest.raises(CableSimError, match="range drag=0 leaves nothing"):
        adjusted(log, scene, cable, before_run(log, scene, cable, (0.0, 0.0)), Ranges(drag=0.0))


def test_a_log_cut_off_or_with_wrong_bytes_is_read_or_refused(tmp_path):
    """64 places of a cut, 1000 flips: an error of ours or a log of finite numbers, nothing else."""
    whole = written(tmp_path / "whole.csv", **POSITIONS).read_bytes()
    dice, path = random.Random(7), tmp_path / "damaged.csv"
    cuts = [whole[: len(whole) * k // 64] for k in range(64)]
    flips = []
    for _ in range(1000):
        at = dice.randrange(len(whole))
        flips.append(whole[:at] + bytes([whole[at] ^ 1 << dice.randrange(8)]) + whole[at + 1 :])
    read = 0
    for data in cuts + flips:
        path.write_bytes(data)
        try:
            log = read_log(path)
        except CableSimError as error:
            assert "\n" not in str(error)
            continue
        read += 1
        assert np.isfinite(log.track).all() and np.isfinite(log.cable).all() and len(log.seconds) < 90_000
    assert 50 < read < 1060


def test_places_on_a_plane_serve_as_positions_do(tmp_path):
    log = read_log(written(tmp_path / "log.csv", heading_deg=None, x_m=5.0 + 2.0 * np.arange(N), y_m=np.full(N, 7.0)))
    ends = np.array([[5.0, 7.0], [5.0 + 2.0 * (N - 1), 7.0]])
    assert log.origin is None and log.track[[0, -1]] == pytest.approx(ends)
