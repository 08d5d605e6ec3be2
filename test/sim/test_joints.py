"""Sections of their own cable, terminations and bodies on the line: what stops a scene, and what is only a caution."""

from math import pi

import numpy as np
import pytest
from underway import cautioned, refused

from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.io.scenes.load import SceneError, dump_scene, load_scene, override, scene_from_dict
from cable_sim_ros.io.scenes.load import scene_from_text as read
from cable_sim_ros.physics.tick_output import BODY_COLUMNS
from cable_sim_ros.runs.offline import run
from cable_sim_ros.sim.build import build_model
from cable_sim_ros.sim.checks import checks
from cable_sim_ros.sim.layout import layout_of
from verification.shipped import started

pytestmark = pytest.mark.trust
POD = {"at": "bare", "mass": 20.0, "net_weight": 50.0}


def scene(sections=None, bodies=None, base="full_scale_contact", **changes):
    """A shipped scene with other keys of its sections and these bodies."""
    data = load_scene(base).model_dump(mode="json")
    for name, keys in (sections or {}).items():
        data["cable"]["sections"][name] |= keys
    return scene_from_dict(data | {"bodies": bodies or {}} | changes, "tow.yaml")


OF_BARE = [  # keys of the section bare, what is said of one
    ({"elements": None}, "elements is missing"),
    ({"drag_law": "pode", "tangential_coefficient": 0.02}, "tangential_coefficient = 0.02 has no meaning"),
    (
        {"drag_law": "crossflow", "tangential_coefficient": 0.02, "friction_coefficient": 0.01},
        "friction_coefficient = 0.01 stands beside tangential_coefficient = 0.02",
    ),
    ({"tangential_coefficient": 0.02}, "tangential_coefficient = 0.02 has no part in the law"),
    ({"drag_law": "off", "friction_coefficient": 0.01}, "friction_coefficient = 0.01 has no part in the law off"),
    ({"drag_law": "dymore"}, "drag_law = dymore needs a constant C_D above 0"),
    ({"drag_law": "huston_kamman_6", "drag_coefficient": 1.2}, "drag_coefficient = 1.2 takes the place of the C_N(Re)"),
    ({"drag_law": "capozucca", "fairing": "airfoil"}, "drag_law = capozucca has a C_N of its own"),
    ({"fairing_mass": 0.2}, "fairing_mass = 0.2 kg/m is of no known material"),
    (
        {"fairing": "hair", "fairing_mass": 0.1, "fairing_net_weight": 2.0},
        "fairing_net_weight = 2 N/m is more than 1.00062 N/m",
    ),
    ({"termination_net_weight": 10.0}, "termination_net_weight = 10 N belongs to a termination without mass"),
    (
        {"termination_mass": 1.0, "termination_net_weight": 20.0},
        "termination_net_weight = 20 N is more than the dry weight 9.81 N",
    ),
    ({"axial_stiffness": 5000.0}, "axial_stiffness = 5000 N is less than 2"),
    ({"axial_stiffness": 1e12}, "axial_stiffness = 1000000000000.0 N is outside [1, 1e+11] N"),
]
OF_POD = [  # the body pod, what is said of it
    (POD | {"at": "tail"}, ".at = 'tail' is no section of the cable"),
    (POD | {"at": "faired"}, ".at = 'faired' is the last section"),
    (POD | {"at": "drum"}, ".at = 'drum' puts it 5.2 m from the drum end, not above "),
    (POD | {"net_weight": 500.0}, ".net_weight = 500 N is more than the dry weight 196.2 N"),
    (3.0, " = 3.0 is a number"),
]
WRONG = [
    *(({"bare": keys}, {}, f"cable.sections.bare.{text}") for keys, text in OF_BARE),
    *(({}, {"pod": body}, f"bodies.pod{text}") for body, text in OF_POD),
    ({"sheave": {"diameter": 0.05}}, {}, "cable.sections.sheave.diameter = 0.05 m would sit 0.04 m above the seat"),
    ({}, {"Pod 1": POD}, "bodies.Pod 1 is not a body name"),
]


@pytest.mark.parametrize("sections, bodies, text", WRONG, ids=[text for _, _, text in WRONG])
def test_problem(sections, bodies, text):
    with pytest.raises(SceneError) as caught:
        scene(sections, bodies)
    (found,) = caught.value.problems
    assert found.startswith(f"tow.yaml: {text}") and found.remedy, found


def test_two_bodies_at_one_end():
    with pytest.raises(SceneError) as caught:
        scene(bodies={"a": POD, "b": POD})
    assert [p.partition(";")[0] for p in caught.value.problems] == [
        f"tow.yaml: bodies.{name}.at = 'bare' is given to 2 bodies, a section's end carries one" for name in "ab"
    ]


def test_a_section_that_floats_over_a_seabed():
    with pytest.raises(SceneError, match="what floats does not lie on it: the cable weighs -1.125 N/m"):
        scene({"faired": {"diameter": 0.025}}, seabed={"depth": 500.0})


def test_a_section_outboard_that_is_too_thick_for_the_groove_is_a_caution():
    said = " ".join(cautioned(scene, {"faired": {"diameter": 0.05, "mass_per_length": 5.0}}))
    assert "cable.sections.faired.diameter = 0.05 m would sit 0.04 m above the seat of cable.diameter = 0.01 m" in said


def test_downforce_counts_every_section_and_what_hangs_on_it():
    """By hand: wet weight past the tangent point, pods, terminations and lifts in still water and under way."""
    plain = checks.downforce(layout_of(scene()))
    area = 0.25 * pi
    assert plain == checks.downforce(layout_of(load_scene("full_scale_contact")))
    place = layout_of(scene())
    winch = load_scene("full_scale").winch.model_dump(mode="json") | {"scope": None}
    fed = scene(base="full_scale", winch=winch | {"cable_on_drum": 600.0 - (place.route.total - place.route.wound)})
    assert checks.downforce(layout_of(fed)) == pytest.approx(plain, rel=1e-9), "what is on the drum does not pull"
    hung = scene({"bare": {"termination_mass": 3.0, "termination_net_weight": 20.0}}, {"pod": POD | {"lift_area": 0.1}})
    lift = 0.5 * hung.water.density * 0.1 * hung.ship.tow_speed**2
    assert checks.downforce(layout_of(hung)) == pytest.approx(plain + 20.0 + 50.0 - lift, rel=1e-12)
    thick = scene({"faired": {"diameter": 0.02, "mass_per_length": 1.5}})
    more = 150.0 * 9.81 * (1.5 - 0.389 - thick.water.density * area * (0.02**2 - 0.01**2))
    assert checks.downforce(layout_of(thick)) == pytest.approx(plain + more, rel=1e-9)


def test_bodies_stand_at_the_ends_of_their_sections():
    model = build_model(layout_of(scene({"bare": {"termination_mass": 3.0}}, {"pod": POD})))
    nodes = model.line.held.shape[0]
    sections = load_scene("full_scale_contact").cable.sections
    assert list(model.line.body_nodes) == [nodes - 1, nodes - 1 - sections["faired"].elements]
    assert list(model.line.bodies["mass"]) == [250.0, 20.0]
    assert model.line.beads["mass"] == [3.0] and model.line.beads["buoyancy"] == [0.0]
    assert model.line.beads["place"][0] == pytest.approx(sum(sections[name].length for name in list(sections)[:-1]))


def test_bodies_of_a_winch_that_feeds_stand_at_the_ends_of_the_zones():
    tow = scene({"bare": {"termination_mass": 3.0}}, {"pod": POD}, base="full_scale")
    sim = started(tow)
    nodes, (towbody, pod) = sim.nodes, sim.model.line.body_nodes
    assert towbody == nodes - 1 and 0 < pod < nodes - 1
    assert sim.state.arc[pod] == pytest.approx(450.0, abs=1e-9) == sim.model.line.beads["place"][0]


def test_bodies_on_the_line_are_in_metrics_recording_and_topic(tmp_path):
    tow = scene({}, {"pod": POD}, base="full_scale", name="two_part")
    result = run(tow, motion=None, duration=1.0, out=tmp_path)
    pod, last = result.metrics["bodies"]["pod"], result.frames[-1]
    recorded = load_run(tmp_path / "tow")
    ((_, rows),) = [one for one in recorded.bodies if one[0] == last.time]
    assert rows.shape == (1, len(BODY_COLUMNS)) and rows[0, 5] == pytest.approx(450.0, rel=1e-6)
    assert (
        pod["depth_m"] == pytest.approx(-rows[0, 2], abs=1e-3) and 0.0 < pod["depth_m"] < result.metrics["body_depth_m"]
    )
    assert 0.0 < pod["layback_m"] < last.layback

    sim = started(tow)
    sim.run(1)
    n, tension, half = sim.model.line.body_nodes[1], sim.state.tension, 0.5 * np.diff(sim.state.arc)

    def drawn_on(near, far):
        """Tension at the node, on the line through those of two elements."""
        return tension[near] + half[near] * (tension[near] - tension[far]) / (half[near] + half[far])

    above, below = drawn_on(n - 1, n - 2), drawn_on(n, n + 1)
    weight = POD["net_weight"]
    assert pod["tension_above_mean_n"] == pytest.approx(above, abs=0.02 * weight)
    assert pod["tension_below_min_n"] == pytest.approx(below, abs=0.02 * weight)
    assert above - below > 0.1 * weight, "the tension jumps there"


def test_a_body_that_a_winch_that_feeds_has_on_board_at_the_start_is_refused():
    winch = load_scene("full_scale").winch.model_dump(mode="json") | {"scope": 100.0}
    with pytest.raises(SceneError, match=r"bodies.pod.at = 'bare' puts it 450 m .* hang inboard"):
        scene(bodies={"pod": POD}, base="full_scale", winch=winch)


def test_a_body_is_read_back_and_overridden():
    first = scene({"bare": {"fairing": "hair", "termination_mass": 3.0}}, {"pod": POD})
    assert read(dump_scene(first), "again.yaml") == first
    assert override(first, {"bodies.pod.mass": 30.0}).bodies["pod"].mass == 30.0
    said = refused(override, first, {"bodies.pod.mas": 1.0})
    assert "bodies.pod.mas = 1.0: there is no such key" in said and "Did you mean bodies.pod.mass?" in said
