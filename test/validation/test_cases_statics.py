"""Families of lines at rest against closed forms and independent solutions, at the tolerances of the case files."""

import numpy as np
import pytest
from case_bench import check
from scipy.integrate import solve_bvp, trapezoid
from scipy.optimize import fsolve

pytestmark = pytest.mark.trust


def elastic_catenary(span, rise, length, weight, ea):
    """Irvine (1981), Cable Structures, 2.3: x(s), z(s) for T = EA strain; unknown end force (H, V) at the origin."""

    def at(s, h, v):  # v: vertical force on the cable at the origin, upward; tension's z component w s - v
        u0, u1 = -v / h, (weight * s - v) / h
        x = h * s / ea + h / weight * (np.arcsinh(u1) - np.arcsinh(u0))
        z = (weight * s * s / 2 - v * s) / ea + h / weight * (np.hypot(1, u1) - np.hypot(1, u0))
        return x, z

    h, v = fsolve(
        lambda p: np.subtract(at(length, *p), (span, rise)),
        (0.3 * weight * length, 0.5 * weight * length * (1 - rise / length)),
        xtol=1e-12,
    )
    s = np.linspace(0, length, 20001)
    tension = np.hypot(h, weight * s - v)
    stretched = length + trapezoid(tension, s) / ea
    expected = {
        "H horizontal tension": (h, 1e-3, 0),
        "T at end A (origin)": (tension[0], 1e-3, 0),
        "T at end B": (tension[-1], 1e-3, 0),
        "stretched length": (stretched, 1e-4, 0),
    }
    for fraction in (0.25, 0.4, 0.75):
        x, z = at(fraction * length, h, v)
        expected[f"x at s={fraction} L0"] = (x, 0, 5e-4 * length)
        expected[f"z at s={fraction} L0"] = (z, 0, 5e-4 * length)
    return expected


@pytest.mark.parametrize(
    "numbers", [(100.0, 0.0, 110.0, 20.0, 2e6), (100.0, 50.0, 170.0, 410.2887, 5e8), (60.0, -25.0, 70.0, 35.0, 5e6)]
)
def test_catenary(numbers):
    keys = ("span_x_m", "rise_z_m", "unstretched_length_m", "weight_per_length_N_m", "EA_N")
    check(dict(zip(keys, numbers)), elastic_catenary(*numbers))


def elastica(tip, weight=0.0):
    """Inextensible cantilever, unit length and EI, dead loads: (x, drop, slope at the tip, moment at the clamp)."""
    s = np.linspace(0, 1, 400)
    bent = min(tip + weight / 2, 2.4)
    sol = solve_bvp(
        lambda s, y: np.vstack((y[1], -(tip + weight * (1 - s)) * np.cos(y[0]))),
        lambda a, b: np.array((a[0], b[1])),
        s,
        np.vstack((bent / 2 * s * (2 - s), bent * (1 - s))),
        tol=1e-9,
        max_nodes=50000,
    )
    assert sol.success
    fine = np.linspace(0, 1, 20001)
    angle = sol.sol(fine)[0]
    return trapezoid(np.cos(angle), fine), trapezoid(np.sin(angle), fine), angle[-1], sol.sol(0)[1]


@pytest.mark.parametrize(
    ("length", "ei", "loads"), [(2.0, 1.4, (0.0875, 0.35, 1.0499999999999998, 3.5)), (0.7, 0.02, (0.005, 0.3))]
)
def test_tip_force(length, ei, loads):
    """Bisshopp & Drucker (1945), the equation solved numerically."""
    expected = {}
    for force in loads:
        x, z, slope, _ = elastica(force * length**2 / ei)
        for name, value in (("deflection", z * length), ("tip abscissa", x * length), ("tip slope", slope)):
            expected[f"{name}, P={force:.6g} N"] = (value, 2e-3, 0)
    check({"length_m": length, "EI_N_m2": ei, "tip_force_N": list(loads), "gravity": 0.0}, expected)


@pytest.mark.parametrize(("length", "ei", "turns"), [(2.0, 1.4, (0.25, 0.5, 1.0, 1.5, 2.0)), (5.0, 30.0, (0.3, 1.2))])
def test_tip_moment(length, ei, turns):
    """A circle of radius EI/M."""
    expected, moments = {}, [2 * np.pi * t * ei / length for t in turns]
    for turn, moment in zip(turns, moments):
        radius, angle = ei / moment, moment * length / ei
        expected[f"tip x, M={moment:.8g} N m ({turn} turn)"] = (radius * np.sin(angle), 0, 2e-3 * length)
        expected[f"tip z, M={moment:.8g} N m ({turn} turn)"] = (radius * (1 - np.cos(angle)), 0, 2e-3 * length)
    check({"length_m": length, "EI_N_m2": ei, "tip_moment_N_m": moments}, expected)


@pytest.mark.parametrize(("length", "ei", "mass", "line"), [(0.0464, 2.82e-6, 0.00133, 2e-4), (0.2, 1e-3, 0.01, 0.05)])
def test_clamped_line_with_mass(length, ei, mass, line):
    x, z, slope, moment = elastica(mass * 9.81 * length**2 / ei, line * 9.81 * length**3 / ei)
    check(
        {"length_m": length, "EI_N_m2": ei, "tip_mass_kg": mass, "mass_per_length_kg_m": line, "g": 9.81},
        {
            "tip x": (x * length, 5e-3, 0),
            "tip drop": (z * length, 5e-3, 0),
            "tip slope below level": (slope, 5e-3, 0),
            "clamp moment": (moment * ei / length, 1e-2, 0),
        },
    )


LONG = {"length_m": 1e4, "wet_weight_N_m": 3.0255820361514885, "body_wet_weight_N": 1167.0, "EA_N": 6.786e6}


def hung(inputs):
    length, w, body, ea = inputs.values()
    return {
        "top tension": (w * length + body, 1e-3, 0),
        "tension at mid length": (w * length / 2 + body, 1e-3, 0),
        "elongation": ((w * length**2 / 2 + body * length) / ea, 2e-3, 0),
    }


@pytest.mark.parametrize("inputs", [LONG, {**LONG, "length_m": 3000.0, "EA_N": 2e7}])
def test_vertical(inputs):
    check(inputs, hung(inputs))
