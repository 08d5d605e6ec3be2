"""Frequencies of the spectra: equal steps, or steps that are fine about the resonances and long between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from . import lift, modes
from .span import Line, Method, Span

MAX_STEPS, EQUAL = 20_000, 2_000  # steps; more equal ones than the second are not taken where none is asked for
TAIL = 4.0  # standard deviations of the lift above its top frequency
FINE = 0.05  # of a half width near a resonance: mesh that the uneven steps are laid out on
OFF = 1e-3  # of a frequency: what finite differences may be from it


class Grid(NamedTuple):
    frequency: np.ndarray  # Hz
    width: np.ndarray  # Hz, of the step that each stands for
    even: bool


class Lift(NamedTuple):
    """Where the lift is."""

    narrowest: float  # Hz, standard deviation of the narrowest peak
    shed: float  # Hz, top of its first order
    top: float  # Hz, top of all orders


def lift_range(span: Span, line: Line) -> Lift:
    """Width and ends of the lift spectrum."""
    slower = lift.READINGS[span.lift.reading][0]
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
        return Grid(step * np.arange(1, number + 1), np.full(number, step), True)
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
    return Grid(at(middles), at(middles, 1), False)


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
