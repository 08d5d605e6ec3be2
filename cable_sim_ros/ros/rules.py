"""The rules on watch of a running node: its ticks come one by one in one thread, its report is asked for in another."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np

from ..sim.rules.watch import RuleWatch, rule_watch
from ..sim.scene import Scene

PIECE = 20  # ticks that are judged together: one by one costs ten times as much


class RuleKeeper:
    """A RuleWatch that may be asked from any thread."""

    def __init__(self, watch: RuleWatch) -> None:
        self._watch = watch
        self._waiting: list[np.record] = []
        self._lock = threading.Lock()

    def add(self, frame: np.record) -> None:
        """One tick output, a copy."""
        with self._lock:
            self._waiting.append(frame)
            if len(self._waiting) >= PIECE:
                self._judge()

    def report(self) -> dict[str, Any]:
        """As `RuleWatch.report`, of every tick so far."""
        with self._lock:
            self._judge()
            return self._watch.report()

    @property
    def broken(self) -> tuple[str, ...]:
        """Rules broken, by name, up to PIECE ticks ago."""
        with self._lock:
            return self._watch.broken

    def _judge(self) -> None:
        if self._waiting:
            self._watch.add(np.array(self._waiting, self._waiting[0].dtype))
            self._waiting = []


def rule_keeper(scene: Scene) -> RuleKeeper | None:
    """The rules of a scene, None where it watches none."""
    watch = rule_watch(scene)
    return None if watch is None else RuleKeeper(watch)
