"""Do the parts of motion messages fit each other? Wrong units and axes found from the data alone, by name.

What must hang together is compared: attitude with the integral of the angular velocity, position with that of the
velocity, specific force with gravity, odometry with the IMU. `cross_check.py` says how, `fault_hypotheses.py` what
each finding means. A stream that is convicted is refused until its parts have fitted each other again for a second.

Sudden misfits, message by message: a velocity or a height that leaves what its own stream has been doing.

`cross_check.py` needs half a second and more to name what is wrong. The cubic between samples makes an acceleration of
4 (change of velocity) / dt out of a velocity that steps, so not one such message may be used. What is usual is learnt
from the stream itself: a noisy one is allowed more.
"""

from __future__ import annotations

from collections.abc import Callable
from math import cos, dist, exp, hypot, inf, pi, sin, sqrt

from ...sim.tables.attitude import to_world
from ..messages.fault_hypotheses import DOUBTS, rate_guesses, velocity_guesses
from ..messages.messages import Imu, Odometry
from .cross_check import Comparison, CrossCheck

LEARN, LEARN_MESSAGES = 1.0, 10  # s and messages before a stream is judged
MEMORY = 60.0  # s, decay of the largest usual value
OVER = 1.5  # times the largest usual change, that is still usual
FRACTION = 0.5  # of a step, that the positions must leave unexplained
WINDOW = 0.2  # s, memory of the misfit while messages are refused
AGAIN = 0.1  # s for which it must fit to be used again
GIVE_UP = 5.0  # s; a step that lasts so long without a name is the stream's new way
GIVE_UP_HEIGHT = 20.0  # s, longer than a height takes to be named

GAP = 1.6  # s; a longer gap begins anew
LEAK = 0.5  # s
MISFIT = 0.035, 0.5  # rad and share of the rms of the angle: misfit of attitude and rates that is refused
TURN_STEP, TURN_RAMP = 0.02, 0.1  # rad/s, rad/s^2: a step of the rates that is always usual
MOVE_STEP, MOVE_RAMP = 0.2, 1.0  # m/s, m/s^2: of the velocity
UNSEEN = 0.35  # rad/s: a first sample that turns faster waits for the second
NORM_ODD = 1e-3  # a quaternion further off norm 1 is said to be
SLOW = 60.0  # s, longer than any heave that is meant
SWELL = 20.0 / (2.0 * pi)  # s/rad of the longest swell


class RateGuard:
    """Three coordinates and their rates. A step of the rates that the coordinates do not follow is refused.

    floor: step that is always usual (m/s or rad/s); ramp: what a ship may accelerate by beside it, per s.
    """

    def __init__(self, floor: float, ramp: float) -> None:
        self.floor, self.ramp = floor, ramp
        self._peak = 0.0  # largest usual change per second
        self._forget()
        self.begin()

    def _forget(self) -> None:
        self._age, self._seen = 0.0, 0

    def begin(self) -> None:
        """After a gap: no message before; what is usual is kept."""
        self._before: tuple[tuple[float, ...], tuple[float, ...]] | None = None
        self._kept: tuple[float, ...] = ()  # newest rates that were used
        self._refused = self._step = self._fits = self._span = 0.0
        self._off = (0.0, 0.0, 0.0)

    def take(self, x, v, dt: float) -> bool:
        """Is this message to be refused? x: coordinates, v: their rates, dt: s since the message before."""
        before, self._before = self._before, (x, v)
        if before is None or not dt > 0.0:
            self._kept = v
            return False
        x0, v0 = before
        off = [b - a - 0.5 * dt * (p + q) for a, b, p, q in zip(x0, x, v0, v)]
        misfit = 2.0 * hypot(*off) / dt  # what the newest rate alone would be off by
        if self._refused:
            return self._still(v, off, misfit, dt)
        step = dist(v, self._kept)
        judged = self._age >= LEARN and self._seen >= LEARN_MESSAGES
        if judged and step > self.floor + (self.ramp + OVER * self._peak) * dt and misfit > FRACTION * step:
            self._refused, self._step, self._fits = dt, step, 0.0
            self._off, self._span = (0.0, 0.0, 0.0), 0.0
            return True
        self._age, self._seen = self._age + dt, self._seen + 1
        self._peak = max(self._peak * exp(-dt / MEMORY), step / dt)
        self._kept = v
        return False

    def _still(self, v, off, misfit: float, dt: float) -> bool:
        """While messages are refused: until the rates have fitted the moved coordinates again for a while."""
        self._refused += dt
        fade = exp(-dt / WINDOW)
        self._off, self._span = tuple(fade * a + b for a, b in zip(self._off, off)), fade * self._span + dt
        fits = min(misfit, 2.0 * hypot(*self._off) / self._span) <= FRACTION * self._step
        self._fits = self._fits + dt if fits else 0.0
        if self._refused > GIVE_UP:
            self._forget()
        elif self._fits < AGAIN:
            return True
        self._refused, self._kept = 0.0, v
        return False


class HeightGuard:
    """z against the integral of its velocity since the message before, or since the last that was used.

    maximum: step that is always usual, m.
    """

    def __init__(self, maximum: float) -> None:
        self.maximum = maximum
        self._peak = self._age = 0.0
        self._seen = 0
        self.begin()

    def begin(self) -> None:
        """After a gap; what is usual is kept."""
        self._before: tuple[float, float] | None = None  # z that is expected, vertical velocity
        self._refused = 0.0

    def take(self, z: float, climb: float, dt: float) -> bool:
        """Is this message to be refused? z: m, climb: m/s, dt: s since the message before."""
        if self._before is None or not dt > 0.0:
            self._before, self._refused = (z, climb), 0.0
            return False
        expected = self._before[0] + 0.5 * dt * (self._before[1] + climb)
        off = abs(z - expected)
        judged = self._age >= LEARN and self._seen >= LEARN_MESSAGES
        if judged and off > self.maximum + 2.0 * self._peak + 0.1 * self._refused:
            self._refused += dt
            if self._refused <= GIVE_UP_HEIGHT:
                self._before = expected, climb
                return True
            self._age, self._seen = 0.0, 0
        elif not self._refused:
            self._age, self._seen = self._age + dt, self._seen + 1
            self._peak = max(self._peak * exp(-dt / MEMORY), off)
        self._before, self._refused = (z, climb), 0.0
        return False


class Axes:
    """An attitude (roll, pitch, yaw) whose sines and cosines are used more than once."""

    def __init__(self, angles) -> None:
        roll, pitch, yaw = angles
        self.cr, self.sr = cos(roll), sin(roll)
        self.cp, self.sp = cos(pitch), sin(pitch)
        self.cy, self.sy = cos(yaw), sin(yaw)

    def angle_rates(self, rate) -> tuple[float, float, float]:
        """As `sim.tables.attitude.angle_rates`."""
        p, q, r = rate
        turning = (q * self.sr + r * self.cr) / self.cp
        return p + turning * self.sp, q * self.cr - r * self.sr, turning

    def to_body(self, vector) -> tuple[float, float, float]:
        """A vector of the world in body axes."""
        x, y, z = vector
        x, y = x * self.cy + y * self.sy, y * self.cy - x * self.sy
        x, z = x * self.cp - z * self.sp, z * self.cp + x * self.sp
        return x, y * self.cr + z * self.sr, z * self.cr - y * self.sr

    def columns(self, vector) -> tuple[float, ...]:
        """The parts of a vector along body x, y, z, each in the world: 9 numbers."""
        (x, y, z), cr, sr, cp, sp, cy, sy = vector, self.cr, self.sr, self.cp, self.sp, self.cy, self.sy
        a, b = sp * sr, sp * cr
        return (
            *(cy * cp * x, sy * cp * x, -sp * x),
            *((cy * a - sy * cr) * y, (sy * a + cy * cr) * y, cp * sr * y),
            *((cy * b + sy * sr) * z, (sy * b - cy * sr) * z, cp * cr * z),
        )


class Turning:
    """Attitude against angular velocity: the comparison, and a quick guard against gross misfits of single samples."""

    def __init__(self, world: bool) -> None:
        self.compared = Comparison(rate_guesses(world), moving=5e-4, apart=2.5e-3)
        self._world = world
        self._guard = RateGuard(TURN_STEP, TURN_RAMP)
        self.begin()

    def begin(self) -> None:
        self.compared.begin()
        self._guard.begin()
        self._angles: tuple[float, float, float] | None = None
        self._before: tuple[float, ...] = ()
        self._integral = [0.0] * (6 if self._world else 3)
        self._misfit = [0.0] * 3
        self._mean, self._square = [0.0] * 3, [0.0] * 3

    def take(self, angles, axes: Axes, rate, dt: float) -> bool:
        """Angles [rad], yaw unwrapped, and rates as sent [rad/s]. True where a sample must be refused by itself."""
        rates: tuple[float, ...] = axes.angle_rates(rate)
        if self._world:
            rates += axes.angle_rates(axes.to_body(rate))
        stepped = self._guard.take(angles, rates[:3], dt)
        if self._angles is None:
            self._angles, self._before, self._mean = angles, rates, list(angles)
            self.compared.add((*angles, *self._integral), 0.0)
            return max(map(abs, rate)) > UNSEEN
        moved = [0.5 * dt * (a + b) for a, b in zip(self._before, rates)]
        self._integral = [a + b for a, b in zip(self._integral, moved)]
        fade, fraction, bad = exp(-dt / LEAK), min(1.0, dt / 5.0), stepped
        for i in range(3):
            off = self._misfit[i] = fade * self._misfit[i] + angles[i] - self._angles[i] - moved[i]
            self._mean[i] += fraction * (angles[i] - self._mean[i])
            self._square[i] += fraction * ((angles[i] - self._mean[i]) ** 2 - self._square[i])
            bad |= abs(off) > MISFIT[0] and abs(off) > MISFIT[0] + MISFIT[1] * sqrt(self._square[i])
        self._angles, self._before = angles, rates
        self.compared.add((*angles, *self._integral), dt)
        return bad


class Moving:
    """Position against the integral of the velocity, and height against its reference."""

    def __init__(self, reference: float, maximum: float) -> None:
        self.compared = Comparison(velocity_guesses(), moving=0.03, apart=0.05)
        self.reference, self.maximum = reference, maximum
        self.high = False
        self._guard, self._height_guard = RateGuard(MOVE_STEP, MOVE_RAMP), HeightGuard(0.5 * maximum)
        self.begin()

    def begin(self) -> None:
        self.compared.begin()
        self._guard.begin()
        self._height_guard.begin()
        self.misfit = ""  # why the newest sample must be refused by itself
        self._before: tuple[float, ...] = ()
        self._first = (0.0, 0.0, 0.0)
        self._integral = [0.0] * 12
        self._age = self._mean = self._rise = self._bend = self._speed = self._up = self._way = 0.0
        self._crest, self._trough, self._turns = -inf, inf, 0
        self._far = inf  # s since z was last as near as it must be; inf: it never was

    def pose_only(self) -> None:
        """A message without twist: nothing to hold its position against."""
        self.compared.begin()
        self._guard.begin()
        self._height_guard.begin()
        self.misfit = ""

    def take(self, position, axes: Axes, velocity, dt: float) -> float:
        """Returns the vertical velocity, m/s."""
        parts = (*axes.columns(velocity), *velocity)
        if not self._before:
            self._before, self._first = parts, position
        self._integral = [s + 0.5 * dt * (a + b) for s, a, b in zip(self._integral, self._before, parts)]
        self._before = parts
        self.compared.add((*(p - q for p, q in zip(position, self._first)), *self._integral), dt)
        speed = tuple(parts[i] + parts[3 + i] + parts[6 + i] for i in range(3))
        self.misfit = "velocity_misfit" if self._guard.take(position, speed, dt) else ""
        if self.misfit:
            self._height_guard.begin()
        elif self._height_guard.take(position[2], speed[2], dt):
            self.misfit = "height_step"
        return speed[2]

    def height(self, z: float, up: float, dt: float) -> None:
        """Does z [m above the reference] keep away from 0? up: m/s.

        Told at once where it moves so little that no swell can be meant, else by crest and trough, or by the mean.
        """
        if dt > 0.0:
            self._age += dt
            fast, slow = (min(1.0, dt / min(maximum, self._age)) for maximum in (1.0, 10.0))
            self._mean += min(1.0, dt / min(SLOW, self._age)) * (z - self._mean)
            self._rise += fast * (abs(up) - self._rise)
            self._bend += fast * (abs(up - self._up) / dt - self._bend)
            self._speed += slow * (abs(up) - self._speed)
        self._far = 0.0 if abs(z) <= self.maximum else self._far + dt
        self._up = up
        self._crest, self._trough = max(self._crest, z), min(self._trough, z)
        if self._age < 0.8:
            return
        if up * self._way < 0.0 and abs(up) > 0.5 * self._speed:
            self._turns += 1
        if abs(up) > 0.5 * self._speed:
            self._way = up
        maximum = self.maximum
        swing = SWELL * hypot(1.6 * self._rise, SWELL * 1.6 * self._bend)
        calm = abs(z) > maximum + 1.25 * swing and self._far > SLOW
        if calm or (self._age > SLOW and abs(self._mean) > maximum + 0.2 * self._speed * SWELL):
            self.high = True
        elif self._turns < 2:
            if abs(z) + swing < maximum:
                self.high = False
            return
        else:  # a crest and a trough have passed
            middle, half = 0.5 * (self._crest + self._trough), 0.5 * (self._crest - self._trough)
            self.high = abs(middle) > maximum + (0.0 if self.high else 0.25 * half)
        self._turns, self._crest, self._trough = 0, z, z


class Weighing:
    """Specific force against gravity, over blocks of 0.1 s in the last second."""

    def __init__(self, gravity: float) -> None:
        self.gravity, self.cause = gravity, ""
        self.begin()

    def begin(self) -> None:
        self._age, self._size, self._up, self._held = 0.0, 0.0, 0.0, (self.cause, 0.0)

    def take(self, angles, force, dt: float) -> bool:
        """Force in body axes [m/s^2]. True where the cause has changed."""
        self._age += dt
        fraction = min(1.0, dt / max(1e-9, min(0.5, self._age)))
        self._size += fraction * (sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2) - self._size)
        self._up += fraction * (to_world(angles, force)[2] - self._up)
        cause, since = self._now(), self._held[1] + dt
        self._held = (cause, since) if cause == self._held[0] else (cause, 0.0)
        if cause == self.cause or self._age < 0.4 or self._held[1] < (0.2 if cause else 1.0):
            return False
        self.cause = cause
        return True

    def _now(self) -> str:
        size, up, g = self._size, self._up, self.gravity
        if size < 0.5 * g:
            unit = abs(abs(up) - 1.0) < 0.35 and size < 1.5 and self.cause != "gravity_removed"
            return "gravity_units" if unit else "gravity_removed"
        if up < -0.5 * size:
            return "gravity_sign"
        return "gravity_direction" if up < 0.5 * size else ""


IMU_FRAME = "imu_link"  # what drivers call the sensor itself; heave.imu_position and imu_rotation_deg say where it is


class HeaderWatch:
    """Tick output names and the norm of the quaternion: what is said once for each topic."""

    def __init__(self, frames: tuple[str, str], say: Callable[[str], None]) -> None:
        self._frames, self._say = frames, say
        self._seen: dict[str, tuple[bytes, ...]] = {}

    def look(self, topic: str, message: Imu | Odometry) -> None:
        """Say what is odd about a message."""
        if abs(message.norm - 1.0) > NORM_ODD:
            self._say(
                f"{topic}: the quaternion has a norm that differs from 1 by more than {NORM_ODD:g}: used, brought to "
                f"norm 1; check the driver (a norm off by more than 0.01 is refused)"
            )
        if message.frames == self._seen.get(topic):
            return
        self._seen[topic] = message.frames
        known = (self._frames[1],) if topic == "imu/data" else self._frames
        for name, raw, meant in zip(("header.frame_id", "child_frame_id"), message.frames, known):
            text = raw.rstrip(b"\0").decode("utf-8", "replace").lstrip("/")
            if text and text != meant and (topic, text) != ("imu/data", IMU_FRAME):
                role = "the ship's frame, turned by heave.imu_rotation_deg" if topic == "imu/data" else "that frame"
                self._say(
                    f"{topic}: {name} is '{text[:60]}', not '{meant}': no transform is looked up, the numbers are "
                    f"taken as given in {role}"
                )


class Watch:
    """Both streams. `imu` and `odometry` take a decoded message and say why it is refused, "" where it is not.

    gravity: m/s^2; reference, maximum: mean height of base_link and how far off it may be [m]; arm: IMU in base_link
    [m]; jump: horizontal jump of the position that is no motion [m]; say: is called with each finding in words.
    """

    def __init__(self, gravity, reference, maximum, arm, jump, say: Callable[[str], None]) -> None:
        self.jump, self.say = jump, say
        self._weighing = Weighing(gravity)
        self._turning = {"imu/data": Turning(world=False), "odom": Turning(world=True)}
        self._moving = Moving(reference, maximum)
        self._cross = CrossCheck(gravity, arm)
        self.causes = {"imu/data": "", "odom": ""}
        self.pose_only = False  # the twist of the odometry is not filled in, or not wholly
        self.reset()

    def reset(self) -> None:
        """A jump of the clock: forget the times, not the findings."""
        self._last: dict[str, tuple[int, float]] = {}  # stamp [ns] and unwrapped yaw
        self._cross.reset()
        self._place: tuple[float, float, float] | None = None
        self._poses: list[tuple[float, ...]] = []  # x y z roll pitch of the first message without twist

    def _since(self, topic: str, stamp: int, angles) -> tuple[float, tuple[float, float, float]]:
        """Seconds since the message before (0: begin anew) and angles with the yaw unwrapped."""
        yaw = angles[2]
        dt = 0.0
        if topic in self._last:
            before, old = self._last[topic]
            yaw = old + (yaw - old + pi) % (2.0 * pi) - pi
            dt = (stamp - before) * 1e-9
        self._last[topic] = stamp, yaw
        return (dt if 0.0 < dt < GAP else 0.0), (angles[0], angles[1], yaw)

    @property
    def witnessed(self) -> bool:
        """Has the odometry been seen to fit the IMU, convicted or not?"""
        return self._cross.witnessed

    def imu(self, message: Imu, stamp: int) -> str:
        """Cause of refusal of an IMU message with this stamp [ns], or ""."""
        topic, turning = "imu/data", self._turning["imu/data"]
        dt, angles = self._since(topic, stamp, message.angles)
        if not dt:
            turning.begin()
            self._weighing.begin()
        misfit = turning.take(angles, Axes(angles), message.rate, dt)
        self._weighing.take(angles, message.force, dt)
        self._cross.imu(stamp, angles, message.force, dt)
        cause = self._weighing.cause or turning.compared.cause
        self._note(topic, "rate_absent" if cause == "absent" else cause, turning.compared.gain)
        return self.causes[topic] or ("rate_misfit" if misfit else "")

    def odometry(self, message: Odometry, stamp: int) -> str:
        """Cause of refusal of an odometry message with this stamp [ns], or ""."""
        topic, turning, moving = "odom", self._turning["odom"], self._moving
        dt, angles = self._since(topic, stamp, message.angles)
        place, before = message.position, self._place
        self._place = place
        if not dt or before is None:
            dt = 0.0
            turning.begin()
            moving.begin()
        elif hypot(place[0] - before[0], place[1] - before[1]) > self.jump + 50.0 * dt:
            moving.compared.begin()
        misfit, climb = False, (place[2] - before[2]) / dt if dt and before is not None else 0.0
        pose_only = False
        if not message.twist:
            pose_only = self._moved((*place, *angles[:2]))
            turning.begin()
            moving.pose_only()
        else:
            self._poses.clear()
            axes = Axes(angles)
            misfit = turning.take(angles, axes, message.rate, dt)
            climb = moving.take(place, axes, message.velocity, dt)
        moving.height(place[2] - moving.reference, climb, dt)
        self._cross.odometry(stamp, angles, message, climb, dt, self.causes["imu/data"])
        pose_only |= "absent" in (moving.compared.cause, turning.compared.cause)
        if pose_only and not self.pose_only:
            self.say(
                "odom: twist is zero while the pose moves, in whole or in its linear or angular part: not filled in? "
                "Rates are differences of the poses instead, one sample later; let the driver send the twist"
            )
        self.pose_only = pose_only
        found = [moving.compared.cause, turning.compared.cause, *self._cross.causes]
        found += ["height_offset"] if moving.high else []
        gain = (moving if moving.compared.cause else turning).compared.gain
        self._note(topic, next((cause for cause in found if cause not in ("", "absent")), ""), gain)
        if self.causes[topic] or pose_only:
            return self.causes[topic]
        return "rate_misfit" if misfit else moving.misfit

    def _moved(self, pose: tuple[float, ...]) -> bool:
        """Has the pose moved since the twist has been zero? A ship at rest has a twist of zero."""
        self._poses = self._poses or [pose]
        moved = [abs(a - b) for a, b in zip(pose, self._poses[0])]
        return max(moved[:3]) > 0.3 or max(moved[3:]) > 0.01

    def _note(self, topic: str, cause: str, gain: float) -> None:
        if cause == self.causes[topic]:
            return
        self.causes[topic] = cause
        if cause:
            measured = f" (measured: {gain:.3g} times)" if cause.endswith(("degrees", "knots", "kmh")) else ""
            self.say(f"{topic}: {DOUBTS[cause]}{measured}")
        else:
            self.say(f"{topic}: its parts fit each other again: used")
