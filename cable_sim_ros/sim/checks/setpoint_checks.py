"""Checks of feed-forward and prediction: a drive that has no inverse, options that act on nothing."""

from __future__ import annotations

from collections.abc import Iterator

from ...physics.heave_compensation import SetpointLaw
from ...physics.winch_drive import DriveModel
from ..compensation_setup import horizon
from ..problem import Problem
from ..scene import Scene

WITHOUT = (SetpointLaw.HOLD, SetpointLaw.CONSTANT_TENSION)  # laws that ask for nothing that the ship's motion gives


def feed_forward_problems(scene: Scene) -> Iterator[Problem]:
    """A drive that cannot be inverted: what is asked of a feed-forward that is set while it runs, too."""
    servo = scene.drive.model is DriveModel.SERVO
    if scene.setpoint.feed_forward and servo and scene.winch.derivative_gain <= 0.0:
        yield Problem(
            "setpoint.feed_forward",
            "= true inverts the servo, but winch.derivative_gain = 0 1/s: without it the servo swings by itself and "
            "its inverse needs the set-point's acceleration at once",
            "Give winch.derivative_gain above 0 1/s, or leave the feed-forward out",
        )


def setpoint_option_warnings(scene: Scene) -> Iterator[Problem]:
    """Options of the laws that act on nothing."""
    block = scene.setpoint
    for key in ("feed_forward", "prediction"):
        if getattr(block, key) and block.algorithm in WITHOUT:
            yield Problem(
                f"setpoint.{key}",
                f"= true has no effect with setpoint.algorithm = {block.algorithm.value}, which asks for nothing "
                "that follows from the ship's motion",
                "Take one of the sheave laws, or leave it out",
            )
    if block.prediction and horizon(scene) == 0.0:
        by = "drive.dead_time" if block.horizon is None else "setpoint.horizon"
        yield Problem(
            "setpoint.prediction",
            f"= true has no effect: {by} = 0 s, there is nothing to look ahead to",
            "Give setpoint.horizon or drive.dead_time in s, or leave it out",
        )
