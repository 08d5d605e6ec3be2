"""Mesh of a tow whose winch feeds cable: how many elements, how long, and where."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .scene import Scene
from .statics import Route


class FeedMesh(NamedTuple):
    """Where the nodes stand, see physics/feed.py."""

    aboard: np.ndarray  # [n] m from the drum's tangent point, the first 0
    shares: tuple[np.ndarray, ...]  # of each section's zone: shares of its length, ascending, the last 1
    least: np.ndarray  # [sections] m from the last node aboard, nearer the end of a zone does not come

    @property
    def boundaries(self) -> np.ndarray:
        """Node at the outboard end of each section."""
        return len(self.aboard) - 1 + np.cumsum([len(s) for s in self.shares])

    @property
    def nodes(self) -> int:
        return int(self.boundaries[-1]) + 1

    @property
    def blend(self) -> float:
        """Way [m] over which the end of a zone lets go of the end of its section."""
        return 0.5 * float(self.least[0])


FINE = 0.25  # element on the sheave over its radius


def feed_mesh(scene: Scene) -> FeedMesh | None:
    """The scene's mesh; None where it is fixed to the material."""
    route = Route(scene)
    if not route.feeds:
        return None
    import os

    inboard, fine, before, after = 2, int(os.environ.get("FINE", 12)), 0.1, float(os.environ.get("AFTER", 0.15))
    bend = route.on_sheave(0.3)
    begin = route.span - before
    aboard = np.concatenate(
        (np.linspace(0.0, begin, inboard + 1), np.linspace(begin, route.span + bend + after, fine + 1)[1:])
    )
    sections = list(scene.cable.sections.values())
    counts = [int(c) for c in os.environ.get("OUT", "10,6").split(",")]
    shares = []
    for i, n in enumerate(counts):
        x = np.linspace(0.0, 1.0, n + 1)[1:]
        shares.append(x**2.0 if i == 0 else x)
    size = aboard[-1] - aboard[-2]
    least = np.cumsum([n * size for n in counts])
    return FeedMesh(aboard, tuple(shares), least)
