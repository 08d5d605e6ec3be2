"""The whole tow against an independent statics: the cable's differential equation in a uniform stream (EI = 0)."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cable_sim_ros.io.load import load_scene, override
from cable_sim_ros.physics.drag import LOADING, choo_casarella
from cable_sim_ros.physics.fairing import dressed
from cable_sim_ros.sim.simulator import Simulator

CONFIG = Path(__file__).parents[2] / "config"


def profile(scene):
    """Solution (x, z, F_x, F_z) over the unstretched length from the body upwards, no bending, fully wet."""
    cable, water, body = scene.cable, scene.water, scene.towbody
    speed, d = scene.ship.tow_speed, cable.diameter
    weight = (cable.mass_per_length - water.density * 0.25 * np.pi * d**2) * scene.gravity
    q = 0.5 * water.density * speed**2
    # pull of the cable on the body: up and ahead
    force = np.array((q * body.drag_area[0], body.net_weight - q * body.lift_area))
    sections = [dressed(section) for section in cable.sections.values()][::-1]
    ends = np.cumsum([s.length for s in sections])

    def rhs(s, y):
        x, z, fx, fz = y
        t = np.array((fx, fz)) / np.hypot(fx, fz)  # upwards along the cable
        section = sections[min(int(np.searchsorted(ends, s)), len(sections) - 1)]
        eta = np.arctan2(abs(t[1]), abs(t[0]))
        n, f = LOADING[section.drag_law]
        fn = n[0] + n[1] * np.cos(eta) + n[2] * np.sin(eta) + n[3] * np.cos(2 * eta) + n[4] * np.sin(2 * eta)
        ft = f[0] + sum(f[k] * np.cos(k * eta) + f[5 + k] * np.sin(k * eta) for k in range(1, 6))
        cd = section.drag_coefficient or choo_casarella(water.density * d * speed * np.sin(eta) / water.viscosity)[0]
        k = section.drag_amplification * q * d * cd
        stream = np.array((-1.0, 0.0))
        normal = stream - np.dot(stream, t) * t
        load = k * (fn * normal / np.linalg.norm(normal) + max(ft, 0.0) * np.sign(np.dot(stream, t)) * t)
        stretch = 1.0 + np.hypot(fx, fz) / cable.axial_stiffness
        return [stretch * t[0], stretch * t[1], -load[0], weight - load[1]]

    return solve_ivp(
        rhs, (0.0, ends[-1]), np.array((0.0, 0.0, *force)), rtol=1e-9, atol=1e-9, max_step=1.0, dense_output=True
    )


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"ship.tow_speed": 1.0},
        {"cable.sections.bare.drag_amplification": 1.0, "cable.sections.faired.drag_amplification": 1.0},
        {"towbody.lift_area": 0.0},
    ],
)
def test_static_tow_against_the_differential_equation(changes):
    """From the body upwards to where the product's cable leaves the water: same shape and tension.

    Allowed 0.2 % of depth and length, 0.3 % of tension: the product has a mesh and bending.
    """
    scene = override(load_scene(CONFIG / "full_scale.yaml"), {"setpoint.algorithm": "hold", **changes})
    sim = Simulator(scene)
    sim.start()
    shape = sim.shape
    below = np.flatnonzero(shape[:, 2] < -1.0)
    arc = shape[-1, 4] - shape[below, 4]
    want = profile(scene).sol(arc)
    depth = -shape[-1, 2]
    np.testing.assert_allclose(shape[below, 2] - shape[-1, 2], want[1], atol=2e-3 * depth)
    np.testing.assert_allclose(shape[below, 0] - shape[-1, 0], want[0], atol=2e-3 * 450.0)
    got = shape[below[:-1], 3]
    np.testing.assert_allclose(got, np.hypot(want[2], want[3])[:-1], rtol=3e-3)  # 12.5 m elements near the body
    print(f"{changes}: top tension {got[0]:.1f} N, equation {np.hypot(*want[2:, 0]):.1f} N")
