"""Natural frequencies and the spinning cable against closed forms, at the tolerances of the case files."""

import numpy as np
import pytest
from case_bench import check
from scipy.optimize import brentq
from scipy.special import j0, j1, jn_zeros, y0, y1

pytestmark = pytest.mark.trust


@pytest.mark.parametrize(("length", "mass", "count"), [(10.0, 0.389, 5), (35.0, 2.0, 3)])
def test_hanging_chain(length, mass, count):
    """Bernoulli: j_0n / 2 sqrt(g / L)."""
    omega = 0.5 * jn_zeros(0, count) * np.sqrt(9.81 / length)
    check(
        {"length_m": length, "mass_per_length_kg_m": mass, "g": 9.81, "modes": count},
        {f"omega_{k + 1}": (omega[k], 5e-3 if k < 3 else 1e-2, 0) for k in range(count)},
    )


def frequencies(w, mass, low, length, end_mass, count):
    """String with tension low + w z from its lower end, held above; end_mass None: held below too. Bessel functions of
    2 omega sqrt(mass (z + low/w) / w)."""

    def wanted(omega):
        bottom, top = (2 * omega * np.sqrt(mass * x) / w for x in (low, low + w * length))
        if end_mass is None:
            return j0(bottom) * y0(top) - y0(bottom) * j0(top)
        slope = 2 * omega**2 * mass / (w * bottom)  # d(argument)/dz at the lower end
        a, b = (-low * slope * f1(bottom) + omega**2 * end_mass * f0(bottom) for f0, f1 in ((j0, j1), (y0, y1)))
        return a * y0(top) - b * j0(top)

    c = np.sqrt((low + 0.5 * w * length) / mass)
    grid = np.linspace(1e-3, (count + 1) * np.pi, 4000) * c / length
    values = np.array([wanted(x) for x in grid])
    at = np.flatnonzero(values[:-1] * values[1:] < 0)[:count]
    return [brentq(wanted, grid[i], grid[i + 1], xtol=1e-12) for i in at]


@pytest.mark.parametrize(
    ("length", "diameter", "mass", "ca", "wet", "body", "added"),
    [
        pytest.param(100.0, 0.01, 0.389, 1.0, 445.0, 250.0, 209.9196, marks=pytest.mark.nightly),
        (60.0, 0.03, 1.5, 0.8, 900.0, 150.0, 80.0),
    ],
)
def test_submerged_hanging_cable(length, diameter, mass, ca, wet, body, added):
    displaced = 1026.0 * np.pi / 4 * diameter**2
    omega = frequencies((mass - displaced) * 9.81, mass + ca * displaced, wet, length, body + added, 4)
    check(
        {
            "length_m": length,
            "diameter_m": diameter,
            "mass_per_length_kg_m": mass,
            "fluid_density": 1026.0,
            "Ca_normal": ca,
            "body_wet_weight_N": wet,
            "body_mass_kg": body,
            "body_transverse_added_mass_kg": added,
            "Cd": 0.0,
            "g": 9.81,
        },
        {f"omega_{k + 1}": (x, 5e-3, 0) for k, x in enumerate(omega)},
    )


@pytest.mark.parametrize(
    ("length", "mass", "low", "high", "count"), [(200.0, 0.5, 2000.0, 3000.0, 6), (50.0, 2.0, 300.0, 2500.0, 3)]
)
def test_string_under_linear_tension(length, mass, low, high, count):
    omega = frequencies((high - low) / length, mass, low, length, None, count)
    check(
        {"length_m": length, "mass_per_length_kg_m": mass, "T_low_N": low, "T_high_N": high, "modes": count},
        {f"omega_{k + 1}": (x, 5e-3 if k < 3 else 1e-2, 0) for k, x in enumerate(omega)},
    )


@pytest.mark.parametrize(
    ("length", "mass", "tip", "spin", "ea", "turns"), [(10.0, 0.389, 5.0, 6.0, 1e9, 20), (4.0, 0.2, 1.0, 3.0, 1e7, 10)]
)
def test_spinning_cable(length, mass, tip, spin, ea, turns):
    """T(s) = spin^2 (m (L^2 - s^2) / 2 + M L); nothing acts along the turn, so the spin stays."""

    def tension(s):
        return spin**2 * (mass * (length**2 - s**2) / 2 + tip * length)

    check(
        {"length_m": length, "mass_per_length_kg_m": mass, "tip_mass_kg": tip, "spin_rad_s": spin, "EA_N": ea},
        {
            "tension at the hub": (tension(0), 3e-3, 0),
            "tension at mid length": (tension(length / 2), 3e-3, 0),
            "tension at the tip": (tension(length), 3e-3, 0),
            "kinetic energy (constant)": (0.5 * spin**2 * length**2 * (tip + mass * length / 3), 1e-3, 0),
            f"spin kept after {turns} turns": (spin, 1e-3, 0),
        },
    )
