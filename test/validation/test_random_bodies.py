"""Random rigid bodies on two shipped tows under a heaving, rolling ship: each runs to its end, or is not started with
the reason. Seeds, so that a failure comes back."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from cable_sim_ros import ShipMotion, Simulator
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.sim.statics.route import StartError

pytestmark = pytest.mark.nightly

COUNT = 200


def scene_of(chance: np.random.Generator):
    """A shipped tow with a body of random size, balance, tail and wing; slow to fast."""
    of, between = load_scene(str(chance.choice(["full_scale", "side_scan"]))), chance.uniform
    length = between(0.8, 4.0)
    thick, mass = length * between(0.05, 0.2), of.towbody.mass * between(0.5, 2.0)
    lifted = 0.8 * 0.25 * np.pi * thick**2 * length * 1026.0 * 9.81 * between(0.6, 1.0)
    along, level = mass * length**2 / 12.0, {"chord": length * between(0.05, 0.15), "span": length * between(0.1, 0.4)}
    wings = {
        "tail": level | {"place": [-length * between(0.4, 0.6), 0.0, -0.5 * thick]},
        "fin": level | {"place": [-length * between(0.4, 0.6), 0.0, -0.5 * thick], "dihedral": 90.0},
    }
    if chance.random() < 0.5:
        size = {"span": length * between(0.2, 0.8), "chord": length * between(0.05, 0.2)}
        angles = {"incidence": between(-10.0, 3.0), "dihedral": between(-10.0, 10.0)}
        wings["wing"] = size | angles | {"place": [length * between(-0.1, 0.1), 0.0, -0.5 * thick]}
    body = {
        "model": "rigid",
        "lift_area": 0.0,
        "mass": mass,
        "net_weight": max(mass * 9.81 - lifted, 20.0),
        "length": length,
        "diameter": thick,
        "inertia": [mass * thick**2 / 8.0, along, along],
        "centre_of_gravity": [
            length * between(-0.15, 0.1),
            length * between(-0.005, 0.005),
            -thick * between(0.5, 1.5),
        ],
        "centre_of_buoyancy": [length * between(-0.15, 0.05), 0.0, -thick * between(0.3, 0.9)],
        "added_mass": [0.0, 0.0, 0.0],
        "drag_area": [0.9 * 0.25 * np.pi * thick**2, 0.0, 0.0],
        "wings": wings,
    }
    changes = {"setpoint.algorithm": "hold", "ship.tow_speed": between(0.2, 4.0)}
    if chance.random() < 0.3:
        changes["solver.tension_error"] = 0.005
    if chance.random() < 0.3:
        changes |= {"water.waves.kind": "jonswap", "water.waves.height": 2.0, "water.waves.period": 8.0}
    return override(of, changes | {f"towbody.{key}": value for key, value in body.items()})


def heave(sim: Simulator, chance: np.random.Generator) -> None:
    """18 s of up to 2.5 m of heave and 10 deg of roll."""
    w, speed = 2.0 * np.pi / chance.uniform(4.0, 12.0), sim.scene.ship.tow_speed
    up, roll = 0.5 * chance.uniform(0.2, 2.5), np.radians(chance.uniform(0.0, 10.0))
    for k in range(1, 900):
        t = 0.02 * k
        place, velocity = (speed * t, 0.0, up * (1.0 - np.cos(w * t))), (speed, 0.0, up * w * np.sin(w * t))
        turned, rate = (roll * np.sin(w * t), 0.0, 0.0), (roll * w * np.cos(w * t), 0.0, 0.0)
        sim.push(ShipMotion(time_ns=k * 20_000_000, position=place, velocity=velocity, attitude=turned, rate=rate))


def test_random_bodies_run_or_are_not_started_with_the_reason():
    """Of the first 100, 12 had no trim that they keep, and more than 15 % would be new; energy in balance to 5e-5."""
    became, worst = Counter[str](), 0.0
    for seed in range(COUNT):
        chance = np.random.default_rng(seed)
        sim = Simulator(scene_of(chance))
        try:
            sim.start()
        except StartError as error:
            assert "Remedy:" in str(error), seed
            became["not started"] += 1
            continue
        heave(sim, chance)
        frames = sim.run(1700)
        assert all(np.isfinite(frames[name]).all() for name in ("tension", "body_position", "body_quaternion")), seed
        assert np.abs(np.linalg.norm(frames.body_quaternion, axis=1) - 1.0).max() < 1e-9, seed
        worked = np.abs(np.diff(frames.work_supplied)).sum() + np.abs(np.diff(frames.work_water)).sum()
        worst = max(worst, abs(float(frames.energy_residual[-1] - frames.energy_residual[0])) / max(worked, 1.0))
        became["ran"] += 1
    assert became["not started"] <= 0.15 * COUNT and worst < 1e-3, (became, worst)
