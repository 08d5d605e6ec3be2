"""Cases of contact and pulleys against closed forms, with the tolerances of the case files; with other numbers too."""

from math import cos, cosh, degrees, pi, radians, sin, sinh, sqrt

import numpy as np
import pytest
from case_bench import case_of, check, compare
from scipy.integrate import quad, solve_ivp
from scipy.optimize import brentq

from verification.cases import family_of
from verification.cases.family import Level

G = 9.81


@pytest.mark.parametrize("tension, root, half", [(3710.0, 0.25, 30.0), (900.0, 0.4, 40.0)])
def test_static_wrap(tension, root, half):
    """2 T sin(W/2), q = T/R less the penetration (q/k)^(2/3), q / (2 sin s) on a flank."""
    radius, k = root + 0.005, 1e9
    line = brentq(lambda q: q - tension / (radius - (q / k) ** (2 / 3)), 0.5 * tension / radius, 2 * tension / radius)
    expected = {
        f"total contact force, wrap {w} deg": (2 * tension * sin(radians(w) / 2), 0.005, 0) for w in (25, 90, 180)
    }
    expected |= {
        "contact line load (mid wrap)": (line, 0.02, 0),
        "penetration with line load kN*delta^1.5, kN=1e9, cylindrical surface": ((line / k) ** (2 / 3), 0.02, 0),
        f"normal line load on each flank, groove half angle {half} deg, no friction": (
            tension / radius / (2 * sin(radians(half))),
            0.02,
            0,
        ),
    }
    check(
        {
            "tension_N": tension,
            "sheave_root_radius_m": root,
            "cable_diameter_m": 0.01,
            "wraps_deg": [25, 90, 180],
            "contact_stiffness_kN": k,
            "exponent": 1.5,
            "groove_half_angle_deg": half,
        },
        expected,
    )


@pytest.mark.parametrize(
    "tension, stiff, radius, wrap", [(3710.0, 1.4, 0.255, 90.0), (3710.0, 1.4, 0.255, 20.0), (800.0, 3.0, 0.6, 60.0)]
)
def test_bending_boundary(tension, stiff, radius, wrap):
    """Free elastica: EI kappa^2 / 2 = T (1 - cos phi), so contact at kappa = 1/R ends at sin(phi/2) = sqrt(EI/T)/2R.

    There the shear T sin(phi) goes into the sheave at once; inside, the normal force T cos(phi) over R.
    """
    phi = 2 * np.arcsin(0.5 * sqrt(stiff / tension) / radius)
    check(
        {
            "far_tension_N": tension,
            "EI_N_m2": stiff,
            "radius_to_centreline_m": radius,
            "angle_between_far_lines_deg": wrap,
        },
        {
            "angle by which contact stops short of the geometric tangent, each side": (degrees(phi), 0.1, 0.3),
            "concentrated reaction at each contact end": (tension * sin(phi), 0.1, 0),
            "line load inside the wrap": (tension * cos(phi) / radius, 0.02, 0),
            "total contact force": (2 * tension * sin(radians(wrap) / 2), 0.005, 0),
        },
    )


@pytest.mark.parametrize("mass, radius, left, right, end", [(2.0, 0.5, 10.0, 8.0, 4.0), (1.0, 0.3, 6.0, 5.0, 1.0)])
def test_heavy_rope_at_rest(mass, radius, left, right, end):
    """Tension grows by the weight of the height: T = T0 + mu g z; q = (T + mu g z)/R on the arc, z above the axis."""
    tension = mass * G * left
    expected = {
        "tension at the left tangent point": (tension, 0.005, 0),
        "tension at the top": (tension + mass * G * radius, 0.005, 0),
        "tension at the right tangent point": (tension, 0.005, 0),
        "line load at the top": (tension / radius + 2 * mass * G, 0.02, 0),
        "line load at the tangent points": (tension / radius, 0.03, 0),
        "total vertical contact force": (2 * tension + mass * G * pi * radius, 0.003, 0),
    }
    check(
        {
            "mass_per_length_kg_m": mass,
            "g": G,
            "radius_to_centreline_m": radius,
            "hanging_left_m": left,
            "hanging_right_m": right,
            "end_mass_right_kg": end,
            "end_mass_left_kg": 0.0,
        },
        expected,
    )


@pytest.mark.parametrize(
    "tension, mass, radius, speed, wrap", [(120.0, 0.2, 0.4, 8.0, 60.0), (200.0, 0.389, 0.1, 18.0, 160.0)]
)
def test_running_cable(tension, mass, radius, speed, wrap):
    """T - mu v^2 bends the cable: q = (T - mu v^2)/R, 2 (T - mu v^2) sin(W/2), lift-off at sqrt(T/mu)."""
    left = tension - mass * speed**2
    check(
        {
            "tension_N": tension,
            "mass_per_length_kg_m": mass,
            "radius_to_centreline_m": radius,
            "speed_m_s": speed,
            "wrap_deg": wrap,
        },
        {
            "contact line load": (left / radius, 0.02, 0),
            "total contact force": (2 * left * sin(radians(wrap) / 2), 0.01, 0),
            "lift-off speed": (sqrt(tension / mass), 0.03, 0),
        },
    )


@pytest.mark.parametrize("mass, k, damping, speed", [(1.0, 1e6, 0.3, 0.5), (2.5, 4e7, 0.8, 1.2)])
def test_bounce(mass, k, damping, speed):
    """m v dv/d(delta) = -k delta^1.5 (1 + D v): v/D - ln(1 + D v)/D^2 falls by k delta^2.5 / 2.5 m."""

    def work(v):
        return v / damping - np.log1p(damping * v) / damping**2

    def speed_at(x, out):
        left = work(speed) - k * x**2.5 / 2.5 / mass
        return (
            -brentq(lambda v: work(-v) - left, 0, 0.999 / damping)
            if out
            else brentq(lambda v: work(v) - left, 0, 2 * speed)
        )

    deep = (2.5 * mass * work(speed) / k) ** 0.4
    # x = deep (1 - u^2) takes the root out of 1/v
    time = sum(
        quad(lambda u, o=out: 2 * u * deep / abs(speed_at(deep * (1 - u * u), o)), 1e-6, 1)[0] for out in (False, True)
    )
    check(
        {
            "mass_kg": mass,
            "stiffness_N_m1p5": k,
            "exponent": 1.5,
            "D_s_m": damping,
            "approach_speed_m_s": speed,
            "gravity": 0.0,
        },
        {
            "rebound speed": (-speed_at(0.0, True), 0.005, 0),
            "largest penetration": (deep, 0.005, 0),
            "contact time": (time, 0.01, 0),
        },
    )


@pytest.mark.parametrize("half, tension", [(30.0, 20.0), (45.0, 50.0)])
def test_groove_climb(half, tension):
    """On one wall alone: across / radial = cot(half angle), which is the heel 90 deg - half angle without tension."""
    ratio, mass, radius = 1 / np.tan(radians(half)), 0.389, 0.255
    check(
        {
            "groove_half_angle_deg": half,
            "mass_per_length_kg_m": mass,
            "radius_to_centreline_m": radius,
            "tension_N": 0.0,
            "g": G,
        },
        {
            "heel angle at climb-out, zero tension": (90.0 - half, 0, 2.0),
            "lateral/radial line-load ratio at climb-out": (ratio, 0.03, 0),
            f"lateral line load that climbs out at {tension:g} N tension, level sheave, cable at the top": (
                ratio * (tension / radius + mass * G),
                0.03,
                0,
            ),
        },
    )


@pytest.mark.parametrize("right, left, hang, times", [(20.0, 15.0, 5.0, (0.25, 1.0)), (6.0, 9.0, 4.0, (0.3,))])
def test_atwood(right, left, hang, times):
    """M x'' = A + 2 mu g x, M all that moves; the rope's turning takes 2 mu v^2 off the vertical contact force."""
    radius, mu = 0.255, 0.389
    total = right + left + mu * (2 * hang + pi * radius)
    first, growth = abs(right - left) * G / total, sqrt(2 * mu * G / total)
    expected = {}
    for t in times:
        x = first / growth**2 * (cosh(growth * t) - 1)
        v, a = first / growth * sinh(growth * t), first + growth**2 * x
        heavy, light = (max(right, left) + mu * (hang + x)) * (G - a), (min(right, left) + mu * (hang - x)) * (G + a)
        expected |= {
            f"travel at {t} s": (x, 0.005, 0),
            f"speed at {t} s": (v, 0.005, 0),
            f"tension at heavy-side tangent at {t} s": (heavy, 0.01, 0),
            f"tension at light-side tangent at {t} s": (light, 0.01, 0),
            f"vertical contact force at {t} s": (heavy + light - 2 * mu * v**2 + mu * G * pi * radius, 0.01, 0),
        }
    check(
        {
            "radius_to_centreline_m": radius,
            "m_right_kg": right,
            "m_left_kg": left,
            "rope_mass_per_length_kg_m": mu,
            "right_hanging_m": hang,
            "left_hanging_m": hang,
            "g": G,
            "EA_N": 1e7,
        },
        expected,
    )


@pytest.mark.parametrize("pull, radius", [pytest.param(0.5 * G, 0.05, marks=pytest.mark.nightly), (1.4 * G, 0.06)])
def test_lift_off(pull, radius):
    """At the free side T = mu l (g + a) meets mu v^2, with v = a t and l = l0 - a t^2 / 2."""
    free = 1.0
    time = sqrt(free * (G + pull) / (pull**2 + 0.5 * pull * (G + pull)))
    expected = {
        "lift-off time": (time, 0.03, 0),
        "speed at lift-off": (pull * time, 0.03, 0),
        "free length left at lift-off": (free - 0.5 * pull * time**2, 0.05, 0),
        "angular position of first lift-off from the free-side tangent": (0.0, 0, 15.0),
    }
    one = case_of(
        {
            "radius_to_centreline_m": radius,
            "rope_mass_per_length_kg_m": 0.1,
            "free_length_below_tangent_m": free,
            "pull_acceleration_m_s2": pull,
            "g": G,
            "wrap_deg": 180.0,
        },
        expected,
    )
    compare(family_of(one).solve(one, Level(2, 0)).of, expected)


@pytest.mark.parametrize(
    "radius, length, start", [pytest.param(0.05062, 0.7, 55.0, marks=pytest.mark.nightly), (0.2, 0.7, 30.0)]
)
def test_wrapping_pendulum(radius, length, start):
    """l theta'' = -(g sin theta + R theta'^2), l = L - R (pi/2 - theta), T = m (g cos theta + l theta'^2)."""
    mass = 9.43

    def free(angle):
        return length - radius * (pi / 2 - angle)

    def back(_, y):
        return y[1]

    back.direction = -1
    swing = solve_ivp(
        lambda _, y: [y[1], -(G * sin(y[0]) + radius * y[1] ** 2) / free(y[0])],
        (0, 6),
        [radians(start), -1e-12],
        rtol=1e-10,
        atol=1e-12,
        events=back,
        dense_output=True,
    )
    period = min(t for t in swing.t_events[0] if t > 0.1)
    y = swing.sol(np.linspace(0, period, 4001))
    tension = mass * (G * np.cos(y[0]) + free(y[0]) * y[1] ** 2)
    low, wrap = degrees(y[0].min()), pi / 2 - y[0][1000]
    expected = {
        "full period": (period, 0.005, 0),
        "other extreme angle from vertical": (low, 0, 0.5),
        "smallest wrap": (90 - start, 0, 0.5),
        "largest wrap": (90 - low, 0, 0.5),
        "largest tension": (tension.max(), 0.01, 0),
        "smallest tension": (tension.min(), 0.02, 0),
        "wrap at 0.25 period": (degrees(wrap), 0, 1.0),
        "tension at 0.25 period": (tension[1000], 0.02, 0),
        "total contact force at 0.25 period": (2 * tension[1000] * sin(wrap / 2), 0.02, 0),
    }
    check(
        {
            "radius_to_centreline_m": radius,
            "rope_length_from_top_of_pulley_m": length,
            "mass_kg": mass,
            "initial_angle_from_vertical_deg": start,
            "g": G,
            "rope_mass_per_length_kg_m": 1e-3 * mass / length,
            "EA_N": 1e6,
        },
        expected,
    )
