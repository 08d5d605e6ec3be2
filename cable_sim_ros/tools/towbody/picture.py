"""Picture of a body with an attitude: polar, pitch and depth over speed, fins over tow point."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ...plots.canvas import canvas

LIFT, DRAG, FORMULA = "#0b3c5d", "#c23b33", "#7f7f7f"


def plot(found: dict[str, Any], path: Path) -> Path:
    """Draw it. RuntimeError where matplotlib is missing."""
    with canvas(path, (12.0, 9.0), f"{found['scene']}: {found['body']}", "keys: docs/bodies.md") as figure:
        (polar, pitch), (fins, depth) = figure.subplots(2, 2)
        angles = [row["pitch_up_deg"] for row in found["polar"]]
        polar.set_title(f"Body alone at {found['polar_speed_mps']:.3g} m/s")
        polar.plot(angles, [row["lift_n"] for row in found["polar"]], color=LIFT, lw=2, label="lift")
        polar.plot(angles, [row["drag_n"] for row in found["polar"]], color=DRAG, lw=2, label="drag")
        polar.set_xlabel("pitch, nose up [deg]")
        polar.set_ylabel("force [N]")
        polar.legend(frameon=False)
        kept = [row for row in found["speeds"] if row["unstable"] is None]
        lost = [row["speed_mps"] for row in found["speeds"] if row["unstable"] is not None]
        speeds = [row["speed_mps"] for row in kept]
        for axis, key, label in ((pitch, "pitch_up_deg", "pitch, nose up [deg]"), (depth, "depth_m", "depth [m]")):
            axis.plot(speeds, [row[key] for row in kept], "o-", color=LIFT, lw=2, ms=4)
            for i, speed in enumerate(lost):
                axis.axvline(speed, color=DRAG, ls=":", label=None if i else "no stable trim")
            if lost:
                axis.legend(frameon=False)
            axis.set_xlabel("speed [m/s]")
            axis.set_ylabel(label)
        pitch.set_title("Trim of the tow")
        depth.set_title("Depth of the tow")
        depth.invert_yaxis()
        known = [row for row in found["fins"] if row["found_m2"] is not None]
        fins.set_title("Least upright fins, aspect ratio 2")
        fins.plot([r["ahead_m"] for r in known], [r["found_m2"] for r in known], "o-", color=LIFT, lw=2, label="found")
        fins.plot(
            [r["ahead_m"] for r in found["fins"]],
            [r["formula_m2"] for r in found["fins"]],
            color=FORMULA,
            ls="--",
            label="formula",
        )
        fins.axhline(found["fin_area_m2"], color=DRAG, ls=":", label="its own")
        fins.set_xlabel("tow point ahead of its place [m]")
        fins.set_ylabel("area [m²]")
        fins.set_ylim(bottom=0.0)
        fins.legend(frameon=False)
    return path
