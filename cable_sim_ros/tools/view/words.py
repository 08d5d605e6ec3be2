"""Alarms, verdict and figures of a moment in words; colours of the page."""

from __future__ import annotations

from html import escape

import numpy as np

from ...physics.tick_output import Flag
from ...sim.flag_rules import DOUBTFUL, FAILED, OK, RULES
from ...sim.verdict import Verdict

RULE = {rule.flag: rule for rule in RULES}
GREEN, AMBER, RED, GREY = "#1f7a4d", "#b45f06", "#b3261e", "#5f6b76"
OF_STATE = {OK: GREEN, DOUBTFUL: AMBER, FAILED: RED}


def alarms(status: int) -> list[tuple[str, str, str]]:
    """(flag, what it says, colour) of each flag set in a status word, the worst first."""
    found = []
    for flag in Flag:
        if flag and status & flag:
            rule = RULE.get(flag.name or "")
            state = rule.state if rule else OK
            alarm = rule is not None and rule.alarm
            rank = 0 if state == FAILED else 1 if alarm and state == DOUBTFUL else 2 if alarm else 3
            colour = RED if state == FAILED else AMBER if alarm else GREY
            found.append((rank, flag.name or "", flag.text, colour))
    return [(name, text, colour) for _, name, text, colour in sorted(found)]


def force(newton: float) -> str:
    """A force as it is read: N below one kN."""
    return f"{newton / 1e3:.2f} kN" if abs(newton) >= 1e3 else f"{newton:.1f} N"


def figures(frame) -> list[tuple[str, str]]:
    """Name and value of what is read off first."""
    speed = float(np.hypot(*frame["ship_velocity"][:2]))
    return [
        ("tension, sheave", force(float(frame["tension"]))),
        ("tension, drum", force(float(frame["tension_drum"]))),
        ("pay-out", f"{float(frame['payout']):.2f} m"),
        ("pay-out rate", f"{float(frame['payout_rate']):+.2f} m/s"),
        ("towbody depth", f"{-float(frame['body_position'][2]):.1f} m"),
        ("layback", f"{float(frame['layback']):.1f} m"),
        ("departure angle", f"{np.degrees(float(frame['departure_angle'])):.1f}°"),
        ("wrap angle", f"{np.degrees(float(frame['wrap_angle'])):.0f}°"),
        ("ship's speed", f"{speed:.2f} m/s"),
        ("sheave height", f"{float(frame['sheave_position'][2]):+.2f} m"),
    ]


def pill(text: str, colour: str) -> str:
    """A word on a coloured ground."""
    return (
        f'<span style="background:{colour};color:#fff;border-radius:4px;padding:2px 8px;font-weight:700">'
        f"{escape(text)}</span>"
    )


def verdict_html(verdict: Verdict, of: str) -> str:
    """State and each reason in a sentence."""
    rows = "".join(f'<div style="margin-top:3px">{escape(str(reason))}</div>' for reason in verdict.reasons)
    return f"<div>{escape(of)} {pill(verdict.state, OF_STATE.get(verdict.state, GREY))}{rows}</div>"


def alarms_html(status: int) -> str:
    """Flags of this moment; a line that says so where there is none."""
    rows = [
        f'<div style="margin-top:3px"><b style="color:{colour}">{escape(name)}</b> {escape(text)}</div>'
        for name, text, colour in alarms(status)
    ]
    return "<div>alarms now: " + ("none</div>" if not rows else "</div>" + "".join(rows))


def figures_html(frame) -> str:
    """`figures`, two in a row."""
    cells = "".join(
        f'<div style="display:flex;justify-content:space-between"><span style="opacity:.7">{escape(name)}</span>'
        f'<b style="font-variant-numeric:tabular-nums">{escape(value)}</b></div>'
        for name, value in figures(frame)
    )
    return f'<div style="display:grid;grid-template-columns:1fr 1fr;gap:1px 18px;font-size:13px">{cells}</div>'
