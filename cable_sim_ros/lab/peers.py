"""Other codes on the benchmark scenes, as jobs for bench.py. The lumped chain is always run, the others on request."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from . import chain

INSTALL = "not installed: pip install 'cable_sim_ros[peers]'"
CODES = ("moordyn", "mujoco", "exudyn", "cabledyn")


def installed(code: str) -> str | None:
    """Version of a peer, None where it is not installed."""
    try:
        return version(code)
    except PackageNotFoundError:
        return None


def jobs_of(scene: str, all_codes: bool) -> tuple[list[tuple[str, Any, Callable]], list[tuple[str, str]]]:
    """(code, setting, run) of what can be run on a scene, and (code, why not) of what cannot."""
    jobs: list[tuple[str, Any, Callable]] = []
    missing: list[tuple[str, str]] = []
    if scene in chain.CASES:
        run, settings = chain.CASES[scene]
        jobs += [("lumped chain", s, run) for s in settings]
    else:
        missing.append(("lumped chain", "no contact in the plain chain"))
    return jobs, missing
