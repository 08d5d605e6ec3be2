"""Recordings of a running node: where they go, what they say of themselves, and their end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from .. import __version__
from ..io.bag_writer import BagError
from ..io.load import dump_scene
from ..io.recorder import Recorder, RecorderStats
from ..io.recording_place import Names, name_problem, root_problem
from .params import Settings

MEGABYTE = 1_000_000


class RecordingControl:
    """At most one Recorder at a time; `recorder` is None while nothing is recorded."""

    def __init__(self, settings: Settings, namespace: str) -> None:
        self.settings = settings
        self._about = {
            "scene": settings.scene.name,
            "scene_yaml": dump_scene(settings.scene),
            "cable_sim_ros": __version__,
            "namespace": namespace,
            "node": settings.node.model_dump_json(),
        }
        self.wanted = settings.node.recording.path
        self.names = Names(settings.node.recording.root)
        self.path: Path | None = None
        self.recorder: Recorder | None = None
        self._closing: Recorder | None = None
        self._last: RecorderStats | None = None

    def start(self, finish: Callable[[], object]) -> str:
        """Begin a recording; returns "" or why there is none. finish(): ends one that has ended by itself."""
        if self.recorder is not None:
            ended = self.recorder.stats().ended
            if not ended:
                return f"already recording to {self.path}"
            finish()
        if self._closing is not None and self._closing.alive:
            return f"no recording: the disk has not taken all of {self.path} yet; try again"
        block = self.settings.node.recording
        least_free = round(block.least_free * MEGABYTE)
        problem = name_problem("recording.path", self.wanted) or root_problem("recording.root", block.root, least_free)
        if problem:
            return f"no recording: {problem}"
        path = self.names.next(self.wanted)
        try:
            self.recorder = Recorder(path, custom_data=self._about, least_free=least_free)
        except (BagError, OSError) as error:
            return f"no recording: {error}"
        self.names.made()
        self.path = path
        return ""

    def stop(self, timeout: float = 10.0) -> RecorderStats | None:
        """Finish the recording; its counts, None when there was none.

        timeout: s to wait for the disk, which goes on writing behind it.
        """
        recorder, self.recorder = self.recorder, None
        if recorder is None:
            return None
        self._last, self._closing = recorder.close(timeout), recorder
        return self._last

    def stats(self) -> RecorderStats | None:
        """Counts of this recording or of the last one."""
        return self.recorder.stats() if self.recorder is not None else self._last
