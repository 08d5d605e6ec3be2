"""Recording beside the real-time loop: own thread, bounded queue, a bag flushed once a second."""

from __future__ import annotations

import os
import shutil
import threading
import time
from collections import deque
from heapq import merge
from typing import NamedTuple

from ..bags.bag_writer import BagWriter
from ..bags.mcap_file import size_text

POLL = 0.05  # s; the feeding thread never wakes anyone, it only appends
FLUSH = 1.0  # s of wall time: the most a crash may cost
MAX_MESSAGE = 16_000_000  # bytes of one message
QUEUE_BYTES = 64_000_000  # of messages that wait
KEPT_SIZE = 65_536  # messages that wait and are to be kept


class RecorderStats(NamedTuple):
    """Counts of a recording: messages written, dropped (queue full, too large, recording ended), waiting, most ever
    waiting; errors of the disk or of a message and the text of the last one ("" = none); slowest flush [s]; those of
    the dropped that were to be kept; why the recording ended by itself ("" = it did not). Every message that was put is
    one of written, dropped and waiting; written is what the disk has once the recording is closed."""

    written: int
    dropped: int
    waiting: int
    max_waiting: int
    errors: int
    error: str
    slowest_flush: float
    kept_dropped: int = 0
    ended: str = ""


class _Item(NamedTuple):
    number: int  # in order of put
    keep: bool
    message: tuple[str, str, int, bytes, int | None]


class Recorder:
    """Records to a bag from another thread than the one that makes the messages.

    path, custom_data: see `BagWriter`; queue_size: messages that may wait, at 100 ticks a second about 6 s;
    flush_s: longest wall time that data stays in memory; least_free: bytes of the disk below which the recording
    ends in good order. The constructor raises BagError if the bag cannot be made. Afterwards no call raises: a failing
    or full disk ends the recording, is counted, and the simulation goes on.
    """

    def __init__(
        self,
        path: str | os.PathLike,
        *,
        queue_size: int = 4096,
        flush_s: float = FLUSH,
        custom_data: dict[str, str] | None = None,
        poll_s: float = POLL,
        least_free: int = 0,
    ) -> None:
        self.writer = BagWriter(path, custom_data=custom_data)
        self.queue_size, self.flush_s, self.poll_s, self.least_free = queue_size, flush_s, poll_s, least_free
        self._queue: deque[_Item] = deque()
        self._kept: deque[_Item] = deque()
        self._bytes = {False: 0, True: 0}  # waiting, by keep
        self._declared: deque[tuple[str, str, str]] = deque()
        self._lock = threading.Lock()  # held for an append or a swap of the queue only
        self._stop = threading.Event()
        self._number = self._dropped = self._kept_dropped = self._maximum = self._errors = 0
        self._unsaved: list[bool] = []  # keep of the messages in the chunk in progress
        self._written = 0
        self._error, self._ended, self._slowest = "", "", 0.0
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def declare(self, topic: str, msgtype: str, qos: str = "") -> None:
        """Register a topic with its QoS before its first `put`; see `BagWriter.declare`."""
        with self._lock:
            self._declared.append((topic, msgtype, qos))  # only the recording thread touches the writer

    def put(
        self,
        topic: str,
        msgtype: str,
        time_ns: int,
        data: bytes,
        publish_time_ns: int | None = None,
        *,
        keep: bool = False,
    ) -> None:
        """Queue one message and return at once. When the queue is full the oldest that is not `keep` is dropped and
        counted; messages to be kept have a queue of their own, sixteen times as long, and are counted apart."""
        size = len(data)
        with self._lock:
            self._number += 1
            item = _Item(self._number, keep, (topic, msgtype, time_ns, data, publish_time_ns))
            if self._ended or self._stop.is_set():
                self._drop(item)
                return
            if size > MAX_MESSAGE:
                self._drop(item)
                self._fail(
                    f"a message of '{topic}' has {size_text(size)}, above the limit of {size_text(MAX_MESSAGE)}: "
                    f"it is not recorded; check its sender"
                )
                return
            queue, maximum = (self._kept, KEPT_SIZE) if keep else (self._queue, self.queue_size)
            while queue and (len(queue) >= maximum or self._bytes[keep] + size > QUEUE_BYTES):
                old = queue.popleft()
                self._bytes[keep] -= len(old.message[3])
                self._drop(old)
            queue.append(item)
            self._bytes[keep] += size
            self._maximum = max(self._maximum, len(self._queue) + len(self._kept))

    @property
    def alive(self) -> bool:
        """The recording thread still runs."""
        return self._thread.is_alive()

    def stats(self) -> RecorderStats:
        """Counts so far; may be called from any thread."""
        with self._lock:
            return RecorderStats(
                self._written,
                self._dropped,
                len(self._queue) + len(self._kept),
                self._maximum,
                self._errors,
                self._error,
                self._slowest,
                self._kept_dropped,
                self._ended,
            )

    def close(self, timeout: float = 10.0) -> RecorderStats:
        """Write what waits, finish the bag and return the final counts; a second call only returns them."""
        with self._lock:
            self._stop.set()
        self._thread.join(timeout)
        if self._thread.is_alive():
            with self._lock:
                self._fail(f"the disk did not take the last messages within {timeout:g} s")
        return self.stats()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    # ---- with the lock held

    def _drop(self, item: _Item) -> None:
        self._dropped += 1
        self._kept_dropped += item.keep

    def _fail(self, text: str) -> None:
        self._errors += 1
        self._error = text

    def _end(self, text: str) -> None:
        """No message is taken from here on."""
        self._ended = text
        self._fail(text)
        for item in (*self._kept, *self._queue):
            self._drop(item)
        self._kept.clear()
        self._queue.clear()

    # ---- the recording thread

    def _run(self) -> None:
        begun = flushed = time.monotonic()
        try:
            while True:
                stopping = self._stop.wait(self.poll_s)
                self._write(self._batch())
                now = time.monotonic()
                # often in the beginning: a bag of less than a second shall have something in it too
                if now - flushed >= min(self.flush_s, 0.5 * (now - begun)):
                    self.writer.flush()
                    self._saved()
                    flushed = time.monotonic()
                    self._slowest = max(self._slowest, flushed - now)
                    stopping = self._too_full() or stopping
                if stopping:
                    self.writer.close()
                    self._saved()
                    return
        except Exception as error:  # nobody else would see it: a thread that dies silently loses the recording
            self.writer.abort()
            self._saved()
            with self._lock:
                for keep in self._unsaved:  # of the chunk that the disk did not take
                    self._written -= 1
                    self._dropped += 1
                    self._kept_dropped += keep
                self._end(
                    f"recording to '{self.writer.path}' ended ({type(error).__name__}: {error}): "
                    f"the simulation goes on unrecorded; free the disk, recover this bag, record anew"
                )

    def _batch(self) -> list[_Item]:
        with self._lock:
            kept, self._kept = self._kept, deque()
            queue, self._queue = self._queue, deque()
            self._bytes = {False: 0, True: 0}
        return list(merge(kept, queue))

    def _saved(self) -> None:
        """Forget what the disk has."""
        del self._unsaved[: len(self._unsaved) - (self.writer.message_count - self.writer.safe_count)]

    def _too_full(self) -> bool:
        """True, once, when the disk has less room than is to be left."""
        if self._ended or not self.least_free:
            return False
        text = too_full(self.writer.path, self.least_free)
        if text:
            self._write(self._batch())
            with self._lock:
                self._end(f"recording to '{self.writer.path}' ended: {text}; the bag is whole, the simulation goes on")
        return bool(text)

    def _write(self, batch: list[_Item]) -> None:
        while self._declared:
            try:
                self.writer.declare(*self._declared.popleft())
            except ValueError as error:  # a type nobody knows: its messages will be refused one by one
                with self._lock:
                    self._fail(str(error))
        for number, item in enumerate(batch):
            try:
                self.writer.add(*item.message)
            except ValueError as error:  # one bad message, not a bad disk
                with self._lock:
                    self._fail(str(error))
                    self._drop(item)
            except BaseException:
                with self._lock:
                    for rest in batch[number:]:
                        self._drop(rest)
                raise
            else:
                self._unsaved.append(item.keep)
                self._written += 1
        self._saved()


def too_full(path: str | os.PathLike, minimum: int) -> str:
    """ "" or a clause that says that the disk of a path has less than `minimum` bytes free."""
    free = shutil.disk_usage(path).free
    if free >= minimum:
        return ""
    return f"{size_text(free)} of the disk are free, {size_text(minimum)} are to be left (recording.least_free)"
