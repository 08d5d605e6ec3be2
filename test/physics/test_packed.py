"""The lane loops are vectorised: packed multiplications counted in the machine code of a fresh compilation.

A broken condition of the vectoriser costs a factor of two to six and nothing tells it. Each loop also exists once more
in scalar form, for arrays that overlap; so at least as many multiplications are packed as are not, up to the few beside
the loop.
"""

from __future__ import annotations

import re

import llvmlite.binding
import numba
import numpy as np
import pytest

from cable_sim_ros.physics import ancf, cable, contact, drag, sea
from cable_sim_ros.physics.cable import CONTACT_POINTS
from cable_sim_ros.physics.drag import POINT_V
from cable_sim_ros.physics.surface import DRUM, FLOOR, GROOVE, SURFACE, Solid, solid
from cable_sim_ros.physics.work import make_work

pytestmark = pytest.mark.skipif(
    bool(numba.config.DISABLE_JIT) or not llvmlite.binding.get_host_cpu_features().get("avx2", False),
    reason="needs compilation and AVX2",
)

W = make_work(4).lanes[0]
LANE, TABLE, ROW = W.lane[0], np.zeros((4, 16)), np.zeros(1, SURFACE)[0]
CURRENT, STREAM = (0.0, 0.0, 0.0, 0.0), np.zeros((11, 16))
OUT = (W.load[0], W.by_place[0], W.by_slope[0])
BOTH = (W.by_place, W.by_slope)
KERNELS = {  # kernel: arguments, scalar multiplications allowed beyond the packed ones
    ancf.inertia_lanes: ((W.x, W.p, W.force, 0.0), 0),
    ancf.inertia_tangent_lanes: ((W.p, 1.0, W.k), 20),
    ancf.elastic_lanes: ((W.x, W.p, W.force, LANE, W.lane[1], W.lane[2]), 0),
    ancf.elastic_tangent_lanes: ((W.x, W.p, 1.0, W.force, LANE, W.lane[1], W.lane[2], W.k9, W.k), 0),
    cable.power_of: ((W.x, W.force, 16, LANE), 0),
    cable.near_surface: ((W.x, ROW, LANE), 0),
    drag.point_lanes: ((W.x, W.p, TABLE, TABLE, CURRENT, W.point), 0),
    drag.mean_lanes: ((W.mean_v, TABLE, W.point), 0),
    drag.coefficient_lanes: ((W.p, W.point, POINT_V), 0),
    drag.load_lanes: ((W.point, W.p, LANE, W.load[0]), 0),
    drag.load_tangent_lanes: ((W.point, W.p, 1.0, 1.0, LANE, *OUT), 0),
    drag.mean_load_lanes: ((W.point, W.p, LANE, W.load[0]), 0),
    drag.mean_tangent_lanes: ((W.point, W.p, 1.0, LANE, *OUT), 0),
    # in vectors of eight, 48 numbers a row are half as many packed multiplications as in vectors of four
    drag.spread_force: ((np.zeros((5, 4)), W.load, CONTACT_POINTS, W.force), 24),
    drag.spread_matrix: ((np.zeros((5, 4)), np.zeros((5, 4)), BOTH, CONTACT_POINTS, W.mixed, W.k), 0),
    # what each component holds for all lanes stands beside the loop
    sea.wave_lanes: ((np.zeros((1, 8)), np.zeros((1, 3)), np.zeros(2), 0.0, W.point, STREAM), 20),
    sea.stream_lanes: ((STREAM, W.x, TABLE, W.point), 0),
    sea.push_lanes: ((STREAM, W.p, LANE, W.load[0]), 12),  # in vectors of eight, see spread_force
    contact.contact_point_lanes: ((W.x, W.p, TABLE[0], W.point), 0),
    contact.contact_lanes: ((W.point, ROW, LANE, W.load[0]), 10),
    # ten of each kind: what does not change in its loop, see below
    contact.contact_tangent_lanes: ((W.point, ROW, 1.0, LANE, OUT), 30),
}


def counted(kernel, args) -> tuple[int, int]:
    """Packed and scalar multiplications of a kernel; machine code from the cache cannot be read."""
    fresh = numba.njit(error_model="numpy", nogil=True, _nrt=False)(kernel.py_func)
    fresh.compile(tuple(numba.typeof(a) for a in args))
    code = fresh.inspect_asm(fresh.signatures[0])
    return len(re.findall(r"\bv?mulpd\b", code)), len(re.findall(r"\bv?mulsd\b", code))


@pytest.mark.parametrize("kernel", KERNELS, ids=lambda k: k.py_func.__name__)
def test_packed(kernel):
    args, beside = KERNELS[kernel]
    packed, scalar = counted(kernel, args)
    assert packed > 0
    assert packed + beside >= scalar, f"{packed} packed, {scalar} scalar multiplications"


@pytest.mark.parametrize("kind", [DRUM, GROOVE, FLOOR], ids=["drum", "groove", "floor"])
@pytest.mark.parametrize(
    "kernel",
    [contact.contact_lanes, contact.contact_tangent_lanes, cable.near_surface],
    ids=lambda k: k.py_func.__name__,
)
def test_packed_for_each_kind_of_surface(kernel, kind, monkeypatch):
    """The loop of one kind alone: with the kind a constant, the others are not compiled."""

    @numba.njit(forceinline=True, error_model="numpy", _nrt=False)
    def of_kind(row):
        s = solid(row)
        rest = (s.radius, s.slope_sin, s.slope_cos, s.rim, s.top, s.crest, s.stiffness, s.damping, s.friction, s.slip)
        return Solid(kind, s.centre, s.speed, s.spin, s.axis, *rest)

    monkeypatch.setattr(contact, "solid", of_kind)
    monkeypatch.setattr(cable, "solid", of_kind)
    packed, scalar = counted(kernel, KERNELS[kernel][0])
    assert packed > 0
    beside = 16 if kind == FLOOR else 10  # a plane has one normal: its products with the spin stand beside the loop
    assert packed + beside >= scalar, f"{packed} packed, {scalar} scalar multiplications"
