"""Other codes on the benchmark scenes, as jobs for bench.py. The lumped chain is always run, the others on request.

Each is used as its manual shows, one thread, with the settings listed; a scene it cannot honestly do is listed so.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .. import lumped_chain
from ..ours import COARSEST
from .common import Setting, even, installed
from .in_cabledyn import cabledyn_towed
from .in_exudyn import exudyn_pulled_over, exudyn_released, exudyn_towed
from .in_moordyn import moordyn_towed
from .in_mujoco import mujoco_released, mujoco_towed

__all__ = ["CANNOT", "CODES", "RUNS", "Setting", "even", "installed", "jobs_of"]

INSTALL = "not installed: pip install 'cable_sim_ros[peers]'"
# why a code has no row on a scene
CANNOT = {
    ("moordyn", "P2"): "starts from its own hanging equilibrium, not from a straight level line",
    ("moordyn", "P4"): "no sheave",
    ("cabledyn", "P2"): "starts from its own hanging equilibrium",
    ("cabledyn", "P4"): "no sheave",
    ("mujoco", "P4"): "rigid links over the sheave: 10 % in tension with 64 links at 0.5 and 1 ms, unstable with 128",
    ("lumped chain", "P4"): "no contact in the plain chain",
}
# towed: 13 to 26 elements, finest at the towbody
COARSE, FINE = ((0.6, 5), (0.3, 4), (0.1, 4)), ((0.6, 5), (0.3, 6), (0.1, 6))
FINER = ((0.6, 8), (0.3, 9), (0.1, 9))
FINE_END = ((0.7, 25), (0.3, 44))  # the 69 elements of P6
RIGID = {"points": 1, "note": "RK4, native fluid force, one slide for the stretch"}
ALPHA = {"points": 2, "note": "generalised-alpha 0.5, sparse, Newton to 1e-6, drag with Jacobian compiled"}
# over the sheave: the cheapest found at most 0.5 % and 0.2 % off, and finer ones
SHEAVE = {"penalty": 3e4, "note": "generalised-alpha 0.3, sparse, Newton to 1e-6"}
HALVES, QUARTERS = {"points": 2} | SHEAVE, {"points": 4} | SHEAVE
DAMPED = {"note": "RK2, axial damping 0.05 of critical"}
SECTION = {"note": "generalised-alpha 0.4, Newton to 1e-4, towbody as a heavy section of 0.5 m"}

RUNS: dict[tuple[str, str], tuple[Callable, tuple[Setting, ...]]] = {
    ("exudyn", "P2"): (
        exudyn_released,
        tuple(
            even(n, dt, note="generalised-alpha 0.5, sparse, Newton to 1e-6")
            for n, dt in ((10, 0.005), (16, 0.01), (18, 0.005), (20, 0.005), (20, 0.0025))
        ),
    ),
    ("exudyn", "P4"): (
        exudyn_pulled_over,
        (
            Setting(((0.32, 2), (0.32, 16), (0.36, 2)), 0.05, **HALVES),
            Setting(((0.32, 2), (0.32, 20), (0.36, 2)), 0.04, **HALVES),
            Setting(((0.32, 2), (0.3, 30), (0.38, 4)), 0.025, **QUARTERS),
            even(48, 0.0125, **QUARTERS),
            even(96, 0.01, **QUARTERS),
        ),
    ),
    ("exudyn", "P5"): (
        exudyn_towed,
        (
            *(Setting(COARSEST, dt, **ALPHA) for dt in (0.4, 0.2)),
            *(Setting(FINE, dt, **ALPHA) for dt in (0.2, 0.1)),
            even(40, 0.1, **ALPHA),
        ),
    ),
    ("exudyn", "P6"): (exudyn_towed, (even(69, 0.2, **ALPHA), even(69, 0.1, **ALPHA))),
    ("mujoco", "P2"): (
        mujoco_released,
        tuple(even(n, dt, note="RK4, no stretch") for n, dt in ((20, 0.005), (40, 0.005), (80, 0.00125))),
    ),
    ("mujoco", "P5"): (
        mujoco_towed,
        (Setting(COARSE, 0.05, **RIGID), Setting(FINE, 0.05, **RIGID), even(40, 0.05, **RIGID)),
    ),
    ("mujoco", "P6"): (mujoco_towed, (even(69, 0.05, **RIGID), Setting(FINE_END, 0.05, **RIGID))),
    ("moordyn", "P5"): (moordyn_towed, (even(20, 0.02, inner=0.002, **DAMPED), even(40, 0.02, inner=0.001, **DAMPED))),
    ("moordyn", "P6"): (moordyn_towed, (even(69, 0.02, inner=0.0005, **DAMPED),)),
    ("cabledyn", "P5"): (
        cabledyn_towed,
        (Setting(FINER, 0.2, **SECTION), even(40, 0.2, **SECTION), even(40, 0.1, **SECTION)),
    ),
    ("cabledyn", "P6"): (
        cabledyn_towed,
        (*(even(69, dt, **SECTION) for dt in (0.4, 0.2, 0.1)), Setting(FINE_END, 0.1, **SECTION)),
    ),
}
CODES = ("moordyn", "mujoco", "exudyn", "cabledyn")


def jobs_of(scene: str, all_codes: bool) -> tuple[list[tuple[str, Any, Callable]], list[tuple[str, str]]]:
    """(code, setting, run) of what can be run on a scene, and (code, why not) of what cannot."""
    jobs: list[tuple[str, Any, Callable]] = []
    missing: list[tuple[str, str]] = []
    if scene in lumped_chain.CASES:
        run, settings = lumped_chain.CASES[scene]
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
