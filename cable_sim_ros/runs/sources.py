"""Where a run takes its ship motion from (a bag, a table, a sinusoidal heave), and a replay its scene."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ..io.bags.bag_writer import BagError
from ..io.scenes.load import load_scene, override, scene_from_text
from ..io.scenes.resources import find_bag
from ..io.sources.coarse_bag import smooth_odometry
from ..io.sources.motion_table import MotionError, read_table, sine_heave
from ..io.sources.recorded_tow import RecordedTow, read_tow
from ..sim.scene import Scene
from . import motion_preview
from .settings import NOTHING, Settings, apply_to_bag, apply_to_scene, recorded_intake, refuse_without_bag

HEAVE_SECONDS = 60.0  # s of a run under a sinusoidal heave where no duration is given


def motion_of(
    scene: Scene,
    motion: str | os.PathLike | None,
    heave: tuple[float, float] | None,
    duration: float | None,
    imu_only: bool,
    settings: Settings = NOTHING,
    topics: Mapping[str, str] = NOTHING,
) -> RecordedTow | None:
    """Messages of the ship's motion, whatever they come from."""
    table = motion if motion is not None and Path(motion).suffix.lower() == ".csv" else None
    if heave is not None and motion is not None:
        raise MotionError(f"heave and the motion '{motion}' were both given: nothing was simulated; give one of them")
    if imu_only and (table is not None or heave is not None):
        raise MotionError(f"{motion or '--heave'} gives no IMU messages: nothing was simulated; leave --imu-only out")
    if heave is not None or table is not None or motion is None:
        refuse_without_bag(settings, topics, "a table" if table else "--heave" if heave else "none")
    if heave is not None:
        amplitude, period = heave
        return sine_heave(amplitude, period, HEAVE_SECONDS if duration is None else duration, scene.ship)
    if table is not None:
        return read_table(table, scene.ship, scene.sheave.position)
    if motion is None:
        return None
    tow = read_tow(find_bag(motion), imu_only=imu_only, topics=topics)
    apply_to_bag(tow, settings)
    motion_preview.look(tow, scene, *recorded_intake(tow))
    smooth_odometry(tow, scene.sheave.position)
    return tow


def scene_of_bag(
    tow: RecordedTow, scene: Scene | str | os.PathLike | None, algorithm: str | None, settings: Settings
) -> tuple[Scene, bool]:
    """The scene to replay, and whether the bag is to agree with it: not where it keeps another one."""
    text = tow.about.get("scene_yaml")
    kept = scene_from_text(text, f"scene kept in {tow.path}") if text else None
    if scene is None and kept is None:
        raise BagError(
            f"bag '{tow.path}' keeps no scene, so it is not known which tow it recorded: nothing was simulated; give "
            f"--scene NAME or FILE. For a run under its motion: cable-sim run SCENE --motion {tow.path}"
        )
    if scene is None:
        scene = kept
    elif not isinstance(scene, Scene):
        scene = load_scene(scene)
    assert isinstance(scene, Scene)
    scene = apply_to_scene(scene, settings)
    if algorithm is not None:
        scene = override(scene, {"setpoint.algorithm": algorithm})
    return scene, kept is None or scene == kept
