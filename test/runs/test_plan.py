"""What a plan says, against figures read off the tick outputs by hand; rules of a run in JSON, bag and replay."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from cable_sim_ros.cli import commands
from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.io.scenes.document import find_bag
from cable_sim_ros.io.scenes.load import SceneWarning, load_scene, override, scene_from_text
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.passage import MEANING
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.verdict import check, verdict_of
from cable_sim_ros.tools.plan.plan import NEEDS, NoWinch, most_power, motor_pull, needs_of, plan_of, smallest
from cable_sim_ros.tools.report.subject import subject_of
from cable_sim_ros.tools.report.verdict import cards

pytestmark = pytest.mark.trust
SHORT = [
    "water.waves.kind=off",
    "water.waves.height=0",
    "winch.scope=200",
    "winch.most_scope=250",
    "mesh.sections.conducting.elements=12",
    "rules.turns_left=1200",
]


def call(*words):
    return CliRunner().invoke(commands.main, [str(word) for word in words])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """20 s of the recovery, 200 m out: JSON of the plan, tick outputs, scene, folder."""
    out = tmp_path_factory.mktemp("plan") / "run"
    line = ["plan", "recovery_3t", "--heave", "1,8", "--duration", 20, "--winch", "2 rate -0.5", "--json", "--out", out]
    line += [word for value in SHORT for word in ("--set", value)]
    done = call(*line)
    assert done.exit_code == 0, done.output
    run = load_run(out / "tow")
    return json.loads(done.stdout), run.frames, scene_from_text(run.custom_data["scene_yaml"], "bag"), out


@pytest.fixture(scope="module")
def rows(made):
    return {row["need"]: row for row in made[0]["plan"]}


def largest(values):
    """Value and place of the largest, by hand."""
    at, most = 0, -float("inf")
    for index, value in enumerate(values):
        if value > most:
            at, most = index, value
    return float(values[at]), at


@pytest.mark.parametrize(
    "need, field, sign, has",
    [
        ("rate", "payout_rate_tick_max", 1.0, 2.5),
        ("acceleration", "payout_acceleration_tick_max", 1.0, None),
        ("power", "motor_power", 1.0, 1e5),
        ("power_back", "motor_power", -1.0, 1e5),
        ("breaking_load", "tension_most", 1.0, 1.67e5),
        ("working_load", "tension_most", 1.0, 1.67e5 / 2.5),
    ],
)
def test_a_peak_its_time_and_its_margin(rows, made, need, field, sign, has):
    frames = made[1]
    value, at = largest(sign * frames[field])
    row = rows[need]
    assert row["needed"] == value and row["has"] == has
    assert row["at_s"] == pytest.approx((at + 1) * 0.05), "a tick output is the end of its tick"
    if has is None:
        assert row["margin"] is None and row["margin_share"] is None
    else:
        assert row["margin"] == pytest.approx(has - value) and row["margin_share"] == pytest.approx(1.0 - value / has)


def test_torque_is_judged_where_least_of_it_is_left(rows, made):
    """On the layer that runs off: the curve is that of the first, 70 kN up to 1.2 m/s, 1e5 W at most."""
    _, frames, scene, _ = made
    first = scene.winch.drum_radius + 0.5 * scene.cable.diameter
    left = []
    for frame in frames:
        gear = first / frame.drum_lay_radius
        speed = abs(frame.payout_rate) * gear
        assert speed < 1.2
        can = gear * min(7e4, 1e5 / max(speed, 1e-12))
        left.append((can - abs(frame.motor_pull), abs(frame.motor_pull) * frame.drum_lay_radius, can * first / gear))
    at = min(range(len(left)), key=lambda index: left[index][0])
    row = rows["torque"]
    assert row["at_s"] == pytest.approx((at + 1) * 0.05)
    assert (row["needed"], row["has"]) == (pytest.approx(left[at][1]), pytest.approx(left[at][2]))
    assert row["needed"] > 1e4


def test_pull_and_brake_are_those_of_the_layer(rows, made):
    _, frames, scene, _ = made
    value, at = largest(frames.tension_drum_tick_max)
    gear = (scene.winch.drum_radius + 0.5 * scene.cable.diameter) / frames.drum_lay_radius[at]
    assert gear < 0.75, "2.8 km are wound"
    for need, first in (("line_pull", 7e4), ("brake_load", 9e4)):
        assert rows[need]["needed"] == value and rows[need]["has"] == pytest.approx(gear * first)


def test_cable_and_least_tension(rows, made):
    _, frames, scene, _ = made
    stays = 0.3 * layout_of(scene).route.drum
    value, at = largest(frames.scope)
    assert rows["cable_length"]["needed"] == value
    assert rows["cable_length"]["margin"] == pytest.approx(frames.cable_on_drum[at] - stays)
    least, at = largest(-frames.tension_least)
    assert rows["least_tension"]["needed"] == -least and rows["least_tension"]["at_s"] == pytest.approx(0.05 * (at + 1))


def test_the_plan_has_every_need_in_order_with_verdict_and_rules(made):
    plan = made[0]
    assert [row["need"] for row in plan["plan"]] == [name for name, *_ in NEEDS if name not in MEANING]
    assert plan["verdict"]["state"] == "ok" and plan["scene"] == "recovery_3t" and plan["winch"] == "2 rate -0.5"
    assert plan["rules"]["broken"] == ["turns_left"] and plan["notes"] == []
    assert json.loads((made[3] / "plan.json").read_text("utf-8")) == plan


def test_a_recording_has_the_plan_of_its_run(made):
    plan, _, _, out = made
    done = call("plan", out / "tow", "--json")
    again = json.loads(done.stdout)
    assert done.exit_code == 0 and again["plan"] == plan["plan"] and again["rules"] == plan["rules"]
    assert again["winch"] == plan["winch"] and again["verdict"]["state"] == "ok"
    (file,) = (out / "tow").glob("*.mcap")
    table = call("plan", file)
    assert table.exit_code == 0 and "brake_load" in table.stdout and "BROKEN" in table.stdout
    assert table.stdout.rstrip().endswith("verdict: ok")


def test_rules_of_a_run_stand_in_its_figures_its_bag_and_its_replay(made):
    plan, _, _, out = made
    assert json.loads((out / "summary.json").read_text("utf-8"))["rules"] == plan["rules"]
    assert json.loads(load_run(out / "tow").custom_data["rules"]) == plan["rules"]
    again = offline.replay(out / "tow")
    assert json.loads(json.dumps(again.metrics["rules"])) == plan["rules"]
    assert again.metrics["largest_difference"]["difference"] == 0.0


def test_the_scene_of_the_page_has_one_caution():
    """That of waves beside a ship that moves by itself, which --rao takes back; in the file it is accepted."""
    with pytest.warns(SceneWarning) as said:
        override(load_scene("recovery_3t"), {})
    assert len(said) == 1 and "water.waves.ship_motion = independent" in str(said[0].message)


def test_a_run_that_goes_on_may_have_other_rules(tmp_path):
    scene, state = load_scene("full_scale"), tmp_path / "tow.npz"
    offline.run(scene, duration=0.5, save=state)
    watching = override(scene, {"rules.set": "watch", "rules.turns_left": 3.0})
    run = offline.run(watching, duration=0.5, resumed=state)
    assert run.metrics["rules"]["broken"] == [] and run.metrics["rules"]["duration_s"] == pytest.approx(0.5)


def test_a_limit_that_held_the_winch_is_said(made):
    _, frames, scene, _ = made
    for asked, saturated, note in ((1.2, 100 / len(frames), "a limit held the winch"), (1.0, 0.0, "top rate, or it")):
        held = at_top_rate(frames, scene, asked)
        row = next(row for row in needs_of(held, scene) if row.name == "rate")
        assert row.held == pytest.approx(saturated) and ("rate saturated in 25 %" in row.short) == (saturated > 0.0)
        plan = plan_of(held, scene, {})
        assert note in plan["notes"][0] and plan["sufficient"] == (saturated == 0.0)


def at_top_rate(frames, scene, asked):
    """A haul at the largest rate for 100 ticks, of which so many times that rate is asked."""
    held, rate, tick = frames.copy(), scene.winch.max_rate, scene.solver.tick
    held.rate_limited[:], held.command_limited[:] = 0.0, 0.0
    held.rate_limited[100:200], held.payout_rate_tick_max[100:200] = 1.0, rate
    held.payout_setpoint[:] = 200.0 - asked * rate * tick * np.clip(np.arange(len(held)) - 99.0, 0.0, 100.0)
    return held


def test_a_winch_that_does_not_suffice_makes_the_plan_doubtful(monkeypatch, made):
    """A rate 20 % beyond the limit: neither ok nor code 0, on the page too; one least tension on it."""
    _, frames, scene, folder = made
    fast = frames.copy()
    fast.payout_rate_tick_max[50] = 1.2 * scene.winch.max_rate
    metrics = {"tension_min_n": 1.0, "tension_mean_n": 2.0, "duration_s": 20.0, "flags": {}}
    monkeypatch.setattr(offline, "run", lambda *_, **__: offline.Run(fast, dict(metrics), scene=scene))
    done = call("plan", "full_scale", "--motion", "none")
    assert done.exit_code == 4 and "insufficient: rate 3 m/s needed at 2.55 s, has 2.5 (-20 %)" in done.stdout
    assert "WINCH: the winch does not suffice: rate 3 m/s" in done.stdout and "the winch suffices" not in done.stdout
    monkeypatch.setattr(offline, "run", lambda *_, **__: offline.Run(frames, dict(metrics), scene=scene))
    done = call("plan", "full_scale", "--motion", "none")
    assert done.exit_code == 0 and "the winch suffices; least margin: " in done.stdout
    slack = frames.copy()
    slack.tension_least[9] = -0.1
    assert plan_of(slack, scene, {})["short"] == ["least_tension: the cable goes slack"]
    run = offline.Run(frames, dict(metrics), scene=scene)
    page = subject_of(run, (), plan_of(frames, scene, {}))
    (least,) = (card for card in cards(page) if "least" in card.label)
    assert least.label == "least tension along the cable"


def test_the_smallest_winch_is_that_of_the_hardest_sea_and_suffices(made):
    """Jobs in closed form: of seed k (1 + k/10) m/s, and so much of the pull; limits are raised until none holds."""
    _, frames, base, _ = made
    small = override(base, {"winch.max_rate": 0.5, "water.waves.seed": 1})

    def simulate(values):
        scene = override(small, dict(values))
        job = 1.0 + 0.1 * scene.water.waves.seed
        held = at_top_rate(frames, scene, job / scene.winch.max_rate)
        held.payout_rate_tick_max[:] = np.minimum(job, scene.winch.max_rate)
        held.rate_limited[:] *= job > scene.winch.max_rate
        held.motor_pull[:] = held.motor_pull * job
        return offline.Run(held, {}, scene=scene)

    found = smallest(simulate, small, 3)
    limits = {row["key"]: row for row in found["limits"]}
    assert found["seeds"] == [1, 2, 3] and set(found["lacks"]) == {"1", "2", "3"} and found["runs"] == 12
    assert limits["winch.max_rate"]["least"] == pytest.approx(1.3) and limits["winch.max_rate"]["seed"] == 3
    curve = limits["drive.curve_pull"]
    assert len(curve["least"]) == len(base.drive.curve_pull)
    enough = override(small, {"winch.max_rate": 1.3, "drive.curve_pull": [1.000001 * one for one in curve["least"]]})
    rows = {row.name: row for row in needs_of(simulate({"water.waves.seed": 3}).frames, enough)}
    assert not rows["line_pull"].short and not rows["torque"].short

    def endless(values):
        scene = override(small, dict(values))
        return offline.Run(at_top_rate(frames, scene, 1.2), {}, scene=scene)

    with pytest.raises(NoWinch, match="no winch was found that suffices, up to winch.max_rate"):
        smallest(endless, small, 1)


def test_without_a_motor_nothing_is_made_up(made):
    _, frames, scene, _ = made
    servo = scene.model_copy(update={"drive": type(scene.drive)()})
    rows = {row.name: row for row in needs_of(frames, servo)}
    assert all(rows[name].has is None for name in ("line_pull", "torque", "power", "power_back", "brake_load"))
    assert rows["torque"].needed == float(frames.drum_torque.max()) and rows["acceleration"].has == 0.5
    assert rows["power"].needed == float(frames.winch_power_tick_max.max())


def test_the_servo_is_told_apart_and_a_doubtful_verdict_said(tmp_path):
    line = ("plan", "full_scale", "--heave", "1,8", "--duration", "3", "--set", "cable.breaking_load=3200")
    done = call(*line, "--json")
    report = json.loads(done.stdout)
    assert done.exit_code == 4 and report["verdict"]["state"] == "doubtful" and "OVERLOAD" in done.stderr
    assert "drive.model is servo" in report["notes"][0]
    (row,) = [row for row in report["plan"] if row["need"] == "breaking_load"]
    assert row["margin"] < 0.0 and "working_load" not in {row["need"] for row in report["plan"]}


def test_power_and_pull_of_a_motor():
    values = {
        "drive.model": "motor",
        "drive.inertia": 100.0,
        "drive.curve_speed": [0.0, 2.0, 6.0],
        "drive.curve_pull": [2e4, 2e4, 0.0],
    }
    scene = override(load_scene("full_scale"), values)
    assert most_power(scene) == pytest.approx(3.0 * 1.5e4), "v (2e4 - 5e3 (v - 2)) is largest at 3 m/s"
    assert list(motor_pull(scene, np.array([0.0, 1.0, 4.0, 7.0]))) == [2e4, 2e4, 1e4, 0.0]
    weak = override(scene, {"drive.max_power": 3e4})
    assert most_power(weak) == 3e4 and list(motor_pull(weak, np.array([1.0, 2.0]))) == [2e4, 1.5e4]


def test_a_run_that_failed_has_no_plan(monkeypatch, made):
    _, frames, scene, _ = made
    failed = verdict_of([check("HALTED", "the solver gave up after 3.00 s")])
    result = offline.Run(frames, {}, "the solver gave up", scene=scene, verdict=failed)
    monkeypatch.setattr(offline, "run", lambda *_, **__: result)
    done = call("plan", "full_scale", "--motion", "none", "--json")
    report = json.loads(done.stdout)
    assert done.exit_code == 1 and report["verdict"]["state"] == "failed" and "plan" not in report
    assert done.stderr.startswith("error: full_scale: no plan is made of a run that failed: HALTED: the solver gave up")
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "words, text",
    [
        (("no_such_scene",), "error: no_such_scene: no such scene file; nothing was started."),
        (("no_such.mcap",), "no_such.mcap"),
        (("full_scale", "--heave", "1,8", "--motion", "none"), "--heave and --motion none contradict each other"),
        (("full_scale", "--rao", "simple"), "error: full_scale: --rao moves the ship in the waves of the scene"),
        (("recovery_3t", "--rao", "simple", "--every", "0.1"), "rules.tension_rate = 20 Hz is more than 10 Hz"),
        (("full_scale", "--set", "rules.set=watch"), "rules.set = watch, but no threshold is given"),
    ],
)
def test_what_cannot_be_planned_is_one_line(words, text):
    done = call("plan", *words)
    assert done.exit_code == 2 and text in done.stderr and "Traceback" not in done.output


def test_a_recording_that_is_no_run_or_keeps_no_scene_has_no_plan(monkeypatch, made):
    done = call("plan", find_bag("nbp1406"))
    assert done.exit_code == 2 and "has no topic 'sim/health'" in done.stderr
    run = load_run(made[3] / "tow")
    monkeypatch.setattr(offline, "load_run", lambda path: run._replace(custom_data={}))
    done = call("plan", made[3] / "tow")
    assert done.exit_code == 2 and "keeps no scene, so what its winch has is not known: no plan is made" in done.stderr


def test_a_recording_takes_no_options_of_a_run(made):
    bag = made[3] / "tow"
    for words, flag in (
        (("--heave", "1,8"), "--heave"),
        (("--set", "gravity=9.8"), "--set"),
        (("--out", "x"), "--out"),
        (("--faults", "x.yaml"), "--faults"),
        (("--ship", "60 speed 1 over 60"), "--ship"),
    ):
        done = call("plan", bag, *words)
        assert done.exit_code == 2
        assert f"{flag} is of a run, and {bag} is a recording of one; nothing was done; leave it out" in done.stderr
