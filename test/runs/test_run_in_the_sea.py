"""A run whose ship moves in the waves of the scene: with the surface it has below it, recorded, replayed, saved."""

import json
import warnings
from math import pi

import numpy as np
import pytest

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.sources.motion_table import MotionError
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.saved.savefile import SaveError

pytestmark = pytest.mark.trust

G = 9.81
ROWS = "period_s,heading_deg,heave_amplitude,heave_phase_deg\n"
RIDES = ROWS + "".join(f"{p},{h},1,0\n" for p in (2, 30) for h in (0, 90, 180))


@pytest.fixture(scope="module")
def rides(tmp_path_factory):
    """A ship that heaves as the surface at base_link does, and nothing else."""
    path = tmp_path_factory.mktemp("rao") / "rides.csv"
    path.write_text(RIDES, "utf-8")
    return path


@pytest.fixture(scope="module")
def scene():
    """A following sea with one wave length between base_link and the sheave, 16 m aft of it."""
    values = {
        "gravity": G,
        "water.ramp": 8.0,
        "water.waves.kind": "airy",
        "water.waves.height": 0.6,
        "water.waves.period": (2.0 * pi * 16.0 / G) ** 0.5,
        "ship.start_blend": 0.5,
    }
    return override(load_scene("side_scan"), values)


@pytest.fixture(scope="module")
def run(scene, rides, tmp_path_factory):
    out = tmp_path_factory.mktemp("run")
    return offline.run(scene, rao=rides, duration=20.0, out=out), out


def test_the_ship_rides_on_the_surface_that_acts_on_the_cable(run, scene):
    """The sheave is a wave length aft: the surface there is the heave, at every tick, growing with it."""
    frames = run[0].frames
    heave = frames["ship_position"][:, 2] - scene.ship.reference_height
    after = frames["time"] - frames["time"][0] > 1e9
    assert frames["surface_elevation"][after] == pytest.approx(heave[after], abs=1e-8)
    assert np.abs(heave).max() == pytest.approx(0.3, rel=0.01)


def test_summary_and_verdict_say_what_moved_the_ship(run, rides):
    result, out = run
    summary = json.loads((out / "summary.json").read_text("utf-8"))
    assert summary["rao"]["source"] == str(rides) and summary["rao"]["outside"] == 0.0
    assert summary["rao"]["deviations"]["heave"] == pytest.approx(0.3 / 2.0**0.5)
    assert "no columns of surge" in summary["verdict"]["notes"][0]
    assert result.verdict.state == "ok" and "note: " in result.verdict.lines()[1]
    assert summary["motion"] == "rides.csv in the waves of side_scan"


def test_the_recording_replays_to_the_bit_without_the_warning_of_an_independent_ship(run):
    result, out = run
    with warnings.catch_warnings():
        warnings.filterwarnings("error", ".*ship_motion = independent")
        again = offline.replay(out / "tow")
    assert again.metrics["largest_difference"]["difference"] == 0.0
    assert again.metrics["largest_difference"]["ticks"] == len(result.frames) and again.verdict.state == "ok"
    assert again.metrics["rao"] == result.metrics["rao"] and again.run_verdict.notes == result.verdict.notes


def test_a_saved_run_goes_on_in_its_sea_and_takes_up_no_other(run, scene, rides, tmp_path):
    state = tmp_path / "half.npz"
    offline.run(scene, rao=rides, duration=10.0, save=state)
    rest = offline.run(None, rao=rides, duration=10.0, resumed=state)
    assert rest.metrics["resumed"]["motion"] == "goes on"
    assert np.array_equal(rest.frames["tension"], run[0].frames["tension"][-len(rest.frames) :])
    with pytest.raises(
        SaveError, match="was not saved under simple in the waves .* would not be the same; nothing was"
    ):
        offline.run(None, rao="simple", duration=2.0, resumed=state)


def test_a_check_keeps_the_notes_and_repeats_the_motion(scene, rides):
    """The finer run has the same motion: mean tensions agree."""
    result = offline.run(scene, rao=rides, duration=1.0, check=True)
    first, finer = result.metrics["check"]["tension_mean_n"]
    assert finer == pytest.approx(first, rel=0.01)
    assert "no columns of surge" in result.metrics["verdict"]["notes"][0]


def test_the_warning_of_an_independent_ship_stays_away(rides, monkeypatch):
    """Where the scene is loaded by the run itself; other warnings stay."""
    keys = {"water.waves.kind": "airy", "water.waves.height": 1.0, "sheave.position": [-16.0, 0.0, 0.7]}
    monkeypatch.setattr(offline, "motion_of", lambda *_: (_ for _ in ()).throw(MotionError("enough")))
    for rao, said in ((rides, False), (None, True)):
        with warnings.catch_warnings(record=True, action="always") as found, pytest.raises(MotionError, match="enough"):
            offline.run("side_scan", rao=rao, settings=keys | {"winch.position": [-8.0, 0.0, 0.7]})
        texts = [str(warning.message) for warning in found]
        assert any("ship_motion = independent" in text for text in texts) == said


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"motion": "nbp1406"}, "rao and the motion 'nbp1406' were both given: nothing was simulated"),
        ({"heave": (1.0, 8.0)}, "rao and heave were both given"),
        ({"imu_only": True}, "--rao gives no IMU messages"),
        ({"settings": {"motion.convention": "ned"}}, "motion.convention: .* but the motion is --rao"),
        ({}, "side_scan: --rao moves the ship in the waves of the scene, but water.waves.kind = off"),
    ],
)
def test_what_contradicts_the_sea_is_refused(given, said):
    with pytest.raises(MotionError, match=said):
        offline.run("side_scan", rao="simple", **given)
