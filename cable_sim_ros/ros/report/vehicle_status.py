"""Task `vehicle` of /diagnostics, and its final figures: what came of the pose of a vehicle at the far end."""

from __future__ import annotations

import math
from typing import Any

from ...physics.tick_output import Flag
from ..session import NO_POSE, Session
from ..status import OK, WARN, Status, text_of


def refused(session: Session) -> dict[str, int]:
    """Poses that were refused, by cause."""
    vehicle = session.intake.vehicle if getattr(session, "intake", None) is not None else None
    return {} if vehicle is None else vehicle.refusals_by_cause()


def vehicle_metrics(session: Session) -> dict[str, Any]:
    """For the final figures: poses that came, and those refused by cause."""
    return {"received": session.poses, "refused": refused(session)}


def vehicle_status(session: Session, frame: Any, now: int) -> Status:
    """Task `vehicle`; frame: the newest tick output, or None; now: on the clock of the arrivals, ns."""
    counts, arrival = refused(session), session.vehicle_arrival
    age = math.nan if arrival is None else (now - arrival) * 1e-9
    values = {"received": str(session.poses), "received_age_s": "never" if arrival is None else text_of(age)}
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
        values |= {"off_m": text_of(float(frame["vehicle_off"])), "age_s": text_of(float(frame["vehicle_age"]))}
        if flags & Flag.VEHICLE_STALE:
            said.append(f"silent for {float(frame['vehicle_age']):.1f} s: it goes on at its mean speed and last depth")
        if flags & Flag.VEHICLE_LIMITED:
            off = float(frame["vehicle_off"])
            why = f"the cable's end stays {off:.2f} m behind" if off > 0.0 else "it pulls above vehicle.max_tension"
            said.append(f"limited: beyond what the cable reaches or bears, {why}")
    return Status("vehicle", WARN, "; ".join(said), values) if said else Status("vehicle", OK, "followed", values)
