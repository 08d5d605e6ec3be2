"""`cable-sim towbody`: trim, loads, stability and polar of a body with an attitude."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ...cli.options import Answer, answers, drawn
from ...terminal import print_table, say

MOST_SPEEDS = 100


def speeds_of(text: str) -> tuple[float, ...]:
    """FROM:TO:STEP, m/s. Raises click.BadParameter."""
    try:
        low, high, step = (float(part) for part in text.split(":"))
    except ValueError:
        raise click.BadParameter(f"'{text}' is not FROM:TO:STEP, three numbers in m/s; nothing was computed") from None
    if not (0.0 < low <= high <= 15.0 and step > 0.0 and (high - low) / step < MOST_SPEEDS):
        raise click.BadParameter(
            f"'{text}' is not 0 < FROM <= TO <= 15 m/s in at most {MOST_SPEEDS} steps; nothing was computed"
        )
    return tuple(low + step * k for k in range(int((high - low) / step + 1.0 + 1e-9)))


@click.command()
@click.argument("scene")
@click.option("--body", default="towbody", metavar="NAME", help="Body: towbody, or one of bodies. Default: towbody.")
@click.option("--speeds", type=speeds_of, default="1:4:0.5", metavar="FROM:TO:STEP", help="m/s. Default: 1:4:0.5.")
@click.option("--map", "mapped", is_flag=True, help="Stability over tow point and tail area too, found and by formula.")
@click.option("--out", type=click.Path(path_type=Path), metavar="PAGE.png", help="Page of pictures, PNG or SVG.")
@answers
def towbody(scene, body, speeds, mapped, out) -> Answer:
    """Trim, loads, stability and polar of a body with an attitude (model: rigid), pitch nose up."""
    from ...io.scenes.load import load_scene
    from .figures import figures_of, plot

    found = figures_of(load_scene(scene), body, speeds, mapped)
    return Answer(found, lambda: _tell(found), files=drawn(lambda: plot(found, out)) if out else ())


def _tell(found: dict[str, Any]) -> None:
    critical = found["critical_speed_mps"]
    say(
        f"{found['scene']}, {found['body']}: "
        + ("pitch keeps at any speed" if critical is None else f"level, pitch is lost above {critical:.4g} m/s")
        + f"; upright fins {found['fin_area_m2']:.3g} m^2, least {found['least_fin_m2']:.3g} m^2 (aspect ratio 2)"
    )
    columns = ("m/s", "roll", "pitch up", "heading", "depth m", "drag N", "lift N", "tension N", "of stall", "period s")
    print_table("Trim over speed; period with damping ratio", columns, [_row(row) for row in found["speeds"]])
    for row in found["speeds"]:
        if row["unstable"] is None and row["fastest_growth_per_s"] > 0.0:
            say(f"at {row['speed_mps']:.3g} m/s a small turn grows with {row['fastest_growth_per_s']:.3g} 1/s")
    fins = [(f"{r['ahead_m']:.3g}", _or_none(r["found_m2"]), f"{r['formula_m2']:.3g}") for r in found["fins"]]
    print_table("Least upright fins over tow point", ("tow point ahead m", "found m^2", "by formula m^2"), fins)
    for axis, one in (found["map"] or {}).items():
        if one is not None:
            _tell_map(axis, one)


def _tell_map(axis: str, one: dict[str, Any]) -> None:
    columns = (f"tow point {one['tow_point']} m", "found m^2", "by formula m^2")
    lines = zip(one["tow_point_m"], one["found_m2"], one["formula_m2"], strict=True)
    rows = [(f"{place:.3g}", _or_none(found), _or_none(formula)) for place, found, formula in lines]
    own = f"its own {one['own_tow_point_m']:.3g} m, {one['own_area_m2']:.3g} m^2"
    print_table(f"Least tail in {axis} at {one['speed_mps']:.3g} m/s; {own}", columns, rows)


def _or_none(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}"


def _row(row: dict[str, Any]) -> tuple[str, ...]:
    if row["unstable"] is not None:
        return (f"{row['speed_mps']:.3g}", f"{row['unstable']}: {row['body']}", *[""] * 8)
    numbers = ("roll_deg", "pitch_up_deg", "heading_deg", "depth_m", "drag_n", "lift_n", "tension_n", "stall_share")
    periods = " ".join(f"{one['period_s']:.3g}({one['damping_ratio']:.2f})" for one in row["oscillations"])
    return (
        f"{row['speed_mps']:.3g}",
        *(f"{row[name]:z.3f}" if "deg" in name else f"{row[name]:.4g}" for name in numbers),
        periods or "-",
    )
