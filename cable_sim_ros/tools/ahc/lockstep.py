"""One run of a cell with a program of rclpy at the winch: the node in lockstep, in a domain of its own."""

from __future__ import annotations

import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ...errors import NEEDS_ROS
from ...io.bags.bag_writer import BagWriter
from ...io.messages.messages import KINDS
from ...io.scenes.load import dump_scene
from ...io.sources.recorded_tow import RecordedTow
from ...runs import verdict
from ...sim.scene import Scene
from ...sim.verdict import FAILED, OK, verdict_of
from .entrants import AhcError, Entrant, words_of
from .outcome import Done

SCENE, PERIOD = "AHC_SCENE", "AHC_PERIOD"  # what the program finds in its environment: file of the scene; s


def through_topics(
    entrant: Entrant,
    scene: Scene,
    tow: RecordedTow,
    duration: float,
    period: float,
    changes: tuple[tuple[float, str, Any], ...],
    expected: tuple[str, ...],
) -> Done:
    """The run; period: of the commands [s], for which lockstep waits. Raises AhcError, TowError.

    Live changes are made by parameters of the node, between two steps.
    """
    if find_spec("rclpy") is None:
        raise AhcError(f"--command {NEEDS_ROS.format(error='it is not installed')}")
    from ...testing import tow as node

    with tempfile.TemporaryDirectory(prefix="ahc_") as folder:
        at = Path(folder)
        (at / "scene.yaml").write_text(dump_scene(scene), "utf-8")
        with BagWriter(at / "motion") as bag:
            for event in tow.events:
                msgtype, topic = KINDS[event.kind]
                bag.add(f"/tow_sim/{topic}", msgtype, event.arrival, event.data, event.time)
        with node(
            at / "scene.yaml",
            mode="lockstep",
            parameters={"lockstep.command_period": period},
            folder=at / "log",
            environment={SCENE: str(at / "scene.yaml"), PERIOD: f"{period:.9g}"},
            may_be_doubtful=True,
        ) as sim:
            sim.run(words_of(entrant), name=entrant.name)
            sim.feed(at / "motion")
            done = 0.0
            for when, key, value in changes:
                if when > done:
                    sim.advance(when - done, motion_may_end=True)
                    done = when
                sim.set(key, value)
            sim.advance(duration - done, motion_may_end=True)
            frames, missing = sim.frames.copy(), sim.missing
    if missing:
        return Done(None, FAILED, f"{missing} tick outputs were not heard")
    judged = verdict.judge(frames, scene)
    judged = verdict_of(reason for reason in judged.reasons if reason.flag not in expected)
    return Done(frames, judged.state, "" if judged.state == OK else judged.headline)
