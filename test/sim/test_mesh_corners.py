"""Bodies and terminations turn the line: the elements beside such a corner, their error, and the check that sees it."""

import re

import pytest
from underway import cautioned, refused, scene_with

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.runs.mesh import check, extrapolated, kept
from cable_sim_ros.runs.verdict import judge
from cable_sim_ros.sim.checks.deviation_checks import hauled_into_waves
from cable_sim_ros.sim.layout import Layout, layout_of
from cable_sim_ros.sim.mesh import mesh_maker
from cable_sim_ros.sim.mesh.mesh_corners import Turn, error_per_turn, stiffness
from cable_sim_ros.sim.mesh.mesh_kinds import places_outboard
from verification.meshes import mesh_promise
from verification.meshes.mesh_tows import other_tows
from verification.shipped import started

TOWS = {tow.scene.name: tow for tow in other_tows()}
LIMP = override(TOWS["heavy_depressor"].scene, {"cable.bending_stiffness": 0.0, "cable.bending_damping": 0.0})
pytestmark = pytest.mark.trust


def test_there_are_twenty_tows_of_every_kind():
    assert len(TOWS) == 20
    scenes = [tow.scene for tow in TOWS.values()]
    assert sum(bool(scene.bodies) for scene in scenes) >= 8
    assert sum(len(scene.bodies) > 1 for scene in scenes) >= 2
    assert sum(any(s.termination_mass for s in scene.cable.sections.values()) for scene in scenes) >= 4
    assert sum(scene.seabed.depth is not None for scene in scenes) >= 2
    assert sum(tow.plan is not None for tow in TOWS.values()) >= 2
    assert sum(scene.water.waves.height > 0.0 for scene in scenes) >= 3


@pytest.mark.parametrize("bending", [0.05, 0.3])
def test_many_short_cubics_resist_a_turn_as_a_beam_under_tension_does(bending):
    """T w'' - EI w'''' with w' = a e^(-s/l): the moment at its end is T l a, l = sqrt(EI/T)."""
    sizes = tuple(0.1 * bending * 1.1**k for k in range(60))
    assert stiffness(sizes, bending) == pytest.approx(bending, rel=1e-4)


def test_one_long_cubic_of_a_string_resists_it_by_a_ninth_of_its_length():
    assert stiffness((7.0,), 0.0) == pytest.approx(7.0 / 9.0)
    turn = Turn(0.5, 100.0, (0.0, 0.0))
    assert error_per_turn(turn, (7.0,), (7.0,)) == pytest.approx(7.0 / 18.0)
    assert error_per_turn(turn, (1000.0,), (0.01,)) == pytest.approx(0.01 / 9.0, rel=1e-4), "one side is enough"


def test_one_element_a_side_of_2_3_bending_lengths_is_within_4_percent():
    turn = Turn(0.5, 100.0, (0.04, 0.04))
    assert error_per_turn(turn, (0.093, 9.3), (0.093, 9.3)) < 0.035 * 0.02
    assert error_per_turn(turn, (9.3,), (0.02, 2.0)) > 0.02, "a string's hinge is too stiff for a cable that bends"


@pytest.mark.parametrize("name", ["heavy_depressor", "clump_and_float", "dragged_sled"])
def test_the_static_promise_is_kept_beside_bodies(name):
    """The place erred by 152 mm with the depressor; the sled on the ground came to rest 0.36 m elsewhere by chance."""
    got = mesh_promise.measure(TOWS[name], 0.0)
    assert got.kept, got
    assert name in mesh_promise.markdown([got])
    reasons = [part.reason for part in layout_of(TOWS[name].scene).plan.parts]
    assert any("corner of" in reason for reason in reasons) or not TOWS[name].scene.bodies


def without_corners(scene, monkeypatch):
    monkeypatch.setattr(mesh_maker, "corners", lambda *_: [])
    return Layout(scene).plan


def test_the_check_sees_an_error_of_the_first_order_whole(monkeypatch):
    """One doubling showed 11.7 of 22 mm."""
    scene = TOWS["termination_20kg"].scene
    plan = without_corners(scene, monkeypatch)
    (static,) = check(scene, plan, seconds=0.0)
    assert 0.019 < static.position < 0.028
    assert not kept(plan, layout_of(scene).route.scope, [static])


def test_what_is_left_after_two_halvings_falls_as_they_did():
    assert extrapolated(8.0, 4.0) == pytest.approx(16.0)
    assert extrapolated(15.0, 15.0 / 16.0) == pytest.approx(16.0)
    assert extrapolated(1.0, 3.0) == pytest.approx(7.0), "nothing is known of what grows: at least as much again"
    assert extrapolated(0.0, 0.0) == 0.0


@pytest.mark.parametrize("hauled", [0.0, 100.0, 250.0])
def test_short_elements_move_with_the_material(hauled):
    scene = TOWS["heavy_depressor"].scene
    plan, total = layout_of(scene).plan, sum(s.length for s in scene.cable.sections.values())
    wound = total - layout_of(scene).route.scope - 8.0 + hauled
    places = places_outboard(plan.mesh, total, wound)
    node = int(plan.mesh.boundaries[0]) - (len(plan.mesh.aboard) - 1)
    assert places[node] == pytest.approx(450.0), "the depressor stands on its node"
    beside = {part.name: part.longest for part in plan.parts if "corner of" in part.reason}
    assert places[node + 1] - places[node] == pytest.approx(beside["faired, begin"])
    assert places[node] - places[node - 1] == pytest.approx(beside["bare, end"])


def test_numbers_by_hand_stand_and_their_error_is_told():
    by_hand = {"mesh.sections": {name: {"elements": 12} for name in ("bare", "faired")}}
    plan = layout_of(override(TOWS["heavy_depressor"].scene, by_hand)).plan
    assert [part.elements for part in plan.parts if part.place == "outboard"] == [12, 12]
    assert max(row.position for row in plan.expected) > 0.1


def test_a_place_that_the_shortest_elements_do_not_keep_is_refused():
    said = refused(override, LIMP, {"accuracy.position": 3e-4, "solver.tolerance": 1e-10})
    assert "accuracy.position = 0.0003 m cannot be met: bodies.wing turns the line by " in said
    assert re.search(r"corners err by \S+ m with \S+ m of scope; nothing was started. Give \S+ m or more", said)


def test_waves_want_short_elements_near_the_surface():
    scene = TOWS["wave_of_4_s"].scene
    calm, plan = layout_of(override(scene, {"water.waves": {}})).plan, layout_of(scene).plan
    assert calm.mesh.nodes + 20 < plan.mesh.nodes < 120
    assert any("waves of the water" in part.reason for part in plan.parts)
    start = layout_of(scene).route.scope
    assert all(row.tension <= 1.5 * scene.accuracy.tension for row in plan.expected if row.scope >= start)


def test_the_promise_is_kept_in_waves_alone():
    """The deviation of the tension was 9 % low."""
    tow = TOWS["wave_of_4_s"]
    pulls = []
    for mesh in (layout_of(tow.scene).plan.mesh, layout_of(tow.scene).plan.mesh.doubled):
        tension, _, problem = mesh_promise._run(tow, tow.scene, mesh, 25.0)
        assert not problem
        pulls.append(tension[100:])
    assert pulls[0].std() == pytest.approx(pulls[1].std(), rel=tow.scene.accuracy.tension)


def test_a_mesh_by_hand_too_coarse_for_its_waves_brings_a_caution():
    said = cautioned(override, TOWS["wave_of_4_s"].scene, {"mesh.sections": {"cable": {"elements": 12}}})
    text = r"water.waves.period = 4 s makes .* err by \S+ of itself, more than 0.0075, 1.5 of accuracy.tension: "
    assert re.search(text, "\n".join(said))


def test_a_haul_to_where_the_mesh_is_too_coarse_for_the_waves_is_doubtful():
    """The mesh is made for the waves from the scope of the start on; shallower, the verdict says what it errs by."""
    scene = scene_with(water__waves__kind="airy", water__waves__height=1.0, water__waves__period=5.0)
    assert not hauled_into_waves(scene, 449.0) and not hauled_into_waves(load_scene("full_scale"), 100.0)
    (reason,) = hauled_into_waves(scene, 200.0)
    assert reason.flag == "MESH_WAVES" and "450 m to 200 m" in reason.text
    said = float(re.search(r"err by (\S+) %", reason.text)[1])
    error = {row.scope: row.tension for row in layout_of(scene).plan.expected}
    assert 1.5 < said / 100.0 / scene.accuracy.tension and said < 100.0 * error[135.0]
    sim = started(scene)
    frames = sim.run(2).copy()
    assert "MESH_WAVES" not in {reason.flag for reason in judge(frames, scene).reasons}
    frames["scope"] = 200.0
    assert "MESH_WAVES" in {reason.flag for reason in judge(frames, scene).reasons}
