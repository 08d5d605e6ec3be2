"""Multiplications in the machine code of the lane kernels, packed and scalar, for two processors: a process of its own.

Started with NUMBA_CPU_NAME and NUMBA_CPU_FEATURES of the first; for the second numba's passes run again over the same
modules. Nothing that is compiled here is run, so the machine need not be one of them. Prints JSON: kernel and kind of
surface, packed and scalar of the first target and of the second.
"""

from __future__ import annotations

import json
import re
import sys

import llvmlite.binding as llvm
import numba
import numpy as np
from numba.core.codegen import CPUCodeLibrary

from cable_sim_ros.physics import ancf, cable_assembly, contact, drag, sea
from cable_sim_ros.physics.cable_assembly import CONTACT_POINTS
from cable_sim_ros.physics.contact_surface import DRUM, FLOOR, GROOVE, SURFACE, Solid, solid
from cable_sim_ros.physics.drag import POINT_V
from cable_sim_ros.physics.workspace import make_work

W, P = make_work(4).lanes[0], np.zeros((ancf.ROWS, 16))
LANE, TABLE, ROW = W.lane[0], np.zeros((4, 16)), np.zeros(1, SURFACE)[0]
CURRENT, STREAM = (0.0, 0.0, 0.0, 0.0), np.zeros((11, 16))
OUT = (W.load[0], W.by_place[0], W.by_slope[0])
BOTH = (W.by_place, W.by_slope)
KERNELS = {
    ancf.inertia_lanes: (W.x, P, W.force, 0.0),
    ancf.inertia_tangent_lanes: (P, 1.0, W.k),
    ancf.elastic_lanes: (W.x, P, W.force, LANE, W.lane[1], W.lane[2]),
    ancf.elastic_tangent_lanes: (W.x, P, 1.0, W.force, LANE, W.lane[1], W.lane[2], W.k9, W.k),
    cable_assembly.power_of: (W.x, W.force, 16, LANE),
    cable_assembly.near_surface: (W.x, ROW, LANE),
    drag.point_lanes: (W.x, P, TABLE, TABLE, CURRENT, W.point),
    drag.mean_lanes: (W.mean_v, TABLE, W.point),
    drag.coefficient_lanes: (P, W.point, POINT_V),
    drag.load_lanes: (W.point, P, LANE, W.load[0]),
    drag.load_tangent_lanes: (W.point, P, 1.0, 1.0, LANE, *OUT),
    drag.mean_load_lanes: (W.point, P, LANE, W.load[0]),
    drag.mean_tangent_lanes: (W.point, P, 1.0, LANE, *OUT),
    drag.spread_force: (np.zeros((5, 4)), W.load, CONTACT_POINTS, W.force),
    drag.spread_matrix: (np.zeros((5, 4)), np.zeros((5, 4)), BOTH, CONTACT_POINTS, W.mixed, W.k),
    sea.wave_lanes: (np.zeros((1, 8)), np.zeros((1, 3)), np.zeros(2), 0.0, W.point, STREAM),
    sea.stream_lanes: (STREAM, W.x, TABLE, W.point),
    sea.push_lanes: (STREAM, P, LANE, W.load[0]),
    contact.contact_point_lanes: (W.x, P, TABLE[0], W.point),
    contact.contact_lanes: (W.point, ROW, LANE, W.load[0]),
    contact.contact_tangent_lanes: (W.point, ROW, 1.0, LANE, OUT),
}
OF_SURFACES = (contact.contact_lanes, contact.contact_tangent_lanes, cable_assembly.near_surface)
KINDS = {"drum": DRUM, "groove": GROOVE, "floor": FLOOR}

_optimise = CPUCodeLibrary._optimize_final_module
_second: dict = {}  # name of what is being compiled, target machine: set by counted(); its code there


def _for_both(library):
    """numba's own passes, for the kernel itself over a copy of the module for the second target as well."""
    if _second["name"] in library.name:
        own, codegen = library._final_module, library._codegen
        first, codegen._tm, library._final_module = codegen._tm, _second["machine"], own.clone()
        _optimise(library)
        _second["code"] = codegen._tm.emit_assembly(library._final_module)
        codegen._tm, library._final_module = first, own
    _optimise(library)


def multiplications(code: str) -> tuple[int, int]:
    return len(re.findall(r"\bv?mulpd\b", code)), len(re.findall(r"\bv?mulsd\b", code))


def counted(kernel, args, machine) -> tuple[int, int, int, int]:
    """Machine code from the cache cannot be read: compiled anew."""
    fresh = numba.njit(error_model="numpy", nogil=True, _nrt=False)(kernel.py_func)
    _second.update(name=kernel.py_func.__name__, machine=machine, code="")
    fresh.compile(tuple(numba.typeof(a) for a in args))
    assert _second["code"], f"{kernel} was not compiled for the second target"
    return *multiplications(fresh.inspect_asm(fresh.signatures[0])), *multiplications(_second["code"])


def of_kind(kind: int):
    """solid() with the kind a constant, so that the loops of the others are not compiled."""

    @numba.njit(forceinline=True, error_model="numpy", _nrt=False)
    def fixed(row):
        s = solid(row)
        rest = (s.radius, s.slope_sin, s.slope_cos, s.rim, s.top, s.crest, s.stiffness, s.damping, s.friction, s.slip)
        return Solid(kind, s.centre, s.speed, s.spin, s.axis, *rest)

    return fixed


def main(cpu: str, features: str) -> None:
    target = llvm.Target.from_triple(llvm.get_process_triple())
    machine = target.create_target_machine(cpu=cpu, features=features, opt=3)
    CPUCodeLibrary._optimize_final_module = _for_both
    found = {kernel.py_func.__name__: counted(kernel, args, machine) for kernel, args in KERNELS.items()}
    for name, kind in KINDS.items():
        contact.solid = cable_assembly.solid = of_kind(kind)
        for kernel in OF_SURFACES:
            found[f"{kernel.py_func.__name__} {name}"] = counted(kernel, KERNELS[kernel], machine)
    print(json.dumps(found))


if __name__ == "__main__":
    main(*sys.argv[1:])
