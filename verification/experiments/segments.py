"""Chains of rigid links in water against another multibody code, and the closed forms of Huston and Kamman (1980).

R1: one rod released level; R2: ten links released level; R3: R2's chain with a ball at its tip, hanging straight at
rest, a stream from t = 0; R4: R3 without the ball. Links with spherical joints, full buoyancy, added mass of the normal
motion, planar. The references are those of Kane's equations for rigid links, integrated to a relative tolerance of
1e-10 with 8 Gauss points a link for the drag: no code is shared. The same cases run on cubic elements (ancf): a smooth
cable is no chain of ten links, and differs by what the corners are worth.

The source prints no numbers. What it prints can be evaluated: (41) to (43) as printed stand beside the same integrals.
"""

from __future__ import annotations

from math import atan2, degrees, log, pi
from pathlib import Path
from typing import NamedTuple

import numpy as np

from cable_sim_ros.physics.link_loads import integrals
from cable_sim_ros.physics.section import CableModel
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.water import Water
from cable_sim_ros.plots.run import canvas
from cable_sim_ros.sim.rig.rig import Rig, cable_of

from . import Comparison, Result

GRAVITY, DEPTH, STREAM, LENGTH = 9.81, -100.0, 2.2, 5.0  # m/s^2, m (all wet), m/s, m
STEP = 0.001  # s
SAME, STEADY, SMOOTH = 1e-4, 1e-3, 0.03  # m, m, of the length: what is allowed
RIGID = 2e6  # EA over the working tension: strain below 1e-6
REFERENCE = "another code (Kane)"
BALL_RADIUS, BALL_MASS, BALL_DRAG, BALL_ADDED = 0.05, 4.0, 0.47, 0.5  # m, kg, 1, 1

R1_ANGLE = {0.25: 1.324588, 0.5: 0.932665, 1.0: 0.275758, 2.0: -0.094964, 4.0: -0.034345}  # rad from straight down
R1_FORCE = (-3.0254, 16.7978)  # N, at 1 s
R2 = {  # s: tip x, tip z [m], top force [N]
    0.5: (4.910826, -0.297664, 2.0957),
    1.0: (4.686830, -0.648187, 2.5721),
    2.0: (4.131764, -1.349252, 4.6003),
    4.0: (2.895015, -2.751759, 8.7745),
    6.0: (1.524945, -4.182257, 12.8310),
    8.0: (0.368950, -4.983399, 15.0913),
}
R3 = {
    0.25: (0.118183, -4.926551),
    0.5: (0.451991, -4.822742),
    1.0: (1.455826, -4.618549),
    2.0: (2.962592, -3.880741),
    4.0: (3.785608, -3.046876),
    20.0: (4.037590, -2.712746),
}
R3_FORCE, R3_ANGLES = 48.634, (68.30, 67.44, 66.31, 64.81, 62.77, 59.92, 55.81, 49.61, 39.91, 24.65)  # N, deg
R4_EARLY, R4_LATE, R4_FORCE, R4_ANGLE = (1.933630, -4.241157), (4.752574, -1.553395), 11.7473, 71.8998
FORM = (0.25, 0.3, 0.5, 2.0)  # a, b, c, L of the integrals shown


class Chain(NamedTuple):
    """One run: samples every 0.25 s."""

    tip: np.ndarray  # [samples, 2] m, x and z from the pin
    force: np.ndarray  # [samples, 2] N, on the pin's side
    angle: np.ndarray  # [samples, elements] rad from straight down
    places: np.ndarray  # [samples, nodes, 2] m

    def at(self, t: float) -> int:
        """Row of the sample at t [s]."""
        return round(t / 0.25) - 1


def chain(
    duration: float,
    *,
    level: bool,
    ball: bool = False,
    stream: float = 0.0,
    elements: int = 10,
    model: CableModel = CableModel.SEGMENTS,
) -> Chain:
    """R2, R3 or R4 [s]; level: released level, else hanging straight."""
    section = {
        "length": LENGTH,
        "elements": elements,
        "drag_law": "crossflow",
        "drag_coefficient": 1.2,
        "tangential_coefficient": 0.02 * pi,
    }
    working = 50.0 if ball else 15.0
    cable = cable_of([section], model=model, diameter=0.01, mass_per_length=0.389, axial_stiffness=RIGID * working)
    water = 1026.0 * 4.0 / 3.0 * pi * BALL_RADIUS**3
    body = Towbody(
        mass=BALL_MASS,
        net_weight=(BALL_MASS - water) * GRAVITY,
        added_mass=(BALL_ADDED * water,) * 3,
        drag_area=(BALL_DRAG * pi * BALL_RADIUS**2,) * 3,
    )
    rig = Rig(
        cable,
        held={0: "r"},
        tension=working,
        gravity=GRAVITY,
        water=Water(density=1026.0, current=(stream, 0.0)),
        bodies={-1: body} if ball else {},
    )
    return _released(rig, duration, level)


def rod(duration: float) -> Chain:
    """R1 [s]."""
    section = {"length": 1.0, "elements": 1, "drag_law": "crossflow", "drag_coefficient": 1.2}
    cable = cable_of(
        [section], model=CableModel.SEGMENTS, diameter=0.02, mass_per_length=2.0, axial_stiffness=RIGID * 20.0
    )
    return _released(Rig(cable, held={0: "r"}, tension=20.0, water=Water(density=1000.0)), duration, True)


def _released(rig: Rig, duration: float, level: bool) -> Chain:
    rig.straight((0.0, 0.0, DEPTH), (1.0, 0.0, 0.0) if level else (0.0, 0.0, -1.0))
    rig.balance()
    run = rig.run(duration, STEP, every=round(0.25 / STEP))
    places = run.q[:, :, [0, 2]] - (0.0, DEPTH)
    along = np.diff(places, axis=1)
    return Chain(places[:, -1], run.reaction[:, 0, [0, 2]], np.arctan2(along[:, :, 0], -along[:, :, 1]), places)


def printed(a: float, b: float, c: float, length: float) -> tuple[float, float, float]:
    """I_0 to I_2 as (41) to (43) print them: X^3/2 where X^1/2 belongs, in (43) the logarithm without its factor."""
    high, low = a + 0.5 * b * length + 0.25 * c * length**2, a - 0.5 * b * length + 0.25 * c * length**2
    d, half = 4.0 * a * c - b * b, 0.5 * length * c**0.5
    lam = log((high**0.5 + half + 0.5 * b / c**0.5) / (low**0.5 - half + 0.5 * b / c**0.5))
    h, l = high**1.5, low**1.5
    zero = (c * length + b) / (4.0 * c) * h + (c * length - b) / (4.0 * c) * l + d / (8.0 * c**1.5) * lam
    one = (h - l) / (3.0 * c) - b * (c * length + b) / (8.0 * c * c) * h + b * (b - c * length) / (8.0 * c * c) * l
    one -= b * d / (16.0 * c**2.5) * lam
    two = (0.5 * length - 5.0 * b / (6.0 * c)) * h / (4.0 * c) + (0.5 * length + 5.0 * b / (6.0 * c)) * l / (4.0 * c)
    two += (
        (5.0 * b * b - 4.0 * a * c)
        / (16.0 * c * c)
        * ((c * length + b) / (4.0 * c) * h + (c * length - b) / (4.0 * c) * l)
    )
    return zero, one, two + d / (8.0 * c**1.5) * lam


def _forms() -> list[Comparison]:
    ours, theirs = integrals(*FORM), printed(*FORM)
    return [
        Comparison(f"closed forms, I_{k} as printed ({41 + k})", f"m^{k + 2}/s", ours[k], theirs[k], None, who)
        for k, who in enumerate(("exponents of two terms",) + ("exponents", "exponents, brace"))
    ]


def _tip(name: str, run: Chain, t: float, want: tuple[float, ...], allowed: float, who: str) -> list[Comparison]:
    x, z = run.tip[run.at(t)]
    return [
        Comparison(f"{name}, tip x at {t:g} s", "m", float(x), want[0], allowed, who),
        Comparison(f"{name}, tip z at {t:g} s", "m", float(z), want[1], allowed, who),
    ]


def _force(name: str, run: Chain, t: float, want: float, who: str) -> Comparison:
    ours = float(np.linalg.norm(run.force[run.at(t)]))
    return Comparison(f"{name}, top force at {t:g} s", "N", ours, want, 1e-3 * want, who)


def _rows(progress) -> tuple[list[Comparison], Chain, Chain]:
    rows, who = list[Comparison](), REFERENCE
    progress("R1", 0, 5)
    one = rod(4.0)
    for t, want in R1_ANGLE.items():
        ours = float(one.angle[one.at(t), 0])
        rows.append(Comparison(f"R1, angle at {t:g} s", "rad", ours, want, 1e-5, who))
    for k, axis in enumerate("xz"):
        ours = float(one.force[one.at(1.0), k])
        rows.append(Comparison(f"R1, support force {axis} at 1 s", "N", ours, R1_FORCE[k], 1e-3, who))
    progress("R2", 1, 5)
    two = chain(8.0, level=True)
    for t, (x, z, force) in R2.items():
        rows += [*_tip("R2", two, t, (x, z), SAME, who), _force("R2", two, t, force, who)]
    progress("R3", 2, 5)
    three = chain(20.0, level=False, ball=True, stream=STREAM)
    for t, want in R3.items():
        rows += _tip("R3", three, t, want, SAME, who)
    rows.append(_force("R3", three, 20.0, R3_FORCE, who))
    for k, want in enumerate(R3_ANGLES):
        rows.append(Comparison(f"R3, angle of link {k + 1}", "deg", degrees(three.angle[-1, k]), want, 0.006, who))
    progress("R4", 3, 5)
    four = chain(20.0, level=False, stream=STREAM)
    rows += _tip("R4", four, 1.0, R4_EARLY, SAME, who) + _tip("R4", four, 20.0, R4_LATE, STEADY, who)
    rows.append(_force("R4", four, 20.0, R4_FORCE, who))
    along = four.places[-1, -1]
    rows.append(Comparison("R4, angle", "deg", degrees(atan2(along[0], -along[1])), R4_ANGLE, 0.01, who))
    progress("ancf", 4, 5)
    smooth = {"elements": 20, "model": CableModel.ANCF}
    cable, loose = chain(8.0, level=True, **smooth), SMOOTH * LENGTH
    for t in (1.0, 4.0, 8.0):
        rows += _tip("R2 on ancf", cable, t, R2[t], loose, "a smooth cable: 3 % of the length")
    ball = chain(20.0, level=False, ball=True, stream=STREAM, **smooth)
    for t in (1.0, 4.0, 20.0):
        rows += _tip("R3 on ancf", ball, t, R3[t], loose, "a smooth cable: 3 % of the length")
    bare = chain(20.0, level=False, stream=STREAM, **smooth)
    rows += _tip("R4 on ancf", bare, 20.0, R4_LATE, STEADY, "straight: no corners")
    return rows + _forms(), two, cable


def experiment(progress) -> Result:
    """All of it; the references say how long each case lasts."""
    rows, links, smooth = _rows(progress)
    return Result("segments", rows, [], lambda folder: picture(links, smooth, folder))


def picture(links: Chain, smooth: Chain, folder: Path) -> Path:
    """R2: the chain and the smooth cable as they fall."""
    path = folder / "segments.png"
    with canvas(path, (10.0, 7.0), source="experiment segments of `cable-sim validate`") as figure:
        axis = figure.subplots()
        for k, t in enumerate((0.5, 1.0, 2.0, 4.0, 6.0, 8.0)):
            x, z = links.places[links.at(t)].T
            axis.plot(x, z, "o-", color=f"C{k}", ms=4, lw=1.0, label=f"{t:g} s")
            x, z = smooth.places[smooth.at(t)].T
            axis.plot(x, z, "--", color=f"C{k}", lw=1.0)
        axis.set_aspect("equal")
        axis.set(title="R2: ten links (solid) and a smooth cable (dashed), released level in still water")
        axis.set(xlabel="x [m]", ylabel="z [m]")
        axis.legend()
    return path
