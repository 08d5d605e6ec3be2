"""Layers of cable on the drum: radius, lay and turns by the length wound."""

from math import pi, sqrt

import numpy as np
import pytest
from bench_cable import filled
from hypothesis import given
from hypothesis import strategies as st

from cable_sim_ros.io.scenes.load import SceneError, load_scene, override
from cable_sim_ros.physics.drum_layers import (
    below,
    lay_of,
    layer_of,
    radius_and_slope,
    radius_of,
    second_moment,
    turns_of,
)
from cable_sim_ros.physics.winch import DRUM
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.layout import layout_of
from cable_sim_ros.sim.live_parameters import set_live
from verification.experiments.drum import MU, RADIUS, hanging
from verification.shipped import started

pytestmark = pytest.mark.check


def drum(turns=20.0, radius=0.3, pitch=0.02, rise=0.017):
    return filled(DRUM, lay_turns=turns, radius=radius, lay_pitch=pitch, lay_rise=rise)


DRUMS = st.builds(
    drum,
    turns=st.floats(2.0, 300.0),
    radius=st.floats(0.05, 3.0),
    pitch=st.floats(0.002, 0.2),
    rise=st.floats(0.0, 0.04),
)


@given(DRUMS, st.integers(0, 30))
def test_a_layer_holds_its_turns_and_is_found_again(one, i):
    full = below(one, i + 1.0) - below(one, float(i))
    assert full == pytest.approx(2.0 * pi * (one.radius + i * one.lay_rise) * one.lay_turns)
    assert layer_of(one, below(one, float(i)) + 0.5 * full) == i
    assert turns_of(one, below(one, float(i)) + 0.5 * full) == pytest.approx((i + 0.5) * one.lay_turns)


@given(DRUMS, st.floats(0.0, 1.0))
def test_radius_and_lay_go_on_without_a_jump_also_of_their_slope(one, part):
    end = below(one, 3.0)
    s, d = part * end, 1e-6
    assert abs(radius_of(one, s + d) - radius_of(one, s)) <= 2.0 * one.lay_rise / (pi * one.radius) * d + 1e-12
    (y, slope), (after, later) = lay_of(one, s), lay_of(one, s + d)
    assert abs(after - y - slope * d) < 1e-9 and abs(y) <= 0.5 * one.lay_turns * one.lay_pitch * (1 + 1e-12)
    assert abs(later - slope) <= 2.0 * one.lay_pitch / (2.0 * pi * one.radius) ** 2 * d * 1.01 + 1e-12
    assert one.radius - 1e-12 <= radius_of(one, s) <= one.radius + 3.0 * one.lay_rise


@given(DRUMS, st.integers(0, 6), st.floats(0.01, 0.99))
def test_slope_and_second_moment_are_those_of_the_radius(one, i, part):
    radii = one.radius + np.arange(i + 1) * one.lay_rise
    full, left = 2.0 * pi * one.lay_turns * (radii[:-1] ** 3).sum(), part * 2.0 * pi * one.lay_turns * radii[-1]
    s, d = below(one, float(i)) + left, 1e-6
    assert second_moment(one, s) == pytest.approx(full + radii[-1] ** 2 * left)
    (r, slope), (before, _), (after, _) = (radius_and_slope(one, x) for x in (s, s - d, s + d))
    assert r == radius_of(one, s) and slope == pytest.approx(0.5 * (after - before) / d, abs=1e-5)


def turned(frames, inertia, turns, rise):
    """Pay-out and its rate of a bare drum [m, m/s] by its angle: I w' = (T - F) r under the tension of tick outputs,
    I with the cable turn for turn, of midpoint steps. The radius is that of a layer, even within one."""
    wound = np.linspace(0.0, float(frames.cable_on_drum[0]), 40_001)
    ends = np.cumsum([0.0] + [2.0 * pi * turns * (RADIUS + i * rise) for i in range(40)])
    i = np.searchsorted(ends, wound, "right") - 1
    half, r = pi * RADIUS, RADIUS + i * rise
    low, high = 0.5 + 0.5 * (wound - ends[i]) / half, 0.5 - 0.5 * (ends[i + 1] - wound) / half
    r = np.where((low < 1.0) & (i > 0), r - rise * (1.0 - low**2 * (3.0 - 2.0 * low)), r)
    r = np.where(high > 0.0, r + rise * high**2 * (3.0 - 2.0 * high), r)
    of_cable = MU * np.concatenate([[0.0], np.cumsum(0.5 * (r[1:] ** 2 + r[:-1] ** 2) * np.diff(wound))])
    time, parts = 1e-9 * (frames.time - frames.time[0]), 4
    step, state, found = time[1] / parts, np.zeros(2), [np.zeros(2)]

    def change(t, state):
        left = wound[-1] - state[0]
        radius = np.interp(left, wound, r)
        pull = np.interp(t, time, frames.tension_drum) - frames.motor_pull[1]
        return np.array([state[1] * radius, pull * radius / (inertia + np.interp(left, wound, of_cable))])

    for k in range(parts * (len(time) - 1)):
        middle = state + 0.5 * step * change(k * step, state)
        state = state + step * change((k + 0.5) * step, middle)
        if k % parts == parts - 1:
            found.append(np.array([state[0], state[1] * np.interp(wound[-1] - state[0], wound, r)]))
    return np.array(found).T


def test_a_drum_that_runs_off_its_layers_keeps_its_energy():
    """20 t of drum in overhauling pull, over two layers: its angle, and the account of energy that it is part of. As it
    was without v^2 r'/r it ran 6 % too fast, and its energy grew by 2 e/r a layer without work."""
    mass, turns, rise = 2e4, 4, 0.02
    scene = hanging(
        mass,
        12.0,
        winch__max_rate=10.0,
        winch__lay_width=turns * 0.01,
        winch__lay_rise=rise,
        drive__mode="tension",
        drive__set_pull=2.45e4,
        cable__sections={"all": {"length": 80.0, "drag_law": "off"}},
    )
    sim = started(scene)
    first = sim.run(1).copy()
    set_live(sim, "drive.set_pull", 1e4)
    frames = np.concatenate([first, sim.run(500)]).view(np.recarray)
    assert frames.drum_layer[0] - frames.drum_layer[-1] == 2 and frames.payout_rate[-1] > 5.0
    way, speed = turned(frames, mass * RADIUS**2, turns, rise)
    assert np.abs(frames.payout_rate - speed).max() < 2e-3
    assert np.abs(frames.payout - frames.payout[0] - way).max() < 2e-3
    moves = 0.5 * mass * (RADIUS / frames.drum_lay_radius[-1] * frames.payout_rate[-1]) ** 2
    assert frames.kinetic_energy[-1] > moves, "the drum is part of it"
    assert abs(frames.energy_residual[-1]) < 2e-4 * moves


def test_the_lay_goes_to_and_fro():
    one = drum()
    ends = [below(one, float(i)) for i in range(4)]
    places = [lay_of(one, s)[0] for s in ends]
    assert places[0] == pytest.approx(-0.2) and places[1:] == pytest.approx([0.195, -0.195, 0.195])


def test_one_radius_where_no_width_is_given():
    one = drum(turns=0.0)
    assert radius_of(one, 1e3) == 0.3 and lay_of(one, 1e3) == (0.0, 0.0)
    assert turns_of(one, 1e3) == pytest.approx(1e3 / (2.0 * pi * 0.3))


LAYERS = {"winch.lay_width": 0.6, "winch.scope": None, "winch.cable_on_drum": 142.0}
MOTOR = {"drive.model": "motor", "drive.inertia": 50.0, "drive.curve_speed": [0.0, 6.0], "drive.curve_pull": [5e3, 5e3]}


def test_a_tow_on_a_layered_drum_turns_lays_and_loads_it():
    """Hauling in over a change of layer: the drum turns by the length over the radius, torque is pull times radius."""
    tow = load_scene("full_scale")
    radius, wound = 0.5 * 0.01 + 0.3, 0.6 / 0.01
    first = 2.0 * pi * radius * wound  # m in the first layer
    frames = offline.run(
        override(tow, LAYERS | {"winch.cable_on_drum": first - 4.0}), winch="0.5 rate -0.5", duration=20.0, step="fixed"
    ).frames
    assert frames.drum_layer[0] == 0 and frames.drum_layer[-1] == 1
    assert frames.drum_lay_radius[0] == pytest.approx(radius)
    assert frames.drum_lay_radius[-1] == pytest.approx(radius + 0.5 * sqrt(3.0) * 0.01)
    assert frames.drum_torque == pytest.approx(frames.tension_drum * frames.drum_lay_radius)
    turned = np.diff(frames.drum_angle)[1:-1] / 0.01
    assert np.abs(turned - 0.5 * (frames.drum_rate[1:-2] + frames.drum_rate[2:-1]))[100:].max() < 1e-3
    pitch = 0.01 / (2.0 * pi * radius)  # m across the drum per m wound
    assert np.abs(np.diff(frames.drum_lay)).max() <= frames.payout_rate_tick_max.max() * 0.01 * pitch * 1.001
    assert frames.drum_lay.max() > 0.29, "it turns round at the flange"


def test_a_motor_pulls_less_on_a_higher_layer():
    tow = load_scene("full_scale")
    pulls = {}
    for rise in (0.0, 0.05):
        scene = override(tow, LAYERS | MOTOR | {"winch.lay_rise": rise})
        frames = offline.run(scene, winch="0.5 rate -3", duration=6.0, step="fixed").frames
        pulls[rise] = float(frames.motor_pull.max())
    assert pulls[0.0] == pytest.approx(5e3)
    assert pulls[0.05] == pytest.approx(5e3 * 0.305 / 0.355, rel=1e-6)


def test_what_cannot_be_wound_is_refused():
    tow = load_scene("full_scale")
    for values, words in (
        ({"winch.lay_width": 0.005}, "winch.lay_width = 0.005 m is less than one turn of 0.01 m"),
        ({"winch.lay_width": 0.1, "winch.flange_radius": 0.35}, "the drum has no room for it"),
    ):
        with pytest.raises(SceneError, match=words):
            override(tow, LAYERS | values)
    assert layout_of(override(tow, LAYERS | {"winch.flange_radius": 0.5})).route.wound > 0.0
