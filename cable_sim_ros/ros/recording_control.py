"""Recordings of a running node: where they go, what they say of themselves, and their end."""

from __future__ import annotations

import time
from pathlib import Path

from .. import __version__
from ..io.bag import BagError
from ..io.load import dump_scene
from ..io.recorder import Recorder, RecorderStats
from .params import Settings


class RecordingControl:
    """At most one Recorder at a time; `recorder` is None while nothing is recorded."""

    def __init__(self, settings: Settings, namespace: str) -> None:
        self.settings, self.namespace = settings, namespace
        self.wanted = settings.node.recording.path
        self.path: Path | None = None
        self.recorder: Recorder | None = None
        self._last: RecorderStats | None = None

    def start(self) -> str:
        """Begin a recording; returns "" or why there is none."""
        if self.recorder is not None:
            return f"already recording to {self.path}"
        path = Path(self.wanted or time.strftime("tow_%Y%m%d_%H%M%S"))
        number = 1
        while path.exists() and self._last is not None:  # a second recording of this run
            number += 1
            path = path.with_name(f"{Path(self.wanted or path.name).name}_{number}")
        try:
            self.recorder = Recorder(
                path,
                custom_data={
                    "scene": self.settings.scene.name,
                    "scene_yaml": dump_scene(self.settings.scene),
                    "cable_sim_ros": __version__,
                    "namespace": self.namespace,
                    "node": self.settings.node.model_dump_json(),
                },
            )
        except (BagError, OSError) as error:
            return f"no recording: {error}"
        self.path = path
        return ""

    def stop(self) -> RecorderStats | None:
        """Finish the recording; its counts, None when there was none."""
        recorder, self.recorder = self.recorder, None
        if recorder is None:
            return None
        self._last = recorder.close()
        return self._last

    def stats(self) -> RecorderStats | None:
        """Counts of this recording or of the last one."""
        return self.recorder.stats() if self.recorder is not None else self._last
