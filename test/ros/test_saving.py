"""Save and restore of a session in lockstep, with the real simulator and without a network: back to the saved time, and
on from there bit for bit; what is refused leaves everything as it was."""

from __future__ import annotations

import json
import math
import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "io"))

from test_commands import command  # noqa: E402
from test_motion import imu, odometry  # noqa: E402

from cable_sim_ros.ros.params import settle  # noqa: E402
from cable_sim_ros.ros.stepped import SteppedSession  # noqa: E402
from cable_sim_ros.runs import offline  # noqa: E402

S = 1_000_000_000
pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="the loop calls libc from compiled code"
)


class Harness:
    """A session that stands at /clock 1 s until it is stepped; frames of its ticks."""

    def __init__(self, **parameters) -> None:
        given = {"scene": "side_scan", "solver.tick": 0.02, "time_mode": "lockstep", "lockstep.paused": True}
        self.said: list[str] = []
        self.session = SteppedSession(settle(given | parameters), lambda level, text: self.said.append(text))
        self.frames: list[np.void] = []
        self.session.publish_ticks = self._publish
        self.session.configure()
        self.session.activate()

    def _publish(self) -> None:
        loop = self.session.built_loop
        self.frames.append(loop.output.frame[(loop.count - 1) % loop.rows].copy())

    def feed(self, first: int, last: int, kind: str = "odometry", heading: float = 0.0) -> None:
        """Motion of 50 Hz from 1 s on, samples first to last; every tenth brings a command for its time."""
        for k in range(first, last):
            stamp, t = S + 20_000_000 * k, 0.02 * k
            up, rate = 0.4 * math.sin(0.9 * t), 0.36 * math.cos(0.9 * t)
            if kind == "odometry":
                angles = (0.0, 0.0, heading)
                data = odometry(stamp, (2.0 * t, 0.0, up), angles=angles, velocity=(2.0, 0.0, rate))
            else:
                data = imu(stamp, force=(0.0, 0.0, 9.81 - 0.81 * up))
            self.session.motion(kind, data, stamp)

    def order(self, rate: float) -> str:
        return self.session.command(command(self.session.steps.clock, [], [rate]), 0)

    def step(self, count: int) -> list[bytes]:
        """So many ticks; their Frames."""
        before, until = len(self.frames), time.monotonic() + 20.0
        begun, text = self.session.step(count)
        assert begun, text
        while self.session.steps_left:
            assert time.monotonic() < until, (self.session.steps.doing, self.session.problem)
            self.session.advance(time.monotonic_ns())
        return [frame.tobytes() for frame in self.frames[before:]]

    def close(self) -> None:
        self.session.close()
        self.session.built_loop.close()


@pytest.fixture
def make():
    made = []

    def make(**parameters):
        made.append(Harness(**parameters))
        return made[-1]

    yield make
    for harness in made:
        harness.close()


@pytest.mark.parametrize("kind", ["odometry", "imu"])
def test_what_goes_on_from_a_file_is_what_would_have_gone_on(make, tmp_path, kind):
    one, path = make(), tmp_path / "new" / "tow.npz"
    one.feed(0, 400, kind)
    one.step(40)
    assert one.order(0.3) == ""
    one.step(30)
    saved, text = one.session.save(path)
    assert saved and "saved at 2." in text and str(path) in text
    clock = one.session.steps.clock
    first = one.step(20)
    assert one.order(-0.2) == ""
    whole = first + one.step(60)
    other = make()  # another node, which has heard nothing yet
    for harness in (one, other):
        done, text = harness.session.restore(path)
        assert done and "the clock goes back to it" in text and harness.session.steps.clock == clock
        assert harness.session.state == "running" and harness.session.paused
        again = harness.step(20)
        assert harness.order(-0.2) == ""
        assert again + harness.step(60) == whole
    assert len({frame["payout"] for frame in one.frames}) > 30, "the commands moved the winch"
