"""Water that moves otherwise than linearly with depth: waves, current by a table, turbulence. docs/waves.md.

Linear (Airy) waves, each of amplitude A, wave number k, frequency w, towards b, in water of depth d:
    eta = A cos th,   th = k (x cos b + y sin b) - w t + phase,   w^2 = g k tanh(k d)
    u = A w cosh(k(z+d))/sinh(kd) cos th (cos b, sin b),  u_z = A w sinh(k(z+d))/sinh(kd) sin th,  a = du/dt
cosh and sinh over sinh(kd) are N (e^kz +- B e^-kz) with B = e^-2kd, N = 1/(1 - B): nothing overflows. Above z = 0 the
velocity is that of z = 0 (vertical stretching); Dean & Dalrymple (1991), ch. 3; Faltinsen (1990), 2.

A stream is what the water does at a point beyond the linear current of State.memory: eleven numbers, evaluated once a
step at the predicted shape, so that the tangent of the step stays exact. Its current is linear about the predicted
point: EXTRA - SHEAR z.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import NamedTuple

import numpy as np

from ..compiler.jit import LANES, driver, inline
from .ancf import DISPLACED
from .drag import POINT_A, POINT_R, POINT_SHEAR, POINT_V, POINT_W
from .hermite import GAUSS_4_X

# rows of a stream: current beyond the linear one (x y z) and its fall with z (x y), velocity of the waves, acceleration
# of the water; of a node the elevation of the surface over it besides
EXTRA, SHEAR, ORBIT, RATE, ELEVATION = np.array((0, 3, 5, 8, 11))
WIND = 12  # to 17: load of the wind on a node, see wind.py
STREAM_ROWS, NODE_COLUMNS = 11, 18
# columns of the table of waves; REACH: depth [m] below which a component is left out, the table falls with it
AMPLITUDE, NUMBER, FREQUENCY, PHASE, TOWARDS, NORM, BOTTOM, REACH = np.arange(8)
WAVE_COLUMNS = 8
# of the table of the current: an interval of height [m], cubics in z - LOW, highest power first
LOW, HIGH, CUBIC_X, CUBIC_Y = np.array((0, 1, 2, 6))
PROFILE_COLUMNS = 10
# of its variation: an interval of time [s], cubics of factor and turn [rad] in t - LOW, as above
# of turbulence: axis, amplitude [m/s], frequency [rad/s], phase
EDDY_COLUMNS = 4

SEA = np.dtype(
    [
        ("time", "f8"),  # s since the start, at the end of the step begun last
        ("shift", "f8", 2),  # m, of the tow frame in the world the phases of the waves belong to
        ("fraction", "f8", 2),  # of waves and turbulence that acts, and its rate [1/s]: they grow from the start
        ("steady", "f8", 4),  # current at the surface and its gradient before it varies, in the world
        ("current_yaw", "f8"),  # rad, by which tables of current and turbulence are turned into the world
        ("wave_yaw", "f8"),  # the same of the waves
        ("turn", "f8", 2),  # now: factor of the current times cos and sin of its turn into the world
    ],
    align=True,
)
SEA_SETTINGS = np.dtype(
    [
        ("ramp", "f8"),  # s
        ("crest", "f8"),  # m, higher and lower the surface does not come
    ],
    align=True,
)


class Sea(NamedTuple):
    """What the scene says of the water beyond a linear current, read-only; without rows where that is nothing."""

    waves: np.ndarray  # [n, WAVE_COLUMNS], REACH falling
    profile: np.ndarray  # [intervals, PROFILE_COLUMNS], upward
    variation: np.ndarray  # [intervals, PROFILE_COLUMNS]
    eddies: np.ndarray  # [n, EDDY_COLUMNS]
    settings: np.ndarray  # SEA_SETTINGS [1]

    @property
    def rests(self) -> bool:
        """Is there nothing beyond the linear current?"""
        return not any(len(table) for table in self[:4])


@inline
def sincos(angle):
    """Sine and cosine to 1e-11 without a call or a division, so that loops over lanes are vectorised: of half the
    angle, by polynomials through the Chebyshev points of 0 to pi/2."""
    turns = (angle * (0.5 / pi) + 6755399441055744.0) - 6755399441055744.0  # 1.5 * 2^52: to the nearest whole number
    x = 0.5 * (angle - turns * (2.0 * pi))
    q = x * x
    s = q * 1.550250902793809e-10 - 2.5036745008428295e-08
    s = q * s + 2.755712317437327e-06
    s = q * s - 0.0001984126870905615
    s = q * s + 0.008333333330940365
    s = x * (1.0 + q * (q * s - 0.16666666666658467))
    c = q * 2.0043838867607283e-09 - 2.753434319598821e-07
    c = q * c + 2.4801294210170026e-05
    c = q * c - 0.0013888887196553783
    c = q * c + 0.0416666666309018
    c = 1.0 + q * (q * c - 0.49999999999877454)
    return 2.0 * s * c, 1.0 - 2.0 * s * s


@inline
def decay(x):
    """e^x for x <= 0, to 1e-11, held at e^-30: (e^(x/64))^64, vectorised like sincos."""
    y = max(x, -30.0) * 0.015625
    e = y * 2.016731863971514e-05 + 0.00019501074816183152
    e = y * e + 0.0013875636257640153
    e = y * e + 0.00833304509754231
    e = y * e + 0.041666632486559024
    e = y * e + 0.16666666467129349
    e = y * e + 0.4999999999555448
    e = 1.0 + y * (y * e + 0.9999999999998372)
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    return e * e


@driver
def wave_lanes(waves, phase, fraction, top, place, out):
    """Velocity and acceleration of the waves into rows ORBIT and RATE of out [STREAM_ROWS, LANES].

    phase [n, 3]: k cos b, k sin b, phase now; share: see SEA; top: highest z of the points, components that do not
    reach down to it are left out; place: rows POINT_R of a point table.
    """
    if place.shape[1] != LANES or out.shape[1] != LANES:
        raise ValueError("lanes")
    for row in range(ORBIT, ORBIT + 6):
        for e in range(LANES):
            out[row, e] = 0.0
    for i in range(waves.shape[0]):
        if waves[i, REACH] < -top:
            break
        k, omega, norm, bottom = waves[i, NUMBER], waves[i, FREQUENCY], waves[i, NORM], waves[i, BOTTOM]
        kx, ky, now = phase[i, 0], phase[i, 1], phase[i, 2]
        speed = waves[i, AMPLITUDE] * omega * norm
        ux, uy = speed * kx / k, speed * ky / k
        for e in range(LANES):
            s, c = sincos(kx * place[POINT_R, e] + ky * place[POINT_R + 1, e] + now)
            up = decay(k * min(place[POINT_R + 2, e], 0.0))
            down = bottom / up
            across, upward = up + down, speed * (up - down)
            out[ORBIT, e] += ux * across * c
            out[ORBIT + 1, e] += uy * across * c
            out[ORBIT + 2, e] += upward * s
            out[RATE, e] += omega * ux * across * s
            out[RATE + 1, e] += omega * uy * across * s
            out[RATE + 2, e] -= omega * upward * c
    for k in range(3):
        for e in range(LANES):
            u = out[ORBIT + k, e]
            out[ORBIT + k, e] = fraction[0] * u
            out[RATE + k, e] = fraction[0] * out[RATE + k, e] + fraction[1] * u


@driver
def elevation(waves, phase, fraction, x, y):
    """Height [m] of the surface over z = 0 at x, y of the tow frame."""
    eta = 0.0
    for i in range(waves.shape[0]):
        eta += waves[i, AMPLITUDE] * sincos(phase[i, 0] * x + phase[i, 1] * y + phase[i, 2])[1]
    return fraction[0] * eta


@driver
def pressure_head(waves, phase, fraction, x, y, z):
    """Head [m of water] by which the waves raise the pressure at x, y, z of the tow frame, Dean & Dalrymple (1991)
    4.20: the sum of A cosh(k(z + d)) / cosh(kd) cos th; above z = 0 that of z = 0."""
    head = 0.0
    for i in range(waves.shape[0]):
        if waves[i, REACH] < -z:
            break
        up = decay(waves[i, NUMBER] * min(z, 0.0))
        head += (
            waves[i, AMPLITUDE]
            * (up + waves[i, BOTTOM] / up)
            / (1.0 + waves[i, BOTTOM])
            * sincos(phase[i, 0] * x + phase[i, 1] * y + phase[i, 2])[1]
        )
    return fraction[0] * head


@inline
def cubic(table, i, column, s):
    """Value and slope at s of the cubic in row i of a table."""
    a, b, c, d = table[i, column], table[i, column + 1], table[i, column + 2], table[i, column + 3]
    return ((a * s + b) * s + c) * s + d, (3.0 * a * s + 2.0 * b) * s + c


@inline
def look_up(table, x):
    """Two values and their slopes at x of a table of cubics, held beyond its ends."""
    last = table.shape[0] - 1
    i = 0
    while i < last and x > table[i, HIGH]:
        i += 1
    inside = table[0, LOW] < x < table[last, HIGH]
    s = min(max(x, table[0, LOW]), table[last, HIGH]) - table[i, LOW]
    u, du = cubic(table, i, CUBIC_X, s)
    v, dv = cubic(table, i, CUBIC_Y, s)
    return u, v, du if inside else 0.0, dv if inside else 0.0


@inline
def tabled(sea, now, z):
    """Current of the table at z in the world: x, y [m/s], and their slopes [1/s]; now: a SEA."""
    u, v, du, dv = look_up(sea.profile, z)
    c, s = now.turn[0], now.turn[1]
    return c * u - s * v, s * u + c * v, c * du - s * dv, s * du + c * dv


@inline
def current_at(sea, memory, z):
    """Mean current at z relative to the tow frame, x and y [m/s]: without waves and turbulence; memory: a MEMORY."""
    m = memory.current
    x, y = m[0] - m[2] * z, m[1] - m[3] * z
    if sea.profile.shape[0] > 0:
        u, v, _, _ = tabled(sea, memory.sea, z)
        x, y = x + u, y + v
    return x, y


@driver
def gust(eddies, now, out):
    """Velocity [m/s] and acceleration [m/s^2] of the turbulence into out [6]; now: a SEA."""
    for k in range(6):
        out[k] = 0.0
    for i in range(eddies.shape[0]):
        k, omega = int(eddies[i, 0]), eddies[i, 2]
        angle = omega * now.time + eddies[i, 3]
        out[k] += eddies[i, 1] * cos(angle)
        out[3 + k] -= eddies[i, 1] * omega * sin(angle)
    c, s = cos(now.current_yaw), sin(now.current_yaw)
    for k in range(3):
        out[3 + k] = now.fraction[0] * out[3 + k] + now.fraction[1] * out[k]
        out[k] *= now.fraction[0]
    for k in range(0, 6, 3):
        out[k], out[k + 1] = c * out[k] - s * out[k + 1], s * out[k] + c * out[k + 1]


@driver
def stream_lanes(stream, x, n, t):
    """Add a stream [STREAM_ROWS, LANES] to the kinematics of one point a lane, see drag.point_lanes."""
    if x.shape[1] != LANES or n.shape[1] != LANES or t.shape[1] != LANES or stream.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        z = n[0, e] * x[2, e] + n[1, e] * x[5, e] + n[2, e] * x[8, e] + n[3, e] * x[11, e]
        u, v = stream[EXTRA, e] - stream[SHEAR, e] * z, stream[EXTRA + 1, e] - stream[SHEAR + 1, e] * z
        t[POINT_SHEAR, e] += stream[SHEAR, e]
        t[POINT_SHEAR + 1, e] += stream[SHEAR + 1, e]
        t[POINT_W, e] += u
        t[POINT_W + 1, e] += v
        t[POINT_W + 2, e] += stream[EXTRA + 2, e]
        t[POINT_V, e] += u + stream[ORBIT, e]
        t[POINT_V + 1, e] += v + stream[ORBIT + 1, e]
        t[POINT_V + 2, e] += stream[EXTRA + 2, e] + stream[ORBIT + 2, e]
        t[POINT_A, e] -= stream[RATE, e]  # added mass goes with the acceleration relative to the water
        t[POINT_A + 1, e] -= stream[RATE + 1, e]
        t[POINT_A + 2, e] -= stream[RATE + 2, e]


@driver
def push_lanes(stream, p, weight, f):
    """Add the Froude-Krylov load rho A a of the water's acceleration, weight * load, to f[3, LANES]."""
    if p.shape[1] != LANES or weight.shape[0] != LANES or f.shape[1] != LANES or stream.shape[1] != LANES:
        raise ValueError("lanes")
    for e in range(LANES):
        m = weight[e] * p[DISPLACED, e]
        f[0, e] += m * stream[RATE, e]
        f[1, e] += m * stream[RATE + 1, e]
        f[2, e] += m * stream[RATE + 2, e]


@driver
def stream_at(streams, e, xi, lane, out):
    """Stream at xi of the element in lane e into a lane of out, by the cubic through its four Gauss points."""
    a, b, c, d = GAUSS_4_X
    p, q, r, s = xi - a, xi - b, xi - c, xi - d
    w0 = q * r * s / ((a - b) * (a - c) * (a - d))
    w1 = p * r * s / ((b - a) * (b - c) * (b - d))
    w2 = p * q * s / ((c - a) * (c - b) * (c - d))
    w3 = p * q * r / ((d - a) * (d - b) * (d - c))
    for row in range(STREAM_ROWS):
        out[row, lane] = (
            w0 * streams[0, row, e] + w1 * streams[1, row, e] + w2 * streams[2, row, e] + w3 * streams[3, row, e]
        )
