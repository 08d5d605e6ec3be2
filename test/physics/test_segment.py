"""The equivalent force system of a link: closed forms against their printed test values and against quadrature."""

from __future__ import annotations

import numpy as np
import pytest

from cable_sim_ros.physics.link_loads import added_mass, integrals, normal_drag, tangential_drag

pytestmark = pytest.mark.check


@pytest.mark.parametrize(
    "form, want",
    [
        ((0.0, 0.0, 1.0, 2.0), (1.0, 0.0, 0.5)),
        ((0.25, -1.0, 1.0, 2.0), (1.25, -0.4583333333333333, 0.5104166666666667)),
        ((4.0, 0.0, 0.0, 2.0), (4.0, 0.0, 4.0 / 3.0)),
        ((1.0, 3e-5, 1e-8, 2.0), (2.000000003258333, 9.99999997e-6, 0.666666668621666)),
    ],
)
def test_integrals_have_the_known_values(form, want):
    assert integrals(*form) == pytest.approx(want, rel=1e-14, abs=1e-14)


def quadrature(a, b, c, length):
    """I_k [n, 3] by Gauss rules on panels that halve towards the point of least speed."""
    h = 0.5 * length
    at = np.clip(np.where(c > 0.0, -0.5 * b / np.where(c > 0.0, c, 1.0), 0.0), -h, h)
    x, w = np.polynomial.legendre.leggauss(16)
    ends = np.concatenate(([0.0], 0.5 ** np.arange(50, -1, -1.0)))
    low, high = ends[:-1, None], ends[1:, None]
    u, weight = (low + 0.5 * (high - low) * (1.0 + x)).ravel(), (0.5 * (high - low) * w).ravel()
    total = np.zeros((len(a), 3))
    for side in (-1.0, 1.0):
        reach = np.abs(side * h - at)
        y = at[:, None] + side * reach[:, None] * u
        speed = np.sqrt(np.maximum(a[:, None] + b[:, None] * y + c[:, None] * y * y, 0.0))
        for k in range(3):
            total[:, k] += reach * ((y**k * speed) @ weight)
    return total


def test_integrals_of_4000_random_links():
    """Speeds over 20 decades, one third with the stagnation point on the link or next to it."""
    rng = np.random.default_rng(7)
    n, length = 4000, 1.7
    a, c = 10.0 ** rng.uniform(-10.0, 10.0, n), 10.0 ** rng.uniform(-10.0, 10.0, n)
    b = 2.0 * np.sqrt(a * c) * rng.uniform(-1.0, 1.0, n)
    still = np.arange(n) % 3 == 0
    at, minimum = rng.uniform(-1.0, 1.0, n) * length, c * 10.0 ** rng.uniform(-30.0, -6.0, n)
    a, b = np.where(still, minimum + c * at * at, a), np.where(still, -2.0 * c * at, b)
    want = quadrature(a, b, c, np.full(n, length))
    got = np.array([integrals(*row, length) for row in zip(a, b, c, strict=True)])
    scale = np.sqrt(np.maximum(a, c * 0.25 * length**2))[:, None] * (0.5 * length) ** np.arange(1, 4)
    assert np.isfinite(got).all()
    assert np.abs((got - want) / scale).max() < 1e-12


def test_integrals_where_the_printed_logarithm_is_not_a_number():
    """D = 4ac - b^2 just below zero by rounding, the stagnation point on the link, a link that does not turn."""
    for x0 in (0.0, 0.3, -0.99, 1.0):
        for c in (1e-300, 1e-18, 1.0, 1e12):
            form = (c * x0 * x0 * (1.0 - 1e-16), -2.0 * c * x0, c, 2.0)
            assert np.isfinite(integrals(*form)).all(), form
    assert integrals(0.0, 0.0, 0.0, 2.0) == (0.0, 0.0, 0.0)


def axis_and_turn():
    n, omega = np.array((1.0, 2.0, 2.0)) / 3.0, np.array((0.7, 1.1, -0.5))
    return n, omega


def test_normal_drag_has_the_known_force_and_moment():
    n, omega = axis_and_turn()
    v = np.array((0.377777778, -0.344444444, 0.155555556))
    force, moment = normal_drag(tuple(v), tuple(-np.cross(omega, n)), tuple(n), 6.2, 1.5)
    assert force == pytest.approx((3.87595255, -3.01971483, 1.08173855), rel=1e-7)
    assert np.cross(n, moment) == pytest.approx((-1.14911292, -1.19571961, 1.77027607), rel=1e-7)


def test_added_mass_has_the_known_force_and_moment():
    n, omega = axis_and_turn()
    a, alpha = np.array((0.2, 0.1, -0.4)), np.array((-0.3, 0.8, 0.6))
    turn = -(np.cross(alpha, n) + np.cross(omega, np.cross(omega, n)))
    force, moment = added_mass(tuple(a), tuple(turn), tuple(n), 3.1, 1.5)
    assert force == pytest.approx((1.13666667, 0.87833333, -1.44666667), rel=1e-7)
    assert np.cross(n, moment) == pytest.approx((1.09275, -0.56284375, 0.01646875), rel=1e-7)


@pytest.mark.parametrize("speed, stretch", [(0.7, 0.0), (0.7, 0.3), (-0.7, 0.3), (0.2, 1.3), (-0.2, 1.3), (0.0, 1.0)])
def test_tangential_drag_of_a_link_whose_ends_may_slide_apart(speed, stretch):
    """Against a fine sum; without stretch the source's F_T = C L |V_T| V_T and no moment."""
    n, length, c = np.array((0.6, 0.0, 0.8)), 1.5, 2.1
    force, moment = tangential_drag(tuple(speed * n), tuple(stretch * n), tuple(n), c, length)
    x = (np.arange(200_000) + 0.5) / 200_000 * length - 0.5 * length
    f = c * np.abs(speed + stretch * x) * (speed + stretch * x) * length / len(x)
    assert force == pytest.approx(f.sum() * n, rel=1e-8, abs=1e-10)
    assert moment == pytest.approx((f * x).sum() * n, rel=1e-8, abs=1e-10)
