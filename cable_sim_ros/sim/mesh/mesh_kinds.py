"""Where the nodes of a fed mesh stand, and how a length is cut into elements."""

from __future__ import annotations

from math import ceil, log
from typing import NamedTuple

import numpy as np

from ...compiler.jit import plain
from ...errors import CableSimError
from ...physics.mesh_motion import at_least as _at_least
from ..tables.elementary import exp

_smooth = plain(_at_least)  # plain Python: a scene loads without compiling


SPREAD = 20.0  # mean element of a section over its shortest


class MeshError(CableSimError, ValueError):
    """No mesh as asked for; key, text and remedy as in a Problem."""

    def __init__(self, key: str, text: str, remedy: str):
        super().__init__(f"{key} {text}. {remedy}")
        self.key, self.text, self.remedy = key, text, remedy


class FeedMesh(NamedTuple):
    """Where the nodes stand, see physics/mesh_motion.py. A section is one zone, or several."""

    aboard: np.ndarray  # [n] m from the drum's tangent point, the first 0
    fractions: tuple[np.ndarray, ...]  # of each zone: fractions of its length, ascending, the last 1
    minimum: np.ndarray  # [zones] m from the last node aboard, nearer the end of a zone does not come
    ends: np.ndarray  # [zones] m from the cable's inner end: the material at the end of a zone
    sections: np.ndarray  # [zones] index of the section that a zone is of

    @property
    def last_zones(self) -> np.ndarray:
        """Zone at the outboard end of each section."""
        return np.append(np.flatnonzero(np.diff(self.sections)), len(self.sections) - 1)

    @property
    def boundaries(self) -> np.ndarray:
        """Node at the outboard end of each section."""
        return (len(self.aboard) - 1 + np.cumsum([len(s) for s in self.fractions]))[self.last_zones]

    @property
    def section_fractions(self) -> list[np.ndarray]:
        """Of each section: fractions of its length, over all its zones."""
        begins = np.concatenate(([0.0], self.ends[:-1]))
        out, first = [], 0
        for last in self.last_zones:
            zones = range(first, int(last) + 1)
            places = [
                begins[i] + s * (self.ends[i] - begins[i]) for i, s in zip(zones, self.fractions[first : last + 1])
            ]
            length = self.ends[last] - begins[first]
            out.append(self.fractions[first] if first == last else (np.concatenate(places) - begins[first]) / length)
            first = int(last) + 1
        return out

    @property
    def nodes(self) -> int:
        return len(self.aboard) + sum(len(s) for s in self.fractions)

    @property
    def doubled(self) -> FeedMesh:
        """Every element halved."""
        cut = [halved(np.concatenate(([0.0], fraction)))[1:] for fraction in self.fractions]
        return self._replace(aboard=halved(self.aboard), fractions=tuple(cut))

    @property
    def blend(self) -> float:
        """Way [m] over which the end of a zone lets go of the end of its section."""
        return 0.5 * float(self.minimum[0])


class Part(NamedTuple):
    """A row of the table of a mesh: lengths [m] of its shortest and longest element at the start, and why."""

    name: str
    place: str  # where it stands: with the ship, or outboard
    elements: int
    shortest: float
    longest: float
    reason: str


class Expected(NamedTuple):
    """Error promised with ``scope`` [m] out: of the tension (relative), of the body's place [m].

    nan, nothing is promised: the static shape does not close there, the tow comes to the surface.
    """

    scope: float
    tension: float
    position: float


class MeshPlan(NamedTuple):
    """A mesh with its reasons."""

    mesh: FeedMesh
    parts: tuple[Part, ...]
    expected: tuple[Expected, ...]
    tick: float  # s, that would do
    tolerance: float  # of the working tension, to which forces are solved


def places_outboard(mesh: FeedMesh, total: float, tangent: float) -> np.ndarray:
    """Arc lengths from the last node aboard on, as physics/mesh_motion.py lays them, with ``tangent`` m on the drum."""
    last = tangent + mesh.aboard[-1]
    ends = np.array([_smooth(float(b - last), float(low), mesh.blend)[0] for b, low in zip(mesh.ends, mesh.minimum)])
    ends[-1] = total - last
    places, begin = [np.zeros(1)], 0.0
    for end, fraction in zip(ends, mesh.fractions, strict=True):
        places.append(begin + fraction * (end - begin))
        begin = end
    return last + np.concatenate(places)


def halved(places: np.ndarray) -> np.ndarray:
    """Places with one more in the middle between each two."""
    out = np.empty(2 * len(places) - 1)
    out[::2], out[1::2] = places, 0.5 * (places[1:] + places[:-1])
    return out


def ends(sizes: np.ndarray) -> tuple[float, float]:
    """Shortest and longest."""
    return float(sizes.min()), float(sizes.max())


def even(length: float, size: float) -> np.ndarray:
    """Equal parts of ``length`` of at most ``size``."""
    count = max(0, ceil(length / size - 1e-6))
    return np.full(count, length / count) if count else np.zeros(0)


def graded(length: float, size: float, maximum: float) -> np.ndarray:
    """Parts of ``length`` that double from ``size`` to at most ``maximum``."""
    parts, done, part = [], 0.0, size
    while done < length - 1e-9 * (length + size):
        parts.append(part)
        done += part
        part = min(2.0 * part, maximum)
    return np.array(parts) * (length / done) if parts else np.zeros(0)


def geometric(count: int, ratio: float) -> np.ndarray:
    """Shares of elements whose last is ``ratio`` times as long as the first."""
    sizes = exp(np.linspace(0.0, log(ratio), count)) if count > 1 else np.ones(1)
    out = np.cumsum(sizes) / sizes.sum()
    out[-1] = 1.0
    return out


def equal_parts(x: np.ndarray, density: np.ndarray, count: int) -> np.ndarray:
    """Shares that cut the integral of ``density`` over x from 0 to 1 into equal parts; no part below mean / SPREAD."""
    density = np.minimum(density, SPREAD * count)
    integral = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(x))))
    out = np.interp(np.linspace(0.0, 1.0, count + 1)[1:], integral / integral[-1], x)
    out[-1] = 1.0
    return out
