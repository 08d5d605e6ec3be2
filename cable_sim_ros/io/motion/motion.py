"""Ship motion: bytes of sensor_msgs/Imu and nav_msgs/Odometry -> samples in Inputs, the same for topic and bag.

Odometry is used while it is fresh. Otherwise the IMU alone: attitude from its message, translation by the heave
filter about a mean track; the filter runs all the time, so that a change is warm. What cannot be right is refused and
counted by cause; nothing that is not finite gets through. messages.py decodes the messages and reads bags,
`stamps.py` makes jittering stamps regular, `position_rate_fit.py` makes positions and rates fit each other.

A Stream is one topic: its stamps, arrivals and rate. Counted too is how long each topic was refused for what its parts
say of each other, and what was used in its place.
"""

from __future__ import annotations

from collections import deque
from math import cos, hypot, nan, pi, sin

from ...physics.heave_filter import Heave, HeaveFilter, MotionInput
from ...physics.inputs import Inputs, push_motion
from ...physics.ship import Ship
from ...physics.tick_output import Source
from ...sim.tables.attitude import angle_rates, to_world
from ..messages.messages import CAUSES, Odometry, Refused, decode_imu, decode_odometry
from ..messages.mounting import mounting_of
from ..plausibility.plausibility import HeaderWatch, Watch
from .position_rate_fit import PositionRateFit
from .stamps import RegularStamps

IMU, ODOMETRY = "imu/data", "odom"
TOPICS = {"imu": IMU, "odometry": ODOMETRY}  # by kind of message
LONGEST = 1.0  # s that one message stands for, at most

SECOND = 1_000_000_000
BACKWARDS = SECOND  # ns; a stamp further back than this is a jump of the clock, not a late message

JUMPED = 10  # backward stamps in a row that make a time jump
LEARNT = 10.0  # s of odometry, from which on its mean speed outlives a second of wrong one
RETURN = 2.0  # odometry is taken again after this many time-outs without a gap: no flapping at low rates


class Refusals:
    """One for both topics; what is counted outlives a jump of the clock."""

    def __init__(self) -> None:
        self._seconds: dict[str, dict[str, float]] = {IMU: {}, ODOMETRY: {}}  # by topic and cause
        self._newest: dict[str, int] = {}  # stamp of the newest message of a topic, refused or not, ns
        self._cause: dict[str, str] = {}  # of its refusal; "": it was taken

    def judged(self, topic: str, cause: str, stamp: int) -> None:
        """A message was held against itself and the others; cause: why it is refused, "" where it is not."""
        since = (stamp - self._newest.get(topic, stamp)) * 1e-9
        self._newest[topic], self._cause[topic] = stamp, cause
        if cause and since > 0.0:
            seconds = self._seconds[topic]
            seconds[cause] = seconds.get(cause, 0.0) + min(since, LONGEST)

    def refused(self, kind: str, cause: str) -> None:
        """A message of a kind was refused, for whatever cause."""
        self._cause[TOPICS.get(kind, kind)] = cause

    def why(self, kind: str) -> str:
        """Cause, and what to do, of the newest message of a kind where it was refused; "" where it was not."""
        cause = self._cause.get(TOPICS[kind], "")
        return f"{cause}: {CAUSES[cause]}" if cause else ""

    def report(self, witnessed: bool) -> list[tuple[str, float]]:
        """Text and seconds for each topic that was refused; witnessed: the odometry fits a refused IMU, which then
        casts no doubt on it."""
        found = []
        for topic, other in ((IMU, ODOMETRY), (ODOMETRY, IMU)):
            causes = self._seconds[topic]
            if not causes or (topic == IMU and other in self._newest and witnessed):
                continue
            cause = max(causes, key=lambda name: causes[name])
            found.append(
                (f"{topic} was refused ({cause}): {CAUSES[cause]}; {self._instead(other)}", sum(causes.values()))
            )
        return found

    def _instead(self, other: str) -> str:
        if other not in self._newest:
            return "nothing else came, so that the ship was on its mean track meanwhile"
        beside = sum(self._seconds[other].values())
        if beside:
            return f"{other} was refused too, for {beside:.3g} s"
        if other == IMU:
            return "imu/data alone gave the motion, about a mean track"
        return "odom was used, but could not be held against it: what is wrong with the one may be wrong with both"


class Stream:
    """Stamps, arrivals and rate of one topic."""

    def __init__(self, jitter: float) -> None:
        self.stamp: int | None = None  # ns, as the arrival
        self.arrival: int | None = None
        self.streak = 0  # ns, arrival since which there was no gap
        self.regular = RegularStamps(jitter)
        self.used: int | None = None  # ns, the newest regular stamp
        self.period = nan  # s between stamps, smoothed
        self.unstamped = False
        self.backwards = 0

    def check(self, stamp: int, arrival: int) -> int:
        """The stamp, or the arrival where there is none; Refused if it does not advance."""
        if stamp == 0:  # a driver without a clock; the first such message may also be a clock that starts at zero
            if not self.unstamped:
                self.unstamped = True
                raise Refused("no_stamp")
            stamp = arrival
        else:
            self.unstamped = False
        if self.stamp is not None and stamp <= self.stamp:
            far = self.stamp - stamp > BACKWARDS
            self.backwards = self.backwards + 1 if far else 0
            raise Refused("stamp_backwards" if far else "stamp_not_advancing")
        return stamp

    def skip(self, stamp: int) -> None:
        """A message that is refused for what it says: its stamp has been, the stream is as good as silent."""
        self.stamp, self.backwards = stamp, 0

    def take(self, stamp: int, arrival: int, timeout: float) -> tuple[int, float]:
        """Stamp to use, made regular, and seconds since the one before (NaN for the first)."""
        used = self.regular.take(stamp)
        dt = nan if self.used is None else (used - self.used) * 1e-9
        if self.arrival is None or arrival - self.arrival > timeout * SECOND:
            self.streak = arrival
        if dt == dt:
            self.period = dt if self.period != self.period else self.period + 0.05 * (dt - self.period)
        self.stamp, self.used, self.arrival, self.backwards = stamp, used, arrival, 0
        return used, dt

    def age(self, now: int) -> float:
        return nan if self.arrival is None else (now - self.arrival) * 1e-9

    def report(self, name: str, now: int) -> dict[str, object]:
        regular = self.regular
        return {
            f"{name}_age_s": self.age(now),
            f"{name}_rate_hz": 1.0 / self.period if self.period > 0.0 else nan,
            f"{name}_stamp_period_s": regular.period * 1e-9,
            f"{name}_stamp_jitter_s": regular.jitter * 1e-9,
            f"{name}_stamps_regular": regular.active,
        }


class Slow:
    """Mean of a vector over an expanding memory of at most `memory` seconds."""

    def __init__(self, memory: float) -> None:
        self.memory, self.time = memory, 0.0
        self.mean: tuple[float, ...] | None = None

    def add(self, values: tuple[float, ...], dt: float) -> tuple[float, ...]:
        if self.mean is None or not dt > 0.0:
            self.mean = self.mean or values
            return self.mean
        self.time = min(self.time + dt, self.memory)
        x = min(1.0, dt / self.time)
        self.mean = tuple(m + x * (v - m) for m, v in zip(self.mean, values))
        return self.mean


class MotionIngest:
    """Takes message bytes, pushes motion samples. One writer: call it from one thread.

    inputs: the rings; ship, heave, motion: parameter blocks; gravity: m/s^2. `imu` and `odometry` take CDR bytes and
    the arrival in ns on any clock that runs on (the log time in a replay), and return the stamp of an accepted
    message in ns, None for a refused one. `counts` has the refusals by cause and the events; `notices` has what a user
    should read, each text once: take them out and print them. frames: names of the world's and the ship's frame.
    """

    def __init__(
        self,
        inputs: Inputs,
        ship: Ship,
        heave: Heave,
        motion: MotionInput | None = None,
        gravity: float = 9.81,
        frames: tuple[str, str] = ("odom", "base_link"),
    ) -> None:
        self.inputs, self.ship, self.heave = inputs, ship, heave
        self.settings = motion or MotionInput()
        self.filter = HeaveFilter(heave, gravity)
        self.counts: dict[str, int] = dict.fromkeys(CAUSES, 0)
        self.last_refusal = ""
        self.epoch = 0
        self.notices: deque[str] = deque(maxlen=100)
        self.last_notice = ""
        self._header = HeaderWatch(frames, self._notice)
        self._mounting = mounting_of(heave.imu_rotation_deg)
        self._watch = Watch(
            gravity,
            ship.reference_height,
            self.settings.max_height_offset,
            heave.imu_position,
            self.settings.max_jump,
            self._notice,
        )
        self._said: set[str] = set()
        self.refused = Refusals()
        self.reset()

    def _notice(self, text: str) -> None:
        self.last_notice = text
        if text not in self._said and len(self._said) < 1000:
            self._said.add(text)
            self.notices.append(text)

    def reset(self) -> None:
        """Start anew after a jump of the clock: empties the motion ring, so call it only while no tick runs.

        Counts are kept; the next sample begins a new epoch.
        """
        self.inputs.motion_head[0] = 0
        self.source = Source.MEAN
        self.first_pose: tuple[int, float, float, float] | None = None  # stamp, x, y, yaw of the first sample
        self.origin = (0.0, 0.0)  # m, added to the odometry's position
        self._imu, self._odometry = Stream(self.settings.stamp_jitter), Stream(self.settings.stamp_jitter)
        self._fit = PositionRateFit(self.settings.position_time)
        self._began: int | None = None  # first arrival of an IMU message
        self._new_epoch = True
        self._yaw: float | None = None
        self._last: tuple[int, list[float]] | None = None  # newest pushed sample
        self._track: list[float] | None = None  # x y of the mean track while the IMU is the source
        self._track_velocity = (0.0, 0.0)
        self._heading = Slow(self.heave.period)  # cos and sin of the yaw
        self._velocity = Slow(self.heave.period)  # of the odometry
        self._gravity = Slow(10.0)  # specific force along the vertical
        self._mismatch = Slow(10.0)  # squared difference of odometry twist and moved position
        self._before: Odometry | None = None  # newest odometry
        self._waiting: list[Odometry] = []  # without twist: newest two, for a central difference
        self.filter.reset()
        self._watch.reset()

    def take(self, kind: str, data: bytes, arrival: int) -> int | None:
        """Take a message of the kind "imu" or "odometry"; see the class."""
        return (self.imu if kind == "imu" else self.odometry)(data, arrival)

    # IMU

    def imu(self, data: bytes, arrival: int) -> int | None:
        """Take a sensor_msgs/Imu; see the class."""
        try:
            message = decode_imu(data, self.settings.convention, self._mounting, self.settings.force_reversed)
            stamp = self._imu.check(message.stamp, arrival)
            self._header.look("imu/data", message)
            cause = self._watch.imu(message, stamp)
            self.refused.judged(IMU, cause, message.stamp)
            if cause:
                self._imu.skip(stamp)
                raise Refused(cause)
        except Refused as refusal:
            self._refuse("imu", refusal.cause)
            return None
        stamp, dt = self._imu.take(stamp, arrival, self.settings.odometry_timeout)
        self._began = arrival if self._began is None else self._began
        angles = (*message.angles[:2], self._unwrap(message.angles[2]))
        if dt > self.heave.max_gap:
            self.counts["imu_gap"] += 1
        if not dt <= self.heave.max_gap:
            self.filter.reset()
            self._new_epoch |= self.source == Source.IMU
        moved = self.filter.push(dt if dt == dt else 0.0, message.force, angles, message.rate).tolist()
        if self.filter.diverged:
            self.counts["heave_diverged"] += 1
            self.filter.reset()
            moved = self.filter.push(0.0, message.force, angles, message.rate).tolist()
            self._new_epoch |= self.source == Source.IMU
        self._gravity.add((to_world(angles, message.force)[2],), dt)
        heading = self._heading.add((cos(angles[2]), sin(angles[2])), dt)
        if self._imu_leads(arrival):
            self._push_imu(stamp, dt, angles, angle_rates(*angles[:2], message.rate), moved, heading)
        return stamp

    def _imu_leads(self, arrival: int) -> bool:
        timeout = self.settings.odometry_timeout
        if self._watch.causes["odom"]:
            return True
        if self.source == Source.ODOMETRY:
            return self._odometry.age(arrival) > timeout
        # at the start odometry gets the time to show up, lest every start begin with a change of source
        began = arrival if self._began is None else self._began
        return self.source == Source.IMU or (arrival - began) * 1e-9 >= timeout

    def _push_imu(self, stamp: int, dt: float, angles, rates, moved, heading) -> None:
        length = hypot(*heading) or 1.0
        ahead = heading[0] / length, heading[1] / length
        speed = self.ship.tow_speed
        known = self._velocity.mean
        if known is not None and self._velocity.time > 0.0:  # the odometry knew better
            speed = known[0] * ahead[0] + known[1] * ahead[1]
        velocity = speed * ahead[0], speed * ahead[1]
        if self.source != Source.IMU or self._track is None:
            self._change_source(Source.IMU)
            self._track = list(self.origin)  # only used before the first sample of any source
            if self._last is not None:  # goes on where the ship is
                before, row = self._last
                since = (stamp - before) * 1e-9
                self._track = [row[0] + velocity[0] * since - moved[0], row[1] + velocity[1] * since - moved[1]]
        else:
            for i in range(2):
                self._track[i] += 0.5 * dt * (velocity[i] + self._track_velocity[i])
        self._track_velocity = velocity
        self._push(
            stamp,
            [
                self._track[0] + moved[0],
                self._track[1] + moved[1],
                self.ship.reference_height + moved[2],
                *angles,
                velocity[0] + moved[3],
                velocity[1] + moved[4],
                moved[5],
                *rates,
            ],
        )

    # odometry

    def odometry(self, data: bytes, arrival: int) -> int | None:
        """Take a nav_msgs/Odometry; see the class.

        A twist of six exact zeros is taken as absent: rates then are central differences of the poses, which costs
        one sample of delay (a backward difference would lag the pose and show as false acceleration).
        """
        try:
            message = self.decoded(data)
            stamp = self._odometry.check(message.stamp, arrival)
            if abs(message.position[2] - self.ship.reference_height) > self.heave.max_displacement:
                raise Refused("height")
            self._header.look("odom", message)
            cause = self._watch.odometry(message, stamp)
            self.refused.judged(ODOMETRY, cause, message.stamp)
            if cause:
                self._odometry.skip(stamp)
                if self._velocity.time < LEARNT:  # mostly of what is refused now
                    self._velocity = Slow(self.heave.period)
                raise Refused(cause)
            if self._watch.pose_only:
                message = message._replace(twist=False)
        except Refused as refusal:
            self._refuse("odometry", refusal.cause)
            return None
        timeout = self.settings.odometry_timeout
        stamp, dt = self._odometry.take(stamp, arrival, timeout)
        x, y, z = message.position
        angles = (*message.angles[:2], self._unwrap(message.angles[2]))
        message = message._replace(stamp=stamp, position=(x + self.origin[0], y + self.origin[1], z), angles=angles)
        message = self._anchored(message, dt)
        if not message.twist and self._before is not None and dt <= self.ship.max_gap:
            ahead = tuple((b - a) / dt for a, b in zip(self._before.position, message.position))
            self._velocity.add(ahead[:2], dt)
        elif message.twist:
            self._velocity.add(to_world(angles, message.velocity)[:2], dt)
        self._before = message
        if self.source == Source.IMU and (arrival - self._odometry.streak) * 1e-9 < RETURN * timeout:
            return stamp
        if self.source != Source.ODOMETRY:
            self._change_source(Source.ODOMETRY)
            self._waiting.clear()
        self._push_odometry(message, dt)
        return stamp

    def decoded(self, data: bytes) -> Odometry:
        """Checked numbers of an odometry message. Raises Refused."""
        return decode_odometry(data, self.settings.convention)

    def _anchored(self, message: Odometry, dt: float) -> Odometry:
        """The message with its origin shifted if its position jumped, so that the ship does not."""
        if self.source == Source.ODOMETRY and self._before is not None:
            x, y, _ = self._before.position
            vx, vy = self._velocity.mean or (0.0, 0.0)
            if message.twist and dt <= self.ship.max_gap:
                wx, wy, _ = to_world(message.angles, message.velocity)
                offset = message.position[0] - x - wx * dt, message.position[1] - y - wy * dt
                self._mismatch.add(((offset[0] ** 2 + offset[1] ** 2) / dt**2,), dt)
        elif self._last is not None:  # comes back
            (before, row), (vx, vy) = self._last, self._track_velocity
            x, y, dt = row[0], row[1], (message.stamp - before) * 1e-9
        else:
            return message
        x, y = x + vx * dt, y + vy * dt
        jump = message.position[0] - x, message.position[1] - y
        if hypot(*jump) <= self.settings.max_jump:
            return message
        self.counts["position_jump"] += 1
        self._new_epoch |= self.source == Source.ODOMETRY
        self._waiting.clear()
        self.origin = self.origin[0] - jump[0], self.origin[1] - jump[1]
        return message._replace(position=(x, y, message.position[2]))

    def _push_odometry(self, message: Odometry, dt: float) -> None:
        waiting = self._waiting
        if waiting and not dt <= self.ship.max_gap:
            waiting.clear()
        waiting.append(message)
        if len(waiting) >= 2 and not waiting[-2].twist:
            first, middle, last = waiting[0], waiting[-2], waiting[-1]
            span = (last.stamp - first.stamp) * 1e-9
            ends = zip((*first.position, *first.angles), (*last.position, *last.angles))
            rates = [(b - a) / span for a, b in ends]
            self._push(middle.stamp, [*middle.position, *middle.angles, *rates], measured=False)
        if message.twist:
            self._push(
                message.stamp,
                [
                    *message.position,
                    *message.angles,
                    *to_world(message.angles, message.velocity),
                    *angle_rates(*message.angles[:2], message.rate),
                ],
            )
        del waiting[:-2]

    # both

    def _refuse(self, topic: str, cause: str) -> None:
        self.counts[cause] += 1
        self.refused.refused(topic, cause)
        self.last_refusal = f"{topic}: {CAUSES[cause]}"

    @property
    def convicted(self) -> dict[str, str]:
        """What is found against each topic at present, "" where nothing is."""
        return self._watch.causes

    def refusals(self) -> list[tuple[str, float]]:
        """Text and seconds of what was refused for what its parts say of each other; see `Refusals.report`."""
        return self.refused.report(self._watch.witnessed)

    def _unwrap(self, yaw: float) -> float:
        if self._yaw is not None:
            yaw = self._yaw + (yaw - self._yaw + pi) % (2.0 * pi) - pi
        self._yaw = yaw
        return yaw

    def _change_source(self, source: Source) -> None:
        if self.source != Source.MEAN:
            self.counts["source_change"] += 1
        self.source, self._new_epoch = source, True

    def _push(self, stamp: int, row: list[float], measured: bool = True) -> None:
        """Push a sample; measured: its rates are measured, not differences of the positions."""
        if self._last is not None:
            if stamp <= self._last[0]:  # the other source was ahead
                self._refuse(str(self.source.name).lower(), "behind")
                return
            if stamp - self._last[0] > self.ship.max_gap * SECOND and not self._new_epoch:
                self.counts["gap"] += 1
                self._new_epoch = True
        if self._new_epoch or not measured:
            self._fit.reset()
        if measured:
            row = self._fit.push((stamp - self._last[0]) * 1e-9 if self._last else 0.0, row)
        epoch = self.epoch + (1 if self._new_epoch else 0)
        push_motion(self.inputs, stamp, [*row, float(epoch), float(self.source)])
        self.epoch, self._new_epoch = epoch, False
        self._last = stamp, row
        self.first_pose = self.first_pose or (stamp, row[0], row[1], row[5])

    @property
    def time_jump(self) -> bool:
        """True when a topic's clock has been set back: its messages are refused until `reset`."""
        return max(self._imu.backwards, self._odometry.backwards) >= JUMPED

    def report(self, now: int) -> dict[str, object]:
        """Plain values for diagnostics. now: ns on the clock of the arrivals. NaN = not known."""
        gravity = self._gravity.mean[0] if self._gravity.mean else nan
        mismatch = self._mismatch.mean[0] ** 0.5 if self._mismatch.mean else nan
        doubts = self._watch.causes
        hint = "; ".join(f"{topic}: {CAUSES[cause]}" for topic, cause in doubts.items() if cause)
        if not hint and mismatch > 1.0:
            hint = (
                f"odometry twist differs from the moved position by {mismatch:.2f} m/s rms: the motion between "
                f"samples is wrong; the twist must be in the axes of child_frame_id"
            )
        return {
            "source": str(self.source.name).lower(),
            "epoch": self.epoch,
            "samples": int(self.inputs.motion_head[0]),
            **self._imu.report("imu", now),
            **self._odometry.report("odometry", now),
            "integrated": self._fit.names(self._fit.integrated),
            "smoothed": self._fit.names(self._fit.smoothed),
            "heave_valid": self.filter.valid,
            "heave_age_s": self.filter.age,
            "heave_bias_mps2": self.filter.bias[2],
            "vertical_force_mps2": gravity,
            "twist_mismatch_mps": mismatch,
            "origin_x_m": self.origin[0],
            "origin_y_m": self.origin[1],
            "time_jump": self.time_jump,
            "imu_doubt": doubts["imu/data"] or "none",
            "odometry_doubt": doubts["odom"] or "none",
            "pose_only": self._watch.pose_only,
            "last_notice": self.last_notice,
            "refused": sum(self.counts[cause] for cause, text in CAUSES.items() if text),
            "last_refusal": self.last_refusal,
            "hint": hint,
        }
