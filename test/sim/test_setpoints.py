"""Cautions about set-point laws that ask for too much and damping that does nothing; what the laws start from."""

import re
from functools import partial

import numpy as np
import pytest
from underway import cautioned, scene_with

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.heave_compensation import EXCESS_TENSION
from cable_sim_ros.sim.compensation_setup import impedance
from verification.shipped import started

pytestmark = pytest.mark.trust


warned = partial(cautioned, scene_with)  # cautions of a shipped scene with changes


@pytest.mark.parametrize("law", ["simplified_waterline", "rigorous_waterline"])
@pytest.mark.parametrize("name", ["full_scale", "full_scale_contact"])
def test_a_waterline_law_on_a_flat_tow_is_a_caution_with_its_number(law, name):
    (text,) = [text for text in warned(name, setpoint__algorithm=law) if "setpoint.algorithm" in text]
    found = re.search(
        rf"setpoint.algorithm = {law}: 1/cos\(\d\d deg\) = (\d\.\d) m of pay-out per m of heave \(the angle is "
        r"estimated\), of which 0\.\d+ m is .* limited to a gain of 2 \(setpoint.max_gain\), 1 m \(setpoint.max_excess",
        text,
    )
    assert 4.0 < float(found[1]) < 6.0 and text.endswith("are for cables steeper than 51 deg")


def test_the_angle_of_the_caution_is_the_nominal_one_where_it_is_given():
    (text,) = warned("full_scale", setpoint__algorithm="simplified_waterline", setpoint__nominal_angle_deg=-60.0)
    assert "1/cos(60 deg) = 2.0 m of pay-out per m of heave (the angle is setpoint.nominal_angle_deg)" in text


def test_other_laws_and_steep_cables_are_no_caution():
    assert warned("full_scale", setpoint__algorithm="rigorous_sheave") == []
    assert warned("lowered_ctd", setpoint__algorithm="rigorous_waterline") == []


def test_bending_damping_without_bending_stiffness_is_a_caution():
    said = "= 6.4e-05 N m^2 s has no effect where bending_stiffness is 0 N m^2"
    (text,) = [text for text in warned("full_scale", cable__bending_stiffness=0.0) if "damping" in text]
    assert f"cable.bending_damping {said}" in text
    own = {"cable.sections.faired.bending_stiffness": 0.0, "cable.sections.faired.bending_damping": 6.4e-5}
    (text,) = [text for text in warned("full_scale", **own) if "damping" in text]
    assert f"cable.sections.faired.bending_damping {said}" in text
    none = {"cable__bending_stiffness": 0.0, "cable__bending_damping": 0.0}
    assert not [text for text in warned("full_scale", **none) if "damping" in text]


def test_a_body_that_may_swing_by_itself_is_a_caution():
    """394 N s/m from its added mass, 211 N s/m of damping; and none of the shipped scenes has one."""
    (text,) = warned("side_scan", towbody__added_mass=[10.0, 2000.0, 10.0])
    assert "towbody.added_mass across is 2000 kg, 1990 kg more than ahead" in text
    assert "swing to the side with up to 394 N s/m, more than the 211 N s/m that" in text
    for name in ("full_scale", "full_scale_contact", "full_scale_westin", "side_scan", "lowered_ctd", "flume"):
        assert not [text for text in warned(name) if "swing" in text]


def test_the_laws_start_from_the_static_tow():
    sim = started(load_scene("full_scale"), heading=2.0)
    setpoint, frame = sim.state.now.setpoint, sim.frame
    assert setpoint.engaged == setpoint.algorithm == 1, "taken up with the motion, not after it"
    assert setpoint.angle == setpoint.departure == pytest.approx(float(frame.departure_angle), abs=1e-6)
    np.testing.assert_allclose(setpoint.track, (*frame.sheave_position[:2], 2.0))
    assert impedance(sim.scene) == pytest.approx(np.sqrt(6.786e6 * 0.389))
    assert setpoint.max_excess_rate == pytest.approx(EXCESS_TENSION * frame.tension / np.sqrt(6.786e6 * 0.389))
    given = started(override(sim.scene, {"setpoint.max_excess_rate": 0.2, "setpoint.nominal_angle_deg": -5.0}))
    assert given.state.now.setpoint.max_excess_rate == 0.2
    assert given.state.now.setpoint.angle == pytest.approx(np.radians(-5.0))
