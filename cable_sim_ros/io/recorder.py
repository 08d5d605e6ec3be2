"""Recording beside the real-time loop: own thread, bounded queue, a bag flushed once a second."""

from __future__ import annotations

import os
import threading
import time
from collections import deque
from typing import NamedTuple

from .bag import BagWriter

POLL = 0.05  # s; the feeding thread never wakes anyone, it only appends
FLUSH = 1.0  # s of wall time: the most a crash may cost


class RecorderStats(NamedTuple):
    """Counts of a recording: messages written, dropped (queue full or recording failed), waiting, most ever
    waiting; errors of the disk or of a message and the text of the last one ("" = none); slowest flush [s]."""

    written: int
    dropped: int
    waiting: int
    most_waiting: int
    errors: int
    error: str
    slowest_flush: float


class Recorder:
    """Records to a bag from another thread than the one that makes the messages.

    path, custom_data: see `BagWriter`; queue_size: messages that may wait, at 100 ticks a second about 6 s;
    flush_s: longest wall time that data stays in memory. The constructor raises if the bag cannot be made.
    Afterwards no call raises: a failing disk ends the recording, is counted, and the simulation goes on.
    """

    def __init__(
        self,
        path: str | os.PathLike,
        *,
        queue_size: int = 4096,
        flush_s: float = FLUSH,
        custom_data: dict[str, str] | None = None,
        poll_s: float = POLL,
    ) -> None:
        self.writer = BagWriter(path, custom_data=custom_data)
        self.queue_size, self.flush_s, self.poll_s = queue_size, flush_s, poll_s
        self._queue: deque = deque()
        self._declared: deque = deque()
        self._lock = threading.Lock()  # held for an append or a swap of the queue only
        self._stop = threading.Event()
        self._failed = False
        self._written = self._dropped = self._most = self._errors = 0
        self._error, self._slowest = "", 0.0
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def declare(self, topic: str, msgtype: str, qos: str = "") -> None:
        """Register a topic with its QoS before its first `put`; see `BagWriter.declare`."""
        with self._lock:
            self._declared.append((topic, msgtype, qos))  # only the recording thread touches the writer

    def put(self, topic: str, msgtype: str, time_ns: int, data: bytes, publish_time_ns: int | None = None) -> None:
        """Queue one message and return at once; when the queue is full the oldest one is dropped and counted."""
        with self._lock:
            if self._failed or self._stop.is_set():
                self._dropped += 1
                return
            if len(self._queue) >= self.queue_size:
                self._queue.popleft()
                self._dropped += 1
            self._queue.append((topic, msgtype, time_ns, data, publish_time_ns))
            self._most = max(self._most, len(self._queue))

    def stats(self) -> RecorderStats:
        """Counts so far; may be called from any thread."""
        with self._lock:
            return RecorderStats(
                self._written, self._dropped, len(self._queue), self._most, self._errors, self._error, self._slowest
            )

    def close(self, timeout: float = 10.0) -> RecorderStats:
        """Write what waits, finish the bag and return the final counts; a second call only returns them."""
        with self._lock:
            self._stop.set()
        self._thread.join(timeout)
        if self._thread.is_alive():
            with self._lock:
                self._error = f"the disk did not take the last messages within {timeout:g} s"
                self._errors += 1
        return self.stats()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def _run(self) -> None:
        flushed = time.monotonic()
        try:
            while True:
                stopping = self._stop.wait(self.poll_s)
                with self._lock:
                    batch, self._queue = self._queue, deque()
                self._write(batch)
                now = time.monotonic()
                if now - flushed >= self.flush_s:
                    self.writer.flush()
                    flushed = time.monotonic()
                    self._slowest = max(self._slowest, flushed - now)
                if stopping:
                    self.writer.close()
                    return
        except Exception as error:  # nobody else would see it: a thread that dies silently loses the recording
            with self._lock:
                self._failed = True
                self._errors += 1
                self._dropped += len(self._queue)
                self._queue.clear()
                self._error = (
                    f"recording to '{self.writer.path}' ended ({type(error).__name__}: {error}): "
                    f"the simulation goes on unrecorded; free the disk, recover this bag, record anew"
                )
            self.writer.abort()

    def _write(self, batch: deque) -> None:
        while self._declared:
            try:
                self.writer.declare(*self._declared.popleft())
            except ValueError as error:  # a type nobody knows: its messages will be refused one by one
                with self._lock:
                    self._errors += 1
                    self._error = str(error)
        while batch:
            item = batch.popleft()
            try:
                self.writer.add(*item)
            except ValueError as error:  # one bad message, not a bad disk
                with self._lock:
                    self._errors += 1
                    self._dropped += 1
                    self._error = str(error)
            except BaseException:
                with self._lock:
                    self._dropped += len(batch) + 1
                raise
            else:
                self._written += 1
