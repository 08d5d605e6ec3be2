"""A drawn figure as a file: same figure, same bytes; a PNG in 256 colours, a third of the size."""

from __future__ import annotations

import os
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..files import place

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL import Image

COLOURS, EXACT = 256, 128  # of a picture, and how many of them are its commonest ones as they are


def save(figure: Figure, path: str | os.PathLike) -> Path:
    """Save a figure; the suffix of ``path`` says the format. Returns the path."""
    path = place(path)
    if path.suffix != ".png":
        figure.savefig(path)
        return path
    from PIL import Image as images  # matplotlib needs it too

    drawn = BytesIO()
    figure.savefig(drawn, format="png")
    with images.open(drawn) as image:
        picture = image.convert("RGB")
    few(picture).save(path, optimize=True)
    return path


def few(picture: Image.Image) -> Image.Image:
    """A picture in COLOURS colours: its commonest ones to the bit, so that grey stays grey, and others over the scales
    of colours that it has; each pixel takes the nearest."""
    from PIL import Image

    spread = picture.quantize(COLOURS - EXACT, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).getpalette() or []
    pixels = np.asarray(picture).astype(np.int64)
    packed = (pixels[..., 0] << 16 | pixels[..., 1] << 8 | pixels[..., 2]).ravel()
    found, which, counts = np.unique(packed, return_inverse=True, return_counts=True)
    colours = np.stack([found >> 16, found >> 8 & 255, found & 255], axis=1)
    common = colours[np.argsort(-counts, kind="stable")[:EXACT]]
    palette = np.vstack([common, np.reshape(spread[: 3 * (COLOURS - EXACT)], (-1, 3))])
    nearest = np.empty(len(found), np.uint8)
    for k in range(0, len(found), 4096):
        gap = ((colours[k : k + 4096, None, :] - palette) ** 2).sum(axis=2)
        nearest[k : k + 4096] = gap.argmin(axis=1)
    made = Image.fromarray(nearest[which].reshape(pixels.shape[:2]), "P")
    made.putpalette(palette.astype(np.uint8).ravel().tolist())
    return made
