"""A figure of the house as SVG text that stands inside an HTML page: nothing from outside, names of its own."""

from __future__ import annotations

import re
from collections.abc import Callable
from io import StringIO
from typing import TYPE_CHECKING

from .run import STYLE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# text stays text: it can be read aloud, searched and scaled; the salt makes the same names for the same drawing
VECTOR = {
    "svg.hashsalt": "cable_sim_ros",
    "svg.fonttype": "none",
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.labelsize": 10,
    "xtick.labelsize": 9.5,
    "ytick.labelsize": 9.5,
    "legend.fontsize": 9.5,
    "path.simplify_threshold": 0.2,
}
NOTHING = dict.fromkeys(("Date", "Creator", "Format", "Type"))


def svg(
    name: str, size: tuple[float, float], draw: Callable[[Figure], None], layout: str | None = "constrained"
) -> str:
    """The SVG element of what ``draw`` puts on a figure of a size [inch]; name: makes its ids unlike those of others.

    RuntimeError where matplotlib is missing.
    """
    try:
        import matplotlib
        from matplotlib.backends.backend_svg import FigureCanvasSVG
        from matplotlib.figure import Figure
    except ImportError:
        raise RuntimeError("matplotlib is not installed: no plot was drawn; install cable_sim_ros[viz]") from None
    text = StringIO()
    with matplotlib.rc_context(STYLE | VECTOR):
        figure = Figure(figsize=size, facecolor="white", layout=layout)
        FigureCanvasSVG(figure)
        draw(figure)
        figure.savefig(text, format="svg", metadata=NOTHING)
    return inlined(text.getvalue(), name)


def inlined(text: str, name: str) -> str:
    """The <svg> element alone: no prolog, no namespaces, no metadata, no style for the whole page, ids with a name."""
    text = text[text.index("<svg") :].strip()
    text = re.sub(r"<metadata>.*?</metadata>|<style[^>]*>.*?</style>|<!--.*?-->", "", text, flags=re.DOTALL)
    text = re.sub(r' xmlns(:\w+)?="[^"]*"', "", text).replace("xlink:href", "href")
    text = re.sub(r'<svg [^>]*?(viewBox="[^"]*")[^>]*>', r"<svg \1>", text, count=1)
    used = set(re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', text))
    names = {one for pair in used for one in pair if one}
    text = re.sub(r' id="([^"]*)"', lambda m: f' id="{name}-{m[1]}"' if m[1] in names else "", text)
    text = re.sub(r'href="#', f'href="#{name}-', text)
    text = re.sub(r"url\(#", f"url(#{name}-", text)
    return re.sub(r"\s*\n\s*", "\n", text)
