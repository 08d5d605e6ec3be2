"""Vibration of a cable from the vortices it sheds in a flow that varies along it, in the frequency domain.

Capozucca (1988), with the misprints of his equations mended (docs/viv.md). Names are imported when first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING

_FACE = {  # name -> module
    "Span": "tools.spans.in_frequency.span",
    "SpanError": "tools.spans.in_frequency.files",
    "SpanWarning": "tools.spans.in_frequency.files",
    "Vibration": "tools.spans.in_frequency.response",
    "warnings": "tools.spans.in_frequency.files",
    "load_cases": "tools.spans.to_frequency",
    "load_span": "tools.spans.in_frequency.files",
    "span_from_dict": "tools.spans.in_frequency.files",
    "vibration": "tools.spans.in_frequency.response",
    "FrequencyCase": "tools.spans.to_frequency",
}
__all__ = [*_FACE]

if TYPE_CHECKING:  # each by its own name: the face of a typed package
    from .tools.spans.in_frequency.files import SpanError as SpanError
    from .tools.spans.in_frequency.files import SpanWarning as SpanWarning
    from .tools.spans.in_frequency.files import load_span as load_span
    from .tools.spans.in_frequency.files import span_from_dict as span_from_dict
    from .tools.spans.in_frequency.files import warnings as warnings
    from .tools.spans.in_frequency.response import Vibration as Vibration
    from .tools.spans.in_frequency.response import vibration as vibration
    from .tools.spans.in_frequency.span import Span as Span
    from .tools.spans.to_frequency import FrequencyCase as FrequencyCase
    from .tools.spans.to_frequency import load_cases as load_cases


def __getattr__(name: str) -> object:
    """Import a name when it is first used."""
    if name not in _FACE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(_FACE)}")
    value = globals()[name] = getattr(import_module(f"{__package__}.{_FACE[name]}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_FACE})
