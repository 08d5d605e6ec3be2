"""Starter scenes: no caution, statics as by hand, 120 s of heave without a flag but that of the start."""

import warnings
from math import acos, degrees, pi, sqrt

import numpy as np
import pytest
from underway import sail

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.layout import layout_of
from verification.shipped import started

pytestmark = pytest.mark.trust

HEAVE = {"side_scan": (1.2, 8.0), "lowered_ctd": (1.2, 8.0), "flume": (0.02, 2.0)}  # m, s
COMPENSATED = ("side_scan", "lowered_ctd")  # hauling in stops 1 m from the end: the flume has no more than that


def begun(name, **changes):
    """Simulator at its static start; any caution of the scene is an error."""
    with warnings.catch_warnings(action="error"):
        scene = override(load_scene(name), changes)
    return started(scene)


def frames_of_heave(sim, amplitude, period, seconds):
    """Tick outputs of a ship that heaves; 50 Hz motion, pushed a second ahead."""
    w, frames = 2.0 * pi / period, []
    for second in range(seconds):
        for t in 0.02 * np.arange(50 * (second + 1) * (second > 0), 50 * (second + 2)):
            sail(sim, t, amplitude * np.sin(w * t), amplitude * w * np.cos(w * t))
        frames.append(sim.run(100))
    return np.concatenate(frames)


@pytest.mark.parametrize("name", HEAVE)
def test_heave_raises_no_flag_but_that_of_the_start(name):
    sim = begun(name)
    assert len(layout_of(sim.scene).elements) < 150
    frames = frames_of_heave(sim, *HEAVE[name], 120)
    assert Flag(int(np.bitwise_or.reduce(frames["status"]))) == Flag.MOTION_BLENDING
    assert not frames["status"][1100:].any()
    assert frames["tension_least"].min() > 0.0


@pytest.mark.parametrize("name", COMPENSATED)
def test_compensation_fits_the_mesh(name):
    """Winch driven by the heave: no caution, no flag, and less than a third of the tension's deviation is left."""
    deviation = []
    for law in ("hold", "simplified_sheave"):
        frames = frames_of_heave(begun(name, **{"setpoint.algorithm": law}), *HEAVE[name], 60)
        assert Flag(int(np.bitwise_or.reduce(frames["status"]))) == Flag.MOTION_BLENDING
        deviation.append(frames["tension"][2000:].std())
    assert deviation[1] < deviation[0] / 3.0


def test_side_scan_hangs_at_the_critical_angle():
    """Just below the surface w cos b = C_D G rho/2 d V^2 sin^2 b for the angle b from the horizontal, C_D 1.2."""
    sim = begun("side_scan")
    scene, shape = sim.scene, sim.shape
    weight = (0.389 - 1026.0 * pi / 4.0 * 0.010**2) * 9.81
    k = weight / (1.2 * 1.8 * 0.5 * 1026.0 * 0.010 * scene.ship.tow_speed**2)
    by_hand = degrees(acos(sqrt((k / 2.0) ** 2 + 1.0) - k / 2.0))  # c^2 + k c = 1 for c = cos b
    wet = shape[shape[:, 2] < 0.0][:2]
    dx, _, dz = np.diff(wet[:, :3], axis=0)[0]
    assert degrees(np.arctan2(-dz, -dx)) == pytest.approx(by_hand, abs=1.0)
    assert -sim.frame.body_position[2] == pytest.approx(54.1, abs=0.5)
    assert sim.frame.tension == pytest.approx(634.0, rel=0.01), "its factor is of a measured C_D: 704 N with (64)"


@pytest.mark.parametrize("name", ["full_scale", "full_scale_contact", "full_scale_westin"])
def test_the_body_of_the_full_scale_tow_moves_the_water_of_its_scene(name):
    """Added mass of a cylinder of 0.3 m and 3 m: C_m 0.05 along, 1.0 across."""
    scene = load_scene(name)
    displaced = scene.water.density * 0.25 * pi * 0.3**2 * 3.0
    assert scene.towbody.added_mass[1:] == pytest.approx((displaced, displaced), rel=1e-3)
    assert scene.towbody.added_mass[0] == pytest.approx(0.05 * displaced, rel=0.04)


def test_lowered_ctd_weighs_what_hangs():
    """Nearly vertical: tension is the weight of rosette, wet cable and dry cable."""
    sim = begun("lowered_ctd")
    depth, height = -sim.frame.body_position[2], sim.scene.sheave.position[2]
    wet = (0.471 - 1026.0 * pi / 4.0 * 0.011**2) * 9.81
    assert sim.frame.tension == pytest.approx(2200.0 + wet * depth + 0.471 * 9.81 * height, rel=0.005)
    assert depth == pytest.approx(1493.9, abs=0.5) and degrees(sim.frame.departure_angle) < 1.0


def test_flume_puts_the_sphere_where_it_was_measured():
    """Westin (2018) 4.3.1: 0.708 m downstream, 0.685 m below the top of the winch; his own model is 5.0 mm off."""
    sim = begun("flume")
    place = sim.frame.body_position - (0.0, 0.0, 0.46)
    assert np.hypot(place[0] + 0.708, place[2] + 0.685) < 0.010
