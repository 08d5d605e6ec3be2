"""A running tow taken to another clock and place, after a jump of the clock of its motion."""

from __future__ import annotations

from ..physics.ship import NO_EPOCH


def carried_over(saved: dict, time_ns: int, position: tuple[float, float]) -> dict:
    """A snapshot() on another clock and with the ship elsewhere, the cable hanging from it as it did.

    The water is the same everywhere, so moving the tow frame moves everything. The motion so far is gone from the ring:
    it stands in the blend, as an offset from the mean track.
    """
    memory = saved["memory"].copy()
    time, frame, ship, events = memory.time, memory.frame, memory.ship, memory.events
    since, later = (time.now - time.start) * 1e-9, time_ns - time.now
    frame.origin += position - (frame.origin + frame.velocity * since + ship.motion.coord[:2])
    time.now += later
    time.start += later
    time.blend = time_ns
    if events.pressed_since >= 0:
        events.pressed_since += later
    ship.epoch = NO_EPOCH
    ship.offset[:] = ship.motion.coord - ship.mean_coord
    ship.offset_rate[:] = ship.motion.rate
    ship.blend_length = 1.0  # any: the first tick takes the offset whole
    return saved | {"memory": memory, "step_memory": memory}
