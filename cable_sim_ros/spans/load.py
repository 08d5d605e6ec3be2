"""Span files: `span:` at the top, SI units, checked as scenes are."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from ..io.scenes import resources, yaml12
from ..io.scenes.load import SceneError
from ..io.scenes.scene_errors import CONSEQUENCE, line_of, place, texts_of
from ..sim.problem import Problem
from .span_checks import span_problems
from .span_file import Span, SpanFile

Check = Callable[[Span], list[Problem]]


def load_span(path_or_name: str | os.PathLike, check: Check = span_problems) -> Span:
    """Span of a YAML file, or of the name of a shipped one (``span_in_wind``). Raises SceneError with every problem.

    check: what finds cases that cannot be computed, in time where none is given.
    """
    try:
        path = resources.find_span(path_or_name)
        text = Path(path).read_text(encoding="utf-8")
    except (resources.ResourceError, UnicodeDecodeError, OSError) as error:
        raise SceneError([str(error) if isinstance(error, resources.ResourceError) else _unread(path, error)]) from None
    try:
        data, lines = yaml12.parse(text)
    except yaml12.YamlError as error:
        raise SceneError(
            [f"{place(str(path), line)}: {what}; {CONSEQUENCE}. Correct the YAML" for line, what in error.problems]
        ) from None
    return span_from_dict(data, str(path), lines, check)


def span_from_dict(
    data: Any, origin: str, lines: Mapping[tuple, int] | None = None, check: Check = span_problems
) -> Span:
    """Span of plain data ``{"span": {...}}``; origin and lines name places in errors. Raises SceneError."""
    if not isinstance(data, Mapping) or "span" not in data:
        raise SceneError(
            [
                f"{origin}: has no key `span`, so it is no span; {CONSEQUENCE}. Begin with a copy of a shipped one: "
                f"{', '.join(resources.shipped_spans())}; a scene of a tow is for `cable-sim run`, a file"
                " with `flow` for `cable-sim viv`: it has no wake, viscosity or axial stiffness"
            ]
        )
    try:
        span = SpanFile.model_validate(data).span
    except ValidationError as error:
        raise SceneError(texts_of(error, data, origin, lines or {}, SpanFile)) from None
    if not span.cases:
        raise SceneError([f"{origin}: span.cases has no case; {CONSEQUENCE}. Give length, tension and wind of one"])
    return checked_span(span, origin, lines, check)


def checked_span(
    span: Span, origin: str, lines: Mapping[tuple, int] | None = None, check: Check = span_problems
) -> Span:
    """The span itself where each of its cases can be a line. Raises SceneError with every problem."""
    found = check(span)
    if found:
        at = [place(origin, line_of(lines or {}, tuple(problem.key.split(".")))) for problem in found]
        raise SceneError([f"{a}: {p.key} {p.text}; {CONSEQUENCE}. {p.remedy}" for a, p in zip(at, found, strict=True)])
    return span


def known_cases(span: Span, names: Collection[str]) -> None:
    """Raises SceneError where a name is of no case."""
    unknown = [name for name in names if name not in span.cases]
    if unknown:
        text = f"case '{unknown[0]}' is not in {span.name}; nothing was run. Known: {', '.join(span.cases)}"
        raise SceneError([text])


def _unread(path: str | os.PathLike, error: OSError | UnicodeDecodeError) -> str:
    why = "is not UTF-8 text" if isinstance(error, UnicodeDecodeError) else f"cannot be read ({error.strerror})"
    return f"{path}: {why}; {CONSEQUENCE}. Check the file"
