"""Scratch of assembly and solver: lane tables of one group of elements, and the block-tridiagonal system."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..compiler.jit import LANES
from .ancf import K9_ROWS, ROWS
from .block_tridiagonal import COLUMNS, FACTOR_COLUMNS
from .drag import POINT_ROWS
from .sea import NODE_COLUMNS, STREAM_ROWS

# powers [W] and works [J]: what the cable's own forces take (inertia, weight, stiffness, damping), what damping loses
# of it, and what water, surfaces, held nodes, loads and the energy of material that enters give to the cable; a body
# counts with water, surfaces and own; what friction of the cable on surfaces turns into heat is a part of the surfaces'
OWN, LOST_POWER, WATER, SURFACES, HELD, LOADS, FED, RUBBED = range(8)
POWERS = 8
BINS = 257  # bounds of the classes of speed, see viv_amplification.py

UNKNOWNS, MEAN_UNKNOWNS = 36, 12
TENSION, ENERGY, WEIGHT, WET, NEAR, LOST, SUM = range(7)  # WET: 1 wet, 0 dry, -1 crossing the surface
RISE = 7  # elevation of the water surface over the two nodes
LANE_ROWS = 9


# one group of elements in lanes
LANE_TABLES = np.dtype(
    [
        ("x", "f8", (UNKNOWNS, LANES)),  # scaled unknowns, velocities, accelerations
        ("mean_v", "f8", (MEAN_UNKNOWNS, LANES)),  # running mean of the scaled velocities; "mean" is one of numpy's own
        ("force", "f8", (12, LANES)),
        ("k", "f8", (144, LANES)),
        ("k9", "f8", (K9_ROWS, LANES)),
        ("director", "f8", (6, LANES)),  # L g of the two nodes of a link, see link_element.py
        ("point", "f8", (POINT_ROWS, LANES)),
        ("load", "f8", (5, 3, LANES)),  # of each point
        ("by_place", "f8", (5, 9, LANES)),  # derivative of the load of a point to N_j y_j
        ("by_slope", "f8", (5, 9, LANES)),  # the same to N_j' y_j
        ("mixed", "f8", (5, 9, LANES)),
        ("lane", "f8", (LANE_ROWS, LANES)),  # TENSION, ENERGY, WEIGHT, WET, NEAR, LOST, SUM, RISE
        # the element that crosses the water surface, a point a lane: unknowns, mean, rows, N_i, N_i', and weight, xi,
        # side of the moving bound, bounds of the wet intervals
        ("cut_x", "f8", (UNKNOWNS, LANES)),
        ("cut_mean", "f8", (MEAN_UNKNOWNS, LANES)),
        ("cut_p", "f8", (ROWS, LANES)),
        ("cut_n", "f8", (4, LANES)),
        ("cut_d", "f8", (4, LANES)),
        ("cut", "f8", (4, LANES)),
        ("cut_stream", "f8", (STREAM_ROWS, LANES)),
        ("power", "f8", POWERS),  # W, of the last assembly
    ],
    align=True,
)


TURN_COLUMNS = 4  # see kept_tangent.py


class Work(NamedTuple):
    """Scratch of the assembly and the solver; nothing in it outlives a step but the tangent that is kept."""

    lanes: np.ndarray  # LANE_TABLES [1]
    band: np.ndarray  # [nodes, 6, COLUMNS]
    lower: np.ndarray  # [nodes, 6, 6]
    factor: np.ndarray  # [nodes, 6, FACTOR_COLUMNS] of the solve
    step: np.ndarray  # [nodes, 6] solution
    facing: np.ndarray  # [nodes, 3] gradients where the tangent was kept, see kept_tangent.py
    turn: np.ndarray  # [nodes, TURN_COLUMNS] since
    bins: np.ndarray  # [BINS] length of cable up to a speed
    # water beyond the linear current, see sea.py, of the step in hand
    stream: np.ndarray  # [groups, 4, STREAM_ROWS, LANES] at the Gauss points; no groups: there is none
    around: np.ndarray  # [nodes, NODE_COLUMNS] at the bodies; elevation at nodes near the surface too
    phase: np.ndarray  # [waves, 3]
    gusts: np.ndarray  # [6]
    stream_of_body: np.ndarray  # [STREAM_ROWS, LANES]
    body: np.ndarray  # [5, 6, 3] derivatives of the loads of a rigid body, see rigid_body.py
    wake: np.ndarray  # [nodes, 6] load of the wakes, held in a step, see wake_oscillator.py


def make_work(nodes: int, waves: int = 0, streams: bool = False) -> Work:
    """Scratch for a cable of ``nodes`` nodes in a sea of ``waves`` components.

    streams: is there more than a linear current?
    """
    z = np.zeros
    return Work(
        lanes=z(1, LANE_TABLES).view(np.recarray),
        band=z((nodes, 6, COLUMNS)),
        lower=z((nodes, 6, 6)),
        factor=z((nodes, 6, FACTOR_COLUMNS)),
        step=z((nodes, 6)),
        facing=z((nodes, 3)),
        turn=z((nodes, TURN_COLUMNS)),
        bins=z(BINS),
        stream=z((-(-(nodes - 1) // LANES) if streams else 0, 4, STREAM_ROWS, LANES)),
        around=z((nodes, NODE_COLUMNS)),
        phase=z((waves, 3)),
        gusts=z(6),
        stream_of_body=z((STREAM_ROWS, LANES)),
        body=z((5, 6, 3)),
        wake=z((nodes, 6)),
    )
