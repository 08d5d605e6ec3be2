"""The ship motion of a bag as samples in Python: to look at, to change, to push into a Simulator."""

from __future__ import annotations

import os
from collections.abc import Mapping

from ..io.motion.arrival_order import Intake, Took
from ..io.scenes.load import load_scene
from ..io.sources.motion_table import MotionError
from ..physics.inputs import EPOCH, MOTION_ROWS, SOURCE, make_inputs
from ..physics.tick_output import Source
from ..sim.inputs import ShipMotion
from ..sim.scene import Scene
from ..sim.tables.attitude import body_rates
from .settings import NOTHING, Settings, recorded_intake
from .sources import motion_of


def motion_of_bag(
    bag: str | os.PathLike,
    scene: Scene | str | os.PathLike,
    *,
    imu_only: bool = False,
    settings: Settings = NOTHING,
    topics: Mapping[str, str] = NOTHING,
) -> list[ShipMotion]:
    """The samples of ship motion that a run of ``scene`` under ``bag`` takes, in order of time.

    bag: a directory, an MCAP file, the name of a shipped bag, or a CSV table; scene: whose ship it is (height, speed,
    place of the sheave); imu_only, settings, topics: as of `run`. Each sample has its stamp [ns, of the messages],
    position [m] and velocity [m/s] of base_link in odom, roll, pitch, yaw [rad] and the angular velocity in
    base_link [rad/s]; `jump` is True where the motion does not go on from the sample before. Messages that a run
    refuses have no sample.

    Raises BagError, ResourceError, SceneError, and MotionError where no message can be used or where the clock of the
    stamps jumps: there is no one order of time then.
    """
    scene = scene if isinstance(scene, Scene) else load_scene(scene)
    tow = motion_of(scene, bag, None, None, imu_only, settings, topics)
    assert tow is not None  # for motion None alone
    inputs = make_inputs()
    intake = Intake(inputs, scene, *recorded_intake(tow))
    samples: list[ShipMotion] = []
    epoch = None
    for event in tow.events:
        if event.is_command:
            continue
        before = int(inputs.motion_head[0])
        if intake.motion(event) is Took.JUMPED:
            if samples:
                raise MotionError(
                    f"{tow.path}: the stamps jump from {samples[-1].time_ns} ns to {event.time} ns: no list of samples "
                    f"was made, its time would not go up. Cut the bag there, or simulate it with run(), which takes "
                    f"the tow over the jump"
                )
            intake.jump()  # the first stamps were odd
            continue
        for k in range(before, int(inputs.motion_head[0])):
            row = inputs.motion[k % MOTION_ROWS].tolist()
            samples.append(
                ShipMotion(
                    time_ns=int(inputs.motion_time[k % MOTION_ROWS]),
                    position=tuple(row[:3]),
                    velocity=tuple(row[6:9]),
                    attitude=tuple(row[3:6]),
                    rate=body_rates(row[3], row[4], row[9:12]),
                    source=Source(int(row[SOURCE])),
                    jump=epoch is not None and row[EPOCH] != epoch,
                )
            )
            epoch = row[EPOCH]
    if not samples:
        counts = ", ".join(f"{cause} {count}" for cause, count in intake.refusals().items()) or "none came"
        raise MotionError(
            f"{tow.path}: no message of the ship's motion can be used ({counts}): there are no samples. See the causes "
            f"in docs/motion.md"
        )
    return samples
