"""Picture of an ensemble over a recording: tension, depth and layback of the tow in their band."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...plots.canvas import canvas

OURS, BAND, MIDDLE = "#0b3c5d", "#a6c8e0", "#5c6873"


def plot(
    path: Path,
    title: str,
    seconds: np.ndarray,
    panels: list[tuple[str, np.ndarray, np.ndarray, np.ndarray, np.ndarray]],
    level: float,
) -> Path:
    """Draw it. panels: name with unit, and low, median, high, recorded over ``seconds``; level: share that the band
    holds. RuntimeError where matplotlib is missing."""
    with canvas(path, (15.0, 3.4 * len(panels)), title, "perturbed copies of the tow") as figure:
        axes = np.atleast_1d(figure.subplots(len(panels), 1, sharex=True))
        for axis, (name, low, median, high, tow) in zip(axes, panels, strict=True):
            axis.fill_between(seconds, low, high, color=BAND, label=f"band, {100.0 * level:.3g} %")
            axis.plot(seconds, median, color=MIDDLE, lw=1.0, ls="--", label="median of the copies")
            axis.plot(seconds, tow, color=OURS, lw=2.0, label="recorded")
            axis.set_ylabel(name)
        axes[0].legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
        axes[-1].set_xlabel("time [s]")
    return path
