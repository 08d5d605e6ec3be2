"""Strumming of a tow: start, run, replay, what keeps it and what refuses it."""

from functools import partial

import numpy as np
import pytest
from underway import goes_on, refused, sail, scene_with

from cable_sim_ros.io.bags.bag import read_bag
from cable_sim_ros.io.messages.channels import STRUM as CHANNEL
from cable_sim_ros.io.messages.channels import channels_of, decode
from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.section import Section
from cable_sim_ros.physics.state import NOW, STRUM
from cable_sim_ros.physics.tick_output import SHAPE_COLUMNS, SLOPE_COLUMNS, STRUM_COLUMNS, Flag
from cable_sim_ros.physics.viv_amplification import AMPLITUDE, EXTRA, FREQUENCY, MODE, SPEED, TARGET
from cable_sim_ros.plots.strumming import draw_strum
from cable_sim_ros.runs import offline
from cable_sim_ros.runs.summary import summarize
from cable_sim_ros.sim.checks.checks import warnings
from cable_sim_ros.sim.inputs import WinchCommand
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.live_parameters import set_live
from cable_sim_ros.sim.rig.rig import Rig
from cable_sim_ros.sim.simulator import SolverError
from cable_sim_ros.sim.tables.viv_tables import drag_factor, strumming_of
from verification.shipped import started

pytestmark = pytest.mark.trust
ON = {
    "viv.law": "govardhan_williamson",
    "cable.sections.bare.drag_amplification": 1.0,
    "cable.sections.faired.drag_amplification": 1.0,
}
COLUMN = {name: k for k, (name, _) in enumerate(STRUM_COLUMNS)}


def drag_factors(scene):
    """By section, of a speed."""
    return [partial(drag_factor, one) for one in strumming_of(scene)]


strumming = partial(scene_with, **ON, setpoint__algorithm="hold")


def row(sim):
    return sim.state.nodes[NOW, STRUM]


def heave(sim, seconds, jump=0.0):
    """50 Hz of a ship that tows ahead and heaves 1 m with a period of 8 s, and after 0.2 s jumps up [m]."""
    w = 2.0 * np.pi / 8.0
    for t in 0.02 * np.arange(round(50 * seconds)):
        sail(sim, t, np.sin(w * t) + (jump if t > 0.19 else 0.0), w * np.cos(w * t))


@pytest.fixture(scope="module")
def tow():
    sim = started(strumming())
    return sim, sim.snapshot()


@pytest.fixture
def sim(tow):
    tow[0].restore(tow[1])
    return tow[0]


def test_off_there_is_nothing():
    sim = started(load_scene("full_scale"))
    sim.run(120)
    assert not row(sim).any() and sim.strum.shape == (0, len(STRUM_COLUMNS))
    assert sim.output.shape.shape[2] == len(SHAPE_COLUMNS + SLOPE_COLUMNS)
    assert sim.frame.amplification_mean == 1.0 and sim.frame.strum_amplitude_most == 0.0
    assert CHANNEL not in channels_of(sim.scene)


def test_a_start_has_shape_and_factors_that_belong_together(sim):
    depth, drag = sim.frame.body_position[2], row(sim)[:, EXTRA].copy()
    assert np.array_equal(drag, row(sim)[:, TARGET]) and drag.max() > 0.9
    frames = sim.run(300)
    assert np.ptp(frames.body_position[:, 2]) < 1e-3 and frames.body_position[-1, 2] == pytest.approx(depth, abs=1e-3)
    assert np.allclose(row(sim)[:, EXTRA], drag, atol=1e-4)


def test_a_faired_section_and_dry_cable_have_a_factor_of_one(sim):
    arc = sim.state.arc
    middle = 0.5 * (arc[1:] + arc[:-1])
    faired = middle > sim.scene.cable.sections["bare"].length
    assert (sim.strum[:-1][faired, COLUMN["amplification"]] == 1.0).all()
    for column in (EXTRA, TARGET, FREQUENCY, AMPLITUDE, MODE):
        assert not row(sim)[:-1][faired, column].any()
    dry = np.minimum(sim.state.q[1:, 2], sim.state.q[:-1, 2]) >= 0.0
    assert dry.any() and not row(sim)[:-1][dry, SPEED:].any() and (sim.strum[:-1][dry, 3:] == (0, 0, 0, 0, 1)).all()
    assert (row(sim)[:-1][~faired & ~dry, EXTRA] > 0.5).all()


def test_a_computed_factor_is_of_the_drag_across_the_cable(sim):
    """The static shape without a mesh, where it is; by hand on both ways 2525 N."""
    bare, tension = "cable.sections.bare.drag_amplification", sim.frame.tension
    assert tension == pytest.approx(layout_of(sim.scene).shape(450.0).tension[-1], rel=2e-3)
    mean = sim.strum[:-1, COLUMN["amplification"]][sim.strum[:-1, COLUMN["amplitude"]] > 0.0].mean()
    hand = {of: override(sim.scene, {"viv.law": "off", bare: mean, f"{bare}_of": of}) for of in ("normal", "both")}
    pulls = {of: layout_of(scene).shape(450.0).tension[-1] for of, scene in hand.items()}
    assert pulls["normal"] == pytest.approx(tension, rel=3e-3) and pulls["both"] > 1.05 * tension


def test_what_is_published_is_what_acts(sim):
    table = sim.strum
    assert table.shape == (sim.nodes, len(STRUM_COLUMNS)) and np.array_equal(table[:, :3], sim.shape[:, :3])
    assert np.array_equal(table[:, COLUMN["amplification"]], 1.0 + row(sim)[:, EXTRA] * (row(sim)[:, SPEED] > 0.0))
    strumming = table[:, COLUMN["amplitude"]] > 0.0
    speed, frequency = table[strumming, COLUMN["normal_speed"]], table[strumming, COLUMN["shedding_frequency"]]
    re = 1026.0 * 0.010 * speed / 1.2e-3
    assert np.allclose(frequency, 0.2 * (1.0 - 20.0 / re) * speed / 0.010)
    # waves take about 450 m / 65 m/s from the sheave to the towbody
    assert np.allclose(table[strumming, COLUMN["mode"]] / frequency, 2.0 * 450.0 / 65.0, rtol=0.08)
    weight = np.diff(sim.state.arc)[row(sim)[:-1, SPEED] > 0.0]
    mean = np.average(table[:-1][row(sim)[:-1, SPEED] > 0.0, COLUMN["amplification"]], weights=weight)
    assert sim.frame.amplification_mean == pytest.approx(mean)


def test_a_factor_changes_no_faster_than_its_rate(sim):
    set_live(sim, "viv.multiplier", 0.0)
    assert not sim.model.line.strum.rules.flags.writeable
    before, fastest = row(sim)[:, EXTRA].copy(), 0.0
    for _ in range(150):
        sim.tick()
        fastest = max(fastest, np.abs(row(sim)[:, EXTRA] - before).max())
        before = row(sim)[:, EXTRA].copy()
    assert fastest == pytest.approx(0.05 * 0.01, rel=1e-9)
    assert not row(sim)[:, TARGET].any() and before.max() > 0.9, "on its way"
    sim.start()
    assert sim.frame.amplification_mean == 1.0, "a start keeps the multiplier"
    set_live(sim, "viv.multiplier", 1.0)
    sim.start()
    assert sim.frame.amplification_mean > 1.5


def test_more_vibration_is_more_drag():
    depths = [-started(strumming(viv__multiplier=m)).frame.body_position[2] for m in (0.3, 1.0, 1.5)]
    assert (np.diff(depths) < -1.0).all()
    factors = [drag_factors(strumming(viv__multiplier=m))[0](0.7) for m in (0.0, 0.3, 0.6, 1.0, 1.5)]
    assert factors[0] == 1.0 and (np.diff(factors) > 0.1).all()


def test_sections_have_numbers_of_their_own():
    base = drag_factors(strumming())
    half = drag_factors(strumming(cable__sections__bare__viv_multiplier=0.5))
    damped = drag_factors(strumming(cable__sections__bare__viv_damping_ratio=0.1))
    none = drag_factors(strumming(cable__sections__bare__viv_multiplier=0.0))
    assert 1.0 < half[0](0.7) < base[0](0.7) and 1.0 < damped[0](0.7) < base[0](0.7) and none[0](0.7) == 1.0
    assert base[1](0.7) == 1.0, "a ribbon"


def test_a_cable_of_links_strums_alike(sim):
    links = started(strumming(cable__model="segments"))
    assert links.frame.body_position[2] == pytest.approx(sim.frame.body_position[2], abs=1.5)
    assert links.frame.amplification_mean == pytest.approx(sim.frame.amplification_mean, abs=0.02)


def test_lock_in_leaves_what_sheds_alike(sim):
    """In a flow that is the same along a straight cable all of it locks in; in the bend of a tow a part."""
    whole, part = sim, started(strumming(viv__lock_in_band=0.2))
    assert (row(part)[:, AMPLITUDE] <= row(whole)[:, AMPLITUDE] + 1e-12).all()
    assert 0.2 * row(whole)[:, AMPLITUDE].max() < row(part)[:, AMPLITUDE].max() < 0.99 * row(whole)[:, AMPLITUDE].max()
    wide = started(strumming(viv__lock_in_band=0.9))
    assert row(wide)[:, AMPLITUDE].max() > row(part)[:, AMPLITUDE].max()


def test_a_run_goes_on_bit_for_bit_from_a_snapshot_and_from_a_file(sim, tmp_path):
    heave(sim, 6.0)
    sim.run(130)
    goes_on(sim, 200, tmp_path)


def test_a_halt_leaves_no_trace():
    """With new targets every tick: the one that is given up, after halvings, has none."""
    sim = started(strumming(viv__period=0.01))
    heave(sim, 1.0, jump=30.0)
    set_live(sim, "viv.multiplier", 0.5)
    with pytest.raises(SolverError):
        for _ in range(40):
            before = row(sim).copy()
            sim.tick()
    assert sim.state.plan[0].halved == 1 and np.array_equal(row(sim), before) and before[:, EXTRA].any()


def test_a_step_taken_back_leaves_no_trace(sim):
    """Halvings within a tick see one factor, and change none."""
    heave(sim, 1.0, jump=1.0)
    before = row(sim).copy()
    frames = sim.run(60)
    assert (frames.status & Flag.HALVED).any() and np.array_equal(row(sim), before), "no second has passed"


def test_a_mesh_that_moves_keeps_its_factors(sim):
    sim.push(WinchCommand(rate=1.0))
    wound = sim.frame.payout
    for _ in range(10):
        sim.run(40)
        sim.push(WinchCommand(rate=1.0))
    assert sim.frame.payout > wound + 2.0
    strumming = row(sim)[:-1][row(sim)[:-1, FREQUENCY] > 0.0]
    assert np.isfinite(row(sim)).all() and np.allclose(strumming[:, EXTRA], strumming[:, TARGET], atol=0.2)
    middle = 0.5 * (sim.state.arc[1:] + sim.state.arc[:-1])
    assert not row(sim)[:-1][middle > sim.scene.cable.sections["bare"].length, EXTRA].any()


def test_steps_that_are_chosen_take_it_too():
    fixed, chosen = started(strumming()), started(strumming(solver__tension_error=1e-3, solver__tick=0.5))
    for sim, ticks in ((fixed, 400), (chosen, 8)):
        set_live(sim, "viv.multiplier", 0.5)
        sim.run(ticks)
    assert row(chosen)[:, EXTRA] == pytest.approx(row(fixed)[:, EXTRA], abs=0.06)


def test_a_run_is_recorded_summed_up_drawn_and_its_replay_is_the_run(tmp_path):
    scene = strumming(**{"setpoint.algorithm": "simplified_sheave"})
    run = offline.run(scene, heave=(1.0, 8.0), duration=3.0, out=tmp_path / "run")
    messages = [m for m in read_bag(run.bag) if m.topic.endswith("cable/strum")]
    assert len(messages) == 3
    last = decode(CHANNEL, messages[-1].data)
    assert last["strum"].shape[1] == len(STRUM_COLUMNS)
    recorded = load_run(run.bag)
    assert [time for time, _ in recorded.strums] == [m for m in recorded.frames.time if m % 10**9 == 0]
    metrics = summarize(recorded.frames)
    assert metrics["strum_amplification"] == pytest.approx(recorded.frames.amplification_mean.mean(), abs=0.01)
    assert run.metrics["strum_amplitude_max_diameters"] == metrics["strum_amplitude_max_diameters"] > 0.9
    assert draw_strum(run.bag, tmp_path / "strumming.png").stat().st_size > 20_000
    again = offline.replay(run.bag, out=tmp_path / "again")
    assert np.array_equal(again.frames, run.frames)
    theirs = [m.data for m in read_bag(again.bag) if m.topic.endswith("cable/strum")]
    assert theirs == [m.data for m in messages], "the same bytes"


def test_a_run_without_it_has_no_figures_and_no_picture(tmp_path):
    run = offline.run("full_scale", duration=1.0, out=tmp_path)
    assert run.metrics["strum_amplification"] is None and not load_run(run.bag).strums
    with pytest.raises(ValueError, match="no channel cable/strum: nothing was drawn; record it with viv.law other"):
        draw_strum(run.bag, tmp_path / "strumming.png")


# ---- refused, and doubtful


def test_a_factor_found_by_hand_and_a_computed_one_are_not_both_taken():
    said = refused(scene_with, viv__law="govardhan_williamson")
    assert "cable.sections.bare.drag_amplification = 2.37 is a drag factor found by hand" in said
    assert "viv.law = govardhan_williamson computes that of this section: it would count twice, must be 1;" in said
    strumming(cable__sections__faired__drag_amplification=2.0)  # a ribbon does not strum: its drag may be raised


def viv_warnings(name="full_scale", **changes):
    scene = scene_with(name, **((ON if name == "full_scale" and "viv__law" not in changes else {}) | changes))
    return [f"{c.key} {c.text}. {c.remedy}" for c in warnings(scene) if "viv" in c.key]


BARE = "cable.sections.bare."
FLUME = {"cable.sections.line.drag_amplification": 1.0, "viv.law": "govardhan_williamson"}
STILL = {"water.current": [-0.1, 0.0], "water.current_gradient": [0.0, 0.0]}


@pytest.mark.parametrize(
    "name, changes, texts",
    [
        ("full_scale", {"viv__law": "off", BARE + "viv_multiplier": 0.5}, ["0.5 has no effect: viv.law is off. Leave"]),
        ("full_scale", {"viv__law": "off", BARE + "viv_damping_ratio": 0.02}, ["= 0.02 has no effect: viv.law is off"]),
        ("full_scale", {BARE + "viv_multiplier": 0.0}, ["has no effect: every section is faired, has no drag or has"]),
        ("full_scale", {}, ["= 1 with cable that is inclined by 14.", " deg on average", "than 35 deg:"]),
        ("flume", FLUME, ["is used at Reynolds numbers of 67", " to 88", "its data are of 500 to 33000: there the"]),
        ("flume", FLUME | STILL, ["no effect: the Reynolds number of the flow across the cable is 3", "below 47"]),
    ],
)
def test_what_has_no_effect_or_is_far_from_its_data_is_said(name, changes, texts):
    found = "\n".join(viv_warnings(name, **changes))
    assert all(text in found for text in texts), found


def test_a_small_multiplier_silences_the_caution_of_inclination_and_a_large_one_does_not():
    assert not viv_warnings(viv__multiplier=0.6)
    assert not viv_warnings(cable__sections__bare__viv_multiplier=0.6)
    for multiplier in (0.85, 1.01):
        (text,) = viv_warnings(viv__multiplier=multiplier)
        assert f"viv.multiplier = {multiplier:g} with cable that is inclined by 1" in text
    (text,) = viv_warnings(viv__multiplier=0.6, cable__sections__bare__viv_multiplier=1.5)
    assert "= 0.6 (0.9 with the viv_multiplier of the section) with cable that is inclined by" in text


def test_amplitudes_and_factors_beyond_their_bounds_are_said():
    found = "\n".join(viv_warnings(viv__multiplier=2.0))
    assert "viv.multiplier = 2 gives amplitudes of up to " in found and "more than 1.3 diameters" in found
    found = "\n".join(viv_warnings(viv__amplification="blevins"))
    assert "viv.amplification = blevins gives a drag factor of 3." in found
    assert " % of the strumming cable is held at the bound of 3" in found


def test_a_damping_that_switches_strumming_off_is_said():
    (text,) = viv_warnings(viv__damping_ratio=1.0)
    assert "viv.damping_ratio = 1 gives section bare a mass damping of " in text
    assert "at which govardhan_williamson has an amplitude of 0 diameters: it does not strum, its drag" in text
    (text,) = viv_warnings(cable__sections__bare__viv_damping_ratio=1.0)
    assert text.startswith("cable.sections.bare.viv_damping_ratio = 1 gives section bare")


def test_keys_of_the_block_without_a_law_have_no_effect():
    found = viv_warnings(viv__law="off", viv__multiplier=0.6, viv__damping_ratio=0.02, viv__amplification="blevins")
    assert [text.partition(":")[0] for text in found] == [
        "viv.damping_ratio = 0.02 has no effect",
        "viv.multiplier = 0.6 has no effect",
        "viv.amplification = blevins has no effect",
    ]


# ---- what the theory has, with factors by hand


@pytest.mark.parametrize("bending, within", [(0.0, 1e-3), (2.82e-6, 5e-3)])
def test_the_sphere_of_the_flume(bending, within):
    """Factor 1.527 with 0.011 in f_n: (-0.7098, -0.6870) m from the point that the line hangs from."""
    line = Section(length=1.01, elements=60, drag_law="driscoll_nahon", drag_amplification=1.527)
    scene = override(load_scene("flume"), {"cable.bending_stiffness": bending, "cable.bending_damping": 0.0})
    cable = scene.cable.model_copy(update={"sections": {"line": line}})
    rig = Rig(cable, held={0: "r"}, bodies={-1: scene.towbody}, tension=0.02, water=scene.water)
    rig.straight((0.0, 0.0, 0.46), (-0.6, 0.0, -0.8))
    rig.settle()
    x, _, z = rig.state.q[-1, :3]
    assert np.hypot(x + 0.7098, z - 0.46 + 0.6870) < within


@pytest.mark.parametrize("factor, depth", [(1.0, 188.0), (2.368, 108.0)])
def test_the_depth_at_full_scale(factor, depth):
    """The wing pulls with 722 N, as printed for fresh water."""
    changes = {f"cable.sections.{name}.drag_amplification": factor for name in ("bare", "faired")}
    scene = scene_with(**changes, towbody__lift_area=-722.0 / (0.5 * 1026.0 * 2.2**2))
    assert -layout_of(scene).shape(450.0).place[0, 2] == pytest.approx(depth, abs=0.5)
