"""What the peers share: how a run is set, whether a code is there, how it is kept quiet."""

from __future__ import annotations

import os
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from typing import NamedTuple

import numpy as np

from ..ours import mesh_text
from ..scenes import static_shape


class Setting(NamedTuple):
    """Mesh as ((length share, elements), ...) from the top, step [s] of the caller; what only some codes have: own
    step [s], points an element for drag or contact, penalty of a contact [N/m]. ``note``: what else was chosen."""

    mesh: tuple[tuple[float, int], ...]
    dt: float
    inner: float = 0.0
    points: int = 0
    penalty: float = 0.0
    note: str = ""

    @property
    def elements(self) -> int:
        return sum(n for _, n in self.mesh)

    def arc(self, length: float) -> np.ndarray:
        """Arc length [m] of the nodes."""
        return np.concatenate(
            ([0.0], np.cumsum(np.repeat(*zip(*((fraction * length / n, n) for fraction, n in self.mesh), strict=True))))
        )

    def __str__(self) -> str:
        more = (
            (self.inner, f"inner step {1e3 * self.inner:g} ms"),
            (self.points, f"{self.points} points an element"),
            (self.penalty, f"contact {self.penalty:g} N/m"),
        )
        return ", ".join((mesh_text(self.mesh), f"{1e3 * self.dt:g} ms", *(text for value, text in more if value)))


def even(n: int, dt: float, **more) -> Setting:
    """Equal elements."""
    return Setting(((1.0, n),), dt, **more)


def installed(code: str) -> str | None:
    """Version of a peer, None where it is not installed."""
    try:
        return version(code)
    except PackageNotFoundError:
        return None


def static_places(arc: np.ndarray) -> np.ndarray:
    """Places [nodes, 2] (x, z, m) on the reference's static shape of P5, to settle from."""
    shape = static_shape()
    return np.column_stack([np.interp(arc, shape[:, 0], shape[:, k]) for k in (1, 2)])


def static_tension(arc: np.ndarray) -> np.ndarray:
    """Tension [N] of the same."""
    return np.interp(arc, static_shape()[:, 0], static_shape()[:, 3])


@contextmanager
def silent():
    """Nothing of what a library prints from C reaches the terminal."""
    kept, null = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(null)
