"""The four cases of the flume tank, Westin (2018) 4.3.3, measured by Calnan, and what they need of the line.

Printed are means, deviations and volumes; the winch motion of figure 27, its length and the corner of the turbulence
filter are not. Chosen in their place: the motion of NBP1406 at the sheave of `full_scale` made smaller and faster,
40 s of it, and the time scale of `turbulence`. What another choice changes stands in the table; nothing is fitted to
Tables 4 to 7. Turbulence is a sum of sinusoids in time: one seed is the same water in steps of any length.

Of the line (4.3.1): bending stiffness, damping of its first mode, drag factor. The photograph of the bend test is not
printed: the golden section is tried on points of our own line, scattered so that the sum of squares is the one that he
found.
"""

from __future__ import annotations

from collections.abc import Callable
from math import hypot, pi, sqrt
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from cable_sim_ros.io.scenes.document import share_folder
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.plots.run import BLUE, FAINT, ORANGE, canvas
from cable_sim_ros.runs.make_bags import read_csv
from cable_sim_ros.runs.summary import ellipsoid_volume
from cable_sim_ros.sim.inputs import ShipMotion
from cable_sim_ros.sim.rig.rig import Rig
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator

from ..cables import uniform
from ..cases.modes import transverse
from ..shipped import scene_with, started
from . import Comparison, Result, unjudged
from .turbulence import AXES, CENTRE, DEVIATION, LINE, STILL, TIME, TIME_SCALE
from .viv_tow import land, miss
from .workers import Over, here

LENGTH, MASS, LINE_MASS, DIAMETER, EI = 0.0464, 1.33e-3, 0.2e-3, 0.45e-3, 2.82e-6
TOW, GRAVITY, MODULUS = 1.01, 9.81, 1.40e9
SECOND_MOMENT = pi * DIAMETER**4 / 64.0
POINTS, BEND_ERROR = 25, 2.54e-7  # of the photograph; his sum of squares [m^2]
RANGE_EI, RANGE_G = (2e-6, 6e-6), (1.0, 2.0)  # of his golden sections
SOURCE = "Westin (2018) 4.3"
MEASURED_CENTRE = (CENTRE[0], -0.008, CENTRE[1])
ROUNDING = 0.01  # of the printed figures, where his simulation is as measured
MOTION = "nbp1406_6dof_derived_1hz.csv"
LEVER = (-36.8, 0.0, 3.7)  # m, of the sheave of full_scale from base_link
SECONDS, QUICK_SECONDS, SETTLING, RAMP, SEEDS = 40.0, 15.0, 20.0, 5.0, 20
SETS, QUICK_SETS = 5, 2  # of points of the bend test
CASES = {  # set-point; experiment's and Westin's volume [cm^3] and deviations [cm]; how far off his centroid was [cm]
    "no motion": ("hold", (4.82, 1.19, 0.78, 0.13), (7.76, 1.56, 1.23, 0.07), 0.48),
    "uncompensated": ("hold", (182.84, 2.73, 1.36, 0.88), (185.96, 2.14, 1.55, 0.97), 2.15),
    "simplified": ("simplified_sheave", (36.55, 2.58, 1.29, 0.28), (26.68, 2.82, 1.67, 0.12), 1.88),
    "rigorous": ("rigorous_sheave", (24.92, 2.42, 1.15, 0.28), (19.55, 2.42, 1.48, 0.10), 2.62),
}
TABLES = dict(zip(CASES, ("Table 4", "Table 5", "Table 6", "Table 7")))
MOVED = "the winch motion of figure 27 is not printed"


class Choice(NamedTuple):
    """What the source leaves open."""

    smaller: float = 100.0  # by which the motion of NBP1406 is divided
    faster: float = 5.0  # by which its time is
    time_scale: float = TIME_SCALE  # s, of the turbulence
    drag_factor: float = 1.737
    step: float = 0.01  # s, of turbulence that changes in 50 ms


CHOSEN = Choice()
OTHERWISE = {
    "motion divided by 70": {"smaller": 70.0},
    "time of the motion divided by 10": {"faster": 10.0},
    "turbulence of 0.25 s": {"time_scale": 0.25},
    "turbulence of 0.03 s, steps of 5 ms": {"time_scale": 0.03, "step": 0.005},
    "step of 20 ms": {"step": 0.02},
    "step of 5 ms": {"step": 0.005},
}
CHANGED = ("no motion", "uncompensated", "simplified")  # cases in which choices are made otherwise
QUICK = (
    f"{QUICK_SECONDS:g} s of {SECONDS:g} s, one seed of {SEEDS}, {QUICK_SETS} sets of points of {SETS}, "
    "no choice made otherwise"
)


class Trace(NamedTuple):
    """The sphere after the settling: path [n, 3] from the top of the winch [m], volume [cm^3], deviations [cm].

    track: standard deviation of the error of the winch's track [mm].
    """

    path: np.ndarray
    volume: float
    deviations: np.ndarray
    track: float

    @property
    def away(self) -> float:
        """Distance of the centroid, in the plane of the stream, from the one measured without motion [cm]."""
        return 100.0 * hypot(*(self.path.mean(axis=0) - MEASURED_CENTRE)[[0, 2]])


def winch_motion(choice: Choice) -> tuple[np.ndarray, Any]:
    """Times [s] and curve (of times and order, [n, 3] m) of the winch: NBP1406 at the sheave of full_scale, smaller and
    faster; small angles, x ahead, y to port, z up."""
    from scipy.interpolate import CubicSpline

    columns = read_csv(share_folder() / "bags" / "source" / MOTION)[1]
    surge, sway, heave = columns["surge_fwd_m"], -columns["sway_stbd_m"], -columns["heave_down_m"]
    roll, pitch, yaw = columns["roll_rad"], -columns["pitch_rad"], -columns["yaw_rad"]
    x, _, z = LEVER
    place = np.stack([surge + pitch * z, sway + yaw * x - roll * z, heave - pitch * x], axis=1)
    place = (place - place.mean(axis=0)) / choice.smaller
    t = columns["t_s"] / choice.faster
    return t, CubicSpline(t, place)


def scene_of(algorithm: str, seed: int | None, choice: Choice) -> Scene:
    """Scene `flume` with a set-point and the turbulence of a seed; None: without turbulence."""
    values = {
        "setpoint.algorithm": algorithm,
        f"{LINE}.drag_amplification": choice.drag_factor,
        "solver.tick": choice.step,
    }
    if seed is not None:
        values |= {
            "water.turbulence.deviation": DEVIATION,
            "water.turbulence.seed": seed,
            TIME: choice.time_scale,
            "water.ramp": 5.0,
        }
    return scene_with("flume", values)


def moved(sim: Simulator, seconds: float, choice: Choice | None) -> np.recarray:
    """Tick outputs after the settling, the winch moved; choice None: it stands."""
    tick, frames, pushed, level = sim.scene.solver.tick, [], 0, (0.0, 0.0, 0.0)
    if choice is not None:
        times, curve = winch_motion(choice)
        seconds = min(seconds, times[-1] - times[0] - SETTLING - 2.0)  # there is no more motion
    count, block = round((SETTLING + seconds) / tick), 50
    if choice is not None:
        stamps = tick * np.arange(1, count + block + 5)
        at = np.minimum(times[0] + stamps, times[-1])
        x = np.clip(stamps / RAMP, 0.0, 1.0)
        grown, rate = x**2 * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) / RAMP
        place = grown[:, None] * curve(at)
        speed = grown[:, None] * curve(at, 1) + rate[:, None] * curve(at)
    for k in range(0, count, block):
        while choice is not None and pushed < k + block + 4:
            stamp, where, how_fast = round(stamps[pushed] * 1e9), tuple(place[pushed]), tuple(speed[pushed])
            sim.push(ShipMotion(time_ns=stamp, position=where, velocity=how_fast, attitude=level, rate=level))
            pushed += 1
        frames.append(sim.run(min(block, count - k)).copy())
    f = np.concatenate(frames).view(np.recarray)
    return f[f.time > min(SETTLING, 0.2 * f.time[-1] * 1e-9) * 1e9]


def trace(case: str, seconds: float, seed: int = 1, choice: Choice = CHOSEN) -> Trace:
    """The sphere in one of the four cases."""
    scene = scene_of(CASES[case][0], seed, choice)
    f = moved(started(scene), seconds, None if case == "no motion" else choice)
    path = f.body_position - (np.asarray(scene.sheave.position) + (0.0, 0.0, scene.sheave.radius))
    deviations = 100.0 * np.sqrt(np.linalg.eigvalsh(np.cov(path.T))[::-1])
    track = 1e3 * float(np.std(f.payout_setpoint - f.payout))
    return Trace(path, 1e6 * ellipsoid_volume(f.time * 1e-9, path)[1], deviations, track)


def case_rows(found: dict[str, list[Trace]]) -> list[Comparison]:
    """Tables 4 to 7: the mean over the seeds is judged, their spread and the centroid stand below it."""
    rows, means = [], {}
    for case, traces in found.items():
        _, measured, his, away = CASES[case]
        source, why = f"{SOURCE}.3, {TABLES[case]}", STILL if case == "no motion" else MOVED
        values = np.array([(t.volume, *t.deviations) for t in traces])
        means[case] = float(values[:, 0].mean())
        names = ("ellipsoid volume", *(f"standard deviation along {axis}" for axis in AXES))
        for k, name in enumerate(names):
            unit, ours, allowed = "cm" if k else "cm^3", float(values[:, k].mean()), abs(his[k] - measured[k])
            allowed = max(allowed, ROUNDING)
            rows.append(Comparison(f"{case}: {name}", unit, ours, measured[k], allowed, source, why, his[k]))
        deviation = float(values[:, 0].std(ddof=1)) if len(traces) > 1 else 0.0
        seeds = f"{len(traces)} seeds"
        rows.append(unjudged(f"{case}: volume, standard deviation over {seeds}", "cm^3", deviation, ""))
        centre = float(np.mean([t.away for t in traces]))
        rows.append(
            unjudged(
                f"{case}: centroid off the one without motion",
                "cm",
                centre,
                f"{SOURCE}.3: off the one of the case",
                simulated=away,
            )
        )
        if case in ("simplified", "rigorous"):
            track = float(np.mean([t.track for t in traces]))
            rows.append(unjudged(f"{case}: error of the winch's track", "mm", track, SOURCE, simulated=0.42))
    for case in ("simplified", "rigorous"):
        if {case, "uncompensated"} <= found.keys():
            ours, measured, his = (
                100.0 * (1.0 - of[case] / of["uncompensated"])
                for of in (means, *({name: row[k][0] for name, row in CASES.items()} for k in (1, 2)))
            )
            name, allowed = f"{case}: volume less than uncompensated", abs(his - measured)
            rows.append(Comparison(name, "%", ours, measured, allowed, f"{SOURCE}.3", MOVED, his))
    return rows


def golden(cost: Callable[[float], float], low: float, high: float, width: float) -> float:
    """Argument of the least cost between low and high, by golden section until the bracket is ``width`` wide."""
    ratio = 0.5 * (sqrt(5.0) - 1.0)
    a, b = high - ratio * (high - low), low + ratio * (high - low)
    at_a, at_b = cost(a), cost(b)
    while high - low > width:
        if at_a < at_b:
            high, b, at_b = b, a, at_a
            a = high - ratio * (high - low)
            at_a = cost(a)
        else:
            low, a, at_a = a, b, at_b
            b = low + ratio * (high - low)
            at_b = cost(b)
    return 0.5 * (low + high)


def bent(bending: float, elements: int = 20) -> np.ndarray:
    """Nodes [elements + 1, 2] x, z [m] of the clamped line with the sphere at its end."""
    cable = uniform(
        LENGTH, elements, LINE_MASS, 1e7 * bending / LENGTH**2, bending_stiffness=bending, compression_share=1.0
    )
    rig = Rig(cable, held={0: "rg"}, tension=(MASS + LINE_MASS * LENGTH) * GRAVITY, bodies={elements: MASS})
    rig.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    rig.settle()
    return rig.state.q[:, [0, 2]].copy()


def off(points: np.ndarray, line: np.ndarray) -> float:
    """(141): sum of squares [m^2] of the shortest distances of points [n, 2] from a polygon [m, 2]."""
    start, along = line[:-1], np.diff(line, axis=0)
    part = np.einsum("nmk,mk->nm", points[:, None] - start, along) / np.sum(along**2, axis=1)
    foot = start + np.clip(part, 0.0, 1.0)[..., None] * along
    return float(np.sum((points[:, None] - foot) ** 2, axis=2).min(axis=1).sum())


def photograph(bending: float, seed: int, error: float = BEND_ERROR) -> np.ndarray:
    """25 points [25, 2] on a line of that stiffness, scattered so that (141) is as large as he found."""
    line = bent(bending, 60)
    points = line[np.linspace(2, 60, POINTS).round().astype(int)]
    return points + np.random.default_rng(seed).normal(0.0, sqrt(error / POINTS), points.shape)


def stiffness_of(points: np.ndarray) -> float:
    """EI [N m^2] whose line is nearest to the points, by golden section over his range."""
    return golden(lambda ei: off(points, bent(ei)), *RANGE_EI, 2e-9)


def bend_rows(seeds: int = 5) -> list[Comparison]:
    """Golden section on made points whose stiffness is known, and the modulus that his stiffness means."""
    found = [stiffness_of(photograph(EI, seed)) for seed in range(seeds)]
    exact = stiffness_of(photograph(EI, 0, 0.0))
    worst = max(found, key=lambda ei: abs(ei - EI))
    unit, missing = "1e-6 N m^2", "points of the photograph are not printed"
    return [
        Comparison("EI / I of the bend test", "GPa", EI / SECOND_MOMENT * 1e-9, 1.40, 0.005, SOURCE),
        Comparison("EI from exact points of our own line", unit, 1e6 * exact, 1e6 * EI, 0.005, "golden section"),
        Comparison(f"EI, worst of {seeds} sets of points with his scatter", unit, 1e6 * worst, 1e6 * EI, None, missing),
    ]


def damping_per_c(elements: int = 24) -> tuple[float, float]:
    """Damping ratio of the first mode over c [1/(N s)] of the hanging, clamped line.

    Of his (55), which resists the rate of the gradient, and of the product's damping, which resists the rate of strain
    and curvature (c EI/EA).
    """
    cable = uniform(TOW, elements, LINE_MASS, MODULUS * 0.25 * pi * DIAMETER**2, bending_stiffness=EI)
    rig = Rig(cable, held={0: "rg"}, tension=(MASS + LINE_MASS * TOW) * GRAVITY, bodies={elements: MASS})
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    omega, shapes, weights = transverse(rig)
    full = np.zeros((rig.nodes, 2))
    full.reshape(-1)[2:] = shapes[:, 0]  # node by node: displacement and gradient; the clamped ones stay zero
    mass, h = float(shapes[:, 0] @ weights[:, 0]), TOW / elements
    x, w = np.polynomial.legendre.leggauss(4)
    xi, w = 0.5 * (x + 1.0), 0.5 * h * w
    first = np.stack([(6 * xi**2 - 6 * xi) / h, 1 - 4 * xi + 3 * xi**2, (6 * xi - 6 * xi**2) / h, 3 * xi**2 - 2 * xi])
    second = np.stack([(12 * xi - 6) / h**2, (6 * xi - 4) / h, (6 - 12 * xi) / h**2, (6 * xi - 2) / h])
    ends = np.hstack([full[:-1], full[1:]])
    slope, bend = (float(np.sum((ends @ rows) ** 2 @ w)) for rows in (first, second))
    share = EI / (MODULUS * 0.25 * pi * DIAMETER**2)
    return slope / (2.0 * omega[0] * mass), share * bend / (2.0 * omega[0] * mass)


def parameter_rows() -> list[Comparison]:
    """Damping and the two drag factors: tuned as he did, and computed by the law of strumming."""
    of_55, ours = damping_per_c()
    base = load_scene("flume")

    def away(factor: float) -> float:
        return miss(land(override(base, {f"{LINE}.drag_amplification": factor})))

    tuned, his = golden(away, *RANGE_G, 2e-3), f"{SOURCE}.1: his tuned one leaves 5.0"
    strum = {"viv.law": "govardhan_williamson", "viv.damping_ratio": 0.061}
    plain = {f"{LINE}.drag_amplification": 1.0, f"{LINE}.drag_law": "driscoll_nahon"}
    computed = land(scene_with(base, plain | strum))  # Reynolds numbers below those of the law: said on its page
    return [
        Comparison("damping ratio of the first mode over c, (55)", "1/(N s)", of_55, 112.72, 0.1127, f"{SOURCE}.1"),
        Comparison("c for the damping ratio of 0.061", "1e-4 N s", 610.0 / of_55, 5.4, 0.05, f"{SOURCE}.1"),
        unjudged(
            "the same mode over c, damping of strain and curvature",
            "1/(N s)",
            ours,
            "the product: a swing without bending is not damped",
        ),
        Comparison("drag factor tuned to the centroid, golden section", "1", tuned, 1.737, None, f"{SOURCE}.1: tuned"),
        Comparison("what the tuned factor leaves of the place", "mm", away(tuned), 0.0, 5.0, f"{SOURCE}.1"),
        unjudged("drag factor computed, damping 0.061", "1", computed.factor, "strumming"),
        Comparison("what the computed factor leaves of the place", "mm", miss(computed), 0.0, 5.0, his),
    ]


def experiment(progress, seconds: float, quick: bool = False, over: Over = here) -> Result:
    """Bend test, damping, drag factor, the four cases over seeds, and every choice made otherwise.

    seconds: of each run; quick: one seed, no choices; over: what runs the cases.
    """
    seeds, changes = (1, {}) if quick else (SEEDS, OTHERWISE)
    runs = [(case, seconds, seed, CHOSEN) for case in CASES for seed in range(1, seeds + 1)]
    runs += [(case, seconds, 1, CHOSEN._replace(**change)) for change in changes.values() for case in CHANGED]
    traces = iter(over(trace, runs))
    progress("stiffness, damping, drag factor", 0, len(runs))
    rows = bend_rows(QUICK_SETS if quick else SETS) + parameter_rows()
    done: list[Trace] = []
    for case, _, seed, _ in runs:
        progress(f"{case}, seed {seed}", len(done), len(runs))
        done.append(next(traces))
    found = {case: done[k * seeds : (k + 1) * seeds] for k, case in enumerate(CASES)}
    rows += case_rows(found)
    choices, rest = [], iter(done[len(CASES) * seeds :])
    for name in changes:
        others = {f"{case} [cm^3]": next(rest).volume - found[case][0].volume for case in CHANGED}
        choices.append({"choice": name, **others})
    chosen = "chosen otherwise: what changes in the volume, first seed"
    return Result("flume", rows, choices, lambda folder: draw(found, folder / "flume.png"), chosen)


def draw(found: dict[str, list[Trace]], path: Path) -> Path:
    """Paths of the four cases, volumes, bend test. RuntimeError where matplotlib is missing."""
    title = "Towed sphere in a flume: four cases, seen from the side"
    with canvas(path, (14.0, 8.5), title, f"scene flume; measured: {SOURCE}") as figure:
        axes = figure.subplots(2, 3).ravel()
        for axis, (case, traces) in zip(axes, found.items()):
            for t in traces[1:]:
                axis.plot(100 * t.path[:, 0], 100 * t.path[:, 2], color=FAINT, lw=0.3)
            axis.plot(100 * traces[0].path[:, 0], 100 * traces[0].path[:, 2], color=BLUE, lw=0.5, label="first seed")
            axis.plot(100 * CENTRE[0], 100 * CENTRE[1], "+", color=ORANGE, ms=16, mew=2, label="measured mean")
            axis.set(
                xlim=(-80.0, -62.0), ylim=(-75.0, -62.0), title=case, xlabel="x from the winch [cm]", ylabel="z [cm]"
            )
        axes[0].legend(loc="lower right")
        bars, bend = axes[4:]
        place = np.arange(len(found))
        for k, (name, colour) in enumerate((("measured", ORANGE), ("Westin's", FAINT), ("ours", BLUE))):
            if name == "ours":
                height = [float(np.mean([t.volume for t in traces])) for traces in found.values()]
            else:
                height = [CASES[case][1 + k][0] for case in found]
            bars.bar(place + 0.27 * (k - 1), height, 0.25, color=colour, label=name)
        bars.set_yscale("log")
        bars.set_xticks(place, list(found), fontsize="small", rotation=20)
        bars.set(ylim=(1.0, 3000.0), title="ellipsoid volume [cm³]")  # room for the names
        bars.legend(loc="upper left")
        points = 1e3 * photograph(EI, 0)
        for ei, style in ((RANGE_EI[0], ":"), (EI, "-"), (RANGE_EI[1], ":")):
            bend.plot(*(1e3 * bent(ei)).T, color=BLUE, ls=style, label=f"EI {1e6 * ei:.2f}e-6 N m²")
        bend.plot(*points.T, "o", ms=3, color=ORANGE, label="points, made")
        bend.set(title="bend test [mm]", xlim=(0.0, 75.0))  # room for the names
        bend.legend(loc="lower right", fontsize="small")
    return path
