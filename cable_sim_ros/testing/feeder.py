"""Sends motion as sensors would: at the pace of the wall clock, or in lockstep as /clock comes to its stamps."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable, Sequence

from ..io.messages.messages import Event
from .motion import SECOND

AHEAD = SECOND // 50  # ns from now to the first message in real time


class Feeder:
    """A queue of messages; `send(message)` is called when each is due."""

    def __init__(self, send: Callable[[Event], None], lockstep: bool) -> None:
        self._send, self.lockstep = send, lockstep
        self._queue: deque[Event] = deque()
        self._changed = threading.Condition()
        self._now: int | None = None  # what /clock said last, ns
        self._closed = self._sending = False
        self.end: int | None = None  # stamp of the last message that was given, ns
        self.sent = 0
        self.kinds: set[str] = set()  # of motion, sent
        self.failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="cable_sim_feed", daemon=True)
        self._thread.start()

    def add(self, messages: Sequence[Event], first: int | None) -> int:
        """Queue messages behind what is there; returns the stamp of the first, ns.

        first: where that stamp goes, ns; None: stamps as they are. Behind earlier messages it is never less than one
        interval after them.
        """
        stamps = [message.time for message in messages]
        with self._changed:
            if first is not None and self.end is not None and first <= self.end:
                same = [stamp for message, stamp in zip(messages, stamps) if message.kind == messages[0].kind]
                first = self.end + (same[1] - same[0] if len(same) > 1 else AHEAD)
            shift = 0 if first is None else first - stamps[0]
            self._queue.extend(message.moved(shift) if shift else message for message in messages)
            self.end = stamps[-1] + shift
            self._changed.notify_all()
        return stamps[0] + shift

    def clock(self, now: int) -> None:
        """What /clock says, ns: in lockstep, messages up to it are sent."""
        with self._changed:
            if self._now is None or now != self._now:
                self._now = now
                self._changed.notify_all()

    @property
    def waiting(self) -> int:
        """Events that have not been sent."""
        return len(self._queue)

    @property
    def idle(self) -> bool:
        """Has everything been sent that the clock has come to?"""
        with self._changed:
            due = self._queue and self._now is not None and self._queue[0].time <= self._now
            return not due and not self._sending

    def close(self) -> None:
        """Send nothing more; bounded."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join(5.0)

    def _run(self) -> None:
        try:
            while (message := self._next()) is not None:
                self._send(message)
                self.sent += 1
                if not message.is_command:
                    self.kinds.add(message.kind)
                self._sending = False
        except BaseException as error:
            self.failure = error

    def _next(self) -> Event | None:
        """The next message when it is due; None at the end."""
        with self._changed:
            while not self._closed:
                wait = None
                if self._queue:
                    due = self._queue[0].time
                    if not self.lockstep:
                        wait = (due - time.time_ns()) / SECOND
                    elif self._now is not None and due <= self._now:
                        wait = 0.0
                if wait is not None and wait <= 0.0:
                    self._sending = True
                    return self._queue.popleft()
                self._changed.wait(wait)
        return None
