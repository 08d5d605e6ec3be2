"""Vibration of a cable from the vortices it sheds in a flow that varies along it, in the frequency domain.

Capozucca (1988), with the misprints of his equations mended (docs/viv.md). Names are imported when first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING

_FACE = {  # name -> module
    "Span": "span",
    "SpanError": "files",
    "SpanWarning": "files",
    "Vibration": "response",
    "warnings": "files",
    "load_span": "files",
    "span_from_dict": "files",
    "vibration": "response",
}
__all__ = ["Span", "SpanError", "SpanWarning", "Vibration", "warnings", "load_span", "span_from_dict", "vibration"]

if TYPE_CHECKING:
    from .files import SpanError, SpanWarning, load_span, span_from_dict, warnings
    from .response import Vibration, vibration
    from .span import Span


def __getattr__(name: str) -> object:
    """Import a name when it is first used."""
    if name not in _FACE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(_FACE)}")
    value = globals()[name] = getattr(import_module(f"{__name__}.{_FACE[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_FACE})
