"""Scratch of assembly and solver: lane tables of one group of elements, and the block-tridiagonal system."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .ancf import K9_ROWS, ROWS
from .banded import COLUMNS, FACTOR_COLUMNS
from .drag import POINT_ROWS
from .jit import LANES

# powers [W] and works [J]: what the cable's own forces take (inertia, weight, stiffness, damping), what damping loses
# of it, and what water, surfaces, held nodes and loads give to the cable; a body counts with water, surfaces and own
OWN, LOST_POWER, WATER, SURFACES, HELD, LOADS = range(6)
POWERS = 6

UNKNOWNS, MEAN_UNKNOWNS = 36, 12
TENSION, ENERGY, WEIGHT, WET, NEAR, LOST, SUM = range(7)  # WET: 1 wet, 0 dry, -1 crossing the surface
LANE_ROWS = 7


class Work(NamedTuple):
    """Scratch of the assembly and the solver; nothing in it outlives a call."""

    x: np.ndarray  # [36, LANES] scaled unknowns, velocities, accelerations
    mean: np.ndarray  # [12, LANES] running mean of the scaled velocities
    p: np.ndarray  # [ROWS, LANES]
    force: np.ndarray  # [12, LANES]
    k: np.ndarray  # [144, LANES]
    k9: np.ndarray  # [K9_ROWS, LANES]
    point: np.ndarray  # [POINT_ROWS, LANES]
    load: np.ndarray  # [points, 3, LANES]
    by_place: np.ndarray  # [points, 9, LANES] derivative of the load of a point to N_j y_j
    by_slope: np.ndarray  # [points, 9, LANES] the same to N_j' y_j
    mixed: np.ndarray  # [points, 9, LANES]
    lane: np.ndarray  # [LANE_ROWS, LANES]: TENSION, ENERGY, WEIGHT, WET, NEAR, LOST, SUM
    cut_x: np.ndarray  # [36, LANES], cut_mean [12, LANES], cut_p [ROWS, LANES], cut_n and cut_d [4, LANES],
    cut_mean: np.ndarray  # cut [4, LANES]: the element that crosses the water surface, a point a lane: unknowns, rows,
    cut_p: np.ndarray  # N_i, N_i', and weight, xi, side of the moving bound, bounds of the wet intervals
    cut_n: np.ndarray
    cut_d: np.ndarray
    cut: np.ndarray
    power: np.ndarray  # [POWERS] W, of the last assembly
    band: np.ndarray  # [nodes, 6, COLUMNS]
    lower: np.ndarray  # [nodes, 6, 6]
    factor: np.ndarray  # [nodes, 6, FACTOR_COLUMNS] of the solve
    step: np.ndarray  # [nodes, 6] solution


def make_work(nodes: int) -> Work:
    """Scratch for a cable of ``nodes`` nodes."""
    z = np.zeros
    return Work(
        x=z((UNKNOWNS, LANES)),
        mean=z((MEAN_UNKNOWNS, LANES)),
        p=z((ROWS, LANES)),
        force=z((12, LANES)),
        k=z((144, LANES)),
        k9=z((K9_ROWS, LANES)),
        point=z((POINT_ROWS, LANES)),
        load=z((5, 3, LANES)),
        by_place=z((5, 9, LANES)),
        by_slope=z((5, 9, LANES)),
        mixed=z((5, 9, LANES)),
        lane=z((LANE_ROWS, LANES)),
        cut_x=z((UNKNOWNS, LANES)),
        cut_mean=z((MEAN_UNKNOWNS, LANES)),
        cut_p=z((ROWS, LANES)),
        cut_n=z((4, LANES)),
        cut_d=z((4, LANES)),
        cut=z((4, LANES)),
        power=z(POWERS),
        band=z((nodes, 6, COLUMNS)),
        lower=z((nodes, 6, 6)),
        factor=z((nodes, 6, FACTOR_COLUMNS)),
        step=z((nodes, 6)),
    )
