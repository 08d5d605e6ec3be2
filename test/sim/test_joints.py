"""Sections of their own cable, terminations and bodies on the line: what stops a scene, and what is only a caution."""

import warnings
from math import pi

import numpy as np
import pytest

from cable_sim_ros.io.recordings.recorded_run import load_run
from cable_sim_ros.io.scenes.load import SceneError, SceneWarning, dump_scene, load_scene, override, scene_from_dict
from cable_sim_ros.io.scenes.load import scene_from_text as read
from cable_sim_ros.physics.tick_output import BODY_COLUMNS
from cable_sim_ros.runs.offline import run
from cable_sim_ros.sim.build import build_model
from cable_sim_ros.sim.checks import checks
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.simulator import Simulator

pytestmark = pytest.mark.trust
POD = {"at": "bare", "mass": 20.0, "net_weight": 50.0}


def scene(sections=None, bodies=None, base="full_scale_contact", **changes):
    """A shipped scene with other keys of its sections and these bodies."""
    data = load_scene(base).model_dump(mode="json")
    for name, keys in (sections or {}).items():
        data["cable"]["sections"][name] |= keys
    return scene_from_dict(data | {"bodies": bodies or {}} | changes, "tow.yaml")


WRONG = {
    "no mesh": ({"bare": {"elements": None}}, {}, "tow.yaml: cable.sections.bare.elements is missing"),
    "tangential without a constant": (
        {"bare": {"drag_law": "pode", "tangential_coefficient": 0.02}},
        {},
        "tow.yaml: cable.sections.bare.tangential_coefficient = 0.02 has no meaning",
    ),
    "two coefficients along the cable": (
        {"bare": {"drag_law": "crossflow", "tangential_coefficient": 0.02, "friction_coefficient": 0.01}},
        {},
        "tow.yaml: cable.sections.bare.friction_coefficient = 0.01 stands beside tangential_coefficient = 0.02",
    ),
    "tangential of a law of the angle": (
        {"bare": {"tangential_coefficient": 0.02}},
        {},
        "tow.yaml: cable.sections.bare.tangential_coefficient = 0.02 has no part in the law",
    ),
    "friction of no drag": (
        {"bare": {"drag_law": "off", "friction_coefficient": 0.01}},
        {},
        "tow.yaml: cable.sections.bare.friction_coefficient = 0.01 has no part in the law off",
    ),
    "dymore without c_d": (
        {"bare": {"drag_law": "dymore"}},
        {},
        "tow.yaml: cable.sections.bare.drag_law = dymore needs a constant C_D above 0",
    ),
    "constant for a law of Re": (
        {"bare": {"drag_law": "huston_kamman_6", "drag_coefficient": 1.2}},
        {},
        "tow.yaml: cable.sections.bare.drag_coefficient = 1.2 takes the place of the C_N(Re)",
    ),
    "fairing with a C_D beside such a law": (
        {"bare": {"drag_law": "capozucca", "fairing": "airfoil"}},
        {},
        "tow.yaml: cable.sections.bare.drag_law = capozucca has a C_N of its own",
    ),
    "fairing of no material": (
        {"bare": {"fairing_mass": 0.2}},
        {},
        "tow.yaml: cable.sections.bare.fairing_mass = 0.2 kg/m is of no known material",
    ),
    "fairing that sinks too well": (
        {"bare": {"fairing": "hair", "fairing_mass": 0.1, "fairing_net_weight": 2.0}},
        {},
        "tow.yaml: cable.sections.bare.fairing_net_weight = 2 N/m is more than 1.00062 N/m",
    ),
    "termination without mass": (
        {"bare": {"termination_net_weight": 10.0}},
        {},
        "tow.yaml: cable.sections.bare.termination_net_weight = 10 N belongs to a termination without mass",
    ),
    "nowhere": ({}, {"pod": POD | {"at": "tail"}}, "tow.yaml: bodies.pod.at = 'tail' is no section of the cable"),
    "at the towbody": ({}, {"pod": POD | {"at": "faired"}}, "tow.yaml: bodies.pod.at = 'faired' is the last section"),
    "inboard": ({}, {"pod": POD | {"at": "drum"}}, "tow.yaml: bodies.pod.at = 'drum' puts it 5.2 m "),
    "name": ({}, {"Pod 1": POD}, "tow.yaml: bodies.Pod 1 is not a body name"),
    "thick on the sheave": (
        {"sheave": {"diameter": 0.05}},
        {},
        "tow.yaml: cable.sections.sheave.diameter = 0.05 m would sit 0.04 m above the seat",
    ),
    "soft section": (
        {"bare": {"axial_stiffness": 5000.0}},
        {},
        "tow.yaml: cable.sections.bare.axial_stiffness = 5000 N is less than 2",
    ),
    "stiff section": (
        {"bare": {"axial_stiffness": 1e12}},
        {},
        "tow.yaml: cable.sections.bare.axial_stiffness = 1000000000000.0 N is outside [1, 1e+11] N",
    ),
    "no block": ({}, {"pod": 3.0}, "tow.yaml: bodies.pod = 3.0 is a number"),
}


@pytest.mark.parametrize("sections, bodies, text", WRONG.values(), ids=WRONG)
def test_problem(sections, bodies, text):
    with pytest.raises(SceneError) as caught:
        scene(sections, bodies)
    (found,) = caught.value.problems
    assert found.startswith(text) and found.remedy, found


def test_inboard_says_where_the_sheave_is_left():
    with pytest.raises(SceneError, match=r"from the drum end, not above \d+\.\d+ m, where .* hang inboard"):
        scene(bodies={"pod": POD | {"at": "drum"}})


@pytest.mark.parametrize(
    "sections, bodies, text",
    [
        ({}, {"pod": POD | {"net_weight": 500.0}}, "bodies.pod.net_weight = 500 N is more than the dry weight 196.2 N"),
        (
            {"bare": {"termination_mass": 1.0, "termination_net_weight": 20.0}},
            {},
            "cable.sections.bare.termination_net_weight = 20 N is more than the dry weight 9.81 N",
        ),
    ],
)
def test_nothing_is_heavier_in_water_than_in_air(sections, bodies, text):
    with pytest.raises(SceneError, match=text):
        scene(sections, bodies)


def test_two_bodies_at_one_end():
    with pytest.raises(SceneError) as caught:
        scene(bodies={"a": POD, "b": POD})
    assert [p.partition(";")[0] for p in caught.value.problems] == [
        f"tow.yaml: bodies.{name}.at = 'bare' is given to 2 bodies, a section's end carries one" for name in "ab"
    ]


def test_a_section_that_floats_over_a_seabed():
    with pytest.raises(SceneError, match="what floats does not lie on it: the cable weighs -1.125 N/m"):
        scene({"faired": {"diameter": 0.025}}, seabed={"depth": 500.0})


@pytest.mark.parametrize(
    "sections, bodies, text",
    [
        (
            {"faired": {"diameter": 0.05, "mass_per_length": 5.0}},
            {},
            "cable.sections.faired.diameter = 0.05 m would sit 0.04 m above the seat of cable.diameter = 0.01 m",
        )
    ],
)
def test_caution(sections, bodies, text):
    with pytest.warns(SceneWarning) as caught:
        scene(sections, bodies)
    assert any(text in str(item.message) for item in caught)


def test_downforce_counts_every_section_and_what_hangs_on_it():
    """By hand: wet weight past the tangent point, pods, terminations and lifts in still water and under way."""
    plain = checks.downforce(layout_of(scene()))
    area = 0.25 * pi
    assert plain == checks.downforce(layout_of(load_scene("full_scale_contact")))
    place = layout_of(scene())
    winch = load_scene("full_scale").winch.model_dump(mode="json") | {"scope": None}
    fed = scene(base="full_scale", winch=winch | {"cable_on_drum": 600.0 - (place.total - place.wound)})
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
    sim = Simulator(tow)
    sim.start()
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

    sim = Simulator(tow)
    sim.start()
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
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert read(dump_scene(first), "again.yaml") == first
    assert override(first, {"bodies.pod.mass": 30.0}).bodies["pod"].mass == 30.0
    with pytest.raises(
        SceneError, match="bodies.pod.mas = 1.0: there is no such key; .* Did you mean bodies.pod.mass?"
    ):
        override(first, {"bodies.pod.mas": 1.0})
