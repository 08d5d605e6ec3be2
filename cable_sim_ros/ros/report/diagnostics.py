"""What the node says of itself: one Status a task, once a second and when a level changes, and the final figures.

No rclpy here; the node turns a Status into a diagnostic_msgs/DiagnosticStatus.
"""

from __future__ import annotations

import math
import time
from collections import Counter, deque
from collections.abc import Mapping
from math import isnan
from typing import Any

from ...compiler.packaged import packaged
from ...io.messages.messages import CAUSES, Command
from ...physics.tick_output import Flag, Source
from ...sim.checks.deviation_checks import hauled_into_waves
from ...sim.checks.friction_checks import in_part
from ...sim.drive_mode import mode_in_force
from ...sim.flag_rules import OK as OK_RUN
from ...sim.flag_rules import RULES
from ...sim.rules.latch import said
from ...sim.verdict import Verdict, check, judge_counts, of_node, overload, verdict_of
from ..overload import Rate
from ..parts import ERROR, OK, WARN, Status
from ..parts import text_of as _text
from ..publisher import RuleKeeper, TickPublisher
from ..session import NO_POSE, Session
from ..stepped import SteppedSession
from .health import InputHealth, lockstep_metrics, lockstep_status

LAST_SECOND = 1_050_000_000  # ns
BLENDED_OVER = 10_050_000_000  # ns
MIXTURE = 0.5  # of the ticks blended, from which on it is said: one late sample blends two seconds of ten
LAGGING = 0.1  # s behind the motion that are worth a warning: longer than the steps a controller acts in
UNMOVED = "tension", "brake", "emergency_stop"  # modes in which commands do not move the drum
ARRIVED = 0.1  # m; a winch this near to its length is there
NEWEST = 1000  # ticks the percentiles of /diagnostics look back
# those that make a run doubtful first
ALARMS = tuple(Flag[rule.flag] for rule in sorted(RULES, key=lambda rule: rule.state == OK_RUN) if rule.alarm)


def first(name: str, values: dict[str, str], *cases: tuple[int, Any]) -> Status:
    """The Status of the first case, level and sentence, that has a sentence."""
    level, said = next(case for case in cases if case[1])
    return Status(name, level, said, values)


def rule_status(keeper: RuleKeeper) -> Status:
    """A warning from the first break on, for as long as the node lives."""
    report = keeper.report()
    values = {"set": report["set"], "watched_s": _text(report["duration_s"])}
    for row in report["rules"]:
        name = row["rule"]
        values[f"{name}: worst"] = "none" if row["worst"] is None else f"{row['worst']:.6g}"
        values[f"{name}: {row['sense']}"] = f"{row['limit']:.6g}"
        if row["broken"]:
            values |= {
                f"{name}: worst_s": _text(row["worst_s"]),
                f"{name}: first_s": _text(row["first_s"]),
                f"{name}: first_ns": str(row["first_ns"]),
                f"{name}: seconds": _text(row["seconds"]),
                f"{name}: times": str(row["times"]),
            }
    values |= {f"not watched: {row['rule']}": row["why"] for row in report["not_watched"]}
    broken = [said(row) for row in report["rules"] if row["broken"]]
    if broken:
        return Status("rules", WARN, "; ".join(broken), values)
    return Status("rules", OK, f"{len(report['rules'])} rules kept", values)


class Watch:
    """Makes the statuses. One caller; keeps what the call before saw, for rates and for what is new."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.inputs = InputHealth(session)
        self.neighbours: list[str] = []  # what the node found out about others on its topics
        self.commanders = self.nodes = 0  # publishers of commands that it is connected to; nodes it knows
        self._rates = {"tick": Rate(), "imu": Rate(), "odometry": Rate()}
        self._seen: dict[str, deque[tuple[int, int]]] = {}

    def levels(self, publisher: TickPublisher | None, now: int) -> tuple:
        """What is published at once when it changes: states of the inputs, of the loop, of the neighbours, a
        rule that is broken."""
        frame = publisher.latest if publisher else None
        self.inputs.look(now, frame)
        stale = 0 if frame is None else int(frame["status"]) & (Flag.MOTION_STALE | Flag.COMMAND_STALE)
        pace = self.session.pace
        stepped = self.session if isinstance(self.session, SteppedSession) else None
        came = (at is not None for at in self.session.arrivals.values())
        doing = (lockstep_status(stepped).level, stepped.spoken, *came) if stepped else OK
        others = (self.commanders, self.nodes, *self.neighbours)
        broken = publisher.rules.broken if publisher is not None and publisher.rules is not None else ()
        return (self.session.shown_state, doing, *self.inputs.levels(), stale, pace.stops, others, broken)

    def statuses(self, publisher: TickPublisher | None, recorder_stats, recording: bool) -> list[Status]:
        """All tasks; publisher: None while there is no loop; recorder_stats: RecorderStats or None."""
        now = self.session.now()
        result = [
            self._loop(publisher, now),
            self.inputs.status(),
            self._motion(publisher, now),
            self._command(publisher, now),
            self._solver(publisher),
            self._recorder(recorder_stats, recording),
            self._neighbours(),
        ]
        if isinstance(self.session, SteppedSession):
            result.append(lockstep_status(self.session))
        if self.session.driven:
            result.append(vehicle_status(self.session, publisher.latest if publisher else None, now))
        if publisher is not None and publisher.rules is not None:
            result.append(rule_status(publisher.rules))
        return result

    def _new(self, key: str, count: int, over: int = LAST_SECOND) -> int:
        """How much a counter grew in the last second, or in so many ns."""
        now = time.monotonic_ns()
        seen = self._seen.setdefault(key, deque([(now, 0)]))
        seen.append((now, count))
        while len(seen) > 2 and now - seen[1][0] >= over:
            seen.popleft()
        return count - seen[0][1]

    def _neighbours(self) -> Status:
        values = {str(k + 1): problem for k, problem in enumerate(self.neighbours)} | {"nodes": str(self.nodes)}
        if self.neighbours:
            return Status("neighbours", WARN, "; ".join(self.neighbours), values)
        return Status("neighbours", OK, "nobody else publishes on our topics", values)

    def _loop(self, publisher: TickPublisher | None, now: int) -> Status:
        session = self.session
        if session.loop is None or publisher is None:
            return Status("loop", WARN, session.state, {"state": session.state})
        pace = session.pace
        loop, counters = session.loop, session.counters()
        rate = self._rates["tick"].of(loop.count, time.monotonic_ns())
        times = publisher.lateness.named("lateness", 50, 99, 100, newest=NEWEST)
        times |= publisher.work.named("work", 50, 99, newest=NEWEST)
        times |= publisher.latency.named("latency", 50, 99, newest=NEWEST)
        values = {
            "state": session.shown_state,
            "rate_hz": _text(rate),
            **{key: _text(value) for key, value in times.items()},
            "lag_ms": _text(session.lag() * 1e3),
            "real_time_factor": _text(pace.factor),
            "scheduler": loop.scheduler,
            "kernels": packaged.told(),
            "publisher_skipped": str(publisher.skipped),
            **{key: str(value) for key, value in counters.items()},
        }
        if session.state in ("halted", "failed"):
            return Status("loop", ERROR, session.problem, values)
        if publisher.failure is not None or not publisher.is_alive():
            return Status("loop", ERROR, f"the publisher thread ended: {publisher.failure}", values)
        resyncs, overruns = self._new("resyncs", counters["resyncs"]), self._new("overruns", counters["overruns"])
        lag, busy = session.lag(), "the machine is too slow or too busy for this scene"
        worked_off = f"worked off in {lag / 0.02:.0f} s"
        return first(
            "loop",
            values,
            (ERROR, pace.overloaded and pace.text()),
            (WARN, pace.stop_text(now)),
            (WARN, resyncs and f"resynchronised {resyncs} time{'s' * (resyncs > 1)} in the last second: {busy}"),
            (WARN, overruns and f"{overruns} ticks overran in the last second"),
            (WARN, lag > LAGGING and f"{lag:.2f} s behind the motion after a hold-up, {worked_off}"),
            (OK, session.state),
        )

    def _motion(self, publisher: TickPublisher | None, now: int) -> Status:
        session, values = self.session, dict[str, str]()
        for kind, arrival in session.arrivals.items():
            values[f"{kind}_received_hz"] = _text(self._rates[kind].of(session.received[kind], now))
            values[f"{kind}_received_age_s"] = "never" if arrival is None else _text((now - arrival) * 1e-9)
        report: dict = {}
        if getattr(session, "intake", None) is not None:
            report = session.intake.ingest.report(now + session.wall)
            values |= {key: _text(value) if isinstance(value, float) else str(value) for key, value in report.items()}
        drops = drop_counts(session)
        for cause, count in sorted(drops.items()):
            values[f"dropped: {cause}"] = str(count)
        new = {cause: n for cause, count in drops.items() if (n := self._new(f"dropped {cause}", count))}
        hint = str(report.get("hint", ""))
        doubted = {"none"} != {report.get(f"{kind}_doubt", "none") for kind in ("imu", "odometry")}
        values["clock_jumps"] = str(session.clock.jumps)
        frame = publisher.latest if publisher else None
        blended = math.nan
        if frame is not None:
            counts = list(publisher.statuses.items()) if publisher else []
            ticks = self._new("ticks", sum(n for _, n in counts), BLENDED_OVER)
            mixed = self._new("blended", sum(n for status, n in counts if status & Flag.MOTION_BLENDING), BLENDED_OVER)
            blended = mixed / ticks if ticks else math.nan
            values["blended_percent"] = _text(100.0 * blended)
            values["sample_age_ms"] = _text(session.distance.needed * 1e-6)
            values["input_delay_ms"] = _text(session.distance.delay * 1e-6)
            values["source_of_tick"] = str(Source(int(frame["motion_source"])).name).lower()
            values["motion_age_s"] = _text(float(frame["motion_age"]))
        doubt, running, gone = f"; {hint}" if doubted else "", session.state == "running", ""
        if running and frame is not None and int(frame["status"]) & Flag.MOTION_STALE:
            gone = f"nothing usable for {float(frame['motion_age']):.1f} s, the ship returns to its mean track"
        why = "; ".join(f"{cause}: {CAUSES[cause]}" for cause in new)
        settling = report.get("source") == "imu" and not report.get("heave_valid")
        settles = settling and f"settling for {report['heave_age_s']:.0f} s: heave of the IMU is not yet valid"
        return first(
            "motion",
            values,
            (WARN, session.state == "waiting" and f"waiting for motion{doubt}"),
            (ERROR, gone and f"motion stale: {gone}{doubt}"),
            (WARN, doubted and hint),
            (WARN, new and f"{_refused(sum(new.values()), 'message')}; {why}"),
            (WARN, hint),
            (WARN, settles and f"heave filter {settles}"),
            (WARN, self._mixture(blended)),
            (OK, "motion arrives" if running else session.state),
        )

    def _mixture(self, blended: float) -> str:
        """ "" or that the tow cannot follow the motion as it comes; blended: fraction of the last ticks."""
        session, far = self.session, self.session.distance
        said = far.text() if far.delay - far.least > LAGGING * 1e9 else ""
        since = 0 if session.loop is None else session.loop.count - session.first_tick
        if blended > MIXTURE and since * session.scene.solver.tick > session.scene.ship.start_blend + 10.0:
            said += f"; {100.0 * blended:.0f} % of the last ticks mix late or changed motion into that of the ship"
        return said.removeprefix("; ")

    def _command(self, publisher: TickPublisher | None, now: int) -> Status:
        if getattr(self.session, "intake", None) is None:
            return Status("command", OK, "not yet listening", {})
        commands = self.session.intake.commands
        frame = publisher.latest if publisher else None
        payout = math.nan if frame is None else float(frame["payout"])
        flags = 0 if frame is None else int(frame["status"])
        out, back = commands.travel(payout)
        mode = "-" if frame is None else mode_in_force(frame, commands.last, self.session.scene.setpoint.algorithm)
        values = {
            "accepted": str(commands.accepted),
            "flaps": str(commands.flaps_accepted),
            "no_command": str(commands.no_command),
            "publishers": str(self.commanders),
            "newest": _commanded(commands.last),
            "age_s": "never" if commands.last_arrival is None else _text((now - commands.last_arrival) * 1e-9),
            "mode": mode,
            "stale": str(bool(flags & Flag.COMMAND_STALE)).lower(),
            "lag_ms": _text(commands.lag * 1e3),
            "lag_largest_ms": _text(commands.largest_lag * 1e3),
            "lag_clock": commands.lag_clock or "-",
            "data_clock_lead_ms": _text(self.session.distance.delay * 1e-6),
            "delay_ms": _text(self.session.scene.winch.command_delay * 1e3),
            "remaining_out_m": _text(out),
            "remaining_in_m": _text(back),
            **{f"clamped: {what}": str(count) for what, count in sorted(commands.clamped.items())},
            **{f"refused: {cause}": str(count) for cause, count in sorted(commands.refused.items())},
        }
        refused = self._new("command drops", sum(commands.refused.values()))
        clamped = self._new("command clamps", sum(commands.clamped.values()))
        empty = self._new("no command", commands.no_command)
        nothing = (
            f"; messages without a command in the last second: {empty}, is the controller active?" if empty else ""
        )
        left = f"{out:.2f} m can be paid out and {back:.2f} m hauled in"
        if flags & Flag.COMMAND_STALE and commands.last is not None:
            does = "brakes and holds" if isnan(commands.last.payout) else "goes to it and holds there"
            text = (
                f"command stale: the newest, {_commanded(commands.last)}, is older than winch.command_timeout, the "
                f"winch {does}: {payout:.2f} m out now{nothing}"
            )
        elif refused:
            text = f"{_refused(refused, 'command')}: {commands.last_refusal}"
        elif clamped:
            text = f"{commands.last_clamp}; {left}"
        elif flags & Flag.COMMAND_LIMITED:
            text = f"the newest, {_commanded(commands.last)}, asks for more than the winch can do: {left}"
        else:
            text = f"commanded: {_commanded(commands.last)}{_to_go(commands.last, payout)}; {left}"
            text = text if commands.accepted else "no command yet: the winch holds"
            if mode in UNMOVED:
                text = f"mode {mode}: commands and set-point law do not move the drum; {left}"
            return Status("command", OK, text + nothing, values)
        return Status("command", WARN, text, values)

    def _solver(self, publisher: TickPublisher | None) -> Status:
        session, values = self.session, dict[str, str]()
        frame = publisher.latest if publisher else None
        if frame is not None:
            flags = Flag(int(frame["status"]))
            values = {
                "iterations": str(int(frame["iterations"])),
                "substeps": str(int(frame["substeps"])),
                "residual_n": f"{float(frame['residual']):.3g}",
                "flags": flag_names(flags),
                "tension_n": f"{float(frame['tension']):.1f}",
                "penetration_m": f"{float(frame['penetration']):.3g}",
                "detachments": str(int(frame["detachments"])),
            }
        if session.state in ("halted", "failed"):
            return Status("solver", ERROR, session.problem, values)
        if publisher is not None and publisher.fault:
            return Status("solver", ERROR, publisher.fault, values)
        if frame is not None:
            alarms = [flag.text for flag in ALARMS if flags & flag]
            if alarms:
                return Status("solver", WARN, "; ".join(alarms), values)
        return Status("solver", OK, "solves" if frame is not None else session.state, values)

    def _recorder(self, stats, recording: bool) -> Status:
        if stats is None:
            return Status("recorder", OK, "not recording", {})
        values = {
            "recording": str(recording).lower(),
            "written": str(stats.written),
            "dropped": str(stats.dropped),
            "waiting": str(stats.waiting),
            "max_waiting": str(stats.max_waiting),
            "errors": str(stats.errors),
            "slowest_flush_ms": _text(stats.slowest_flush * 1e3),
        }
        if stats.error:
            return Status("recorder", ERROR, stats.error, values)
        if self._new("recorder drops", stats.dropped) > 0:
            return Status("recorder", WARN, f"{stats.dropped} messages were not recorded: the disk is too slow", values)
        return Status("recorder", OK, "recording" if recording else "finished", values)


def drop_counts(session: Session) -> Counter:
    """Motion messages refused, by cause, of the clock and of the ingest."""
    drops = Counter(session.refused)
    if getattr(session, "intake", None) is not None:
        drops.update(
            {cause: count for cause, count in session.intake.ingest.counts.items() if count and CAUSES.get(cause)}
        )
    return drops


def _refused(count: int, what: str) -> str:
    return f"{count} {what}{'s' if count > 1 else ''} refused in the last second"


def _commanded(command: Command | None) -> str:
    """A command in words."""
    if command is None:
        return "none"
    if not math.isnan(command.payout):
        beside = f", not the rate {command.rate:g} m/s beside it" if abs(command.rate) > 0.0 else ""
        return f"length {command.payout:g} m{beside}"
    return f"rate {command.rate:g} m/s"


def _to_go(command: Command | None, payout: float) -> str:
    """How far the winch still has to go to a length, in words."""
    left = math.nan if command is None else command.payout - payout
    if not abs(left) > ARRIVED:
        return ""
    return f", {abs(left):.1f} m to {'pay out' if left > 0.0 else 'haul in'}"


def flag_names(flags: Flag) -> str:
    return ", ".join(str(flag.name).lower() for flag in Flag if flag and flags & flag) or "none"


def final_metrics(session: Session, publisher: TickPublisher | None, recorder_stats) -> dict:
    """Figures of the whole run (of the newest ten minutes where they are percentiles), names as in docs/json.md."""
    metrics: dict = {"state": session.state, "problem": session.problem}
    if session.loop is not None:
        counters = session.counters()
        metrics |= counters | {
            "missed_ticks": counters["overruns"] + counters["skipped"],
            "scheduler": session.loop.scheduler,
            "static_start_s": session.start_cost,
        }
        since = session.ended - session.running_since  # of the newest start
        pace = session.pace
        metrics |= {"min_real_time_factor": pace.min_factor, "overloaded_s": pace.overloaded_s}
        metrics["longest_standstill_s"] = pace.longest_stop
        if not math.isnan(since) and not session.resets + session.skips_ahead + session.clock.jumps:
            metrics["realtime_factor"] = counters["ticks"] * session.loop.period_ns * 1e-9 / max(since, 1e-3)
    if publisher is not None:
        metrics |= {"published_ticks": publisher.published, "publisher_skipped": publisher.skipped}
        metrics |= publisher.lateness.named("jitter", 50, 99, 99.9, 100)
        metrics |= publisher.work.named("work", 50, 99, 100)
        metrics |= publisher.latency.named("latency", 50, 99, 100)
    metrics["input_delay_ms"] = session.node.input_delay * 1e3
    metrics["received"] = dict(session.received)
    metrics["dropped"] = dict(drop_counts(session))
    if getattr(session, "intake", None) is not None:
        metrics["motion_refusals"] = [list(row) for row in session.intake.ingest.refusals()]
        ticks = session.loop.count if session.loop is not None else 0
        metrics["motion_s"] = ticks * session.scene.solver.tick
        metrics["commands_refused"] = dict(session.intake.commands.refused)
        metrics["commands_clamped"] = dict(session.intake.commands.clamped)
        metrics["no_commands"] = session.intake.commands.no_command
    if session.driven:
        metrics["vehicle"] = vehicle_metrics(session)
    if isinstance(session, SteppedSession):
        metrics["lockstep"] = lockstep_metrics(session)
    if publisher is not None and publisher.rules is not None:
        metrics["rules"] = publisher.rules.report()
    if recorder_stats is not None:
        metrics["recorder"] = recorder_stats._asdict()
    return metrics


def _refused_poses(session: Session) -> dict[str, int]:
    """Poses that were refused, by cause."""
    vehicle = session.intake.vehicle if getattr(session, "intake", None) is not None else None
    return {} if vehicle is None else vehicle.refusals_by_cause()


def vehicle_metrics(session: Session) -> dict[str, Any]:
    """For the final figures: poses that came, and those refused by cause."""
    return {"received": session.poses, "refused": _refused_poses(session)}


def vehicle_status(session: Session, frame: Any, now: int) -> Status:
    """Task `vehicle`; frame: the newest tick output, or None; now: on the clock of the arrivals, ns."""
    counts, arrival = _refused_poses(session), session.vehicle_arrival
    age = math.nan if arrival is None else (now - arrival) * 1e-9
    values = {"received": str(session.poses), "received_age_s": "never" if arrival is None else _text(age)}
    values |= {f"refused: {cause}": str(count) for cause, count in sorted(counts.items())}
    vehicle = session.intake.vehicle if getattr(session, "intake", None) is not None else None
    if vehicle is not None:
        report = vehicle.report(now + session.wall)
        names = {"odometry_rate_hz": "rate_hz", "samples": "samples", "last_refusal": "last_refusal"}
        values |= {mine: str(report[theirs]) for theirs, mine in names.items()}
    said = []
    if session.state != "running":
        return Status("vehicle", OK, session.state, values)
    if arrival is None:
        said.append(NO_POSE)
    elif vehicle is not None and not vehicle.inputs.motion_head[0]:
        said.append(f"poses come, but none can be used: {vehicle.last_refusal or 'they do not fit the clock'}")
    if frame is not None:
        flags = int(frame["status"])
        values |= {"off_m": _text(float(frame["vehicle_off"])), "age_s": _text(float(frame["vehicle_age"]))}
        if flags & Flag.VEHICLE_STALE:
            said.append(f"silent for {float(frame['vehicle_age']):.1f} s: it goes on at its mean speed and last depth")
        if flags & Flag.VEHICLE_LIMITED:
            off = float(frame["vehicle_off"])
            why = f"the cable's end stays {off:.2f} m behind" if off > 0.0 else "it pulls above vehicle.max_tension"
            said.append(f"limited: beyond what the cable reaches or bears, {why}")
    return Status("vehicle", WARN, "; ".join(said), values) if said else Status("vehicle", OK, "followed", values)


def verdict_of_node(session: Session, publisher: TickPublisher | None, metrics: Mapping[str, Any]) -> Verdict:
    """Verdict on a run that a node published; figures: its final ones. One that published nothing and did not fail is
    ok, unless motion came that it could not use."""
    scene, problem = session.scene, session.problem
    if publisher is None or publisher.latest is None:
        return verdict_of([check("HALTED", problem)] if problem else of_node(metrics))
    found = judge_counts(
        publisher.statuses,
        scene.solver.tick,
        int(publisher.latest["status"]),
        scene=scene,
        others=(
            *overload(scene, publisher.max_tension),
            *hauled_into_waves(scene, publisher.sums.least_scope),
            *in_part(scene, publisher.sums.slow_fraction),
            *of_node(metrics),
        ),
        problem=problem,
        slam=publisher.sums.max_slam,
    )
    known = {reason.flag for reason in found.reasons}
    return verdict_of([*found.reasons, *(more for more in publisher.sums.reasons() if more.flag not in known)])
