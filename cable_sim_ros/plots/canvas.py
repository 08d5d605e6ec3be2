"""A figure in the style of the house that is saved where it was asked for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ..version import __version__
from .run import FAINT, STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 100
GROW = 1.25  # of the letters beside the drawing: a picture is read on a telephone too


@contextmanager
def canvas(
    path: Path, size: tuple[float, float], title: str = "", source: str = "", *, grow: float = GROW
) -> Iterator[Figure]:
    """An empty figure of a size [inch at DPI] to draw on; it is saved at the end, its folder made. No pyplot, so no
    state. title: over all panels; source: at the foot, with the version: what was simulated, and whose figures stand
    beside it; grow: of the letters. RuntimeError where matplotlib is missing.
    """
    try:
        import matplotlib
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError:
        raise RuntimeError("matplotlib is not installed: no plot was drawn; install cable_sim_ros[viz]") from None
    with matplotlib.rc_context(STYLE):
        inches = size[0] / grow, size[1] / grow
        figure = Figure(figsize=inches, dpi=grow * DPI, facecolor="white", layout="constrained")
        figure.get_layout_engine().set(w_pad=0.1, h_pad=0.1)  # inches: titles keep off the edge and the panel above
        FigureCanvasAgg(figure)
        if title:
            figure.suptitle(title, x=0.012, ha="left", size=15, weight="bold")
        if source:
            said = f"{source}; simulated by cable_sim_ros {__version__}"
            figure.supxlabel(said, x=0.012, ha="left", size=9, color=FAINT)
        yield figure
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, metadata={"Software": None} if path.suffix == ".png" else None)  # same run, same bytes
