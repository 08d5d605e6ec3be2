"""Wakes in scenes and lines of one's own: what is refused in which words; a tow with a wake is saved and resumed."""

from functools import partial

import numpy as np
import pytest
from underway import cautioned, goes_on, refused, scene_with

from cable_sim_ros.io.scenes.document import find_scene
from cable_sim_ros.io.scenes.load import load_scene, scene_from_text
from cable_sim_ros.physics.fluid import Fluid
from cable_sim_ros.physics.section import Material
from cable_sim_ros.physics.state import NOW, WAKE
from cable_sim_ros.physics.wake_oscillator import WAKE_Q, WAKE_RATE
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.rig.rig import Rig, RigError, cable_of
from cable_sim_ros.sim.wake_tables import min_tensions, wave_length
from verification.shipped import started

pytestmark = pytest.mark.trust

CTD = {"water.current": [0.05, 0.0], "winch.scope": 60.0}  # slow water, and elements short enough for its vortices


refusal = partial(refused, scene_with)
WIRE = f"cable.sections.{next(iter(load_scene('lowered_ctd').cable.sections))}"


def test_a_step_too_long_for_the_shedding_is_refused_with_number_bound_and_remedy():
    text = refusal("full_scale", cable__sections__bare__wake__law="bai_qin")
    assert "solver.tick = 0.01 s is more than 0.0007576 s, 1/30 of a period of the vortices" in text


def test_an_element_too_long_for_its_waves_is_refused_with_number_bound_and_remedy():
    text = refusal("full_scale", **{"cable.sections.bare.wake.law": "bai_qin", "solver.tick": 5e-4})
    assert "cable.sections.bare.wake.law = bai_qin on elements of" in text and "1/6 of a wave of this cable" in text
    assert "at the 44 Hz that it sheds at 2.2 m/s: under" in text and "the mesh does not carry the vibration" in text
    assert "Give mesh.sections.bare or the section more elements, of at most 0." in text


def test_the_wave_is_that_of_a_stiff_string():
    string = Material(diameter=0.02, mass_per_length=1.38, axial_stiffness=1e6, added_mass_coefficient=0.0)
    assert wave_length(string, 1000.0, 10.0, 200.0) == pytest.approx(np.sqrt(200.0 / 1.38) / 10.0)
    beam = string.model_copy(update={"bending_stiffness": 0.73})
    assert wave_length(beam, 1000.0, 10.0, 0.0) == pytest.approx(
        2.0 * np.pi * (0.73 / 1.38 / (20 * np.pi) ** 2) ** 0.25
    )
    k = 2.0 * np.pi / wave_length(beam, 1000.0, 10.0, 20.0)
    assert 0.73 * k**4 + 20.0 * k**2 == pytest.approx(1.38 * (20.0 * np.pi) ** 2)
    assert wave_length(beam, 1000.0, 0.0, 20.0) == np.inf


def test_the_bound_of_a_light_line_is_of_its_least_tension():
    """Flume: 7.8 mN at the towbody, below the working tension of its contact."""
    assert min_tensions(layout_of(load_scene("flume")))["line"] == pytest.approx(7.8e-3, rel=0.02)
    fast = {"cable.sections.line.wake.law": "facchinetti", "solver.tick": 2e-4, "cable.bending_stiffness": 0.0}
    mesh = {"mesh.sections": {"line": {"elements": 40}}}
    text = refusal("flume", **fast, **mesh)
    assert "cable.sections.line.wake.law = facchinetti on elements of 0.0" in text and "m, more than 0.005267" in text
    assert "at the 146.8 Hz that it sheds at 0.33 m/s: under 0.0078" in text


def test_a_faired_section_has_no_wake():
    text = refusal("full_scale", cable__sections__faired__wake__law="facchinetti")
    assert "cable.sections.faired.wake.law = facchinetti is one of bare cable" in text


def test_links_have_no_wake():
    text = refusal("full_scale", **{"cable.model": "segments", "cable.sections.bare.wake.law": "bai_qin"})
    assert "cable.model = segments has no wakes: their load needs the shape of an element between its nodes" in text
    assert "Use cable.model = ancf, or leave the wakes out" in text


def test_strumming_and_a_wake_would_count_twice():
    both = CTD | {f"{WIRE}.wake.law": "bai_qin", "viv.law": "govardhan_williamson"}
    assert f"{WIRE}.wake.law = bai_qin beside viv.law = govardhan_williamson" in refusal("lowered_ctd", **both)
    scene_with("lowered_ctd", **both, **{f"{WIRE}.viv_multiplier": 0.0})


def test_an_amplified_drag_beside_a_wake_is_a_caution():
    amplified = CTD | {f"{WIRE}.wake.law": "bai_qin", f"{WIRE}.drag_amplification": 1.5}
    said = " ".join(cautioned(scene_with, "lowered_ctd", **amplified))
    assert "beside wake.law = bai_qin: the amplification stands for the drag of a vibration" in said


def line(water, **section):
    cable = cable_of(
        [{"length": 2.0, "elements": 4, "wake": {"law": "bai_qin"}, **section}],
        mass_per_length=1.38,
        axial_stiffness=1e6,
        diameter=0.02,
    )
    return Rig(cable, held={0: "r"}, tension=200.0, water=water)


def test_a_line_of_ones_own_is_refused_in_the_same_words():
    with pytest.raises(RigError, match="has a wake in nothing: no fluid, no vortices; nothing was built"):
        line(None)
    with pytest.raises(RigError, match="fairing = ribbon, drag_law = off.: a fairing is there to keep vortices"):
        line(Fluid(), fairing="ribbon")
    with pytest.raises(RigError, match="on elements of 0.5 m, more than .* nothing was built. Give cable.sections.s0"):
        line(Fluid(current=(0.0, 2.0)))
    rig = line(Fluid(current=(0.0, 0.3)))
    with pytest.raises(RigError, match="step = 0.1 s is more than 0.01111 s, 1/30 .* nothing was simulated. Make it"):
        rig.run(1.0, 0.1)
    with pytest.raises(RigError, match="step = 0.1 s is more than 0.01111 s"):
        next(rig.steps(0.1))


def test_a_key_of_a_wake_is_checked_like_every_other():
    text = refusal("lowered_ctd", **{f"{WIRE}.wake.strouhal": 2.0})
    assert f"{WIRE}.wake.strouhal = 2.0 is outside [0.05, 0.5]" in text
    text = refusal("lowered_ctd", **{f"{WIRE}.wake.law": "vandermeer"})
    assert "is none of its values" in text and "off, bai_qin, facchinetti" in text
    name = WIRE.rpartition(".")[2]
    source = find_scene("lowered_ctd").read_text("utf-8").replace(f"{name}: {{", f"{name}: {{wake: bai_qin, ", 1)
    assert "wake = 'bai_qin' is text, expected a block of keys" in refused(scene_from_text, source, "ctd.yaml")


def test_a_tow_with_a_wake_is_resumed_to_the_bit(tmp_path):
    """Saved, loaded and taken back: the wake goes on where it was, and works on the tow."""
    sim = started(scene_with("lowered_ctd", **CTD, **{f"{WIRE}.wake.law": "bai_qin"}))
    sim.run(200)
    assert (sim.state.nodes[NOW, WAKE, 1:, WAKE_RATE] > 0.0).any()
    goes_on(sim, 100, tmp_path)
    assert np.abs(sim.state.nodes[NOW, WAKE, :, WAKE_Q]).max() > 0.05
    sim.start()
    assert np.abs(sim.state.nodes[NOW, WAKE, :, WAKE_RATE]).max() == 0.0  # begins anew
