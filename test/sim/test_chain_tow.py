"""Whole tows on links: the scene, its checks and mesh, and the same answers as on cubic elements."""

from __future__ import annotations

import numpy as np
import pytest
from underway import cautioned, goes_on, refused, sail, scene_with

from cable_sim_ros import Simulator
from cable_sim_ros.io.scenes.load import SceneWarning, load_scene
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.layout import layout_of

pytestmark = pytest.mark.trust

LINKS = {"cable.model": "segments"}


def heaving(sim: Simulator, seconds: float) -> np.recarray:
    """Start, a metre of heave at 8 s, compensated, and pay-out at 0.5 m/s; returns the tick outputs."""
    sim.start()
    for t in 0.02 * np.arange(1, round(seconds / 0.02) + 10):
        sail(sim, t, 0.5 * (1.0 - np.cos(0.8 * t)), 0.4 * np.sin(0.8 * t))
    return sim.run(round(seconds / sim.scene.solver.tick), winch="0 rate 0.5")


@pytest.mark.parametrize("name", ["full_scale", "flume"])
def test_a_tow_on_links_rests_where_it_rests_on_cubic_elements(name):
    """Made from the same accuracy; without bending, for the mesh is made for the shape without it."""
    without_bending = {"cable.bending_stiffness": 0.0, "cable.bending_damping": 0.0}
    scene = scene_with(name, **LINKS, **without_bending)
    links, cubic = Simulator(scene), Simulator(scene_with(name, **without_bending))
    links.start()
    cubic.start()
    apart = np.linalg.norm(links.frame.body_position - cubic.frame.body_position)
    promise = layout_of(scene).plan.expected[-3].position if name != "flume" else np.inf  # nothing is promised of it
    assert apart < min(1.5 * promise, 0.011)
    assert links.frame.tension == pytest.approx(float(cubic.frame.tension), rel=2e-3)
    assert links.frame.tension_body == pytest.approx(float(cubic.frame.tension_body), rel=5e-3)


@pytest.fixture(scope="module")
def underway():
    sim = Simulator(scene_with(**LINKS, accuracy__position=0.1, accuracy__tension=0.01))
    frames = heaving(sim, 6.0)
    return sim, frames


def test_a_winch_that_feeds_links_pulls_as_one_that_feeds_cubic_elements(underway):
    """Heave, compensation and 3 m paid out: tension, place and energy account of both models."""
    sim, links = underway
    cubic = heaving(Simulator(load_scene("full_scale")), 6.0)
    assert links["payout"][-1] - links["payout"][0] == pytest.approx(cubic["payout"][-1] - cubic["payout"][0], rel=2e-3)
    assert links["payout"][-1] - links["payout"][0] > 2.0
    apart = (links["tension"] - cubic["tension"]) / cubic["tension"].mean()
    assert np.abs(apart[200:]).max() < 0.01  # the pay-out begins at once and strikes the cable
    assert np.sqrt(np.mean(apart**2)) < 0.005
    assert links["tension"].mean() == pytest.approx(cubic["tension"].mean(), rel=2e-3)
    assert np.abs(links["body_position"] - cubic["body_position"]).max() < 0.15
    assert not (links["status"] & (Flag.PENETRATION | Flag.SLACK | Flag.HALVED | Flag.DETACHED)).any()
    turned = np.abs(np.diff(links["work_supplied"])).sum()
    assert abs(links["energy_residual"][-1]) < 0.02 * turned


def test_links_go_on_from_a_file_as_if_they_had_not_been_interrupted(underway, tmp_path):
    goes_on(underway[0], 30, tmp_path)


def test_a_tow_on_links_wound_on_a_drum_surface_starts_and_runs():
    """The drum's links are too long for a drum of 0.3 m: the tow runs, and a caution says what it costs."""
    changes = LINKS | {"cable.sections.bare.elements": 30, "cable.sections.faired.elements": 30}
    with pytest.warns(SceneWarning, match=r"cable.sections.drum lies on winch.drum_radius = 0.305 m with links of"):
        scene = scene_with("full_scale_contact", **changes)
    links, cubic = Simulator(scene), Simulator(load_scene("full_scale_contact"))
    for sim in (links, cubic):
        sim.start()
        sim.run(100)
    for what in ("tension", "tension_drum", "contact_resultant"):
        assert links.frame[what] == pytest.approx(float(cubic.frame[what]), rel=0.01), what


@pytest.mark.parametrize(
    ("name", "changes", "text"),
    [
        ("full_scale_contact", LINKS | {"cable.sections.drum.elements": 15}, "links of 0.3467 m, more than 0.305 m"),
        ("full_scale", {"cable.link_buoyancy": "normal"}, "cable.link_buoyancy = normal has no effect: it is of links"),
    ],
)
def test_links_that_make_no_sense_stop_the_load(name, changes, text):
    assert text in refused(scene_with, name, **changes)


@pytest.mark.parametrize(
    ("name", "changes", "text"),
    [
        ("full_scale", LINKS, "cable.bending_damping = 6.4e-05 N m^2 s has no effect on a cable of links"),
        ("full_scale", LINKS | {"cable.link_buoyancy": "normal"}, "cross-section comes to, 79.1 N at 100 m. For"),
        ("full_scale_contact", LINKS | {"cable.sections.sheave.elements": 60}, "of 0.08 m, more than 0.06387 m, whose"),
    ],
)
def test_cautions_about_links(name, changes, text):
    assert text in " ".join(cautioned(scene_with, name, **changes))
