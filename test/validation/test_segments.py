"""Chains of links against an independent multibody code and against the cubic elements.

A bare cable swinging in air with the product's integrator: energy of the undamped swing.
"""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from cable_sim_ros.physics.link_loads import integrals
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.water import Water
from cable_sim_ros.sim.rig.rig import Rig, cable_of
from verification.experiments import run
from verification.experiments.segments import printed
from verification.stress.n09_n10_n12_heavy_sea_and_energy import swinging

pytestmark = pytest.mark.trust

LENGTH, MASS, GRAVITY = 10.0, 0.389, 9.81


@pytest.mark.parametrize("tick, loss", [(0.002, 1e-3), (0.01, 2e-2)])
def test_undamped_swing_keeps_its_energy(tick, loss):
    """30 degrees, 10 s. An independent code with the same method lost 2e-4 at 2 ms (docs/theory.md, section 4)."""
    sim, angle = swinging(tick), np.radians(30.0)
    frames = sim.run(round(10.0 / tick))
    lowest = MASS * LENGTH * GRAVITY * (sim.state.q[0, 2] - 0.5 * LENGTH)
    swing = 0.5 * MASS * GRAVITY * LENGTH**2 * (1.0 - np.cos(angle))
    energy = (frames.kinetic_energy + frames.strain_energy + frames.potential_energy - lowest) / swing - 1.0
    print(f"swing energy at {tick} s: first {energy[0]:.2e}, most {energy.max():.2e}, after 10 s {energy[-1]:.2e}")
    assert energy.max() < 1e-4, "a passive cable never gains"
    assert energy[-1] > -loss
    assert frames.kinetic_energy.max() > 0.5 * swing, "it must swing"


def test_every_figure_is_within_what_is_allowed():
    """R1 to R4: 1e-4 m for the same links, 1e-3 m for the steady R4; ancf as a smooth cable."""
    rows = run("segments", 1.0).rows
    compared = [row for row in rows if row.allowed is not None]
    assert len(compared) > 50
    missed = [row for row in compared if not abs(row.ours - row.measured) <= row.allowed]
    assert not missed


def test_the_integrals_as_printed_are_not_those_of_the_text():
    """What the table of misprints says: each of the three is off as printed."""
    form = (0.25, 0.3, 0.5, 2.0)
    for wrong, right in zip(printed(*form), integrals(*form), strict=True):
        assert abs(wrong / right - 1.0) > 0.05


@pytest.mark.parametrize("buoyancy", ["full", "normal"])
def test_the_printed_buoyancy_leaves_a_cable_too_limp(buoyancy):
    """200 m straight down from 100 m, pulled aside at its end by 1 N.

    In truth (T_e t)' = (w - b) k, the slope is F/T_e. As printed, with a body that lacks the pressure on the cable's
    cross-section, T = T_e - pA and T theta' = (w - b) theta: the tip yields by two thirds more.
    """
    length, area, rho, g, weight, side = 200.0, 0.25 * np.pi * 0.01**2, 1026.0, 9.81, 445.0, 1.0
    top = -100.0
    cable = cable_of(
        [{"length": length, "elements": 80}],
        model="segments",
        link_buoyancy=buoyancy,
        diameter=0.01,
        mass_per_length=0.389,
        axial_stiffness=1e8,
    )
    pressed = rho * g * (length - top) * area
    net = weight if buoyancy == "full" else weight - pressed
    rig = Rig(
        cable, held={0: "r"}, tension=weight, bodies={-1: Towbody(mass=250.0, net_weight=net)}, water=Water(density=rho)
    )
    rig.straight((0.0, 0.0, top), (0.0, 0.0, -1.0))
    rig.load(-1, force=(side, 0.0, 0.0))
    rig.settle()
    up = np.linspace(0.0, length, 4001)
    dry, wet = 0.389 * g, (0.389 - rho * area) * g
    if buoyancy == "full":
        tension, slope = weight + wet * up, side / (weight + wet * up)
    else:
        tension = net + dry * up
        slope = side / net * (tension / net) ** (-wet / dry)
    assert rig.state.q[-1, 0] == pytest.approx(trapezoid(slope, up), rel=3e-3)
    assert rig.state.reaction[0, 2] == pytest.approx(tension[-1], rel=3e-3)
    effective = tension[-1] if buoyancy == "full" else tension[-1] - rho * g * top * area
    assert effective == pytest.approx(weight + wet * length, rel=3e-3)
