"""Pause, step, save, restore, reset and record by service, over a real network, in both time modes."""

from __future__ import annotations

import os
import time

import pytest
from conftest import poll

pytest.importorskip("rclpy")
pytestmark = [pytest.mark.ros, pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="needs real time")]


class Remote:
    """The services of one node, each answer as (success, message)."""

    def __init__(self, ears) -> None:
        self.ears = ears

    def trigger(self, name: str, within: float = 10.0) -> tuple[bool, str]:
        from std_srvs.srv import Trigger

        answer = self.ears.call(Trigger, f"cable_sim/{name}", Trigger.Request(), within)
        return answer.success, answer.message

    def set(self, name: str, data: bool) -> tuple[bool, str]:
        from std_srvs.srv import SetBool

        answer = self.ears.call(SetBool, f"cable_sim/{name}", SetBool.Request(data=data))
        return answer.success, answer.message

    def parameter(self, name: str, **value) -> str:
        from rcl_interfaces.msg import Parameter, ParameterValue
        from rcl_interfaces.srv import SetParameters

        kind = {"integer_value": 2, "string_value": 4}[next(iter(value))]
        request = SetParameters.Request(
            parameters=[Parameter(name=name, value=ParameterValue(type=kind, **value))]
        )
        return self.ears.call(SetParameters, "cable_sim/set_parameters", request).results[0].reason


def test_in_real_time_the_tow_is_saved_and_restored_and_time_does_not_stand(world):
    ears = world.ears()
    ship, remote = world.ship(ears).sail(), Remote(ears)
    root = world.folder / "states"
    node = world.node(recording__root=str(root), recording__least_free=0.0).until("running")
    assert "simulation_interfaces is not installed: its services are not offered" in node.text
    for answer in (remote.set("pause", True), remote.trigger("step")):
        assert answer[0] is False and answer[1].startswith("time_mode is realtime: the clock of the motion drives")
    missing = remote.trigger("restore")
    assert missing[0] is False and "state.npz: cannot be read (No such file or directory)" in missing[1]
    assert not root.exists() and node.state()["state"] == "running"
    saved, text = remote.trigger("save")
    assert saved and text.endswith("states/state.npz") and [path.name for path in root.iterdir()] == ["state.npz"]
    restored, text = remote.trigger("restore")
    assert restored and "it goes on at the present, and the winch holds until it is commanded" in text
    assert node.state()["state"] == "running"
    assert "not a name for a state file" in remote.parameter("state_file", string_value="../x")
    assert remote.parameter("state_file", string_value="broken") == ""
    (root / "broken.npz").write_bytes(b"x")
    refused, text = remote.trigger("restore")
    assert refused is False and "broken.npz: is no saved simulation; nothing was loaded" in text
    ship.silent = True
    assert node.stop() == 0


def test_in_lockstep_a_step_is_answered_when_it_is_done(world):
    from rosgraph_msgs.msg import Clock

    ears = world.ears()
    ship, remote = world.ship(ears), Remote(ears)
    clocks = ears.listen(Clock, "/clock")
    parameters = {"recording__root": str(world.folder), "recording__least_free": 0.0, "publish__state_rate": 0.0}
    node = world.node(time_mode="lockstep", lockstep__paused=True, lockstep__rate=0.0, **parameters).until("waiting")
    poll(lambda: clocks, 10.0, "a clock")
    refused, text = remote.trigger("save")
    assert refused is False and text == "the node is waiting: there is no tow under way; nothing was saved"

    def sail(first: int, last: int) -> None:
        for k in range(first, last):
            for message, topic in zip(ship.messages(10**9 + 20_000_000 * k, 0.02 * k), (ship.imu, ship.odom)):
                topic.publish(message)
            time.sleep(0.002)

    poll(lambda: ship.odom.get_subscription_count(), 10.0, "the node's ears")
    sail(0, 100)
    assert remote.parameter("lockstep.steps", integer_value=50) == ""
    assert remote.trigger("step") == (True, "50 of 50 ticks done")
    stood = poll(lambda: clocks[-1].clock.nanosec and clocks[-1], 5.0, "the clock after it")
    stamp = stood.clock.sec * 10**9 + stood.clock.nanosec
    saved, text = remote.trigger("save")
    assert saved, text
    assert remote.trigger("step") == (True, "50 of 50 ticks done")
    later = poll(lambda: _stamp(clocks) > stamp and _stamp(clocks), 5.0, "a later clock")
    restored, text = remote.trigger("restore")
    assert restored and text.endswith("the clock goes back to it")
    poll(lambda: _stamp(clocks) == stamp < later, 5.0, "the clock goes back")
    running, text = remote.set("pause", False)
    assert running and text.startswith("running, /clock ")
    refused, text = remote.trigger("step")
    assert refused is False and text == "it runs; pause it first, by ~/pause with data: true"
    paused, text = remote.set("pause", True)
    assert paused and text.startswith("paused, /clock ")
    assert remote.trigger("reset")[0]
    assert remote.set("record", True)[0] and "messages in" in remote.set("record", False)[1]
    assert remote.set("record", False) == (False, "nothing was recorded")
    assert node.stop() == 0


def _stamp(clocks) -> int:
    return clocks[-1].clock.sec * 10**9 + clocks[-1].clock.nanosec
