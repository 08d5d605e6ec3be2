"""The public face: lazy names, what the Simulator takes, types for users."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

import cable_sim_ros
from cable_sim_ros.io.scenes.load import SceneError, dump_scene
from cable_sim_ros.sim import simulator

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.check


def test_importing_the_package_loads_neither_compiler_nor_ros():
    code = (
        "import sys, cable_sim_ros\nassert not {'numba', 'scipy', 'pydantic', 'rclpy', 'numpy'} & "
        "set(sys.modules)\nfrom cable_sim_ros import ShipMotion, WinchCommand\nassert not {'numba', 'rclpy'} & "
        "set(sys.modules)\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, cwd=ROOT)


@pytest.mark.parametrize("name", sorted(cable_sim_ros._FACE))
def test_every_name_leads_somewhere(name):
    assert getattr(cable_sim_ros, name).__name__ == name
    assert name in dir(cable_sim_ros) and name in cable_sim_ros.__all__


def test_another_name_is_refused_with_what_there_is():
    with pytest.raises(AttributeError, match="no attribute 'Simulater'; it has BagReader, CableSimError"):
        cable_sim_ros.Simulater  # noqa: B018


def test_the_simulator_takes_a_name_a_file_plain_data_and_a_scene():
    scene = cable_sim_ros.load_scene("full_scale")
    path = ROOT / "config" / "full_scale.yaml"
    for given in ("full_scale", path, str(path), yaml.safe_load(dump_scene(scene)), scene):
        assert cable_sim_ros.Simulator(given).scene == scene
    assert isinstance(cable_sim_ros.Simulator(scene), simulator.Simulator)


def test_plain_data_is_checked_like_a_file():
    data = yaml.safe_load(dump_scene(cable_sim_ros.load_scene("full_scale")))
    data["water"]["density"] = -1.0
    with pytest.raises(SceneError, match=r"scene given as a dict: water.density = -1.0 kg/m\^3 is outside \["):
        cable_sim_ros.Simulator(data)


@pytest.mark.parametrize("given", [None, 3])
def test_anything_else_is_no_scene(given):
    with pytest.raises(TypeError, match="expected a Scene; nothing was built. cable_sim_ros.Simulator takes the name"):
        cable_sim_ros.Simulator(given)


def test_the_simulator_of_floor_1_takes_a_scene_only():
    with pytest.raises(TypeError, match="'full_scale' is a str, expected a Scene"):
        simulator.Simulator("full_scale")


def test_types_are_declared():
    assert (ROOT / "cable_sim_ros" / "py.typed").is_file()
    assert '"py.typed"' in (ROOT / "setup.py").read_text("utf-8")


def test_motion_and_commands_reach_the_tow():
    sim = cable_sim_ros.Simulator("full_scale")
    sim.start()
    before = float(sim.frame.payout)
    sim.push(cable_sim_ros.WinchCommand(rate=0.5))
    still, ahead = (0.0, 0.0, 0.0), {"velocity": (2.2, 0.0, 0.0), "attitude": (0.0, 0.0, 0.0)}
    for k in range(2, 42):
        place = (0.022 * k, 0.0, 0.0)
        sim.push(cable_sim_ros.ShipMotion(time_ns=k * 10_000_000, position=place, rate=still, **ahead))
        frame = sim.tick()
    assert frame.payout - before == pytest.approx(0.2, abs=0.03)
    assert frame.motion_source == 1 and frame.command_age == pytest.approx(0.4, abs=0.02)


def test_the_simulator_follows_a_plan_however_it_is_cut():
    sims = [cable_sim_ros.Simulator("full_scale") for _ in range(2)]
    for sim in sims:
        sim.start(time_ns=5)
    plan = "0 hold, 0.2 rate 0.5, 0.6 hold"
    whole = sims[0].run(100, winch=plan)
    cut = [frame for n in (13, 1, 46, 40) for frame in sims[1].run(n, winch=cable_sim_ros.WinchPlan(plan))]
    assert np.array(cut).tobytes() == whole.tobytes()
    out = whole["payout_setpoint"] - whole["payout_setpoint"][0]
    assert out[19] == 0.0 and out[59] == pytest.approx(0.2 - 0.5**2 / 40.0, abs=5e-4), "taken up with 20 m/s^2"
    assert out[-1] == pytest.approx(0.2, abs=1e-9)
    assert len(sims[0].run(0, winch=plan)) == 0
