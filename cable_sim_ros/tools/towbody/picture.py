"""Picture of a body with an attitude: polar, pitch and depth over speed, fins over tow point."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ...plots.canvas import canvas

LIFT, DRAG, FORMULA = "#0b3c5d", "#c23b33", "#7f7f7f"


def plot(found: dict[str, Any], path: Path) -> Path:
    """Draw it. RuntimeError where matplotlib is missing."""
    maps = {axis: one for axis, one in (found["map"] or {}).items() if one is not None}
    size = (18.0, 9.0) if maps else (12.0, 9.0)
    with canvas(path, size, f"{found['scene']}: {found['body']}", "keys: docs/bodies.md") as figure:
        (polar, pitch, *upper), (fins, depth, *lower) = figure.subplots(2, 3 if maps else 2)
        for axis, plotted in zip((*upper, *lower), ("yaw", "pitch"), strict=False):
            _draw_map(figure, axis, plotted, maps.get(plotted))
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


def _draw_map(figure: Any, axis: Any, name: str, one: dict[str, Any] | None) -> None:
    """Growth of a small turn by colour, the boundary found and by formula, the body itself."""
    if one is None:
        axis.set_axis_off()
        axis.text(0.5, 0.5, f"no tail holds it in {name}", ha="center")
        return
    places, areas, growth = one["tow_point_m"], one["tail_area_m2"], np.array(one["growth_per_s"])
    most = float(np.abs(growth).max())
    mesh = axis.pcolormesh(places, areas, growth, cmap="RdBu_r", vmin=-most, vmax=most, shading="gouraud")
    figure.colorbar(mesh, ax=axis, label="growth of a small turn [1/s]")
    wide, thin = {"color": FORMULA, "lw": 5}, {"color": "black", "ls": "--", "lw": 1.5}
    for key, style, label in (("found_m2", wide, "boundary, found"), ("formula_m2", thin, "by formula")):
        known = [(x, y) for x, y in zip(places, one[key], strict=True) if y is not None]
        axis.plot([x for x, _ in known], [y for _, y in known], label=label, **style)
    axis.plot(one["own_tow_point_m"], one["own_area_m2"], "o", color="black", mfc="white", ms=8, label="as it is")
    axis.set_ylim(0.0, areas[-1])
    axis.set_title(f"Stability in {name}, level at {one['speed_mps']:.3g} m/s")
    axis.set_xlabel(f"tow point {one['tow_point']} [m]")
    axis.set_ylabel(("upright" if name == "yaw" else "level") + " tail [m²]")
    axis.legend(loc="upper right", frameon=True, facecolor="white", framealpha=0.9)
