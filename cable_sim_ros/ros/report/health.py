"""Ages of the inputs, many times a second: what a controller decides by cannot wait for the next second.

Published as `sim/inputs` at the rate of the polls (20 Hz), and as task `inputs` of /diagnostics, which goes out at once
when a level changes. An input is stale when nothing of it was accepted for longer than its time-out.

Task `lockstep` of /diagnostics, and the same figures for the statistics file.
"""

from __future__ import annotations

import math
from collections import deque
from typing import Any, NamedTuple

from ...io.messages.cdr import JointTemplate
from ...io.motion.motion import TOPICS
from ...io.motion.time_sequencer import CONFIRM
from ...physics.tick_output import Flag
from ..parts import ERROR, OK, WARN, Status, text_of
from ..stepped import SECOND, SteppedSession

KINDS = ("imu", "odometry", "command")
TOPIC, MSGTYPE = "sim/inputs", "sensor_msgs/msg/JointState"
FRESH, STALE, NEVER = 0.0, 1.0, -1.0
RATE_OVER = 1_000_000_000  # ns


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
    senders = [("command", steps.commands), ("flaps", steps.flaps)] if steps.flaps.newest is not None else []
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
    senders = {"winch command": steps.commands, "flap command": steps.flaps} | steps.gate.cadence
    if late := [name for name, cadence in senders.items() if cadence.in_row]:
        text = f"{_doing(session)}; the newest {' and the newest '.join(late)} that was due did not come"
        return Status("lockstep", WARN, text, values)
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


class Age(NamedTuple):
    """One input: seconds since the newest accepted (-1: none yet), messages a second, FRESH, STALE or NEVER."""

    age: float
    rate: float
    state: float


class InputHealth:
    """Ages of the inputs of one Session. One caller."""

    def __init__(self, session) -> None:
        self.session = session
        scene, node = session.scene, session.node
        self.limits = {"imu": scene.ship.stale_after, "odometry": node.motion.odometry_timeout, "command": math.inf}
        self.ages = dict.fromkeys(KINDS, Age(-1.0, 0.0, NEVER))
        self._counts: deque[tuple[int, dict[str, int]]] = deque()
        self._template = JointTemplate(KINDS, arrays=3)

    def look(self, now: int, frame) -> dict[str, Age]:
        """Ages now [ns, `session.now`]; frame: the newest one or None, it says whether a command is stale."""
        session = self.session
        intake = getattr(session, "intake", None)
        report = {} if intake is None else intake.ingest.report(now + session.wall)
        commands = None if intake is None else intake.commands
        ages = {kind: float(report.get(f"{kind}_age_s", math.nan)) for kind in ("imu", "odometry")}
        last = commands.last_arrival if commands is not None else None
        ages["command"] = math.nan if last is None else (now - last) * 1e-9
        rates = self._rates(now, commands)
        for kind, age in ages.items():
            stale = age > self.limits[kind]
            if kind == "command" and frame is not None:
                stale = bool(int(frame["status"]) & Flag.COMMAND_STALE)
            state = NEVER if math.isnan(age) else STALE if stale else FRESH
            self.ages[kind] = Age(-1.0 if math.isnan(age) else age, rates[kind], state)
        return self.ages

    def _rates(self, now: int, commands) -> dict[str, float]:
        counts = dict(self.session.received) | {"command": commands.accepted if commands is not None else 0}
        self._counts.append((now, counts))
        while len(self._counts) > 2 and now - self._counts[1][0] >= RATE_OVER:
            self._counts.popleft()
        then, before = self._counts[0]
        span = max((now - then) * 1e-9, 1e-3)
        return {kind: (counts[kind] - before[kind]) / span for kind in KINDS}

    def message(self) -> bytes:
        """`sim/inputs` as CDR bytes, stamped with the wall clock, in lockstep with /clock."""
        columns = zip(*(self.ages[kind] for kind in KINDS))
        return self._template.write(self.session.log_time(), *(number for column in columns for number in column))

    def status(self) -> Status:
        """Task `inputs` of /diagnostics."""
        values = {}
        for kind, (age, rate, state) in self.ages.items():
            values[f"{kind}_age_s"] = "never" if state == NEVER else text_of(age)
            values[f"{kind}_rate_hz"] = text_of(rate)
            values[f"{kind}_stale"] = str(state == STALE).lower()
        if self.session.state != "running":
            return Status("inputs", OK, self.session.state, values)
        silent = {kind: self.ages[kind].age for kind in KINDS if self.ages[kind].state == STALE}
        fresh = [kind for kind in ("imu", "odometry") if self.ages[kind].state == FRESH]
        refused = self._refused()
        said = [f"{kind} silent for {age:.1f} s" for kind, age in silent.items() if kind not in refused]
        said += [f"{kind} comes but is refused: {why}" for kind, why in refused.items()]
        if not fresh:
            said.append("no motion is known: the ship returns to its mean track")
            return Status("inputs", ERROR, "; ".join(said), values)
        if "odometry" in silent:
            said.append("the IMU alone gives the motion")
        if said:
            return Status("inputs", WARN, "; ".join(said), values)
        return Status("inputs", OK, "fresh", values)

    def _refused(self) -> dict[str, str]:
        """Why motion that comes is not used, by kind."""
        if getattr(self.session, "intake", None) is None:
            return {}
        refused = self.session.intake.ingest.refused
        coming = [kind for kind in TOPICS if self.ages[kind].state != FRESH and self.ages[kind].rate > 0.0]
        return {kind: why for kind in coming if (why := refused.why(kind))}

    def levels(self) -> tuple:
        """What must be published at once when it changes."""
        return tuple(self.ages[kind].state for kind in KINDS)
