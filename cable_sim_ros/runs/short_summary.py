"""What a run prints: at most twelve rows, chosen by what was asked of the tow, and what is unusual marked.

All figures are in the JSON (runs/summary.py), and printed with --all.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from .summary import WINCH_LIMITS, format_value

if TYPE_CHECKING:
    from rich.table import Table

MOST = 12  # rows
BODIES = 2  # rows of bodies on the line
UPRIGHT = 0.05  # layback over scope, below which a load hangs and has none to speak of
MOVED = 1e-3  # m of pay-out, below which the winch stood


class Row(NamedTuple):
    """One row: None is not printed; unusual: marked, a tow in order has no such row."""

    what: str
    mean: Any = None
    std: Any = None
    least: Any = None
    largest: Any = None
    unit: str = ""
    unusual: bool = False


def rows(m: dict[str, Any]) -> list[Row]:
    """The rows of a summary, the least important left out where there are more than MOST.

    m: as of `summarize`, with what the run adds.
    """
    last = [*_unusual(m), *_pace(m)]
    return [*[*_tow(m), *_winch(m), *_bodies(m), *_beside(m)][: MOST - len(last)], *last]


def _tow(m: dict[str, Any]) -> Iterator[Row]:
    haul, std = m["tension_std_n"] is None, m["tension_std_n"]
    yield Row("tension at the sheave", m["tension_mean_n"], std, m["tension_min_n"], m["tension_max_n"], "N")
    if haul:
        yield Row("scope at the largest tension", m["tension_max_scope_m"], unit="m")
    depth = m["body_depth_min_m"], m["body_depth_max_m"], "m"
    yield Row("depth of the towbody", None if haul else m["body_depth_m"], m["body_depth_std_m"], *depth)
    for name in ("pitch", "roll"):
        if m[f"body_{name}_std_deg"] is not None:
            what = f"{name} of the towbody{', nose up' if name == 'pitch' else ''}"
            yield Row(what, m[f"body_{name}_mean_deg"], m[f"body_{name}_std_deg"], unit="deg")
    if m["splash_tension_max_n"] is not None:
        tension = m["splash_tension_min_n"], m["splash_tension_max_n"], "N"
        yield Row("tension while a body is in the surface", None, None, *tension)
        yield Row("slam", None, None, None, m["slam_max_n"], "N")
    if m["landing_speed_m_s"] is not None:
        yield Row("speed of landing", m["landing_speed_m_s"], unit="m/s")
    if haul:
        yield Row("scope", None, None, m["scope_min_m"], m["scope_max_m"], "m")
    if (m["layback_max_m"] or 0.0) > UPRIGHT * (m["scope_max_m"] or 0.0):
        yield Row("layback", None, None, m["layback_min_m"], m["layback_max_m"], "m")


def _winch(m: dict[str, Any]) -> Iterator[Row]:
    if (m["payout_max_m"] or 0.0) - (m["payout_min_m"] or 0.0) > MOVED:
        if m["tension_std_n"] is not None:
            yield Row("pay-out", None, None, m["payout_min_m"], m["payout_max_m"], "m")
        yield Row("speed of pay-out", None, None, None, m["winch_rate_max_m_s"], "m/s")
        yield Row("power of the winch", None, None, m["winch_power_min_w"], m["winch_power_max_w"], "W")
    if m["motor_pull_max_n"]:
        yield Row("pull of the motor", None, None, None, m["motor_pull_max_n"], "N")


def _bodies(m: dict[str, Any]) -> Iterator[Row]:
    for name, body in list(m.get("bodies", {}).items())[:BODIES]:
        yield Row(f"depth of {name}", body["depth_m"], body["depth_std_m"], unit="m")
        if body.get("pitch_std_deg"):
            yield Row(f"pitch of {name}, nose up", body["pitch_mean_deg"], body["pitch_std_deg"], unit="deg")


def _beside(m: dict[str, Any]) -> Iterator[Row]:
    if m.get("departure_angle_deg") is not None:
        yield Row("departure angle", m["departure_angle_deg"], unit="deg")
    yield Row("resultant on the sheave", m["contact_resultant_mean_n"], None, None, m["contact_resultant_max_n"], "N")
    if m["strum_amplification"] is not None:
        yield Row("drag factor of strumming", m["strum_amplification"])
    if m["ellipsoid_volume_m3"]:
        yield Row("towbody, 95 % ellipsoid", m["ellipsoid_volume_m3"], unit="m^3")


def _unusual(m: dict[str, Any]) -> Iterator[Row]:
    """One row for what held the winch, one for ticks that were missed; flags beyond their bound are in the verdict."""
    held = [f"{name} {share:.2g}" for name, _ in WINCH_LIMITS if (share := m[f"winch_{name}_share"])]
    held += [f"motor_limited {m['motor_limited_share']:.2g}"] if m["motor_limited_share"] else []
    held += [f"drum_end {m['drum_end_s']:.3g} s"] if m["drum_end_s"] else []
    held += [f"brake_slip {m['brake_slip_m']:.3g} m"] if m["brake_slip_m"] else []
    if held:
        yield Row("winch held, share of the run", ", ".join(held), unusual=True)
    if m["missed_ticks"]:
        yield Row("missed ticks", m["missed_ticks"], unusual=True)


def _pace(m: dict[str, Any]) -> Iterator[Row]:
    if m["realtime_factor"] is not None:
        yield Row("simulated over wall time", m["realtime_factor"])
    if m["latency_p99_ms"] is not None:
        yield Row("IMU stamp to tension, 99 %", m["latency_p99_ms"], unit="ms")


def short_table(metrics: dict[str, Any], title: str) -> Table:
    """The rows as a `rich` table."""
    from rich.table import Table

    table = Table(title=title, title_justify="left", caption="--all: every figure", caption_justify="left")
    table.add_column("")
    for name in ("mean", "std", "least", "largest"):
        table.add_column(name, justify="right", overflow="fold")
    table.add_column("unit")
    for row in rows(metrics):
        table.add_row(f"! {row.what}" if row.unusual else row.what, *map(_text, row[1:5]), row.unit)
    return table


def _text(value: Any) -> str:
    if value is None or isinstance(value, str):
        return value or ""
    return format_value(value)
