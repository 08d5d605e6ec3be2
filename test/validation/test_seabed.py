"""A chain laid on a floor, dragged over it, and a tow on the seabed, against closed forms."""

import numpy as np
import pytest

from cable_sim_ros.io.scenes.load import load_scene, override
from cable_sim_ros.physics.contact_surface import floor_row
from cable_sim_ros.physics.tick_output import Flag
from cable_sim_ros.runs import offline
from cable_sim_ros.sim.rig.rig import HALVED, Rig, cable_of, load_of
from cable_sim_ros.sim.simulator import Simulator, StartError
from verification.shipped import started

pytestmark = pytest.mark.trust

WEIGHT, FRICTION, SLIP = 4.0, 0.3, 0.01  # N/m, 1, m/s


def chain(length: float, elements: int, penetration: float, **more) -> Rig:
    """A chain without bending stiffness over a floor at z = 0."""
    cable = cable_of(
        [{"length": length, "elements": elements}], mass_per_length=WEIGHT / 9.81, axial_stiffness=1e7, diameter=0.02
    )
    floor = floor_row(0.0, WEIGHT / penetration**1.5, 1.0, FRICTION, SLIP)
    return Rig(cable, tension=200.0, surfaces=[floor], **more)


@pytest.mark.parametrize(("pull", "height", "length"), [(200.0, 20.0, 120.0), (50.0, 30.0, 90.0), (400.0, 5.0, 100.0)])
def test_a_chain_laid_on_a_floor_hangs_as_the_catenary_of_its_touchdown(pull, height, length):
    """Suspended length sqrt(h^2 + 2 h H/w), tension at the top H + w h, span H/w arccosh(1 + w h/H)."""
    depth = 1e-3
    rig = chain(length, 40, depth, held={0: "r", -1: "yz"}, loads=[load_of(40, (pull, 0.0, 0.0))])
    hanging = np.sqrt(height**2 + 2.0 * height * pull / WEIGHT)
    slope = np.sqrt(hanging**2 - height**2)
    s = rig.arc
    down = s < hanging
    x = np.where(down, s * slope / hanging, slope + s - hanging)
    z = np.where(down, height * (1.0 - s / hanging), 0.0)
    g = np.where(down[:, None], (slope / hanging, 0.0, -height / hanging), (1.0, 0.0, 0.0))
    rig.place(np.column_stack((x, 0.0 * s, z)), g)
    rig.settle()
    top = float(np.linalg.norm(rig.state.reaction[0, :3]))
    assert top == pytest.approx(pull + WEIGHT * height, rel=5e-4)
    span = pull / WEIGHT * np.arccosh(1.0 + WEIGHT * height / pull)
    assert rig.state.q[-1, 0] == pytest.approx(span + length - hanging, abs=2e-3 * length)
    # penetration under its own weight, away from the touchdown and its end
    lying = (s > hanging + 0.1 * length) & (s < 0.95 * length)
    assert rig.state.q[lying, 2] == pytest.approx(-depth, rel=0.02)
    pressed = rig.contact_table()
    load = float((pressed["load_own"] * pressed["length"]).sum())
    assert load == pytest.approx(WEIGHT * (length - hanging), rel=0.02)


def test_a_chain_dragged_over_a_floor_pulls_with_its_friction():
    """Coulomb: mu w L at v / sqrt(v^2 + v_s^2) of the slip."""
    length, speed = 40.0, 0.5
    rig = chain(length, 20, 0.01, held={0: "r"})
    rig.place(np.column_stack((-rig.arc, 0.0 * rig.arc, 0.0 * rig.arc - 0.01)), np.tile((-1.0, 0.0, 0.0), (21, 1)))

    def motion(t):
        out = np.zeros((len(t), 1, 9))
        out[:, 0, 0] = np.where(t < 2.0, 0.25 * speed * t * t, speed * (t - 1.0))
        out[:, 0, 3], out[:, 0, 6] = speed * np.clip(0.5 * t, 0.0, 1.0), np.where(t < 2.0, 0.5 * speed, 0.0)
        out[:, 0, 2] = -0.01
        return out

    history = rig.run(20.0, 0.02, moved=(0,), motion=motion, rules=HALVED)
    wanted = FRICTION * WEIGHT * length * speed / np.hypot(speed, SLIP)
    assert history.reaction[-100:, 0, 0].mean() == pytest.approx(wanted, rel=1e-4)


@pytest.mark.parametrize(
    "speed, depth", [(2.2, 100.0), pytest.param(1.0, 100.0, marks=pytest.mark.nightly), (0.3, 100.0)]
)
def test_a_tow_lies_down_and_is_dragged_along(speed, depth):
    scene = override(
        load_scene("full_scale"),
        {"ship.tow_speed": speed, "seabed.depth": depth, "setpoint.algorithm": "hold", "solver.tick": 0.05},
    )
    free = started(override(scene, {"seabed.depth": None}))
    assert free.frame.seabed_length == 0.0 and not free.frame.status & Flag.SEABED
    run = offline.run(scene, heave=(1.0, 8.0), duration=40.0)
    frames = run.frames
    assert not run.problem and (frames.status & Flag.SEABED > 0).all()
    assert -frames.body_position[:, 2] == pytest.approx(depth, abs=0.1)
    assert frames.tension[0] < free.frame.tension  # the ground bears what hung
    assert np.abs(frames.energy_residual).max() < 1e-3 * np.abs(np.diff(frames.work_supplied)).sum()
    if speed < 2.0:
        assert frames.seabed_length.min() > 50.0


def test_cable_laid_slack_under_a_ship_at_rest_is_refused_with_the_remedy():
    sim = Simulator(override(load_scene("full_scale"), {"ship.tow_speed": 0.0, "seabed.depth": 100.0}))
    with pytest.raises(StartError, match="cable that lies slack on the seabed has no one place: a ship under way"):
        sim.start()
