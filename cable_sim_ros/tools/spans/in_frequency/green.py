"""Green's function of the damped string, (5.1)-(5.6) mended: neither sinh nor cosh, every factor bounded by 1.

With mu = a - i b and a travel time t: sin(mu t) = e^(b t) u(t), u(t) = (e^(i a t) - e^(-i a t - 2 b t)) / 2i, |u| <= 1.
The growing factors of G add up to e^(-b |tau(s) - tau(x)|).
"""

from __future__ import annotations

import numpy as np

from .span import Line


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


def green(line: Line, s, x, omega, rate) -> np.ndarray:
    """G(s, x) [m/N]: displacement at s by a unit force at x; omega [rad/s], rate = r/m_t [1/s]. Shapes broadcast."""
    low, high = np.minimum(s, x), np.maximum(s, x)
    first, last, left = line.travel_time(low), line.travel_time(high), line.time_left(high)
    amplitude = 1.0 / np.sqrt(line.impedance(s) * line.impedance(x))
    crossing = np.asarray(line.crossing)
    out = 0.0
    for mu, factor in parts(line, damped(omega, rate)):
        both = wave(mu, first) * wave(mu, left) / wave(mu, crossing)
        out = out + factor / mu * both * np.exp(mu.imag * (last - first))
    return out * amplitude


def respond(line: Line, s: np.ndarray, mu: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Displacement (len(s), frequencies, loads) by point forces at the same places s.

    s [m] ascending; mu (frequencies,) as `damped` gives it; load (len(s), frequencies, loads) [N].
    """
    out = np.zeros(load.shape, complex)
    for part, factor in parts(line, mu):
        out += _sweep(line, s, part, factor, load)
    return out


def _sweep(line: Line, s, mu, factor, load) -> np.ndarray:
    """`respond` of one string, once up and once down the cable."""
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
