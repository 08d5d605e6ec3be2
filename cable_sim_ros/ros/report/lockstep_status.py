"""Task `lockstep` of /diagnostics, and the same figures for the statistics file."""

from __future__ import annotations

import math
from typing import Any

from ...io.motion.time_sequencer import CONFIRM
from ..parts import ERROR, OK, WARN, Status, text_of
from ..stepped import SECOND, SteppedSession


def lockstep_metrics(session: SteppedSession) -> dict[str, Any]:
    """What lockstep did so far; times in s, periods and slacks of simulated time."""
    steps = session.steps
    metrics = {
        "doing": _doing(session),
        "step": steps.steps,
        "steps_left": steps.steps_left,
        "clock_s": steps.clock / SECOND,
        "rate": session.rate,
        "rate_wanted": steps.settings.rate,
        "motion_spoke": session.spoken,
        "controller_spoke": steps.commands.received_count + steps.flaps.received_count > 0,
        "commands_missed": steps.commands.missed + steps.flaps.missed,
        "commands_missed_in_row": max(steps.commands.in_row, steps.flaps.in_row),
        "commands_late": steps.late,
        "commands_early": steps.early,
        "commands_unstamped": steps.unstamped,
        "motion_held": steps.gate.held,
    }
    senders = [("command", steps.commands), ("flaps", steps.flaps)] if steps.flaps.received_count else []
    for name, cadence in (*(senders or [("command", steps.commands)]), *steps.gate.cadence.items()):
        metrics[f"{name}_period_s"] = _seconds(cadence.period)
        metrics[f"{name}_slack_s"] = _seconds(cadence.slack)
    for kind, cadence in steps.gate.cadence.items():
        metrics[f"{kind}_missed"] = cadence.missed
    metrics |= {f"refused: {cause}": count for cause, count in _refused(session).items()}
    return metrics


def lockstep_status(session: SteppedSession) -> Status:
    """ERROR while held, with a silent controller or motion off the clock; WARN while a topic of motion is silent."""
    steps = session.steps
    values = {key: _text(value) for key, value in lockstep_metrics(session).items()}
    if steps.held:
        return Status("lockstep", ERROR, f"held: {steps.held}", values)
    for sender, whose in ((steps.commands, ""), (steps.flaps, " of the flaps")):
        if sender.silent:
            return Status(
                "lockstep",
                ERROR,
                f"the controller{whose} is silent: {sender.in_row} commands missed in a row, each waited for "
                f"lockstep.wait = {steps.settings.wait:g} s; the last one acts, and no step waits until it speaks",
                values,
            )
    if steps.gate.refused_in_row >= CONFIRM:
        text = (
            f"the newest {steps.gate.refused_in_row} stamps of the motion are more than 1 s behind /clock: refused; "
            f"let the sensors use /clock, or call ~/reset, which takes /clock to their next stamp"
        )
        return Status("lockstep", ERROR, text, values)
    silent = [kind for kind, cadence in steps.gate.cadence.items() if cadence.silent]
    if silent:
        text = f"no {' and no '.join(silent)} any more: no step waits for it until it speaks"
        return Status("lockstep", WARN, text, values)
    if steps.commands.in_row or steps.flaps.in_row or any(cadence.in_row for cadence in steps.gate.cadence.values()):
        return Status("lockstep", WARN, f"{_doing(session)}; the newest that was due did not come", values)
    return Status("lockstep", OK, _doing(session), values)


def _doing(session: SteppedSession) -> str:
    steps = session.steps
    if session.state == "waiting" and not (steps.held or steps.paused):
        return "waiting for first motion"
    return steps.doing if session.state in ("waiting", "running") else session.state


def _text(value: Any) -> str:
    if isinstance(value, float):
        return text_of(value)
    return str(value).lower() if isinstance(value, bool) else str(value)


def _seconds(ns: int | None) -> float:
    return math.nan if ns is None else ns / SECOND


def _refused(session: SteppedSession) -> dict[str, int]:
    commands = getattr(session, "intake", None)
    counts = {} if commands is None else commands.commands.refused
    return {cause: count for cause, count in sorted(counts.items()) if cause.startswith("step_")}
