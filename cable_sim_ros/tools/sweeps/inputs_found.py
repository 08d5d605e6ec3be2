"""Motions and winch plans of a sweep, tried before anything runs: what no case can take is said at once."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

from ...errors import CableSimError
from ...io.scenes.resources import ResourceError, find_bag
from ...io.scenes.winch_plan import PlanError, WinchPlan
from ...io.sources.motion_table import HEAVE_PERIODS, read_table
from ...io.sources.recorded_tow import read_tow
from ...io.sources.sea_motion import response_of, sea_motion
from ...physics.heave_filter import Heave
from ...runs.live_changes import ChangeError
from ...runs.message_run import MessageRun
from ...sim.scene import Scene

TRIED = 1.0  # s of motion in the waves


def motion_problem(scene: Scene, kind: str, name: str, waves_vary: bool) -> str:
    """Why a bag, a table or response amplitude operators give no motion; kind: bag or rao, waves_vary: the waves of
    the scene are not those of every case. "" where they do."""
    try:
        with warnings.catch_warnings():  # a row says what is odd
            warnings.simplefilter("ignore")
            if kind == "rao":
                response_of(name, scene)
                if not waves_vary:
                    sea_motion(name, scene, TRIED)
            elif name.lower().endswith(".csv"):
                read_table(name, scene.ship, scene.sheave.position)
            else:
                tow = read_tow(find_bag(name))
                if not any(not event.is_command for event in tow.events):
                    return "holds no motion of a ship; nothing was simulated. Give a bag with odometry or IMU"
    except (CableSimError, OSError) as error:
        return str(error).replace("--rao simple: ", "").replace("--rao simple", "rao: simple")  # as a sweep has it
    return ""


def heave_problem(heave: tuple[float, float]) -> str:
    """Why amplitude and period [m, s] are none that --heave of the command line takes, "" where they are."""
    shown, most = f"= [{heave[0]:g}, {heave[1]:g}]", Heave().max_displacement
    if not 0.0 < heave[0] <= most:
        return f"{shown}: the amplitude is outside (0, {most:g}] m"
    if not HEAVE_PERIODS[0] <= heave[1] <= HEAVE_PERIODS[1]:
        return f"{shown}: the period is outside [{HEAVE_PERIODS[0]:g}, {HEAVE_PERIODS[1]:g}] s"
    return ""


def plan_problem(scene: Scene, words: str) -> str:
    """Why the winch of a scene cannot carry out a plan, "" where it can."""
    try:
        MessageRun(scene, None, winch=WinchPlan.of(words))
    except (PlanError, ChangeError) as error:
        return str(error)
    except CableSimError:  # the scene itself: a row that fails
        return ""
    return ""


def place_of(name: str | None) -> str | None:
    """A file or bag by where it lies, so that two names of it are the same; other words as they are."""
    if name is None:
        return None
    try:
        return os.fspath(find_bag(name).resolve())
    except ResourceError:
        return os.fspath(Path(name).resolve()) if Path(name).exists() else name
