"""The sea of a scene as tables for kernels: spectra and seeds become regular waves and sinusoids at configure time.

JONSWAP, Hasselmann et al. (1973), S(w) ~ w^-5 exp(-5/4 (w/w_p)^-4) gamma^exp(-(w/w_p - 1)^2/(2 s^2)), s = 0.07 below
and 0.09 above the peak, scaled so that the band kept holds Hs^2/16. The band is cut into as many parts as there are
components, each has one wave with the energy of its part at a frequency drawn from it by the seed (so that the sea does
not repeat), with a random phase, and with spreading a direction drawn from cos^2s. The parts are equal in a mean of
energy and fourth moment: with parts of equal energy the last of 100 reaches from 3 to 6 times the peak, and the fourth
moment, to which accelerations and steepness go, hangs on where in it one wave falls (42 % of it from seed to seed; so
3 %). Turbulence: von Karman, S(f) ~ (1 + 70.8 (f T)^2)^-5/6, each axis by parts of equal energy.
"""

from __future__ import annotations

import math
from math import pi

import numpy as np

from ...physics.sea import EDDY_COLUMNS, PROFILE_COLUMNS, SEA_SETTINGS, WAVE_COLUMNS, Sea
from ...physics.water import CurrentTable, CurrentVariation, Turbulence, Water, WaveKind, Waves
from .elementary import exp, log, power, tanh

BAND = 0.5, 6.0  # of the peak frequency: outside lies 2e-4 of the energy of a jonswap sea
EDDY_BAND = 30.0  # over the time scale, rad: 92 % of the energy of a von Karman spectrum lies below
LOWEST_EDDY = math.log(1e-4)  # of the band, in powers of e: points are even in the logarithm
NEGLIGIBLE = 1e-5  # of the deviation of the velocity at the surface: what a component may bring where it is left out
HIGHEST = 6.0  # deviations of the elevation: higher a sea of any length does not come
FINE = 20001  # points of a cumulative spectrum
TAIL = 0.1  # share of the components that go by the fourth moment, the rest go by energy


def wave_number(omega: np.ndarray, gravity: float, depth: float) -> np.ndarray:
    """k [1/m] of w^2 = g k tanh(k d) by Newton from the deep water's; omega [rad/s]; depth [m], infinite: deep."""
    deep = omega**2 / gravity
    if not np.isfinite(depth):
        return deep
    k = deep / np.sqrt(tanh(deep * depth))  # Eckart
    for _ in range(20):
        t = tanh(k * depth)
        k = k - (k * t - deep) / (t + k * depth * (1.0 - t * t))
    return k


def jonswap(omega: np.ndarray, peak: float, gamma: float) -> np.ndarray:
    """Shape of the spectrum at omega [rad/s], not scaled; peak [rad/s]."""
    x = omega / peak
    width = np.where(x <= 1.0, 0.07, 0.09)
    return power(x, -5.0) * exp(-1.25 * power(x, -4.0)) * power(gamma, exp(-0.5 * ((x - 1.0) / width) ** 2))


def cumulated(density: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Share of the weight under a density up to each of the points at which it is given."""
    weight = np.concatenate(([0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(at))))
    return weight / weight[-1]


def drawn(density: np.ndarray, at: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """One value from each of ``count`` parts of equal weight under a density given at points: [count], ascending."""
    return np.interp((np.arange(count) + rng.random(count)) / count, cumulated(density, at), at)


def components(
    density: np.ndarray, omega: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [rad/s] of ``count`` waves, ascending, and their shares of the energy, of a spectrum given at omega.

    A frequency is drawn by energy within its part, so that no moment of the spectrum is biased.
    """
    energy, fourth = cumulated(density, omega), cumulated(density * omega**4, omega)
    bounds = np.interp(np.arange(count + 1) / count, (1.0 - TAIL) * energy + TAIL * fourth, energy)
    part = np.diff(bounds)
    return np.interp(bounds[:-1] + rng.random(count) * part, energy, omega), part


def wave_table(waves: Waves, gravity: float, depth: float) -> np.ndarray:
    """[n, WAVE_COLUMNS] of physics/sea.py, deepest reach first; without rows where there are no waves."""
    if waves.kind is WaveKind.OFF or waves.height == 0.0:
        return np.zeros((0, WAVE_COLUMNS))
    peak, n = 2.0 * pi / waves.period, waves.components
    towards = np.radians(waves.towards_deg)
    if waves.kind is WaveKind.AIRY:
        omega, amplitude = np.array([peak]), np.array([0.5 * waves.height])
        phase, b = np.zeros(1), np.array([towards])
    else:
        rng = np.random.default_rng(waves.seed)
        band = np.linspace(BAND[0] * peak, BAND[1] * peak, FINE)
        omega, part = components(jonswap(band, peak, waves.gamma), band, n, rng)
        amplitude = 0.25 * waves.height * np.sqrt(2.0 * part)
        phase = 2.0 * pi * rng.random(n)
        b = np.full(n, towards)
        if waves.spreading is not None:
            angle = np.linspace(-pi, pi, FINE)
            b += rng.permutation(drawn(power(np.cos(0.5 * angle), 2.0 * waves.spreading), angle, n, rng))
    k = wave_number(omega, gravity, depth)
    bottom = exp(-2.0 * k * depth)
    norm = 1.0 / (1.0 - bottom)
    speed = amplitude * omega * norm
    minimum = NEGLIGIBLE * np.sqrt(0.5 * (speed**2).sum())
    reach = log(np.maximum(speed * (1.0 + bottom) / minimum, 1.0)) / k
    table = np.stack([amplitude, k, omega, phase, b, norm, bottom, reach], 1)
    return table[np.argsort(-reach, kind="stable")]


def cubics(x: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """[intervals, PROFILE_COLUMNS]: two values by monotone C1 cubics (Fritsch & Butland (1984), scipy's PCHIP)."""
    from scipy.interpolate import PchipInterpolator  # a fifth of a start that only currents by depth wait for

    pieces = np.zeros((len(x) - 1, PROFILE_COLUMNS))
    pieces[:, 0], pieces[:, 1] = x[:-1], x[1:]
    pieces[:, 2:6], pieces[:, 6:] = PchipInterpolator(x, u).c.T, PchipInterpolator(x, v).c.T
    return pieces


def table_values(table: CurrentTable) -> tuple[np.ndarray, np.ndarray]:
    """Components of the current at the rows of a table, m/s."""
    if table.speed is not None and table.towards_deg is not None:
        angle = np.radians(table.towards_deg)
        speed = np.array(table.speed, float)
        return speed * np.cos(angle), speed * np.sin(angle)
    none = (0.0,) * len(table.depth or ())
    return np.array(table.east or none, float), np.array(table.north or none, float)


def profile_table(table: CurrentTable) -> np.ndarray:
    """Current by height in the frame the scene gives it in [intervals, PROFILE_COLUMNS]."""
    if table.depth is None:
        return np.zeros((0, PROFILE_COLUMNS))
    u, v = table_values(table)
    return cubics(-np.array(table.depth)[::-1], u[::-1], v[::-1])


def variation_table(variation: CurrentVariation) -> np.ndarray:
    """Factor and turn [rad] of the current by time [intervals, PROFILE_COLUMNS]."""
    if variation.time is None:
        return np.zeros((0, PROFILE_COLUMNS))
    n = len(variation.time)
    factor, turn = np.array(variation.factor or (1.0,) * n), np.radians(variation.turn_deg or (0.0,) * n)
    return cubics(np.array(variation.time, float), factor, turn)


def eddy_table(turbulence: Turbulence) -> np.ndarray:
    """Sinusoids of the turbulence [n, EDDY_COLUMNS]."""
    rng, rows = np.random.default_rng(turbulence.seed), [np.zeros((0, EDDY_COLUMNS))]
    if not any(deviation > 0.0 for deviation in turbulence.deviation):
        return rows[0]  # every start asks, and a spectrum takes milliseconds
    top, n = EDDY_BAND / turbulence.time_scale, turbulence.components
    band = np.concatenate(([0.0], top * exp(np.linspace(LOWEST_EDDY, 0.0, FINE))))
    spectrum = power(1.0 + 70.8 * (0.5 / pi * band * turbulence.time_scale) ** 2, -5.0 / 6.0)
    for axis, deviation in enumerate(turbulence.deviation):
        omega, phase = drawn(spectrum, band, n, rng), 2.0 * pi * rng.random(n)  # also of an axis that is left out
        if deviation > 0.0:
            size = np.full(n, deviation * np.sqrt(2.0 / n))
            rows.append(np.stack([np.full(n, float(axis)), size, omega, phase], 1))
    return np.concatenate(rows)


def sea_of(water: Water, gravity: float, depth: float | None) -> Sea:
    """The tables of a scene's water; depth: of the seabed [m], None: deep."""
    waves = wave_table(water.waves, gravity, np.inf if depth is None else depth)
    settings = np.zeros(1, SEA_SETTINGS)
    settings["ramp"] = water.ramp
    total, deviation = waves[:, 0].sum(), np.sqrt(0.5 * (waves[:, 0] ** 2).sum())
    settings["crest"] = min(total, HIGHEST * deviation)
    return Sea(
        waves,
        profile_table(water.current_table),
        variation_table(water.current_variation),
        eddy_table(water.turbulence),
        settings,
    )
