"""Contact of a line on one surface, point by point along the cable, read from the product's own contact detection.

A contact point is a Gauss point of the assembly. Line loads of single contact points swing about their mean where
elements are coarser than the bending boundary layer sqrt(EI/T); what is reported of a stretch is therefore the sum of
load times weight.
"""

from __future__ import annotations

from functools import cached_property
from math import degrees

import numpy as np

from cable_sim_ros.physics.contact import CONTACT_POINTS_PER_ELEMENT
from cable_sim_ros.physics.hermite import W5, X5
from cable_sim_ros.sim.rig.rig import Rig


class ContactPoints:
    """Stations of a line on a drum or sheave. Lengths [m], angles [rad] from the vertical to +x, line loads [N/m]."""

    def __init__(self, rows: np.ndarray, axis: np.ndarray):
        """rows: CONTACT_POINT records [contact points] of the surface; axis: its unit axis [3]."""
        self.rows, self.axis = rows, axis

    @property
    def s(self) -> np.ndarray:
        """Unstretched arc length."""
        return self.rows["place"]

    @property
    def weight(self) -> np.ndarray:
        """Length of cable a contact point stands for."""
        return self.rows["length"]

    @cached_property
    def radial(self) -> np.ndarray:
        """Unit vectors from the axis to the contact points [contact points, 3]."""
        rel = self.rows["rel"]
        out = rel - (rel @ self.axis)[:, None] * self.axis
        return out / np.sqrt(np.sum(out * out, axis=1) + 1e-30)[:, None]  # never over zero on the axis

    @cached_property
    def angle(self) -> np.ndarray:
        """Place round the surface."""
        return np.arctan2(self.radial[:, 0], self.radial[:, 2])

    @property
    def flanks(self) -> np.ndarray:
        """Normal line load of the half on the contact point's own side and of the other one [contact points, 2]."""
        return np.column_stack((self.rows["load_own"], self.rows["load_other"]))

    @property
    def gap(self) -> np.ndarray:
        """Height of the centreline above its seat, negative where it presses in."""
        return self.rows["height"]

    @cached_property
    def force(self) -> np.ndarray:
        """Line load of the surface on the cable [contact points, 3]."""
        r = self.rows
        return r["load_own"][:, None] * r["normal_own"] + r["load_other"][:, None] * r["normal_other"] + r["rub"]

    @cached_property
    def load(self) -> np.ndarray:
        """Radial line load."""
        return np.sum(self.force * self.radial, axis=1)

    @property
    def resultant(self) -> np.ndarray:
        """Total force of the surface on the cable [N]."""
        return self.weight @ self.force

    def mean(self, low: float, high: float, what: np.ndarray | None = None) -> float:
        """Line load (or another column) averaged over the contact points between two angles round the surface."""
        inside = (self.angle >= low) & (self.angle <= high)
        if not inside.any():
            return float("nan")
        values = self.load if what is None else what
        return float(self.weight[inside] @ values[inside] / self.weight[inside].sum())

    def fit(self, low: float, high: float, at: float) -> float:
        """Radial line load at an angle, of the parabola through the contact points between two angles."""
        inside = (self.angle >= low) & (self.angle <= high)
        degree = min(2, int(inside.sum()) - 1)
        if degree < 0:
            return float("nan")
        return float(np.polyfit(self.angle[inside] - at, self.load[inside], degree, w=self.weight[inside] ** 0.5)[-1])

    def edges(self) -> tuple[float, float] | None:
        """Angles where contact begins and ends: zero of the gap, between the contact points where it changes sign."""
        on = np.flatnonzero((self.gap < 0.0) & (self.load > 0.0))
        if not len(on):
            return None
        return self._edge(on[0], on[0] - 1), self._edge(on[-1], on[-1] + 1)

    def _edge(self, inside: int, outside: int) -> float:
        if not 0 <= outside < len(self.gap):
            return float(self.angle[inside])
        a, b = self.gap[inside], self.gap[outside]
        fraction = a / (a - b) if b > a else 0.0
        return float(self.angle[inside] + fraction * (self.angle[outside] - self.angle[inside]))

    def ends(self, inside: float, reach: float) -> list[tuple[float, float]] | None:
        """Both ends of the contact as (place [rad], concentrated reaction [N]), first the one at the smaller angle.

        A rigid cylinder carries the line load ``inside`` up to the end and a point force there. A penalty spreads that
        over a length of its own; reported is the rigid load with the same force and the same moment as the computed one
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

    def boundary(self, wrap: float, reach: float) -> dict[str, float | None]:
        """Of a wrap [rad]: angle lost at each end and by the gap [deg], end reaction [N], line load inside [N/m]; None:
        there is no such thing."""
        edges = self.edges()
        if edges is None:
            return dict.fromkeys(("lost", "end", "inside", "gap"))
        centre, half = 0.5 * sum(edges), 0.3 * 0.5 * (edges[1] - edges[0])
        inside = self.mean(centre - half, centre + half)
        found = {"lost": None, "end": None, "inside": inside, "gap": degrees(0.5 * (wrap - edges[1] + edges[0]))}
        ends = self.ends(inside, reach)
        if ends is not None:
            (low, first), (high, last) = ends
            found |= {"lost": degrees(0.5 * (wrap - high + low)), "end": 0.5 * (first + last)}
        return found


def contact_points(rig: Rig, surface: int = 0, q: np.ndarray | None = None) -> ContactPoints:
    """Contact on one of a rig's surfaces, of the present state or of a sample q of a run."""
    count = CONTACT_POINTS_PER_ELEMENT * (rig.nodes - 1)
    rows = rig.contact_table(q)[surface * count : (surface + 1) * count]
    return ContactPoints(rows.copy(), rig.state.surfaces["axis"][surface].copy())
