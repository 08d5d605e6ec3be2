"""Tick outputs as they come from `sim/health`, kept and handed out as one array."""

from __future__ import annotations

import threading

import numpy as np

from ..io.messages.channels import decode_frames
from ..physics.tick_output import TICK_OUTPUT

EMPTY = np.zeros(0, TICK_OUTPUT).view(np.recarray)


class FrameBox:
    """Collects messages in one thread, gives arrays in another."""

    def __init__(self) -> None:
        self._fresh: list[bytes] = []
        self._frames: np.recarray = EMPTY
        self.count = 0
        self.changed = threading.Condition()

    def put(self, data: bytes) -> None:
        """One message of `sim/health` as CDR bytes."""
        with self.changed:
            self._fresh.append(data)
            self.count += 1
            self.changed.notify_all()

    @property
    def frames(self) -> np.recarray:
        """Every tick output so far, in order: recarray of TICK_OUTPUT [n], read-only."""
        with self.changed:
            fresh, self._fresh = self._fresh, []
        if fresh:
            self._frames = np.concatenate([self._frames, decode_frames(fresh)]).view(np.recarray)
            self._frames.flags.writeable = False
        return self._frames

    @property
    def missing(self) -> int:
        """Ticks between the first and the last tick output that were not heard; a reset begins anew."""
        steps = np.diff(self.frames["tick"])
        return int((steps[steps > 1] - 1).sum())
