"""MoorDyn v2 on P5 and P6, driven through its tow point.

A uniform stream is made by towing at its speed through still water, after SPIN_UP seconds of straight tow, not timed.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np

from ..ours import DEEP, Ours, ramped_heave
from ..scenes import reference
from .common import Setting, silent

SPIN_UP, GATHER = 1000.0, 20.0  # s of straight tow before the heave; of them getting up to speed
TOP = -50.0  # m, depth of the tow point
RULE = "-" * 20
POINTS = f"""{RULE} POINTS {RULE}
ID Attachment X Y Z Mass Volume CdA Ca
(#) (-) (m) (m) (m) (kg) (m^3) (m^2) (-)"""
OUTPUTS = f"""{RULE} OUTPUTS {RULE}
FairTen1
{RULE} need this line {RULE}
"""


def types(p: dict) -> str:
    """A deck from its first line to the cable among the types of line."""
    return f"""P5
{RULE} LINE TYPES {RULE}
TypeName Diam Mass/m EA BA/-zeta EI Cd Ca CdAx CaAx
(name) (m) (kg/m) (N) (N-s/-) (N-m^2) (-) (-) (-) (-)
cable {p["d"]} {p["mu"]} {p["EA"]} -0.05 0 {p["Cdn"]} 0.0 {p["Cdt"]} 0.0"""


def body_volume(p: dict) -> float:
    """Displaced volume [m^3] of the towbody."""
    return (p["M"] * p["g"] - p["Wnet"]) / p["rho"] / p["g"]


def _deck(setting: Setting) -> str:
    """P5: one line, body as a free point, tow point driven from outside."""
    p = reference("P5").params
    return f"""{types(p)}
{POINTS}
1 Free {0.92 * p["L"]} 0 {TOP - 0.36 * p["L"]} {p["M"]} {body_volume(p)} 0 0
2 Coupled 0 0 {TOP} 0 0 0 0
{RULE} LINES {RULE}
ID LineType AttachA AttachB UnstrLen NumSegs Outputs
(#) (name) (#) (#) (m) (-) (-)
1 cable 1 2 {p["L"]} {setting.elements} -
{RULE} OPTIONS {RULE}
{setting.inner} dtM
{p["g"]} g
{p["rho"]} rhoW
1000 WtrDpth
2 dtIC
0.5 TmaxIC
0.01 threshIC
0 writeLog
{OUTPUTS}"""


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


def moordyn_towed(setting: Setting) -> Ours:
    """P5 and P6 in MoorDyn: lumped masses, explicit, axial damping 0.05 of critical; spun up, then P5 from t = 0."""
    import moordyn

    p = reference("P5").params
    with silent(), tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "p5.txt"
        file.write_text(_deck(setting))
        system = moordyn.Create(str(file))
        moordyn.Init(system, [0.0, 0.0, TOP], [0.0, 0.0, 0.0])
        line, body = moordyn.GetLine(system, 1), moordyn.GetPoint(system, 1)

        def step(row, t):
            moordyn.Step(system, list(row[:3]), list(row[3:6]), t, setting.dt)

        def look(t, along):
            x = np.array(moordyn.GetPointPos(body)) - (along, 0.0, TOP)
            return t, abs(x[0]), x[2], moordyn.GetLineFairTen(line)

        try:
            for i, row in enumerate(_tow_path(setting.dt, 0.0, SPIN_UP, False)):
                step(row, i * setting.dt)
            path, every = _tow_path(setting.dt, SPIN_UP, p["T"], True), max(int(round(p["dt_out"] / setting.dt)), 1)
            report = [look(0.0, path[0, 0])]
            begin = time.process_time()
            for i, row in enumerate(path):
                step(row, SPIN_UP + i * setting.dt)
                if (i + 1) % every == 0:
                    report.append(look((i + 1) * setting.dt, row[0]))
            cpu = time.process_time() - begin
        finally:
            moordyn.Close(system)
    return Ours(str(setting), setting.elements, setting.inner, np.array(report), cpu, p["T"], 0, len(path))
