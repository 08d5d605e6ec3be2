"""Does the loop hold real time? Tells a process that stood still from a model that is too big for this machine.

Pure: `look` is given times and rows of the loop, nothing here waits or starts anything.

Figures of the running node: rings of the newest samples, and the JSON file that reports its state.
"""

from __future__ import annotations

import json
import math
import os
from collections import deque
from collections.abc import Callable
from pathlib import Path

import numpy as np

SECOND = 1_000_000_000
WINDOW = 600_000_000  # ns of wall time that the real-time factor is measured over; with the polls, shown within 1 s
MIN = 500_000_000  # ns; no judgement on less
TOO_SLOW = 0.97  # real-time factor; what is lost above it is a tick or two, which the resyncs show
BUSY = 0.9  # share of the wall time spent in ticks, below which it is not the model that holds the loop up
RECOVERED = 2 * SECOND  # ns of real time held, after which the overload is over
STILL = 80_000_000  # ns; a longer hole in the ticks and in the polls at once: the whole process stood still
SHOWN = 10.0  # s that a standstill stays in the message of /diagnostics


class Samples:
    """The newest `size` values of one quantity, with percentiles. One writer; readers may see a value torn by none."""

    def __init__(self, size: int = 60_000) -> None:
        self._ring = np.zeros(size)
        self.count = 0

    def add(self, value: float) -> None:
        self._ring[self.count % len(self._ring)] = value
        self.count += 1

    def percentiles(self, *ranks: float, newest: int | None = None) -> list[float]:
        """Percentiles of the newest values (all that are kept by default); nan while there are none."""
        size = len(self._ring)
        kept = min(self.count, size, newest or size)
        if kept == 0:
            return [math.nan] * len(ranks)
        places = np.arange(self.count - kept, self.count) % size
        return [float(value) for value in np.percentile(self._ring[places], ranks)]

    def named(self, name: str, *ranks: float, newest: int | None = None) -> dict[str, float]:
        """Percentiles of times [ms] by NAME_p50_ms and so on, the largest by NAME_max_ms."""
        names = ("max" if rank == 100 else f"p{rank:g}".replace(".", "") for rank in ranks)
        return {f"{name}_{of}_ms": value for of, value in zip(names, self.percentiles(*ranks, newest=newest))}


class Rate:
    """Events per second, from a counter looked at now and then, also twice at once where a state changes."""

    SHORTEST = 200_000_000  # ns; over less than that a regular stream shows any rate, 0 as well

    def __init__(self) -> None:
        self._last: tuple[int, int] | None = None
        self._rate = math.nan

    def of(self, count: int, monotonic_ns: int) -> float:
        """Rate [1/s] since a call before, SHORTEST ago at least; nan at the first."""
        if self._last is None:
            self._last = count, monotonic_ns
        since = monotonic_ns - self._last[1]
        if since >= self.SHORTEST:
            self._rate, self._last = (count - self._last[0]) / (since * 1e-9), (count, monotonic_ns)
        return self._rate


def clean(value):
    """The same tree without what JSON cannot hold: nan and infinity become null, numpy numbers plain."""
    if isinstance(value, dict):
        return {str(key): clean(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [clean(item) for item in value]
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    return value


def write_json(path: str | os.PathLike, tree: dict) -> None:
    """Write a file that is at no time half written."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    scratch = path.with_name(path.name + ".tmp")
    scratch.write_text(json.dumps(clean(tree), indent=1) + "\n", "utf-8")
    scratch.replace(path)


class Pace:
    """Pace of one loop. `overloaded`, `factor` (simulated over wall time, NaN: not yet known) and counts are public.

    `stops`, `longest_stop` and `last_stop` [s] are of standstills; `overloads` and `overloaded_s` of overloads.
    """

    def __init__(self, period_ns: int) -> None:
        self.period = period_ns
        self.overloaded = False
        self.factor = math.nan
        self.min_factor = math.nan
        self.overloads = self.stops = 0
        self.overloaded_s = self.longest_stop = self.last_stop = 0.0
        self._stopped_at = -math.inf  # s
        self._skipped = 0
        self.last_skipped = 0  # ticks, at the newest standstill
        self._polled: int | None = None
        self._holes: deque[tuple[int, int]] = deque()  # polls that came late: when [ns], by how much [ns]
        self._bad_at = 0
        self.begin(0, 0)

    def begin(self, due_ns: int, count: int) -> None:
        """The loop starts: tick number `count` is due at due_ns on CLOCK_MONOTONIC. An overload stays one."""
        self._seen = count
        self._wake: int | None = None
        self._done = due_ns
        self._work = 0
        self._window: deque[tuple[int, int, int]] = deque([(due_ns, count, 0)])
        self._bad_at = max(self._bad_at, due_ns)

    def look(self, now: int, count: int, rows: int, row: Callable, skipped: int) -> list[tuple[str, str]]:
        """Judge the ticks done since the call before; returns what is worth a line of the log: (level, text).

        now: CLOCK_MONOTONIC, ns; count: ticks done; row(k): Row of tick k, the newest `rows` are kept; skipped: ticks
        skipped so far. Call it every 50 ms or so, whatever the state of the loop.
        """
        before, self._polled = self._polled, now
        if self.overloaded:
            self.overloaded_s += (now - (before or now)) * 1e-9
        if before is not None and now - before > STILL:
            self._holes.append((now, now - before))
        while self._holes and now - self._holes[0][0] > SECOND:
            self._holes.popleft()
        lines = self._standstill(self._longest_hole(count, rows, row), now, skipped)
        self._skipped = skipped
        while len(self._window) > 1 and now - self._window[1][0] > WINDOW:
            self._window.popleft()
        since, first, work = self._window[0]
        self._window.append((now, count, self._work))
        if now - since < MIN:
            return lines
        under_way = now - self._done if now - self._done > 2 * self.period else 0
        self.factor = (count - first) * self.period / (now - since)
        busy = (self._work - work + under_way) / (now - since)
        if self.factor < TOO_SLOW and busy > BUSY:
            self._bad_at = now
            self.min_factor = min(self.factor, self.min_factor) if self.overloads else self.factor
            if not self.overloaded:
                lines += self.overload(now)
        if self.overloaded:
            if self.factor < TOO_SLOW:
                self._bad_at = now
            if now - self._bad_at >= RECOVERED:
                self.overloaded = False
                lines.append(("info", "no longer overloaded: real time is held again"))
        return lines

    def overload(self, now: int) -> list[tuple[str, str]]:
        """Go to overloaded, as `look` does, or because the lag has grown to its bound."""
        self._bad_at = now
        if self.overloaded:
            return []
        self.overloaded = True
        self.overloads += 1
        return [("error", self.text())]

    def text(self) -> str:
        """What an overload means, with the factor."""
        return (
            f"overloaded: simulated time passes at {self.factor:.2f} of real time, so what is published lags behind "
            "the motion and, at realtime.max_lag, is taken to the present; do not control by it. Use a coarser mesh, "
            "a longer solver.tick or a faster machine"
        )

    def stop_text(self, now: int) -> str:
        """What the newest standstill was, for SHOWN seconds after it; else ""."""
        if now * 1e-9 - self._stopped_at > SHOWN:
            return ""
        return (
            f"the process stood still for {self.last_stop:.1f} s, {self.last_skipped} ticks skipped "
            f"({self.stops} times so far)"
        )

    def stopped_lately(self, now: int, lag: float) -> bool:
        """True if a standstill explains a lag [s]."""
        return now * 1e-9 - self._stopped_at < SHOWN and self.last_stop > 0.5 * lag

    def _longest_hole(self, count: int, rows: int, row: Callable) -> int:
        """Longest time between two wakings among the new ticks, less the period [ns]."""
        longest, work = 0, 0
        first = max(self._seen, count - rows + 1)
        for k in range(first, count):
            tick = row(k)
            if self._wake is not None and (k > first or first == self._seen):
                longest = max(longest, tick.wake - self._wake - self.period)
            self._wake, self._done = tick.wake, tick.done
            work += tick.done - tick.wake
        if count > first:  # those that have left the ring worked as the others did
            self._work += work * (count - self._seen) // (count - first)
        self._seen = count
        return longest

    def _standstill(self, hole: int, now: int, skipped: int) -> list[tuple[str, str]]:
        together = max((gap for _, gap in self._holes), default=0)
        if hole < STILL or together < 0.5 * hole:
            return []
        self._holes.clear()
        self.stops += 1
        self.last_stop, self.last_skipped = hole * 1e-9, skipped - self._skipped
        self.longest_stop = max(self.longest_stop, self.last_stop)
        self._stopped_at = now * 1e-9
        self._window = deque([(now, self._seen, self._work)])  # what was lost in it is no overload
        return [("warn", self.stop_text(now))]
