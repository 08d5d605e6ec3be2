"""A rope on a fixed pulley with a swinging load, Westin (2018) 4.1, Table 1, configurations 1 to 3.

The rope is pinned a little before the top of the pulley, lies over it and carries the load of (138)-(139): a stiff
two-point element with the masses of a rigid body, its force along a unit direction, as it has to be. It starts in
static equilibrium (pre-tensioned) with the load held, rope and load in line at the printed wrap angle. No term damps
the swing: Table 1 gives none but c = 1e-3 N s.
"""

from __future__ import annotations

from math import cos, pi, radians, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.physics.integrate import Solver
from cable_sim_ros.physics.state import STRUT
from cable_sim_ros.plots.run import BLUE, FAINT, ORANGE, canvas
from cable_sim_ros.sim.rig.rig import Rig, cable_of

from ..bend import Bend, drum
from . import Comparison, Result, unjudged

RADIUS, DIAMETER, DENSITY, MODULUS, SECOND_MOMENT, DAMPING = 0.0462, 0.00884, 0.059, 2.0e9, 4.0e-14, 1e-3
ROPE = 0.44  # m, from the top of the pulley to the load
CONFIGURATIONS = {  # m_L [kg], L_PI [m], L_PG [m], first wrap angle [deg]
    1: (9.43, 0.269, 0.258, 34.9),
    2: (18.50, 0.259, 0.245, 40.4),
    3: (27.57, 0.245, 0.232, 49.4),
}
MEASURED = {1: {"wrap": (36.7, 146.0), "tension": (49.2, 162.0)}, 3: {"wrap": (52.4, 129.0)}}
ALLOWED = {1: {"wrap": 2.77, "tension": 21.2}, 3: {"wrap": 4.30}}  # Westin's own largest errors
SOURCE = "Westin (2018) 4.1"
SECONDS, QUICK_SECONDS = 10.0, 4.0
QUICK = f"{QUICK_SECONDS:g} s of {SECONDS:g} s, no loss, no choice made otherwise"


class Choice(NamedTuple):
    """What the source leaves open."""

    element: float = 0.011  # m, element on the rope: a quarter of the pulley's radius
    step: float = 0.001  # s
    lead: float = 0.05  # m, of rope between the pin and the top of the pulley
    penetration: float = 1e-3  # of the radius, under the load's weight
    contact_damping: float = 0.3  # s/m
    stiffness: float = 1e6  # N, of the load element
    bending: float = 1.0  # factor on E I
    rho_inf: float = Solver().rho_inf
    cutoff: float = 10.0  # Hz, of the low-pass on the tension
    order: int = 4  # of the Butterworth filter, forward and backward
    loss: float = 0.0  # 1/s, damping of all motion: air, rope, bearing


CHOSEN = Choice()


class Swing(NamedTuple):
    time: np.ndarray  # s
    wrap: np.ndarray  # deg, angle of the rope below the horizontal
    tension: np.ndarray  # N, at the pin
    smooth: np.ndarray  # N, low-passed
    energy: np.ndarray  # J, kinetic and potential of the load, from the start


def loaded(
    sections: list[tuple[float, int]], ea: float, ei: float, pull: float, surface: np.ndarray, load: np.ndarray, **more
) -> Rig:
    """The rope, fast at its first node, on a surface, with its load; sections: length [m] and elements, the last only
    carries the second point of the load; EA [N], EI [N m^2], weight [N]; load: a STRUT; more: of Rig."""
    cable = cable_of(
        [{"length": length, "elements": n} for length, n in sections],
        mass_per_length=DENSITY,
        axial_stiffness=ea,
        bending_stiffness=ei,
        axial_damping=DAMPING,
        diameter=DIAMETER,
    )
    rig = Rig(cable, held={0: "r", -1: "g"}, tension=pull, surfaces=[surface], struts=[load], **more)
    rig.empty_element(-1)
    return rig


def rigid_load(node: int, mass: float, inertia: float, centre: float, stiffness: float = 1e6) -> np.ndarray:
    """(138)-(139), a STRUT from this node on: mass [kg], L_PI and L_PG [m], stiffness [N]."""
    fraction, strut = centre / inertia, np.zeros((), STRUT)
    strut["node"], strut["length"], strut["stiffness"] = node, inertia, stiffness
    strut["aa"], strut["ab"], strut["bb"] = 2.0 * mass * (1.0 - fraction), mass * (fraction - 1.0), mass
    return strut


def build(number: int, choice: Choice) -> Rig:
    """The rope with its load at rest, load held."""
    mass, inertia, gravity_centre, wrap = CONFIGURATIONS[number]
    radius, angle = RADIUS + 0.5 * DIAMETER, radians(wrap)
    area = 0.25 * pi * DIAMETER**2
    pull = mass * 9.81
    rope = max(round(ROPE / choice.element), 4)
    lead = max(round(choice.lead / choice.element), 1)
    ea, ei = MODULUS * area, MODULUS * SECOND_MOMENT * choice.bending
    sections = [(choice.lead, lead), (ROPE, rope), (inertia, 1)]
    load = lead + rope  # its first point
    strut, fraction = rigid_load(load, mass, inertia, gravity_centre, choice.stiffness), gravity_centre / inertia
    surface, solver = drum(radius, pull, choice.contact_damping, choice.penetration), Solver(rho_inf=choice.rho_inf)
    rig = loaded(sections, ea, ei, pull, surface, strut, solver=solver, mass_damping=choice.loss)
    r, g = Bend(radius, 0.0, angle, choice.lead).nodes(rig.arc)
    # stretched by the pull of the first instant: the part of the weight along the rope
    first = pull * sin(angle)
    rig.place(r, g * (1.0 + first / ea))
    # held as by a hand across the rope: the part of the weight across it is carried until the release
    across = np.array((sin(angle), 0.0, cos(angle)))
    carried = pull * cos(angle)
    for node, part in ((load, 1.0 - fraction), (load + 1, fraction)):
        rig.load(node, carried * part * across)
    rig.settle(steps=800)
    rig.release_loads()
    rig.balance()
    return rig


def swing(number: int, duration: float, choice: Choice = CHOSEN) -> Swing:
    """Let one configuration swing for ``duration`` [s]."""
    from scipy.signal import butter, sosfiltfilt

    mass, inertia, gravity_centre, _ = CONFIGURATIONS[number]
    rig = build(number, choice)
    report = rig.run(duration, choice.step)
    load = rig.nodes - 2
    # the rope's own direction a diameter before the load, where the markers would be
    g = report.q[:, load - 1, 3:]
    wrap = np.degrees(np.unwrap(np.arctan2(-g[:, 2], g[:, 0])))
    tension = np.linalg.norm(report.reaction[:, 0, :3], axis=1)
    rate = 1.0 / choice.step
    smooth = sosfiltfilt(butter(choice.order, choice.cutoff, fs=rate, output="sos"), tension)
    fraction = gravity_centre / inertia
    p, i = report.q[:, load], report.q[:, load + 1]
    vp, vi = report.v[:, load, :3], report.v[:, load + 1, :3]
    kinetic = mass * (
        (1.0 - fraction) * np.sum(vp * vp, 1) + (fraction - 1.0) * np.sum(vp * vi, 1) + 0.5 * np.sum(vi * vi, 1)
    )
    height = p[:, 2] + fraction * (i[:, 2] - p[:, 2])
    energy = kinetic + mass * 9.81 * height
    return Swing(report.time, wrap, tension, smooth, energy - energy[0])


def ranges(s: Swing) -> dict[str, tuple[float, float]]:
    """Smallest and largest wrap [deg] and tension [N]; the filter's first and last half second left out where long."""
    inner = slice(None) if s.time[-1] < 2.0 else (s.time > 0.1) & (s.time < s.time[-1] - 0.1)
    return {
        "wrap": (float(s.wrap.min()), float(s.wrap.max())),
        "tension": (float(s.smooth[inner].min()), float(s.smooth[inner].max())),
        "raw tension": (float(s.tension.min()), float(s.tension.max())),
    }


OTHERWISE = {
    "20 elements on the rope (0.5 of a radius)": {"element": 0.022},
    "elements half as long": {"element": 0.0055},
    "step of 0.5 ms": {"step": 0.0005},
    "lead of 0.1 m": {"lead": 0.1},
    "penetration a tenth": {"penetration": 1e-4},
    "no contact damping": {"contact_damping": 0.0},
    "load ten times stiffer": {"stiffness": 1e7},
    "rope without bending stiffness": {"bending": 0.0},
    "bending stiffness times 100": {"bending": 100.0},
    "rho_inf 0": {"rho_inf": 0.0},
    "rho_inf 0.5": {"rho_inf": 0.5},
    "low-pass at 5 Hz": {"cutoff": 5.0},
    "low-pass at 20 Hz": {"cutoff": 20.0},
    "filter of order 2": {"order": 2},
}

MOST_LOSS, HALVINGS = 0.1, 7  # 1/s; of the bracket


def loss_shown(seconds: float = SECONDS) -> float:
    """Damping of all motion [1/s] for which the largest wrap of configuration 1 is the measured one, by bisection."""
    low, high = 0.0, MOST_LOSS
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if ranges(swing(1, seconds, Choice(loss=middle)))["wrap"][1] > MEASURED[1]["wrap"][1]:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def lossy(seconds: float = SECONDS) -> list[Comparison]:
    """The loss that the largest wrap of configuration 1 shows, and every other measured figure judged with it."""
    loss, rows = loss_shown(seconds), []
    rows.append(unjudged("with loss: damping of all motion", "1/s", loss, "chosen: largest wrap, configuration 1"))
    for n, measured in MEASURED.items():
        got = ranges(swing(n, seconds, Choice(loss=loss)))
        for what, pair in measured.items():
            for k, end in enumerate(("smallest", "largest")):
                if (n, what, k) == (1, "wrap", 1):
                    continue  # the loss was made of it
                name = f"with loss: configuration {n}, {end} {what}"
                unit = "deg" if what == "wrap" else "N"
                rows.append(Comparison(name, unit, got[what][k], pair[k], ALLOWED[n][what], SOURCE))
    return rows


def experiment(progress, seconds: float, quick: bool = False) -> Result:
    """All three configurations, and configuration 1 with every choice made otherwise; quick: shorter, no choices."""
    swings, rows, choices = {}, [], []
    for n in CONFIGURATIONS:
        progress(f"configuration {n}", n - 1, 3 + len(OTHERWISE))
        swings[n] = swing(n, seconds)
        got = ranges(swings[n])
        for what, unit in (("wrap", "deg"), ("tension", "N"), ("raw tension", "N")):
            for k, end in enumerate(("smallest", "largest")):
                measured = MEASURED.get(n, {}).get(what, (None, None))[k]
                name, allowed = f"configuration {n}, {end} {what}", ALLOWED.get(n, {}).get(what)
                rows.append(Comparison(name, unit, got[what][k], measured, allowed, SOURCE))
    progress("loss that one figure shows", 3, 3 + len(OTHERWISE))
    rows += [] if quick else lossy()
    base = ranges(swings[1])
    for i, (name, change) in enumerate(() if quick else OTHERWISE.items()):
        progress(name, 3 + i, 3 + len(OTHERWISE))
        other = ranges(swing(1, seconds, Choice()._replace(**change)))
        changed = {
            f"{end} {what}": other[what][k] - base[what][k]
            for what in ("wrap", "tension")
            for k, end in enumerate(("smallest", "largest"))
        }
        choices.append({"choice": name} | changed)
    chosen = "configuration 1, chosen otherwise: what changes"
    return Result("pulley", rows, choices, lambda folder: draw(swings, folder / "pulley.png"), chosen)


def draw(swings: dict[int, Swing], path: Path) -> Path:
    """Wrap angle and tension over time with the measured ranges. RuntimeError where matplotlib is missing."""
    title = "Load that swings on a rope over a fixed pulley"
    with canvas(path, (14.0, 10.0), title, f"measured ranges: {SOURCE}") as figure:
        for column, (n, s) in zip(figure.subplots(3, 2), swings.items(), strict=True):
            for axis, what, unit in zip(column, ("wrap", "tension"), ("deg", "N"), strict=True):
                if what == "tension":
                    axis.plot(s.time, s.tension, color=FAINT, lw=0.5, label="raw")
                    axis.plot(s.time, s.smooth, color=BLUE, lw=1.4, label="below 10 Hz")
                else:
                    axis.plot(s.time, s.wrap, color=BLUE, lw=1.4, label="simulated")
                for k, value in enumerate(MEASURED.get(n, {}).get(what, ())):
                    axis.axhline(value, color=ORANGE, ls="--", lw=1.2, label=None if k else "measured range")
                name = "wrap angle" if what == "wrap" else "tension at the pin"
                axis.set(title=f"Configuration {n}: {name}", ylabel=f"{what} [{unit}]")
                axis.set(xlim=(0.0, s.time[-1]), xlabel="time [s]" if n == 3 else "")
        names = {}
        for axis in figure.axes:
            names |= {label: line for line, label in zip(*axis.get_legend_handles_labels(), strict=True)}
        figure.legend(names.values(), names, loc="outside lower center", ncols=len(names), handlelength=1.8)
    return path
