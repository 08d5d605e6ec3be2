"""Two recordings of a run on the same stamps: every field of every tick, and what was different first."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


class FieldDifference(NamedTuple):
    """A field of the tick output that differs: when first [s from the first common tick], largest magnitude of B less
    A, and when; nan_ticks: where one of them alone is no number."""

    field: str
    first_s: float
    ticks: int
    largest: float
    largest_at_s: float
    nan_ticks: int


class Exact(NamedTuple):
    """common: ticks with equal stamps, of ticks_a and ticks_b; fields: what differs, by the time of its beginning."""

    ticks_a: int
    ticks_b: int
    common: int
    fields: list[FieldDifference]

    @property
    def same(self) -> bool:
        """Every field of every tick to the last bit."""
        return not self.fields and self.ticks_a == self.ticks_b == self.common

    def as_dict(self) -> dict[str, Any]:
        """For the JSON."""
        return {
            "ticks_a": self.ticks_a,
            "ticks_b": self.ticks_b,
            "common": self.common,
            "same": self.same,
            "fields": [one._asdict() for one in self.fields],
        }

    def line(self) -> str:
        """In a sentence."""
        if self.same:
            return f"the same run: every field of all {self.common} ticks is equal to the last bit"
        ticks = f"{self.common} common ticks of {self.ticks_a} and {self.ticks_b}"
        if not self.fields:
            return f"{ticks}: every field is equal to the last bit"
        first = self.fields[0]
        others = [one.field for one in self.fields if one.first_s == first.first_s]
        return f"{ticks}: {len(self.fields)} fields differ, first at {first.first_s:.4g} s: {', '.join(others[:6])}" + (
            f" and {len(others) - 6} more" if len(others) > 6 else ""
        )


def exact(a: np.ndarray, b: np.ndarray) -> Exact | None:
    """Differences of two runs, tick by tick; None without a common stamp. Stamps that come again are left out."""
    ours, i = np.unique(a["time"], return_index=True)
    theirs, j = np.unique(b["time"], return_index=True)
    common, k, m = np.intersect1d(ours, theirs, assume_unique=True, return_indices=True)
    if not len(common):
        return None
    one, other = a[i[k]], b[j[m]]
    seconds = (common - common[0]) * 1e-9
    found = []
    for name in a.dtype.names or ():
        if name == "time" or name not in (b.dtype.names or ()):
            continue
        mine, yours = (np.ascontiguousarray(run[name]).reshape(len(common), -1) for run in (one, other))
        x, y = mine.astype(float), yours.astype(float)
        unequal = (mine != yours) | (np.signbit(x) != np.signbit(y))
        unequal &= ~(np.isnan(x) & np.isnan(y))
        rows = unequal.any(axis=1)
        if not rows.any():
            continue
        gap = np.where(unequal, np.abs(y - x), 0.0)
        nan = np.isnan(gap)
        gap = np.where(nan, 0.0, gap).max(axis=1)
        at = int(np.argmax(gap))
        found.append(
            FieldDifference(
                name,
                float(seconds[int(np.argmax(rows))]),
                int(rows.sum()),
                float(gap[at]),
                float(seconds[at]),
                int(nan.any(axis=1).sum()),
            )
        )
    found.sort(key=lambda row: row.first_s)
    return Exact(len(a), len(b), len(common), found)
