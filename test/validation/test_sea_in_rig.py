"""Cable and bodies in waves and sheared currents: closed forms through the Rig, the tow as a whole."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.sea import ELEVATION, EXTRA, current_at
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.water import CurrentTable, CurrentVariation, Turbulence, Water, Waves
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.rig.rig import HALVED, Rig, cable_of
from cable_sim_ros.sim.simulator import Simulator
from verification.shipped import scene_with, started

pytestmark = pytest.mark.trust

RHO, G, D, CD, CA = 1026.0, 9.81, 0.05, 1.2, 1.0
AREA = 0.25 * np.pi * D**2
HEIGHT, PERIOD = 0.6, 4.0
OMEGA = 2.0 * np.pi / PERIOD
K = OMEGA**2 / G
SEA = Waves(kind="airy", height=HEIGHT, period=PERIOD)


def held_cylinder(start, direction, length, water, elements=8):
    """A cylinder of 50 mm, held all along; its weight is that of its displaced water."""
    section = {"length": length, "elements": elements, "drag_law": "crossflow", "drag_coefficient": CD}
    cable = cable_of([section], diameter=D, mass_per_length=RHO * AREA, axial_stiffness=1e6)
    rig = Rig(cable, held=dict.fromkeys(range(elements + 1), "rg"), tension=100.0, water=water, gravity=G)
    rig.straight(start, direction)
    return rig


def water_on(rig):
    """Force of the water on a held line, less buoyancy [3]: what holds it, reversed."""
    return -rig.state.reaction[:, :3].sum(0)


def orbital(x, z, t):
    """Velocity and acceleration, x and z, of the regular wave towards x in deep water."""
    a, theta, up = 0.5 * HEIGHT, K * x - OMEGA * t, np.exp(K * np.minimum(z, 0.0))
    u = np.array((a * OMEGA * up * np.cos(theta), a * OMEGA * up * np.sin(theta)))
    return u, np.array((a * OMEGA**2 * up * np.sin(theta), -a * OMEGA**2 * up * np.cos(theta)))


def test_morison_on_a_horizontal_cylinder_along_the_crests():
    """rho A (1 + C_a) a + rho d C_D |u| u / 2 per length, in both directions across."""
    rig = held_cylinder((3.0, 0.0, -1.0), (0.0, 1.0, 0.0), 4.0, Water(density=RHO, waves=SEA, ramp=0.0))
    time = 0.0
    for _ in range(8):
        rig.run(0.5, 0.1)
        time += 0.5
        u, a = orbital(3.0, -1.0, time)
        exact = 4.0 * (RHO * AREA * (1.0 + CA) * a + 0.5 * RHO * D * CD * np.hypot(*u) * u)
        np.testing.assert_allclose(water_on(rig)[[0, 2]], exact, atol=2e-4 * np.abs(exact).max())
    assert rig.state.now.sea.time == pytest.approx(4.0, abs=1e-12)


def test_morison_on_a_vertical_cylinder_through_the_surface():
    """Across: both parts of Morison up to the surface of the moment; along: Froude-Krylov alone, and the buoyancy of
    what the wave wets beyond z = 0."""
    rig = held_cylinder((0.0, 0.0, 1.0), (0.0, 0.0, -1.0), 9.0, Water(density=RHO, waves=SEA, ramp=0.0), 18)
    time, x, w = 0.0, *np.polynomial.legendre.leggauss(40)
    for _ in range(4):
        rig.run(0.9, 0.1)
        time += 0.9
        eta = 0.5 * HEIGHT * np.cos(-OMEGA * time)
        found, across, along = water_on(rig), 0.0, 0.0
        for low, high in ((-8.0, min(eta, 0.0)), (0.0, max(eta, 0.0))):  # vertical stretching above z = 0
            z = 0.5 * (high - low) * x + 0.5 * (high + low)
            u, a = orbital(0.0, z, time)
            load = RHO * AREA * (1.0 + CA) * a[0] + 0.5 * RHO * D * CD * np.abs(u[0]) * u[0]
            across += 0.5 * (high - low) * (w * load).sum()
            along += 0.5 * (high - low) * (w * RHO * AREA * a[1]).sum()
        along += RHO * AREA * G * (eta + 8.0 - 9.0)  # the reaction holds the weight of nine metres
        assert found[0] == pytest.approx(across, rel=2e-3, abs=0.02)
        assert found[2] == pytest.approx(along, rel=2e-3, abs=0.02)


def test_a_small_floating_body_goes_with_the_water():
    """Neutral, with any added mass and drag: the path of a particle.

    In a low wave: the convective acceleration, second order in the steepness, is left out (docs/waves.md).
    """
    body = Towbody(mass=10.0, net_weight=0.0, added_mass=(3.0, 7.0, 5.0), drag_area=(0.02, 0.02, 0.02))
    cable = cable_of([{"length": 0.2, "elements": 1}], diameter=D, mass_per_length=RHO * AREA, axial_stiffness=1e4)
    wave = Waves(kind="airy", height=0.004, period=PERIOD)
    rig = Rig(cable, held={}, bodies={0: body}, tension=1.0, water=Water(density=RHO, waves=wave, ramp=2.0), gravity=G)
    rig.straight((1.0, 0.0, -2.0), (0.0, 1.0, 0.0))
    rig.balance()
    history = rig.run(8.0, 0.02, rules=HALVED)

    def drift(t, r):
        grown = min(t / 2.0, 1.0)
        return grown * grown * (3.0 - 2.0 * grown) * orbital(r[0], r[1], t)[0] / 150.0

    path = solve_ivp(drift, (0.0, 8.0), (1.0, -2.0), t_eval=history.time, rtol=1e-9, atol=1e-12).y
    radius = 0.002 * np.exp(-2.0 * K)
    assert np.ptp(history.q[:, 0, 0]) > 1.5 * radius
    assert np.abs(history.q[:, 0, [0, 2]] - path.T).max() < 0.03 * radius


@pytest.mark.parametrize("heading", [0.0, 2.0, np.pi])
def test_the_ship_meets_the_waves_at_the_encounter_frequency(heading):
    """A place that moves with the tow frame sees w - k U cos(heading of the ship to the waves)."""
    rig = held_cylinder((0.0, 0.0, -0.2), (0.0, 1.0, 0.0), 0.4, Water(density=RHO, waves=SEA, ramp=0.0), 1)
    rig.state.now.frame.velocity[:] = 2.5 * np.cos(heading), 2.5 * np.sin(heading)
    rig.state.now.current[:2] = -rig.state.now.frame.velocity
    met, t = OMEGA - K * 2.5 * np.cos(heading), 0.0
    for _ in range(60):
        rig.run(0.1, 0.1)
        t += 0.1
        assert rig.state.work.around[0, ELEVATION] == pytest.approx(0.5 * HEIGHT * np.cos(met * t), abs=1e-9)


def test_a_halved_step_ends_in_the_water_of_its_end():
    """Pieces of a step, and steps taken back, leave the time of the water where the steps are."""
    times = []
    for pieces in (1, 4):
        rig = held_cylinder((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), 1.0, Water(density=RHO, waves=SEA, ramp=0.0), 1)
        rig.state.now.control.level = {1: 0, 4: 2}[pieces]  # begins as if it had been halved so often
        taken = list(rig.steps(0.4))
        assert len(taken) >= 1 and sum(taken) == pytest.approx(0.4)
        times.append((rig.state.now.sea.time, water_on(rig)[0]))
    assert times[0] == pytest.approx(times[1], rel=1e-9)
    exact = orbital(0.0, -1.0, 0.4)
    load = RHO * AREA * 2.0 * exact[1][0] + 0.5 * RHO * D * CD * np.hypot(*exact[0]) * exact[0][0]
    assert times[0][1] == pytest.approx(load, rel=1e-3)


def test_forces_of_now_are_those_of_the_water_of_now():
    """Before the first step, and after one: the residual counts tables and waves where the line is."""
    water = Water(density=RHO, current_table=CurrentTable(depth=(0.0, 4.0), east=(0.8, 0.4)), waves=SEA, ramp=0.0)
    rig = held_cylinder((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), 1.0, water, 1)
    for time in (0.0, 0.3):
        if time > 0.0:
            rig.run(time, 0.1)
        rig.residual()
        u, a = orbital(0.0, -1.0, time)
        u[0] += 0.7
        exact = RHO * AREA * (1.0 + CA) * a + 0.5 * RHO * D * CD * np.hypot(*u) * u
        np.testing.assert_allclose(water_on(rig)[[0, 2]], exact, atol=2e-4 * np.abs(exact).max())


def test_turbulence_reaches_the_cable_and_grows_from_the_start():
    water = Water(density=RHO, current=(0.5, 0.0), turbulence=Turbulence(deviation=(0.1, 0.0, 0.05)), ramp=4.0)
    rig = held_cylinder((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), 2.0, water, 1)
    seen = []
    for _ in range(200):
        rig.run(0.4, 0.2)
        seen.append(rig.state.work.stream[0, 0, EXTRA : EXTRA + 3, 0].copy())
    seen = np.array(seen)
    assert np.abs(seen[0]).max() < 0.2 * np.abs(seen[10:]).max() and not seen[:, 1].any()
    np.testing.assert_allclose(seen[10:].std(0)[[0, 2]], (0.1, 0.05), rtol=0.2)
    assert water_on(rig)[0] != 0.0


TABLE = CurrentTable(depth=(0.0, 5.0, 12.0, 20.0), speed=(2.0, 1.2, 0.9, 0.3), towards_deg=(0.0, 60.0, 150.0, 200.0))


def hanging(water):
    section = {"length": 25.0, "elements": 20, "drag_law": "crossflow", "drag_coefficient": CD}
    cable = cable_of([section], diameter=0.02, mass_per_length=1.5, axial_stiffness=1e6)
    rig = Rig(cable, held={0: "r"}, bodies={-1: 60.0}, tension=800.0, water=water, gravity=G)
    rig.straight((0.0, 0.0, 1.0), (0.0, 0.0, -1.0))
    return rig


def test_a_strongly_sheared_turning_current_comes_to_rest_and_stays():
    """Where the current turns by 200 deg over 20 m; what is at rest stays there."""
    rig = hanging(Water(density=RHO, current_table=TABLE))
    assert rig.settle() < 40
    drift = [rig.state.q[n, 1] for n in range(rig.nodes)]
    assert max(drift) > 0.3, "the cable is set to the side where the current turns"
    before = rig.state.q.copy()
    rig.run(2.0, 0.1)
    np.testing.assert_allclose(rig.state.q, before, atol=1e-5)
    x, y = current_at(rig.model.sea, rig.state.now, -12.0)
    np.testing.assert_allclose((x, y), 0.9 * np.array((np.cos(np.radians(150)), np.sin(np.radians(150)))), atol=1e-9)


def test_a_table_that_is_a_line_is_the_linear_current():
    linear = hanging(Water(density=RHO, current=(0.8, 0.1), current_gradient=(-0.02, 0.01)))
    table = CurrentTable(depth=(0.0, 10.0, 30.0), east=(0.8, 0.6, 0.2), north=(0.1, 0.2, 0.4))
    tabled = hanging(Water(density=RHO, current_table=table))
    linear.settle()
    tabled.settle()
    np.testing.assert_allclose(tabled.state.q, linear.state.q, atol=5e-6)


def test_the_current_varies_with_time_as_its_table_says():
    change = CurrentVariation(time=(0.0, 5.0, 10.0), factor=(1.0, 1.0, 0.5), turn_deg=(0.0, 45.0, 90.0))
    for water in (
        Water(density=RHO, current=(0.8, 0.0), current_gradient=(-0.01, 0.0), current_variation=change),
        Water(density=RHO, current_table=CurrentTable(depth=(0.0, 40.0), east=(0.8, 0.4)), current_variation=change),
    ):
        rig = hanging(water)
        rig.settle()
        assert current_at(rig.model.sea, rig.state.now, -10.0) == pytest.approx((0.7, 0.0), abs=1e-9)
        rig.run(5.0, 0.1)
        half = 0.7 * np.sqrt(0.5)
        assert current_at(rig.model.sea, rig.state.now, -10.0) == pytest.approx((half, half), abs=1e-6)
        rig.run(7.0, 0.1)
        assert current_at(rig.model.sea, rig.state.now, -10.0) == pytest.approx((0.0, 0.35), abs=1e-9)


WILD = {
    "water.waves.kind": "jonswap",
    "water.waves.height": 2.0,
    "water.waves.spreading": 8.0,
    "water.turbulence.deviation": [0.02, 0.02, 0.01],
    "water.current_table.depth": [0.0, 40.0, 100.0],
    "water.current_table.east": [-0.3, 0.1, 0.0],
    "water.current_table.north": [0.0, 0.2, 0.0],
    "water.current_variation.time": [0.0, 60.0],
    "water.current_variation.factor": [1.0, 0.5],
    "water.ramp": 5.0,
}


@pytest.fixture(scope="module")
def tow():
    return started(scene_with("full_scale", WILD))


def test_waves_begin_without_a_jump_and_a_run_from_a_file_is_the_run_bit_for_bit(tow, tmp_path):
    """Save, load, restore, run again: with waves, turbulence and a changing current."""
    at_rest = float(tow.frame.tension)
    assert tow.frame.surface_elevation == 0.0
    frames = tow.run(300)
    assert abs(frames.tension[0] - at_rest) < 1e-3 * at_rest
    assert np.ptp(frames.surface_elevation) > 0.05 and np.abs(np.diff(frames.surface_elevation)).max() < 0.1
    saved, path = tow.snapshot(), tmp_path / "sea.npz"
    tow.save(path)
    whole = tow.run(60)
    assert np.ptp(whole.tension) > 1.0
    other = Simulator.load(path)
    assert np.concatenate([other.run(20) for _ in range(3)]).tobytes() == whole.tobytes()
    tow.restore(saved)
    assert tow.run(60).tobytes() == whole.tobytes()


def test_a_second_start_is_the_first_again(tow):
    tow.start()
    one = tow.run(30).tobytes()
    tow.start()
    assert tow.run(30).tobytes() == one


def test_elevation_is_that_of_the_sea_where_the_sheave_is(tow):
    """Phases belong to odom: the place of the sheave there and the time since the start tell the elevation."""
    tow.start()
    frame, waves = tow.run(700)[-1], tow.model.line.sea.waves
    x, y, t = frame.sheave_position[0], frame.sheave_position[1], 7.0
    k, omega, phase, b = waves[:, 1], waves[:, 2], waves[:, 3], waves[:, 4]
    eta = (waves[:, 0] * np.cos(k * (x * np.cos(b) + y * np.sin(b)) - omega * t + phase)).sum()
    assert frame.surface_elevation == pytest.approx(eta, abs=1e-6)


def test_a_replay_of_a_recording_is_the_run_bit_for_bit(tmp_path):
    ran = offline.run(override(load_scene("full_scale"), WILD), heave=(0.5, 8.0), duration=4.0, out=tmp_path / "run")
    again = offline.replay(ran.bag)
    assert again.metrics["largest_difference"] == {"field": "", "difference": 0.0, "ticks": 400}
    assert np.ptp(ran.frames.surface_elevation) > 0.05


def test_chosen_steps_see_the_water_of_their_end():
    """Ticks divided by their error: the same sea at the same time, and next to the same tow."""
    values = {"water.waves.kind": "airy", "water.waves.height": 2.0, "water.ramp": 4.0}
    fixed = started(scene_with("full_scale", values))
    chosen = started(scene_with("full_scale", values | {"solver.tick": 0.2, "solver.tension_error": 1e-4}))
    frames = []
    for sim, ticks in ((fixed, 1000), (chosen, 50)):
        frames.append(sim.run(ticks)[-1])
        assert sim.state.now.sea.time == pytest.approx(10.0, abs=1e-9)
    assert len(chosen.steps) > 1, "of several lengths"
    assert frames[0].surface_elevation == pytest.approx(frames[1].surface_elevation, abs=1e-6)
    assert frames[0].tension == pytest.approx(frames[1].tension, rel=2e-4)
