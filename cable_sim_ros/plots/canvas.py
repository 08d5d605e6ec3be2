"""A figure in the style of the house that is saved where it was asked for."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ..version import __version__
from .run import FAINT, STYLE, save

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 100
LETTER, FOOT = 0.16, 0.3  # inches: a letter of the title, the line of the source
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
            wide = textwrap.fill(title, int(inches[0] / LETTER)).replace("$", r"\$")  # a name is no formula
            figure.suptitle(wide, x=0.012, ha="left", size=15, weight="bold")
        foot = FOOT / inches[1] if source else 0.0
        figure.get_layout_engine().set(rect=(0.0, foot, 1.0, 1.0 - foot))
        if source:
            said = f"{source}; simulated by cable_sim_ros {__version__}"
            figure.text(0.012, 0.2 * foot, said, ha="left", va="bottom", size=9, color=FAINT)
        yield figure
        _legends(figure, foot)
        path.parent.mkdir(parents=True, exist_ok=True)
        save(figure, path)


def _legends(figure: Figure, foot: float) -> None:
    """Put the legends of the figure above its source, and the panels above them; foot: height of the source."""
    if not figure.legends:  # a drawing without one may have a layout of its own
        return
    renderer = figure.canvas.get_renderer()
    low = foot
    for legend in figure.legends:
        legend.set_in_layout(False)  # the layout leaves no room for one that is moved
        legend.set_bbox_to_anchor((0.0, low, 1.0, 1.0 - low), transform=figure.transFigure)
        low += legend.get_window_extent(renderer).height / figure.bbox.height + 0.01
    figure.get_layout_engine().set(rect=(0.0, low, 1.0, 1.0 - low))
