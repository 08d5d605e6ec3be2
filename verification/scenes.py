"""Benchmark scenes: parameters, reference histories and the stated error measures, in one place for every code.

P6 is P5 with 69 elements; P7 to P9 are whole tows and have no file: their references
are their own refined solutions (tow_bench.py, haul_bench.py).
"""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import make_interp_spline

FOLDER = Path(__file__).parent / "reference"
FILES = {"P1": "p1", "P2": "p2", "P3": "p3_dynamic", "P4": "p4_motion", "P5": "p5", "P6": "p5"}
WHAT = {
    "P1": ("end tension", "shape over the length"),
    "P2": ("RMS of the top reaction over its RMS", "RMS tip distance over the length"),
    "P3": ("no tension", "RMS tip distance over the length"),
    "P4": ("RMS at the right mass over its mean, 0.2 to 1 s", "RMS travel over the last travel"),
    "P5": ("worse of mean and std of the top tension, 60 to 100 s", "heave amplitude of the towbody"),
    "P6": ("worse of mean and std of the top tension, 60 to 100 s", "heave amplitude of the towbody"),
    "P7": ("worse of mean and std of the tension, each over its own", "largest distance of the towbody [m]"),
    "P8": ("tension at rest over the working tension", "distance of the towbody at rest from its static start [m]"),
    "P9": ("worse of mean and std of the tension, each over its own", "largest distance of the towbody [m]"),
}


class Reference(NamedTuple):
    params: dict[str, float]
    data: dict[str, Any]  # the whole file
    history: np.ndarray  # [samples, columns]


@cache
def reference(scene: str) -> Reference:
    """Parameters and reference history of P1 to P6."""
    data = json.loads((FOLDER / f"{FILES[scene]}.json").read_text("utf-8"))
    table = np.genfromtxt(FOLDER / f"{FILES[scene]}.csv", delimiter=",", names=True)
    return Reference(data["params"], data, np.column_stack([table[n] for n in table.dtype.names]))


@cache
def static_shape() -> np.ndarray:
    """Static shape of P5: rows of s, x, z, T."""
    return np.genfromtxt(FOLDER / "p5_static.csv", delimiter=",", skip_header=1)


def errors(scene: str, history: np.ndarray) -> tuple[float, float]:
    """(error of tension, error of position), fractions, by the measures in WHAT; nan where a scene has none.

    history: columns as in the reference file; compared at the reference's own instants, on cubic splines: straight
    lines would cut the crests off, 0.5 % of a deviation at 25 samples a period. nan where the history is not finite.
    """
    if not np.isfinite(history).all():
        return float("nan"), float("nan")
    ref = reference(scene)
    p, want = ref.params, ref.history
    got = make_interp_spline(history[:, 0], history, k=3)(want[:, 0])
    if scene == "P1":
        ends = abs(got[0, 3] / want[0, 3] - 1.0)
        return ends, float(np.hypot(got[:, 1] - want[:, 1], got[:, 2] - want[:, 2]).max() / p["L"])
    if scene in ("P2", "P3"):
        tip = np.hypot(got[:, 1] - want[:, 1], got[:, 2] - want[:, 2])
        tension = _rms(got[:, 3] - want[:, 3]) / _rms(want[:, 3]) if scene == "P2" else float("nan")
        return tension, _rms(tip) / p["L"]
    if scene == "P4":
        late = want[:, 0] >= 0.2 - 1e-9
        return (_rms(got[late, 2] - want[late, 2]) / want[late, 2].mean(), _rms(got[:, 1] - want[:, 1]) / want[-1, 1])
    late = want[:, 0] >= ref.data["params"]["t_stat"] - 1e-9
    mean, std = got[late, 3].mean(), got[late, 3].std()
    heave = 0.5 * np.ptp(got[late, 2])
    return (
        max(abs(mean / ref.data["tension_mean"] - 1.0), abs(std / ref.data["tension_std"] - 1.0)),
        abs(heave / ref.data["towbody_heave_amplitude"] - 1.0),
    )


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.square(x))))
