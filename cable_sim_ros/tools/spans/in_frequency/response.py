"""Vibration of a span: spectra, rms displacement and acceleration along it.

    S_vv(s, f) = int int S_ff(x, x', f) G(s, x) G*(s, x') dx dx',   rms^2 = int S_vv df     (5.3)

With the correlation of the lift taken apart into patterns B (B B^T = R), S_vv is the sum over them of the squared
response to the forces q sqrt(S_C) B dx: positive by construction. The integral over x is the plain sum over the points
of a uniform grid, over f the sum over steps (grid.py).

Response by finite differences: the other route, without the assumption that the tension varies slowly.

Green's function of the damped string, (5.1)-(5.6) mended: neither sinh nor cosh, every factor bounded by 1.

With mu = a - i b and a travel time t: sin(mu t) = e^(b t) u(t), u(t) = (e^(i a t) - e^(-i a t - 2 b t)) / 2i, |u| <= 1.
The growing factors of G add up to e^(-b |tau(s) - tau(x)|).
"""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_banded
from scipy.sparse import csr_matrix

from . import grid, modes
from . import modes as damping
from .modes import bands
from .span import Line, Method, Span

CELLS_PER_WAVE, MIN_CELLS, MAX_CELLS = 60, 400, 20_000

CHUNK = 4_000_000  # complex numbers of a table at a time


def wave(mu: np.ndarray, t: np.ndarray) -> np.ndarray:
    """u(t) for the complex frequencies mu [rad/s] and travel times t [s]: sin(mu t) without its growth."""
    a, b = mu.real, -mu.imag
    return (np.exp(1j * a * t) - np.exp(-1j * a * t - 2.0 * b * t)) / 2j


def damped(omega, rate):
    """mu [rad/s] of (5.6), mu^2 = omega^2 - i omega r/m_t with rate = r/m_t [1/s]; Im mu < 0, motion e^(i omega t)."""
    return np.sqrt(np.asarray(omega) ** 2 - 1j * np.asarray(omega) * rate)


def parts(line: Line, mu: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Strings whose Green's functions add up to that of the cable: (mu, factor) of each.

    Without bending stiffness the string itself. With it the string that its travelling waves go like, (5.21), less the
    one of what stays near the force: exact for constant tension and pinned ends.
    """
    if not line.bend:
        return [(mu, np.ones_like(mu))]
    root = np.sqrt(1.0 + 4.0 * line.bend * mu**2)
    return [
        (mu * np.sqrt(2.0 / (1.0 + root)), 1.0 / root),
        (-1j * np.sqrt((1.0 + root) / (2.0 * line.bend)), -1.0 / root),
    ]


def respond_by_green(line: Line, s: np.ndarray, mu: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Displacement (len(s), frequencies, loads) by point forces at the same places s.

    s [m] ascending; mu (frequencies,) as `damped` gives it; load (len(s), frequencies, loads) [N].
    """
    out = np.zeros(load.shape, complex)
    for part, factor in parts(line, mu):
        out += _sweep(line, s, part, factor, load)
    return out


def _sweep(line: Line, s, mu, factor, load) -> np.ndarray:
    """`respond_by_green` of one string, once up and once down the cable."""
    tau = line.travel_time(s)
    amplitude = 1.0 / np.sqrt(line.impedance(s))
    up, down = wave(mu, tau[:, None]), wave(mu, line.time_left(s)[:, None])  # (len(s), frequencies)
    decay = np.exp(mu.imag * np.diff(tau)[:, None])
    out = np.empty(load.shape, complex)
    held = np.zeros(load.shape[1:], complex)
    for i in range(len(s)):  # forces at and below s
        if i:
            held *= decay[i - 1][:, None]
        held += (amplitude[i] * up[i])[:, None] * load[i]
        out[i] = down[i][:, None] * held
    held[:] = 0.0
    for i in range(len(s) - 1, 0, -1):  # forces above s
        held += (amplitude[i] * down[i])[:, None] * load[i]
        held *= decay[i - 1][:, None]
        out[i - 1] += up[i - 1][:, None] * held
    return out * amplitude[:, None, None] * (factor / (mu * wave(mu, np.asarray(line.crossing))))[:, None]


def cells_for(line: Line, top: float) -> int:
    """Cells of a grid that resolves the waves of frequency top [Hz] where they are shortest."""
    at = np.linspace(0.0, line.length, 401)
    slowest = np.sqrt(line.tension(at) / line.mass(at)).min()
    return int(min(max(CELLS_PER_WAVE * line.length * top / slowest, MIN_CELLS), MAX_CELLS))


def fraction(line: Line, s: np.ndarray, cells: int) -> csr_matrix:
    """Matrix (len(s), cells - 1) that interpolates values of the inner points at s; its transpose shares out forces."""
    at = np.clip(s / line.length * cells, 0.0, cells)
    left = np.minimum(at.astype(int), cells - 1)
    rows = np.tile(np.arange(len(s)), 2)
    columns, weights = np.concatenate((left, left + 1)), np.concatenate((1.0 - (at - left), at - left))
    inner = (columns > 0) & (columns < cells)
    return csr_matrix((weights[inner], (rows[inner], columns[inner] - 1)), shape=(len(s), cells - 1))


def respond(line: Line, s: np.ndarray, mu: np.ndarray, load: np.ndarray, top: float) -> np.ndarray:
    """As `respond_by_green`; top [Hz], the largest frequency of all, sets the grid."""
    cells = cells_for(line, top)
    stiffness, mass = bands(line, cells)
    order = 2 if line.stiffness else 1
    kept = stiffness[2 - order : 3 + order].astype(complex)
    at = fraction(line, s, cells)
    out = np.empty(load.shape, complex)
    for k, square in enumerate(mu**2):
        matrix = kept.copy()
        matrix[order] -= square * mass
        out[:, k] = at @ solve_banded((order, order), matrix, at.T @ load[:, k], overwrite_ab=True, check_finite=False)
    return out


class Vibration(NamedTuple):
    """What vibration() answers; arrays along arc have len(arc), those of modes len(frequencies)."""

    name: str
    frequencies: np.ndarray  # Hz, f_n of (3.23) with the stiffness of (5.21)
    frequencies_exact: np.ndarray  # Hz, by finite differences, of the first 50 modes
    damping_ratios: np.ndarray  # as used
    damping_computed: np.ndarray  # as computed, whether given or not
    damping_whole: np.ndarray  # as computed with the whole cable damping
    driven: list[list[tuple[float, float]]]  # m, power-in regions of each mode
    shedding: tuple[float, float]  # Hz, least and largest f_s along the cable
    correlation_length: float  # m, L_c
    arc: np.ndarray  # m, s
    modes: np.ndarray  # (modes, arc), phi_n
    rms_displacement: np.ndarray  # m
    rms_acceleration: np.ndarray  # m/s^2
    diameters: np.ndarray  # rms displacement over the diameter there
    place: float  # m, where the spectra are
    place_rms_displacement: float  # m
    place_rms_acceleration: float  # m/s^2
    frequency: np.ndarray  # Hz, of the spectra
    frequency_width: np.ndarray  # Hz, of the step that each frequency stands for
    displacement_spectrum: np.ndarray  # m^2/Hz, one-sided, at the place
    acceleration_spectrum: np.ndarray  # m^2/s^4/Hz
    reading: str  # of the lift spectrum
    method: str  # of the response
    frequency_step: float  # Hz, the shortest
    segments: int  # that the lift acts on


def leading(result: Vibration, maximum: int) -> list[int]:
    """Modes (from 0) of the largest mean square at the place, by the spectrum up to half way to their neighbours."""
    between = 0.5 * (result.frequencies[1:] + result.frequencies[:-1])
    fraction = np.zeros(len(result.frequencies))
    np.add.at(
        fraction, np.searchsorted(between, result.frequency), result.displacement_spectrum * result.frequency_width
    )
    return sorted(int(n) for n in np.argsort(-fraction, kind="stable")[:maximum])


def count_modes(span: Span, line: Line) -> int:
    """Modes with a damping ratio: asked for, or as many as were given, or those up to the top shedding frequency."""
    if span.response.modes or span.damping.ratios:
        return span.response.modes or len(span.damping.ratios)
    return modes_shed(line)


def modes_shed(line: Line) -> int:
    """Modes up to the top shedding frequency, one at least."""
    return max(1, modes.count_up_to(line, line.shedding_range[1]))


def correlation_length(span: Span, line: Line) -> float:
    """L_c [m]: given, or (4.19) with the modes up to the top shedding frequency, whatever modes have a ratio."""
    return span.lift.correlation_length or span.cable.length / (2.0 * modes_shed(line))


def vibration(span: Span, progress: Callable[[str, int, int], object] = lambda *_: None) -> Vibration:
    """Compute the vibration of a span. Seconds, minutes on thousands of segments; nothing random.

    progress: called with what is computed, frequencies done, frequencies in all.
    """
    line = Line(span)
    count = count_modes(span, line)
    f_n = modes.frequencies(line, count)
    length = correlation_length(span, line)
    damped = damping.damping(line, span.damping, count, length)
    ratios = np.array(span.damping.ratios) if span.damping.ratios else damped.ratios
    frequency, width = grid.grid(span, line, f_n, ratios)

    arc = np.linspace(0.0, line.length, span.response.points + 1)
    place = span.response.place
    seen = arc if place is None else np.unique(np.append(arc, place))
    spectra = spectrum(span, line, seen, frequency, f_n, ratios, length, progress)
    fourth = (2.0 * pi * frequency[:, None]) ** 4
    displacement = np.sqrt(width @ spectra)
    acceleration = np.sqrt(width @ (fourth * spectra))
    at = np.searchsorted(seen, arc)
    here = int(displacement.argmax()) if place is None else int(np.searchsorted(seen, place))
    return Vibration(
        name=span.name,
        frequencies=f_n,
        frequencies_exact=modes.exact_frequencies(line, count),
        damping_ratios=ratios,
        damping_computed=damped.ratios,
        damping_whole=damped.whole,
        driven=damped.driven,
        shedding=line.shedding_range,
        correlation_length=length,
        arc=arc,
        modes=modes.shapes(line, arc, count),
        rms_displacement=displacement[at],
        rms_acceleration=acceleration[at],
        diameters=displacement[at] / line.diameter(arc),
        place=float(seen[here]),
        place_rms_displacement=float(displacement[here]),
        place_rms_acceleration=float(acceleration[here]),
        frequency=frequency,
        frequency_width=width,
        displacement_spectrum=spectra[:, here],
        acceleration_spectrum=(fourth * spectra)[:, here],
        reading=span.lift.reading.value,
        method=span.response.method.value,
        frequency_step=float(width.min()),
        segments=span.response.segments,
    )


def spectrum(span: Span, line: Line, seen, frequency, f_n, ratios, length, progress=lambda *_: None) -> np.ndarray:
    """Displacement spectra S_vv [m^2/Hz], one-sided, array (len(frequency), len(seen)).

    seen: ascending places s [m]; frequency [Hz]; f_n, ratios: of the modes, between which r = 2 zeta omega m_t is
    linear in the frequency and beyond which it is constant; length: L_c [m].
    """
    x = np.linspace(0.0, line.length, span.response.segments + 1)
    forces = grid.patterns(span.lift, length, x) * (line.length / span.response.segments)
    local = grid.load(line, span.lift, span.flow.turbulence, x, frequency)
    omega = 2.0 * pi * frequency
    mu = damped(omega, np.interp(frequency, f_n, 4.0 * pi * ratios * f_n))
    s = np.unique(np.concatenate((x, seen)))
    loaded, reported = np.searchsorted(s, x), np.searchsorted(s, seen)
    out = np.empty((len(frequency), len(seen)))
    chunk = max(1, CHUNK // (len(s) * forces.shape[1]))
    for start in range(0, len(frequency), chunk):
        progress(span.name, start, len(frequency))
        part = slice(start, start + chunk)
        load = np.zeros((len(s), len(frequency[part]), forces.shape[1]))
        load[loaded] = local[part].T[:, :, None] * forces[:, None, :]
        if span.response.method is Method.EXACT:
            y = respond(line, s, mu[part], load, float(frequency[-1]))
        else:
            y = respond_by_green(line, s, mu[part], load)
        y = y[reported]
        out[part] = (y.real**2 + y.imag**2).sum(2).T
    return out
