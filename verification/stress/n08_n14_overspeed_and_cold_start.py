"""N8, N14: winch at its limits, cold starts at any pay-out."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cable_sim_ros.io.scenes.load import SceneError
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.sim.scene import Scene
from cable_sim_ros.sim.simulator import SolverError, StartError

from ..shipped import started
from .tows import finite, held, reel, weights
from .verdict import MIN, Found, Metric, holds, relative, stress

FINE = 0.1  # m, elements that come over sheave and drum where the mesh is fixed to the material
OUTBOARD, WOUND, SPAN = 12.0, 16.0, 8.04  # m; the last from drum to sheave
# sinks at about 1 m/s
LIGHT_FISH = {
    "towbody__mass": 40.0,
    "towbody__net_weight": 150.0,
    "towbody__drag_area": [0.3, 0.3, 0.3],
    "towbody__added_mass": [10.0, 40.0, 40.0],
}


STILL = {"ship__tow_speed": 0.0, "solver__tick": 0.01, "towbody__lift_area": 0.0, "winch__command_timeout": 3600.0}


def short(outboard: float, wound: float, **values) -> Scene:
    """A cable of so many metres outboard and on a drum that feeds, in still water."""
    cable = {"all": {"length": outboard + SPAN + wound}}
    return held(**STILL | {"cable__sections": cable, "winch__scope": outboard} | values)


def short_for_slack(outboard: float, wound: float, **values) -> Scene:
    """The same with short elements wherever slack cable may lie on the sheave."""
    mesh = {"accuracy__slack": 6.0, "mesh__sections": {"all": {"elements": 60}}}
    return short(outboard, wound, **mesh | values)


def short_on_drum(outboard: float, wound: float, **values) -> Scene:
    """The same with the end of the cable on the drum's surface, all of it meshed for the sheave."""
    length = outboard + SPAN + wound
    cable = {"all": {"length": length, "elements": round(length / FINE)}}
    wrap = (wound - 0.1) / 0.305
    return held("full_scale_contact", **STILL | {"cable__sections": cable, "winch__wrap": wrap} | values)


def _overspeed(name: str, tow: Callable[..., Scene], waits: int) -> tuple[list[Metric], list[str]]:
    """Pay-out commanded at ten times what the winch can for 2.5 s, a stop, and so many times ten seconds."""
    scene = tow(OUTBOARD, WOUND, **LIGHT_FISH)
    sim = started(scene)
    try:
        still = sim.run(10)[-1]
        out = reel(sim, 50.0, 2.5)
        slack = (out.status & Flag.SLACK > 0) | (out.tension_least < 0.0)
        after = [reel(sim, 0.0, 10.0) for _ in range(waits)]
        last, paid = after[-1], float(after[-1].payout[-1] - still.payout)
        # not against the weights: the light fish leaves the bending at the sheave its share, EI kappa^2/2 = 9 N
        settled = started(tow(OUTBOARD + paid, WOUND - paid, **LIGHT_FISH)).frame
    except SolverError as error:
        return [holds(f"{name}, ran to its end", False)], [f"{name}: {error}"]
    maximum = float(np.abs(out.payout_rate).max() / scene.winch.max_rate)
    swing, minimum = (
        float(np.ptp(last.tension) / last.tension.mean()),
        float(out.tension_body.min() / still.tension_body),
    )
    stopped = f"{name}, after the stop"
    return [
        Metric(f"{name}, largest rate of pay-out over winch.max_rate", maximum, "", 1.0 + 1e-9),
        holds(f"{name}, slack reported", bool((out.status & Flag.SLACK > 0).any())),
        Metric(f"{name}, least tension at the fish over that at rest", minimum),
        holds(f"{name}, numbers finite", all(finite(f) for f in (out, *after))),
        relative(
            f"{stopped}, mean tension against a start at this pay-out", last.tension.mean(), settled.tension, 0.02
        ),
        Metric(f"{stopped}, swing of the tension", swing),
        holds(f"{stopped}, slack no longer reported", not bool((last.status & Flag.SLACK).any())),
    ], [
        f"{name}: {out.payout[-1] - still.payout:.1f} m paid out, slack in {int(slack.sum())} of "
        f"{len(out)} ticks, least element tension {out.tension_least.min():.3g} N"
    ]


@stress("winch overspeed, slack at the fish, haul-in to the last metre", "slack reported, recovers to within 2 %")
def winch(quick: bool) -> Found:
    """Hanging in still water: pay-out faster than the fish sinks, then a stop; and hauling in all there is."""
    metrics, notes = [], []
    # slack cable leaves its sheave, and comes back where elements of its size wait for it; the turns on a drum with
    # contact come loose and whip, a subject of its own
    for name, tow in (
        ("overspeed, short elements for 6 m outboard", short_for_slack),
        ("overspeed", short),
        ("overspeed, drum with contact", short_on_drum),
    )[: 1 if quick else 3]:
        found, report = _overspeed(name, tow, 3 if quick else 12)
        metrics, notes = metrics + found, notes + report
    scene = short(15.0, 4.0)
    sim = started(scene)
    try:
        minimum = float(-sim.model.settings["drum"]["min_length"][0])  # length that may be hauled in
        hauled = reel(sim, -1.0, minimum + 3.0)
        rest = reel(sim, 0.0, 20.0 if quick else 60.0)
        left = float(15.0 + (hauled.payout[-1] - hauled.payout[0]))
        metrics += [
            Metric("haul-in, cable left outboard of the tangent point of the sheave", left, "m"),
            holds("haul-in, end reported", bool((hauled.status & Flag.DRUM_END > 0).any())),
            holds("haul-in, numbers finite", finite(hauled) and finite(rest)),
            relative(
                "haul-in, mean tension against the weights that hang", rest.tension[-500:].mean(), weights(sim), 0.02
            ),
        ]
        reel(sim, 1.0, minimum)
        rest = reel(sim, 0.0, 20.0 if quick else 60.0)
        mean = rest.tension[-500:].mean()
        metrics.append(relative("paid out again, mean tension against the weights that hang", mean, weights(sim), 0.02))
    except SolverError as error:
        metrics.append(holds("haul-in ran to its end", False))
        notes.append(f"haul-in: {error}")
    return Found(metrics, notes)


@stress(
    "cold start at 1 m, half, full pay-out; slack in still water",
    "settled or a clear error, never a plausible wrong state",
)
def cold(quick: bool) -> Found:
    """Each start by itself: a refusal must say why; a state must stay, and balance the weights if nothing flows."""
    metrics, notes = [], []

    def full(outboard: float, speed: float, **values) -> Scene:
        return held(**{"ship__tow_speed": speed, "winch__scope": outboard} | values)

    light = {"towbody__lift_area": 0.0}
    # the body floats up and the cable hangs in a loop; a cable lighter than water; a body that weighs nothing
    cases = [
        (f"{length:g} m, {speed:g} m/s", length, speed, {}) for speed in (0.0, 2.2) for length in (1.0, 225.0, 450.0)
    ]
    cases += [
        ("slack, body floats, loop of cable", 225.0, 0.0, light | {"towbody__net_weight": -200.0}),
        ("slack, weightless body", 225.0, 0.0, light | {"towbody__net_weight": 0.0}),
        (
            "slack, cable and body lighter than water",
            225.0,
            0.0,
            light | {"towbody__net_weight": -10.0, "cable__mass_per_length": 0.07},
        ),
    ]
    for name, length, speed, values in cases:
        try:
            sim = started(full(length, speed, **values))
        except (SceneError, StartError) as error:
            text = str(error)
            clear = "nothing was started" in text and any(c.isdigit() for c in text)
            metrics.append(holds(f"{name}: the error says why", clear))
            notes.append(f"{name}: refused: {text}")
            continue
        first, depth = sim.frame.copy(), sim.shape[-1, 2]
        if speed == 0.0 and not values and length > 4.0:
            metrics.append(
                relative(f"{name}: tension against the weights that hang", first["tension"], weights(sim), 0.02)
            )
        scale = max(abs(float(first["tension"])), 1.0)
        minimum = float(first["tension_least"] / scale)
        metrics += [
            Metric(f"{name}: least element tension over that at the sheave", minimum, "", -0.01, MIN),
            Metric(f"{name}: residual over tension", float(first["residual"] / scale), "", 1e-5),
        ]
        try:
            frames = sim.run(round((10.0 if quick else 60.0) / sim.scene.solver.tick))
        except SolverError as error:
            metrics.append(holds(f"{name}: stays where it settled", False))
            notes.append(f"{name}: {error}")
            continue
        drift = float(np.abs(frames.tension - first["tension"]).max() / scale)
        sunk = float(np.abs(frames.body_position[:, 2] - depth).max() / length)
        metrics += [
            Metric(f"{name}: change of the tension when let run", drift, "", 1e-3),
            Metric(f"{name}: change of the depth over the length", sunk, "", 1e-3),
        ]
        notes.append(
            f"{name}: {first['tension']:.1f} N, body at {first['body_position'][2]:.2f} m, least element tension "
            f"{first['tension_least']:.3g} N, {sim.start_report['steps']} steps"
        )
    return Found(metrics, notes)
