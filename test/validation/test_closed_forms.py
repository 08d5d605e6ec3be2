"""Validation of the element against closed forms: what was taken from where, what is allowed."""

from __future__ import annotations

import numpy as np
import pytest
from equilibrium import Bench, settle
from scipy.integrate import solve_bvp, trapezoid
from scipy.optimize import brentq

pytestmark = pytest.mark.trust


def elastica_tip(load: float) -> tuple[float, float]:
    """Tip of an inextensible cantilever of unit length with EI = 1 and a transverse dead tip load (Bisshopp-Drucker
    ODE)."""

    def rhs(s, y):
        return np.vstack((y[1], -load * np.cos(y[0])))

    s = np.linspace(0.0, 1.0, 200)
    guess = np.vstack((1.2 * s * (2.0 - s), 2.4 * (1.0 - s)))
    sol = solve_bvp(rhs, lambda a, b: np.array((a[0], b[1])), s, guess, tol=1e-10, max_nodes=20000)
    assert sol.success
    fine = np.linspace(0.0, 1.0, 20001)
    angle = sol.sol(fine)[0]
    return float(trapezoid(np.cos(angle), fine)), float(trapezoid(np.sin(angle), fine))


def cantilever(n: int, load: float, ea: float = 3e7) -> np.ndarray:
    """Tip of n elements of the product's cable, unit length, EI = 1, loaded in ten steps."""
    bench = Bench(n, 0, ea=ea, ei=1.0, ca=0.0, tau=0.0, mass=0.0, gravity=0.0, lengths=1.0 / n)
    bench.q[:, 0], bench.q[:, 2], bench.q[:, 3] = bench.arc, 10.0, 1.0
    for fraction in np.linspace(0.1, 1.0, 10):
        force = np.zeros_like(bench.q)
        force[-1, 2] = load * fraction
        settle(bench, list(range(6)), force, steps=200, tolerance=1e-6)
    return bench.q[-1, [0, 2]] - (0.0, 10.0)


def test_elastica_converges_with_order_four():
    """P L^2/EI = 10: an independent code found 2.0e-2, 1.7e-3, 9.7e-5, 6.6e-6 at 2, 4, 8, 16 elements (theory
    notes)."""
    exact = np.array(elastica_tip(10.0))
    errors = [float(np.hypot(*(cantilever(n, 10.0) - exact))) for n in (2, 4, 8, 16)]
    orders = np.log2(np.array(errors[:-1]) / np.array(errors[1:]))
    print("elastica tip error", errors, "orders", orders)
    assert errors[0] < 3e-2 and errors[2] < 2e-4
    assert (orders > 3.5).all()


def catenary_ends(length: float, span: float, weight: float, ea: float) -> tuple[float, float]:
    """H and V of an elastic catenary with level ends."""
    v = 0.5 * weight * length

    def miss(h):
        return 2.0 * (h * v / (ea * weight) + h / weight * np.arcsinh(v / h)) - span

    return brentq(miss, 1.0, 1e5, xtol=1e-12), v


def catenary(n: int) -> tuple[float, float]:
    """End tension and sag of P1 with n elements: 100 m over a span of 80 m, mu 0.389, EA 6.8 MN, EI 0."""
    bench = Bench(n, 0, ea=6.8e6, ei=0.0, ca=0.0, tau=0.0, lengths=100.0 / n)
    s = bench.arc / 100.0
    bench.q[:, 0], bench.q[:, 2] = 80.0 * s, 100.0 - 100.0 * s * (1.0 - s)
    bench.q[:, 3], bench.q[:, 5] = 0.8, -(1.0 - 2.0 * s)
    bench.q[:, 3:] /= np.linalg.norm(bench.q[:, 3:], axis=1)[:, None]
    held = [0, 1, 2, 6 * n, 6 * n + 1, 6 * n + 2] + [6 * i + 4 for i in range(n + 1)] + [6 * i + 1 for i in range(1, n)]
    reaction = settle(bench, held, np.zeros_like(bench.q), steps=800, tolerance=1e-5)
    return float(np.hypot(reaction[0, 0], reaction[0, 2])), float(bench.q[n // 2, 2] - 100.0)


def test_catenary_converges():
    """P1: T_top 230.34849949162 N, sag -26.545629680847558 m (elastic catenary, closed form)."""
    h, v = catenary_ends(100.0, 80.0, 0.389 * 9.81, 6.8e6)
    assert np.hypot(h, v) == pytest.approx(230.34849949162, rel=1e-9)
    errors = []
    for n in (8, 16, 32):
        tension, sag = catenary(n)
        errors.append((abs(tension / np.hypot(h, v) - 1.0), abs(sag + 26.545629680847558)))
    print("catenary errors", errors)
    assert errors[1][0] < 2e-4 and errors[1][1] < 5e-3
    assert errors[2][0] < errors[0][0] / 20 and errors[2][1] < errors[0][1] / 20, "at least third order"
