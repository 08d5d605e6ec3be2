"""A mesh made from an accuracy: rules, hand-written numbers, refusals, and the promise against a finer mesh."""

import re

import numpy as np
import pytest

from cable_sim_ros.io.scenes.load import SceneError, SceneWarning, override
from cable_sim_ros.runs.mesh import as_json, check, plan_of
from cable_sim_ros.sim import layout
from cable_sim_ros.sim.checks.checks import travel_warnings
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.mesh import mesh_maker
from cable_sim_ros.sim.mesh.mesh_kinds import equal_parts, geometric, graded
from cable_sim_ros.sim.mesh.mesh_sheave import scope_range
from cable_sim_ros.sim.simulator import Simulator
from cable_sim_ros.sim.statics.static_shape import derivative
from verification.meshes.mesh_promise import promise_of, promised_table
from verification.meshes.mesh_tows import tows
from verification.shipped import started

TOWS = {scene.name: scene for scene in tows()}
QUICK = "flume_10m_slow harbour_60m full_scale_stiff three_cables umbilical_400m light_1km deep_tow_6km".split()
pytestmark = pytest.mark.trust


def with_keys(name="full_scale", **values):
    return override(TOWS[name], {key.replace("__", "."): value for key, value in values.items()})


def parts(scene):
    return {part.name: part for part in layout_of(scene).plan.parts}


def test_the_full_scale_tow_comes_out_as_in_the_theory():
    scene = with_keys(accuracy__tension=0.005, accuracy__position=0.01, accuracy__sheave="resultant")
    plan = layout_of(scene).plan
    assert 23 <= plan.mesh.nodes - 1 <= 39
    assert all(row.tension <= 0.005 and row.position <= 0.01 for row in plan.expected)
    start, low, maximum = scope_range(scene, layout_of(scene).route)
    assert {row.scope for row in plan.expected} >= {start, maximum} and low == pytest.approx(0.1 * start)
    assert all(part.reason for part in plan.parts)


def test_there_are_tows_from_a_flume_to_the_deep_sea():
    scopes = [layout_of(scene).route.scope for scene in TOWS.values()]
    assert len(TOWS) >= 20 and min(scopes) < 10.0 and max(scopes) >= 6000.0


@pytest.mark.parametrize("name", TOWS)
def test_every_mesh_is_in_order_at_every_scope(name):
    scene = TOWS[name]
    plan = layout_of(scene).plan
    arc = layout_of(scene).arc
    assert (np.diff(arc) > 0.0).all() and len(arc) == plan.mesh.nodes
    assert arc[-1] == pytest.approx(sum(s.length for s in scene.cable.sections.values()))
    assert (np.diff(plan.mesh.minimum) > 0.0).all() and plan.mesh.minimum[0] > 0.0
    for fraction in plan.mesh.fractions:
        assert fraction[-1] == 1.0 and (np.diff(fraction, prepend=0.0) > 0.0).all()


def test_the_mesh_is_where_the_simulator_lays_it():
    sim = started(TOWS["three_cables"])
    np.testing.assert_allclose(sim.state.arc, layout_of(TOWS["three_cables"]).arc, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["full_scale", "side_scan_fast", "rope_300m", "shear_1500m", "deep_tow_3km"])
def test_the_shape_by_integration_is_that_of_the_elements(name):
    """Independent of each other but for the coefficients: depth within 0.2 % of the scope, tension within 0.3 %."""
    scene = TOWS[name]
    sim = started(scene)
    shape = layout_of(scene).shape()
    assert shape.place[0, 2] == pytest.approx(float(sim.frame.body_position[2]), abs=2e-3 * shape.scope)
    assert shape.tension[-1] == pytest.approx(float(sim.frame.tension), rel=3e-3)


def test_the_fourth_derivative_of_a_hanging_chain_is_that_of_the_catenary():
    """Towed body, no drag, tension H + w s upward from a pull of 45 degrees: against differences of the exact shape."""
    scene = with_keys("full_scale", water__density=900.0, towbody__drag_area=[100.0, 0.9, 1.485], ship__tow_speed=0.2)
    none = {"drag_law": "off", "drag_coefficient": 0.0}
    sections = {name: section.model_copy(update=none) for name, section in scene.cable.sections.items()}
    cable = scene.cable.model_copy(update={"sections": sections})
    shape = layout_of(scene.model_copy(update={"cable": cable})).shape(400.0)
    wet = slice(5, int(np.flatnonzero(np.diff(shape.section))[0]) - 5)
    h, v = shape.force[wet, 0], shape.force[wet, 2]
    w = (0.389 - 900.0 * np.pi / 4 * 1e-4) * 9.81
    a = h / w
    s = v / w  # arc length from the vertex
    t = np.linspace(-3.0, 3.0, 13)[:, None]  # differences of kappa a/(a^2+s^2)(...) by a polynomial fit
    y = np.stack([a**2 / (a**2 + (s + t) ** 2) ** 1.5, a * (s + t) / (a**2 + (s + t) ** 2) ** 1.5])
    exact = np.hypot(*[2.0 * np.polynomial.polynomial.polyfit(t[:, 0], part, 6)[2] for part in y])
    np.testing.assert_allclose(derivative(shape, 4)[wet], exact, rtol=0.03)


@pytest.mark.parametrize("name", QUICK)
def test_the_static_promise_is_kept(name):
    row = promise_of(TOWS[name], 0.0)
    assert row.kept, row
    assert name in promised_table([row])


@pytest.mark.parametrize("fairing", [None, "hair"], ids=str)
def test_the_promise_is_kept_in_a_heave(fairing):
    """Also where cable without lift lies above a faired part, at 6 kn: by the static tow alone it was 21 mm for 8."""
    part = "cable.sections.faired."
    faired = {"ship.tow_speed": 3.09, f"{part}drag_law": None, f"{part}fairing": fairing}
    row = promise_of(override(TOWS["full_scale"], faired) if fairing else TOWS["full_scale"], 24.0)
    assert row.kept, row
    assert abs(row.tension_deviation) < 0.005


def test_the_line_load_wants_elements_by_the_bending_length_and_is_then_within_five_percent():
    scene = with_keys(accuracy__sheave="distribution")
    plan = layout_of(scene).plan
    bending = (scene.cable.bending_stiffness / max(layout_of(scene).shape(450.0).tension)) ** 0.5
    assert parts(scene)["sheave"].longest <= 1.5 * bending * 1.001
    assert plan.mesh.nodes - 1 < 128
    loads = []
    for nodes in (plan.mesh, plan.mesh.doubled.doubled):
        sim = started(scene, nodes)
        angle, load = sim.contact[:, 3], sim.contact[:, 4] + sim.contact[:, 5]
        order = np.argsort(angle)
        loads.append((angle[order], load[order]))
    (coarse_at, coarse), (fine_at, fine) = loads
    inside = np.interp(coarse_at, fine_at, fine)
    assert coarse.max() == pytest.approx(fine.max(), rel=0.05)
    assert np.abs(coarse - inside).max() < 0.05 * fine.max()


def test_ends_of_the_contact_want_half_of_that_and_a_hard_sheave():
    scene = with_keys(accuracy__sheave="ends", contact__penetration_limit=0.01)
    assert parts(scene)["sheave"].longest == pytest.approx(
        0.5 * parts(with_keys(accuracy__sheave="distribution"))["sheave"].longest, rel=0.1
    )


def test_what_is_written_by_hand_stands():
    scene = with_keys(
        mesh__inboard=1,
        mesh__sheave=20,
        mesh__before=0.1,
        mesh__after=0.9,
        mesh__sections={"bare": {"elements": 10, "grading": 10.0}, "faired": {"elements": 6}},
    )
    found = parts(scene)
    assert [found[n].elements for n in ("inboard", "sheave", "bare", "faired")] == [1, 20, 10, 6]
    assert found["bare"].longest == pytest.approx(10.0 * found["bare"].shortest, rel=1e-6)
    assert "hand" in found["sheave"].reason and "hand" in found["bare"].reason
    coarse = layout_of(with_keys(mesh__sheave=2)).plan
    assert max(row.tension for row in coarse.expected) > 0.005, "the promise is that of the mesh, not of the wish"


def test_nothing_is_promised_for_a_tow_that_rises_out_of_the_water():
    scene, plan = plan_of(with_keys(towbody__lift_area=3.0))
    assert any(np.isnan(row.position) for row in plan.expected)
    assert any(row["position"] is None for row in as_json(scene, plan, [])["expected"])


def test_the_checks_know_the_elements_of_a_fed_mesh():
    scene = TOWS["three_cables"]
    table = layout_of(scene).elements
    assert [first for first, _, _ in table] + [table[-1][1]] == pytest.approx(list(layout_of(scene).arc))
    assert {name for _, _, name in table} == {"upper", "faired", "tail"}
    assert min(layout_of(scene).fine_zone) > 0.0


def test_a_section_that_never_comes_outboard_has_one_element():
    assert parts(TOWS["last_metres"])["bare"].elements == 1


def test_less_accuracy_needs_fewer_elements():
    counts = [layout_of(with_keys(accuracy__position=p)).plan.mesh.nodes for p in (0.01, 0.1, 1.0)]
    assert counts == sorted(counts, reverse=True) and counts[0] > counts[-1]


def test_how_lengths_are_cut():
    assert geometric(3, 4.0) == pytest.approx([1 / 7, 3 / 7, 1.0])
    assert graded(7.0, 1.0, 10.0) == pytest.approx([1.0, 2.0, 4.0])
    assert graded(7.0, 1.0, 1.0) == pytest.approx(np.ones(7))
    x = np.linspace(0.0, 1.0, 101)
    assert equal_parts(x, np.ones(101), 4) == pytest.approx([0.25, 0.5, 0.75, 1.0])
    fractions = equal_parts(x, 1e6 * (x > 0.999) + 1.0, 4)
    assert np.diff(fractions, prepend=0.0).min() > 0.25 / 20 / 2, "no part far below the mean"


def test_the_figures_are_plain_and_say_whether_the_promise_is_kept():
    scene, plan = plan_of(TOWS["last_metres"])
    report = as_json(scene, plan, check(scene, plan, seconds=0.0))
    assert report["elements"] == plan.mesh.nodes - 1 == sum(part["elements"] for part in report["parts"])
    assert report["kept"] is True and report["change"][0]["deviation"] is None


BARE = "cable.sections.bare"
TOO_SHORT = "shorter than 0.0159 m, 0.25 of an element at the sheave (0.0638 m)"
SHORT = {f"{BARE}.length": 10.0, "winch.scope": 100.0}
FINE = {"accuracy.position": 1e-4, "solver.tolerance": 1e-7}
FIXED = {"winch.drum": "contact"}
SCOPE, DRUM = "winch.scope", "winch.cable_on_drum"
REFUSED = [  # changes, key, values and bound, the way out
    ({"accuracy.sheave": "ends"}, "accuracy.sheave", "contact.penetration_limit = 0.1", "limit 0.01, or"),
    ({"accuracy.tension": 1e-4}, "accuracy.tension", "0.025 sheave radii", "Give 0.0005 or more"),
    (FINE, "accuracy.position", "= 0.0001 m cannot be met: forces are solved to", "m or more, or solver.tolerance"),
    ({f"{BARE}.elements": 12}, f"{BARE}.elements", "= 12 has no effect: a winch that feeds", "winch.drum: contact"),
    ({SCOPE: 700.0}, SCOPE, "700 m and 8.04 m from drum to sheave are more than the 600 m", "591.9 m"),
    ({DRUM: 100.0}, SCOPE, "450 m and winch.cable_on_drum = 100 m are both given", "Leave one"),
    ({SCOPE: None, DRUM: 595.0}, DRUM, "the 5 m off it do not reach the sheave, 8.04 m on", "Make the cable longer"),
    ({SCOPE: None, DRUM: 0.0}, DRUM, "0.0915 m must stay there (winch.dead_length = 0 m", "Leave 0.0915 m or more"),
    ({SCOPE: 0.2}, SCOPE, "of 0.2 m at the start ends on the mesh at the sheave", "Start with"),
    ({"mesh.sections": {"bar": {"elements": 10}}}, "mesh.sections.bar", "is no section", "Known: bare, faired"),
    ({"mesh.sections": {"bare": 10}}, "mesh.sections.bare", "= 10 is a number", "`bare: {elements: 4}`"),
    (SHORT | {f"{BARE}.length": 0.005}, f"{BARE}.length", TOO_SHORT, "Make it 0.0159 m or longer"),
    (
        SHORT | {"mesh.sections": {"bare": {"elements": 1000}}},
        *("mesh.sections.bare.elements", TOO_SHORT, "Give at most 627 elements"),
    ),
    (FIXED | {SCOPE: None}, f"{BARE}.elements", "is missing", "Give the number of elements"),
    (FIXED, SCOPE, "= 450 m has no effect: with winch.drum = contact", "Leave it out"),
    (FIXED | {SCOPE: None, "mesh.sheave": 3}, "mesh.sheave", "= 3 has no effect: with winch.drum", "winch.drum: feed"),
]


@pytest.mark.parametrize(("changes", "key", "what", "remedy"), REFUSED)
def test_a_mesh_that_makes_no_sense_is_refused(changes, key, what, remedy):
    with pytest.raises(SceneError) as error:
        with_keys(**changes)
    assert any(told.key == key and what in told.what and remedy in told.remedy for told in error.value.problems)


def test_a_place_that_no_mesh_of_so_many_elements_keeps_is_refused(monkeypatch):
    monkeypatch.setattr(mesh_maker, "MAX_ELEMENTS", 15)
    layout._made.clear()
    try:
        with pytest.raises(SceneError, match=r"accuracy.position = 0.02 m cannot be met: .* more than 15 are not made"):
            with_keys(accuracy__position=0.02)
    finally:
        layout._made.clear()


def test_cautions_of_a_winch_that_feeds():
    with pytest.warns(SceneWarning, match=r"elements of 0.1\d+ m, more than 0.1 m, 0.4 of .* Give mesh.sheave more"):
        with_keys(mesh__sheave=2)
    assert not any(travel_warnings(layout_of(TOWS["full_scale"]), 400.0, 100.0)), "the fine mesh stays at the sheave"
    (warning,) = travel_warnings(layout_of(TOWS["full_scale"]), 0.0, 200.0)
    assert (warning.key, warning.bound, warning.unit) == ("winch.scope", 200.0, "m")
    assert warning.value == pytest.approx(142.0, abs=0.5)


def test_a_mesh_fixed_to_the_material_has_no_plan():
    scene = with_keys(
        winch__drum="contact",
        winch__scope=None,
        cable__sections__bare__elements=40,
        cable__sections__faired__elements=12,
    )
    assert layout_of(scene).plan is None
    text = (
        r"full_scale: winch.drum = contact has its mesh written in cable.sections.\*.elements; no mesh is made. Leave"
    )
    with pytest.raises(SceneError, match=text):
        plan_of(scene)


def test_forces_are_solved_to_what_the_place_asks_for():
    name, place = "deep_tow_6km", 1e-3
    fine = with_keys(name, accuracy__position=place)
    plan = layout_of(fine).plan
    assert layout_of(TOWS[name]).plan.tolerance == 1e-7 > plan.tolerance
    assert all(row.position <= place for row in plan.expected)
    assert Simulator(fine).tolerance == pytest.approx(plan.tolerance * fine.contact.working_tension)
    with pytest.raises(SceneError, match="cannot be met") as refused:
        with_keys(name, accuracy__position=1e-6)
    least = float(re.search(r"Give (\S+) m or more; round-off allows no less", str(refused.value))[1])
    # what is refused names a number that is taken
    plan = layout_of(with_keys(name, accuracy__position=least)).plan
    assert all(row.position <= least for row in plan.expected)
