"""One topic of motion: its stamps, arrivals and rate; and slow means."""

from __future__ import annotations

from math import nan

from ..messages.messages import Refused
from .stamps import RegularStamps

SECOND = 1_000_000_000
BACKWARDS = SECOND  # ns; a stamp further back than this is a jump of the clock, not a late message


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
