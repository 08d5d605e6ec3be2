"""Other codes on the benchmark scenes, as jobs for bench.py. The lumped chain is always run, the others on request.

Each is used as its manual shows, one thread, with the settings told; a scene it cannot honestly do is told as such.
A uniform stream is made by towing at its speed through still water, after SPIN_UP seconds of straight tow, not timed.
"""

from __future__ import annotations

import os
import tempfile
import time
from collections.abc import Callable
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from . import chain
from .ours import DEEP, Ours, ramped_heave
from .scenes import reference

INSTALL = "not installed: pip install 'cable_sim_ros[peers]'"
SPIN_UP, GATHER = 1000.0, 20.0    # s of straight tow before the heave; of them getting up to speed
TOP = -50.0                        # m, depth of the tow point
# why a code has no row on a scene
CANNOT = {
    ("moordyn", "P2"): "starts from its own hanging equilibrium, not from a straight level line",
    ("moordyn", "P4"): "no sheave", ("cabledyn", "P2"): "starts from its own hanging equilibrium",
    ("cabledyn", "P4"): "no sheave", ("mujoco", "P4"): "rigid links over a sheave: not built",
    ("mujoco", "P5"): "no drag of a cable in a stream; a callback for it is not built",
    ("mujoco", "P6"): "no drag of a cable in a stream; a callback for it is not built",
    ("exudyn", "P4"): "its sliding contact circle is not built here",
    ("exudyn", "P5"): "its drag needs a user function with Jacobian: not built",
    ("exudyn", "P6"): "its drag needs a user function with Jacobian: not built",
    ("lumped chain", "P4"): "no contact in the plain chain",
}


class Setting(NamedTuple):
    """Elements, step [s] of the caller and, where the code has its own, its internal step [s]."""

    elements: int
    dt: float
    inner: float = 0.0
    note: str = ""

    def __str__(self) -> str:
        inner = f", inner step {1e3 * self.inner:g} ms" if self.inner else ""
        return f"{self.elements}, {1e3 * self.dt:g} ms{inner}{', ' + self.note if self.note else ''}"


def installed(code: str) -> str | None:
    """Version of a peer, None where it is not installed."""
    try:
        return version(code)
    except PackageNotFoundError:
        return None


@contextmanager
def _silent():
    """Nothing of what a library prints from C reaches the terminal."""
    kept, null = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(null)


def deck(setting: Setting, more: str) -> str:
    """Input of MoorDyn v2 and CableDyn for P5: one line, body as a free point, tow point driven from outside."""
    p = reference("P5").params
    volume = (p["M"] * p["g"] - p["Wnet"]) / p["rho"] / p["g"]
    rule = "-" * 20
    return f"""P5
{rule} LINE TYPES {rule}
TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx
(name) (m) (kg/m) (N) (N-s/-) (N-m^2) (-) (-) (-) (-)
cable {p["d"]} {p["mu"]} {p["EA"]} -0.5 0 {p["Cdn"]} 0.0 {p["Cdt"]} 0.0
{rule} POINTS {rule}
ID Attachment X Y Z Mass Volume CdA Ca
(#) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)
1 Free {0.92 * p["L"]} 0 {TOP - 0.36 * p["L"]} {p["M"]} {volume} 0 0
2 Coupled 0 0 {TOP} 0 0 0 0
{rule} LINES {rule}
ID LineType AttachA AttachB UnstrLen NumSegs Outputs
(#) (name) (#) (#) (m) (-) (-)
1 cable 1 2 {p["L"]} {setting.elements} -
{rule} OPTIONS {rule}
{setting.inner or setting.dt} dtM
{p["g"]} g
{p["rho"]} rhoW
1000 WtrDpth
{more}
{rule} OUTPUTS {rule}
FairTen1
{rule} need this line {rule}
"""


def _tow_path(dt: float, start: float, duration: float, heave: bool) -> np.ndarray:
    """Position, velocity, acceleration [steps, 9] of the tow point: up to speed over GATHER, then straight ahead."""
    p = reference("P5").params
    t = start + dt * np.arange(1, int(round(duration / dt)) + 1)
    path = np.zeros((len(t), 9))
    early = t < GATHER
    path[:, 0] = -p["U"] * np.where(early, 0.5 * t**2 / GATHER, t - 0.5 * GATHER)
    path[:, 3] = -p["U"] * np.where(early, t / GATHER, 1.0)
    path[:, 6] = np.where(early, -p["U"] / GATHER, 0.0)
    path[:, 2] = TOP
    if heave:
        wave = ramped_heave(p, t - start)[:, 0]
        path[:, 2] += wave[:, 2] - DEEP
        path[:, [5, 8]] = wave[:, [5, 8]]
    return path


def _towed(setting: Setting, step: Callable, look: Callable) -> Ours:
    """Spin up, then P5 from t = 0. step(row of the path, time); look(top) -> x, z of the body, tension."""
    p = reference("P5").params
    for i, row in enumerate(_tow_path(setting.dt, 0.0, SPIN_UP, False)):
        step(row, i * setting.dt)
    path, every = _tow_path(setting.dt, SPIN_UP, p["T"], True), max(int(round(p["dt_out"] / setting.dt)), 1)
    told = [(0.0, *look(np.array((path[0, 0], 0.0, TOP))))]
    begin = time.process_time()
    for i, row in enumerate(path):
        step(row, SPIN_UP + i * setting.dt)
        if (i + 1) % every == 0:
            told.append(((i + 1) * setting.dt, *look(np.array((row[0], 0.0, TOP)))))
    cpu = time.process_time() - begin
    return Ours(str(setting), setting.elements, setting.inner or setting.dt, np.array(told), cpu, p["T"], 0, len(path))


def moordyn_towed(setting: Setting) -> Ours:
    """P5 and P6 in MoorDyn: lumped masses, explicit, axial damping 0.5 of critical."""
    import moordyn
    with _silent(), tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "p5.txt"
        path.write_text(deck(setting, "2 dtIC\n0.5 TmaxIC\n0.01 threshIC\n0 writeLog"))
        system = moordyn.Create(str(path))
        moordyn.Init(system, [0.0, 0.0, TOP], [0.0, 0.0, 0.0])
        line, body = moordyn.GetLine(system, 1), moordyn.GetPoint(system, 1)

        def step(row, t):
            moordyn.Step(system, list(row[:3]), list(row[3:6]), t, setting.dt)

        def look(top):
            x = np.array(moordyn.GetPointPos(body)) - top
            return abs(x[0]), x[2], moordyn.GetLineFairTen(line)
        try:
            return _towed(setting, step, look)
        finally:
            moordyn.Close(system)


def cabledyn_towed(setting: Setting) -> Ours:
    """P5 and P6 in CableDyn: finite elements, generalised-alpha, the body as a point mass."""
    from cabledyn import CableDyn
    with _silent(), tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "p5.dat"
        path.write_text(deck(setting, f"{SPIN_UP + 200.0} TMax"))
        system = CableDyn(str(path))
        host = system.host_dofs()
        q, v, a = (x.copy() for x in system.get_coupled_motion())
        line, body = system.lines[0], system.points[0]

        def step(row, t):
            q[host], v[host], a[host] = row[:3], row[3:6], row[6:]
            system.step(setting.dt, q, v, a)

        def look(top):
            x = np.array(body.position()) - top
            return abs(x[0]), x[2], max(line.fairlead_tension(), line.anchor_tension())
        try:
            return _towed(setting, step, look)
        finally:
            system.close()


def mujoco_released(setting: Setting) -> Ours:
    """P2 in MuJoCo: rigid links, hinges with the bending stiffness, implicit integrator; no stretch."""
    import mujoco
    p, n = reference("P2").params, setting.elements
    link, mass = p["L"] / n, p["mu"] * p["L"] / n
    inertia = mass * link**2 / 12.0
    inner, outer = "", ""
    for i in range(n):
        spring = p["EI"] / link if i else 0.0
        inner += (f'<body pos="{link if i else 0.0} 0 0"><joint type="hinge" axis="0 1 0" stiffness="{spring}"/>'
                  f'<inertial pos="{0.5 * link} 0 0" mass="{mass}" diaginertia="1e-9 {inertia} {inertia}"/>')
        outer += "</body>"
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="{setting.dt}" gravity="0 0 {-p["g"]}" integrator="implicitfast"/>'
        f'<compiler balanceinertia="true"/><worldbody>{inner}<site name="tip" pos="{link} 0 0"/>{outer}</worldbody>'
        "</mujoco>")
    data = mujoco.MjData(model)
    every = max(int(round(p["dt_out"] / setting.dt)), 1)
    count = int(round(p["T"] / setting.dt))
    told = np.zeros((count // every + 1, 4))
    momentum = np.zeros((count // every + 1, 2))
    mujoco.mj_forward(model, data)
    masses = model.body_mass[1:, None]
    begin = time.process_time()
    for s in range(count // every + 1):
        if s:
            mujoco.mj_step(model, data, every)
        told[s, 0], told[s, 1], told[s, 2] = s * p["dt_out"], data.site_xpos[0, 0], data.site_xpos[0, 2]
        mujoco.mj_subtreeVel(model, data)
        momentum[s] = data.subtree_linvel[1, [0, 2]] * masses.sum()
    cpu = time.process_time() - begin
    # reaction of the pin: rate of momentum less weight
    rate = np.gradient(momentum, told[:, 0], axis=0) + (0.0, masses.sum() * p["g"])
    told[:, 3] = np.hypot(rate[:, 0], rate[:, 1])
    return Ours(str(setting), n, setting.dt, told, cpu, p["T"], 0, count)


def exudyn_released(setting: Setting) -> Ours:
    """P2 in Exudyn: ANCFCable2D, generalised-alpha with spectral radius 0.5, modified Newton."""
    import exudyn as exu
    from exudyn.beams import GenerateStraightLineANCFCable2D
    from exudyn.itemInterface import Cable2D
    p, n = reference("P2").params, setting.elements
    with _silent():
        container = exu.SystemContainer()
        system = container.AddSystem()
        cable = Cable2D(physicsMassPerLength=p["mu"], physicsBendingStiffness=p["EI"], physicsAxialStiffness=p["EA"])
        told = GenerateStraightLineANCFCable2D(
            system, positionOfNode0=[0, 0, 0], positionOfNode1=[p["L"], 0, 0], numberOfElements=n,
            cableTemplate=cable, massProportionalLoad=[0, -p["g"], 0], fixedConstraintsNode0=[1, 1, 0, 0],
            fixedConstraintsNode1=[0, 0, 0, 0])
        pins, last = told[4][:2], told[0][-1]
        tip = system.AddSensor(exu.itemInterface.SensorNode(
            nodeNumber=last, storeInternal=True, outputVariableType=exu.OutputVariableType.Position))
        pulls = [system.AddSensor(exu.itemInterface.SensorObject(
            objectNumber=c, storeInternal=True, outputVariableType=exu.OutputVariableType.Force)) for c in pins]
        system.Assemble()
        settings = exu.SimulationSettings()
        settings.timeIntegration.numberOfSteps = int(round(p["T"] / setting.dt))
        settings.timeIntegration.endTime = p["T"]
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.5
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = p["dt_out"]
        settings.timeIntegration.verboseMode = 0
        settings.parallel.numberOfThreads = 1
        begin = time.process_time()
        system.SolveDynamic(settings)
        cpu = time.process_time() - begin
        where = system.GetSensorStoredData(tip)
        force = [system.GetSensorStoredData(s) for s in pulls]
    history = np.column_stack((where[:, 0], where[:, 1], where[:, 2], np.hypot(force[0][:, 1], force[1][:, 1])))
    return Ours(str(setting), n, setting.dt, history, cpu, p["T"], 0, int(round(p["T"] / setting.dt)))


RUNS: dict[tuple[str, str], tuple[Callable, tuple[Setting, ...]]] = {
    ("exudyn", "P2"): (exudyn_released, (Setting(10, 0.005), Setting(20, 0.005), Setting(20, 0.0025))),
    ("mujoco", "P2"): (mujoco_released, (Setting(20, 0.001), Setting(40, 0.0005))),
    ("moordyn", "P5"): (moordyn_towed, (Setting(20, 0.02, 0.002), Setting(40, 0.02, 0.001))),
    ("moordyn", "P6"): (moordyn_towed, (Setting(69, 0.02, 0.0005),)),
    ("cabledyn", "P5"): (cabledyn_towed, (Setting(20, 0.1), Setting(20, 0.02))),
    ("cabledyn", "P6"): (cabledyn_towed, (Setting(69, 0.1),)),
}
CODES = ("moordyn", "mujoco", "exudyn", "cabledyn")


def jobs_of(scene: str, all_codes: bool) -> tuple[list[tuple[str, Any, Callable]], list[tuple[str, str]]]:
    """(code, setting, run) of what can be run on a scene, and (code, why not) of what cannot."""
    jobs: list[tuple[str, Any, Callable]] = []
    missing: list[tuple[str, str]] = []
    if scene in chain.CASES:
        run, settings = chain.CASES[scene]
        jobs += [("lumped chain", s, run) for s in settings]
    else:
        missing.append(("lumped chain", CANNOT["lumped chain", scene]))
    for code in CODES if all_codes else ():
        if (code, scene) not in RUNS:
            missing.append((code, CANNOT[code, scene]))
        elif installed(code) is None:
            missing.append((code, INSTALL))
        else:
            run, settings = RUNS[code, scene]
            jobs += [(f"{code} {installed(code)}", s, run) for s in settings]
    return jobs, missing
