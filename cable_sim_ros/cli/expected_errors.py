"""Errors that a command reports in one line: their text is the whole message. Anything else keeps its traceback."""

from __future__ import annotations

import json

from ..errors import CODE_FAILED, CODE_INPUT, CableSimError
from ..terminal import say


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
        say(json.dumps({"problem": str(error), "verdict": verdict.as_dict()}, indent=1), lines=True)
    return code
