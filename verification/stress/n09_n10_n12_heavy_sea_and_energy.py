"""N9, N10, N12: heavy seas, long steps, the account of energy."""

from __future__ import annotations

import numpy as np

from cable_sim_ros.io.scenes.load import scene_from_dict
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.simulator import Simulator, SolverError

from ..shipped import started
from .sheave_depth import Watch
from .tows import Sea, finite, held, sail, shipped
from .verdict import Found, Metric, holds, stress


def residual_fraction(first, last, supplied: float) -> float:
    """Energy residual gained between two tick outputs over the work turned over [1]; ``supplied``: sum of |d work|
    [J]."""
    return abs(float(last["energy_residual"]) - float(first["energy_residual"])) / max(supplied, 1e-300)


def turned_over(frames) -> float:
    """Work that went in or out through winch and hull, both counted positive [J]."""
    return float(np.abs(np.diff(frames["work_supplied"])).sum())


def _heavy(depth: float, seconds: float) -> tuple[list[Metric], list[str]]:
    scene = held(sheave__groove_depth=depth, accuracy__slack=1.0)
    sim = started(scene)
    sea = Sea(scene, heave=(6.0, 8.0, 0.0), roll=(np.radians(35.0), 11.0, 0.0))
    watch = Watch(sim)
    good, minimum, maximum, flags, work, fraction, done = True, np.inf, -np.inf, 0, 0.0, None, 0.0
    notes, first = [], None
    parts = []
    try:
        while done < seconds:
            frames = watch.look(sail(sim, sea, min(10.0, seconds - done)))
            done += min(10.0, seconds - done)
            good = good and finite(frames)
            minimum, maximum = min(minimum, frames.tension_least.min()), max(maximum, frames.tension_most.max())
            flags |= int(np.bitwise_or.reduce(frames.status))
            first = frames[0].copy() if first is None else first
            work += turned_over(frames)
            fraction = residual_fraction(first, frames[-1], work)
            parts.append(frames.iterations.mean())
    except SolverError as error:
        notes.append(f"groove {1e3 * depth:g} mm: {error}")
    name = f"groove {1e3 * depth:g} mm"
    metrics = [
        Metric(f"{name}, simulated", done, "s", seconds, ">="),
        holds(f"{name}, numbers finite", good),
        *(f._replace(name=f"{name}, {f.name}") for f in watch.metrics(scene.cable.diameter)),
    ]
    if fraction is not None:
        metrics.append(Metric(f"{name}, energy residual over work", fraction, "", 0.01))
    notes.append(
        f"{name}: element tensions {minimum:.0f} to {maximum:.0f} N, {np.mean(parts) if parts else 0.0:.1f} iterations "
        f"a tick, {Flag(flags)!r}; deepest in the sheave at {watch.when:.2f} s"
    )
    return metrics, notes


@stress("heave +-6 m at 8 s, roll +-35 deg, 30 min", "finite, energy residual <= 1 % of work")
def heavy(quick: bool) -> Found:
    """The shipped tow, winch held, 20 ms ticks, in Westin's groove of 10 mm, in its own and in one of 100 mm."""
    seconds = 120.0 if quick else 1800.0
    metrics, notes = [], []
    own = held().sheave.groove_depth
    for depth in (0.01, own, 0.1):
        found, report = _heavy(depth, seconds)
        metrics, notes = metrics + found, notes + report
    notes.append(f"roll of 11 s; the groove of the shipped scene is {1e3 * own:g} mm deep")
    return Found(metrics, notes)


@stress("step x2, x5, x10", "within 2x the error, or sub-stepped or refused with a flag")
def steps(quick: bool) -> Found:
    """The shipped tow with compensation in a sea, against a finer mesh at 2 ms."""
    seconds, settle = (20.0, 12.0) if quick else (60.0, 12.0)
    sea = {"heave": (1.0, 8.0, 0.0), "pitch": (0.03, 7.0, 1.0), "roll": (0.1, 9.0, 0.5)}
    finer = {"accuracy__tension": shipped().accuracy.tension / 4.0, "accuracy__position": 0.004}
    reference = _trace(shipped(solver__tick=0.002, **finer), sea, seconds, settle)
    metrics, notes, shipped_error = [], [], None
    for factor in (1, 2, 5, 10):
        try:
            report = _trace(shipped(solver__tick=0.01 * factor), sea, seconds, settle)
        except SolverError as error:
            flagged = "NEWTON_FAILED" in str(error)
            metrics.append(holds(f"step x{factor}, refused with a flag", flagged))
            notes.append(f"step x{factor}: {error}")
            continue
        shift = reference["tension"].mean()
        error = {
            "tension": np.abs(report["tension"] - reference["tension"]).max() / shift,
            "body": np.linalg.norm(report["body"] - reference["body"], axis=1).max(),
        }
        if factor == 1:
            shipped_error = error
        flagged = report["halved"] > 0
        for name in ("tension", "body"):
            ratio = float(error[name] / shipped_error[name])
            limit = None if factor == 1 or (flagged and ratio > 2.0) else 2.0
            what = f"step x{factor}, largest error of {name} over that of the shipped step"
            metrics.append(Metric(what, ratio, "", limit))
        notes.append(
            f"step x{factor}: largest error of the tension {100 * error['tension']:.3g} %, of the body "
            f"{1e3 * error['body']:.3g} mm; {report['halved']} of {report['ticks']} ticks sub-stepped"
        )
    notes.append(
        f"{seconds:g} s, compared every 0.1 s from {settle:g} s on, against a mesh made for a quarter of the errors, "
        "at 2 ms; errors are those of mesh and step together. Above 2 a step with sub-stepped ticks (flag HALVED) is "
        "shown, not judged"
    )
    return Found(metrics, notes)


def _trace(scene, sea: dict, seconds: float, settle: float) -> dict:
    sim = started(scene)
    frames = sail(sim, Sea(scene, **sea), seconds)
    every = round(0.1 / scene.solver.tick)
    kept = frames[every - 1 :: every]
    kept = kept[kept.time > settle * 1e9]
    return {
        "tension": kept.tension.copy(),
        "body": kept.body_position.copy(),
        "ticks": len(frames),
        "halved": int((frames.status & Flag.HALVED > 0).sum()),
    }


def swinging(tick: float) -> Simulator:
    """A bare, undamped cable pulled aside by 30 degrees, pinned at the drum far above the water; its surfaces do not
    press."""
    sim = Simulator(
        scene_from_dict(
            {
                "name": "swing",
                "ship": {"reference_height": 40.0},
                "cable": {
                    "diameter": 0.01,
                    "mass_per_length": 0.389,
                    "axial_stiffness": 6.8e6,
                    "sections": {"all": {"length": 10.0, "elements": 16, "drag_law": "off"}},
                },
                "winch": {"drum": "contact", "position": [0.0, 0.0, 0.0], "drum_radius": 0.01, "wrap": 0.5},
                "sheave": {"position": [-1.0, 0.0, 0.0], "radius": 0.02},
                "towbody": {"mass": 1e-6, "net_weight": 1e-6},
                "solver": {"tick": tick},
            },
            "swing",
        )
    )
    sim.state.surfaces["stiffness"][:] = 0.0
    sim.start()
    down = np.array((-0.5, 0.0, -np.sqrt(0.75)))
    sim.state.q[:, :3] = sim.state.q[0, :3] + sim.state.arc[:, None] * down
    sim.state.q[:, 3:] = down
    return sim


@stress(
    "energy: stored + dissipated - supplied",
    "<= 0.1 % of work over 10 min; a passive system never gains more than 1e-4",
)
def energy(quick: bool) -> Found:
    """N12: energy: stored + dissipated - supplied."""
    metrics, notes = [], []
    for tick in (0.002, 0.01):
        sim = swinging(tick)
        lowest = 0.389 * 10.0 * 9.81 * (sim.state.q[0, 2] - 5.0)
        swing = 0.5 * 0.389 * 9.81 * 10.0**2 * (1.0 - np.sqrt(0.75))
        gain, minimum = -np.inf, np.inf
        for _ in range(2 if quick else 60):
            frames = sim.run(round(10.0 / tick))
            left = (frames.kinetic_energy + frames.strain_energy + frames.potential_energy - lowest) / swing - 1.0
            gain, minimum = max(gain, float(left.max())), min(minimum, float(left.min()))
        metrics.append(Metric(f"undamped swing, largest gain over its energy, {1e3 * tick:g} ms", gain, "", 1e-4))
        notes.append(
            f"undamped swing of 30 deg at {1e3 * tick:g} ms: {-100 * minimum:.3g} % lost in {20 if quick else 600} s"
        )
    seconds = 60.0 if quick else 600.0
    for name, scene in (("compensation on", shipped()), ("winch held", held())):
        sim = started(scene)
        sea = Sea(scene, heave=(1.5, 8.0, 0.0), pitch=(0.04, 7.0, 1.0), roll=(0.15, 9.0, 0.5))
        first, work, done = None, 0.0, 0.0
        while done < seconds:
            frames = sail(sim, sea, 10.0)
            first = frames[0].copy() if first is None else first
            work, done = work + turned_over(frames), done + 10.0
        fraction = residual_fraction(first, frames[-1], work)
        metrics.append(Metric(f"tow in a sea, {name}, energy residual over work", fraction, "", 1e-3))
    return Found(metrics, notes)
