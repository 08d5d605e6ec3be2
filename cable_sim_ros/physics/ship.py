"""Ship: pose, velocity and acceleration of any hull point. Yaw-pitch-roll as Rz Ry Rx, Westin (2018) (24)-(25).

Motion arrives as samples of position, attitude and their rates; between samples it is interpolated C1 (cubic
Hermite). Samples of one unbroken source share an epoch number. Where the epoch changes, and at the start, the ship
goes over to the new source by a C1 blend; after the newest sample it returns to its mean track, critically damped.
"""

from __future__ import annotations

from .quantity import Block, quantity


class Ship(Block):
    tow_speed: float = quantity(
        0.0, "m/s", -15.0, 15.0, "mean speed ahead through the world frame, used by the start and by IMU-only motion")
    heading_deg: float = quantity(
        0.0, "deg", -360.0, 360.0, "mean yaw at the start (ENU, from east to north), where no motion source gives it")
    reference_height: float = quantity(
        0.0, "m", -50.0, 50.0, "mean height of base_link above the water", "Westin 5: origin on the waterline")
    start_blend: float = quantity(
        10.0, "s", 0.1, 600.0, "time over which recorded motion is taken up from the static start")
    source_blend: float = quantity(2.0, "s", 0.1, 600.0, "time over which a changed motion source is taken up")
    stale_decay: float = quantity(
        3.0, "s", 0.05, 600.0, "time constant with which motion dies out after the newest sample")
    stale_after: float = quantity(0.5, "s", 0.01, 60.0, "age of the newest sample at which motion counts as stale")
    max_gap: float = quantity(
        1.5, "s", 0.02, 60.0, "a longer gap between samples begins a new epoch instead of being interpolated")
