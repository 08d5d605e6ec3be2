"""Span files: `span:` at the top, SI units, checked as scenes are."""

from __future__ import annotations

import os
from typing import Any

from ...sim.problem import Problem
from ...sim.span import Span, SpanFile
from ...sim.span_checks import span_problems
from . import resources
from .document import Document


def _problems(file: SpanFile) -> list[Problem]:
    if not file.span.cases:
        return [Problem("span.cases", "has no case", "Give length, tension and wind of one")]
    return span_problems(file.span)


SPANS = Document(
    SpanFile,
    "a span in a wind",
    "span",
    "span: {name: mine, ...}",
    resources.find_span,
    resources.shipped_spans,
    _problems,
)


def load_span(path_or_name: str | os.PathLike) -> Span:
    """Span of a YAML file, or of the name of a shipped one (``span_in_wind``). Raises SceneError with every problem."""
    return SPANS.load(path_or_name).span


def span_from_dict(data: Any, origin: str) -> Span:
    """Span of plain data ``{"span": {...}}``; origin names it in errors. Raises SceneError with every problem."""
    return SPANS.check(data, origin).span


def checked_span(span: Span, origin: str) -> Span:
    """The span itself where each of its cases can be a line. Raises SceneError with every problem."""
    return SPANS.checked(SpanFile(span=span), origin).span
