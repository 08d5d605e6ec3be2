"""Cable of several sections and what hangs on it, at rest, against closed forms and statics by hand."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import fsolve

from cable_sim_ros.io.scenes.load import load_scene, scene_from_dict
from cable_sim_ros.physics.towbody import Towbody
from cable_sim_ros.physics.water import Water
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.rig.rig import Rig, cable_of
from cable_sim_ros.sim.tables.material import wet_weight
from verification.shipped import started

pytestmark = pytest.mark.trust
G = 9.81


def test_a_hanging_cable_of_two_materials_and_a_termination():
    """Tension of each at the top of it, stretch (W + w L/2) L/EA of each, from the bottom upwards."""
    upper, lower = (30.0, 2.0, 4e5), (20.0, 0.5, 1e5)  # m, kg/m, N
    cable = cable_of(
        [
            {"length": upper[0], "elements": 15, "termination_mass": 8.0},
            {"length": lower[0], "elements": 10, "mass_per_length": lower[1], "axial_stiffness": lower[2]},
        ],
        mass_per_length=upper[1],
        axial_stiffness=upper[2],
    )
    rig = Rig(cable, held={0: "r"}, tension=1e3, bodies={-1: 10.0})
    rig.straight((0.0, 0.0, 0.0), (0.0, 0.0, -1.0))
    rig.settle()
    at_joint = G * (10.0 + lower[0] * lower[1])
    low = lower[0] * (G * 10.0 + 0.5 * G * lower[1] * lower[0]) / lower[2]
    high = upper[0] * (at_joint + 8.0 * G + 0.5 * G * upper[1] * upper[0]) / upper[2]
    assert rig.state.reaction[0, 2] == pytest.approx(at_joint + 8.0 * G + G * upper[0] * upper[1], rel=1e-6)
    assert -rig.state.q[15, 2] - 30.0 == pytest.approx(high, rel=2e-3)
    assert rig.state.q[15, 2] - rig.state.q[-1, 2] - 20.0 == pytest.approx(low, rel=1e-2)


def two_catenaries(span: float, lengths, weights, point: float) -> tuple[float, np.ndarray]:
    """Horizontal pull [N] and place of the joint of two inextensible chains between two points of equal height.

    point: weight [N] at the joint. With V the vertical force, x = H/w (asinh(V1/H) - asinh(V0/H)), z = H/w (cosh...).
    """

    def pieces(unknown):
        pull, start = unknown
        x, z, joint, v = 0.0, 0.0, np.zeros(2), start
        for k, (length, w) in enumerate(zip(lengths, weights)):
            end = v + w * length
            x += pull / w * (np.arcsinh(end / pull) - np.arcsinh(v / pull))
            z += pull / w * (np.hypot(1.0, end / pull) - np.hypot(1.0, v / pull))
            v = end + (point if k == 0 else 0.0)
            if k == 0:
                joint = np.array((x, z))
        return x, z, joint

    total = sum(w * length for w, length in zip(weights, lengths)) + point
    pull, start = fsolve(lambda u: np.subtract(pieces(u)[:2], (span, 0.0)), (total, -0.5 * total), xtol=1e-12)
    return float(pull), pieces((pull, start))[2]


@pytest.mark.parametrize("mass", [0.0, 4.0])
def test_a_chain_of_two_weights_between_two_points(mass):
    """Sag and pull of two catenaries that meet at the joint, with and without a termination there."""
    lengths, masses, span = (30.0, 20.0), (1.0, 3.0), 40.0
    pull, joint = two_catenaries(span, lengths, np.multiply(masses, G), mass * G)
    cable = cable_of(
        [
            {"length": lengths[0], "elements": 60, "termination_mass": mass},
            {"length": lengths[1], "elements": 40, "mass_per_length": masses[1]},
        ],
        mass_per_length=masses[0],
        axial_stiffness=1e8,
    )
    rig = Rig(cable, held={0: "r", -1: "r"}, tension=300.0)
    s = rig.arc / rig.arc[-1]
    depth = 13.0 * 4.0 * s * (1.0 - s)
    rig.place(np.column_stack((span * s, 0.0 * s, -depth)), np.tile((1.0, 0.0, 0.0), (rig.nodes, 1)))
    rig.settle()
    assert -rig.state.reaction[0, 0] == pytest.approx(pull, rel=1e-3)
    assert rig.state.q[60, [0, 2]] == pytest.approx(joint, abs=0.02)


def test_a_split_cable_is_the_whole_one_to_the_bit():
    """Sections that give the cable's own numbers again."""
    found = []
    for split in ([{"length": 10.0, "elements": 20}], [{"length": 5.0, "elements": 10, "mass_per_length": 0.7}] * 2):
        rig = Rig(cable_of(split, mass_per_length=0.7, axial_stiffness=1e5), held={0: "r", -1: "r"}, tension=100.0)
        s = rig.arc
        rig.place(np.column_stack((0.8 * s, 0.0 * s, 0.1 * s * (s - 10.0))), np.tile((1.0, 0.0, 0.0), (rig.nodes, 1)))
        rig.settle()
        found.append(rig.state.q.copy())
    assert (found[0] == found[1]).all()


def test_a_float_in_the_middle_of_a_line_lifts_it_to_a_triangle():
    """Line as light as water between two points at one depth: 2 T sin(angle) is the lift; the kink is rounded."""
    water, lift, length, span = Water(), 200.0, 21.0, 20.0
    area = 0.25 * np.pi * 0.01**2
    cable = cable_of(
        [{"length": 9.5, "elements": 10}] + [{"length": 1.0, "elements": 20}] * 2 + [{"length": 9.5, "elements": 10}],
        mass_per_length=water.density * area,
        axial_stiffness=1e6,
    )
    float_ = Towbody(mass=5.0, net_weight=-lift)
    rig = Rig(cable, held={0: "r", -1: "r"}, tension=300.0, water=water, bodies={30: float_})
    s = rig.arc / length
    up = 3.0 * np.minimum(s, 1.0 - s) * 2.0
    rig.place(np.column_stack((span * s, 0.0 * s, up - 50.0)), np.tile((1.0, 0.0, 0.0), (rig.nodes, 1)))
    rig.settle()
    half = 0.5 * length
    for _ in range(50):  # stretched half length
        angle = np.arccos(0.5 * span / half)
        half = 0.5 * length * (1.0 + lift / (2.0 * np.sin(angle)) / 1e6)
    assert rig.state.reaction[0, 2] == pytest.approx(-0.5 * lift, rel=1e-6)
    assert rig.tension_at(5.0) == pytest.approx(lift / (2.0 * np.sin(angle)), rel=5e-3)
    assert rig.state.q[30, 2] + 50.0 == pytest.approx(half * np.sin(angle), rel=5e-3)


@pytest.mark.parametrize("name", ["full_scale", "full_scale_contact"])
@pytest.mark.parametrize("net", [150.0, -100.0], ids=["pod", "float"])
def test_a_body_on_the_line_of_a_ship_at_rest(net, name):
    """The pull at the sheave is the weight of all that hangs below; the cable below the body does not feel it."""
    data = load_scene(name).model_dump(mode="json")
    data["ship"]["tow_speed"], data["setpoint"]["algorithm"] = 0.0, "hold"
    data["cable"]["sections"]["bare"] |= {"mass_per_length": 0.5, "termination_mass": 6.0}
    data["bodies"] = {"pod": {"at": "bare", "mass": 30.0, "net_weight": net}}
    sim = started(scene_from_dict(data, "test"))
    scene, line = sim.scene, sim.output.shape[0]
    bare, faired = scene.cable.sections["bare"], scene.cable.sections["faired"]
    joint = int(sim.model.line.body_nodes[1])
    lengths = np.diff(sim.state.arc)
    below = scene.towbody.net_weight + wet_weight(scene, faired) * 150.0
    assert sim.state.tension[joint] == pytest.approx(below, abs=wet_weight(scene, faired) * lengths[joint])
    step = sim.state.tension[joint - 1] - sim.state.tension[joint]
    sizes = 0.5 * (wet_weight(scene, bare) * lengths[joint - 1] + wet_weight(scene, faired) * lengths[joint])
    assert step == pytest.approx(net + 6.0 * G + sizes, rel=0.02)
    everything = below + net + 6.0 * G + wet_weight(scene, bare) * (line[joint, 4] - wet_from(line))
    above = scene.cable.mass_per_length * G  # per length in the air, of the section on the sheave or the bare one
    assert float(sim.frame.tension) == pytest.approx(everything, abs=6.0 * above)
    assert np.abs(line[joint:, 0] - line[joint, 0]).max() < 0.5, "it hangs straight"
    # the published tension, node by node: what hangs below, from both sides of the jump
    hangs = scene.towbody.net_weight + wet_weight(scene, faired) * (line[-1, 4] - line[:, 4])
    hangs[:joint] += (
        net + 6.0 * G + (wet_weight(scene, bare) - wet_weight(scene, faired)) * (line[joint, 4] - line[:joint, 4])
    )
    wet = np.flatnonzero(line[:, 2] < -1.0)
    clear = wet[np.abs(wet - joint) > 1]
    assert line[clear, 3] == pytest.approx(hangs[clear], abs=1.0)
    beside = sorted(sim.state.tension[joint - 1 : joint + 1])
    assert beside[0] < line[joint, 3] < beside[1]


def wet_from(line: np.ndarray) -> float:
    """Arc length [m] at which the cable enters the water."""
    return float(np.interp(0.0, -line[:, 2], line[:, 4]))


@pytest.mark.parametrize("name", ["full_scale", "full_scale_contact"])
def test_the_energy_account_closes_with_a_pod_and_terminations_under_way(name):
    """Heave with the winch at work: residual at most 1e-3 of the work, stored and supplied counting what hangs."""
    data = load_scene(name).model_dump(mode="json")
    data["cable"]["sections"]["bare"] |= {"termination_mass": 20.0, "termination_net_weight": 150.0}
    if name == "full_scale_contact":
        data["cable"]["sections"]["sheave"]["termination_mass"] = 2.0
    pod = {"at": "bare", "mass": 60.0, "net_weight": -50.0, "drag_area": [0.05, 0.1, 0.1], "added_mass": [9.0] * 3}
    run = offline.run(scene_from_dict(data | {"bodies": {"pod": pod}}, "test"), heave=(0.5, 8.0), duration=12.0)
    work = np.abs(run.frames.work_supplied).max()
    assert work > 500.0
    assert np.abs(run.frames.energy_residual).max() < 1e-3 * work
