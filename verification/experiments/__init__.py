"""Experiments of the source documents: what was measured, what the product gives, what is allowed and who says so."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from inspect import signature
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from .workers import Over, here, workers


class Comparison(NamedTuple):
    """One figure of an experiment. measured None: not printed in the source."""

    name: str
    unit: str
    ours: float
    measured: float | None
    allowed: float | None  # largest difference the source reports for its own model; None: not printed
    source: str
    why: str = ""  # what the difference comes from
    simulated: float | None = None  # what the source's own simulation gives


def unjudged(
    name: str, unit: str, ours: float, source: str, why: str = "", simulated: float | None = None
) -> Comparison:
    """A figure of ours that nothing printed stands beside."""
    return Comparison(name, unit, ours, None, None, source, why, simulated)


KEPT, MISSED, OPEN = "within", "MISSED", "nothing is allowed or measured"


def verdict_of(row: Comparison) -> str:
    """KEPT or MISSED; OPEN where the source gives no value or no difference."""
    if row.measured is None or row.allowed is None:
        return OPEN
    return KEPT if abs(row.ours - row.measured) <= row.allowed else MISSED  # of what is no number: missed


class Result(NamedTuple):
    experiment: str
    rows: list[Comparison]
    choices: list[dict]  # what had to be chosen, and what choosing otherwise changes: key "choice", then figures
    plot: Callable[[Path], Path]
    chosen: str = "chosen otherwise: what changes"  # heading of the choices
    tables: Callable[[], list[str]] | None = None  # Markdown in place of the table of all rows
    shortened: str = ""  # what --quick left out
    shown: Callable[[], list[str]] | None = None  # Markdown of its own in docs/experiments.md


# each a module of this folder with experiment(progress). One whose runs have a length takes `seconds`, by default its
# SECONDS or QUICK_SECONDS; one that can be quick takes `quick` and says in QUICK what that leaves out; one that hands
# out its runs takes `over` (workers.py)
EXPERIMENTS = (
    "pulley",
    "moving_pulley",
    "drag",
    "viv",
    "viv_tow",
    "wake",
    "segments",
    "turbulence",
    "flume",
    "full_scale",
    "convergence",
    "drive",
    "load_cell",
    "lowered",
    "layback",
    "surveys",
    "shoals",
)


def hands_out(name: str) -> bool:
    """Does an experiment hand out its runs itself? Else it is run whole."""
    return "over" in signature(module_of(name).experiment).parameters


def run(
    name: str,
    duration: float | None,
    progress: Callable[[str, float, float], None] = lambda *_: None,
    quick: bool = False,
    over: Over = here,
) -> Result:
    """Run one experiment.

    duration: s, None: its own; quick: shorter runs, fewer choices where it takes long; over: what runs are handed to.

    Raises KeyError for an unknown name.
    """
    module = module_of(name)
    takes, own = signature(module.experiment).parameters, getattr(module, "SECONDS", None)
    seconds = (getattr(module, "QUICK_SECONDS", own) if quick else own) if duration is None else duration
    options = {"seconds": seconds, "quick": quick, "over": over}
    result = module.experiment(progress, **{key: value for key, value in options.items() if key in takes})
    if not quick or "quick" not in takes:
        return result
    longer = "" if duration is None else f"; runs of {duration:g} s where it has any"
    return result._replace(shortened=module.QUICK + longer)


def module_of(name: str) -> ModuleType:
    """Module of an experiment. Raises KeyError."""
    if name not in EXPERIMENTS:
        raise KeyError(name)
    return import_module(f".{name}", __name__)


def repeat(
    names: Sequence[str],
    duration: float | None,
    progress: Callable[[str, float, float], None] = lambda *_: None,
    quick: bool = False,
    count: int = 1,
    drawn: bool = False,
) -> list[Result]:
    """Results of experiments in the order of their names; the same for any ``count`` of processes but for CPU times.

    duration: s, None: their own; drawn: pictures and pages will be wanted.

    Raises RunError where a process ends.
    """
    with workers(count) as over:
        if count == 1 or len(names) == 1:
            return [run(name, duration, progress, quick, over) for name in names]
        whole = [name for name in names if not hands_out(name)]
        sent = iter(over(sendable, [(name, duration, quick, drawn) for name in whole]))
        # these hand out runs while the others are still under way, so that no process is idle before the end
        found = {name: run(name, duration, progress, quick, over) for name in names if name not in whole}
        for k, name in enumerate(whole):
            progress(name, k, len(whole))
            found[name] = next(sent)
    return [found[name] for name in names]


def sendable(name: str, duration: float | None, quick: bool, drawn: bool) -> Result:
    """An experiment as plain values, which one process can send to another: its picture is bytes, its page text."""
    result = run(name, duration, quick=quick)
    if not drawn:
        return result._replace(plot=_undrawn, tables=None, shown=None)
    with tempfile.TemporaryDirectory(prefix="cable_sim_plot_") as folder:
        path = result.plot(Path(folder))
        plot = partial(_put, path.name, path.read_bytes())
    pages = {key: partial(list, made()) for key in ("tables", "shown") if (made := getattr(result, key))}
    return result._replace(plot=plot, **pages)


def _put(name: str, picture: bytes, folder: Path) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(picture)
    return folder / name


def _undrawn(folder: Path) -> Path:
    raise RuntimeError(f"no picture was asked for, and there is none to put into {folder}")
