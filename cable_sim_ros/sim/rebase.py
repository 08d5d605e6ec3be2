"""A running tow taken to another clock and place, after a jump of the clock of its motion."""

from __future__ import annotations

from math import degrees, hypot, pi, remainder

import numpy as np

from ..physics.flaps import NEVER
from ..physics.sensor_models import FIX
from ..physics.ship import NO_EPOCH

MAX_MOVED, MOVED_SPEED = 10.0, 1.0  # m, m/s: a ship taken further, or faster on the mean, drags its tow along
MAX_TURN = 30.0  # deg; a ship turned further within ship.start_blend sweeps its stern faster than one can turn


def place(memory: np.record) -> tuple[float, float]:
    """x y of base_link in odom [m], of a state's present memory or that of a snapshot()."""
    since = (memory.time.now - memory.time.start) * 1e-9
    x, y = memory.frame.origin + memory.frame.velocity * since + memory.ship.motion.coord[:2]
    return float(x), float(y)


def heading_problem(memory: np.record, heading: float | None) -> str:
    """ "" or why the tow of a memory cannot be taken to motion of another heading [rad]; None: it has none."""
    there = float(memory.ship.motion.coord[5])
    turned = 0.0 if heading is None else degrees(remainder(heading - there, 2.0 * pi))
    if abs(turned) <= MAX_TURN:
        return ""
    return (
        f"the ship heads {degrees(there) % 360.0:.0f} deg in the state and {degrees(there) % 360.0 + turned:.0f} deg "
        f"in the motion: the tow would be swept round by {abs(turned):.0f} deg, more than {MAX_TURN:g} deg"
    )


def start_problem(memory: np.record, yaw: float, at: tuple[float, ...], blend: float) -> str:
    """ "" or why a tow that has been started cannot take up motion; yaw [rad] and at [m, x y]: of its first sample,
    which is taken up over blend [s]."""
    began, turned = memory.ship.mean_coord[5], degrees(remainder(yaw - memory.ship.mean_coord[5], 2.0 * pi))
    if abs(turned) > MAX_TURN:
        return (
            f"the tow was started heading {degrees(began) % 360.0:.0f} deg, and its first motion heads "
            f"{degrees(yaw) % 360.0:.0f} deg: it would be swept round by {abs(turned):.0f} deg, more than "
            f"{MAX_TURN:g} deg. Nothing was pushed. Begin with start(heading={yaw:.4g}) [rad], or set ship.heading_deg"
        )
    x, y = place(memory)
    far, maximum = hypot(at[0] - x, at[1] - y), max(MAX_MOVED, MOVED_SPEED * blend)
    if far <= maximum:
        return ""
    return (
        f"the tow was started at x, y = {x:.1f}, {y:.1f} m, and its first motion is {far:.0f} m away, more than "
        f"{maximum:g} m: it would be dragged there within ship.start_blend = {blend:g} s. Nothing was pushed. Begin "
        f"with start(position=({at[0]:.6g}, {at[1]:.6g}))"
    )


def carried_over(saved: dict, time_ns: int, position: tuple[float, float]) -> dict:
    """A snapshot() on another clock and with the ship elsewhere, the cable hanging from it as it did.

    The water is the same everywhere, so moving the tow frame moves everything. The motion so far is gone from the ring:
    it stands in the blend, as an offset from the mean track.
    """
    memory = saved["memory"].copy()
    time, frame, ship, events = memory.time, memory.frame, memory.ship, memory.events
    since, later = (time.now - time.start) * 1e-9, time_ns - time.now
    moved = position - (frame.origin + frame.velocity * since + ship.motion.coord[:2])
    frame.origin += moved
    time.now += later
    time.start += later
    if events.pressed_since >= 0:
        events.pressed_since += later
    for craft in (ship, memory.vehicle):
        craft.blend_at = time_ns
        craft.epoch = NO_EPOCH
        craft.offset[:] = craft.motion.coord - craft.mean_coord
        craft.offset_rate[:] = craft.motion.rate
        craft.blend_length = 1.0  # any: the first tick takes the offset whole
    for fault in (memory.winch.fault, memory.winch.drive_fault):
        fault.since += later
    attitude = saved["attitude"].copy()
    attitude["since"][attitude["since"] != NEVER] += later
    attitude["fault"]["since"] += later
    attitude["heard"] = NEVER  # the rows of flaps so far are gone too
    sensed, truth = saved["sensors_sensed"].copy(), saved["sensors_truth"].copy()
    sensed["fault"]["since"] += later
    if len(sensed):  # fixes are in odom
        truth[:, FIX : FIX + 2] += moved
        for name in ("shown", "filtered"):
            sensed[name][FIX : FIX + 2] += moved
        sensed["fault"]["at"][FIX : FIX + 2] += moved
    taken = {"sensors_sensed": sensed, "sensors_truth": truth, "attitude": attitude, "step_attitude": attitude}
    return saved | {"memory": memory, "step_memory": memory} | taken
