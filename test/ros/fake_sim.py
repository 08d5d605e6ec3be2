"""A stand-in for the simulator: the contract's shape with a pendulum's worth of physics, compiled in a second.

`install()` puts it in the place of physics.system and sim.simulator, before the node is imported.
"""

from __future__ import annotations

import math
import os
import sys
import types
from typing import NamedTuple

import numpy as np
from numba import njit

from cable_sim_ros.physics.attitude import ATTITUDE
from cable_sim_ros.physics.heave_compensation import SetpointLaw
from cable_sim_ros.physics.inputs import Inputs, make_inputs
from cable_sim_ros.physics.sensor_models import SENSOR_RULES, SIGNAL, SensorModel, make_sensors
from cable_sim_ros.physics.state import MEMORY, TOW_SETTINGS, records
from cable_sim_ros.physics.tick_output import CONTACT_COLUMNS, SHAPE_COLUMNS, SLOPE_COLUMNS, TICK_OUTPUT

NODES, STATIONS = 20, 8
TEMPLATE = np.zeros(1, TICK_OUTPUT)
WORK = int(os.environ.get("FAKE_WORK", "0"))


def settings_of(winch) -> np.recarray:
    """What a session reads of a model's settings: the drum's limits. A travel of 100 m either way, datum zero."""
    found = records(1, TOW_SETTINGS)
    drum = found[0].drum
    drum.max_rate, drum.timeout, drum.min_reach, drum.max_reach = winch.max_rate, winch.command_timeout, -100, 100
    return found


NO_SENSORS = SensorModel(np.zeros(0, SIGNAL), np.zeros(0, SENSOR_RULES))


class Model(NamedTuple):
    period: int
    settings: np.ndarray  # TOW_SETTINGS [1]
    max_rate: float
    work: int  # steps of useless work a tick, for a model that is too big
    sensors: SensorModel  # none aboard


class State(NamedTuple):
    memory: np.ndarray  # MEMORY [1]
    value: np.ndarray  # payout, rate, x, y, z, halted


class Output(NamedTuple):
    frame: np.ndarray
    shape: np.ndarray
    contact: np.ndarray


@njit(nogil=True)
def tick(model, state, inputs, output, slot):
    value = state.value
    if value[5] > 0.0:
        return 1
    useless = 0.0
    for k in range(model.work):
        useless += math.sin(useless + k)
    if useless > 1e9:
        return 1
    now = state.memory[0]
    now.time.now += model.period
    now.time.ticks += 1
    time = now.time.now
    flags = 0
    frame = output.frame[slot]
    head = inputs.motion_seen[0]
    age = 1e3
    if head > 0:
        row = inputs.motion[(head - 1) % inputs.motion.shape[0]]
        value[2], value[3], value[4] = row[0], row[1], row[2]
        age = (time - inputs.motion_time[(head - 1) % inputs.motion.shape[0]]) * 1e-9
        frame.motion_source = int(row[13])
    if age > 0.5:
        flags |= 64
    head = inputs.command_seen[0]
    command_age = -1.0
    value[1] = 0.0
    if head > 0:
        payout, rate = inputs.command[(head - 1) % inputs.command.shape[0]]
        command_age = (time - inputs.command_time[(head - 1) % inputs.command.shape[0]]) * 1e-9
        if not math.isnan(rate):
            if command_age > model.settings[0].drum.timeout:
                flags |= 256
            else:
                value[1] = rate
        elif not math.isnan(payout):
            value[1] = max(-model.max_rate, min(model.max_rate, 5.0 * (payout - value[0])))
    value[0] += value[1] * model.period * 1e-9
    if head > 0 and payout < -900.0 and command_age < 0.2:  # the test's way to a solver that gives up
        value[5] = 1.0
        flags |= 1
    frame.time = time
    frame.tick = now.time.ticks
    frame.tension = 2000.0 + 100.0 * value[4]
    frame.payout = value[0]
    frame.payout_rate = value[1]
    frame.motion_age = age
    frame.command_age = command_age
    frame.contact_stations = STATIONS
    frame.iterations = 3
    frame.substeps = 1
    frame.residual = 1e-6
    frame.status = flags
    for k in range(3):
        frame.ship_position[k] = value[2 + k]
        frame.body_position[k] = value[2 + k]
    frame.body_position[2] -= 100.0
    frame.body_quaternion[3] = 1.0
    frame.ship_quaternion[3] = 1.0
    frame.tension_vector[0] = -frame.tension
    for k in range(output.shape.shape[1]):
        output.shape[slot, k, 2] = -5.0 * k
        output.shape[slot, k, 4] = 5.0 * k
    return flags


@njit(nogil=True)
def sense(model, state, frame):
    pass


@njit(nogil=True)
def observe(model, state, output, slot, flags, blending):
    return flags


@njit(nogil=True)
def rest(model, state, sigma, count, longest):
    return 0, 0, 0.0


@njit(nogil=True)
def lay(model, state):
    pass


def make_output(model: Model, nodes: int, rows: int) -> Output:
    return Output(
        np.zeros(rows, TICK_OUTPUT),
        np.zeros((rows, NODES, len(SHAPE_COLUMNS) + len(SLOPE_COLUMNS))),
        np.zeros((rows, STATIONS, len(CONTACT_COLUMNS))),
    )


class StartError(RuntimeError):
    def __init__(self, text: str, residual: float) -> None:
        super().__init__(text)
        self.residual = residual


class SolverError(RuntimeError):
    pass


class Simulator:
    def __init__(self, scene) -> None:
        self.scene = scene
        settings = settings_of(scene.winch)
        settings.setflags(write=False)
        self.model = Model(round(scene.solver.tick * 1e9), settings, scene.winch.max_rate, WORK, NO_SENSORS)
        self.state = State(records(1, MEMORY), np.zeros(6))
        self.nodes = NODES
        self.inputs: Inputs = make_inputs()
        self.output = make_output(self.model, NODES, 1)

    def warm_up(self, progress=None) -> None:
        if progress:
            progress("compiling the stand-in")

    def start(self, time_ns: int = 0, position=(0.0, 0.0), heading=None, keep_inputs=False) -> None:
        if os.environ.get("FAKE_START_FAILS"):
            raise StartError("no static equilibrium: residual 123 N", 123.0)
        time = self.state.memory[0].time
        time.now, time.start, time.ticks = time_ns, time_ns, 0
        self.state.value[:] = 0.0
        self.state.value[2:4] = position

    def snapshot(self) -> dict:
        rings = {f"inputs_{name}": array.copy() for name, array in self.inputs._asdict().items()}
        none = {f"sensors_{name}": array.copy() for name, array in make_sensors(0)._asdict().items()}
        none["attitude"] = np.zeros(0, ATTITUDE)
        return {"memory": self.state.memory[0].copy(), "nodes": self.state.value.copy(), **none, **rings}

    def taken(self, path, saved) -> dict:
        from cable_sim_ros.sim.saved import savefile

        return savefile.exact(saved.arrays, self.snapshot())

    def restore(self, saved: dict) -> None:
        self.state.memory[0], self.state.value[:] = saved["memory"], saved["nodes"]
        for name, array in self.inputs._asdict().items():
            array[...] = saved[f"inputs_{name}"]

    def set_algorithm(self, law: SetpointLaw) -> None:
        self.law = SetpointLaw(law)


def install() -> None:
    system = types.ModuleType("cable_sim_ros.physics.tick")
    system.tick, system.observe, system.sense, system.link_tick = tick, observe, sense, lambda *parts: None
    from cable_sim_ros.physics import tow

    tow.rest, tow.lay = rest, lay  # sim.loop itself is the real one
    build = types.ModuleType("cable_sim_ros.sim.build")
    build.make_output = make_output
    sys.modules["cable_sim_ros.sim.build"] = build
    simulator = types.ModuleType("cable_sim_ros.sim.simulator")
    simulator.Simulator, simulator.StartError, simulator.SolverError = Simulator, StartError, SolverError
    sys.modules["cable_sim_ros.physics.tick"] = system
    sys.modules["cable_sim_ros.sim.simulator"] = simulator


if __name__ == "__main__":  # python -m test.ros.fake_sim MODULE ARGS: run a module of the package on the stand-in
    import importlib

    sys.path.insert(0, os.getcwd())
    fake = importlib.import_module("fake_sim")
    fake.install()
    sys.exit(importlib.import_module(sys.argv[1]).main(sys.argv[1:]))
