"""Errors that a command reports in one line: their text is the whole message. Anything else keeps its traceback."""

from __future__ import annotations

from importlib import import_module

import click

from ..errors import CODE_FAILED, CODE_INPUT, NEEDS_ROS, CableSimError
from ..terminal import say
from .answer import json_of


class NoRos(click.ClickException):
    """rclpy cannot be imported."""

    exit_code = CODE_INPUT


def need_ros() -> None:
    """Refuse a command of the node where there is no ROS. Raises NoRos."""
    try:
        import_module("rclpy")
    except ImportError as error:
        raise NoRos(f"this command {NEEDS_ROS.format(error=error)}") from None


def code_of(error: BaseException) -> int | None:
    """Exit code of an expected error, None for one that is a fault of the program."""
    if isinstance(error, CableSimError):
        return error.exit_code
    return CODE_INPUT if isinstance(error, OSError) else None


def report(error: BaseException, code: int, as_json: bool) -> int:
    """Say it in one line on stderr, and with --json as the verdict of a run that failed; returns the code."""
    say(f"error: {error}", err=True, lines=getattr(error, "lines", False))
    if as_json and code == CODE_FAILED:
        from ..sim.verdict import check, verdict_of

        verdict = getattr(error, "verdict", None)  # of what is no tow
        verdict = verdict or verdict_of([check(getattr(error, "cause", CableSimError.cause), str(error))])
        say(json_of({"problem": str(error), "verdict": verdict.as_dict()}), lines=True)
    return code
