"""Frequencies of the spectra: equal steps, or steps that are fine about the resonances and long between them.

Spectrum of the lift along the cable, rebuilt from the words of the source, which prints no formula.

S_ff(x, x', f) = q(x) q(x') sqrt(S_C(x, f) S_C(x', f)) R(x - x'),   q = rho D V^2 / 2
S_C(x, f) = sum over k of c_k N(f; k f_s, k sigma_f),   sigma_f = St sigma_V / D,   one-sided, c_k mean squares
"""

from __future__ import annotations

from math import pi, sqrt
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.special import erfc

from . import modes
from .span import Correlation, LiftBlock, Line, Method, Reading, Span

READINGS = {  # factor on the shedding frequency of the lift, factor on the correlation length
    Reading.A: (1.0, 1.0),
    Reading.B: (0.15 / 0.17, 1.0),
    Reading.C: (0.145 / 0.17, sqrt(2.0)),
}
AVERAGED = {Correlation.GAUSSIAN: 0.99, Correlation.EXPONENTIAL: 1.9}  # segments; a longer L_c: points do
NEGLIGIBLE = 1e-13  # of the largest eigenvalue of the correlation

MAX_STEPS, EQUAL = 20_000, 2_000  # steps; more equal ones than the second are not taken where none is asked for
TAIL = 4.0  # standard deviations of the lift above its top frequency
FINE = 0.05  # of a half width near a resonance: mesh that the uneven steps are laid out on
OFF = 1e-3  # of a frequency: what finite differences may be from it


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


class Grid(NamedTuple):
    frequency: np.ndarray  # Hz
    width: np.ndarray  # Hz, of the step that each stands for


class Lift(NamedTuple):
    """Where the lift is."""

    narrowest: float  # Hz, standard deviation of the narrowest peak
    shed: float  # Hz, top of its first order
    top: float  # Hz, top of all orders


def lift_range(span: Span, line: Line) -> Lift:
    """Width and ends of the lift spectrum."""
    slower = READINGS[span.lift.reading][0]
    ends = np.array((0.0, line.length))
    widths = slower * line.strouhal * span.flow.turbulence / line.diameter(np.concatenate((ends, line.knots)))
    shed = slower * line.shedding_range[1] + TAIL * float(widths.max())
    return Lift(float(widths.min()), shed, (int(np.flatnonzero(span.lift.mean_squares)[-1]) + 1) * shed)


def even_steps(span: Span, line: Line, f: np.ndarray, ratios: np.ndarray) -> tuple[float, int]:
    """Step [Hz] and number of equal steps: those asked for, else as fine as the narrowest peak everywhere."""
    found, asked = lift_range(span, line), span.response
    narrowest = min(float((ratios * f).min()), found.narrowest)
    step = asked.frequency_step or narrowest / asked.steps_per_half_width
    return step, asked.frequencies or int(np.ceil(found.top / step))


def grid(span: Span, line: Line, f: np.ndarray, ratios: np.ndarray) -> Grid:
    """Frequencies of the spectra; f [Hz], ratios: of the modes. More than MAX_STEPS are refused by checks.py."""
    step, number = even_steps(span, line, f, ratios)
    if span.response.frequency_step or span.response.frequencies or number <= EQUAL:
        return Grid(step * np.arange(1, number + 1), np.full(number, step))
    return uneven(span, line, f, ratios)


def uneven(span: Span, line: Line, f: np.ndarray, ratios: np.ndarray) -> Grid:
    """Steps of sqrt(w^2 + (f - f_n)^2) over the steps in a half width w = zeta_n f_n, f_n the nearest resonance.

    That is f = f_n + w sinh(u) with equal steps of u: all of the resonance in a few points. Resonances beyond the modes
    with a damping ratio count, as far as the lift reaches; no step is longer than the lift takes.
    """
    found, fine = lift_range(span, line), float(span.response.steps_per_half_width)
    place, half, spread = _resonances(span, line, f, ratios, found.top)
    mesh = _mesh(place, half, spread, found.top)
    right = np.clip(np.searchsorted(place, mesh), 1, max(1, len(place) - 1))
    near = [_step(mesh, place[i], half[i], spread[i]) for i in (right - 1, np.minimum(right, len(place) - 1))]
    step = np.minimum(np.minimum(*near), found.narrowest) / fine
    count = np.concatenate(((0.0,), np.cumsum(0.5 * np.diff(mesh) * (1.0 / step[1:] + 1.0 / step[:-1]))))
    at = PchipInterpolator(count, mesh)
    middles = np.arange(max(1, int(count[-1]))) + 0.5
    return Grid(at(middles), at(middles, 1))


def _step(f, place, half, spread):
    """Half width, growing with the distance from where the resonance may be."""
    return np.hypot(half, np.maximum(np.abs(f - place) - spread, 0.0))


def _resonances(span: Span, line: Line, f, ratios, top: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place, half width and uncertainty [Hz] of the resonances up to a frequency, of one at least."""
    count = max(len(f), modes.count_up_to(line, top) + 1)
    place = modes.frequencies(line, count)
    half = np.interp(place, f, ratios * f)
    spread = np.zeros(count)
    if span.response.method is Method.EXACT:
        exact = modes.exact_frequencies(line, count)
        off = exact / place[: len(exact)]
        spread = (OFF + abs(off[-1] - 1.0)) * place
        spread[: len(exact)] = OFF * place[: len(exact)]
        place = np.sort(np.concatenate((exact, place[len(exact) :] * off[-1])))
    return place, half, spread


def _mesh(place, half, spread, top: float) -> np.ndarray:
    """Ascending frequencies from 0 to top, close where the steps change."""
    between = 0.5 * (place[1:] + place[:-1])
    low, high = np.concatenate(((0.0,), between)), np.concatenate((between, (max(top, 2.0 * place[-1]),)))
    parts = [np.array((0.0, top))]
    for at, width, flat, a, b in zip(place, half, spread, low, high, strict=True):
        if a >= top:
            break
        maximum = np.arcsinh((b - a) / width)
        out = flat + width * np.sinh(np.arange(0.0, maximum + FINE, FINE))
        parts.append(np.concatenate((at - out, (at,), at + out)).clip(a, min(b, top)))
    mesh = np.unique(np.concatenate(parts))
    return mesh[np.concatenate(((True,), np.diff(mesh) > 1e-12 * top))]
