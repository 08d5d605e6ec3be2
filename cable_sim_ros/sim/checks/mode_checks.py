"""Modes that a drive cannot serve: those of a scene, and those given while it runs."""

from __future__ import annotations

from collections.abc import Iterator

from ...physics.winch_drive import DriveModel, WinchMode
from ..problem import Problem
from ..scene import Scene

PULLS = (WinchMode.TENSION, WinchMode.RENDER)
BRAKES = (WinchMode.BRAKE, WinchMode.EMERGENCY_STOP)


def mode_problems(scene: Scene) -> Iterator[Problem]:
    """A mode, set pull or time-out that the drive cannot serve: asked of one that is given while it runs, too."""
    drive = scene.drive
    if drive.dead_time >= scene.winch.command_timeout:
        yield Problem(
            "drive.dead_time",
            f"= {drive.dead_time:g} s is not below winch.command_timeout = {scene.winch.command_timeout:g} s: a stream "
            "of commands would be stale before it moves the drum",
            "Make it shorter, or the time-out longer",
        )
    if drive.mode is not WinchMode.FOLLOW and drive.model is not DriveModel.MOTOR:
        yield Problem(
            "drive.mode",
            f"= {drive.mode.value} needs a motor and a brake, but drive.model = {drive.model.value} has none",
            "Give drive.model: motor with inertia, curve and brake, or drive.mode: follow",
        )
    elif drive.mode in PULLS and drive.set_pull <= 0.0:
        yield Problem(
            "drive.set_pull",
            f"= 0 N, but drive.mode = {drive.mode.value} pulls with it: the cable would run off the drum",
            "Give the pull at the drum that is to be kept, in N",
        )
    elif drive.mode in PULLS and drive.set_pull > max(drive.curve_pull, default=drive.set_pull):
        yield Problem(
            "drive.set_pull",
            f"= {drive.set_pull:g} N is more than the {max(drive.curve_pull):g} N that the motor pulls at most "
            f"(drive.curve_pull): drive.mode = {drive.mode.value} would never come to it",
            "Give less, or a stronger motor",
        )
    elif drive.mode in BRAKES and drive.brake_pull <= 0.0:
        yield Problem(
            "drive.brake_pull",
            f"= 0 N, but drive.mode = {drive.mode.value} hands the cable to the brake: it would run off the drum",
            "Give the pull at the drum that the set brake holds, in N",
        )
