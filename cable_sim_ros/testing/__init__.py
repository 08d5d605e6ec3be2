"""For your own integration tests: a node in a domain of its own, fed, stepped, commanded and read. docs/testing.md.

with tow("full_scale", mode="lockstep") as sim: ...; in pytest the fixture `tow_sim`. Nothing is imported before it is
used: a pytest session that has the plugin installed and does not use it pays nothing, with or without rclpy.
"""

from importlib import import_module
from typing import TYPE_CHECKING

_FACE = {  # name -> module
    "Tow": ".tow_sim",
    "TowError": "..errors",
    "load_run": "..io.recordings.recorded_run",
    "replay": "..runs.offline",
    "tow": ".tow_sim",
}
__all__ = ["Tow", "TowError", "load_run", "replay", "tow"]

if TYPE_CHECKING:
    from ..errors import TowError
    from ..io.recordings.recorded_run import load_run
    from ..runs.offline import replay
    from .tow_sim import Tow, tow


def __getattr__(name: str) -> object:
    """Import a name of this package when it is first used."""
    if name not in _FACE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(_FACE)}")
    value = globals()[name] = getattr(import_module(_FACE[name], __name__), name)
    return value
