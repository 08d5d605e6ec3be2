"""Cases under water against equations solved beside the product: scipy's integration of the steady line, closed forms.

Tolerances are those of the case files. Every family is also solved with other numbers than theirs.
"""

from __future__ import annotations

from math import atan2, cosh, degrees, hypot, log, pi, sin, sqrt, tanh

import numpy as np
import pytest
from case_bench import case_of, check, compare, values, within
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

from cable_sim_ros.physics.drag_laws import DragLaw
from verification.cases import CaseError, Fidelity, run_case
from verification.cases.wet import drag_law


# loading functions as printed by Westin (2018) (60), (145), and the laws of two coefficients; eta in rad
def westin(constant):
    def f(eta):
        c, s = np.cos(eta), np.sin(eta)
        quintic = 0.01 * np.polyval((-1.1873, 3.5064, -4.1615, 1.9159, -0.3858, 2.009), eta)
        return 0.5 - 0.1 * c + 0.1 * s - 0.4 * np.cos(2 * eta) - constant * np.sin(2 * eta), quintic

    return f


def ribbon(eta):
    c, s, c2, s2 = np.cos(eta), np.sin(eta), np.cos(2 * eta), np.sin(2 * eta)
    return (0.498609 - 0.2499 * c + 0.2527 * s - 0.2487 * c2, -0.2255 + 0.3417 * c + 0.255 * s - 0.0811 * s2)


def two(cn, ct):
    return lambda eta: (np.sin(eta) ** 2, ct / cn * np.cos(eta) ** 2)


def pode(f):
    return lambda eta: (np.sin(eta) ** 2, f)


def line_load(velocity, tangent, half_rho_d, cd, law):
    """Drag per length of a stream past a line."""
    along = velocity @ tangent
    across = velocity - along * tangent
    fn, ft = law(atan2(np.linalg.norm(across), abs(along)))
    size = half_rho_d * cd * (velocity @ velocity)
    n = np.linalg.norm(across)
    return size * (fn * (across / n if n > 0.0 else across) + max(ft, 0.0) * np.sign(along) * tangent)


BOTH = "normal 0.5 rho d Cn (U sin)^2, tangential 0.5 rho d Ct (U cos)^2, Cn=1.5, Ct=0.03 (reference area d)"
PRINTED = "loading functions exactly as printed (0.11 on sin(2 eta)), Cd=1.2; f_n is negative below eta=7.96 deg"
TOWS = [
    (BOTH, 1.5, two(1.5, 0.03)),
    (
        "normal 0.5 rho D c_d V_perp^2, tangential 0.5 rho pi D c_f V_par^2, c_d=1.1, c_f=0.012",
        1.1,
        two(1.1, 0.012 * pi),
    ),
    ("Pode (DTMB 687): normal R sin^2, tangential constant f R, R=0.5 rho d Cd U^2, Cd=1.3, f=0.025", 1.3, pode(0.025)),
    ("loading functions with coefficient 0.011 on sin(2 eta) in f_n, polynomial f_t, Cd=1.4", 1.4, westin(0.011)),
    (PRINTED, 1.2, westin(0.11)),
    ("ribbon-fairing loading functions as printed (second one is the tangential function), Cd=0.9", 0.9, ribbon),
]
TOW = {
    "cable_length_m": 380.0,
    "diameter_m": 0.012,
    "mass_per_length_kg_m": 0.5,
    "fluid_density": 1020.0,
    "body_wet_weight_N": 700.0,
    "body_drag_area_CdA_m2": 0.08,
    "g": 9.8,
}
TOW["wet_weight_N_m"] = 9.8 * (0.5 - 0.25 * pi * 0.012**2 * 1020.0)
TOW_NAMES = {  # relative and absolute tolerance
    "tension at the tow point": (0.005, 0),
    "cable angle from horizontal at the tow point": (0, 0.2),
    "body depth below the tow point": (0.005, 0),
    "layback": (0.005, 0),
    "critical angle from horizontal": (0, 0.05),
}


def tow_by_scipy(inputs: dict, cd: float, law) -> dict:
    """Inextensible line in a uniform stream, from the body up: d(T t)/ds = -load, dr/ds = t."""
    speed, wet = np.array((inputs["speed_m_s"], 0.0)), inputs["wet_weight_N_m"]
    half = 0.5 * inputs["fluid_density"] * inputs["diameter_m"]
    pull = np.array(
        (-0.5 * inputs["fluid_density"] * inputs["body_drag_area_CdA_m2"] * speed[0] ** 2, inputs["body_wet_weight_N"])
    )

    def slope(_, y):
        t = y[:2] / np.linalg.norm(y[:2])
        return np.concatenate((-line_load(speed, t, half, cd, law) + (0.0, wet), t))

    y = solve_ivp(slope, (0.0, inputs["cable_length_m"]), (*pull, 0.0, 0.0), rtol=1e-9, atol=1e-9).y[:, -1]

    def across(angle):
        t = np.array((-np.cos(angle), np.sin(angle)))
        load = line_load(speed, t, half, cd, law) - (0.0, wet)
        return load @ (np.sin(angle), np.cos(angle))

    return {
        "tension at the tow point": hypot(*y[:2]),
        "cable angle from horizontal at the tow point": degrees(atan2(y[1], -y[0])),
        "body depth below the tow point": y[3],
        "layback": -y[2],
        "critical angle from horizontal": degrees(brentq(across, 0.01, 1.57)),
    }


@pytest.mark.parametrize("speed", [0.9, 2.5])
@pytest.mark.parametrize("text, cd, law", TOWS)
def test_straight_tow_is_the_steady_line_of_its_law(text, cd, law, speed):
    inputs = {**TOW, "drag_law": text, "speed_m_s": speed}
    check(inputs, within(tow_by_scipy(inputs, cd, law), TOW_NAMES))


def test_a_line_without_a_body_lies_at_the_critical_angle():
    inputs = {**TOW, "drag_law": TOWS[0][0], "speed_m_s": 2.0, "body_wet_weight_N": 0.0, "body_drag_area_CdA_m2": 0.0}
    report = values(case_of(inputs, TOW_NAMES), Fidelity.VERIFICATION)
    assert report["cable angle from horizontal at the tow point"] == pytest.approx(
        report["critical angle from horizontal"], abs=0.01
    )


def test_a_wet_weight_that_does_not_fit_is_taken_and_said():
    inputs = {**TOW, "drag_law": TOWS[0][0], "speed_m_s": 1.5, "wet_weight_N_m": 2.5}
    metrics = run_case(case_of(inputs, TOW_NAMES), Fidelity.REALTIME)
    meant = within(tow_by_scipy(inputs, 1.5, two(1.5, 0.03)), TOW_NAMES)
    compare({o["name"]: o["value"] for o in metrics.outputs}, meant)
    assert any("buoyancy was set" in note for note in metrics.notes)


def test_words_of_a_drag_law():
    def report(text):
        return drag_law(case_of({"drag_law": text}, {}))

    assert report(PRINTED)["drag_law"] is DragLaw.DRISCOLL_NAHON_PRINTED
    assert report(TOWS[3][0]) == {
        "drag_law": DragLaw.DRISCOLL_NAHON,
        "drag_coefficient": 1.4,
        "tangential_coefficient": 0.0,
    }
    assert report(TOWS[1][0])["tangential_coefficient"] == pytest.approx(0.012 * pi)
    assert report(BOTH)["tangential_coefficient"] == 0.03
    assert report(TOWS[2][0])["tangential_coefficient"] == pytest.approx(0.025 * 1.3)
    for text in ("sails, Cd=1.2", "loading functions, Cd=1.2", "ribbon"):
        with pytest.raises(CaseError, match="inline"):
            report(text)


CIRCLE = {
    "mass_per_length_kg_m": 0.389,
    "wet_weight_N_m": 3.025582036151488,
    "diameter_m": 0.01,
    "fluid_density": 1026.0,
    "Cn": 1.2,
    "Ct": 0.02,
    "cable_length_m": 300.0,
    "body_wet_weight_N": 1000.0,
    "body_mass_kg": 250.0,
    "body_drag_area_CdA_m2": 0.05,
    "g": 9.81,
}
CIRCLE_NAMES = {
    "body circle radius": (0.01, 0),
    "body depth": (0.01, 0),
    "angle by which the body trails the ship on the circle": (0, 1.0),
    "tow-point tension": (0.01, 0),
}


def circle_by_scipy(inputs: dict) -> dict:
    """Inextensible line that turns as a whole about z: from the body up, the body's radius so that the top fits."""
    rate = inputs["ship_speed_m_s"] / inputs["ship_turn_radius_m"]
    rho, d, mu = inputs["fluid_density"], inputs["diameter_m"], inputs["mass_per_length_kg_m"]
    added = 0.25 * pi * d**2 * rho * inputs["Ca_normal"]
    law = two(inputs["Cn"], inputs["Ct"])

    def shoot(radius):
        r = np.array((radius, 0.0, 0.0))
        v, a = rate * np.array((0.0, radius, 0.0)), -(rate**2) * r
        drag = -0.5 * rho * inputs["body_drag_area_CdA_m2"] * np.linalg.norm(v) * v
        mass = inputs["body_mass_kg"] + inputs["body_added_mass_kg"]
        pull = mass * a - drag + (0.0, 0.0, inputs["body_wet_weight_N"])

        def slope(_, y):
            t, p = y[:3] / np.linalg.norm(y[:3]), y[3:]
            flow = -rate * np.array((-p[1], p[0], 0.0))
            acc = -(rate**2) * np.array((p[0], p[1], 0.0))
            load = line_load(flow, t, 0.5 * rho * d, inputs["Cn"], law) - added * (acc - (acc @ t) * t)
            return np.concatenate((mu * acc - load + (0.0, 0.0, inputs["wet_weight_N_m"]), t))

        return solve_ivp(slope, (0.0, inputs["cable_length_m"]), (*pull, *r), rtol=1e-8, atol=1e-8)

    want = inputs["ship_turn_radius_m"]
    radius = brentq(lambda x: hypot(*shoot(x).y[3:5, -1]) - want, 1e-3, want, xtol=1e-6)
    y = shoot(radius).y
    bearing = np.unwrap(np.arctan2(y[4], y[3]))
    return dict(
        zip(CIRCLE_NAMES, (radius, y[5, -1], degrees(bearing[-1] - bearing[0]), np.linalg.norm(y[:3, -1])), strict=True)
    )


@pytest.mark.parametrize("speed, radius, ca, added", [(2.5, 300.0, 0.0, 0.0), (2.0, 70.0, 1.0, 100.0)])
def test_circle_tow_is_the_line_that_turns_as_a_whole(speed, radius, ca, added):
    inputs = {
        **CIRCLE,
        "ship_speed_m_s": speed,
        "ship_turn_radius_m": radius,
        "Ca_normal": ca,
        "body_added_mass_kg": added,
    }
    check(inputs, within(circle_by_scipy(inputs), CIRCLE_NAMES))


@pytest.mark.parametrize(
    "length, diameter, mass, cd, speed, depths",
    [(10.0, 0.01, 0.389, 1.2, 1.0, (0.0, 0.37, 5.0, 10.0)), (24.0, 0.03, 2.0, 1.5, 0.7, (1.0, 9.167, 23.99))],
)
def test_reactions_of_a_cable_through_the_surface(length, diameter, mass, cd, speed, depths):
    """Weight less the water displaced; 0.5 rho d Cd U^2 on the wet length."""
    inputs = {
        "length_m": length,
        "diameter_m": diameter,
        "mass_per_length_kg_m": mass,
        "fluid_density": 1010.0,
        "Cd": cd,
        "current_m_s": speed,
        "g": 9.81,
    }
    expected = {}
    for wet in depths:
        pull = f"top tension, {wet} m of the cable under water"
        push = f"horizontal reaction at the top, {wet} m under water, current {speed:g} m/s, cable kept vertical"
        pushed = 505.0 * diameter * cd * speed**2 * wet
        expected[pull] = 9.81 * (mass * length - 0.25 * pi * diameter**2 * 1010.0 * wet), 0.002, 0
        expected[push] = pushed, 0, 0.005 * pushed + 0.001
    check(inputs, expected)


def sinking(net: float, mass: float, drag: float):
    """Terminal speed, speed and drop of (mass) v' = net - drag v^2 from rest."""
    top, rate = sqrt(net / drag), sqrt(net * drag) / mass
    return top, lambda t: top * tanh(rate * t), lambda t: top / rate * log(cosh(rate * t))


@pytest.mark.parametrize("diameter, mass, ca, length", [(0.01, 0.389, 1.0, 50.0), (0.04, 2.2, 0.8, 12.0)])
def test_a_level_cable_sinks_as_a_tanh(diameter, mass, ca, length):
    inputs = {
        "diameter_m": diameter,
        "mass_per_length_kg_m": mass,
        "fluid_density": 1026.0,
        "Cn": 1.2,
        "Ca": ca,
        "length_m": length,
        "g": 9.81,
    }
    water = 0.25 * pi * diameter**2 * 1026.0
    top, speed, drop = sinking((mass - water) * 9.81, mass + ca * water, 0.5 * 1026.0 * diameter * 1.2)
    expected = {"terminal speed": (top, 0.003, 0), "speed at 0.1 s": (speed(0.1), 0.01, 0)}
    check(inputs, expected | {f"drop at {t} s": (drop(t), 0.005, 0) for t in (1.0, 0.25)})


@pytest.mark.parametrize("radius, mass, ca, cd", [(0.1, 10.0, 0.5, 0.47), (0.3, 150.0, 0.6, 0.3)])
def test_a_sphere_sinks_as_a_tanh(radius, mass, ca, cd):
    inputs = {"sphere_radius_m": radius, "mass_kg": mass, "fluid_density": 1026.0, "Ca": ca, "Cd": cd, "g": 9.81}
    water = 4.0 / 3.0 * pi * radius**3 * 1026.0
    top, speed, drop = sinking((mass - water) * 9.81, mass + ca * water, 0.5 * 1026.0 * pi * radius**2 * cd)
    expected = {"terminal speed": (top, 0.003, 0), "depth at 1.0 s": (drop(1.0), 0.005, 0)}
    check(inputs, expected | {f"speed at {t} s": (speed(t), 0.005, 0) for t in (0.5, 0.133)})


@pytest.mark.parametrize("radius, mass, length, ca", [(0.1, 10.0, 2.0, 0.5), (0.2, 60.0, 9.0, 0.5)])
def test_a_submerged_pendulum_swings_with_its_added_mass(radius, mass, length, ca):
    """omega^2 = (m - m_w) g / ((m + C_a m_w) l)."""
    inputs = {
        "sphere_radius_m": radius,
        "mass_kg": mass,
        "fluid_density": 1026.0,
        "Ca": ca,
        "Cd": 0.0,
        "line_length_m": length,
        "g": 9.81,
        "amplitude_deg": 2.0,
    }
    water = 4.0 / 3.0 * pi * radius**3 * 1026.0
    net = (mass - water) * 9.81
    frequency = sqrt(net / (mass + ca * water) / length)
    check(inputs, {"angular frequency": (frequency, 0.005, 0), "static line tension": (net, 0.001, 0)})


@pytest.mark.parametrize("offset, size", [((-36.8, 0.0, 3.7), 1.0), ((12.0, -4.0, 9.0), 1.6)])
def test_a_point_of_the_ship_moves_with_six_harmonics(offset, size):
    """R = Rz(yaw) Ry(pitch) Rx(roll) of scipy; velocity and acceleration by central differences of the position."""
    given = {
        "surge": (0.8, 0.55, 0.2),
        "sway": (0.5, 0.43, 1.1),
        "heave": (1.5, 0.62, 0.0),
        "roll": (0.21, 0.5, 0.7),
        "pitch": (0.09, 0.6, 1.9),
        "yaw": (0.05, 0.2, 0.4),
    }
    inputs = {
        "offset_body_m": list(offset),
        "convention": "x = a sin(w t + ph)",
        "harmonics": {k: {"amplitude": size * a, "omega_rad_s": w, "phase_rad": p} for k, (a, w, p) in given.items()},
    }

    def pose(t):
        x = [size * a * sin(w * t + p) for a, w, p in given.values()]
        turn = Rotation.from_euler("ZYX", (x[5], x[4], x[3]))
        return np.array(x[:3]) + turn.apply(offset), turn.as_quat()

    times, allowed = (3.0, 17.503), {"position": 1e-6, "velocity": 1e-4, "acceleration": 5e-3}
    names = {f"sheave centre {what} at {t} s": (0, bound) for t in times for what, bound in allowed.items()}
    turns = {f"orientation quaternion x,y,z,w at {t} s (sign free)": t for t in times}
    case = case_of(inputs, names | dict.fromkeys(turns, (0, 1e-9)))
    for fidelity in Fidelity:
        report = values(case, fidelity)
        for t in times:
            h = 1e-3
            before, now, after = (pose(t + k * h)[0] for k in (-1, 0, 1))
            meant = {
                "position": now,
                "velocity": (after - before) / (2 * h),
                "acceleration": (after - 2 * now + before) / h**2,
            }
            for what, bound in allowed.items():
                assert report[f"sheave centre {what} at {t} s"] == pytest.approx(meant[what], abs=bound, rel=0)
        for name, t in turns.items():
            q = np.array(report[name])
            assert np.abs(q * np.sign(q[3]) - pose(t)[1] * np.sign(pose(t)[1][3])).max() < 1e-9
