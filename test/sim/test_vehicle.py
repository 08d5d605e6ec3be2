"""A vehicle at the far end of the cable: closed forms, energy, a tow cut at its towbody, reach, silence, bad input."""

from __future__ import annotations

import math
from copy import deepcopy

import numpy as np
import pytest

from cable_sim_ros import ShipMotion, Simulator, VehicleMotion
from cable_sim_ros.physics.tick_output import Flag

pytestmark = [pytest.mark.trust, pytest.mark.filterwarnings("ignore::cable_sim_ros.SceneWarning")]

TETHER = {
    "name": "tether",
    "water": {"density": 1026.0, "viscosity": 1.2e-3},
    "cable": {
        "diameter": 0.016,
        "mass_per_length": 0.25,
        "axial_stiffness": 1.0e6,
        "bending_stiffness": 1.0,
        "axial_damping": 100.0,
        "bending_damping": 1.0e-4,
        "added_mass_coefficient": 1.0,
        "sections": {"tether": {"length": 250.0}},
    },
    "winch": {"position": [-14.0, 0.0, 3.0], "drum_radius": 0.35, "scope": 150.0},
    "sheave": {"position": [-16.0, 0.0, 4.0], "radius": 0.30, "groove_depth": 0.030, "throat_angle_deg": 60.0},
    "contact": {"working_tension": 1000.0},
    "setpoint": {"algorithm": "hold"},
    "towbody": {"model": "vehicle"},
    "vehicle": {"position": [-70.0, 20.0, -80.0], "attachment": [0.5, 0.0, 0.5]},
}
WEIGHT = 0.25 * 9.81  # N/m in air
WET = WEIGHT - 1026.0 * 9.81 * 0.25 * math.pi * 0.016**2
LEVEL = {"rate": (0.0, 0.0, 0.0), "attitude": (0.0, 0.0, 0.0)}


def tow(scope: float = 150.0, mass: float = 0.25, accuracy: float = 0.01, **vehicle) -> Simulator:
    """The tether with so much out, its vehicle otherwise."""
    scene = deepcopy(TETHER)
    scene["winch"]["scope"], scene["cable"]["mass_per_length"] = scope, mass
    scene["vehicle"] |= vehicle
    scene["accuracy"] = {"position": accuracy}
    return Simulator(scene)


def at(seconds: float, position, velocity=(0.0, 0.0, 0.0), **more) -> VehicleMotion:
    return VehicleMotion(
        time_ns=round(seconds * 1e9), position=tuple(position), velocity=tuple(velocity), **(LEVEL | more)
    )


def named(frames) -> set[str]:
    word = int(np.bitwise_or.reduce(np.atleast_1d(frames["status"])))
    return {str(flag.name) for flag in Flag if flag and word & flag}


def test_in_air_the_nodes_lie_on_the_catenary_of_the_force_at_the_vehicle():
    """Force and place of the end determine an elastic catenary, here with EI of 1 N m^2 at its sheave."""
    sim = tow(46.0, accuracy=1e-3, position=[-60.0, 0.0, 9.0], attachment=[0.0, 0.0, 0.0])
    sim.start()
    end, (level, _, first) = sim.frame.body_position, sim.frame.vehicle_force
    shape = sim.shape[sim.shape[:, 4] > sim.shape[-1, 4] - 41.0]
    s = shape[-1, 4] - shape[:, 4]  # from the vehicle
    up = first + WEIGHT * s
    x = level / WEIGHT * (np.arcsinh(up / level) - np.arcsinh(first / level)) + level * s / 1e6
    z = (np.hypot(level, up) - np.hypot(level, first)) / WEIGHT + (first * s + 0.5 * WEIGHT * s**2) / 1e6
    assert first < 0.0 < level
    np.testing.assert_allclose(shape[:, 0], end[0] + x, atol=3e-3)
    np.testing.assert_allclose(shape[:, 2], end[2] + z, atol=3e-3)
    assert sim.frame.tension_body == pytest.approx(math.hypot(level, first), rel=2e-3)


def test_in_still_water_tension_falls_with_depth_and_the_pull_along_is_the_same_at_both_ends():
    sim = tow()
    sim.start()
    f = sim.frame
    force, depth = f.vehicle_force, -float(f.body_position[2])
    out = sim.shape[(sim.shape[:, 2] < 3.5) & (sim.shape[:, 0] < -16.0)][0]  # past the bend at the sheave
    expected = float(np.linalg.norm(force)) + WET * depth + WEIGHT * out[2]
    assert out[3] == pytest.approx(expected, rel=3e-3)
    wet = sim.shape[sim.shape[:, 2] < -1.0]
    step, tension = np.diff(wet[:, :3], axis=0), 0.5 * (wet[1:, 3] + wet[:-1, 3])
    pull = tension[:, None] * step[:, :2] / np.linalg.norm(step, axis=1)[:, None]
    np.testing.assert_allclose(pull, np.tile(-force[:2], (len(pull), 1)), rtol=0.02)
    arm = np.array([0.5, 0.0, 0.5])
    np.testing.assert_allclose(f.vehicle_moment, np.cross(arm, force), atol=1e-9)
    np.testing.assert_allclose(f.vehicle_position, [-70.0, 20.0, -80.0], atol=1e-9)


def test_a_taut_cable_swings_with_the_period_of_a_string():
    scene = deepcopy(TETHER) | {"contact": {"working_tension": 6000.0}}
    scene["winch"]["scope"], scene["vehicle"] = 40.0, {"position": [-56.17, 0.0, 4.3], "start_blend": 0.1}
    sim = Simulator(scene)
    sim.start()
    times = np.arange(1, 90) * 0.1
    for t in times:  # aside by 5 cm within half a second
        part = min(t / 0.5, 1.0)
        y, v = 0.05 * part**2 * (3 - 2 * part), 0.05 * 6 * part * (1 - part) / 0.5
        sim.push(at(t, (-56.17, y, 4.3), (0.0, v, 0.0)))
    side = sim.run(800)["vehicle_force"][200:, 1]
    spectrum = np.abs(np.fft.rfft((side - side.mean()) * np.hanning(len(side)), 1 << 16))
    found = np.fft.rfftfreq(1 << 16, 0.01)[spectrum.argmax()]
    tension, free = float(sim.frame.tension_body), 56.17 - 16.0
    assert tension > 2000.0
    assert found == pytest.approx(math.sqrt(tension / 0.25) / (2.0 * free), rel=0.01)


def test_the_work_of_a_vehicle_on_a_circle_is_in_the_balance_of_energy():
    sim, (x, y, z), w = tow(), (-70.0, 20.0, -80.0), 2.0 * math.pi / 30.0
    sim.start()
    for k in range(1, 402):
        c, s = math.cos(0.1 * k * w), math.sin(0.1 * k * w)
        sim.push(at(0.1 * k, (x + 5.0 * (c - 1.0), y + 5.0 * s, z), (-5.0 * w * s, 5.0 * w * c, 0.0)))
    f = sim.run(4000)
    moved = f["body_position"] - f["vehicle_position"]
    np.testing.assert_allclose(moved, np.tile([0.5, 0.0, 0.5], (4000, 1)), atol=1e-9)
    work = float(np.trapezoid(f["vehicle_power"], dx=0.01))
    assert work > 500.0 and f["work_supplied"][-1] == pytest.approx(work, rel=0.02)  # the drum stands still
    assert abs(f["energy_residual"]).max() < 1e-3 * work
    assert not named(f) & {"VEHICLE_LIMITED", "VEHICLE_STALE", "HALVED"}
    power = -(f["vehicle_force"] * f["body_velocity"]).sum(1)
    np.testing.assert_allclose(f["vehicle_power"], power, rtol=1e-9)


def test_a_tow_cut_at_its_towbody_does_the_same():
    """The motion of a towbody given to a vehicle: the cable cannot tell them apart."""
    scene = deepcopy(TETHER)
    del scene["vehicle"]
    scene["winch"]["scope"] = 60.0
    scene["towbody"] = {"mass": 60.0, "net_weight": 300.0, "added_mass": [20.0] * 3, "drag_area": [0.1] * 3}
    whole = Simulator(scene)
    cut = deepcopy(scene) | {"towbody": {"model": "vehicle"}}
    whole.start()
    cut = Simulator(cut | {"vehicle": {"position": whole.frame.body_position.tolist()}})
    cut.start()
    assert cut.frame.tension == pytest.approx(whole.frame.tension, rel=1e-3)
    w = 2.0 * math.pi / 8.0
    for sim in (whole, cut):
        for k in range(1, 302):
            t = 0.1 * k
            heave = ShipMotion(
                time_ns=round(t * 1e9),
                position=(0.0, 0.0, math.sin(w * t)),
                velocity=(0.0, 0.0, w * math.cos(w * t)),
                **LEVEL,
            )
            sim.push(heave)
    one = whole.run(3000)
    for k in range(4, 3000, 5):
        cut.push(at(0.01 * (k + 1), one["body_position"][k], one["body_velocity"][k]))
    two = cut.run(2995)
    late = slice(1200, 2995)
    assert one["tension"][late].std() > 20.0
    miss = two["tension"][late] - one["tension"][late]
    assert miss.std() < 0.02 * one["tension"][late].std()
