"""Spectrum of the lift along the cable, rebuilt from the words of the source, which prints no formula.

S_ff(x, x', f) = q(x) q(x') sqrt(S_C(x, f) S_C(x', f)) R(x - x'),   q = rho D V^2 / 2
S_C(x, f) = sum over k of c_k N(f; k f_s, k sigma_f),   sigma_f = St sigma_V / D,   one-sided, c_k mean squares
"""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
from scipy.special import erfc

from .span import Correlation, LiftBlock, Line, Reading

READINGS = {  # factor on the shedding frequency of the lift, factor on the correlation length
    Reading.A: (1.0, 1.0),
    Reading.B: (0.15 / 0.17, 1.0),
    Reading.C: (0.145 / 0.17, sqrt(2.0)),
}
AVERAGED = {Correlation.GAUSSIAN: 0.99, Correlation.EXPONENTIAL: 1.9}  # segments; a longer L_c: points do
NEGLIGIBLE = 1e-13  # of the largest eigenvalue of the correlation


def coefficient_spectrum(line: Line, block: LiftBlock, turbulence: float, x: np.ndarray, f: np.ndarray) -> np.ndarray:
    """S_C [1/Hz], array (frequencies, len(x))."""
    slower = READINGS[block.reading][0]
    centre = slower * line.shedding(x)
    width = slower * line.strouhal * turbulence / line.diameter(x)
    out = np.zeros((len(f), len(x)))
    for k, square in enumerate(block.mean_squares, 1):
        if square:
            out += square / (k * width * sqrt(2.0 * pi)) * np.exp(-0.5 * ((f[:, None] / k - centre) / width) ** 2)
    return out


def load(line: Line, block: LiftBlock, turbulence: float, x: np.ndarray, f: np.ndarray) -> np.ndarray:
    """q sqrt(S_C) [N/m/sqrt(Hz)], array (frequencies, len(x))."""
    q = 0.5 * line.density * line.diameter(x) * line.flow(x) ** 2
    return q * np.sqrt(coefficient_spectrum(line, block, turbulence, x, f))


def correlation(block: LiftBlock, length: float, x: np.ndarray) -> np.ndarray:
    """R(x - x'), array (len(x), len(x)), x [m] in equal steps; length L_c [m] before the factor of the reading.

    Where L_c is shorter than a segment or so, the mean of R over pairs of segments about x and x': points that know
    nothing of each other would carry more lift than the segments they stand for.
    """
    length = length * READINGS[block.reading][1]
    distance, segment = np.abs(x[:, None] - x), float(x[1] - x[0])
    if length < AVERAGED[block.correlation] * segment:
        return _averaged(block.correlation, length / segment, np.rint(distance / segment))
    distance = distance / length
    return np.exp(-distance if block.correlation is Correlation.EXPONENTIAL else -0.5 * distance**2)


def _averaged(law: Correlation, length: float, apart: np.ndarray) -> np.ndarray:
    """Mean of R over two segments whose middles are ``apart`` segments from each other; length: L_c in segments.

    Exact: the second difference of the second integral of R, which is a line and what falls away with the distance.
    """
    slope = length if law is Correlation.EXPONENTIAL else length * sqrt(0.5 * pi)

    def falling(d):
        if law is Correlation.EXPONENTIAL:
            return length**2 * np.exp(-d / length)
        return length**2 * np.exp(-0.5 * (d / length) ** 2) - slope * d * erfc(d / (sqrt(2.0) * length))

    lags = np.arange(1.0, apart.max() + 1.0)
    own = 2.0 * (falling(1.0) + slope - length**2)
    others = falling(lags + 1.0) - 2.0 * falling(lags) + falling(lags - 1.0)
    return np.concatenate(((own,), others))[apart.astype(int)]


def patterns(block: LiftBlock, length: float, x: np.ndarray) -> np.ndarray:
    """Independent patterns of lift B with B B^T = R, array (len(x), patterns)."""
    values, vectors = np.linalg.eigh(correlation(block, length, x))
    kept = values > NEGLIGIBLE * values[-1]
    return vectors[:, kept] * np.sqrt(values[kept])
