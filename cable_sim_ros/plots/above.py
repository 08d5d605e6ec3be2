"""The tow from above, where the ship turns: tracks of sheave and towbody, and the cable between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..io.recordings.recorded_run import RecordedRun
from .side import BLUE, FAINT, INK, ORANGE, fit, put_note

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POINTS = 2000  # of a track
CABLES = 8  # that are drawn, the last one at the end of the run


def from_above(axes: Axes, run: RecordedRun) -> None:
    """Tracks in odom from where the sheave begins, north up, with the cable at even times."""
    frames, begin = run.frames, run.frames["sheave_position"][0, :2]
    axes.set_title("From above")
    axes.set_xlabel("east of the beginning [m]")
    axes.set_ylabel("north [m]")
    tracks = [frames[name][:, :2] - begin for name in ("sheave_position", "body_position")]
    for track, name, color in zip(tracks, ("sheave", "towbody"), (BLUE, ORANGE), strict=True):
        axes.plot(*track[:: max(1, len(track) // POINTS)].T, color=color, lw=1.8, label=f"track of the {name}")
    shown = sorted({int(k) for k in np.linspace(0, len(run.shapes) - 1, CABLES)}) if run.shapes else []
    for k in shown:
        last = k == shown[-1]
        axes.plot(*(run.shapes[k][1][:, :2] - begin).T, color=INK if last else FAINT, lw=2.2 if last else 0.9, zorder=3)
    axes.plot([], [], color=INK, lw=2.2, label="cable at the end")
    for track, mark, color in zip(tracks, ("o", "D"), (INK, ORANGE), strict=True):
        axes.plot(*track[-1], mark, color=color, mfc="white" if mark == "o" else color, ms=7, mew=2, zorder=4)
    put_note(axes, fit(axes, np.vstack(tracks))[1])
    axes.legend(loc="best", handlelength=1.6)
