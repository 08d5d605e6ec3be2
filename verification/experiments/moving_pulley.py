"""A rope over a pulley on an arm that rocks at 1 Hz, Westin (2018) 4.2, Table 2.

The arm turns about a hinge; it carries the pulley and the load cell to which the rope is made fast. The amplitude of
the arm is plotted, not printed: the whole family over it is computed, and amplitude is taken from one end of the
measured range to judge the other end by it. The load is that of pulley.py, the two-point element of (138)-(139).
"""

from __future__ import annotations

from math import asin, atan2, hypot, pi, radians
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.plots.run import BLUE, FAINT, ORANGE, canvas
from cable_sim_ros.sim.rig.rig import HALVED, Rig
from cable_sim_ros.terminal import markdown_table

from ..bend import drum
from . import Comparison, Result, unjudged
from .pulley import DIAMETER, MODULUS, SECOND_MOMENT, loaded, rigid_load

RADIUS, ROPE = 0.0318 + 0.5 * DIAMETER, 1.32  # m, of the centreline; from the cell to the load
MASS, INERTIA, CENTRE = 4.749, 0.0855, 0.0685  # kg, L_PI and L_PG [m]
PULLEY, CELL = np.array((0.887, -0.0075)), np.array((0.188, -0.0325))  # m from the hinge, arm level: x, z
FREQUENCY, PASS_BAND = 1.0, 3.0  # Hz
GRAVITY = 9.81
MEASURED, LARGEST_ERROR, DEVIATION = (36.9, 51.5), 6.40, 1.79  # N
SOURCE = "Westin (2018) 4.2"
SECONDS, QUICK_SECONDS, RAMP = 10.0, 2.0, 3.0  # s: Westin's; of --quick; until the arm has its amplitude
FAMILY, QUICK_FAMILY = (0.5, 1.0, 2.0, 3.0, 4.0), (1.0, 3.0, 4.0)  # deg
QUICK = (
    f"{QUICK_SECONDS:g} s of {SECONDS:g} s, {len(QUICK_FAMILY)} amplitudes of {len(FAMILY)}, no choice made otherwise"
)


class Choice(NamedTuple):
    """What the source leaves open."""

    step: float = 0.002  # s
    elements: int = 88  # on the rope: 0.4 of a radius; his 44 give 0.5 % less at rest than the load and rope weigh
    harmonic: float = 0.0  # of twice the frequency, of the amplitude; deepest where the arm turns at its top
    stop_band: float = 5.0  # Hz, of the filter: 60 dB; 0: no filter
    penetration: float = 1e-3  # of the radius, under the load's weight
    mass_damping: float = 0.0  # 1/s
    modulus: float = 1.0  # factor on E


CHOSEN = Choice()
OTHERWISE = {
    "step of 1 ms": {"step": 0.001},
    "44 elements on the rope, his mesh": {"elements": 44},
    "176 elements on the rope": {"elements": 176},
    "penetration a tenth": {"penetration": 1e-4},
    "E half as large": {"modulus": 0.5},
    "filter that stops at 4 Hz": {"stop_band": 4.0},
    "no filter": {"stop_band": 0.0},
    "damping of all motion, 1 % of critical at 1 Hz": {"mass_damping": 0.02 * 2.0 * pi * FREQUENCY},
    "second harmonic, 5 % of the amplitude": {"harmonic": 0.05},
    "second harmonic, 10 % of the amplitude": {"harmonic": 0.10},
}


class Rocking(NamedTuple):
    """One run: time [s], angle of the arm [deg], tension at the cell as simulated and filtered [N]."""

    time: np.ndarray
    angle: np.ndarray
    raw: np.ndarray
    tension: np.ndarray

    @property
    def ends(self) -> tuple[float, float]:
        """Smallest and largest tension [N]."""
        return float(self.tension.min()), float(self.tension.max())


def arm(t: np.ndarray, amplitude: float, harmonic: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angle [rad], rate and acceleration of the arm at times t; amplitude [rad]. It begins at rest and level."""
    x = np.clip(t / RAMP, 0.0, 1.0)
    slow = 1.0 - x
    grown = x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
    first, second = 30.0 * x**2 * slow**2 / RAMP, 60.0 * x * slow * (1.0 - 2.0 * x) / RAMP**2
    w = 2.0 * pi * FREQUENCY
    wave = np.sin(w * t) - harmonic * np.cos(2.0 * w * t)
    rate = w * np.cos(w * t) + 2.0 * harmonic * w * np.sin(2.0 * w * t)
    turn = -(w**2) * np.sin(w * t) + 4.0 * harmonic * w**2 * np.cos(2.0 * w * t)
    return (
        amplitude * grown * wave,
        amplitude * (first * wave + grown * rate),
        amplitude * (second * wave + 2.0 * first * rate + grown * turn),
    )


def carried(place: np.ndarray, turn: tuple[np.ndarray, np.ndarray, np.ndarray]) -> np.ndarray:
    """Position, velocity, acceleration [times, 9] of a point of the arm; the angle raises the far end."""
    angle, rate, acceleration = turn
    c, s = np.cos(angle), np.sin(angle)
    x, z, none = c * place[0] - s * place[1], s * place[0] + c * place[1], np.zeros_like(angle)
    velocity = -rate * z, none, rate * x
    return np.stack(
        [x, none, z, *velocity, -acceleration * z - rate**2 * x, none, acceleration * x - rate**2 * z], axis=1
    )


def build(choice: Choice) -> Rig:
    """Rope and load at rest over the pulley of a level arm."""
    pull, ea = MASS * GRAVITY, MODULUS * choice.modulus * 0.25 * pi * DIAMETER**2
    sections, ei = [(ROPE, choice.elements), (INERTIA, 1)], MODULUS * choice.modulus * SECOND_MOMENT
    surface = drum(RADIUS, pull, 0.3, choice.penetration)
    surface["centre"] = surface["body"] = (PULLEY[0], 0.0, PULLEY[1])
    load = rigid_load(choice.elements, MASS, INERTIA, CENTRE)
    rig = loaded(sections, ea, ei, pull, surface, load, mass_damping=choice.mass_damping)
    away = PULLEY - CELL
    far = hypot(*away)
    up = atan2(away[1], away[0]) + asin(RADIUS / far)  # of the straight part between cell and pulley
    straight = (far**2 - RADIUS**2) ** 0.5
    s = rig.arc - straight
    heading = np.clip(up - s / RADIUS, -0.5 * pi, up)
    g = np.column_stack((np.cos(heading), 0.0 * s, np.sin(heading)))
    r = np.column_stack((PULLEY[0] - RADIUS * np.sin(heading), 0.0 * s, PULLEY[1] + RADIUS * np.cos(heading)))
    r += (np.minimum(s, 0.0) + np.maximum(s - RADIUS * (up + 0.5 * pi), 0.0))[:, None] * g
    rig.place(r, g * (1.0 + pull / ea))
    rig.settle(steps=800)
    rig.balance()
    return rig


def rock(amplitude: float, seconds: float = SECONDS, choice: Choice = CHOSEN) -> Rocking:
    """The arm rocks with ``amplitude`` [deg]; ``seconds`` are kept from the ramp and the filter's length on."""
    taps = low_pass(choice)
    edge = 0.5 * (len(taps) - 1) * choice.step
    count = round((RAMP + seconds + 2.0 * edge) / choice.step)
    t = choice.step * np.arange(count + 1)
    turn = arm(t, radians(amplitude), choice.harmonic)
    cell, centre = carried(CELL, turn), carried(PULLEY, turn)
    rig, raw = build(choice), np.zeros(count + 1)
    surface, pair = rig.state.surfaces[0], np.zeros((2, 1, 9))
    raw[0] = np.linalg.norm(rig.state.reaction[0, :3])
    for n in range(count):
        # where the surface is at the end of the step: forces are taken there
        surface["centre"], surface["speed"] = centre[n + 1, :3], centre[n + 1, 3:6]
        pair[:, 0] = cell[n : n + 2]
        for _ in rig.steps(choice.step, moved=(0,), motion=lambda times: pair, rules=HALVED):
            pass
        raw[n + 1] = np.linalg.norm(rig.state.reaction[0, :3])
    smooth = np.convolve(raw, taps, "same")
    kept = (t >= RAMP + edge) & (t <= t[-1] - edge)
    return Rocking(t[kept] - t[kept][0], np.degrees(turn[0][kept]), raw[kept], smooth[kept])


def low_pass(choice: Choice) -> np.ndarray:
    """Taps of the FIR filter, without delay: flat to 3 Hz, 60 dB from the stop band on."""
    if choice.stop_band <= 0.0:
        return np.ones(1)
    from scipy.signal import firwin, kaiserord

    rate = 1.0 / choice.step
    number, beta = kaiserord(60.0, (choice.stop_band - PASS_BAND) / (0.5 * rate))
    return firwin(number | 1, 0.5 * (PASS_BAND + choice.stop_band), window=("kaiser", beta), fs=rate)


def experiment(progress, seconds: float, quick: bool = False) -> Result:
    """The family over amplitude, each end of the measured range predicted from the other, and the choices.

    quick: shorter, a smaller family, no choices.
    """
    family = QUICK_FAMILY if quick else FAMILY
    runs, total = {}, len(FAMILY) + 3 + len(OTHERWISE)
    for n, amplitude in enumerate(family):
        progress(f"{amplitude:g} deg", n, total)
        runs[amplitude] = rock(amplitude, seconds)
    low, high = (np.array([run.ends[k] for run in runs.values()]) for k in (0, 1))
    by_low = float(np.interp(-MEASURED[0], -low, family))
    by_high = float(np.interp(MEASURED[1], high, family))
    progress("amplitude from one end", len(FAMILY), total)
    one, other = rock(by_low, seconds), rock(by_high, seconds)
    middle, why = 0.5 * sum(MEASURED), "no amplitude moves it: over a period the load falls as far as it rises"
    his = DEVIATION, f"{SOURCE}: his standard deviation", why
    rows = [
        unjudged("amplitude that gives the smallest tension", "deg", by_low, "not printed"),
        unjudged("amplitude that gives the largest tension", "deg", by_high, "not printed"),
        Comparison(
            "largest tension, amplitude from the smallest", "N", one.ends[1], MEASURED[1], LARGEST_ERROR, SOURCE
        ),
        Comparison(
            "smallest tension, amplitude from the largest", "N", other.ends[0], MEASURED[0], LARGEST_ERROR, SOURCE
        ),
        *(
            Comparison(f"middle of the range, amplitude from the {end}", "N", 0.5 * sum(run.ends), middle, *his)
            for end, run in (("smallest", one), ("largest", other))
        ),
    ]
    choices = []
    for n, (name, change) in enumerate(() if quick else OTHERWISE.items()):
        progress(name, len(FAMILY) + 3 + n, total)
        changed = rock(by_low, seconds, Choice(**change)).ends
        choices.append(
            {"choice": name, "smallest [N]": changed[0] - one.ends[0], "largest [N]": changed[1] - one.ends[1]}
        )
    chosen = f"at {by_low:.2f} deg, chosen otherwise: what changes"
    result = Result("moving_pulley", rows, choices, lambda folder: draw(one, family, low, high, folder), chosen)

    def tables() -> list[str]:
        from .table import markdown

        lines = [("amplitude [deg]", "smallest [N]", "largest [N]", "middle [N]")]
        lines += [(f"{a:g}", f"{p:.2f}", f"{q:.2f}", f"{0.5 * (p + q):.2f}") for a, p, q in zip(family, low, high)]
        return [markdown(result), "Family over the amplitude, measured 36.9 to 51.5 N:", markdown_table(lines)]

    return result._replace(tables=tables)


def draw(run: Rocking, amplitudes: tuple[float, ...], low: np.ndarray, high: np.ndarray, folder: Path) -> Path:
    """Range over amplitude, and the tension of one run. RuntimeError where matplotlib is missing."""
    path = folder / "moving_pulley.png"
    with canvas(path, (11.0, 6.0), "Rope over a pulley on a rocking arm", f"measured range: {SOURCE}") as figure:
        family, course = figure.subplots(1, 2)
        family.fill_between(amplitudes, low, high, color=FAINT, alpha=0.4, lw=0.0, label="simulated range")
        family.plot(amplitudes, 0.5 * (low + high), color=BLUE, label="simulated, middle")
        family.set_xlabel("amplitude of the arm [deg]")
        course.plot(run.time, run.tension, color=BLUE)
        course.set(xlabel="time [s]", title=f"one run, {0.5 * np.ptp(run.angle):.1f} deg")
        family.set_title("family over the amplitude")
        for axis in (family, course):
            axis.set(ylabel="tension at the cell [N]", ylim=(30.0, 72.0))  # room for the names
            for k, value in enumerate(MEASURED):
                axis.axhline(value, color=ORANGE, ls="--", lw=1.2, label=None if k else "measured range")
            axis.axhline(0.5 * sum(MEASURED), color=ORANGE, ls=":", lw=1.2, label="measured, middle")
        family.legend(loc="upper left", fontsize="small")
    return path
