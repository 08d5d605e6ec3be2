"""A winch that feeds cable: closed forms of material flow, mass and energy, and the drum that was beside it."""

from __future__ import annotations

import numpy as np
import pytest

from cable_sim_ros import Simulator, WinchCommand
from cable_sim_ros.compiler.jit import LANES
from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.ancf import MASS_PER_LENGTH
from cable_sim_ros.sim.layout import layout_of

pytestmark = pytest.mark.trust

MASS, BODY, GRAVITY = 0.389, 250.0, 9.81


def in_air(tick: float = 0.01, **values) -> Simulator:
    """A weight on a cable of two masses per length over the sheave, far above the water: no drag, no buoyancy."""
    scene = override(
        load_scene("full_scale"),
        {
            "ship.tow_speed": 0.0,
            "ship.reference_height": 50.0,
            "setpoint.algorithm": "hold",
            "solver.tick": tick,
            "winch.scope": 25.0,
            "winch.max_acceleration": 2.0,
            "cable.axial_damping": 1e5,
            "towbody.net_weight": BODY * GRAVITY,
        }
        | {f"cable.sections.{name}.length": length for name, length in (("bare", 100.0), ("faired", 30.0))}
        | values,
    )
    sim = Simulator(scene)
    sim.start()
    return sim


def mass_out(sim) -> float:
    """Mass of the meshed cable, as the elements have it [kg]."""
    lengths = np.diff(sim.state.arc)
    rows = np.concatenate([group[MASS_PER_LENGTH] for group in sim.model.line.elements])[: len(lengths)]
    assert LANES * len(sim.model.line.elements) >= len(lengths)
    return float(rows @ lengths)


@pytest.mark.parametrize("pull", [0.6, -0.6], ids=["paying out", "hauling in"])
def test_the_drum_pulls_with_the_mass_outboard_times_its_acceleration(pull):
    """Vertical cable in air: T = (mu l + M) (g - P''), whatever runs through the mesh; here up to 2 m/s."""
    sim = in_air()
    report = []
    for i in range(400):
        t = 0.01 * (i + 1)
        sim.push(WinchCommand(rate=pull * t))
        f = sim.tick()
        hung = MASS * (f.scope - layout_of(sim.scene).route.sheave) + BODY
        report.append((f.tension, hung * (GRAVITY - pull), f.payout_rate))
    tension, expected, rate = np.array(report[150:350]).T  # the weight bounces at first
    assert abs(rate[-1]) > 1.9
    print(f"T over (mu l + M)(g - a) - 1: {tension.mean() / expected.mean() - 1:.1e}")
    assert tension.mean() == pytest.approx(expected.mean(), rel=2e-3)


def test_what_runs_out_is_what_the_drum_loses_and_weighs_what_it_should():
    """Pay-out and cable on the drum add up; the elements hold the mass of the material between the nodes."""
    sim = in_air(0.02, **{"cable.sections.faired.mass_per_length": 0.8})
    total, ends = 130.0, np.array([100.0, 130.0])
    for target in (12.0, 120.0):
        for _ in range(6):
            sim.push(WinchCommand(payout=target))
            frames = sim.run(100)
            assert frames.payout + frames.cable_on_drum == pytest.approx(total, abs=1e-9)
            arc = sim.state.arc
            assert (np.diff(arc) > 0.0).all() and arc[-1] == pytest.approx(total, abs=1e-9)
            bare = max(ends[0] - arc[0], 0.0)
            assert mass_out(sim) == pytest.approx(MASS * bare + 0.8 * (total - arc[0] - bare), rel=1e-9)


def swung(name: str, values: dict) -> np.ndarray:
    """Tension [N] and towbody from its own start [m], and that from the sheave, while the winch swings 0.4 m in 8 s."""
    tick, omega = 0.02, 2.0 * np.pi / 8.0
    sim = Simulator(override(load_scene(name), {"setpoint.algorithm": "hold", "solver.tick": tick} | values))
    sim.start()
    first, report = sim.frame.body_position - sim.frame.sheave_position, []
    for i in range(round(16.0 / tick)):
        sim.push(WinchCommand(rate=0.4 * omega * np.cos(omega * tick * (i + 0.5))))
        f = sim.tick()
        hung = f.body_position - f.sheave_position
        report.append([f.tension, *(hung - first), *hung])
    return np.array(report)[round(8.0 / tick) :]


def test_small_travel_is_that_of_a_cable_wound_on_a_surface():
    """Within 1 % of the swing of the tension and 5 mm. What remains is the other drum's: cable that is fixed 3 m before
    the tangent point, on a surface that it presses in, and elements of 0.24 m there. Less of all that, less remains."""
    base = load_scene("full_scale_contact")
    route = layout_of(base).route
    scope = route.total - route.wound - route.inboard
    fed = swung("full_scale", {"winch.scope": scope})
    swing = np.ptp(fed[:, 0])
    left = {}
    for wrap in (10.0, 3.0):
        length = base.cable.sections["drum"].length - (base.winch.wrap - wrap) * route.drum
        gap = swung("full_scale_contact", {"winch.wrap": wrap, "cable.sections.drum.length": length}) - fed
        left[wrap] = (
            np.abs(gap[:, 0]).max(),
            np.linalg.norm(gap[:, 1:4], axis=1).max(),
            np.linalg.norm(gap[:, 4:], axis=1).max(),
        )
    print(f"swing {swing:.0f} N; tension [N], way and place [m] by wrap: {left}")
    assert left[10.0][0] < 0.01 * swing and left[10.0][1] < 5e-3
    assert left[3.0][0] < 0.6 * left[10.0][0] and left[3.0][2] < 0.6 * left[10.0][2] < 5e-3
