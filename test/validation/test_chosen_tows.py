"""Tows that no rule of the steps was made with: steps chosen by their error keep the place they were asked for, or the
verdict says that they may not."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.runs import offline

ASKED = 0.01  # m, solver.position_error
FINE = 0.004  # s, of the steps that they are held against


class Tow(NamedTuple):
    scene: str
    values: dict[str, Any]
    run: dict[str, Any]
    deviation: float = 0.015  # of the tension, share that it may be off
    doubts: tuple[str, ...] = ()


def motor(scene: str, mass: float, pull: float) -> dict[str, Any]:
    """A drum of ``mass`` kg at the cable, its motor and brake."""
    tow = load_scene(scene)
    radius = tow.winch.drum_radius + 0.5 * tow.cable.diameter
    drive = {"model": "motor", "inertia": mass * radius**2, "curve_speed": [0.0, 6.0], "curve_pull": [pull, pull]}
    return {f"drive.{key}": value for key, value in drive.items()} | {"drive.brake_pull": 0.6 * pull}


def loop(bandwidth: float, damping: float) -> dict[str, Any]:
    """A rate loop, by its order."""
    return {"drive.model": "rate_loop", "drive.bandwidth": bandwidth, "drive.damping": damping}


def mode(*changes: tuple[float, str]) -> list[tuple[float, str, str]]:
    """Changes of the winch's mode."""
    return [(at, "drive.mode", name) for at, name in changes]


MOTOR = motor("full_scale", 500.0, 2e4)
HOLD, SHEAVE = ({"setpoint.algorithm": law} for law in ("hold", "simplified_sheave"))
LAYERS = {"winch.lay_width": 0.2, "winch.lay_pitch": 0.02, "winch.lay_rise": 0.018}
SHORT = {"cable.sections": {"wire": {"length": 700.0}}, "winch.scope": 400.0}
HEAVY = {  # 2 t on 800 m
    "towbody.mass": 2000.0,
    "towbody.net_weight": 1.6e4,
    "winch.scope": 800.0,
    "winch.most_scope": 850.0,
    "cable.sections": {"wire": {"length": 1000.0}},
    "contact.working_tension": 2.5e4,
    "drive.controller_mass": 4000.0,
}


def deep(scope: float) -> dict[str, Any]:
    return {"winch.scope": scope, "winch.most_scope": scope + 200.0}


def faired(fairing: str) -> dict[str, Any]:
    section = "cable.sections.faired."
    return {"ship.tow_speed": 3.09, f"{section}drag_law": None, f"{section}fairing": fairing}


def render(pull: float, mass: float, scope: float, heave: tuple[float, float]) -> Tow:
    """A rosette whose winch renders: the motor comes to the bound of its pull and leaves it, wave by wave."""
    values = motor("lowered_ctd", mass, 2e4) | {"drive.mode": "render", "drive.set_pull": pull} | deep(scope)
    return Tow("lowered_ctd", values, {"heave": heave, "duration": 24.0}, doubts=("RENDER_PLACE",))


BRAKED = mode((8.0, "brake"), (15.0, "follow"))
TOWS = {
    # a brake stops the drum; the first lost 0.96 m as it followed again, and the fourth 15 mm as it hauled
    "brake, following": Tow("full_scale", MOTOR | HOLD, {"winch": "1 rate 0.8", "changes": BRAKED, "duration": 22.0}),
    "stop, lowering": Tow(
        "full_scale", MOTOR, {"winch": "1 rate 1.2", "changes": mode((9.0, "emergency_stop")), "duration": 40.0}
    ),
    "brake in heave": Tow(
        "full_scale",
        MOTOR,
        {
            "winch": "1 rate 0.4",
            "heave": (1.0, 7.0),
            "changes": mode((12.0, "brake"), (20.0, "follow")),
            "duration": 45.0,
        },
    ),
    "stop, hauling": Tow(
        "full_scale", MOTOR, {"winch": "1 rate -1.0", "changes": mode((10.0, "emergency_stop")), "duration": 40.0}
    ),
    "heavy, brake, following": Tow(
        "lowered_ctd",
        motor("lowered_ctd", 2000.0, 6e4) | HEAVY,
        {"winch": "1 rate 0.8", "changes": BRAKED, "duration": 45.0},
    ),
    "hauling, brake, following": Tow(
        "lowered_ctd",
        motor("lowered_ctd", 1000.0, 4e4) | deep(400.0),
        {"winch": "1 rate -0.9", "changes": mode((12.0, "brake"), (18.0, "follow")), "duration": 45.0},
        doubts=("SLACK",),
    ),
    # a rate loop on a long cable that rings; the first lost 16 mm and 13 % of the deviation
    "loop of second order": Tow(
        "lowered_ctd", loop(6.0, 0.5) | SHEAVE | deep(600.0), {"heave": (1.0, 8.0), "duration": 24.0}
    ),
    "loop of second order, slow": Tow(
        "lowered_ctd", loop(4.0, 0.3) | SHEAVE | deep(600.0), {"heave": (0.8, 6.0), "duration": 60.0}
    ),
    "loop of second order, 1500 m": Tow(
        "lowered_ctd", loop(6.0, 0.7) | SHEAVE, {"heave": (1.0, 8.0), "duration": 60.0}
    ),
    "loop of second order, rates": Tow(
        "lowered_ctd", loop(6.0, 0.4) | deep(600.0), {"winch": "1 rate 0.3, 15 rate 0.1, 30 hold", "duration": 50.0}
    ),
    "loop of first order": Tow(
        "lowered_ctd", loop(6.0, 0.0) | SHEAVE | deep(600.0), {"heave": (1.0, 8.0), "duration": 60.0}, deviation=0.02
    ),
    # layers of the drum
    "layers, lowering": Tow("full_scale", MOTOR | HOLD | LAYERS, {"winch": "1 rate 1.5", "duration": 50.0}),
    "layers, hauling": Tow("full_scale", MOTOR | HOLD | LAYERS, {"winch": "1 rate -1.0", "duration": 50.0}),
    "layers, brake, following": Tow(
        "full_scale",
        motor("full_scale", 300.0, 2e4) | LAYERS,
        {"winch": "1 rate 1.0", "changes": mode((15.0, "emergency_stop"), (22.0, "follow")), "duration": 30.0},
    ),
    "layers in heave": Tow(
        "lowered_ctd",
        motor("lowered_ctd", 1000.0, 4e4) | LAYERS | SHORT,
        {"winch": "1 rate -1.2", "heave": (0.5, 6.0), "duration": 50.0},
    ),
    "layers, ideal drive": Tow("full_scale", LAYERS, {"winch": "5 rate 1.0", "heave": (1.0, 7.0), "duration": 50.0}),
    # a constant pull; the drum is the cable's
    "constant pull": Tow(
        "lowered_ctd",
        motor("lowered_ctd", 300.0, 2e4) | {"drive.mode": "tension", "drive.set_pull": 4300.0} | deep(600.0),
        {"heave": (0.5, 4.0), "duration": 40.0},
    ),
    # friction of groove, bearing and gear
    "friction, hauling": Tow(
        "full_scale",
        {"sheave.friction": 0.15, "sheave.bearing_friction": 0.02, "setpoint.algorithm": "hold"},
        {"winch": "1 rate -0.6", "heave": (0.7, 7.0), "duration": 40.0},
    ),
    "friction, motor": Tow(
        "full_scale",
        MOTOR | {"sheave.friction": 0.12, "sheave.bearing_friction": 0.05, "drive.dry_friction": 300.0},
        {"winch": "1 rate 0.5", "heave": (0.8, 6.0), "duration": 40.0},
    ),
    # bare cable above, faired below, at 6 kn
    "fairing, hair": Tow("full_scale", faired("hair"), {"heave": (1.0, 6.0), "duration": 40.0}),
    "fairing, airfoil": Tow("full_scale", faired("airfoil"), {"heave": (1.0, 6.0), "duration": 40.0}),
    # the motor renders at its bound: lost 0.07 to 0.42 m, ok in the verdict
    "render": render(3500.0, 300.0, 300.0, (1.0, 6.0)),
    "render, short waves": render(3500.0, 300.0, 300.0, (0.3, 3.0)),
    "render, light drum": render(3450.0, 100.0, 300.0, (1.0, 7.0)),
    "render, 600 m": render(4600.0, 300.0, 600.0, (1.0, 8.0)),
    "render, 100 m": render(2700.0, 300.0, 100.0, (0.7, 5.0)),
}
TRIED = "brake, following", "loop of second order", "layers, brake, following", "render"


def off(tow: Tow) -> tuple[float, float, float, Any]:
    """How far [m] towbody and pay-out of chosen steps are off those of fine ones after the first 2 s, and the
    deviation of the tension as a share; the run."""
    scene = override(load_scene(tow.scene), tow.values)
    fine, run = (
        offline.run(scene, step=step, every=every, **tow.run) for step, every in (("fixed", FINE), ("chosen", None))
    )
    ours, theirs = run.frames[run.frames.time - run.frames.time[0] >= 2e9], fine.frames
    _, mine, same = np.intersect1d(ours.time, theirs.time, return_indices=True)
    assert len(mine) > 0.9 * len(ours)
    ours, theirs = ours[mine], theirs[same]
    away = np.sqrt(((ours.body_position - theirs.body_position) ** 2).sum(axis=1)).max()
    return away, np.abs(ours.payout - theirs.payout).max(), ours.tension.std() / theirs.tension.std() - 1.0, run


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in TRIED else pytest.mark.nightly) for name in TOWS]
)
def test_chosen_steps_keep_the_place_or_say_so(name):
    tow = TOWS[name]
    away, moved, deviation, run = off(tow)
    flags = {reason.flag for reason in run.verdict.reasons}
    assert run.problem == "" and flags == set(tow.doubts)
    limit = 0.04 if "RENDER_PLACE" in flags else ASKED
    assert away < limit and moved < limit
    assert abs(deviation) < tow.deviation
    if "layers" in name:
        assert np.abs(run.frames.energy_residual).max() < 5e-4 * np.abs(run.frames.work_supplied).max()
        assert np.ptp(run.frames.drum_layer) >= 1
