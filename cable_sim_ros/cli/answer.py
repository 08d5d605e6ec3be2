"""The frame of a command: it returns an Answer, and what is said, written and left with is the same for all of them.

With --json the figures alone are on standard output, and what else there is to say on standard error.

Errors that a command reports in one line: their text is the whole message. Anything else keeps its traceback.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import wraps
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import click

from ..errors import CODE_FAILED, CODE_INPUT, CODE_OK, NEEDS_ROS, CableSimError
from ..files import write_text
from ..terminal import clean, plain_console, say


class Answer(NamedTuple):
    """What a command found.

    figures: for the JSON; tell: prints them for a person; kept: file for the figures; files: what else was written,
    with a word for each, None: it was not; warnings: lines for standard error; verdict: its lines; code: of the exit.
    """

    figures: Any
    tell: Callable[[], None]
    kept: Path | None = None
    files: Sequence[tuple[str, Path | None]] = ()
    warnings: Sequence[str] = ()
    verdict: Sequence[str] = ()
    code: int = CODE_OK


def answers(function: Callable[..., Answer | None]) -> Callable[..., None]:
    """A function that returns an Answer, or None where it has said all there is, as one that click calls; with --json.
    It stands below the other options."""

    @click.option("--json", "as_json", is_flag=True, help="Print the figures as JSON, nothing else.")
    @wraps(function)
    def command(as_json: bool, **given: Any) -> None:
        answer = function(**given)
        if answer is not None:
            deliver(answer, as_json)

    return command


def asks_json() -> bool:
    """Are the figures of this command to be JSON?"""
    context = click.get_current_context(silent=True)
    return context is not None and bool(context.params.get("as_json"))


def json_of(figures: Any) -> str:
    """The text of figures, on standard output and in files; what numpy counts in becomes a number."""
    return json.dumps(figures, indent=1, default=float)


def deliver(answer: Answer, quiet: bool) -> None:
    """Write, print, and leave with the code; quiet: the figures as JSON, the verdict only where it is not ok."""
    files = list(answer.files)
    if answer.kept is not None:
        write_text(answer.kept, json_of(answer.figures) + "\n")
        files.append(("figures", answer.kept))
    if quiet:
        say(json_of(answer.figures), lines=True)
    else:
        answer.tell()
    for text in answer.warnings:
        say(text, err=True)
    for what, path in files:
        if path is not None:
            say(f"{what + ':':11}{path}", err=quiet)
    leave(answer.verdict, answer.code, quiet)


def leave(verdict: Sequence[str], code: int, quiet: bool) -> None:
    """Say the lines of a verdict and leave with the code; quiet: only where it is not 0, on standard error."""
    if code or not quiet:
        for line in verdict:
            say(line, err=quiet)
    if code:
        sys.exit(code)


def drawn(*draws: Callable[[], Path]) -> list[tuple[str, Path]]:
    """Pictures, for the files of an Answer; none, with a warning, where matplotlib is not installed."""
    try:
        return [("picture", draw()) for draw in draws]
    except RuntimeError as error:
        say(f"warning: {error}", err=True)
        return []


@contextmanager
def progress_bar(unit: str = "s", quiet: bool = False) -> Iterator[Callable[[str, float, float], None]]:
    """Function (what, done, in all) that shows a bar on a terminal, else nothing; unit: of what is counted; quiet:
    show none, as with --json."""
    if quiet or asks_json() or not sys.stderr.isatty():
        yield lambda what, done, total: None
        return
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

    texts = (TextColumn(f"{{task.{name}}}", markup=False) for name in ("description", "fields[now]"))
    columns = next(texts), BarColumn(), next(texts), TimeElapsedColumn(), TimeRemainingColumn()
    with Progress(*columns, console=plain_console(err=True), transient=True) as bar:
        task = bar.add_task("loading", total=None, now="")
        yield lambda what, done, total: bar.update(
            task,
            description=clean(what),
            completed=done,
            total=total or None,
            now=f"{done:.0f} of {total:.0f} {unit}" if total else "",
        )


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
