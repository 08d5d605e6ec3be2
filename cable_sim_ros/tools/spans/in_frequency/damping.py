"""Damping ratios of the modes: drag of the parts of the cable that do not drive the mode, (4.15)-(4.21)."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from . import modes
from .line import Line
from .span import DampingBlock, Region


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
    f = modes.frequencies(line, count)
    inside = region(line, s, f, block.region, correlation_length)
    drag = block.drag_coefficient * block.drag_amplification * 0.5 * line.density
    resistance = block.motion_factor * drag * line.diameter(s) * line.flow(s)  # R(s), (4.8)
    power = resistance * modes.shapes(line, s, count, block.mode_shape) ** 2
    scale = line.length / block.segments / (4.0 * pi * f * modes.modal_mass(line, block.mode_shape))
    ratios = np.where(inside, 0.0, power).sum(1) * scale + block.structural
    whole = power.sum(1) * scale + block.structural
    return Damping(ratios, whole, [runs(s, row) for row in inside])


def runs(s: np.ndarray, inside: np.ndarray) -> list[tuple[float, float]]:
    """Intervals [from, to] of s in which a mask is set."""
    edges = np.flatnonzero(np.diff(np.concatenate(((0,), inside.astype(int), (0,)))))
    return [(float(s[a]), float(s[b - 1])) for a, b in zip(edges[::2], edges[1::2], strict=True)]
