"""Several experiments at once: those that hand out their own runs, and the others whole, over the same processes."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from . import Result, hands_out, run
from .workers import workers


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
