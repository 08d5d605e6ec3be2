"""Slack families against an independent chain of rigid links and the closed form of a mass on a one-sided spring."""

import numpy as np
import pytest
from case_bench import check
from scipy.integrate import solve_ivp
from scipy.optimize import brentq


def falling_links(length, apart, gravity, drops, count=48):
    """Rigid links between lumped masses, angles as unknowns: time, x and speed of the tip when it has dropped."""
    link = length / count
    a = brentq(lambda a: 2 * a * np.sinh(apart / (2 * a)) - length, 0.05 * apart, 1e3 * length)
    s = np.arange(count + 1) * link - length / 2
    start = np.arctan2(np.diff(np.hypot(a, s)), np.diff(a * np.arcsinh(s / a)))
    mass = np.full(count, link)
    mass[-1] *= 0.5
    beyond = np.cumsum(mass[::-1])[::-1]
    inertia = link**2 * beyond[np.maximum.outer(np.arange(count), np.arange(count))]

    def rate(t, y):
        angle, w = y[:count], y[count:]
        d = angle[:, None] - angle[None, :]
        force = -(inertia * np.sin(d)) @ (w * w) - gravity * link * beyond * np.cos(angle)
        return np.concatenate((w, np.linalg.solve(inertia * np.cos(d), force)))

    def tip(y):
        angle, w = y[:count], y[count:]
        return (
            link * np.cos(angle).sum(),
            link * np.sin(angle).sum(),
            link * np.hypot((np.sin(angle) * w).sum(), (np.cos(angle) * w).sum()),
        )

    level = tip(np.concatenate((start, start)))[1]
    events = [lambda t, y, d=d: level - tip(y)[1] - d * length for d in drops]
    for event in events:
        event.direction = 1
    events[-1].terminal = True
    sol = solve_ivp(
        rate,
        (0, 2 * np.sqrt(2 * length / gravity)),
        np.concatenate((start, 0 * start)),
        rtol=1e-7,
        atol=1e-7,
        events=events,
    )
    return [(t[0], *(tip(y[0])[i] for i in (0, 2))) for t, y in zip(sol.t_events, sol.y_events)]


@pytest.mark.parametrize(
    ("length", "apart", "mass", "drops"),
    [(1.0, 0.5, 0.02, (0.25, 0.5, 0.75)), pytest.param(3.0, 2.1, 0.4, (0.3, 0.6), marks=pytest.mark.nightly)],
)
def test_chain_let_go(length, apart, mass, drops):
    expected = {}
    for drop, (t, x, v) in zip(drops, falling_links(length, apart, 9.81, drops)):
        expected |= {
            f"time for the tip to drop {drop:.2f} L": (t, 0.01, 0),
            f"tip x when it has dropped {drop:.2f} L": (x, 0, 0.01 * length),
            f"tip speed when it has dropped {drop:.2f} L": (v, 0.02, 0),
        }
    check(
        {
            "length_m": length,
            "end_separation_m": apart,
            "mass_per_length_kg_m": mass,
            "g": 9.81,
            "start": "inextensible catenary at rest",
        },
        expected,
    )


def test_dropped_weight():
    """A mass on a massless one-sided spring: half swings about its rest, between them free flight."""
    mass, length, ea, height, gravity = 100.0, 10.0, 1e5, 0.5, 9.81
    omega, speed = np.sqrt(ea / length / mass), np.sqrt(2 * gravity * height)
    rest, top = gravity / omega**2, mass * gravity + mass * np.hypot(gravity, speed * omega)
    taut = 2 / omega * (np.pi / 2 + np.arctan(rest * omega / speed))
    check(
        {
            "end_mass_kg": mass,
            "tether_length_m": length,
            "EA_N": ea,
            "tether_mass_per_length_kg_m": 1e-3 * mass / length,
            "free_fall_height_m": height,
            "g": gravity,
        },
        {
            "speed at engagement": (speed, 5e-3, 0),
            "largest tension": (top, 0.01, 0),
            "duration of the first taut phase": (taut, 0.01, 0),
            "height of rebound above engagement": (height, 0.03, 0),
            "time between first and second engagement": (taut + 2 * speed / gravity, 0.01, 0),
            "largest tension at second engagement": (top, 0.03, 0),
        },
    )
