"""Loads of the water on one rigid link: the equivalent force system of Huston and Kamman (1980), in closed form.

A load f(x) along a link of length L, x from its centre G along its unit tangent n, is its resultant F and its first
moment M = int x f dx; the couple about G is T = n x M, and its two ends bear F/2 -+ M/L. Everything that the model
knows of a link is linear in x: velocity V = V_G + x V', acceleration likewise. Of a rigid link in uniform water
V' = -omega x n; a sheared current, stretch and cable that runs through the mesh change V' and nothing else.

Equations of the source (HK) as corrected in docs/segments.md: 1, f = A a_N + B |V_N| V_N + C |V_T| V_T, 20, 21, 41 to
44, 47, 53 and 55. What is printed there cannot be coded: the logarithm of HK 41 to 43 cancels where a link
turns slowly and is not a number where the stagnation point is on the link. The integrals I_k are therefore taken with
asinh about the point of least speed, or by Gauss where the integrand is far from its branch points.
"""

from math import asinh, hypot, sqrt

import numpy as np

from ..compiler.jit import driver, inline
from .vec import axpy, dot, scale

# Gauss-Legendre with 16 points on [-1, 1], the positive half; literals, see hermite.py
_X16 = np.array(
    (0.09501250983763744, 0.2816035507792589, 0.45801677765722737, 0.6178762444026438,
     0.755404408355003, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499)
)  # fmt: skip
_W16 = np.array(
    (0.1894506104550685, 0.18260341504492358, 0.16915651939500254, 0.14959598881657674,
     0.12462897125553388, 0.09515851168249279, 0.062253523938647894, 0.027152459411754096)
)  # fmt: skip
# Bernstein ellipse of the integrand, half-axes' sum: from here on 16 points are exact to round-off, 4 points are
FAR, VERY_FAR = 3.2, 200.0
_X4, _W4 = np.array((0.33998104358485626, 0.8611363115940526)), np.array((0.6521451548625461, 0.34785484513745385))


@inline
def gauss(a, b, c, x, w):
    """J_k of integrals() by a rule of points +-x with weights w."""
    j0, j1, j2 = 0.0, 0.0, 0.0
    for i in range(x.shape[0]):
        s = x[i]
        even = a + c * s * s
        p, m = w[i] * sqrt(max(even + b * s, 0.0)), w[i] * sqrt(max(even - b * s, 0.0))
        j0 += p + m
        j1 += s * (p - m)
        j2 += s * s * (p + m)
    return j0, j1, j2


@inline
def closed(c, minimum, y):
    """Antiderivatives of y^k sqrt(c y^2 + least), k = 0, 1, 2, at y from the point of least speed."""
    r = sqrt(c * y * y + minimum)
    log = 0.0 if minimum <= 0.0 else minimum / sqrt(c) * asinh(y * sqrt(c / minimum))
    j0 = 0.5 * (y * r + log)
    return j0, r * r * r / (3.0 * c), (y * r * r * r - minimum * j0) / (4.0 * c)


@driver
def integrals(a, b, c, length):
    """I_k = int x^k sqrt(a + b x + c x^2) dx over -L/2..L/2, k = 0, 1, 2: HK 41 to 43 without their cancellation.

    a [m^2/s^2], b, c: |V_N|^2 = a + b x + c x^2 >= 0, so 4 a c >= b^2; length [m].
    """
    h = 0.5 * length
    b, c = b * h, c * h * h
    size = max(a, c)
    if not size > 0.0:
        return 0.0, 0.0, 0.0
    a, b, c = a / size, b / size, c / size
    reach = 1e300
    if c > 1e-30:
        at = -0.5 * b / c  # of the least speed, in half lengths
        minimum = max(a - 0.25 * b * b / c, 0.0)  # its square
        off = sqrt(minimum / c)
        axis = 0.5 * (hypot(at - 1.0, off) + hypot(at + 1.0, off))
        reach = axis + sqrt(max(axis * axis - 1.0, 0.0))
    if reach > VERY_FAR:
        j0, j1, j2 = gauss(a, b, c, _X4, _W4)
    elif reach > FAR:
        j0, j1, j2 = gauss(a, b, c, _X16, _W16)
    else:
        p0, p1, p2 = closed(c, minimum, 1.0 - at)
        m0, m1, m2 = closed(c, minimum, -1.0 - at)
        k0, k1, k2 = p0 - m0, p1 - m1, p2 - m2
        j0, j1, j2 = k0, k1 + at * k0, k2 + at * (2.0 * k1 + at * k0)
    f = sqrt(size) * h
    return f * j0, f * h * j1, f * h * h * j2


@inline
def across(v, u):
    """The part of v normal to the unit vector u."""
    return axpy(-dot(v, u), u, v)


@inline
def normal_drag(v, turn, u, b, length):
    """F HK 44 and M of B |V_N| V_N, V = v + x turn, u the unit tangent; T = u x M is HK 47. b: B [kg/m^2]."""
    n, s = across(v, u), across(turn, u)
    i0, i1, i2 = integrals(dot(n, n), 2.0 * dot(n, s), dot(s, s), length)
    return axpy(b * i0, n, scale(b * i1, s)), axpy(b * i1, n, scale(b * i2, s))


@inline
def tangential_drag(v, turn, u, c, length):
    """F and M of C |V_T| V_T, V_T = p + q x/(L/2): with q = 0 the source's F_T = C L |V_T| V_T. c: C [kg/m^2]."""
    h = 0.5 * length
    p, q = dot(v, u), h * dot(turn, u)
    if abs(p) >= abs(q):  # one sign all along the link
        side = 1.0 if p > 0.0 else -1.0
        f, m = side * (2.0 * p * p + q * q / 1.5), side * 4.0 * p * q / 3.0
    else:
        hi, lo = p + q, p - q
        cubes = (abs(hi) ** 3 - abs(lo) ** 3) / 3.0
        f, m = cubes / q, (0.25 * (hi * abs(hi) ** 3 - lo * abs(lo) ** 3) - p * cubes) / (q * q)
    return scale(c * h * f, u), scale(c * h * h * m, u)


@inline
def added_mass(a, turn, u, mass, length):
    """F_M HK 20 and M of A a_N, a = a_G + x turn that of the water relative to the cable; T = u x M is HK 21.

    mass: A [kg/m].
    """
    return scale(mass * length, across(a, u)), scale(mass * length**3 / 12.0, across(turn, u))
