"""The whole tow against an independent statics: the cable's differential equation in a uniform stream (EI = 0)."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from cable_sim_ros.io.scenes.load import load_scene, override, scene_from_dict
from cable_sim_ros.physics.drag_laws import LAWS, AmplifiedDrag, DragLaw, choo_casarella
from cable_sim_ros.physics.fairing import PRESETS, dressed
from cable_sim_ros.physics.section import material_of
from verification.shipped import started

pytestmark = pytest.mark.trust


def profile(scene):
    """Solution (x, z, F_x, F_z) over the unstretched length from the body upwards, no bending, fully wet.

    Section by section; what hangs at the outboard end of one adds its net weight, drag and lift to the pull.
    """
    cable, water = scene.cable, scene.water
    speed, density = scene.ship.tow_speed, water.density
    q = 0.5 * density * speed**2

    def pull(body):
        """Pull of the cable on a body: up and ahead."""
        return np.array((q * body.drag_area[0], body.net_weight - q * body.lift_area))

    def rhs(section):
        own, preset, section = material_of(cable, section), PRESETS[section.fairing], dressed(section)
        weight = (own.mass_per_length - density * 0.25 * np.pi * own.diameter**2) * scene.gravity
        weight += 0.25 * np.pi * own.diameter**2 * preset.volume * (preset.density - density) * scene.gravity
        d, law = own.diameter * preset.thickness, section.drag_law

        def slope(s, y):
            x, z, fx, fz = y
            t = np.array((fx, fz)) / np.hypot(fx, fz)  # upwards along the cable
            eta = np.arctan2(abs(t[1]), abs(t[0]))
            n, f = LAWS[law][:2]
            fn = n[0] + n[1] * np.cos(eta) + n[2] * np.sin(eta) + n[3] * np.cos(2 * eta) + n[4] * np.sin(2 * eta)
            ft = f[0] + sum(f[k] * np.cos(k * eta) + f[5 + k] * np.sin(k * eta) for k in range(1, 6))
            cd = section.drag_coefficient or choo_casarella(density * d * speed * np.sin(eta) / water.viscosity)[0]
            if law is DragLaw.CROSSFLOW:
                ft = section.tangential_coefficient / cd * np.cos(eta) ** 2
            factor, both = section.drag_amplification, section.drag_amplification_of is not AmplifiedDrag.NORMAL
            along = (factor if both else 1.0) * max(ft, 0.0)
            k = q * d * cd
            stream = np.array((-1.0, 0.0))
            normal = stream - np.dot(stream, t) * t
            load = k * (factor * fn * normal / np.linalg.norm(normal) + along * np.sign(np.dot(stream, t)) * t)
            stretch = 1.0 + np.hypot(fx, fz) / own.axial_stiffness
            return [stretch * t[0], stretch * t[1], -load[0], weight - load[1]]

        return slope

    start, y, pieces = 0.0, np.array((0.0, 0.0, *pull(scene.towbody))), []
    for name, section in list(cable.sections.items())[::-1]:
        y[2:] += sum((pull(body) for body in scene.bodies.values() if body.at == name), np.zeros(2))
        y[3] += section.termination_net_weight or 0.0
        span = (start, start + section.length)
        pieces.append(solve_ivp(rhs(section), span, y, rtol=1e-9, atol=1e-9, max_step=1.0, dense_output=True))
        start, y = span[1], pieces[-1].y[:, -1]

    def at(arc):
        ends = [piece.t[-1] for piece in pieces]
        return np.array([pieces[min(int(np.searchsorted(ends, s)), len(ends) - 1)].sol(s) for s in arc]).T

    return at


def beside(scene):
    """Shape of a tow at rest, its nodes in the water, and the equation's solution there; their places are the same.

    Allowed 0.2 % of depth and length: the product has a mesh and bending.
    """
    shape = started(scene).shape
    below = np.flatnonzero(shape[:, 2] < -1.0)
    want = profile(scene)(shape[-1, 4] - shape[below, 4])
    np.testing.assert_allclose(shape[below, 2] - shape[-1, 2], want[1], atol=-2e-3 * shape[-1, 2])
    np.testing.assert_allclose(shape[below, 0] - shape[-1, 0], want[0], atol=2e-3 * 450.0)
    return shape, below, want


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"ship.tow_speed": 1.0},
        {"cable.sections.bare.drag_amplification": 1.0, "cable.sections.faired.drag_amplification": 1.0},
        {"towbody.lift_area": 0.0},
        {"cable.sections.bare.drag_amplification_of": "normal"},
    ],
)
def test_static_tow_against_the_differential_equation(changes):
    """From the body upwards to where the product's cable leaves the water: same shape, and tension to 0.3 %."""
    shape, below, want = beside(override(load_scene("full_scale"), {"setpoint.algorithm": "hold", **changes}))
    got = shape[below[:-1], 3]
    np.testing.assert_allclose(got, np.hypot(want[2], want[3])[:-1], rtol=3e-3)  # 12.5 m elements near the body
    print(f"{changes}: top tension {got[0]:.1f} N, equation {np.hypot(*want[2:, 0]):.1f} N")


@pytest.mark.parametrize(
    "fairing, name", [("ribbon", "full_scale_contact"), ("airfoil", "full_scale"), ("hair", "full_scale")]
)
def test_static_tow_of_several_cables_against_the_differential_equation(fairing, name):
    """Two materials, a fairing with its weight, a termination and a depressor between; elements of 5 m.

    Allowed as above; the tension only two elements away from the joint, where it jumps.
    """
    data = load_scene(name).model_dump(mode="json")
    bare, faired = data["cable"]["sections"]["bare"], data["cable"]["sections"]["faired"]
    counts = {"bare": {"elements": 60}, "faired": {"elements": 30}}
    if name == "full_scale":
        data["mesh"] = {"sections": {key: count | {"grading": 1.0} for key, count in counts.items()}}
    else:
        bare |= counts["bare"]
        faired |= counts["faired"]
    bare |= {"diameter": 0.012, "mass_per_length": 0.5, "axial_stiffness": 3e6}
    bare |= {"termination_mass": 6.0, "termination_net_weight": 40.0}
    faired |= {"drag_law": None, "fairing": fairing, "drag_amplification": 1.0}
    pod = {"at": "bare", "mass": 60.0, "net_weight": 300.0, "drag_area": [0.05, 0.1, 0.1], "lift_area": -0.05}
    data["setpoint"]["algorithm"] = "hold"
    shape, below, want = beside(scene_from_dict(data | {"bodies": {"depressor": pod}}, "test"))
    clear = np.abs(below - (len(shape) - 31)) > 2
    clear[-1] = False
    np.testing.assert_allclose(shape[below[clear], 3], np.hypot(want[2], want[3])[clear], rtol=3e-3)
    jump = np.diff(np.hypot(want[2], want[3]))[len(shape) - 32 - below[0]]
    print(f"{fairing}: depth {-shape[-1, 2]:.2f} m, {jump:.1f} N at the joint")
    assert abs(jump) > 20.0
