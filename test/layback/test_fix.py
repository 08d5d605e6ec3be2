"""`towbody/fix` of a node: the place of the towbody on the earth, its covariance, the bytes of the recording."""

import math
import os
import time

import numpy as np
import pytest

pytest.importorskip("rclpy")
pytestmark = pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs real time")

from cable_sim_ros.io.geodesy import on_plane  # noqa: E402
from cable_sim_ros.io.scenes.load import load_scene, override  # noqa: E402
from cable_sim_ros.ros.blocks import NodeBlock  # noqa: E402
from cable_sim_ros.ros.parameters import ParameterError, settle  # noqa: E402
from cable_sim_ros.tools.ensemble.plan import Ranges  # noqa: E402
from cable_sim_ros.tools.layback import fixes as fixes_module  # noqa: E402
from cable_sim_ros.tools.layback.fixes import BandTable  # noqa: E402
from cable_sim_ros.tools.layback.laid import COVERAGE, Tow, band_of  # noqa: E402
from cable_sim_ros.tools.layback.node_part import TowbodyFix  # noqa: E402

ORIGIN = {"fix.latitude": 60.0, "fix.longitude": 5.0}
QUICK = {"fix.ranges.speed": 0.0, "fix.ranges.current": 0.0}  # the drag alone: two static tows a place


def test_the_table_is_the_interval_at_its_places_and_nothing_outside(monkeypatch):
    monkeypatch.setattr(fixes_module, "SHARES", (0.5, 1.0))
    scene, ranges = load_scene("side_scan"), Ranges(speed=0.0, current=0.0)
    table = BandTable(scene, ranges)
    _, band = band_of(scene, Tow(200.0, 2.06, 0.0, 0.0), ranges)
    found = table.of(200.0, 2.06, 0.0)
    assert found == pytest.approx(tuple(part / COVERAGE for part in (band.along, band.across, band.depth)))
    assert table.of(150.0, 1.5, 3.0) is not None  # in still water every heading is the same
    assert table.of(50.0, 2.06, 0.0) is None and table.of(200.0, 5.0, 0.0) is None
    monkeypatch.setattr(fixes_module, "SHARES", (1.0,))
    drifting = BandTable(
        override(scene, {"water.current": [0.0, 0.3]}), Ranges(drag=0.0, speed=0.0, current=0.0, current_turn_deg=0.0)
    )
    assert drifting.of(200.0, 2.06, 0.1) is not None and drifting.of(200.0, 2.06, 1.0) is None


def test_half_an_origin_is_refused():
    assert TowbodyFix.problem(NodeBlock().fix, load_scene("side_scan")) == ""
    with pytest.raises(ParameterError, match="'fix.latitude' = 60 deg has no fix.longitude beside it.*nothing was st"):
        settle({"scene": "side_scan", "fix.latitude": 60.0})
    with pytest.raises(ParameterError, match="'fix.latitude' = 95 deg is out of range"):
        settle({"scene": "side_scan", "fix.latitude": 95.0, "fix.longitude": 5.0})


def test_the_fix_is_the_towbody_on_the_earth_and_is_recorded(tow_sim, tmp_path):
    from rclpy.serialization import deserialize_message
    from sensor_msgs.msg import NavSatFix

    from cable_sim_ros.io.bags.bag import read_bag

    recording = {"recording.enabled": True, "recording.root": str(tmp_path), "recording.path": "tow"}
    parameters = ORIGIN | QUICK | recording | {"fix.rate": 10.0, "fix.surface": 40.0}
    sim = tow_sim("side_scan", mode="lockstep", parameters=parameters)
    heard = sim.listen(NavSatFix, "towbody/fix")
    sim.feed("nbp1406")
    approximated = NavSatFix.COVARIANCE_TYPE_APPROXIMATED  # once the table is there, which is made beside the tow
    deadline = time.monotonic() + 600.0
    while len(heard) < 12 or heard[-1].position_covariance_type != approximated:
        assert time.monotonic() < deadline, "12 fixes, and a covariance"
        sim.advance(0.1)
        time.sleep(0.1)
    frames = sim.frames.copy()
    at = {int(time): k for k, time in enumerate(frames["time"])}
    fixes = [one for one in heard if one.header.stamp.sec * 1_000_000_000 + one.header.stamp.nanosec in at]
    assert len(fixes) >= 5
    for fix in fixes:
        frame = frames[at[fix.header.stamp.sec * 1_000_000_000 + fix.header.stamp.nanosec]]
        place = on_plane((60.0, 5.0), np.array([fix.latitude]), np.array([fix.longitude]))[0]
        assert place == pytest.approx(frame["body_position"][:2], abs=1e-5)
        assert fix.altitude == pytest.approx(40.0 + frame["body_position"][2])
        if fix.position_covariance_type == approximated:
            e, n = fix.position_covariance[0], fix.position_covariance[4]
            assert 0.5 < math.sqrt(e + n) < 5.0 and fix.position_covariance[8] > 1.0
    assert any(fix.position_covariance_type == approximated for fix in fixes)
    sim.close()
    written = [deserialize_message(m.data, NavSatFix) for m in read_bag(tmp_path / "tow") if m.topic.endswith("/fix")]
    assert all(fix in written for fix in fixes)


def test_without_an_origin_nothing_is_made():
    """The part is not started: no publisher, timer or table."""
    assert not TowbodyFix.asked(NodeBlock().fix) and TowbodyFix.asked(settle({"scene": "side_scan"} | ORIGIN).node.fix)
