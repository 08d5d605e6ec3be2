"""N20, N21, N22: a winch that feeds stops dead, works while the cable leaves its sheave, hauls a joint over it."""

from __future__ import annotations

import numpy as np

from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import Simulator, SolverError

from ..shipped import started
from .n03_load_reversals import TOWED, Thrown
from .n04_n18_climbing_and_pressing import ROLL, YAW, heeled
from .n09_n10_n12_heavy_sea_and_energy import residual_fraction, turned_over
from .sheave_depth import Watch
from .tows import finite, held, reel
from .verdict import MIN, WITHIN, Found, Metric, holds, stress

# EA [N], scope [m], net weight of the body [N], acceleration of the winch [m/s^2], when the wave is looked at [s]: the
# front is longer than an element, the reflection from the body comes after 0.21 s and 0.46 s
STIFF = (6.786e6, 450.0, 12000.0, 500.0, (0.03, 0.12))  # heavy, so that the cable stays tight
SOFT = (3e5, 200.0, 3000.0, 300.0, (0.06, 0.35))  # waves of 878 m/s: the flow is 0.6 % of it
RATE = 2.0  # m/s


def undragged(ea: float, scope: float, net_weight: float, acceleration: float) -> Scene:
    """A body that hangs on a cable without drag from a winch that all but jumps."""
    return held(
        ship__tow_speed=0.0,
        solver__tick=0.001,
        cable__sections={"all": {"length": scope + 108.04, "drag_law": "off"}},
        cable__axial_stiffness=ea,
        mesh__sections={"all": {"elements": 100, "grading": 1.0}},
        mesh__inboard=8,
        mesh__before=0.5,  # stretched by 2 %, the span brings the fine mesh 0.15 m farther out
        winch__scope=scope,
        winch__max_acceleration=acceleration,
        winch__derivative_gain=5000.0,
        winch__proportional_gain=5000.0,
        winch__command_timeout=3600.0,
        contact__working_tension=1.3 * (net_weight + 4.0 * scope),
        towbody__mass=max(250.0, net_weight / 5.0),
        towbody__net_weight=net_weight,
        towbody__lift_area=0.0,
        towbody__drag_area=[0.0, 0.0, 0.0],  # it would sink no faster than 4 m/s
    )


RAMP = 5.0  # s


def ramped(sim: Simulator, begin: float, end: float) -> list[np.recarray]:
    """Bring the winch from one rate to another [m/s] little by little, so that next to no wave is left."""
    fractions = 0.5 * (1.0 - np.cos(np.pi * np.linspace(0.02, 1.0, 50)))
    return [reel(sim, begin + (end - begin) * fraction, RAMP / 50) for fraction in fractions]


def brought_to(scene: Scene, rate: float) -> Simulator:
    """Started, and its winch brought to ``rate`` [m/s]."""
    sim = started(scene)
    if rate:
        ramped(sim, 0.0, rate)
    return sim


def jump(sim: Simulator, end: float, begin: float, window: tuple[float, float]) -> dict[str, float]:
    """Step of the tension at drum and sheave over that by wave theory, less one; rates of pay-out [m/s].

    Against the same run whose winch goes on, so that what swings already takes no part. The tangent point stands, the
    material runs through it with (1 + e) P'. In the wave that goes out v + c e keeps its value, c^2 = EA/mu:
    e - e_0 = (1 + e_0) (P_0' - P_1') / (c + P_1'); a dead stop makes rho c V (1 + e_0). And what is paid out hangs.
    """
    cable, scene = sim.scene.cable, sim.scene
    twin = Simulator(scene)
    twin.restore(sim.snapshot())
    first = round(window[0] / scene.solver.tick)
    after, on = reel(sim, end, window[1])[first:], reel(twin, begin, window[1])[first:]
    c = np.sqrt(cable.axial_stiffness / cable.mass_per_length)
    strain = on.tension_drum.mean() / cable.axial_stiffness
    want = cable.axial_stiffness * (1.0 + strain) * (begin - end) / (c + end)
    want += cable.mass_per_length * scene.gravity * float((after.payout - on.payout).mean())
    return {
        "drum": float((after.tension_drum - on.tension_drum).mean() / want - 1.0),
        "sheave": float((after.tension - on.tension).mean() / want - 1.0),
    }


@stress(
    "dead stop and overspeed of a winch that feeds",
    "step of the tension at drum and sheave within 1 % of wave theory with the flow in it",
)
def wave(quick: bool) -> Found:
    """Cable running in or out is stopped dead, and cable at rest set running, at up to the largest rate."""
    metrics = []
    for cable, name in ((STIFF, "shipped EA"), (SOFT, "EA 300 kN")):
        *numbers, window = cable
        scene = undragged(*numbers)
        maximum = scene.winch.max_rate
        for rate in (maximum,) if quick else (RATE, -RATE, maximum, -maximum):
            for how, begin, end in (("stopped", rate, 0.0), ("set running", 0.0, rate)):
                if begin == 0.0 and rate > 0.0 and cable is STIFF and quick:
                    continue
                off = jump(brought_to(scene, begin), end, begin, window)
                way = "out" if rate > 0.0 else "in"
                metrics += [
                    Metric(f"{name}, {abs(rate):g} m/s {way} {how}, at the {place}", value, "", 0.01, WITHIN)
                    for place, value in off.items()
                ]
    return Found(
        metrics,
        [f"{c[0]:g} N: {c[1]:g} m, mean from {c[4][0]:g} to {c[4][1]:g} s after it, 1 ms" for c in (STIFF, SOFT)],
    )


@stress(
    "cable off its sheave while the winch works",
    "as N3 and N4: flags, never through the sheave, back on it after every throw",
)
def working(quick: bool) -> Found:
    """Throws of a tow and slow turns of its ship, the winch paying out or hauling in at 2 m/s."""
    metrics, notes = [], []
    for rate in (RATE, -RATE):
        way = f"thrown, {rate:+g} m/s"
        tow = Thrown(rate)
        notes += tow.throw(2 if quick else 20, np.random.default_rng(4))
        metrics += [
            Metric(f"{way}, least detachments of a throw", min(tow.detachments, default=0), "", 1, MIN),
            Metric(f"{way}, most changes of the flag within 20 ms of one", max(tow.flag, default=0), "", 2),
            *(f._replace(name=f"{way}, {f.name}") for f in tow.watch.metrics(tow.sim.scene.cable.diameter)),
            holds(f"{way}, back on the sheave after every throw", tow.returned),
        ]
        notes.append(f"{way}: {len(tow.detachments)} throws at {TOWED:g} m/s, {sum(tow.detachments)} detachments")
    for name, speed, waves in (
        ("hanging, heel to 70 deg in 20 s", 0.0, ROLL),
        ("towed, fleet angle to 60 deg in 20 s", 2.2, YAW),
        ("towed, heel to 70 deg in 20 s", 2.2, ROLL),
    )[: 1 if quick else 3]:
        found, report = heeled(speed, waves, RATE)
        metrics += [f._replace(name=f"{name}: {f.name}") for f in found]
        notes += [f"{name}: {note}" for note in report]
    return Found(metrics, notes)


PLACE = 0.01  # m, what the mesh of such a scope is made to
DRAG = {"drag_amplification": 2.37, "drag_amplification_of": "both"}
JOINTS = {
    "fairing": {"fairing": "ribbon"} | DRAG,
    "other cable": {"diameter": 0.013, "mass_per_length": 0.62, "axial_stiffness": 4e6, "bending_stiffness": 3.0},
    "termination of 4 kg": DRAG,
}
OUT, OVER = 20.0, 40.0  # m: scope of the boundary at the start, and hauled in
# N, from one tick to the next: no step is in what a joint does; a mass of M is turned with M v^2/R as it comes over
STEPS = {"fairing": 1.0, "other cable": 1.0, "termination of 4 kg": 4.0 * RATE**2 / 0.255}
PASSES = 9.5  # m from there to beyond the drum's tangent point


def jointed(name: str, scope: float) -> Scene:
    """100 m that differ from the rest of the cable, or end it with a mass; ``scope`` [m] out."""
    inner = {"length": 200.0} | DRAG
    if name.startswith("termination"):
        inner["termination_mass"] = 4.0
    return held(
        cable__sections={"inner": inner, "outer": {"length": 100.0} | JOINTS[name]},
        winch__scope=scope,
        winch__command_timeout=3600.0,
    )


def against(
    name: str, sim: Simulator, start: Simulator, what: str = "a direct start", newton: float = 0.5, metre: float = 0.015
) -> list[Metric]:
    """Tension [N] and place of the body from the sheave [m] against a start, and what they may be off."""
    a, b = sim.frame, start.frame
    place = (a.body_position - a.sheave_position) - (b.body_position - b.sheave_position)
    return [
        Metric(f"{name}, tension against {what}", abs(float(a.tension - b.tension)), "N", newton),
        Metric(f"{name}, body against {what}", float(np.linalg.norm(place)), "m", metre),
    ]


@stress(
    "joint of two sections over the sheave at 2 m/s, in and out",
    "settled within 0.5 N and 15 mm of a direct start; steps of tension below what passes; residual <= 1e-3 of work",
)
def joint(quick: bool) -> Found:
    """Fairing, another cable, a termination: hauled from 20 m outboard onto the drum and paid out again."""
    metrics, notes = [], []
    for name in list(JOINTS)[-1 if quick else 0 :]:
        scene = jointed(name, 100.0 + OUT)
        sim = started(scene)
        watch, first = Watch(sim), sim.frame.copy()
        steps, work, good, settle = [], 0.0, True, 120.0 if quick else 900.0
        try:
            for rate, scope in ((-RATE, 100.0 + OUT - OVER), (RATE, 100.0 + OUT)):
                parts = ramped(sim, 0.0, rate)
                parts += [watch.look(reel(sim, rate, 5.0)) for _ in range(round((OVER / RATE - RAMP) / 5.0))]
                parts += ramped(sim, rate, 0.0)
                moving = np.concatenate(parts).view(np.recarray)
                rest = reel(sim, 0.0, settle)
                good = good and finite(moving) and finite(rest)
                near = (moving.scope > 100.0 - PASSES) & (moving.scope < 100.0 + 3.0)
                change = np.abs(np.diff(moving.tension[near]))
                steps.append(float(change.max() - np.median(change)))
                work += turned_over(np.concatenate((moving, rest)).view(np.recarray))
                way, allowed = "paid out again", {}
                if rate < 0.0:  # the direct start has a mesh of its own: what both are promised to err by
                    newton = float(scene.accuracy.tension * sim.frame.tension)
                    way, allowed = "hauled in", {"newton": newton, "metre": 2.0 * PLACE}
                metrics += against(f"{name}, {way}", sim, started(jointed(name, scope)), **allowed)
        except SolverError as error:
            metrics.append(holds(f"{name}, ran to its end", False))
            notes.append(f"{name}: {error}")
            continue
        metrics += [
            Metric(
                f"{name}, step of the tension from tick to tick where it passes, less the median",
                max(steps),
                "N",
                float(STEPS[name]),
            ),
            holds(f"{name}, numbers finite", good),
            *(f._replace(name=f"{name}, {f.name}") for f in watch.metrics(scene.cable.diameter)),
            Metric(f"{name}, energy residual over work", residual_fraction(first, sim.frame, work), "", 1e-3),
        ]
        notes.append(f"{name}: {first.tension:.1f} N at the start, {sim.nodes - 1} elements, {settle:g} s of settling")
    return Found(metrics, notes)
