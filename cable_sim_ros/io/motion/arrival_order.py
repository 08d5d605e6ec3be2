"""Messages in the order in which they arrive: one rule for the stamps, live and from a bag.

Motion goes through the clock of its stamps into the ingest of motion; commands are put on that clock by their
arrival. What is dropped on the way is counted by cause, in the words of `messages.CAUSES`.

Motion of the vehicle at the far end of the cable: nav_msgs/Odometry or geometry_msgs/PoseStamped -> samples.

By the checks of the ship's odometry (motion.py), but for what is of a ship: its height is any, and where its position
jumps the vehicle is there, so that nothing is anchored. A jump is taken up at ``vehicle.max_speed`` (physics/ship.py).

The clock of the motion data, seen from that of the arrivals: offset = running minimum of (arrival - stamp).

The minimum over the last half minute is free of transport and queueing delays and follows the drift of the sender's
clock. Live, arrivals are CLOCK_MONOTONIC; of a bag they are its log times. Only differences of arrivals count.

A stamp that does not fit the clock is not used: one more than 1 s off, or more than 0.2 s ahead of any message of the
last half minute. Five in a row that agree with each other are a jump of the clock. Stamps that stay 0.2 to 1 s behind
are used, and are a jump after a second of it.
"""

from __future__ import annotations

from collections import Counter
from enum import Enum
from math import hypot, sqrt

import numpy as np

from ...physics.heave_filter import Convention, Heave, MotionInput
from ...physics.inputs import MOTION_ROWS, Inputs, of_vehicle
from ...physics.ship import Ship
from ...physics.tick_output import Source
from ...physics.towbody import BodyModel
from ...physics.vehicle import Vehicle
from ...sim.inputs import JUMP_FREE, MAX_POSITION
from ...sim.scene import Scene
from ...sim.tables.rigid_tables import flaps_of
from ..messages.commands import CommandIngest
from ..messages.messages import CAUSES, VEHICLES, Event, Odometry, Refused
from .motion import MotionIngest

SECOND = 1_000_000_000
BUCKET = SECOND
BUCKETS = 30
FAR = SECOND  # ns; a stamp further off the clock is not used
STEP = SECOND // 5  # ns; no delay of a transport comes or goes by more and stays
SETTLING = SECOND  # ns from the first arrival in which the minimum is still being found
CONFIRM = 5  # stamps in a row that must agree before a jump is believed

TOPIC = "vehicle/odom"


class Stamp(Enum):
    """What a stamp is to the clock."""

    FITS = "fits"
    OFF = "off"  # not to be used
    JUMPED = "jumped"  # as OFF, and the clock has jumped: reset it


class DataClock:
    """Map of stamps to times of arrival [ns]. Not thread safe: one writer; `offset` may be read anywhere."""

    def __init__(self) -> None:
        self.jumps = 0
        self.jump = 0  # ns, by how much the stamps moved against the arrivals in the last jump; positive: ahead
        self.reset()

    def reset(self) -> None:
        """Forget the mapping; the next stamp starts a new one."""
        self.offset: int | None = None
        self.last_stamp: int | None = None
        self.first: int | None = None  # arrival of the first stamp
        self._buckets: dict[int, int] = {}
        self._suspects: list[tuple[int, int]] = []
        self._behind: list[int] = []  # arrivals of stamps that stay behind

    def fits(self, stamp: int, arrival: int) -> bool:
        """Does a stamp fit the clock so far?"""
        if self.offset is None or self.first is None:
            return True
        late = arrival - stamp - self.offset
        return abs(late) <= FAR and (late >= -STEP or arrival - self.first <= SETTLING)

    def judge(self, stamp: int, arrival: int) -> Stamp:
        """What a stamp is to the clock; counts jumps. Call it once for each message, in order of arrival."""
        if self.offset is None:
            return Stamp.FITS
        if self.fits(stamp, arrival):
            self._suspects.clear()
            if not self._stays_behind(stamp, arrival):
                return Stamp.FITS
        elif not self._agree(stamp, arrival):
            return Stamp.OFF
        self.jumps += 1
        self.jump = self.offset - (arrival - stamp)
        return Stamp.JUMPED

    def _agree(self, stamp: int, arrival: int) -> bool:
        suspects = self._suspects
        if suspects:
            before, came = suspects[-1]
            if not (stamp >= before and abs((arrival - came) - (stamp - before)) <= STEP):
                suspects.clear()
        suspects.append((stamp, arrival))
        return len(suspects) >= CONFIRM

    def _stays_behind(self, stamp: int, arrival: int) -> bool:
        assert self.offset is not None
        if arrival - stamp - self.offset <= STEP:
            self._behind.clear()
            return False
        self._behind = [*self._behind[:CONFIRM], arrival]
        return len(self._behind) > CONFIRM and arrival - self._behind[0] >= SECOND

    def update(self, stamp: int, arrival: int) -> None:
        """Take in an accepted stamp and its arrival, ns."""
        self.last_stamp = stamp
        self.first = arrival if self.first is None else self.first
        bucket = (arrival - self.first) // BUCKET
        delay = arrival - stamp
        best = self._buckets.get(bucket)
        if best is None:
            self._buckets[bucket] = delay
            for old in [key for key in self._buckets if key <= bucket - BUCKETS]:
                del self._buckets[old]
            self.offset = min(self._buckets.values())
        elif delay < best:
            self._buckets[bucket] = delay
            self.offset = min(self._buckets.values())

    def now(self, arrival: int) -> int | None:
        """Time on the data's clock, ns, at a time of the clock of the arrivals; None before the first stamp."""
        return None if self.offset is None else arrival - self.offset


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
