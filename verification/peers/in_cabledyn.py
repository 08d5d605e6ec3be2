"""CableDyn on P5 and P6: tension-only elements, generalised-alpha, the stream as its uniform current.

A free point is coupled to its line with a lag, and wrong at long steps (towbody as a point mass: 96 % in tension at
100 ms, 11 % at 20 ms). The towbody therefore is a short heavy section of the line, solved with the cable; as only a
line between two held ends is solved so, a weightless soft tail leads on to a fixed point (its pull: TAIL_PULL).
"""

from __future__ import annotations

import tempfile
import time
from math import pi, sqrt
from pathlib import Path

import numpy as np

from ..ours import DEEP, Ours, ramped_heave
from ..scenes import reference
from .common import Setting, silent
from .in_moordyn import OUTPUTS, POINTS, RULE, TOP, body_volume, types

BODY = 0.5  # m, length of the section that is the towbody
TAIL, TAIL_STRAIN, TAIL_PULL = 100.0, 0.05, 0.1  # m; its strain and pull [N] when the towbody hangs still
SETTLE = 100.0  # s before the heave, from its own statics
TOLERANCE = 1e-4  # of Newton


def _deck(setting: Setting) -> str:
    p = reference("P5").params
    across = sqrt(4.0 * body_volume(p) / BODY / pi)
    x, z = reference("P5").history[0, 1:3]
    cable = "\n".join(f"1 cable {fraction * p['L']} {n}" for fraction, n in setting.mesh)
    return f"""{types(p)}
body {across} {p["M"] / BODY} {10.0 * p["EA"]} -0.05 0 1e-9 0.0 1e-9 0.0
tail 1e-4 1e-4 {TAIL_PULL / TAIL_STRAIN} 0 0 1e-9 0.0 1e-9 0.0
{POINTS}
1 Coupled 0 0 {TOP} 0 0 0 0
2 Fixed {x} 0 {TOP + z - BODY - (1.0 + TAIL_STRAIN) * TAIL} 0 0 0 0
{RULE} LINES {RULE}
ID AttachA AttachB Outputs
(#) (#) (#) (-)
1 1 2 -
{RULE} SECTIONS {RULE}
LineID LineType Length NumSegs
(#) (name) (m) (#)
{cable}
1 body {BODY} 1
1 tail {TAIL} 1
{RULE} OPTIONS {RULE}
{setting.dt} dtM
{SETTLE + p["T"]} TMax
{p["g"]} g
{p["rho"]} rhoW
uniform {p["U"]} 0 0 current
dynamic_solver {TOLERANCE} 1e-8 30 12
{OUTPUTS}"""


def cabledyn_towed(setting: Setting) -> Ours:
    """P5 and P6: t, tip_x, tip_z, top_tension."""
    from cabledyn import CableDyn

    p = reference("P5").params
    every, count = max(int(round(p["dt_out"] / setting.dt)), 1), int(round(p["T"] / setting.dt))
    path = ramped_heave(p, setting.dt * np.arange(1, count + 1))[:, 0] + np.eye(9)[2] * (TOP - DEEP)
    with silent(), tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "p5.dat"
        file.write_text(_deck(setting))
        with CableDyn(str(file)) as system:
            host, line = system.host_dofs(), system.lines[0]
            q, v, a = (x.copy() for x in system.get_coupled_motion())

            def look(t):
                x, _, z = line.node_positions()[setting.elements]
                return t, x, z - TOP, line.fairlead_tension()

            for _ in range(int(round(SETTLE / setting.dt))):
                system.step(setting.dt, q, v, a)
            report = [look(0.0)]
            begin = time.process_time()
            for i, row in enumerate(path, 1):
                q[host], v[host], a[host] = row[:3], row[3:6], row[6:]
                system.step(setting.dt, q, v, a)
                if i % every == 0:
                    report.append(look(i * setting.dt))
            cpu = time.process_time() - begin
    return Ours(str(setting), setting.elements, setting.dt, np.array(report), cpu, p["T"], 0, count)
