"""Static gradients: whole static starts to either side say the same; what has no gradient says why."""

import json
from functools import partial

import numpy as np
import pytest
from calling import cable_sim

from cable_sim_ros.io.scenes.load import load_scene
from cable_sim_ros.runs.settings import apply_to_scene
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.simulator import Simulator
from cable_sim_ros.sim.static_gradients import FIGURES, StaticGradients, number_at, rested, with_number

command = partial(cable_sim, "gradients", code=0)
APART = 1e-3  # of a number, between the scene and the starts beside it
SCENES = {
    "lowered_ctd": ("lowered_ctd", {}),
    "strumming": ("side_scan", {"viv.law": "skop_griffin", "cable.sections.armoured.drag_amplification": 1.0}),
    "links": ("full_scale_contact", {"cable.model": "segments", "cable.bending_stiffness": 0.0}),
}


@pytest.fixture(scope="module")
def static():
    made = {}

    def of(name):
        if name not in made:
            base, settings = SCENES[name]
            made[name] = StaticGradients(apply_to_scene(load_scene(base), settings))
        return made[name]

    return of


def started(one, key, way):
    """FIGURES of a whole static start of a scene beside one, on its mesh."""
    sim = Simulator(with_number(one.scene, key, number_at(one.scene, key) * (1.0 + way)), one.mesh)
    sim.start()
    return np.array([float(figure.of(sim.frame)) for figure in FIGURES])


@pytest.mark.parametrize(
    "name, key",
    [
        ("lowered_ctd", "winch.scope"),
        ("lowered_ctd", "towbody.net_weight"),
        ("strumming", "viv.multiplier"),
        ("links", "ship.tow_speed"),
    ],
)
def test_gradients_are_those_of_whole_static_starts(static, name, key):
    """Within 1e-4; the tension at the sheave within 1e-3, what its round-off over the step is of the gradient."""
    one = static(name)
    found = one(key)
    assert not found.refused and not any(slope.refused for slope in found.slopes)
    differences = (started(one, key, APART) - started(one, key, -APART)) / (2.0 * APART * found.value)
    for slope, difference in zip(found.slopes, differences):
        allowed = 1e-3 if slope.figure == "tension_n" else 1e-4
        assert slope.slope == pytest.approx(difference, rel=allowed), slope.figure
        assert slope.slope == pytest.approx(slope.beside, rel=allowed), slope.figure


def test_what_the_tangent_of_newton_leaves_out_is_put_in(static, monkeypatch):
    """The drag factor of strumming follows the shape: without that the depth is another one."""
    one = static("strumming")
    whole = one("viv.multiplier").slopes
    monkeypatch.setattr(StaticGradients, "_answer", lambda self, load, probe: -self._tangent.solve(load))
    bare = one("viv.multiplier").slopes
    depth = [abs(slopes[2].slope / slopes[2].beside - 1.0) for slopes in (bare, whole)]
    assert depth[0] > 1e-4 > 10.0 * depth[1]


@pytest.mark.parametrize(
    "key, text",
    [
        ("towbody.lift_area", "= 0, and steps are in proportion to it: give --set towbody.lift_area=VALUE"),
        ("towbody.length", "has no value in the scene, and what counts in its place is computed: give --set"),
        ("cable.compression_share", "= 1 1 is at the bound of its range [0, 1]: it has one side alone"),
        ("solver.rho_inf", "says how the tow is computed, not what it is; the mesh is held"),
        ("water.waves.seed", "is no number that changes by a little"),
        ("name", "= 'lowered_ctd' is no number that changes by a little"),
    ],
)
def test_what_is_no_number_to_either_side_is_refused(static, key, text):
    found = static("lowered_ctd")(key)
    assert text in found.refused and not found.slopes


def test_a_number_without_a_part_says_so(static):
    found = static("lowered_ctd")("cable.added_mass_coefficient")
    assert found.note == "has no part in the static tow" and all(slope.slope == 0.0 for slope in found.slopes)


@pytest.mark.nightly
def test_a_figure_that_steps_is_refused_and_the_others_stay():
    """Where a loaded contact point begins, the departure angle is read at the next: it steps, the depth does not."""
    key, one = "ship.tow_speed", StaticGradients(load_scene("side_scan"))
    value, near = one.scene.ship.tow_speed, 1e-4
    ends = [rested(one.beside(key, way * value), one._tangent, one.q)[0] for way in (near, -near)]
    moved = (ends[0] - ends[1]) / (2.0 * near)

    def at(way):
        return rested(one.beside(key, way * value), one._tangent, one.q + way * moved)[1].loaded

    low, high = -0.0012, 0.0  # between them one point is loaded less
    here = at(high)
    assert at(low) != here
    while high - low > 1e-9:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if at(middle) != here else (low, middle)
    scene = with_number(load_scene("side_scan"), key, value * (1.0 + high))
    layout_of(scene).__dict__["plan"] = layout_of(load_scene("side_scan")).plan  # on another mesh it steps elsewhere
    there = StaticGradients(scene)
    angle, depth = (
        next(s for s in there(key).slopes if s.figure == name) for name in ("departure_angle_deg", "body_depth_m")
    )
    assert angle.refused == "steps: the contact points that are loaded change beside the scene"
    assert not depth.refused and depth.slope == pytest.approx(one(key).slopes[2].slope, rel=0.01)


def test_the_command_prints_what_a_unit_and_a_per_cent_change():
    told = json.loads(command("lowered_ctd", "--key", "winch.scope", "--json").stdout)
    assert told["figures"]["body_depth_m"]["unit"] == "m" and told["cpu_s"] > 0.0
    (one,) = told["gradients"]
    depth = one["figures"]["body_depth_m"]
    assert (one["key"], one["unit"], one["refused"]) == ("winch.scope", "m", "")
    assert depth["per_percent"] == pytest.approx(0.01 * one["value"] * depth["per_unit"])
    text = command("lowered_ctd").stdout
    assert "depth of the towbody" in text and "towbody.net_weight" in text and "agreement: with" in text
    assert "lift_area" not in text, "0 in the scene"


def test_a_key_that_was_given_and_has_no_gradient_is_code_4():
    result = command("lowered_ctd", "--key", "towbody.lift_area", "--key", "winch.scope", code=4)
    assert "towbody.lift_area: = 0, and steps are in proportion to it" in result.stdout


def test_gradients_of_a_doubtful_tow_say_so():
    heavy = ["--set", "towbody.mass=20000", "--set", "towbody.net_weight=190000", "--key", "winch.scope"]
    result = command("lowered_ctd", *heavy, "--json", code=4)
    (reason,) = json.loads(result.stdout)["verdict"]["reasons"]
    assert reason["flag"] == "OVERLOAD" and "cannot be taken as it is (docs/flags.md)\n  OVERLOAD: " in result.stderr


@pytest.mark.parametrize(
    "key, text",
    [
        ("towbody.drag_area[3]", "--key towbody.drag_area[3]: towbody.drag_area has 3 components"),
        ("towbody.drag_area", "has 3 components; nothing was computed. Give one, as towbody.drag_area[0]"),
        ("towbody.drag_aera", "--key: towbody.drag_aera: there is no such key; nothing was started"),
        ("winch", "--key winch: stands for several keys; nothing was computed. Give one of its own"),
    ],
)
def test_a_key_that_is_not_there_is_told(key, text):
    assert text in command("lowered_ctd", "--key", key, code=2).stderr


@pytest.mark.nightly
def test_a_sheave_that_moves_under_its_cable_has_gradients():
    """Contact is stiff: the smallest steps alone follow it. Depth and layback keep those of whole static tows."""
    one = StaticGradients(load_scene("side_scan"))
    for key in ("sheave.radius", "sheave.position[2]"):
        value = number_at(one.scene, key)
        whole = (started(one, key, APART) - started(one, key, -APART)) / (2.0 * APART * value)
        slopes = {slope.figure: slope for slope in one(key).slopes}
        for figure, difference in zip(FIGURES, whole):
            if figure.unit == "m":
                assert slopes[figure.name].apart < 1e-5
                assert slopes[figure.name].slope == pytest.approx(difference, rel=0.01), (key, figure.name)
    assert slopes["tension_drum_n"].apart < 1e-3
