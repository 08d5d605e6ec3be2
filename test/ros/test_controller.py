"""hold_depth.py of docs/winch.md against the real simulator through real topics."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from conftest import COMPILED, poll
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

from cable_sim_ros.ros.child import Process

pytestmark = COMPILED
SCRIPT = Path(__file__).resolve().parents[1] / "examples" / "hold_depth.py"
WITHIN = 0.1  # m


def example() -> str:
    return SCRIPT.read_text("utf-8")


def test_the_example_is_short_and_its_own():
    code = example()
    assert len(code.splitlines()) <= 41 and "cable_sim" not in code


@pytest.mark.realtime
def test_the_controller_of_the_page_brings_the_body_to_its_depth_and_its_end_is_seen(world):
    """A rosette at 100 m: 1.5 m deeper and 3 s there within 30 s; killed, the winch holds and says so."""
    ears = world.ears()
    poses, winch = ears.listen(PoseStamped, "towbody/pose"), ears.listen(JointState, "winch/state")
    ship = world.ship(ears)
    ship.amplitude, ship.speed = 0.03, 0.1
    ship.sail()
    environment = {key: value for key, value in world.environment.items() if key != "NUMBA_CACHE_DIR"}
    node = [sys.executable, "-m", "cable_sim_ros.ros.node", "--ros-args"]
    node += ["-p", "scene:=lowered_ctd", "-p", "winch.scope:=100.0", "-p", "winch.most_scope:=150.0"]
    world.processes.append(Process("node", node, world.folder / "node.log", environment))
    poll(lambda: len(poses) > 100, "a second of poses: compiling takes minutes the first time")

    def depth() -> float:
        return -poses[-1].pose.position.z

    first = depth()
    wanted = first + 1.5
    script = world.folder / "hold_depth.py"
    script.write_text(example())
    alone = {key: value for key, value in world.environment.items() if key != "PYTHONPATH"}
    command = [sys.executable, str(script), str(wanted)]
    controller = Process("controller", command, world.folder / "controller.log", alone)
    world.processes.append(controller)

    def held() -> bool:
        """Were the last three seconds at the wanted depth?"""
        return len(poses) > begun and all(abs(-p.pose.position.z - wanted) < WITHIN for p in poses[-300:])

    begun = len(poses) + 300
    poll(held, f"3 s at {wanted:.2f} m, now {depth():.2f} m\n{controller.text}", 30.0, 0.2)
    assert winch[-1].position[0] - winch[0].position[0] == pytest.approx(1.5, abs=0.3)
    values = ears.diagnostics()["command"][2]
    assert values["newest"].startswith("rate") and values["stale"] == "false" and values["lag_clock"] == "motion"
    assert abs(float(values["lag_ms"])) < 500.0 and float(values["data_clock_lead_ms"]) >= 30.0
    assert float(values["remaining_out_m"]) == pytest.approx(50.0 - 1.5, abs=0.5)

    controller.kill()
    level, text, _ = poll(
        lambda: (lambda task: task if task[2].get("stale") == "true" else None)(ears.diagnostics()["command"]),
        "the end of the controller in /diagnostics",
    )
    assert level == 1 and "older than winch.command_timeout, the winch brakes and holds" in text
