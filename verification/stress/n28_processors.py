"""N28: the same bits on every x86-64 processor with AVX2: each other one is played by a process of its own.

What depends on the processor: the target of the kernels (numba), the code that numpy and the BLAS choose as they are
loaded, and the C library's functions. The last are one and the same wherever there is AVX2 with FMA; without FMA they
round otherwise, and so does the run.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import subprocess
import sys
import tempfile

import llvmlite.binding as llvm
import numba

from cable_sim_ros.runs import offline

from .tows import shipped
from .verdict import Found, Metric, stress

WALL = {"compile_s", "start_s", "stepping_s", "realtime_factor"}  # figures of the clock on the wall
SEA = {
    "water__waves__kind": "jonswap",
    "water__waves__height": 2.0,
    "water__waves__period": 7.0,
    "water__waves__spreading": 4.0,
    "water__turbulence__deviation": (0.05, 0.05, 0.02),
    "water__ramp": 1.0,
    "water__current_frame": "heading",
    "ship__heading_deg": 40.0,
}
WITHIN = 3600.0  # s of a process, compiling included
# the least that numpy and OpenBLAS can be held to: what they choose for on better processors is left out
OTHER_BLAS = {"OPENBLAS_CORETYPE": "Prescott", "OPENBLAS_NUM_THREADS": "1"}
NO_FMA = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2"}
TARGETS = ("haswell", "x86-64-v3", "skylake-avx512", "nehalem")  # of the kernels
WIDE = "skylake-avx512"  # runs where there is AVX-512
BEFORE = "nehalem"  # without AVX2 and FMA: outside the promise


def runs(quick: bool) -> dict:
    """Name: the arguments of `offline.run`."""
    if quick:
        return {
            "side_scan, sea and turbulence": (shipped("side_scan", **SEA), {"heave": (0.5, 6.0), "duration": 1.0}),
            "full_scale, IMU alone": ("full_scale", {"motion": "nbp1406", "imu_only": True, "duration": 2.0}),
        }
    heave, bag = {"heave": (1.0, 8.0), "duration": 20.0}, {"motion": "nbp1406", "duration": 30.0}
    return {
        "full_scale, heave": ("full_scale", heave),
        "side_scan, heave": ("side_scan", heave),
        "full_scale, nbp1406": ("full_scale", bag),
        "side_scan, nbp1406": ("side_scan", bag),
        "full_scale, IMU alone": ("full_scale", bag | {"imu_only": True}),
        "side_scan, sea and turbulence": (shipped("side_scan", **SEA), heave),
        "full_scale, chosen steps": ("full_scale", bag | {"every": 0.1}),
        "lowered_ctd, hauled": ("lowered_ctd", heave | {"winch": "0 rate -0.5, 10 rate 0.3"}),
    }


def digests(quick: bool) -> dict[str, str]:
    """Of each run its tick outputs, every field of every tick, and its figures but for those of the clock on the
    wall."""
    found = {}
    for name, (scene, options) in runs(quick).items():
        run = offline.run(scene, **options)
        frames = hashlib.sha256()
        for field in run.frames.dtype.names or ():
            frames.update(run.frames[field].tobytes())
        metrics = json.dumps({key: value for key, value in run.metrics.items() if key not in WALL})
        found[f"{name}: tick outputs"] = frames.hexdigest()
        found[f"{name}: figures"] = hashlib.sha256(metrics.encode()).hexdigest()
    return found


def elsewhere(environment: dict[str, str], quick: bool) -> dict[str, str]:
    """The digests of a process of its own with these variables. Raises RuntimeError with the end of what it said."""
    program = f"import json; from {__name__} import digests; print(json.dumps(digests({quick})))"
    command = [sys.executable, "-W", "ignore", "-c", program]
    done = subprocess.run(
        command, env={**os.environ, **environment}, capture_output=True, text=True, timeout=WITHIN, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{environment}: code {done.returncode}: {done.stderr[-2000:]}")
    return json.loads(done.stdout.splitlines()[-1])


def plain_numpy() -> dict[str, str]:
    """The variable that holds numpy to the code it has for every processor."""
    from numpy._core._multiarray_umath import __cpu_dispatch__, __cpu_features__

    return {"NPY_DISABLE_CPU_FEATURES": " ".join(name for name in __cpu_dispatch__ if __cpu_features__.get(name))}


@stress(
    "kernels for AVX2 and AVX-512, numpy and BLAS of the oldest processor, each in a process of its own",
    "every tick output and figure to the bit",
)
def processors(quick: bool) -> Found:
    """N28: the same bits on every x86-64 processor with AVX2."""
    has = llvm.get_host_cpu_features()
    if not (platform.machine() in ("x86_64", "AMD64") and has.get("avx2") and has.get("fma")):
        return Found([Metric("processor", platform.machine())], ["not promised without AVX2 and FMA: nothing was run"])
    here, notes, metrics = digests(quick), [], []

    def compared(name: str, environment: dict[str, str], judged: bool = True) -> None:
        there = elsewhere(environment, quick)
        wrong = [name for name in here if here[name] != there.get(name)]
        metrics.append(Metric(f"differ, {name}", len(wrong), f"of {len(here)}", 0 if judged else None))
        if wrong:
            notes.append(f"{name}: {', '.join(wrong)}")

    compared("oldest numpy and BLAS", plain_numpy() | OTHER_BLAS)
    if quick or numba.config.DISABLE_JIT:
        return Found(metrics, [*notes, "short runs; kernels of this machine alone"])
    compared("C library without FMA", NO_FMA, judged=False)
    for target in TARGETS:
        if target == WIDE and not has.get("avx512f"):
            notes.append(f"{target}: this processor has no AVX-512, not run")
            continue
        with tempfile.TemporaryDirectory() as folder:
            own = {"NUMBA_CPU_NAME": target, "NUMBA_CPU_FEATURES": "", "NUMBA_CACHE_DIR": folder}
            compared(f"kernels for {target}", own)
            if target == BEFORE:
                compared(f"kernels for {target}, C library without FMA", own | NO_FMA, judged=False)
    return Found(metrics, notes)
