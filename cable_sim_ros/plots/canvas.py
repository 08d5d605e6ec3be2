"""A figure in the style of the house that is saved where it was asked for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from .run import STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@contextmanager
def canvas(path: Path, size: tuple[float, float]) -> Iterator[Figure]:
    """An empty figure of a size [inch] to draw on; it is saved at the end, its folder made. No pyplot, so no state.

    RuntimeError where matplotlib is missing.
    """
    try:
        import matplotlib
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise RuntimeError("matplotlib is not installed: no plot was drawn; install cable_sim_ros[viz]") from None
    with matplotlib.rc_context(STYLE):
        figure = Figure(figsize=size, dpi=80, facecolor="white", layout="constrained")
        figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1)  # inches: titles keep off the edge and the panel above
        FigureCanvasAgg(figure)
        yield figure
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, metadata={"Software": None} if path.suffix == ".png" else None)  # same run, same bytes
