"""Families of waves against d'Alembert and the method of characteristics, at the tolerances of the case files."""

import numpy as np
import pytest
from case_bench import check


@pytest.mark.parametrize(("ea", "mass", "length", "force"), [(6.786e6, 0.389, 450.0, 1e3), (2e6, 1.2, 300.0, -400.0)])
def test_step_force(ea, mass, length, force):
    """A step runs along the bar, doubles at the support and returns: Timoshenko & Goodier, Theory of Elasticity."""
    c, still = np.sqrt(ea / mass), force * length / ea
    check(
        {"EA_N": ea, "mass_per_length_kg_m": mass, "length_m": length, "step_force_N": force},
        {
            "wave speed": (c, 0.01, 0),
            "free-end velocity before first reflection": (force * c / ea, 0.02, 0),
            "free-end displacement at t=L/c": (still, 0.02, 0),
            "free-end displacement at t=2L/c (maximum)": (2 * still, 0.02, 0),
            "free-end displacement at t=4L/c": (0.0, 0, 0.05 * abs(2 * still)),
            "support reaction, mean over 1.2..2.8 L/c": (2 * force, 0.03, 0),
            "support reaction, mean over 0.1..0.9 L/c": (0.0, 0, 0.05 * abs(force)),
            "arrival time at the support (half-amplitude)": (length / c, 0.02, 0),
        },
    )


def stopped(z, end_mass, speed, transit, last, n=2000):
    """Characteristics of a cable (impedance z [N s/m]) with an end mass whose other end stops: T - z v runs out,
    T + z v comes back. Times in L/c, dynamic tension at the winch, speed of the mass."""
    h = transit / n
    count = int(last * n) + 1
    winch, tension, v = np.full(count, z * speed), np.zeros(count), np.full(count, speed)
    for i in range(1, count):
        out = winch[i - n] if i >= n else -z * speed  # T - z v that reaches the mass
        v[i] = -out / z + (v[i - 1] + out / z) * np.exp(-z * h / end_mass)
        tension[i] = out + z * v[i]
        if i >= n:
            winch[i] = tension[i - n] + z * v[i - n]
    return np.arange(count) / n, winch, v


@pytest.mark.parametrize(
    ("ea", "mass", "length", "end", "speed", "pull"),
    [
        pytest.param(6.786e6, 0.389, 450.0, 250.0, 1.0, 6000.0, marks=pytest.mark.nightly),
        (3e6, 0.8, 200.0, 60.0, 0.5, 2500.0),
    ],
)
def test_winch_stopped_dead(ea, mass, length, end, speed, pull):
    z, unit = np.sqrt(ea * mass), length * np.sqrt(mass / ea)
    t, winch, v = stopped(z, end, speed, unit, 8.0)
    small = 0.01 * winch.max()
    expected = {
        f"dynamic tension at the winch at t={at} L/c": (np.interp(at, t, winch), 0.03, small)
        for at in (0.5, 1.5, 2.5, 3.5, 4.5, 5.5)
    }
    expected |= {
        "immediate tension rise at the winch": (z * speed, 0.03, 0),
        "largest dynamic tension at the winch in 0..3 L/c (head)": (winch[t <= 3].max(), 0.15, 0),
        "time of that maximum": (t[np.argmax(winch[t <= 3])] * unit, 0, 0.1 * unit),
        "end-mass speed at t=6 L/c": (np.interp(6.0, t, v), 0.03, 0.02 * speed),
    }
    check(
        {
            "EA_N": ea,
            "mass_per_length_kg_m": mass,
            "length_m": length,
            "end_mass_kg": end,
            "payout_speed_m_s": speed,
            "constant_force_on_end_mass_N": pull,
        },
        expected,
    )


def plucked(x, t, length, at, height, c):
    """d'Alembert: half the odd, periodic continuation of the triangle to either side."""

    def shape(y):
        y = (y + length) % (2 * length) - length
        return np.sign(y) * np.interp(abs(y), (0, at, length), (0, height, 0))

    return 0.5 * (shape(x - c * t) + shape(x + c * t))


@pytest.mark.parametrize(
    ("length", "mass", "tension", "at", "height", "ea"),
    [(50.0, 0.4, 1000.0, 25.0, 0.05, 1e6), (80.0, 0.25, 400.0, 20.0, 0.04, 4e5)],
)
def test_pluck(length, mass, tension, at, height, ea):
    c = np.sqrt(tension / mass)
    period = 2 * length / c
    expected = {"wave speed": (c, 0.01, 0), "period P": (period, 5e-3, 0)}
    for name, fraction, allowed in (("P/8", 1 / 8, 0.03), ("P/4", 1 / 4, 0.03), ("P/2", 1 / 2, 0.06), ("P", 1.0, 0.08)):
        expected[f"midpoint displacement at t={name}"] = (
            plucked(length / 2, fraction * period, length, at, height, c),
            0,
            allowed * height,
        )
    check(
        {
            "length_m": length,
            "mass_per_length_kg_m": mass,
            "tension_N": tension,
            "pluck_at_m": at,
            "pluck_height_m": height,
            "EA_N": ea,
        },
        expected,
    )
