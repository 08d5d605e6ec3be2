"""Figures of the running node: rings of the newest samples, and the JSON file that reports its state."""

from __future__ import annotations

import json
import math
import os
from pathlib import Path

import numpy as np


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
