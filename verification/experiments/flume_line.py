"""The line of the flume tank, Westin (2018) 4.3.1: bending stiffness, damping of its first mode, drag factor.

The photograph of the bend test is not printed: the golden section is tried on points of our own line, scattered so that
the sum of squares is the one that he found.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot, pi, sqrt

import numpy as np

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.sim.rig.rig import Rig

from ..cables import uniform
from ..cases.modes import transverse
from ..shipped import scene_with
from . import Comparison, unjudged
from .turbulence import CENTRE, LINE
from .viv_tow import Landing, land

LENGTH, MASS, LINE_MASS, DIAMETER, EI = 0.0464, 1.33e-3, 0.2e-3, 0.45e-3, 2.82e-6
TOW, GRAVITY, MODULUS = 1.01, 9.81, 1.40e9
SECOND_MOMENT = pi * DIAMETER**4 / 64.0
POINTS, BEND_ERROR = 25, 2.54e-7  # of the photograph; his sum of squares [m^2]
RANGE_EI, RANGE_G = (2e-6, 6e-6), (1.0, 2.0)  # of his golden sections
SOURCE = "Westin (2018) 4.3"


def golden(cost: Callable[[float], float], low: float, high: float, width: float) -> float:
    """Argument of the least cost between low and high, by golden section until the bracket is ``width`` wide."""
    ratio = 0.5 * (sqrt(5.0) - 1.0)
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    at_a, at_b = cost(a), cost(b)
    while high - low > width:
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - ratio * (high - low)
            at_a = cost(a)
        else:
            low, a, at_a = a, b, at_b
            b = low + ratio * (high - low)
            at_b = cost(b)
    return 0.5 * (low + high)


def bent(bending: float, elements: int = 20) -> np.ndarray:
    """Nodes [elements + 1, 2] x, z [m] of the clamped line with the sphere at its end."""
    cable = uniform(
        LENGTH, elements, LINE_MASS, 1e7 * bending / LENGTH**2, bending_stiffness=bending, compression_share=1.0
    )
    rig = Rig(cable, held={0: "rg"}, tension=(MASS + LINE_MASS * LENGTH) * GRAVITY, bodies={elements: MASS})
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rig.settle()
    return rig.state.q[:, [0, 2]].copy()


def off(points: np.ndarray, line: np.ndarray) -> float:
    """(141): sum of squares [m^2] of the shortest distances of points [n, 2] from a polygon [m, 2]."""
    start, along = line[:-1], np.diff(line, axis=0)
    part = np.einsum("nmk,mk->nm", points[:, None] - start, along) / np.sum(along**2, axis=1)
    foot = start + np.clip(part, 0.0, 1.0)[..., None] * along
    return float(np.sum((points[:, None] - foot) ** 2, axis=2).min(axis=1).sum())


def photograph(bending: float, seed: int, error: float = BEND_ERROR) -> np.ndarray:
    """25 points [25, 2] on a line of that stiffness, scattered so that (141) is as large as he found."""
    line = bent(bending, 60)
    points = line[np.linspace(2, 60, POINTS).round().astype(int)]
    return points + np.random.default_rng(seed).normal(0.0, sqrt(error / POINTS), points.shape)


def stiffness_of(points: np.ndarray) -> float:
    """EI [N m^2] whose line is nearest to the points, by golden section over his range."""
    return golden(lambda ei: off(points, bent(ei)), *RANGE_EI, 2e-9)


def bend_rows(seeds: int = 5) -> list[Comparison]:
    """Golden section on made points whose stiffness is known, and the modulus that his stiffness means."""
    found = [stiffness_of(photograph(EI, seed)) for seed in range(seeds)]
    exact = stiffness_of(photograph(EI, 0, 0.0))
    worst = max(found, key=lambda ei: abs(ei - EI))
    unit, missing = "1e-6 N m^2", "points of the photograph are not printed"
    return [
        Comparison("EI / I of the bend test", "GPa", EI / SECOND_MOMENT * 1e-9, 1.40, 0.005, SOURCE),
        Comparison("EI from exact points of our own line", unit, 1e6 * exact, 1e6 * EI, 0.005, "golden section"),
        Comparison(f"EI, worst of {seeds} sets of points with his scatter", unit, 1e6 * worst, 1e6 * EI, None, missing),
    ]


def damping_per_c(elements: int = 24) -> tuple[float, float]:
    """Damping ratio of the first mode over c [1/(N s)] of the hanging, clamped line.

    Of his (55), which resists the rate of the gradient, and of the product's damping, which resists the rate of strain
    and curvature (c EI/EA).
    """
    cable = uniform(TOW, elements, LINE_MASS, MODULUS * 0.25 * pi * DIAMETER**2, bending_stiffness=EI)
    rig = Rig(cable, held={0: "rg"}, tension=(MASS + LINE_MASS * TOW) * GRAVITY, bodies={elements: MASS})
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    omega, shapes, weights = transverse(rig)
    full = np.zeros((rig.nodes, 2))
    full.reshape(-1)[2:] = shapes[:, 0]  # node by node: displacement and gradient; the clamped ones stay zero
    mass, h = float(shapes[:, 0] @ weights[:, 0]), TOW / elements
    x, w = np.polynomial.legendre.leggauss(4)
    xi, w = 0.5 * (x + 1.0), 0.5 * h * w
    first = np.stack([(6 * xi**2 - 6 * xi) / h, 1 - 4 * xi + 3 * xi**2, (6 * xi - 6 * xi**2) / h, 3 * xi**2 - 2 * xi])
    second = np.stack([(12 * xi - 6) / h**2, (6 * xi - 4) / h, (6 - 12 * xi) / h**2, (6 * xi - 2) / h])
    ends = np.hstack([full[:-1], full[1:]])
    slope, bend = (float(np.sum((ends @ rows) ** 2 @ w)) for rows in (first, second))
    share = EI / (MODULUS * 0.25 * pi * DIAMETER**2)
    return slope / (2.0 * omega[0] * mass), share * bend / (2.0 * omega[0] * mass)


def parameter_rows() -> list[Comparison]:
    """Damping and the two drag factors: tuned as he did, and computed by the law of strumming."""
    of_55, ours = damping_per_c()
    base = load_scene("flume")

    def off_centre(at: Landing) -> float:
        return hypot(at.x - CENTRE[0], at.z - CENTRE[1])

    def away(factor: float) -> float:
        return off_centre(land(override(base, {f"{LINE}.drag_amplification": factor})))

    tuned, his = golden(away, *RANGE_G, 2e-3), f"{SOURCE}.1: his tuned one leaves 5.0"
    strum = {"viv.law": "govardhan_williamson", "viv.damping_ratio": 0.061}
    plain = {f"{LINE}.drag_amplification": 1.0, f"{LINE}.drag_law": "driscoll_nahon"}
    computed = land(scene_with(base, plain | strum))  # Reynolds numbers below those of the law: said on its page
    return [
        Comparison("damping ratio of the first mode over c, (55)", "1/(N s)", of_55, 112.72, 0.1127, f"{SOURCE}.1"),
        Comparison("c for the damping ratio of 0.061", "1e-4 N s", 610.0 / of_55, 5.4, 0.05, f"{SOURCE}.1"),
        unjudged(
            "the same mode over c, damping of strain and curvature",
            "1/(N s)",
            ours,
            "the product: a swing without bending is not damped",
        ),
        Comparison("drag factor tuned to the centroid, golden section", "1", tuned, 1.737, None, f"{SOURCE}.1: tuned"),
        Comparison("what the tuned factor leaves of the place", "mm", 1e3 * away(tuned), 0.0, 5.0, f"{SOURCE}.1"),
        unjudged("drag factor computed, damping 0.061", "1", computed.factor, "strumming"),
        Comparison("what the computed factor leaves of the place", "mm", 1e3 * off_centre(computed), 0.0, 5.0, his),
    ]
