"""A drawn figure as a file: same figure, same bytes; a PNG in 256 colours, a third of the size."""

from __future__ import annotations

import os
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = 256


def save(figure: Figure, path: str | os.PathLike) -> Path:
    """Save a figure; the suffix of ``path`` says the format. Returns the path."""
    path = Path(path)
    if path.suffix != ".png":
        figure.savefig(path)
        return path
    from PIL import Image  # matplotlib needs it too

    drawn = BytesIO()
    figure.savefig(drawn, format="png")
    with Image.open(drawn) as image:
        few = image.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
    return path
