"""Live keys that change at times of an offline run: the tick they meet, the journal, the replay, every refusal."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from short_bag import put_short_bag

from cable_sim_ros import Simulator, replay, run
from cable_sim_ros.io.scenes.live_changes import ChangeError, Timetable, changes_of, fit, refuse_unacting, tick_of
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.scenes.winch_plan import PlanError
from cable_sim_ros.physics.winch_drive import BRAKE, FOLLOW

S = 1_000_000_000
MOTOR = {
    "drive.model": "motor",
    "drive.inertia": 45.0,
    "drive.curve_speed": [0.0, 5.0],
    "drive.curve_pull": [2e4, 1e4],
    "drive.brake_pull": 8e3,
}
SCENE = override(load_scene("full_scale"), MOTOR)
HEAVE = {"heave": (0.5, 8.0), "step": "fixed"}
CHANGES = [(0.255, "drive.mode", "brake"), (0.6, "setpoint.algorithm", "hold"), (0.6, "drive.mode", "follow")]


def test_a_change_meets_the_tick_that_holds_its_time_and_a_replay_of_a_replay_has_the_same_bits(tmp_path):
    plain = run(SCENE, duration=0.9, **HEAVE).frames
    result = run(SCENE, duration=0.9, changes=CHANGES, out=tmp_path / "run", **HEAVE)
    mode = result.frames.winch_mode
    assert (mode[:25] == FOLLOW).all() and (mode[25:60] == BRAKE).all() and (mode[60:] == FOLLOW).all()
    assert result.frames[:25].tobytes() == plain[:25].tobytes() and result.frames[25] != plain[25]
    assert result.metrics["changes"] == [
        "0.255 drive.mode brake",
        "0.6 setpoint.algorithm hold",
        "0.6 drive.mode follow",
    ]
    again = replay(result.bag, out=tmp_path / "again")
    assert again.frames.tobytes() == result.frames.tobytes() and not again.metrics["replay_faults"]
    assert replay(again.bag).frames.tobytes() == result.frames.tobytes()


def test_a_run_goes_on_with_what_was_changed_before_it_was_saved(tmp_path):
    whole = run(SCENE, duration=0.9, changes=CHANGES, **HEAVE)
    first = run(SCENE, duration=0.5, changes=CHANGES[:1], save=tmp_path / "a.npz", **HEAVE)
    later = [(time - 0.5, key, value) for time, key, value in CHANGES[1:]]
    second = run(None, duration=0.4, changes=later, resumed=tmp_path / "a.npz", heave=(0.5, 8.0))
    assert first.frames.tobytes() + second.frames.tobytes() == whole.frames.tobytes()


def test_what_stays_as_it_is_changes_no_bit():
    plain = run(SCENE, duration=0.4, **HEAVE).frames
    same = run(SCENE, duration=0.4, changes=[(0.2, "drive.mode", "follow")], **HEAVE).frames
    assert same.tobytes() == plain.tobytes()


def test_a_winch_plan_changes_the_mode(tmp_path):
    plan = "0 rate 0.4, 0.3 mode brake, 0.7 hold, 0.7 mode follow"
    result = run(SCENE, winch=plan, duration=1.0, out=tmp_path / "run", **HEAVE)
    mode = result.frames.winch_mode
    assert (mode[:30] == FOLLOW).all() and (mode[30:70] == BRAKE).all() and (mode[70:] == FOLLOW).all()
    assert replay(result.bag).frames.tobytes() == result.frames.tobytes()
    first = run(SCENE, winch=plan, duration=0.5, save=tmp_path / "a.npz", **HEAVE).frames
    for scene in (None, SCENE):  # the plan that goes on has the mode, whatever the scene begins with
        second = run(scene, duration=0.5, resumed=tmp_path / "a.npz", heave=(0.5, 8.0), step="fixed").frames
        assert first.tobytes() + second.tobytes() == result.frames.tobytes()


def test_a_winch_plan_changes_the_mode_of_a_simulator():
    plan, sims = "0.05 mode brake, 0.2 mode follow, 0.2 rate 0.3", [Simulator(SCENE), Simulator(SCENE)]
    for sim in sims:
        sim.start()
    whole = sims[0].run(40, winch=plan)
    parts = [sims[1].run(count, winch=plan) for count in (3, 10, 27)]
    assert np.concatenate(parts).tobytes() == whole.tobytes()
    assert whole.winch_mode.tolist() == [FOLLOW] * 5 + [BRAKE] * 15 + [FOLLOW] * 20
    with pytest.raises(PlanError, match="item 1 '0 mode brake': drive.mode = brake needs a motor and a brake, but .*;"):
        Simulator("full_scale").run(1, winch="0 mode brake")


def test_after_a_jump_of_the_clock_a_replay_has_what_was_changed_before(monkeypatch, tmp_path):
    events = put_short_bag(monkeypatch, 2, ("odometry",))
    events[len(events) // 2 :] = [event.moved(50 * S) for event in events[len(events) // 2 :]]
    changes = [(0.3, "drive.mode", "brake"), (1.5, "drive.mode", "follow")]
    result = run(SCENE, "nbp1406", step="fixed", changes=changes, out=tmp_path / "run")
    assert result.metrics["clock_jumps"] == 1 and set(result.frames.winch_mode[30:150]) == {BRAKE}
    monkeypatch.undo()
    again = replay(result.bag)
    assert again.frames.tobytes() == result.frames.tobytes() and not again.metrics["replay_faults"]
    assert again.metrics["winch_modes"] == result.metrics["winch_modes"]


def test_values_of_one_time_serve_together_and_are_kept_in_their_own_kind():
    changes = fit(SCENE, changes_of([(1, "drive.mode", "render"), (1.0, "drive.set_pull", 5000)]))
    assert [(one.key, one.value) for one in changes] == [("drive.mode", "render"), ("drive.set_pull", 5000.0)]
    assert type(changes[1].value) is float


FIX = override(SCENE, {"instruments.encoder.on": True, "instruments.usbl.on": True})  # of 1 Hz


@given(begun=st.floats(0.0, 5.0), lasting=st.floats(1e-3, 2.0), target=st.sampled_from(["encoder", "usbl"]))
def test_a_fault_that_is_accepted_meets_a_reading(begun, lasting, target):
    tick, every = 10_000_000, {"encoder": 1, "usbl": 100}[target]
    rows = changes_of([(begun, f"faults.{target}.kind", "lost"), (begun + lasting, f"faults.{target}.kind", "none")])
    rows = [(tick_of(one, tick), one) for one in rows]
    meets = any(number % every == 0 for number in range(rows[0][0] + 1, rows[1][0] + 1))
    for before in (0, 1000):
        try:
            refuse_unacting(FIX, rows, 10_000, before)
            assert meets
        except ChangeError as error:
            assert not meets and "it would never act; nothing was simulated" in str(error)


def test_a_timetable_gives_each_change_once():
    changes = changes_of([(0.0, "a", 1), (0.019999999, "b", 2), (0.02, "c", 3)])
    assert [tick_of(one, 10_000_000) for one in changes] == [0, 1, 2]
    assert tick_of(changes[0], 10_000_000, 50_000_000) == -5
    table = Timetable((tick_of(one, 10_000_000, 10_000_000), one) for one in changes)
    assert [one.key for one in table.due(0)] == ["a", "b"] and table.left(0) == 1 and not table.due(0)
    assert [one.key for one in table.due(1)] == ["c"] and table.left(1) > 10**9


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            [(0.1, "drive.mode")],
            "changes, item 1: (0.1, 'drive.mode') is no (seconds, key, value); nothing was simulated",
        ),
        (["0.1 drive.mode brake"], "changes, item 1: '0.1 drive.mode brake' is no (seconds, key, value)"),
        ([("1", "drive.mode", "brake")], "item 1 '1 drive.mode brake': time = '1' is no number in [0, 1e+07) s"),
        ([(-1.0, "drive.mode", "brake")], "time = -1.0 is no number in [0, 1e+07) s"),
        ([(float("nan"), "drive.mode", "brake")], "time = nan is no number"),
        (
            [(0.2, "drive.mode", "brake"), (0.1, "drive.mode", "follow")],
            "changes, item 2 '0.1 drive.mode follow': time = 0.1 s is before that of the item before, 0.2 s; nothing",
        ),
        (
            [(0.5, "drive.mode", "brake")],
            "time = 0.5 s is not before the end of the run after 0.5 s; nothing was simulated. Give an earlier time",
        ),
        (
            [(0.101, "drive.mode", "brake"), (0.104, "drive.mode", "follow")],
            "item 1 '0.101 drive.mode brake': drive.mode = brake at 0.101 s ends at 0.104 s, before the next tick "
            "output, that at 0.11 s: it would never act; nothing was simulated. Let it last until then or longer",
        ),
        (
            [(0.1, "drive.inertia", 5.0)],
            "item 1 '0.1 drive.inertia 5.0': drive.inertia is fixed while the tow runs; nothing was simulated. Set it",
        ),
        (
            [(0.1, "drive.mod", "brake")],
            "there is no live key drive.mod; nothing was simulated. Did you mean drive.mode?",
        ),
        ([(0.1, "fire", 1)], "there is no live key fire; nothing was simulated. Live are drive.mode, drive.set_pull, "),
        ([(0.1, "drive.mode", "brakes")], "drive.mode = 'brakes' is none of its values"),
        (
            [(0.1, "drive.set_pull", -5.0)],
            "'0.1 drive.set_pull -5.0': drive.set_pull = -5.0 N is outside [0, 1e+07] N (pull at the drum of mode "
            "tension, and largest of mode render); nothing was simulated. Give a value in [0, 1e+07] N",
        ),
        ([(0.1, "drive.set_pull", "much")], "drive.set_pull = 'much' is text, expected a number in [0, 1e+07] N"),
        (
            [(0.1, "drive.mode", "render")],
            "item 1 '0.1 drive.mode render': drive.set_pull = 0 N is not above 0 N: drive.mode = render pulls with it, "
            "and the cable would run off the drum; nothing was simulated. Give the pull at the drum that is to be kept",
        ),
    ],
)
def test_what_cannot_change_is_refused_before_anything_is_simulated(changes, said, tmp_path):
    with pytest.raises(ChangeError) as error:
        run(SCENE, duration=0.5, changes=changes, out=tmp_path / "run", **HEAVE)
    assert said in str(error.value) and "nothing was simulated" in str(error.value)
    assert "\n" not in str(error.value) and not list((tmp_path / "run").glob("tow/*"))
