"""Recordings of a running node: where they go, what they say of themselves, and their end."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from ...io.bags.bag_writer import BagError
from ...io.recordings.journal import MSGTYPE, TOPIC, Journal
from ...io.recordings.recorder import Recorder, RecorderStats
from ...io.recordings.recording_place import Names, name_problem, root_problem
from ...io.scenes.load import dump_scene
from ...version import __version__
from ..parameters import Settings
from ..publisher import TickPublisher
from ..session import Session

MEGABYTE = 1_000_000


class RecordingControl:
    """At most one Recorder at a time; `recorder` is None while nothing is recorded."""

    def __init__(self, settings: Settings, namespace: str) -> None:
        self.settings, self.namespace = settings, namespace
        self.wanted = settings.node.recording.path
        self.names = Names(settings.node.recording.root)
        self.path: Path | None = None
        self.recorder: Recorder | None = None
        self._closing: Recorder | None = None
        self._last: RecorderStats | None = None

    def about(self) -> dict[str, str]:
        """What a recording that begins now says of itself; live parameters are in its scene as they are."""
        return {
            "scene": self.settings.scene.name,
            "scene_yaml": dump_scene(self.settings.scene),
            "cable_sim_ros": __version__,
            "namespace": self.namespace,
            "node": self.settings.node.model_dump_json(),
        }

    def begin(self, session: Session, publisher: TickPublisher | None) -> str:
        """Record a session and what its publisher has; returns "" or why there is no recording."""
        text = self.start(lambda: self.finish(session, publisher))
        recorder = self.recorder
        if not text and recorder is not None and publisher is not None:
            topic = f"{self.namespace.rstrip('/')}/{TOPIC}"

            def put(data: bytes) -> None:
                recorder.put(topic, MSGTYPE, session.record_time(), data, keep=True)

            journal = Journal(put, session.built_sim.inputs)
            publisher.record(recorder, journal)  # first: it must miss no tick
            session.record(journal)
        return text

    def finish(self, session: Session, publisher: TickPublisher | None, timeout: float = 10.0) -> RecorderStats | None:
        """End the recording with the ticks that are done; see `stop`."""
        if publisher is not None:
            publisher.end_recording()
            if publisher.rules is not None and self.recorder is not None:
                self.recorder.writer.custom_data["rules"] = json.dumps(publisher.rules.report())
        session.journal = None
        return self.stop(timeout)

    def start(self, finish: Callable[[], object] | None = None) -> str:
        """Open a recording; returns "" or why there is none. finish(): ends one that has ended by itself."""
        if self.recorder is not None:
            ended = self.recorder.stats().ended
            if not ended:
                return f"already recording to {self.path}"
            (finish or self.stop)()
        if self._closing is not None and self._closing.alive:
            return f"no recording: the disk has not taken all of {self.path} yet; try again"
        block = self.settings.node.recording
        least_free = round(block.least_free * MEGABYTE)
        problem = name_problem("recording.path", self.wanted) or root_problem("recording.root", block.root, least_free)
        if problem:
            return f"no recording: {problem}"
        path = self.names.next(self.wanted)
        try:
            self.recorder = Recorder(path, custom_data=self.about(), least_free=least_free)
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
