"""Messages in the order in which they arrive: one rule for the stamps, live and from a bag.

Motion goes through the clock of its stamps (`clock.py`) into the ingest of motion; commands are put on that clock by
their arrival. What is dropped on the way is counted by cause, in the words of `messages.CAUSES`.
"""

from __future__ import annotations

from collections import Counter
from enum import Enum

import numpy as np

from ...physics.heave_filter import Heave, MotionInput
from ...physics.inputs import MOTION_ROWS, Inputs
from ...physics.towbody import BodyModel
from ...sim.scene import Scene
from ...sim.tables.rigid_tables import flaps_of
from ..messages.commands import CommandIngest
from ..messages.messages import CAUSES, Event
from .clock import DataClock, Stamp
from .motion import MotionIngest
from .vehicle import TOPIC, VehicleIngest


class Took(Enum):
    """What became of a message of motion."""

    NOTHING = "nothing"  # no new sample: refused, or waiting for the next one
    SAMPLE = "sample"
    JUMPED = "jumped"  # the clock of the stamps has jumped: call `Intake.jump`


class Intake:
    """Writes the rings of inputs; one writer: call it from one thread.

    wall: ns to add to an arrival to have the time of day, for messages without a stamp; drum: the DRUM record, for
    commands beyond the winch; frames: names of world and ship in the messages. `refused` counts motion that did not
    come as far as the ingest.
    """

    def __init__(
        self,
        inputs: Inputs,
        scene: Scene,
        motion: MotionInput | None = None,
        heave: Heave | None = None,
        clock: DataClock | None = None,
        wall: int = 0,
        drum: np.record | None = None,
        frames: tuple[str, str] = ("odom", "base_link"),
        vehicle_frame: str = "vehicle_link",
    ) -> None:
        self.inputs, self.wall = inputs, wall
        self.clock = clock or DataClock()
        self.ingest = MotionIngest(inputs, scene.ship, heave or Heave(), motion, scene.gravity, frames)
        self.commands = CommandIngest(inputs, drum, wall, flaps_of(scene))
        self.vehicle: VehicleIngest | None = None
        if scene.towbody.model is BodyModel.VEHICLE:
            convention = self.ingest.settings.convention
            self.vehicle = VehicleIngest(inputs, scene.vehicle, convention, (frames[0], vehicle_frame))
        self.refused: Counter[str] = Counter()

    def motion(self, event: Event) -> Took:
        """One message of kind "imu" or "odometry"."""
        stamp, arrival, kind, data = event
        if stamp is None:
            self.refused["size"] += 1
            return Took.NOTHING
        if stamp:
            judged = self.clock.judge(stamp, arrival)
            if judged is not Stamp.FITS:
                self.refused["stamp_off_clock"] += 1
                return Took.JUMPED if judged is Stamp.JUMPED else Took.NOTHING
        before = int(self.inputs.motion_head[0])
        self.ingest.take(kind, data, arrival + self.wall)
        if int(self.inputs.motion_head[0]) == before:
            return Took.NOTHING
        self.clock.update(int(self.inputs.motion_time[before % MOTION_ROWS]), arrival)
        return Took.SAMPLE

    def of_vehicle(self, event: Event) -> bool:
        """One message of a kind of VEHICLES, its stamp on the clock of the ship's motion; is there a new sample?"""
        stamp, arrival, kind, data = event
        if self.vehicle is None:
            self.refused["no_vehicle"] += 1
            return False
        counts = self.vehicle.counts
        if self.clock.offset is None:
            counts["before_motion"] += 1
            return False
        if stamp and not self.clock.fits(stamp, arrival):
            counts["stamp_off_clock"] += 1
            self.vehicle.last_refusal = f"{TOPIC}: {CAUSES['stamp_off_clock']}"
            return False
        before = int(self.inputs.vehicle_head[0])
        now = self.clock.now(arrival)
        self.vehicle.take(kind, data, arrival + self.wall if stamp or now is None else now)
        return int(self.inputs.vehicle_head[0]) > before

    def command(self, data: bytes, arrival: int, kind: str = "command") -> str:
        """One command as CDR bytes; arrival: ns; kind: of COMMANDED. Returns "" or the cause of its refusal."""
        return self.commands.take(data, arrival, self.clock.now(arrival), kind)

    def jump(self) -> None:
        """Forget motion, commands and clock after a jump; empties the rings: only while no tick runs."""
        self.clock.reset()
        self.ingest.reset()
        if self.vehicle is not None:
            self.vehicle.reset()
        self.forget_commands()

    def forget_commands(self) -> None:
        """Winch and flaps hold where the next start has them; only while no tick runs."""
        self.commands.reset()
        self.inputs.command_head[0] = self.inputs.flap_head[0] = 0

    @property
    def newest(self) -> int | None:
        """Stamp of the newest sample, ns."""
        head = int(self.inputs.motion_head[0])
        return int(self.inputs.motion_time[(head - 1) % MOTION_ROWS]) if head else None

    def refusals(self) -> dict[str, int]:
        """Motion refused or bridged, by cause, where there was any."""
        counts = Counter({cause: count for cause, count in self.ingest.counts.items() if count})
        return dict(counts + self.refused)
