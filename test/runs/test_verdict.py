"""Every end of a run is ok, doubtful or failed: by which flag, for how long, for which figures, with which code."""

from pathlib import Path

import numpy as np
import pytest

from cable_sim_ros import Simulator
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.io.sources.recorded_tow import Residual
from cable_sim_ros.physics.tick_output import TICK_OUTPUT, Flag
from cable_sim_ros.runs import verdict
from cable_sim_ros.runs.offline import run
from cable_sim_ros.runs.step_choice import doubts_of_steps
from cable_sim_ros.runs.summary import SUMMARY
from cable_sim_ros.sim import flag_rules
from cable_sim_ros.sim.flag_rules import CHECKS, DOUBTFUL, FAILED, OK, RULES
from cable_sim_ros.sim.verdict import Verdict, check, judge_counts, of_node, overload, strength, verdict_of

pytestmark = pytest.mark.trust

TICK = 0.01
FLAGS = Path(__file__).resolve().parents[2] / "docs" / "flags.md"
RESERVED = {"SLACK_ENERGY", "SETPOINT_LIMITED", "COMMAND_LIMITED", "LOW_FLOW"}
SHIPPED = load_scene("full_scale")


def frames_of(seconds=60.0, tension=2000.0, **flagged):
    """Tick outputs of a run; flagged: seconds of each flag, from the begin on."""
    frames = np.zeros(round(seconds / TICK), TICK_OUTPUT).view(np.recarray)
    frames.time = np.arange(1, len(frames) + 1) * round(TICK * 1e9)
    frames.tension = frames.tension_most = tension
    for name, lasting in flagged.items():
        frames.status[: round(lasting / TICK)] |= Flag[name]
    return frames


def flags_of(found):
    return [reason.flag for reason in found.reasons]


def test_every_flag_has_a_rule_and_every_figure_exists():
    names = [rule.flag for rule in RULES]
    assert set(names) >= {flag.name for flag in Flag if flag} | RESERVED and len(names) == len(set(names))
    metrics = {name for name, *_ in SUMMARY}
    assert {name for rule in RULES for name in rule.metrics} <= metrics
    assert {name for _, concerned, *_ in CHECKS for name in concerned} <= metrics
    assert not set(names) & {name for name, *_ in CHECKS}


def steps(taken, refused, unsolved=0, error=0.005):
    """Figures of a run that took, refused and could not solve so many steps."""
    return {
        "steps_taken": taken,
        "steps_refused": refused,
        "steps_unsolved": unsolved,
        "step_median_s": 3.125e-3,
        "step_least_s": 7.8e-4,
        "step_tension_error": error,
    }


def test_a_choice_of_the_step_that_never_rests_is_doubtful():
    """As it was with a set-point that jumped: one step in eleven refused."""
    (reason,) = doubts_of_steps(steps(21806, 2039))
    assert reason.flag == "STEP_CONTROL" and "tension_max_n" in reason.metrics
    assert "2039 of 23845 steps tried were taken back, 8.6 % (limit 5 %): 2039 for their error" in reason.text
    assert "median 3.12 ms, shortest 0.78 ms" in reason.text and "--step fixed" in reason.text
    found = verdict.judge(frames_of(), SHIPPED, [reason])
    assert found.state == DOUBTFUL and found.code == 4
    assert doubts_of_steps(steps(380, 0, 21)) and not doubts_of_steps(steps(380, 0, 20))
    assert not doubts_of_steps(steps(1900, 60, 40)) and doubts_of_steps(steps(1900, 61, 40))
    assert not doubts_of_steps(steps(1900, 600, error=None)), "fixed steps are halved where they must"


def test_a_run_without_flags_is_ok():
    found = verdict.judge(frames_of(), SHIPPED)
    assert found == Verdict() and found.code == 0 and found.lines() == ["verdict: ok"]
    assert found.as_dict() == {"state": "ok", "reasons": []}


@pytest.mark.parametrize("rule", [rule for rule in RULES if rule.flag in Flag.__members__], ids=lambda rule: rule.flag)
def test_a_flag_counts_from_its_bound_on(rule):
    bound = max(rule.seconds, 60.0 * rule.fraction)
    below = verdict.judge(frames_of(**{rule.flag: bound}), SHIPPED)
    above = verdict.judge(frames_of(**{rule.flag: bound + TICK}), SHIPPED)
    assert below.state == OK
    if rule.state == OK:
        assert verdict.judge(frames_of(**{rule.flag: 60.0}), SHIPPED).state == OK
        return
    assert above.state == rule.state and flags_of(above) == [rule.flag]
    assert above.reasons[0].seconds == pytest.approx(bound + TICK) and above.reasons[0].metrics == rule.metrics
    assert above.reasons[0].fraction == pytest.approx((bound + TICK) / 60.0)
    assert above.code == {DOUBTFUL: 4, FAILED: 1}[rule.state]


def test_a_share_bears_more_of_a_longer_run():
    stale = next(rule for rule in RULES if rule.flag == "MOTION_STALE")
    assert verdict.judge(frames_of(60.0, MOTION_STALE=3.0)).state == DOUBTFUL
    assert verdict.judge(frames_of(3.0 / stale.fraction + 1.0, MOTION_STALE=3.0)).state == OK


def test_a_cable_beside_its_sheave():
    """500 of 500 ticks as the cable misses its sheave; and a run that ends so, however short it was."""
    found = verdict.judge(frames_of(5.0, DETACHED=5.0), SHIPPED)
    assert found.state == DOUBTFUL and found.code == 4
    assert found.lines() == [
        "verdict: doubtful: the run came to its end, but figures cannot be taken as they are (docs/flags.md)",
        "  DETACHED for 5 s (100 % of the run): the cable was off its sheave or out of its groove: contact, wrap angle "
        "and line loads are not those of one in its groove, tension is that of a cable without its sheave, and the "
        "towbody hangs on another length outboard; in a turn a block that swivels keeps it (sheave.swivel)",
    ]
    assert {"body_depth_m", "body_depth_max_m", "layback_min_m", "layback_max_m"} <= set(found.reasons[0].metrics)
    assert found.headline == "DOUBTFUL: DETACHED 5 s"
    frames = frames_of()
    frames.status[-1] |= Flag.DETACHED
    assert flags_of(verdict.judge(frames)) == ["DETACHED"]


ROSETTE = override(load_scene("lowered_ctd"), {"winch.scope": 12.0, "instruments.depth.on": True})


def with_a_float():
    """The same scope, and the float on the line that crosses is 6 m above a rosette that stays below."""
    data = override(ROSETTE, {"winch.scope": 18.0}).model_dump(mode="json")
    tail = data["cable"]["sections"]["conducting"] | {"length": 10.0, "elements": None}
    data["cable"]["sections"] |= {"tail": tail}
    data["bodies"] = {"float": {"at": "conducting", "mass": 20.0, "net_weight": -100.0, "drag_area": [0.1, 0.1, 0.1]}}
    return type(ROSETTE).model_validate(data)


@pytest.mark.parametrize(("scene", "body"), [(ROSETTE, 0.0), (with_a_float(), 10.0)], ids=["towbody", "on the line"])
@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_run_in_which_a_body_crosses_the_surface_is_doubtful_by_the_slam_it_lacks(scene, body):
    done = run(scene, heave=(0.2, 6.0), duration=6.0, winch="0 rate -1.0", step="fixed")
    f = done.frames
    through = f.status & Flag.SURFACE_CROSSED > 0
    height = f.body_position[:, 2] + body
    assert height[0] < -0.5 < 0.5 < height[-1] and through.any() and not through[[0, -1]].any()
    assert through[f.slam_estimate > 0.0].all() and through[f.slam > 0.0].all()
    reason = next(one for one in done.verdict.reasons if one.flag == "SURFACE_CROSSED")
    assert "none went under" in reason.text, "it is hauled out"
    if body == 0.0:
        assert (f.depth_reading == np.maximum(-f.body_position[:, 2], 0.0)).all(), "a pressure cell shows none in air"


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_load_that_is_lowered_through_the_surface_says_its_slam_and_what_that_leaves_out():
    """Into the water at 1 m/s: A' w^2 of the added mass, and the rest of rho/2 C_s A w^2 in the verdict."""
    begun = override(ROSETTE, {"winch.scope": 5.0, "towbody.added_mass": [100.0, 100.0, 400.0]})
    f = (done := run(begun, heave=(0.1, 6.0), duration=8.0, winch="1 rate 1.0", step="fixed")).frames
    through, half = f.status & Flag.SURFACE_CROSSED > 0, Simulator(begun).model.line.bodies[0].half_height
    assert f.body_position[0, 2] > 0.5 > -0.5 > f.body_position[-1, 2] and done.metrics["slam_max_n"] == f.slam.max()
    speed = -f.body_velocity[f.slam.argmax(), 2]
    assert f.slam.max() == pytest.approx(0.75 * 400.0 / half * speed**2, rel=0.05), "half immersed, at a tick"
    largest = 0.5 * 1026.0 * 5.0 * 1.36 * f.body_velocity[through, 2].min() ** 2
    assert 0.0 < f.slam_estimate.max() < largest
    text = next(one for one in done.verdict.reasons if one.flag == "SURFACE_CROSSED").text
    assert f"about {f.slam_estimate.max():.3g} N of the slam" in text and "DNV-RP-H103" in text
    assert done.metrics["splash_tension_min_n"] < done.metrics["splash_tension_max_n"]


def test_a_winch_limit_matters_to_a_compensation():
    frames = frames_of(WINCH_LIMIT=30.0)
    assert verdict.judge(frames, override(SHIPPED, {"setpoint.algorithm": "hold"})).state == OK
    assert verdict.judge(frames, SHIPPED).state == DOUBTFUL and verdict.judge(frames).state == DOUBTFUL


@pytest.mark.parametrize("left, end", [(0.1, "paying out, the drum was empty"), (100.0, "hauling in, what hangs on")])
def test_the_end_of_the_travel_is_named(left, end):
    frames = frames_of(DRUM_END=5.0)
    frames.cable_on_drum = left
    text = verdict.judge(frames, override(SHIPPED, {"winch.dead_length": 0.2})).reasons[0].text
    assert "; " + end in text


def test_a_push_is_said_with_its_number():
    frames = frames_of(SLACK=1.0)
    frames.tension[5] = -25.0
    text = verdict.judge(frames, SHIPPED).reasons[0].text
    assert text.endswith("; tension at the sheave went down to -25 N, a push")


def test_tension_that_no_cable_carries():
    """102 kN on 10 mm of cable, 1.5 %."""
    found = verdict.judge(frames_of(tension=102e3), SHIPPED)
    assert flags_of(found) == ["OVERLOAD"] and found.code == 4 and found.reasons[0].fraction == 1.0
    assert found.reasons[0].text == (
        "tension went up to 1.02e+05 N, a strain of 1.5 %: above 9.425e+04 N, 1200 MPa of its full circle, which no "
        "steel or fibre rope carries. The cable would have parted; what follows is no tow"
    )
    assert verdict.judge(frames_of(tension=90e3), SHIPPED).state == OK


def test_a_breaking_load_of_the_data_sheet_stands_above_the_guess():
    scene = override(SHIPPED, {"cable.breaking_load": 60e3})
    assert strength(scene) == 60e3
    assert (
        verdict.judge(frames_of(tension=61e3), scene)
        .reasons[0]
        .text.startswith(
            "tension went up to 6.1e+04 N, a strain of 0.9 %: above the breaking load of 6e+04 N. The cable would"
        )
    )
    stronger = override(scene, {"cable.sections.bare.breaking_load": 80e3})
    assert strength(stronger) == 80e3 and not overload(stronger, 79e3)


def test_a_problem_is_a_failure_with_or_without_frames():
    for frames in (frames_of(SLACK=1.0), frames_of(0.0)):
        found = verdict.judge(frames, SHIPPED, problem="the solver gave up after 12 s")
        assert found.state == FAILED and found.code == 1 and found.reasons[0].flag == "HALTED"
        assert found.reasons[0].text == "the solver gave up after 12 s"


@pytest.mark.parametrize(
    "names, code", [((), 0), (("MEAN_TRACK",), 4), (("MEAN_TRACK", "DAMAGE"), 3), (("DAMAGE", "NO_START"), 1)]
)
def test_the_worst_of_several_codes_wins(names, code):
    assert verdict_of(check(name, "so") for name in names).code == code


@pytest.mark.parametrize(
    "row, text",
    [
        (Residual("sheave/tension", "tension", "N", 0.0, 0.0, 1.9, 9), ""),
        (Residual("towbody/pose", "z", "m", 0.0, 0.0, 0.009, 9), ""),
        (Residual("winch/state", "payout rate", "m/s", 0.0, 0.0, 9.0, 9), ""),
        (
            Residual("sheave/tension", "tension", "N", 0.0, 0.0, 28.8, 9),
            "tension of sheave/tension by up to 28.8 N (limit 2 N)",
        ),
        (Residual("towbody/pose", "z", "m", 0.0, 0.0, 0.5, 9), "z of towbody/pose by up to 0.5 m (limit 0.01 m)"),
    ],
)
def test_a_replay_that_is_not_the_run(row, text):
    found = verdict.differences([row], 2000.0)
    assert [reason.text for reason in found] == (
        [f"this replay is not the recorded run: it differs in {text}"] if text else []
    )


def test_counts_say_what_frames_say():
    frames = frames_of(DETACHED=3.0, HALVED=2.0, SLACK=0.05)
    words, counts = np.unique(frames.status, return_counts=True)
    counted = judge_counts(dict(zip(words.tolist(), counts.tolist())), TICK, int(frames.status[-1]), scene=SHIPPED)
    assert counted == verdict.judge(frames, SHIPPED)


def test_a_flag_that_a_version_lacks_counts_for_nothing(monkeypatch):
    ahead = RULES[0]._replace(flag="OF_ANOTHER_VERSION")
    monkeypatch.setattr("cable_sim_ros.sim.verdict.RULES", (ahead, *RULES))
    assert verdict.judge(frames_of(SEABED=60.0), SHIPPED).state == OK


def test_the_figures_of_a_node():
    assert of_node({"skips_ahead": 0, "recorder": {"dropped": 0}}) == () and of_node({}) == ()
    names = [reason.flag for reason in of_node({"skips_ahead": 2, "recorder": {"dropped": 7}})]
    assert names == ["BEHIND", "NOT_RECORDED"]


def test_bounds_are_sane():
    assert 0.0 < flag_rules.WITHIN < 0.05 and 1e9 < flag_rules.MAX_STRESS < 2e9


@pytest.mark.parametrize("trailing, kept", [(0.0, 60.0), (1.4, 58.6), (4.9, 55.1), (6.0, 60.0), (60.0, 60.0)])
def test_a_live_run_ends_with_its_motion(trailing, kept):
    """The node stops a little after the player; a sensor that fell silent for longer counts."""
    frames = frames_of()
    if trailing:
        frames.status[-round(trailing / TICK) :] |= Flag.MOTION_STALE
    assert len(verdict.played(frames)) == round(kept / TICK)
