"""Runs saved at their end and gone on with: the two parts are the whole, bit for bit; another motion, another scene."""

import sys
from pathlib import Path

import numpy as np
import pytest
from short_bag import put_short_bag

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))

from hostile_files import with_notes

from cable_sim_ros.io.recordings.journal import read_journal
from cable_sim_ros.io.scenes.load import SceneWarning, load_scene, override
from cable_sim_ros.io.sources.motion_table import MotionError
from cable_sim_ros.io.sources.recorded_tow import read_tow
from cable_sim_ros.runs import message_run, offline
from cable_sim_ros.runs.resume import Resumed
from cable_sim_ros.sim.saved.savefile import SaveError
from cable_sim_ros.sim.simulator import Simulator

CASES = {
    "heave": {"heave": (0.5, 8.0)},
    "without motion": {},
    "bag": {"motion": "nbp1406"},
    "IMU alone": {"motion": "nbp1406", "imu_only": True},
    "steps chosen": {"heave": (0.5, 8.0), "step": "chosen"},
}


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A run of 1 s in a heave, under a plan, saved."""
    path = tmp_path_factory.mktemp("saved") / "tow.npz"
    return offline.run("side_scan", heave=(0.5, 8.0), duration=1.0, winch="0 hold, 0.5 rate 0.2", save=path), path


@pytest.fixture
def short(monkeypatch):
    """The bag is no longer than two seconds."""
    put_short_bag(monkeypatch, 2)


@pytest.mark.parametrize("case", CASES)
def test_two_parts_are_the_whole(case, short, tmp_path):
    given, path = CASES[case], tmp_path / "tow.npz"
    whole = offline.run("side_scan", duration=1.2, **given)
    first = offline.run("side_scan", duration=0.7, save=path, **given)
    assert first.metrics["saved"] == str(path)
    rest = {key: value for key, value in given.items() if key != "step"}
    second = offline.run(None, duration=0.5, resumed=path, **rest)
    assert len(second.frames) and first.frames.tobytes() + second.frames.tobytes() == whole.frames.tobytes()
    resumed = second.metrics["resumed"]
    assert resumed["motion"] == "goes on" and resumed["time_s"] == pytest.approx(first.frames.time[-1] * 1e-9)


def test_a_plan_goes_on_and_another_takes_its_place(saved):
    whole = offline.run("side_scan", heave=(0.5, 8.0), duration=1.5, winch="0 hold, 0.5 rate 0.2")
    first, path = saved
    second = offline.run(None, heave=(0.5, 8.0), duration=0.5, resumed=path)
    assert first.frames.tobytes() + second.frames.tobytes() == whole.frames.tobytes()
    assert second.metrics["winch"] == first.metrics["winch"]
    held = offline.run(None, heave=(0.5, 8.0), duration=1.0, resumed=path, winch="0 hold")
    assert abs(held.frames["payout_rate"][-1]) < 0.01 < abs(second.frames["payout_rate"][-1])


def test_without_a_duration_a_bag_goes_on_to_its_end(short, tmp_path):
    whole = offline.run("side_scan", "nbp1406")
    first = offline.run("side_scan", "nbp1406", duration=1.0, save=tmp_path / "a")
    second = offline.run("side_scan", "nbp1406", resumed=tmp_path / "a", save=tmp_path / "b")
    assert first.frames.tobytes() + second.frames.tobytes() == whole.frames.tobytes()
    text = r"nbp1406: the motion has ended where the state was saved, after 2 s; nothing was simulated. Give another"
    with pytest.raises(MotionError, match=text):
        offline.run(None, "nbp1406", resumed=tmp_path / "b")


def test_another_motion_takes_the_tow_up_at_its_beginning(saved):
    first, path = saved
    with pytest.warns(
        SceneWarning, match=r"tow.npz: was not saved under heave 0.3 m, 6 s: the tow as it hangs is taken"
    ):
        second = offline.run(None, heave=(0.3, 6.0), duration=0.5, resumed=path)
    assert second.metrics["resumed"]["motion"] == "taken up anew" and "winch" not in second.metrics
    assert second.frames["time"][0] == 10**9 + 10_000_000, "at the beginning of its own motion"
    assert second.frames["payout"][0] == pytest.approx(first.frames["payout"][-1], abs=0.01)
    assert np.ptp(second.frames["payout"]) < 0.05, "the winch holds"
    still = offline.run(None, duration=0.2, resumed=path)
    assert still.frames["time"][0] == first.frames["time"][-1] + 10_000_000
    assert still.metrics["resumed"]["motion"] == "taken up anew"


def test_a_motion_of_another_heading_is_refused(saved, monkeypatch):
    real = message_run.MessageRun.first
    monkeypatch.setattr(message_run.MessageRun, "first", lambda self: real(self)._replace(heading=1.0))
    text = (
        r"tow.npz: the ship heads 0 deg in the state and 57 deg in the motion: the tow would be swept round by 57 deg, "
    )
    text += "more than 30 deg; nothing was simulated. Start the scene anew under this motion"
    with pytest.raises(SaveError, match=text):
        offline.run(None, heave=(0.3, 6.0), duration=0.5, resumed=saved[1])


def test_another_scene_is_refused_with_what_differs(saved):
    path = saved[1]
    other = override(load_scene("side_scan"), {"towbody.net_weight": 80.0, "setpoint.algorithm": "simplified_sheave"})
    text = r"tow.npz: is the state of another scene: setpoint.algorithm is \w+ in the file, simplified_sheave here; "
    text += r"towbody.net_weight is [\d.]+ N in the file, 80 N here; nothing was loaded. \w+ .*'side_scan'"
    with pytest.raises(SaveError, match=text):
        offline.run(other, heave=(0.5, 8.0), resumed=path)
    with pytest.raises(SaveError, match=r"solver.tick is 0.01 s in the file, 0.02 s here; nothing was loaded"):
        offline.run("side_scan", heave=(0.5, 8.0), resumed=path, every=0.02)
    held = offline.run("side_scan", heave=(0.5, 8.0), duration=0.1, resumed=path, algorithm="simplified_sheave")
    assert held.metrics["setpoint"] == "simplified_sheave", "the algorithm may be another, as in a run"


def test_a_file_of_something_else_needs_a_motion(saved, tmp_path):
    sim = Simulator(load_scene("side_scan"))
    sim.start()
    sim.save(tmp_path / "own.npz")
    text = (
        "own.npz: was not saved by a run, so it does not say under which motion to go on; nothing was simulated. Give"
    )
    with pytest.raises(MotionError, match=text):
        Resumed(tmp_path / "own.npz").report()
    assert len(offline.run(None, heave=(0.3, 6.0), duration=0.1, resumed=tmp_path / "own.npz").frames) == 10
    with pytest.raises(TypeError, match="needs a scene, or a saved state"):
        offline.run(None)


@pytest.mark.parametrize(
    "change",
    [
        lambda run: run.pop("report"),
        lambda run: run["report"].update(heave=[1.0]),
        lambda run: run.pop("done"),
        lambda run: run.update(origin=[1.0]),
        lambda run: run["intake"]["object"].pop("clock"),
        lambda run: run["intake"]["object"]["clock"]["object"].update(_buckets={"what": 1}),
        lambda run: run.update(intake=[3]),
    ],
)
def test_damaged_notes_are_refused(saved, tmp_path, change):
    path = with_notes(saved[1], tmp_path / "tow.npz", lambda notes: change(notes["run"]))
    with pytest.raises(SaveError, match="tow.npz: is damaged .its notes of the run do not fit, .*; nothing was loaded"):
        resumed = Resumed(path)
        resumed.report()
        offline.run(None, heave=(0.5, 8.0), duration=0.1, resumed=resumed)


def test_nothing_is_saved_where_that_cannot_be_or_the_run_gave_up(saved, tmp_path, monkeypatch):
    text = r"gone/x: cannot be written \(No such file or directory\); nothing was saved. Check the folder"
    with pytest.raises(SaveError, match=text):
        offline.run("side_scan", duration=0.1, save=tmp_path / "gone" / "x")
    with pytest.raises(SaveError, match=r"cannot be written \(Is a directory\)"):
        offline.run("side_scan", duration=0.1, save=tmp_path)
    real = message_run.MessageRun.run
    monkeypatch.setattr(
        message_run.MessageRun, "run", lambda self, *given: real(self, *given)._replace(problem="the solver gave up")
    )
    result = offline.run("side_scan", duration=0.1, save=tmp_path / "x")
    assert result.problem == f"the solver gave up; its state was not saved to {tmp_path / 'x'}"
    assert not (tmp_path / "x").exists() and result.metrics["problem"] == result.problem


def test_a_recorded_part_is_replayed(saved, tmp_path):
    result = offline.run(None, heave=(0.5, 8.0), duration=0.5, resumed=saved[1], out=tmp_path)
    (segment,) = read_journal(read_tow(result.bag).journal).segments
    assert segment.start.cause == "restore"
    again = offline.replay(result.bag)
    assert again.frames.tobytes() == result.frames.tobytes() and again.metrics["replay_faults"] == []
