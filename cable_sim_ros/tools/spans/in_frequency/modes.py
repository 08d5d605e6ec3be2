"""Modes: frequencies and shapes, WKB in closed form and exact by finite differences; damping ratios by the drag of the
parts of the cable that do not drive the mode, (4.15)-(4.21).
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np
from scipy.integrate import trapezoid
from scipy.sparse import dia_matrix, diags
from scipy.sparse.linalg import eigsh

from .span import DampingBlock, Line, Region, Shape

MIN_CELLS, CELLS_PER_MODE = 400, 40  # of the finite differences
MAX_EXACT = 50  # modes; the error of WKB falls as the square of the mode number
DIAGONALS = (2, 1, 0, -1, -2)


def string_frequencies(line: Line, count: int) -> np.ndarray:
    """omega_n of the string without stiffness [rad/s]: n pi / tau(L), (3.23)."""
    return np.arange(1, count + 1) * pi / line.crossing


def frequencies(line: Line, count: int) -> np.ndarray:
    """Frequencies of modes 1 to count [Hz], with the bending stiffness of (5.21)."""
    omega = string_frequencies(line, count)
    return omega * np.sqrt(1.0 + line.bend * omega**2) / (2.0 * pi)


def count_up_to(line: Line, top: float) -> int:
    """Modes with a frequency up to top [Hz], rounded: (3.23) and (5.21) the other way round."""
    omega = 2.0 * pi * top
    string = omega * np.sqrt(2.0 / (1.0 + np.sqrt(1.0 + 4.0 * line.bend * omega**2)))
    return round(float(string * line.crossing / pi))


def shapes(line: Line, s: np.ndarray, count: int, shape: Shape = Shape.WKB) -> np.ndarray:
    """phi_n(s), array (count, len(s)): (3.24) with its amplitude, or the plain sine as printed."""
    phase = string_frequencies(line, count)[:, None] * line.travel_time(s)
    if shape is Shape.SINE:
        return np.sin(phase)
    return np.sqrt(line.impedance(0.0) / line.impedance(s)) * np.sin(phase)


def modal_mass(line: Line, shape: Shape = Shape.WKB) -> float:
    """M_n [kg], the same for all modes: sqrt(m T_c) tau(L) / 2; for the plain sine half the mass, as printed."""
    if shape is Shape.SINE:
        s = np.linspace(0.0, line.length, 2001)
        return float(0.5 * trapezoid(line.mass(s), s))
    return 0.5 * float(line.impedance(0.0)) * line.crossing


def bands(line: Line, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness (5, n) and mass (n,) of the n = cells - 1 inner points by second differences, ends pinned.

    Of -d/ds(T dy/ds) + E I d4y/ds4: diagonals 2 to -2 by column, as LAPACK takes them.
    """
    h = line.length / cells
    pull = line.tension((np.arange(cells) + 0.5) * h) / h
    out = np.zeros((5, cells - 1))
    out[2] = pull[1:] + pull[:-1]
    out[1, 1:] = out[3, :-1] = -pull[1:-1]
    if line.stiffness:
        bend = line.stiffness / h**3
        out[2] += 6.0 * bend
        out[2, [0, -1]] -= bend  # no moment at the ends
        out[1, 1:] -= 4.0 * bend
        out[3, :-1] -= 4.0 * bend
        out[0, 2:] += bend
        out[4, :-2] += bend
    return out, line.mass(np.arange(1, cells) * h) * h


def exact_frequencies(line: Line, count: int) -> np.ndarray:
    """Frequencies of modes 1 to count, 50 at most [Hz], by finite differences on two grids, extrapolated."""
    count = min(count, MAX_EXACT)
    cells = max(MIN_CELLS, CELLS_PER_MODE * count)
    coarse, fine = (_squares(line, n, count) for n in (cells, 2 * cells))
    return np.sqrt((4.0 * fine - coarse) / 3.0) / (2.0 * pi)


def _squares(line: Line, cells: int, count: int) -> np.ndarray:
    """omega_n^2 of the finite differences, ascending."""
    stiffness, mass = bands(line, cells)
    matrix = dia_matrix((stiffness, DIAGONALS), shape=(cells - 1, cells - 1))
    root = diags([1.0 / np.sqrt(mass)], [0])
    scaled = (root @ matrix @ root).tocsc()
    values = eigsh(scaled, k=count, sigma=0.0, v0=np.ones(cells - 1), return_eigenvectors=False)
    return np.sort(values)


class Damping(NamedTuple):
    ratios: np.ndarray  # zeta_n, structural part included
    whole: np.ndarray  # zeta_n if no part of the cable drove the mode (H = 1)
    driven: list[list[tuple[float, float]]]  # m, power-in regions [from, to] of each mode


def region(line: Line, s: np.ndarray, f: np.ndarray, law: Region, correlation_length: float) -> np.ndarray:
    """Whether s drives mode n, array (modes, len(s)); f [Hz] are the frequencies of modes 1, 2, ...

    A mode above the top shedding frequency is not driven.
    """
    shed = line.shedding(s)
    if law is Region.OFF:
        return np.zeros((len(f), len(s)), bool)
    off = shed - f[:, None]
    if law is Region.HALF_SPACING:
        inside = np.abs(off) < 0.5 * f[0]
    else:
        inside = np.zeros(off.shape, bool)
        for n, row in enumerate(off):
            # places where the shedding frequency is that of the mode, between two points
            before = np.flatnonzero((row[:-1] <= 0.0) & (row[1:] > 0.0) | (row[:-1] >= 0.0) & (row[1:] < 0.0))
            for i in before:
                place = s[i] + (s[i + 1] - s[i]) * row[i] / (row[i] - row[i + 1])
                inside[n] |= np.abs(s - place) < correlation_length
    inside[f > line.shedding_range[1]] = False
    return inside


def damping(line: Line, block: DampingBlock, count: int, correlation_length: float) -> Damping:
    """Damping ratios of modes 1 to count.

    The integral is the source's plain sum over the points of a grid, those strictly inside a driven part left out.
    """
    s = np.linspace(0.0, line.length, block.segments + 1)
    f = frequencies(line, count)
    inside = region(line, s, f, block.region, correlation_length)
    drag = block.drag_coefficient * block.drag_amplification * 0.5 * line.density
    resistance = block.motion_factor * drag * line.diameter(s) * line.flow(s)  # R(s), (4.8)
    power = resistance * shapes(line, s, count, block.mode_shape) ** 2
    scale = line.length / block.segments / (4.0 * pi * f * modal_mass(line, block.mode_shape))
    ratios = np.where(inside, 0.0, power).sum(1) * scale + block.structural
    whole = power.sum(1) * scale + block.structural
    return Damping(ratios, whole, [runs(s, row) for row in inside])


def runs(s: np.ndarray, inside: np.ndarray) -> list[tuple[float, float]]:
    """Intervals [from, to] of s in which a mask is set."""
    edges = np.flatnonzero(np.diff(np.concatenate(((0,), inside.astype(int), (0,)))))
    return [(float(s[a]), float(s[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]
