"""The lane loops are vectorised: packed multiplications counted in the machine code of a fresh compilation.

A broken condition of the vectoriser costs a factor of two to six and nothing tells it. Each loop also exists once more
in scalar form, for arrays that overlap; so at least as many multiplications are packed as are not, up to the few beside
the loop. The code is made for two processors by name, AVX2 and AVX-512 in vectors of eight, not for the one that runs
the test: how often the vectoriser unrolls each form is another on each.
"""

import json
import os
import platform
import subprocess
import sys
from pathlib import Path

import numba
import pytest
from packed_code import KERNELS, KINDS, OF_SURFACES

pytestmark = [
    pytest.mark.nightly,  # of the speed: no result depends on it
    pytest.mark.skipif(
        bool(numba.config.DISABLE_JIT) or platform.machine() not in ("x86_64", "AMD64"),
        reason="needs compilation, and LLVM for x86-64",
    ),
]

FIRST, SECOND = ("haswell", ""), ("skylake-avx512", "-prefer-256-bit")  # name and features for LLVM
BESIDE = {  # scalar multiplications beyond the packed ones: what does not change in a loop stands beside it
    "near_surface": 3,
    "contact_lanes": 19,
    "contact_tangent_lanes": 30,
    "near_surface drum": 3,
    "near_surface groove": 3,
    "contact_lanes drum": 1,
    "contact_lanes groove": 5,  # two loops, without friction and with it
    "contact_tangent_lanes drum": 3,
    "contact_tangent_lanes groove": 7,
    "contact_tangent_lanes floor": 11,  # a plane has one normal: its products with the spin
}
UNROLLED = {"wave_lanes": 2}  # times that the scalar form stands there
NAMES = [kernel.py_func.__name__ for kernel in KERNELS]
NAMES += [f"{kernel.py_func.__name__} {kind}" for kind in KINDS for kernel in OF_SURFACES]


@pytest.fixture(scope="module")
def counts():
    """Kernel, and kind of surface: packed and scalar multiplications for the first processor, and for the second."""
    done = subprocess.run(
        [sys.executable, str(Path(__file__).with_name("packed_code.py")), *SECOND],
        env={**os.environ, "NUMBA_CPU_NAME": FIRST[0], "NUMBA_CPU_FEATURES": FIRST[1]},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)


@pytest.mark.parametrize("which", [0, 1], ids=["avx2", "avx512"])
@pytest.mark.parametrize("name", NAMES)
def test_packed(counts, name, which):
    packed, scalar = counts[name][2 * which : 2 * which + 2]
    assert packed > 0
    assert packed + BESIDE.get(name, 0) >= scalar / UNROLLED.get(name, 1), f"{packed} packed, {scalar} scalar"


def test_all_are_counted(counts):
    assert sorted(counts) == sorted(NAMES) and {*BESIDE, *UNROLLED} <= {*NAMES}
