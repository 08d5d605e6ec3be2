"""Motion of the vehicle at the far end of the cable: nav_msgs/Odometry or geometry_msgs/PoseStamped -> samples.

By the checks of the ship's odometry (motion.py), but for what is of a ship: its height is any, and where its position
jumps the vehicle is there, so that nothing is anchored. A jump is taken up at ``vehicle.max_speed`` (physics/ship.py).
"""

from __future__ import annotations

from math import hypot, sqrt

from ...physics.heave_filter import Convention, Heave, MotionInput
from ...physics.inputs import Inputs, of_vehicle
from ...physics.ship import Ship
from ...physics.tick_output import Source
from ...physics.vehicle import Vehicle
from ...sim.inputs import JUMP_FREE, MAX_POSITION
from ..messages.messages import CAUSES, VEHICLES, Odometry, Refused
from .motion import MotionIngest

TOPIC = "vehicle/odom"


class VehicleIngest(MotionIngest):
    """See MotionIngest; `take` alone is called. frames: names of the world and of the vehicle."""

    def __init__(
        self,
        inputs: Inputs,
        vehicle: Vehicle,
        convention: Convention = Convention.ENU,
        frames: tuple[str, str] = ("odom", "vehicle_link"),
    ) -> None:
        self.vehicle, self.kind = vehicle, "vehicle"
        # no height, and no step of it, is too much for a vehicle
        settings = MotionInput(convention=convention).model_copy(update={"max_height_offset": MAX_POSITION})
        heave = Heave().model_copy(update={"max_displacement": MAX_POSITION})
        super().__init__(of_vehicle(inputs), Ship(max_gap=vehicle.max_gap), heave, settings, frames=frames)

    def take(self, kind: str, data: bytes, arrival: int) -> int | None:
        """Take a message of a kind of VEHICLES; see MotionIngest."""
        self.kind = kind
        return self.odometry(data, arrival)

    def decoded(self, data: bytes) -> Odometry:
        message: Odometry = VEHICLES[self.kind](data, self.settings.convention)
        if sqrt(sum(v * v for v in message.velocity)) > self.vehicle.max_speed:
            raise Refused("too_fast")
        return message

    def refusals_by_cause(self) -> dict[str, int]:
        """Poses that were refused, by cause."""
        return {cause: count for cause, count in self.counts.items() if count and CAUSES.get(cause)}

    def _notice(self, text: str) -> None:
        super()._notice(f"{TOPIC}{text.removeprefix('odom')}" if text.startswith("odom") else text)

    def _refuse(self, topic: str, cause: str) -> None:
        super()._refuse(topic, cause)
        self.last_refusal = self.last_refusal.replace("odometry", TOPIC, 1)

    def _anchored(self, message: Odometry, dt: float) -> Odometry:
        if self.source == Source.ODOMETRY and self._before is not None:
            far = [b - a for a, b in zip(self._before.position, message.position)]
            if hypot(*far) > self.vehicle.max_speed * dt + JUMP_FREE:
                self.counts["position_jump"] += 1
                self._new_epoch = True
                self._waiting.clear()
        return message

    def _push_odometry(self, message: Odometry, dt: float) -> None:
        if not message.twist and self._last is None:  # its place is wanted for the start, its rates come with the next
            self._push(message.stamp, [*message.position, *message.angles, *[0.0] * 6], measured=False)
        super()._push_odometry(message, dt)

    def _push(self, stamp: int, row: list[float], measured: bool = True) -> None:
        if self._last is None or stamp != self._last[0]:
            super()._push(stamp, row, measured)
