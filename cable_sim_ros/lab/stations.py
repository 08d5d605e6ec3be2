"""Contact of a line on one surface, station by station along the cable, from the product's own contact law.

A station is a Gauss point of the assembly. Line loads of single stations swing about their mean where elements are
coarser than the bending boundary layer sqrt(EI/T); what is told of a stretch is therefore the sum of load times weight.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..physics.contact import touch
from ..physics.jit import driver
from ..physics.observe import point_of
from ..physics.shape import W5, X5

S, WEIGHT, ANGLE, FIRST, SECOND, GAP, DEPTH, FORCE, RADIAL = 0, 1, 2, 3, 4, 5, 6, 7, 10
COLUMNS = 11
POINTS = 5


@driver
def touched(arc, q, v, surface, table):
    """Fill table [5 elements, COLUMNS] for every Gauss point of the cable, in order."""
    for e in range(arc.shape[0] - 1):
        length = arc[e + 1] - arc[e]
        for g in range(5):
            r, w, _ = point_of(arc, q, v, e, X5[g])
            o = touch(r, w, surface)
            er, n1, n2, f1, f2 = o[0], o[7], o[8], o[9], o[13]
            row = table[5 * e + g]
            row[0], row[1] = arc[e] + X5[g] * length, W5[g] * length
            row[2] = np.arctan2(er[0], er[2])
            row[3], row[4], row[5] = f1, f2, o[3]
            row[6] = max(o[4], o[5])
            for k in range(3):
                row[7 + k] = f1 * n1[k] + f2 * n2[k]
            row[10] = row[7] * er[0] + row[8] * er[1] + row[9] * er[2]


class Stations(NamedTuple):
    """Table of one line on one surface. Lengths [m], angles [rad] from the vertical towards +x, line loads [N/m]."""

    table: np.ndarray  # [stations, COLUMNS]

    @property
    def s(self) -> np.ndarray:
        """Unstretched arc length."""
        return self.table[:, S]

    @property
    def weight(self) -> np.ndarray:
        """Length of cable a station stands for."""
        return self.table[:, WEIGHT]

    @property
    def angle(self) -> np.ndarray:
        """Place round the surface."""
        return self.table[:, ANGLE]

    @property
    def flanks(self) -> np.ndarray:
        """Normal line load of both flanks [stations, 2]."""
        return self.table[:, [FIRST, SECOND]]

    @property
    def gap(self) -> np.ndarray:
        """Height of the centreline above its seat, negative where it presses in."""
        return self.table[:, GAP]

    @property
    def load(self) -> np.ndarray:
        """Radial line load."""
        return self.table[:, RADIAL]

    @property
    def resultant(self) -> np.ndarray:
        """Total force of the surface on the cable [N]."""
        return self.weight @ self.table[:, FORCE : FORCE + 3]

    def mean(self, low: float, high: float, what: np.ndarray | None = None) -> float:
        """Line load (or another column) averaged over the stations between two angles round the surface."""
        inside = (self.angle >= low) & (self.angle <= high)
        if not inside.any():
            return float("nan")
        values = self.load if what is None else what
        return float(self.weight[inside] @ values[inside] / self.weight[inside].sum())

    def fit(self, low: float, high: float, at: float) -> float:
        """Radial line load at an angle, of the parabola through the stations between two angles."""
        inside = (self.angle >= low) & (self.angle <= high)
        degree = min(2, int(inside.sum()) - 1)
        if degree < 0:
            return float("nan")
        return float(np.polyfit(self.angle[inside] - at, self.load[inside], degree, w=self.weight[inside] ** 0.5)[-1])

    def edges(self) -> tuple[float, float] | None:
        """Angles where contact begins and ends: zero of the gap, between the stations where it changes sign."""
        on = np.flatnonzero((self.gap < 0.0) & (self.load > 0.0))
        if not len(on):
            return None
        return self._edge(on[0], on[0] - 1), self._edge(on[-1], on[-1] + 1)

    def _edge(self, inside: int, outside: int) -> float:
        if not 0 <= outside < len(self.gap):
            return float(self.angle[inside])
        a, b = self.gap[inside], self.gap[outside]
        share = a / (a - b) if b > a else 0.0
        return float(self.angle[inside] + share * (self.angle[outside] - self.angle[inside]))

    def ends(self, inside: float, reach: float) -> list[tuple[float, float]] | None:
        """Both ends of the contact as (place [rad], concentrated reaction [N]), first the one at the smaller angle.

        A rigid cylinder carries the line load ``inside`` up to the end and a point force there. A penalty spreads that
        over a length of its own; told is the rigid load with the same force and the same moment as the computed one
        from the edge to ``reach`` [m] inside, never beyond the middle. None where there is no such load.
        """
        edges = self.edges()
        if edges is None or self.angle[-1] <= self.angle[0]:
            return None
        low, high = np.interp(edges, self.angle, self.s)
        reach = min(reach, 0.5 * (high - low))
        bounds = self.s[0] - X5[0] / W5[0] * self.weight[0] + np.concatenate(([0.0], np.cumsum(self.weight)))
        found = []
        for edge, inward in ((low, 1.0), (high, -1.0)):
            cut = bounds[np.abs(bounds - (edge + inward * reach)).argmin()]
            depth = inward * (cut - self.s)
            load = self.weight * self.load * (depth > 0.0)
            force, moment = load.sum(), load @ depth
            left = force * force - 2.0 * inside * moment
            if not left >= 0.0 or not inside > 0.0:
                return None
            place = cut - inward * (force - left**0.5) / inside
            found.append((float(np.interp(place, self.s, self.angle)), float(left**0.5)))
        return found


def stations(line, surface: int = 0, q: np.ndarray | None = None, v: np.ndarray | None = None) -> Stations:
    """Contact of a line (Rig.line) on one of its surfaces, of the present state or of a sample of a run."""
    table = np.zeros((POINTS * (len(line.arc) - 1), COLUMNS))
    touched(
        line.arc,
        line.q if q is None else np.ascontiguousarray(q),
        line.v if v is None else np.ascontiguousarray(v),
        line.surfaces[surface],
        table,
    )
    return Stations(table)
