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
    """A queue of messages; `send(message)` is called when each is due.

    In lockstep by the thread that says the clock, or adds what is due already; in real time by one of its own.
    """

    def __init__(self, send: Callable[[Event], None], lockstep: bool) -> None:
        self._send, self.lockstep = send, lockstep
        self._queue: deque[Event] = deque()
        self._changed = threading.Condition()  # held while something is sent: what is sent is in order
        self._now: int | None = None  # what /clock said last, ns
        self._closed = False
        self.end: int | None = None  # stamp of the last message that was given, ns
        self.sent = 0
        self.kinds: set[str] = set()  # of motion, sent
        self.failure: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="cable_sim_feed", daemon=True)
        if not lockstep:
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
            if self._now is not None:
                self._send_until(self._now, self._now)
        return stamps[0] + shift

    def clock(self, now: int, ahead: int = 0) -> None:
        """What /clock says, ns: in lockstep, messages up to it are sent, and motion up to `ahead`."""
        with self._changed:
            self._now = now
            self._send_until(now, max(now, ahead))

    @property
    def waiting(self) -> int:
        """Events that have not been sent."""
        return len(self._queue)

    def close(self) -> None:
        """Send nothing more; bounded."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread.ident is not None:
            self._thread.join(5.0)

    def _send_until(self, now: int, ahead: int) -> None:
        """What is due, in order: commands up to now, motion up to `ahead`, ns."""
        try:
            while self._queue and not self._closed and self.failure is None:
                message = self._queue[0]
                if message.time > (now if message.is_command else ahead):
                    break
                self._queue.popleft()
                self._send(message)
                self.sent += 1
                if not message.is_command:
                    self.kinds.add(message.kind)
        except BaseException as error:
            self.failure = error

    def _run(self) -> None:
        with self._changed:
            while not self._closed and self.failure is None:
                now = time.time_ns()
                self._send_until(now, now)
                self._changed.wait((self._queue[0].time - time.time_ns()) / SECOND if self._queue else None)
