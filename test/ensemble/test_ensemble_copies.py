"""Copies feel nothing of each other: alone, in company, with a look-ahead or after others are let go, the same bits."""

import re
from math import pi
from pathlib import Path

import numpy as np
import pytest

from cable_sim_ros.io.scenes.document import SceneError
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.rigid_model import RIGID, STRIP
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.physics.towbody import BodyModel
from cable_sim_ros.physics.wing import WING
from cable_sim_ros.sim.inputs import ShipMotion, WinchCommand
from cable_sim_ros.sim.simulator import Simulator, SolverError
from cable_sim_ros.sim.tables.rigid_tables import rigid_tables
from cable_sim_ros.tools.ensemble import copies as module
from cable_sim_ros.tools.ensemble.copies import FIGURES, Ensemble, EnsembleEnded, band_of, level_of
from cable_sim_ros.tools.ensemble.coverage import ENSEMBLES, seed_of
from cable_sim_ros.tools.ensemble.limits import MAX_SEED
from cable_sim_ros.tools.ensemble.plan import NOMINAL, EnsembleError, EnsemblePlan, draw_of, load_plan, scene_of

SECOND = 1_000_000_000
COUNT = 60  # ticks
STILL = {"cable.sections.armoured.drag_amplification": 1.0}


@pytest.fixture(scope="module")
def scene():
    return override(load_scene("side_scan"), {"solver.tick": 0.05})


def motion(seconds=6.0, begin=0.0):
    w = 2.0 * pi / 6.0
    for t in np.arange(begin + 0.02, seconds, 0.02).tolist():
        yield ShipMotion(
            time_ns=round(t * SECOND),
            position=(2.0 * t, 0.0, 0.4 * np.sin(w * t)),
            velocity=(2.0, 0.0, 0.4 * w * np.cos(w * t)),
            attitude=(0.0, 0.0, 0.0),
            rate=(0.0, 0.0, 0.0),
        )


def ran(scene, draws, peep=False):
    ensemble = Ensemble(scene, EnsemblePlan(copies=5), draws=draws)
    ensemble.start()
    for one in motion():
        ensemble.push(one)
    ensemble.push(WinchCommand(rate=0.2, time_ns=SECOND))
    first = ensemble.run(COUNT // 2, 10)
    if peep:
        *_, seen = ensemble.ahead(20, [], [WinchCommand(rate=-0.5, time_ns=2 * SECOND)], 10)
        assert seen is not None and seen.time[-1] == first.time[-1] + SECOND
    second = ensemble.run(COUNT // 2, 10)
    return np.concatenate([np.stack([b.nominal, *b.values]) for b in (first, second)], axis=1)


def test_a_copy_has_the_same_bits_alone_and_in_company_and_with_a_look_ahead(scene):
    plan = EnsemblePlan(copies=5)
    draws = [draw_of(plan, number) for number in range(6)]
    together = ran(scene, draws)
    assert len({rows.tobytes() for rows in together}) == 6, "the copies are not all the same"
    alone = ran(scene, [NOMINAL, draws[3]])
    assert np.array_equal(alone[0], together[0]) and np.array_equal(alone[1], together[3])
    assert np.array_equal(ran(scene, draws[:3], peep=True), together[:3])
    sim = Simulator(scene)  # the tow itself, without any ensemble
    sim.start()
    for one in motion():
        sim.push(one)
    sim.push(WinchCommand(rate=0.2, time_ns=SECOND))
    assert np.array_equal(module.figures_of(sim.run(COUNT)[9::10]), together[0])


def test_after_others_are_let_go_a_copy_goes_on_with_the_same_bits(scene):
    values = []
    for number in (6, 5):
        ensemble = Ensemble(scene, EnsemblePlan(copies=number))
        ensemble.start()
        for one in motion():
            ensemble.push(one)
        ensemble.run(50)
        ensemble.let_go(5)
        band = ensemble.run(50)
        assert band.members == 5
        values.append(band.values)
    assert np.array_equal(*values)


def test_a_draw_is_of_seed_and_number_and_as_wide_as_it_says():
    few, many = EnsemblePlan(copies=5), EnsemblePlan(copies=500)
    assert draw_of(few, 4) == draw_of(many, 4) != draw_of(few, 3) and draw_of(few, 0) is NOMINAL
    assert draw_of(few, 4) != draw_of(few.model_copy(update={"seed": 2}), 4)
    drawn = [draw_of(many, number) for number in range(1, 2001)]
    for name, half in (("drag", 0.2), ("speed", 0.1), ("east", 0.1), ("turn_deg", 15.0)):
        off = np.array([getattr(draw, name) for draw in drawn]) - getattr(NOMINAL, name)
        inside = np.mean(np.abs(off) <= half)
        assert 0.935 <= inside <= 0.965, "0.95 with three standard deviations of 2000 draws"
    assert all(draw.payout == 0.0 for draw in drawn)


def test_what_copies_are_warned_of_is_told_once_and_that_of_the_scene_is_not(scene):
    from cable_sim_ros.tools.ensemble.command import of_copies

    with pytest.warns(UserWarning) as caught:
        override(load_scene("full_scale_contact"), {})
    own = str(caught.pop(UserWarning).message)
    texts = [f"override of a: the tow rises {n} m above the surface" for n in ("1.5", "2e-1")]
    assert of_copies(scene, texts) == ["warned of 2 x in the copies, first: the tow rises 1.5 m above the surface"]
    assert of_copies(load_scene("full_scale_contact"), [own]) == []


def test_twins_follow_the_seed_and_no_two_ensembles_have_the_same():
    seeds = {seed_of(seed, group) for seed in range(10) for group in range(ENSEMBLES)}
    assert len(seeds) == 10 * ENSEMBLES and all(0 <= seed <= MAX_SEED for seed in (*seeds, seed_of(MAX_SEED, 5)))


def test_the_scene_of_a_draw_has_its_numbers(scene):
    draw = NOMINAL._replace(drag=1.5, speed=0.1, payout=3.0)
    one = scene_of(scene, draw, 0.0)
    assert one.towbody.drag_area == pytest.approx(tuple(1.5 * area for area in scene.towbody.drag_area))
    assert one.water.current == pytest.approx((scene.water.current[0] - 0.1, scene.water.current[1]))
    assert one.winch.scope == pytest.approx(scene.winch.scope + 3.0)


@pytest.mark.parametrize("name", ["side_scan_fish", "depressor", "two_part"])
def test_a_factor_on_the_drag_is_on_that_of_every_body_and_leaves_lift(name):
    """Drag of hull and wings by the factor, to rounding; lift and what it induces, mass, weight: the same bits."""
    plain, more = (_bodies(scene_of(load_scene(name), NOMINAL._replace(drag=drag), 0.0)) for drag in (1.0, 1.5))
    drags = {(RIGID, "drag"), (STRIP, "across"), (WING, "drag")}
    for one, other in zip(plain, more, strict=True):
        for column in one.dtype.names:
            factor = 1.5 if (one.dtype, column) in drags else 1.0
            assert np.allclose(other[column], factor * one[column], rtol=1e-12 * (factor != 1.0), atol=0.0), column


def _bodies(scene):
    rigid = [body for body in (scene.towbody, *scene.bodies.values()) if body.model is BodyModel.RIGID]
    assert any(body.wings for body in rigid)
    return rigid_tables(list(enumerate(rigid)), scene.gravity, scene.water.density)


def test_a_factor_on_the_drag_that_its_bound_does_not_allow_refuses_the_copy(scene):
    """Not that of the bound in its place."""
    rough = override(scene, {"cable.sections.armoured.drag_amplification": 9.0})
    with pytest.raises(SceneError, match=r"cable.sections.armoured.drag_amplification = 13.5"):
        scene_of(rough, NOMINAL._replace(drag=1.5), 0.0)


def test_the_band_holds_a_further_draw_as_often_as_it_says():
    """Order statistics: with 39 copies the ends are the least and the largest, and hold 38 of 40."""
    assert level_of(39) == level_of(50) == pytest.approx(0.95) and level_of(9) == pytest.approx(0.8)
    chance, inside = np.random.default_rng(3), []
    for _ in range(500):
        values = chance.standard_normal((40, 1, len(FIGURES)))
        band = band_of((np.zeros(1), values[0]), list(values[1:]))
        assert band.low == pytest.approx(values[1:].min(axis=0))
        truth = chance.standard_normal((1, len(FIGURES)))
        inside.append((truth >= band.low) & (truth <= band.high))
    assert np.mean(inside) == pytest.approx(0.95, abs=4.0 * np.sqrt(0.95 * 0.05 / 3000))


def test_a_copy_that_is_given_up_is_named_and_too_many_are_no_band(scene, monkeypatch):
    plan, bad, real = EnsemblePlan(copies=9), [], Simulator.run

    def run(sim, count):
        if sim in bad:
            raise SolverError("gave up")
        return real(sim, count)

    monkeypatch.setattr(Simulator, "run", run)
    ensemble = Ensemble(scene, plan)
    ensemble.start()
    bad.append(ensemble._sims[4])
    band = ensemble.run(20)
    assert band.members == 8 and [(lost.number, lost.why) for lost in ensemble.lost] == [(4, "gave up")]
    bad.append(ensemble._sims[5])
    with pytest.raises(EnsembleEnded, match=r"2 of 10 copies were given up, the first \(drag = .*no band. Narrow the"):
        ensemble.run(20)


def test_the_file_of_the_page_is_the_default_but_for_what_it_adds(tmp_path, scene):
    page = (Path(__file__).parents[2] / "docs" / "ensemble.md").read_text("utf-8")
    file = tmp_path / "mine.yaml"
    file.write_text(re.search(r"```yaml\n(.*?)```", page, re.S)[1])
    plan, usual = load_plan(file, {}, scene).model_dump(), EnsemblePlan().model_dump()
    assert plan.pop("ensemble") == "mine" and set(plan.pop("ranges")) == {"towbody.mass"}
    assert str(plan["ahead"].pop("winch")) == "0 hold, 20 rate -0.5"
    del usual["ensemble"], usual["ranges"], usual["ahead"]["winch"]
    assert plan == usual


@pytest.mark.parametrize(
    "text, problem",
    [
        ("ensemble: a\ncopies: 2\n", "copies = 2 .*5"),
        ("ensemble: a\nhalf_widths: {drag: 0, speed: 0, current: 0, current_turn_deg: 0}\n", "all copies are the same"),
        ("ensemble: a\nranges: {winch.scope: {low: 5, high: 5}}\n", "is no range"),
        ("ensemble: a\nranges: {winch.scop: {low: 5, high: 6}}\n", "winch.scop"),
        ("ensemble: a\nranges: {towbody.mass: {low: -5, high: 60}}\n", "towbody.mass"),
        ("ensemble: a\nranges: {solver.tick: {low: 0.01, high: 0.1}}\n", "solver.tick is the same in all copies"),
        ("ensemble: a\nranges: {ship.heading_deg: {low: 0, high: 9}}\n", "ship.heading_deg is the same in all copies"),
        ("ensemble: a\nranges: {cable.sections.armoured.elements: {low: 10, high: 20}}\n", "ranges.cable.sections.arm"),
        ("ensemble: a\nahead: {winch: '0 haul 3'}\n", "ahead.winch.*is no plan"),
        ("ensemble: a\nahead: {seconds: 200}\n", "ahead.seconds = 200 s is beyond .*raise winch.command_timeout"),
        ("", "a.yaml"),
    ],
)
def test_a_file_that_cannot_be_is_refused_in_a_line(text, problem, tmp_path, scene):
    file = tmp_path / "a.yaml"
    file.write_text(text)
    with pytest.raises(EnsembleError, match=problem) as error:
        load_plan(file, {}, scene)
    assert "a.yaml" in str(error.value)


def test_flags_of_copies_are_judged_as_those_of_a_run_and_counted(scene):
    from cable_sim_ros.tools.ensemble.copies import Seen, flagged, of_recorded

    def seen(*words, tension=100.0):
        one = Seen(scene)
        for part in (words[:1], words[1:]):
            frames = np.zeros(len(part), [("status", "i8"), ("tension_most", "f8")])
            frames["status"], frames["tension_most"] = part, tension
            one.take(frames)
        return one

    ticks = round(1.0 / scene.solver.tick)
    well, slack = [0] * 3 * ticks, [int(Flag.SLACK)] * ticks
    tows = {0: seen(*well), 1: seen(*well, *slack), 2: seen(*slack[1:], *well), 3: seen(*well, tension=1e6)}
    told = flagged(tows, 3)
    assert set(told) == {"SLACK", "OVERLOAD"}
    assert told["SLACK"].startswith("SLACK in 2 of 3 copies, for up to 1 s (25 %): part of the cable carried less")
    assert told["OVERLOAD"].startswith("OVERLOAD in 1 of 3 copies: ")
    tows[0] = tows[1]
    assert flagged(tows, 3)["SLACK"].startswith("SLACK in 2 of 3 copies and in copy 0, for")
    stale = seen(*well, *[int(Flag.MOTION_STALE | Flag.SLACK)] * 3 * ticks)
    (line,) = of_recorded(stale, told)
    assert line.startswith("the recorded tow: MOTION_STALE for 3 s (50 % of the run): there was no motion")
    assert flagged({0: seen(*slack), 1: seen()}, 1)["SLACK"].startswith("SLACK in copy 0 alone, for")


def test_a_scene_that_no_band_can_be_of_is_refused(scene):
    strums = override(load_scene("side_scan"), {"viv.law": "govardhan_williamson", **STILL})
    with pytest.raises(EnsembleError, match="half_widths.drag = 0.2 multiplies .* govardhan_williamson computes"):
        load_plan(None, {}, strums)
    with pytest.raises(EnsembleError, match=r"every = 10 s is 1000 ticks of solver.tick = 0.01 s, more than 500"):
        load_plan(None, {"every": 10.0}, load_scene("side_scan"))
    with pytest.raises(EnsembleError, match="towbody.model = vehicle is driven by poses, which the copies do not hear"):
        load_plan(None, {}, load_scene("rov_tether"))
