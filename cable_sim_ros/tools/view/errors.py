"""What ends `cable-sim view` and `film`: input that cannot be shown (code 2), or a page that cannot be served (1)."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

from ...errors import CableSimError, RunError


class ViewError(CableSimError, ValueError):
    """What was given cannot be drawn; the text says why and what to give."""


class PageError(RunError):
    """What was given is right, but no page or film came of it."""


def need(module: str, what: str, package: str | None = None) -> ModuleType:
    """A module of the extra `view`; ViewError in one line where it is missing. package: its name where it differs."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ViewError(
            f"{what} needs {package or module}, which cannot be imported ({error}); nothing was drawn. "
            f"Install it: pip install 'cable_sim_ros[view]'"
        ) from None
