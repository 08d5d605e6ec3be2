"""The tow inside an FMU, without FMI: clock, inputs, forces, state; and what the builder refuses."""

import json
import sys

import numpy as np
import pytest
from calling import cable_sim
from heaving_ship import NAMES, numbers, pushed

from cable_sim_ros import CableSimError, Simulator, VehicleMotion, WinchCommand
from cable_sim_ros.io.scenes.load import dump_scene, load_scene, override
from cable_sim_ros.tools.fmu import tow as module
from cable_sim_ros.tools.fmu.slave import rows
from cable_sim_ros.tools.fmu.tow import FmuError, Tow, matrix
from cable_sim_ros.tools.fmu.variables import INPUTS, OUTPUTS, PARAMETERS, UNITS, VEHICLE_INPUTS, VEHICLE_OUTPUTS

TICK, STEP = 0.02, 0.1
SCENE = {"solver.tick": TICK}


def packed(folder, name, **about):
    """What an FMU of a shipped scene holds."""
    (folder / module.SCENE_FILE).write_text(dump_scene(override(load_scene(name), SCENE)))
    (folder / module.ABOUT_FILE).write_text(json.dumps({"name": name, "version": module.__version__, **about}))
    return folder


@pytest.fixture
def resources(tmp_path):
    return packed(tmp_path, "side_scan", parameters={"water.density": load_scene("side_scan").water.density})


def begun(resources, t=0.0, **values):
    tow = Tow(resources)
    tow.begin_at(t)
    give(tow, t)
    tow.values.update(values)
    tow.start()
    return tow


def give(tow, t):
    for name, value in zip(NAMES, numbers(t)):
        tow.set(name, float(value))


def test_a_step_is_its_ticks_under_the_cubic_to_the_motion_at_its_end(resources):
    tow = begun(resources)
    sim = Simulator(override(load_scene("side_scan"), SCENE))
    sim.start(0, (0.0, 0.0), 0.0)
    sim.push(pushed(0.0))
    tow.values.update({"winch.mode": 1, "winch.rate": 0.2})
    for k in range(20):
        give(tow, (k + 1) * STEP)
        tow.step(k * STEP, STEP)
        sim.push(pushed((k + 1) * STEP))
        sim.push(WinchCommand(rate=0.2))
        frames = sim.run(5)
        assert tow.output("cable.tension") == frames[-1].tension
        assert tow.output("cable.tension_largest") == frames["tension_tick_max"].max()
        assert tow.output("winch.payout") == frames[-1].payout
    assert tow.output("winch.payout") > 208.7 and tow.output("health.verdict") == 0
    assert tow.output("health.motion_misfit") < 0.01 and not tow.said


def test_the_force_is_that_of_the_contact_and_its_moment_that_of_its_point(resources):
    tow = begun(resources)
    for k in range(30):
        give(tow, (k + 1) * STEP)
        tow.step(k * STEP, STEP)
    sim = tow.sim
    ship = np.array([tow.output(f"force.ship.{a}") for a in "xyz"])
    world = np.array([tow.output(f"force.world.{a}") for a in "xyz"])
    turn = matrix(sim.frame.ship_quaternion)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
    np.testing.assert_allclose(world, turn @ ship, rtol=1e-12)
    assert np.linalg.norm(world) == pytest.approx(sim.frame.tension) and world[2] < 0 and world[0] < 0
    down = np.arccos(-world[2] / np.linalg.norm(world))
    assert down == pytest.approx(sim.frame.departure_angle, abs=1e-9)
    point = np.array([tow.output(f"force.point_ship.{a}") for a in "xyz"])
    loaded = sim.contact[sim.contact[:, 4] + sim.contact[:, 5] > 0.0]
    last = loaded[-1, :3] + np.array(sim.scene.sheave.position)  # axes of sheave_link
    assert np.linalg.norm(point - last) < 0.1 * sim.scene.sheave.radius + sim.contact[:, 8].max()
    moment = [tow.output(f"force.moment_ship.{a}") for a in "xyz"]
    np.testing.assert_allclose(moment, np.cross(point, ship), rtol=1e-12)
    place = np.array([tow.output(f"force.point_world.{a}") for a in "xyz"])
    np.testing.assert_allclose(place, sim.frame.ship_position + turn @ point, rtol=1e-12)


def test_the_ship_of_the_scene_needs_no_inputs(resources):
    tow = begun(resources, **{"ship.from_scene": True})
    tow.set("ship.position.x", float("nan"))
    tow.step(0.0, 2.0)  # longer than ship.max_gap, for there are no samples
    assert tow.output("body.velocity.x") == pytest.approx(2.06, abs=1e-3)


def test_numbers_of_the_scene_are_those_of_an_override(resources):
    still = Simulator(override(load_scene("side_scan"), SCENE | {"water.density": 1000.0}))
    still.start(0, (0.0, 0.0), 0.0)
    by_text = begun(resources, settings="water.density=1000")
    by_parameter = begun(resources, **{"water.density": 1000.0})
    plain = begun(resources)
    assert by_text.output("cable.tension") == by_parameter.output("cable.tension") == still.frame.tension
    assert plain.output("cable.tension") != still.frame.tension


@pytest.mark.parametrize(
    "values, text",
    [
        ({"settings": "water.densty=1"}, "water.densty"),
        ({"settings": "winch.scope=1e9"}, "winch.scope"),
        ({"settings": "heave.imu_position=[1,0,2]"}, "that of the inputs ship.*"),
        ({"ship.velocity.x": float("nan")}, "ShipMotion.velocity[0] = nan m/s is not a number"),
        ({"ship.attitude.pitch": 9.0}, "ShipMotion.attitude[1] = 9 rad is outside"),
    ],
)
def test_a_start_that_fails_says_why(resources, values, text):
    with pytest.raises(CableSimError) as found:
        begun(resources, **values)
    assert text in str(found.value)


@pytest.mark.parametrize(
    "t, h, text",
    [
        (0.0, 0.03, "communication step of 0.03 s at 0 s: is no multiple of the tick; nothing was simulated."),
        (0.0, 0.0, "is no multiple of the tick"),
        (0.0, -0.1, "is no multiple of the tick"),
        (0.0, float("nan"), "is no multiple of the tick"),
        (0.0, 1e300, "is no multiple of the tick"),
        (0.0, 3.0, "is longer than ship.max_gap, above which samples are not interpolated; nothing was simulated."),
        (0.5, 0.1, "communication point 0.5 s is not the end of the last step, 0 s; nothing was simulated."),
        (float("nan"), 0.1, "communication point nan s is not the end"),
    ],
)
def test_a_step_that_does_not_fit_is_refused_and_nothing_moves(resources, t, h, text):
    tow = begun(resources)
    before = tow.sim.snapshot()
    give(tow, 0.1)
    with pytest.raises(FmuError) as found:
        tow.step(t, h)
    assert text in str(found.value)
    assert all(np.array_equal(a, before[name], equal_nan=a.dtype.kind == "f") for name, a in tow.sim.snapshot().items())
    tow.step(0.0, 0.1)  # and it goes on


def test_a_step_before_the_end_of_the_initialization_is_refused(resources):
    tow = Tow(resources)
    give(tow, 0.0)
    for _ in range(2):
        with pytest.raises(FmuError, match="step of 0.1 s at 0 s before the end of the initialization; noth"):
            tow.step(0.0, 0.1)
        assert tow.output("cable.tension") > 0.0, "outputs may be asked for by then"
    tow.start()
    tow.step(0.0, 0.1)
    assert tow.seconds() == pytest.approx(0.1)


def test_a_command_that_is_none_is_refused_and_nothing_moves(resources):
    tow = begun(resources)
    give(tow, 0.1)
    tow.set("winch.mode", 3)
    with pytest.raises(FmuError, match="winch.mode = 3: is none of 0"):
        tow.step(0.0, 0.1)
    tow.values.update({"winch.mode": 1, "winch.rate": float("inf")})
    with pytest.raises(CableSimError, match="WinchCommand.rate"):
        tow.step(0.0, 0.1)
    tow.set("winch.rate", 0.1)
    long = begun(resources, **{"winch.mode": 1, "settings": "winch.command_timeout=0.1"})
    give(long, 0.2)
    with pytest.raises(FmuError, match="is longer than winch.command_timeout = 0.1 s"):
        long.step(0.0, 0.2)
    tow.step(0.0, 0.1)
    assert tow.output("winch.payout_rate") > 0.0


def test_motion_that_contradicts_itself_is_told_once(resources):
    tow = begun(resources)
    for k in range(2):
        give(tow, (k + 1) * STEP)
        tow.set("ship.position.x", 0.0)  # stands, at 2.06 m/s
        tow.step(k * STEP, STEP)
    (text,) = tow.said
    assert "ship motion at 0.1 s: x and its rate contradict each other by 2.06 m/s" in text
    assert tow.output("health.motion_misfit") == pytest.approx(2.06 / 0.2)


def test_a_start_at_another_speed_is_told(resources):
    (text,) = begun(resources, **{"ship.velocity.x": 3.06}).said
    assert "ship.velocity at the start is 1 m/s off ship.tow_speed = 2.06 m/s" in text


def test_the_clock_may_begin_late_and_not_before_zero(resources):
    tow = begun(resources, 1000.0)
    give(tow, 1000.1)
    tow.step(1000.0, 0.1)
    assert tow.sim.frame.time == 1_000_100_000_000
    with pytest.raises(FmuError, match="start time of -1 s is outside"):
        tow.begin_at(-1.0)


def test_a_state_goes_on_bit_for_bit_also_through_bytes(resources):
    tow = begun(resources)
    give(tow, 0.1)
    tow.step(0.0, 0.1)
    state = tow.state()
    data = Tow.to_bytes(state)

    def on(one):
        give(one, 0.2)
        one.step(0.1, 0.1)
        return one.output("cable.tension"), one.output("body.position.z")

    first = on(tow)
    tow.restore(state)
    assert on(tow) == first
    other = Tow(resources)
    other.restore(Tow.from_bytes(data))
    assert on(other) == first


@pytest.mark.parametrize("data", [b"", b"{}", b"[1]\nabc", b'{"own": {}, "last": null}\n', b"\xff" * 40])
def test_bytes_of_elsewhere_are_refused(resources, data):
    with pytest.raises(FmuError, match="serialized state: is none of this FMU"):
        Tow.from_bytes(data)


def test_a_damaged_state_is_refused_when_it_is_restored(resources):
    tow = begun(resources)
    data = bytearray(Tow.to_bytes(tow.state()))
    data[len(data) // 2] ^= 16
    with pytest.raises(CableSimError):
        tow.restore(Tow.from_bytes(bytes(data)))


def test_a_simulation_that_ended_stays_ended(resources, monkeypatch):
    from cable_sim_ros.sim.simulator import SolverError

    tow = begun(resources)
    give(tow, 0.1)

    def halted(count):
        raise SolverError("the tick could not be solved")

    monkeypatch.setattr(tow.sim, "run", halted)
    with pytest.raises(SolverError):
        tow.step(0.0, 0.1)
    assert tow.output("health.verdict") == 2
    with pytest.raises(FmuError, match="the simulation had ended: the tick could not be solved"):
        tow.step(0.0, 0.1)


def test_another_version_is_told(resources):
    about = json.loads((resources / module.ABOUT_FILE).read_text()) | {"version": "0.0.1"}
    (resources / module.ABOUT_FILE).write_text(json.dumps(about))
    assert f"made by cable_sim_ros 0.0.1, run by {module.__version__}: figures may differ" in Tow(resources).said


def test_every_variable_has_a_value_and_its_unit_is_declared(resources):
    tow = begun(resources)
    for row in rows(tow.about):
        value = tow.output(row.name) if row.role == "output" else tow.values[row.name]
        assert isinstance(value, {"Real": float, "Integer": int, "Boolean": bool, "String": str}[row.kind]), row.name
        assert not row.unit or row.unit in UNITS
    assert {row.name for row in OUTPUTS} == set(tow._out)
    assert {row.name for row in (*INPUTS, *PARAMETERS)} | {"water.density"} == set(tow.values)


@pytest.mark.parametrize(
    "words, text",
    [
        (("side_scan", "--out", "a.zip"), "a.zip: is no name of an FMU; nothing was written."),
        (("side_scan", "--out", "there.fmu"), "there.fmu: is there already; nothing was written. Give --force"),
        (("side_scan", "--out", "folder.fmu"), "folder.fmu: is a folder; nothing was written."),
        (("no_such_scene", "--out", "a.fmu"), "no_such_scene: no such scene file"),
        (("side_scan", "--out", "a.fmu", "--set", "winch.scop=1"), "winch.scop"),
        (("side_scan", "--out", "a.fmu", "--set", "motion.convention=ned"), "that of the inputs ship.*"),
        (("side_scan", "--out", "a.fmu", "--parameter", "name"), "--parameter name: is no number of the scene"),
        (("side_scan", "--out", "no/such/a.fmu"), "a.fmu: cannot be written (No such file or directory)"),
    ],
)
def test_a_mistake_of_the_command_is_told_in_one_line(tmp_path, monkeypatch, words, text):
    pytest.importorskip("pythonfmu")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.fmu").write_text("mine")
    (tmp_path / "folder.fmu").mkdir()
    had = sorted(tmp_path.rglob("*"))
    done = cable_sim("fmu", *words)
    assert done.exit_code == 2 and text in done.stderr and "Traceback" not in done.stderr
    assert sorted(tmp_path.rglob("*")) == had and (tmp_path / "there.fmu").read_text() == "mine"


@pytest.mark.parametrize("fmi, module", [("2", "pythonfmu"), ("3", "pythonfmu3")])
def test_a_missing_extra_is_one_line(tmp_path, monkeypatch, fmi, module):
    monkeypatch.setitem(sys.modules, module, None)
    done = cable_sim("fmu", "side_scan", "--fmi", fmi, "--out", tmp_path / "a.fmu")
    assert done.exit_code == 2 and f"--fmi {fmi} needs {module}, which cannot be imported" in done.stderr
    assert "pip install 'cable_sim_ros[fmu]'" in done.stderr and not list(tmp_path.iterdir())


def test_a_vehicle_is_moved_by_the_master_and_feels_its_cable(tmp_path):
    tow = Tow(packed(tmp_path, "rov_tether", parameters={}, vehicle=True))
    sim = Simulator(override(load_scene("rov_tether"), SCENE))
    assert {row.name for row in rows(tow.about)} == {
        row.name for row in (*INPUTS, *OUTPUTS, *PARAMETERS, *VEHICLE_INPUTS, *VEHICLE_OUTPUTS)
    }
    tow.values["ship.from_scene"] = True
    place = [tow.values[f"vehicle.position.{axis}"] for axis in "xyz"]
    assert place == [-50.0, 0.0, -32.0]

    def there(t):
        w = 2.0 * np.pi / 10.0
        y, v = 0.5 * (1.0 - np.cos(w * t)), 0.5 * w * np.sin(w * t)
        return {"vehicle.position.y": y, "vehicle.velocity.y": v}

    def sample(t):
        values = there(t)
        return VehicleMotion(
            time_ns=round(t * 1e9),
            position=(-50.0, values["vehicle.position.y"], -32.0),
            velocity=(0.0, values["vehicle.velocity.y"], 0.0),
            attitude=(0.0, 0.0, 0.0),
            rate=(0.0, 0.0, 0.0),
        )

    tow.begin_at(0.0)
    tow.start()
    sim.push(sample(0.0))
    sim.start()
    for k in range(60):
        t = (k + 1) * STEP
        tow.values.update(there(t))
        tow.step(k * STEP, STEP)
        sim.push(sample(t))
        frame = sim.run(5)[-1]
        for name, values in (("force", frame.vehicle_force), ("moment", frame.vehicle_moment)):
            assert [tow.output(f"vehicle.{name}.{axis}") for axis in "xyz"] == values.tolist()
    assert abs(tow.output("vehicle.force.y")) > 0.1 and tow.output("vehicle.off") == 0.0
    with pytest.raises(FmuError, match="is longer than vehicle.max_gap"):
        tow.step(60 * STEP, 3.0)
