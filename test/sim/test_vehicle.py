"""A vehicle at the far end of the cable: closed forms, energy, a tow cut at its towbody, reach, silence, bad input."""

from __future__ import annotations

import math
from copy import deepcopy

import numpy as np
import pytest
from underway import goes_on, refused, sail

from cable_sim_ros import Simulator, VehicleMotion
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.inputs import InputError
from cable_sim_ros.sim.simulator import StartError

pytestmark = pytest.mark.trust

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


def tow(scope: float = 150.0, mass: float = 0.25, accuracy: float = 0.01, said=None, **vehicle) -> Simulator:
    """The tether after its start with so much out, its vehicle otherwise; said: a pose that came before."""
    scene = deepcopy(TETHER)
    scene["winch"]["scope"], scene["cable"]["mass_per_length"] = scope, mass
    scene["vehicle"] |= vehicle
    scene["accuracy"] = {"position": accuracy}
    sim = Simulator(scene)
    if said:
        sim.push(at(0.01, said))
    sim.start()
    return sim


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
    velocity = f["vehicle_velocity"]
    wrong = np.diff(f["vehicle_position"], axis=0) / 0.01 - 0.5 * (velocity[1:] + velocity[:-1])
    assert np.abs(wrong).max() < 1e-3 * np.abs(velocity).max()
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
            sail(sim, 0.1 * k, math.sin(0.1 * w * k), w * math.cos(0.1 * w * k))
    one = whole.run(3000)
    for k in range(4, 3000, 5):
        cut.push(at(0.01 * (k + 1), one["body_position"][k], one["body_velocity"][k]))
    two = cut.run(2995)
    late = slice(1200, 2995)
    assert one["tension"][late].std() > 20.0
    miss = two["tension"][late] - one["tension"][late]
    assert miss.std() < 0.02 * one["tension"][late].std()


def test_beyond_its_reach_the_end_stays_behind_and_nothing_is_lost():
    """Away at 2 m/s, and back: the flag comes and goes, the end stays within the reach, energy stays balanced."""
    sim = tow(95.0, position=[-70.0, 0.0, -60.0], start_blend=0.5)
    for k in range(1, 602):
        t = 0.1 * k
        out, v = (2.0 * t, -2.0) if t < 20.0 else (80.0 - 2.0 * t, 2.0)
        sim.push(at(t, (-70.0 - out, 0.0, -60.0), (v, 0.0, 0.0)))
    f = sim.run(4000)
    far = np.linalg.norm(f["body_position"] - f["sheave_position"], axis=1)
    assert far.max() < 95.0 * (1.0 + 2.0 * 1000.0 / 1e6) + 1.0 and f["vehicle_off"].max() > 15.0
    assert "VEHICLE_LIMITED" in named(f) and not named(f) & {"NEWTON_FAILED", "NOT_FINITE"}
    back = f[3500:]
    assert back["vehicle_off"].max() == 0.0 and back["tension"].mean() < 500.0
    assert abs(f["energy_residual"]).max() < 2e-3 * np.abs(f["work_supplied"]).max()
    # velocity and acceleration of the end are those of its place
    v = np.gradient(f["body_position"], 0.01, axis=0)[800:1500]
    np.testing.assert_allclose(f["body_velocity"][800:1500], v, atol=0.02)


def test_a_vehicle_does_not_go_into_the_seabed():
    scene = deepcopy(TETHER) | {"seabed": {"depth": 90.0}}
    sim = Simulator(scene)
    sim.start()
    for k in range(1, 302):
        sim.push(at(0.1 * k, (-70.0, 20.0, -80.0 - 0.1 * k), (0.0, 0.0, -1.0)))
    f = sim.run(2500)
    assert f["body_position"][:, 2].min() >= -90.0 - 1e-9 and f["vehicle_off"][-1] > 10.0
    assert "VEHICLE_LIMITED" in named(f)


def test_a_vehicle_that_falls_silent_keeps_its_depth_and_goes_on_at_its_mean_speed():
    sim = tow(start_blend=0.5)
    for k in range(1, 201):
        sim.push(at(0.1 * k, (-70.0 + 0.03 * k, 20.0, -80.0 + 0.02 * k), (0.3, 0.0, 0.2)))
    f = sim.run(4000)
    assert not named(f[:2200]) & {"VEHICLE_STALE"} and "VEHICLE_STALE" in named(f[2300:2310])
    rise = f["vehicle_position"][:, 2]
    assert rise[-1] == pytest.approx(rise[2000], abs=0.01) and 0.1 < rise[2000:].max() - rise[2000] < 0.3
    speed = (f["vehicle_position"][-1, 0] - f["vehicle_position"][3000, 0]) / 9.99
    assert speed == pytest.approx(0.3, abs=0.01)
    for k in range(400, 451):  # and comes back elsewhere
        sim.push(at(0.1 * k, (-50.0, 20.0, -70.0)))
    f = sim.run(1000)
    speeds = np.linalg.norm(np.diff(f["vehicle_position"], axis=0), axis=1) / 0.01
    assert "VEHICLE_BLENDING" in named(f) and speeds.max() < 5.0 + 0.4
    np.testing.assert_allclose(f["vehicle_position"][490], (-50.0, 20.0, -70.0), atol=1.0)


def test_a_jump_is_taken_up_at_the_largest_speed():
    sim = tow(start_blend=0.5, max_speed=3.0)
    for k in range(1, 302):
        sim.push(at(0.1 * k, (-70.0 if k < 50 else -40.0, 20.0, -80.0)))
    f = sim.run(3000)
    speeds = np.linalg.norm(np.diff(f["vehicle_position"], axis=0), axis=1) / 0.01
    assert 2.5 < speeds.max() < 3.01
    np.testing.assert_allclose(f["vehicle_position"][2500], (-40.0, 20.0, -80.0), atol=1e-6)


def test_the_first_pose_that_is_known_is_that_of_the_start():
    sim = tow(said=(-60.0, 0.0, -70.0))
    np.testing.assert_allclose(sim.frame.vehicle_position, (-60.0, 0.0, -70.0), atol=1e-9)
    with pytest.raises(InputError, match="above vehicle.max_speed = 5 m/s"):
        sim.push(at(0.1, (-60.0, 0.0, -70.0), (6.0, 0.0, 0.0)))


@pytest.mark.parametrize("slack", [{}, {"mass": 0.2063}], ids=["heavy", "neutral"])
def test_slack_cable_starts_and_runs(slack):
    """Twice as long as its chord; the neutrally buoyant one has no weight that draws it anywhere."""
    sim = tow(100.0, position=[-40.0, 0.0, -30.0], **slack)
    f = sim.run(500)
    assert np.isfinite(f["tension"]).all() and not named(f) & {"DETACHED", "VEHICLE_LIMITED"}
    assert abs(f["energy_residual"]).max() < 0.1
    assert np.linalg.norm(f["body_velocity"]) == 0.0


FISH = {"mass": 60.0, "net_weight": 300.0}


@pytest.mark.parametrize(
    "vehicle, beside, text",
    [
        ({"position": [-200.0, 0.0, -80.0]}, {}, "m of straight cable away, and 150 m are out (winch.scope)"),
        ({"position": [-70.0, 0.0, -122.0]}, {"seabed": {"depth": 100.0}}, "21.5 m below the seabed"),
        ({"attitude_deg": [0.0, 89.0, 0.0]}, {}, "vehicle.attitude_deg has a pitch of 89 deg"),
        ({"position": None}, {}, "vehicle.position is missing"),
        ({"max_speed": 0.0}, {}, "vehicle.max_speed = 0.0 m/s is outside [0.01, 50] m/s"),
        ({"postion": [0.0, 0.0, 0.0]}, {}, "Did you mean vehicle.position"),
        ({}, {"towbody": FISH}, "has no effect: with towbody.model = level there is no"),
        ({}, {"towbody": {"model": "vehicle", "mass": 5.0}}, "towbody.mass is given to a body of model vehicle"),
        ({}, {"bodies": {"a": FISH | {"model": "vehicle", "at": "tether"}}}, "a.model = vehicle is a body on the line"),
    ],
)
def test_what_no_vehicle_has_is_refused(vehicle, beside, text):
    scene = deepcopy(TETHER) | beside
    scene["vehicle"] |= vehicle
    assert text in refused(Simulator, scene)


def test_no_motion_of_a_vehicle_is_taken_where_there_is_none():
    scene = deepcopy(TETHER) | {"towbody": FISH}
    del scene["vehicle"]
    with pytest.raises(InputError, match="a VehicleMotion was given, and towbody.model = level"):
        Simulator(scene).push(at(0.1, (0.0, 0.0, 0.0)))


def test_it_begins_where_its_cable_reaches():
    with pytest.raises(StartError, match="m of straight cable away, and 150 m are out"):
        tow(said=(-300.0, 0.0, -70.0))


def test_a_saved_tow_goes_on_with_its_vehicle_bit_for_bit(tmp_path):
    sim = tow()
    for k in range(1, 60):
        sim.push(at(0.1 * k, (-70.0, 20.0 + 0.05 * k, -80.0), (0.0, 0.5, 0.0)))
    sim.run(200)
    goes_on(sim, 300, tmp_path)
