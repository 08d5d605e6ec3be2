"""The session with a vehicle at the far end of the cable, no network: lockstep, recording, replay, odd poses."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import COMPILED

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "io"))
from test_motion import odometry
from test_stepped import BEGIN, MS, Run, S

from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.messages.messages import Event, decode_pose, stamp_of
from cable_sim_ros.io.motion.arrival_order import Intake
from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.physics.inputs import make_inputs
from cable_sim_ros.ros.report.diagnostics import vehicle_status
from cable_sim_ros.runs import offline

pytestmark = [pytest.mark.check, COMPILED]

SCENE = {"scene": "rov_tether", "solver.tick": 0.02, "lockstep.rate": 0.0}
TICKS = 100
PLACE = (-48.0, 3.0, -30.0)


def moving(t: float) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Place and velocity: 1 m to and fro in 6 s."""
    w = 2.0 * math.pi / 6.0
    return (PLACE[0], PLACE[1] + math.sin(w * t), PLACE[2]), (0.0, w * math.cos(w * t), 0.0)


def pose_stamped(stamp: int, place) -> bytes:
    """CDR bytes of a geometry_msgs/PoseStamped, level."""
    types = STORE.types
    header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](*divmod(stamp, S)), "odom")
    point = types["geometry_msgs/msg/Point"](*place)
    turn = types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
    message = types["geometry_msgs/msg/PoseStamped"](header, types["geometry_msgs/msg/Pose"](point, turn))
    return bytes(STORE.serialize_cdr(message, "geometry_msgs/msg/PoseStamped"))


def sailed(monkeypatch, bag=None, vehicle=None, seconds: float = 3.0) -> Run:
    """A ship at rest at 20 Hz and its vehicle, all there before the first step."""
    run = Run(monkeypatch, bag, **SCENE, **{"lockstep.paused": True})
    for k in range(round(seconds / 0.05)):
        stamp = BEGIN + 50 * MS * k
        run.give("odometry", odometry(stamp, (0.0, 0.0, 0.0), velocity=(1e-9, 0.0, 0.0)))
    for kind, data in vehicle if vehicle is not None else poses():
        run.session.vehicle(Event(stamp_of(data), -1, kind, data))
    run.session.pause(False)
    return run


def poses(seconds: float = 3.0, rate: float = 10.0) -> list[tuple[str, bytes]]:
    found = []
    for k in range(round(seconds * rate)):
        place, velocity = moving(k / rate)
        found.append(("vehicle", odometry(BEGIN + round(k * S / rate), place, velocity=velocity)))
    return found


def test_pose_in_wrench_out_in_lockstep_recorded_and_replayed(monkeypatch, tmp_path):
    run = sailed(monkeypatch, tmp_path / "bag")
    frames = run.until(TICKS)
    run.close()
    assert len(frames) == TICKS and run.session.state == "closed"
    np.testing.assert_allclose(frames.vehicle_position[0], PLACE, atol=0.1)
    late = frames[60:]
    expected = [moving((t - BEGIN) * 1e-9)[0][1] for t in late.time.tolist()]
    # taken up over start_blend: what is left of the difference at its begin
    assert np.abs(late.vehicle_position[:, 1] - expected).max() < 1.0
    assert (np.linalg.norm(frames.vehicle_force, axis=1) > 1.0).all() and not (frames.vehicle_off > 0.0).any()
    status = vehicle_status(run.session, frames[-1], run.session.now())
    assert (status.level, status.message) in ((0, "followed"), (0, "closed")) and status.values["received"] == "30"
    assert run.session.poses == 30 and run.session.steps.gate.cadence["vehicle"].missed == 0

    again = offline.replay(str(tmp_path / "bag"))
    assert again.metrics["replay_faults"] == [] and again.frames.tobytes() == frames.tobytes()


def test_a_silent_vehicle_begins_where_the_scene_has_it_and_odd_poses_are_counted(monkeypatch):
    place = (-50.0, 0.0, -32.0)
    odd = [
        ("vehicle", odometry(BEGIN + 500 * MS, (float("nan"), 0.0, 0.0), velocity=(1e-9, 0.0, 0.0))),
        ("vehicle", odometry(BEGIN + 600 * MS, place, velocity=(40.0, 0.0, 0.0))),
        ("vehicle", odometry(BEGIN - 50 * S, place, velocity=(1e-9, 0.0, 0.0))),
        ("vehicle", b"\x00\x01\x00\x00 no message"),
    ]
    run = sailed(monkeypatch, vehicle=odd)
    frames = run.until(TICKS)
    counts = {cause: count for cause, count in run.session.intake.vehicle.counts.items() if count}
    assert counts == {"not_finite": 1, "too_fast": 1, "stamp_off_clock": 1, "size": 1} or len(counts) >= 3, counts
    status = vehicle_status(run.session, frames[-1], run.session.now())
    assert status.level == 1 and "none can be used" in status.message and status.values["refused: too_fast"] == "1"
    assert any("no pose has come" in text for text in run.said)
    run.close()
    np.testing.assert_allclose(frames.vehicle_position, np.tile(frames.vehicle_position[0], (TICKS, 1)), atol=1e-6)
    assert not (frames.vehicle_off > 0.0).any()


def test_poses_alone_will_do_and_their_rates_are_differences(monkeypatch):
    made = [("vehicle_pose", pose_stamped(BEGIN + 100 * MS * k, moving(0.1 * k)[0])) for k in range(30)]
    decoded = decode_pose(made[3][1])
    assert decoded.position == moving(0.3)[0] and not decoded.twist
    run = sailed(monkeypatch, vehicle=made)
    frames = run.until(TICKS)
    run.close()
    other = sailed(monkeypatch)
    twist = other.until(TICKS)
    other.close()
    np.testing.assert_allclose(frames.vehicle_position[60:], twist.vehicle_position[60:], atol=0.2)


def test_a_pose_for_a_scene_without_a_vehicle_is_counted():
    intake = Intake(make_inputs(), load_scene("side_scan"))
    place, velocity = moving(0.0)
    assert not intake.of_vehicle(Event(BEGIN, BEGIN, "vehicle", odometry(BEGIN, place, velocity=velocity)))
    assert intake.refusals() == {"no_vehicle": 1} and not intake.inputs.vehicle_head[0]


def test_a_tow_that_is_taken_back_to_a_saved_state_meets_the_same_poses(monkeypatch, tmp_path):
    run = sailed(monkeypatch)
    run.until(40)
    assert run.session.save(tmp_path / "tow.npz")[0]
    first = run.until(TICKS)[40:]
    back = run.session.restore(tmp_path / "tow.npz")
    assert back[0], back
    run.frames.clear()
    again = run.until(TICKS - 40)
    run.close()
    assert again.tobytes() == first.tobytes()


def test_poses_at_1_hz_are_gone_on_from_and_taken_up_smoothly(monkeypatch):
    run = sailed(monkeypatch, vehicle=poses(9.0, rate=1.0), seconds=9.0)
    frames = run.until(400)
    run.close()
    velocity = np.gradient(frames.vehicle_position, 0.02, axis=0)[1:-1]
    w = 2.0 * math.pi / 6.0
    assert np.abs(velocity[:, 1]).max() < 2.0 * w and np.abs(np.diff(velocity, axis=0)).max() < 0.15
    late = frames[200:]
    off = late.vehicle_position[:, 1] - [moving((t - BEGIN) * 1e-9)[0][1] for t in late.time.tolist()]
    assert np.abs(off).max() < 1.0 and not (frames.vehicle_off > 0.0).any()
