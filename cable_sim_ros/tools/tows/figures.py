"""Figures of measured tows, for the JSON: docs/json.md#tows; and their picture: depth predicted with its interval
against measured, and errors of the ways.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...files import finite
from ...plots.run import canvas
from ..calibrate.free import Free
from .tows import Judged

HELD, OUT, OTHER = "#0b3c5d", "#c23b33", "#7f7f7f"


def draw(judged: Judged, path: Path) -> Path:
    """Draw it. RuntimeError where matplotlib is missing."""
    depth = np.array([tow.depth for tow in judged.table.tows])
    known = np.isfinite(depth)
    measured, (low, mid, high) = depth[known], judged.left_out[known].T
    inside = (measured >= low) & (measured <= high)
    title = f"{judged.made.tows}: {known.sum()} tows, each by a fit without its group"
    with canvas(path, (12.0, 6.2), title, "`cable-sim tows`, docs/tows.md") as figure:
        against, ways = figure.subplots(1, 2, width_ratios=(3, 2))
        end = 1.05 * max(measured.max(), mid.max())
        against.plot([0.0, end], [0.0, end], color=OTHER, lw=1)
        for rows, color, label in ((inside, HELD, "within 90 % interval"), (~inside, OUT, "outside")):
            x, y, off = measured[rows], mid[rows], (mid[rows] - low[rows], high[rows] - mid[rows])
            look = {"fmt": "o", "ms": 4, "lw": 1, "color": color, "alpha": 0.7}
            against.errorbar(x, y, yerr=off, label=f"{label}: {rows.sum()}", **look)
        against.set(xlabel="measured depth [m]", ylabel="predicted depth [m]", xlim=(0.0, end), ylim=(0.0, None))
        against.legend(frameon=False, loc="lower right")
        names = [f"{one.way} ({one.tows})" for one in judged.ways][::-1]
        places = np.arange(len(names))
        ways.barh(places + 0.2, [100 * one.spread for one in judged.ways][::-1], 0.35, color=HELD, label="spread")
        ways.barh(
            places - 0.2, [100 * one.median for one in judged.ways][::-1], 0.35, color=OTHER, label="median error"
        )
        ways.set_yticks(places, names)
        ways.set_xlabel("error, share of depth [%]")
        ways.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return path


def figures_of(judged: Judged, free: Sequence[Free]) -> dict[str, Any]:
    """All of them."""
    fitted, at = judged.fitted, judged.fitted.at
    deviation = np.sqrt(np.diag(fitted.covariance))
    return {
        "tows": judged.made.tows,
        "used": len(judged.table.tows),
        "left_out": judged.table.left,
        "numbers": [
            {"key": one.key, "unit": one.unit, "value": value, "deviation": finite(sd), "scene": one.start}
            for one, value, sd in zip(free, fitted.values.tolist(), deviation.tolist())
        ],
        "deviations": {
            "depth_share": at.depth,
            "angle_deg": float(np.degrees(at.angle)),
            "speeds": at.speeds,
            "true_speed_mps": at.deviation,
        },
        "true_speed_mean_mps": at.mean,
        "scales": at.scales,
        "interval_factor": judged.factor,
        "ways": [one._asdict() for one in judged.ways],
        "interpolation": {
            "simulated": judged.between.tows,
            "failed": len(judged.between.failed),
            "depth_max_share": finite(float(judged.between.error[0])),
            "depth_rms_share": finite(float(judged.between.error[1])),
            "angle_max_deg": finite(float(np.degrees(judged.between.error[2]))),
            "series": sum(tow.series is not None for tow in judged.table.tows),
            "series_max_share": finite(float(judged.between.over_time[0])),
            "series_rms_share": finite(float(judged.between.over_time[1])),
            "tows_max_share": judged.apart[0],
            "tows_rms_share": judged.apart[1],
        },
        "rows": rows_of(judged),
        "verdict": judged.verdict.as_dict(),
    }


def rows_of(judged: Judged) -> list[dict[str, Any]]:
    """One dict a tow: measured, by the fit without its fold with 90 % interval, by the fit to all, simulated itself."""
    return [
        {
            "tow": tow.name,
            "group": tow.group,
            "wire_m": tow.wire,
            "angle_deg": finite(float(np.degrees(tow.angle))),
            "depth_m": finite(float(tow.depth)),
            "left_out_depth_m": float(left[1]),
            "left_out_low_m": float(left[0]),
            "left_out_high_m": float(left[2]),
            "fitted_depth_m": float(own[1]),
            "fitted_low_m": float(own[0]),
            "fitted_high_m": float(own[2]),
            "true_speed_mps": float(speed),
            "simulated_depth_m": finite(float(itself)),
        }
        for tow, left, own, speed, itself in zip(
            judged.table.tows, judged.left_out, judged.all_in, judged.speeds, judged.itself
        )
    ]
