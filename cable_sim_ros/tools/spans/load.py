"""Span files: `span:` at the top, SI units, checked as scenes are."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from typing import Any

from ...io.scenes import resources
from ...io.scenes.document import Document, SceneError
from ...sim.problem import Problem
from .span_checks import span_problems
from .span_file import Span, SpanFile

Check = Callable[[Span], list[Problem]]


def load_span(path_or_name: str | os.PathLike, check: Check = span_problems) -> Span:
    """Span of a YAML file, or of the name of a shipped one (``span_in_wind``). Raises SceneError with every problem.

    check: what finds cases that cannot be computed, in time where none is given.
    """
    return _spans(check).load(path_or_name).span


def span_from_dict(data: Any, origin: str, check: Check = span_problems) -> Span:
    """Span of plain data ``{"span": {...}}``; origin names it in errors. Raises SceneError with every problem."""
    return _spans(check).check(data, origin).span


def checked_span(span: Span, origin: str) -> Span:
    """The span itself where each of its cases can be a line. Raises SceneError with every problem."""
    return _spans(span_problems).checked(SpanFile(span=span), origin).span


def _spans(check: Check) -> Document[SpanFile]:
    def problems(file: SpanFile) -> list[Problem]:
        if not file.span.cases:
            return [Problem("span.cases", "has no case", "Give length, tension and wind of one")]
        return check(file.span)

    find, shipped = resources.find_span, resources.shipped_spans
    return Document(SpanFile, "a span in a wind", "span", "span: {name: mine, ...}", find, shipped, problems)


def known_cases(span: Span, names: Collection[str]) -> None:
    """Raises SceneError where a name is of no case."""
    unknown = [name for name in names if name not in span.cases]
    if unknown:
        text = f"case '{unknown[0]}' is not in {span.name}; nothing was run. Known: {', '.join(span.cases)}"
        raise SceneError([text])
