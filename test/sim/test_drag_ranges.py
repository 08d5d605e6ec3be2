"""Cautions where a drag law is used outside the range of its source; none for the shipped scenes."""

from __future__ import annotations

import re

import numpy as np
import pytest
from underway import cautioned, scene_with

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.drag_laws import AmplifiedDrag
from cable_sim_ros.physics.tick_output import TICK_OUTPUT
from cable_sim_ros.runs.message_run import _warn_of_drag
from cable_sim_ros.sim.checks.scene_warnings import part_warnings
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.simulator import Simulator

pytestmark = pytest.mark.trust

BARE = "cable.sections.bare."


def warned(name: str = "full_scale", **changes) -> list[str]:
    """Cautions of a shipped scene with changes of its section ``bare`` (or, with __, of any key)."""
    values = {key if "__" in key else BARE + key: value for key, value in changes.items()}
    said = cautioned(scene_with, name, **values)
    return [text.partition(BARE)[2] for text in said if BARE in text]


@pytest.mark.parametrize("law", ["driscoll_nahon", "choo_casarella", "huston_kamman_6", "huston_kamman_10"])
def test_a_law_within_its_range_is_no_caution(law):
    assert warned(drag_law=law) == []


@pytest.mark.parametrize("name", ["full_scale", "full_scale_contact", "side_scan", "lowered_ctd", "flume"])
def test_shipped_scenes_keep_to_their_ranges(name):
    assert not [text for text in cautioned(load_scene, name) if "drag_" in text]


def test_a_factor_that_does_not_say_of_what_is_said_with_what_hangs_on_it():
    (text,) = warned(drag_amplification_of=None)
    found = re.fullmatch(
        r"drag_amplification_of is not given for the drag factor of bare \(2.37\), which multiplies the drag along the "
        r"cable too, as Westin's: in the static shape (\S+) N at the sheave and (\S+) m deep, on the drag across alone "
        r"(\S+) N and (\S+) m. Give drag_amplification_of: normal for a factor of a measured or printed C_D, both for "
        r"one tuned so, docs/drag.md",
        text,
    )
    assert found, text
    scene = load_scene("full_scale")

    def bare(**keys):
        sections = scene.cable.sections
        own = sections | {"bare": sections["bare"].model_copy(update=keys)}
        return scene.model_copy(update={"cable": scene.cable.model_copy(update={"sections": own})})

    normal = bare(drag_amplification_of=AmplifiedDrag.NORMAL)
    for one, tension, depth in ((scene, found[1], found[2]), (normal, found[3], found[4])):
        shape = layout_of(one).shape(450.0)
        assert (float(tension), float(depth)) == pytest.approx((shape.tension[-1], -shape.place[0, 2]), rel=1e-3)
    assert float(found[1]) - float(found[3]) > 200.0
    silent = bare(drag_amplification_of=None)
    still = silent.model_copy(update={"ship": scene.ship.model_copy(update={"tow_speed": 0.0})})
    plain = bare(drag_amplification_of=None, drag_amplification=1.0)
    assert any(part_warnings(silent))
    assert not any(warning for one in (scene, normal, still, plain) for warning in part_warnings(one))


def test_reynolds_numbers_above_those_of_the_source():
    """A cable of 30 mm at 5 m/s in water of a twelfth of the viscosity."""
    cable = {"diameter": 0.03, "mass_per_length": 1.5, "drag_amplification": 2.2}
    fast = cable | {"water__viscosity": 1e-4, "ship__tow_speed": 5.0}
    (text,) = warned(**fast)
    found = re.match(
        r"drag_law = driscoll_nahon is used outside its range \(Westin \(2018\), \(60\)-\(61\)\): in the "
        r"static shape at 5 m/s Re of the flow across the cable is (\S+) to (\S+), the range up to 100000: C_D is ",
        text,
    )
    assert found, text
    assert 1e5 < float(found[2]) <= 1026.0 * 0.03 * 5.0 / 1e-4
    assert warned(**fast, drag_coefficient=1.2) == [], "a constant has no range"


def test_the_current_at_depth_counts():
    """Slow at the surface, fast along the lower half of the cable."""
    table = {"depth": [0.0, 20.0, 40.0], "east": [0.0, 0.0, -3.0], "north": [0.0, 0.0, 0.0]}
    cable = {"diameter": 0.03, "mass_per_length": 3.0, "drag_amplification": 2.2}
    fast = cable | {"water__viscosity": 1e-4, "ship__tow_speed": 0.1}
    assert warned(**fast) == []
    (text,) = warned(**fast, water__current_table=table)
    assert "Re of the flow across the cable is " in text


def test_reynolds_numbers_below_those_of_the_source():
    slow = {"water__viscosity": 0.01, "ship__tow_speed": 0.05, "diameter": 1.5e-4, "mass_per_length": 1e-4}
    text = next(text for text in warned(drag_law="huston_kamman_10", **slow) if "drag_law" in text)
    assert "= huston_kamman_10 is used outside its range (Huston and Kamman (1980), equation 10): " in text
    assert re.search(r"Re of the flow across the cable is 0\.\d+ to \S+, the range 1 and more: the lowest branch", text)
    assert warned(drag_law="huston_kamman_10", ship__tow_speed=0.0) == [], "no flow, no Reynolds number"


def test_angles_outside_those_of_the_source():
    (text,) = warned(drag_law="capozucca")
    found = re.match(
        r"drag_law = capozucca is used outside its range \(Capozucca \(1988\), equation 3.6\): in the static "
        r"shape at 2.2 m/s the angle between cable and flow is (\S+) to (\S+) deg, the range 85 to 90 deg: its cases ",
        text,
    )
    assert found, text
    assert 5.0 < float(found[1]) < float(found[2]) < 90.0


def test_the_printed_law_at_angles_where_its_normal_drag_is_negative():
    """The scene of the thesis has them, at the body's end of its bare part; there its author accepts it."""
    text = next(text for text in warned("full_scale_westin") if "drag_law" in text)
    assert "7.71 to 14.8 deg, the range 8 to 90 deg: f_n is negative below 8 deg" in text


def test_a_constant_outside_those_of_the_source():
    (text,) = warned(drag_law="dymore", drag_coefficient=2.5)
    assert text.startswith("drag_coefficient = 2.5 is outside 0.5 to 2, the range of the Dymore manual, equation 10,")
    assert warned(drag_law="dymore", drag_coefficient=1.2) == []


def test_a_law_of_another_kind_of_cable():
    (text,) = warned(drag_law="driscoll_nahon", fairing="ribbon")
    assert text.startswith("drag_law = driscoll_nahon is of a cable with fairing: none (Westin (2018), (60)-(61)), the")
    assert "fairing: ribbon, which it does not describe" in text
    assert warned(drag_law="ribbon") == [] and warned(fairing="airfoil") == []


def test_a_run_faster_than_the_scene_looks_again():
    """Of sections of which the scene itself has not been warned; and not where the ship keeps to its speed."""
    heavy = {BARE + "diameter": 0.02, BARE + "mass_per_length": 2.5}
    scene = override(load_scene("full_scale"), heavy | {"water.viscosity": 1e-4, "ship.tow_speed": 0.3})
    frames = np.zeros(100, TICK_OUTPUT)
    for speed, many in ((0.5, 0), (2.0, 2)):
        frames["ship_velocity"][:, 0] = speed
        texts = cautioned(_warn_of_drag, scene, frames)
        assert len(texts) == many, texts
    assert texts[0].startswith(
        "full_scale: the ship reached 2 m/s, and cable.sections.bare.drag_law = driscoll_nahon is used outside its "
    )
    _warn_of_drag(scene, frames[:0])


@pytest.mark.parametrize(
    "keys",
    [
        {"drag_law": "huston_kamman_6"},
        {"drag_law": "huston_kamman_10"},
        {"drag_law": "choo_casarella", "tangential_coefficient": 0.03},
        {"drag_law": "dymore", "drag_coefficient": 1.2, "friction_coefficient": 0.01},
    ],
    ids=lambda keys: keys["drag_law"],
)
def test_a_tow_of_each_law_starts_where_its_shape_says(keys):
    """The kernels against the integration from the towbody upward, which the mesh and the cautions are made from."""
    scene = override(load_scene("full_scale"), {BARE + key: value for key, value in keys.items()})
    sim, route = Simulator(scene), layout_of(scene).route
    sim.start()
    shape = layout_of(scene).shape(route.total - route.wound - route.inboard)
    assert sim.frame.body_position[2] == pytest.approx(shape.place[0, 2], abs=0.02)
    assert sim.frame.tension == pytest.approx(shape.tension[-1], rel=2e-3)
