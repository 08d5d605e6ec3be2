"""The FMU itself, FMI 2 and 3, flown by fmpy: valid, and bit for bit the run in Python."""

import sys

import numpy as np
import pytest
from calling import cable_sim
from heaving_ship import NAMES, numbers, pushed

from cable_sim_ros import Simulator, WinchCommand
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.tools.fmu.variables import INPUTS, OUTPUTS, PARAMETERS

fmpy = pytest.importorskip("fmpy")
pytest.importorskip("pythonfmu")
pytest.importorskip("pythonfmu3")
pytestmark = pytest.mark.skipif(
    not (sys.platform == "linux" and sys.maxsize > 2**32), reason="binaries of the exporters: Linux x86-64"
)
STEP = 0.1


class Instance:
    """One instance of an FMU, in the same words for both versions."""

    def __init__(self, file, fmi, folder, name="one"):
        from fmpy.fmi2 import FMU2Slave
        from fmpy.fmi3 import FMU3Slave

        self.description, self.fmi = fmpy.read_model_description(file), fmi
        self.places = {v.name: v.valueReference for v in self.description.modelVariables}
        self.folder = fmpy.extract(file, str(folder / f"{name}{fmi}"))
        model = self.description.coSimulation.modelIdentifier
        kind = FMU2Slave if fmi == 2 else FMU3Slave
        self.fmu = kind(
            guid=self.description.guid, unzipDirectory=self.folder, modelIdentifier=model, instanceName=name
        )
        self.fmu.instantiate(loggingOn=True)

    def begin(self, t=0.0, **parameters):
        """From instantiation into the step mode, the ship at its first sample."""
        if self.fmi == 2:
            self.fmu.setupExperiment(startTime=t)
        for name, value in parameters.items():
            self.fmu.setString([self.places[name]], [value])
        self.fmu.enterInitializationMode(**({} if self.fmi == 2 else {"startTime": t}))
        self.ship(t)
        self.fmu.exitInitializationMode()

    def ship(self, t):
        self.real(dict(zip(NAMES, numbers(t))))

    def real(self, values):
        give = self.fmu.setReal if self.fmi == 2 else self.fmu.setFloat64
        give([self.places[name] for name in values], [float(value) for value in values.values()])

    def integer(self, name, value):
        (self.fmu.setInteger if self.fmi == 2 else self.fmu.setInt32)([self.places[name]], [value])

    def get(self, *names):
        return (self.fmu.getReal if self.fmi == 2 else self.fmu.getFloat64)([self.places[name] for name in names])

    def fly(self, k, winch=0.1):
        """The step number k."""
        self.ship((k + 1) * STEP)
        self.real({"winch.rate": winch})
        self.fmu.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)

    def end(self):
        self.fmu.terminate()
        self.fmu.freeInstance()


@pytest.fixture(scope="module", params=[2, 3])
def built(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(f"fmu{request.param}")
    words = "fmu", "side_scan", "--out", folder / "tow.fmu", "--fmi", request.param
    done = cable_sim(*words, "--set", "solver.tick=0.02", "--parameter", "water.density", code=0)
    assert f"FMI {request.param}, model side_scan, tick 0.02 s, {len(INPUTS)} inputs" in done.stdout
    return str(folder / "tow.fmu"), request.param, folder


@pytest.fixture(scope="module")
def expected():
    """Tension, place of the towbody and pay-out after each step, in Python."""
    sim = Simulator(override(load_scene("side_scan"), {"solver.tick": 0.02}))
    sim.start(0, (0.0, 0.0), 0.0)
    found = []
    for k in range(31):
        sim.push(pushed(k * STEP))
        if k:
            sim.push(WinchCommand(rate=0.1))
            sim.run(5)
        found.append([sim.frame.tension, *sim.frame.body_position, sim.frame.payout])
    return found


OUT = ("cable.tension", "body.position.x", "body.position.y", "body.position.z", "winch.payout")


def test_the_description_is_valid_and_says_units_and_roles(built):
    file, fmi, _ = built
    from fmpy.validation import validate_fmu

    assert validate_fmu(file) == []
    described = fmpy.read_model_description(file)
    by_name = {v.name: v for v in described.modelVariables}
    for row in (*INPUTS, *OUTPUTS, *PARAMETERS):
        assert by_name[row.name].causality == row.role and by_name[row.name].description == row.meaning
        assert (by_name[row.name].unit or "") == row.unit
    density = by_name["water.density"]
    assert (
        density.causality == "parameter"
        and float(density.start) == load_scene("side_scan").water.density
        and float(density.max) > 1000.0
    )
    simulation = described.coSimulation
    assert (
        simulation.canGetAndSetFMUstate
        and simulation.canSerializeFMUstate
        and simulation.needsExecutionTool
        and float(described.defaultExperiment.stepSize) == 0.02
    )
    units = {unit.name: unit.baseUnit for unit in described.unitDefinitions}
    assert (units["N"].kg, units["N"].m, units["N"].s) == (1, 1, -2)


def test_it_is_bit_for_bit_the_run_in_python(built, expected):
    file, fmi, folder = built
    one, two = Instance(file, fmi, folder, "one"), Instance(file, fmi, folder, "two")
    for instance in (one, two):  # two at once, the second one later
        instance.begin()
        instance.integer("winch.mode", 1)
    assert one.get(*OUT) == expected[0]
    for k in range(30):
        one.fly(k)
        assert one.get(*OUT) == expected[k + 1], k
        if k % 2:
            two.fly(k // 2)
            assert two.get(*OUT) == expected[k // 2 + 1]
    two.end()
    state = one.fmu.getFMUstate() if fmi == 2 else one.fmu.getFMUState()
    data = one.fmu.serializeFMUstate(state) if fmi == 2 else one.fmu.serializeFMUState(state)

    def on():
        one.fly(30)
        return one.get(*OUT)

    first = on()
    again = one.fmu.deSerializeFMUstate(data) if fmi == 2 else one.fmu.deserializeFMUState(data)
    for saved in (state, again):
        one.fmu.setFMUstate(saved) if fmi == 2 else one.fmu.setFMUState(saved)
        assert on() == first
    one.fmu.reset()
    one.begin()
    one.integer("winch.mode", 1)
    one.fly(0)
    assert one.get(*OUT) == expected[1]
    one.end()


def test_a_step_that_does_not_fit_is_discarded(built):
    file, fmi, folder = built
    one = Instance(file, fmi, folder, "refused")
    one.begin()
    with pytest.raises(Exception, match=r"status 2 \(discard\)"):
        one.fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=0.03)
    one.fly(0)
    one.end()


def test_a_start_that_fails_says_why_in_the_log_and_leaves_others_alone(built, capfd):
    file, fmi, folder = built
    other = Instance(file, fmi, folder, "other")
    other.begin()
    with pytest.raises(Exception, match=r"ExitInitializationMode failed with status 4 \(fatal\)"):
        Instance(file, fmi, folder, "failed").begin(settings="winch.scope=1e6")
    said = capfd.readouterr().out
    assert "winch.scope" in said and "Give a value in [0, 20000] m" in said
    other.fly(0)
    other.end()


def test_fmpy_simulates_it_one_step_late(built):
    """A master that sets what holds at the beginning of a step delays the ship by that step."""
    file, _, _ = built
    times = np.arange(0.0, 1.01, STEP)
    kinds = [("time", np.float64), *((name, np.float64) for name in NAMES)]
    signals = np.array([(t, *numbers(t)) for t in times], dtype=kinds)
    result = fmpy.simulate_fmu(
        file, stop_time=1.0, step_size=STEP, output_interval=STEP, input=signals, output=["force.point_world.x"]
    )
    moved = result["force.point_world.x"][-1] - result["force.point_world.x"][0]
    assert len(result) == 11 and 1.5 < moved < 2.06 * 1.0


def test_a_ship_that_feels_the_cable_settles_where_its_spring_carries_the_pull(built):
    """Master of two models: a ship on a spring in heave and surge steps first, then the tow; force back and forth."""
    file, fmi, folder = built
    one = Instance(file, fmi, folder, "coupled")
    one.begin()
    mass, stiffness, pull = 2e4, 2e4, ("force.world.x", "force.world.z")  # kg, N/m
    damping = 2.0 * (mass * stiffness) ** 0.5  # N s/m, critical
    first = np.array(one.get(*pull))
    place, speed = np.zeros(2), np.zeros(2)  # off the mean track, forward and up
    for k in range(300):
        force = np.array(one.get(*pull))
        speed += STEP / mass * (force - stiffness * place - damping * speed)  # semi-implicit Euler
        place += STEP * speed
        t = (k + 1) * STEP
        one.real(dict(zip(NAMES, (2.06 * t + place[0], 0, place[1], 2.06 + speed[0], 0, speed[1], *[0.0] * 6))))
        one.fmu.doStep(currentCommunicationPoint=k * STEP, communicationStepSize=STEP)
    settled = np.array(one.get(*pull))
    assert place == pytest.approx(settled / stiffness, rel=0.01) and (np.abs(place) > 5e-3).all()
    assert settled == pytest.approx(first, rel=0.05) and one.get("health.motion_misfit")[0] < 1.0
    one.end()
