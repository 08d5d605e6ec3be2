"""A drum over a body that hangs from it: the tow of experiment `drive`, and what closed forms say of it.

The drum with inertia M and the body m are the ends of an elastic rod, c^2 = EA/mu, Z = sqrt(EA mu):
w (M + m) cos(wL/c) = (M m w^2 / Z - Z) sin(wL/c), a spring EA/L between both where the rod is short. Generalised-alpha
steps turn w into another frequency and lose energy, by w h alone: `stepped` has both.
"""

from __future__ import annotations

from math import cos, hypot, log, pi, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq, least_squares

from cable_sim_ros.io.scenes.load import scene_from_dict
from cable_sim_ros.physics.integrate import Solver
from cable_sim_ros.sim.scene import Scene

from ..shipped import quiet

EA, MU, BODY, GRAVITY = 6.786e6, 0.389, 2500.0, 9.81  # cable of full_scale; kg
WEIGHT = BODY * GRAVITY
DEEP = 30.0  # m outboard from which the body hangs in the water, which bears a part of its weight
RADIUS, WRAP = 0.305, 0.255  # m, of the cable's centreline on drum and sheave


def hanging(mass: float, outboard: float, *, inboard: float = 2.0, tick: float = 0.01, **values: Any) -> Scene:
    """A drum of ``mass`` kg at the cable [m outboard and inboard of the sheave] over the body, at rest.

    The groove hardly gives way and the cable has no damping, so that it is a spring alone. values: others by key, with
    __ for the dot.
    """
    data: dict[str, Any] = {
        "name": "drum",
        "ship": {"tow_speed": 0.0, "reference_height": outboard + 20.0 if outboard < DEEP else 0.0},
        "water": {"density": 1026.0, "viscosity": 1.2e-3},
        "cable": {
            "diameter": 0.01,
            "mass_per_length": MU,
            "axial_stiffness": EA,
            "bending_stiffness": 1.4,
            "sections": {"all": {"length": outboard + inboard + 60.0, "drag_law": "off"}},
        },
        "winch": {
            "position": [-36.8 + inboard, 0.0, 0.6],
            "drum_radius": 0.3,
            "scope": outboard,
            "command_timeout": 1000.0,
        },
        "sheave": {"position": [-36.8, 0.0, 0.6], "radius": 0.25, "groove_depth": 0.03, "throat_angle_deg": 60.0},
        "contact": {"working_tension": 2e3, "penetration_limit": 5e-4},
        "towbody": {"mass": BODY, "net_weight": 2e4, "drag_area": [0.0] * 3, "added_mass": [0.0] * 3},
        "setpoint": {"algorithm": "hold"},
        "solver": {"tick": tick},
        "drive": {
            "model": "motor",
            "inertia": mass * RADIUS**2,
            "controller_mass": BODY,
            "curve_speed": [0.0, 10.0],
            "curve_pull": [2e5, 2e5],
            "brake_pull": 2e5,
        },
    }
    for key, value in values.items():
        *way, last = key.split("__")
        block = data
        for part in way:
            block = block.setdefault(part, {})
        block[last] = value
    with quiet():
        return scene_from_dict(data, "drum")


class Swing(NamedTuple):
    """A decaying swing found in a series: rad/s, 1/s, and its amplitude."""

    frequency: float
    decay: float
    amplitude: float


def swing_of(series: np.ndarray, tick: float, near: float) -> Swing:
    """Least squares for a slow trend (a polynomial of fourth order) and one decaying swing near ``near`` rad/s."""
    t = np.arange(len(series)) * tick
    trend = np.polynomial.legendre.legvander(2.0 * t / t[-1] - 1.0, 4)

    def parts(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        shape = np.exp(-p[1] * t)
        columns = np.column_stack([trend, shape * np.cos(p[0] * t), shape * np.sin(p[0] * t)])
        found = np.linalg.lstsq(columns, series, rcond=None)[0]
        return series - columns @ found, found

    def left(p: np.ndarray) -> np.ndarray:
        return parts(p)[0] / series.std()

    fits = [least_squares(left, [near * part, 0.1], x_scale=[near, 1.0]) for part in (0.93, 1.0, 1.05)]
    best = min(fits, key=lambda fit: fit.cost).x
    numbers = parts(best)[1]
    return Swing(float(best[0]), float(best[1]), hypot(*numbers[-2:]))


def closed(mass: float, length: float, stiffness: float = 1.0) -> float:
    """Lowest frequency of drum, cable and body [rad/s]; stiffness: of the cable over EA."""
    c, z = sqrt(stiffness * EA / MU), sqrt(stiffness * EA * MU)

    def off(w: float) -> float:
        k = w * length / c
        return w * (mass + BODY) * cos(k) - (mass * BODY * w * w / z - z) * sin(k)

    spring = sqrt(stiffness * EA / length * (1.0 / mass + 1.0 / (BODY + MU * length / 3.0)))
    places = np.linspace(0.3 * spring, 2.0 * spring, 400)
    for a, b in zip(places, places[1:], strict=False):
        if off(a) * off(b) <= 0.0:
            return float(brentq(off, a, b))
    raise ValueError(f"no frequency near {spring:g} rad/s")


def stepped(frequency: float, tick: float) -> Swing:
    """What generalised-alpha steps of ``tick`` s make of a swing without damping, from its matrix of one step."""
    rho, w, h = Solver().rho_inf, frequency, tick
    am, af = (2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0)
    gamma = 0.5 + af - am
    beta = 0.25 * (gamma + 0.5) ** 2
    per = (1.0 - af) / (1.0 - am)
    columns = []
    for q, v, a, x in np.eye(4):  # place, velocity, acceleration, auxiliary acceleration
        lag = (af * a - am * x) / (1.0 - am)
        end = (q + h * v + h * h * ((0.5 - beta) * x + beta * lag)) / (1.0 + (w * h) ** 2 * beta * per)
        new = lag - per * w * w * end
        columns.append((end, v + h * ((1.0 - gamma) * x + gamma * new), -w * w * end, new))
    values = np.linalg.eigvals(np.array(columns).T)
    swing = max((value for value in values if value.imag > 1e-9), key=abs)
    return Swing(float(np.angle(swing)) / h, -log(abs(swing)) / h, 1.0)


def amplitude_at(series: np.ndarray, time: np.ndarray, period: float) -> float:
    """Amplitude of the swing of this period [s] in a series, beside a constant and a drift."""
    w = 2.0 * pi / period
    columns = np.column_stack([np.ones_like(time), time, np.cos(w * time), np.sin(w * time)])
    return hypot(*np.linalg.lstsq(columns, series, rcond=None)[0][-2:])
