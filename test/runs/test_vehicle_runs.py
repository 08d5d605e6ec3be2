"""A run whose vehicle moves by a table, a bag, a function or a simple motion; recorded, replayed, gone on with."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from cable_sim_ros import CableSimError, replay, run
from cable_sim_ros.io.bags.bag import BagReader
from cable_sim_ros.io.bags.typestore import STORE
from cable_sim_ros.io.scenes.load import load_scene

pytestmark = pytest.mark.trust

SCENE = "rov_tether"
SECONDS = 12.0


@pytest.fixture(scope="module")
def circled(tmp_path_factory):
    """A recorded run on a circle of 5 m in 30 s."""
    out = tmp_path_factory.mktemp("circle")
    return run(SCENE, vehicle="circle 5 30", duration=SECONDS, step="fixed", out=out / "run"), out / "run" / "tow"


@cache
def start() -> list[float]:
    return list(load_scene(SCENE).vehicle.position or ())


def circle(t: float) -> list[float]:
    x, y, z = start()
    w = 2.0 * math.pi / 30.0
    return [x + 5.0 * math.sin(w * t), y + 5.0 * (1.0 - math.cos(w * t)), z, 0.0, 0.0, 0.0]


def test_a_function_of_time_is_the_same_motion(circled):
    other = run(SCENE, vehicle=circle, duration=SECONDS, step="fixed")
    np.testing.assert_allclose(other.frames["vehicle_position"], circled[0].frames["vehicle_position"], atol=1e-9)
    np.testing.assert_allclose(other.frames["tension"], circled[0].frames["tension"], atol=1e-3)
    assert circled[0].verdict.state == "ok"


def test_a_table_at_1_hz_is_the_same_motion(circled, tmp_path):
    table = tmp_path / "vehicle.csv"
    rows = [f"{t},{','.join(f'{x:.6f}' for x in circle(t)[:3])}" for t in range(15)]
    table.write_text("\n".join(["time_s,x_m,y_m,z_m", *rows]))
    other = run(SCENE, vehicle=table, duration=SECONDS, step="fixed").frames
    np.testing.assert_allclose(other["vehicle_position"], circled[0].frames["vehicle_position"], atol=0.02)
    np.testing.assert_allclose(other["tension"], circled[0].frames["tension"], atol=1.0)


def test_a_replay_gives_the_same_bits_and_the_bag_is_a_source(circled):
    one, bag = circled
    again = replay(bag)
    for name in ("tension", "vehicle_force", "vehicle_position"):
        np.testing.assert_array_equal(again.frames[name], one.frames[name])
    other = run(SCENE, vehicle=bag, duration=SECONDS, step="fixed")
    np.testing.assert_allclose(other.frames["tension"], one.frames["tension"], atol=1e-6)


def test_the_force_is_recorded_as_a_wrench_in_axes_of_the_vehicle(circled):
    one, bag = circled
    topic, kind = "/tow_sim/vehicle/wrench", "geometry_msgs/msg/WrenchStamped"
    with BagReader(bag) as reader:
        found = [STORE.deserialize_cdr(message.data, kind) for message in reader.read([topic])]
    assert len(found) == len(one.frames) and found[0].header.frame_id == "vehicle_link"
    for part in ("force", "torque"):  # it heads east, level: its axes are those of the world
        got = np.array([[getattr(getattr(m.wrench, part), axis) for axis in "xyz"] for m in found])
        np.testing.assert_allclose(
            got, one.frames["vehicle_" + {"force": "force", "torque": "moment"}[part]], atol=1e-9
        )


def test_a_saved_run_goes_on_with_the_motion_of_its_vehicle(circled, tmp_path):
    run(SCENE, vehicle="circle 5 30", duration=6.0, step="fixed", save=tmp_path / "half.npz")
    rest = run(None, vehicle="circle 5 30", duration=SECONDS - 6.0, resumed=tmp_path / "half.npz")
    np.testing.assert_array_equal(rest.frames["tension"], circled[0].frames["tension"][600:])


@pytest.mark.parametrize(
    "given, text",
    [
        ("spiral 5 30", "is neither 'still', 'circle RADIUS PERIOD'"),
        ("circle 5", r"'circle 5' is none of .*Give a size in \[0, 1e4\] m"),
        ("", "'' is none of"),
        (lambda t: (0.0, 0.0), "expected six finite numbers"),
        (lambda t: (1.0 / 0.0,) * 6, "ZeroDivisionError"),
        (lambda t: (100.0 * t, 0.0, -30.0, 0.0, 0.0, 0.0), "the speed is"),
    ],
)
def test_what_moves_no_vehicle_is_refused(given, text):
    with pytest.raises(CableSimError, match=text):
        run(SCENE, vehicle=given, duration=1.0)


def test_steps_are_chosen_with_a_vehicle_too(circled):
    chosen = run(SCENE, vehicle="circle 5 30", duration=SECONDS, step="chosen", every=0.1)
    fixed = circled[0].frames["tension"][9::10]
    np.testing.assert_allclose(chosen.frames["tension"][20:], fixed[20:], atol=2.0)
