"""Telegrams as a part of the node, `telegrams.*`: sent over UDP to this host, when tick outputs come, on a grid of
simulation time. No rclpy here.
"""

from __future__ import annotations

import socket
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...ros.parts import OK, WARN, NodePart, Status
from ...sim.scene import Scene
from .blocks import Telegrams, address_of, asked, form_of, telegram_problem
from .fields import TelegramError, Withheld
from .sources import FORMATS, Reader, due

if TYPE_CHECKING:
    from ...ros.node import CableSimNode

RECENT = 1.05  # s that a telegram withheld is a warning


class Link:
    """One kind of telegram and its socket."""

    def __init__(self, name: str, part: Any, scene: Scene, address: str) -> None:
        self.name, self.port, self.rate = name, part.port, part.rate
        self.reader, self.encode, self.form = Reader(name, scene), FORMATS[name].encode, form_of(part)
        self.period = round(1e9 / part.rate)  # ns
        self.sent = self.withheld = self.missed = self.unheard = self.failed = 0
        self.heard = True  # as far as the newest telegram tells
        self.why, self.when = "", -1e9  # newest trouble, and when [s]
        self.newest = b""
        version = socket.AF_INET6 if ":" in address else socket.AF_INET
        self.socket = socket.socket(version, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.socket.connect((address, part.port))  # so that the kernel says where nobody listens

    def send(self, row, before, slots: int) -> None:
        """One telegram of a tick output; slots: how many were due since the one before."""
        self.missed += slots - 1
        try:
            telegram = self.encode(self.reader.read(row, before), self.form)
        except Withheld as error:
            self.withheld += 1
            self._trouble(f"withheld: {error}")
            return
        try:
            try:
                self.socket.send(telegram)
                self.heard = True
            except ConnectionRefusedError:  # says so of the telegram before, and this one has not gone
                self.heard = False
                self.unheard += 1
                self.socket.send(telegram)
        except OSError as error:
            self.failed += 1
            self._trouble(f"not sent: {error.strerror}")
            return
        self.sent += 1
        self.newest = telegram

    def _trouble(self, why: str) -> None:
        self.why, self.when = why, time.monotonic()

    def counts(self) -> dict[str, int]:
        return {name: getattr(self, name) for name in ("sent", "withheld", "missed", "unheard", "failed")}


class Sender(NodePart):
    """The telegrams that are on; `tick` in the thread that has the tick outputs, the rest in any."""

    block, doc = Telegrams, "telegrams of the instruments over UDP"

    def __init__(self, node: CableSimNode, block: Telegrams) -> None:
        """The log of the node hears where each telegram goes. Raises TelegramError where a port cannot be used."""
        scene = node.settings.scene
        self.links: list[Link] = []
        self._address, self._tick = block.address, round(1e9 * scene.solver.tick)
        self._before: Any = None
        for name, part in asked(block).items():
            try:
                self.links.append(Link(name, part, scene, block.address))
            except OSError as error:
                self._refuse(name, part.port, f"{block.address} cannot be sent to ({error.strerror})")
            if others := other_senders(self.links[-1].socket):
                self._refuse(name, part.port, f"{others} other socket{'s' * (others > 1)} of this host sends to it")
        for link in self.links:
            target = f"{block.address} port {link.port}"
            node.log("info", f"telegrams {link.name} to {target}, {link.rate:g} Hz: {link.reader.said}")

    @staticmethod
    def asked(block: Telegrams) -> bool:
        """Has one of them a port?"""
        return bool(asked(block))

    @staticmethod
    def problem(block: Telegrams, scene: Scene) -> str:
        """As telegram_problem."""
        return telegram_problem(block, scene.solver.tick)

    def _refuse(self, name: str, port: int, why: str) -> None:
        self.close()
        raise TelegramError(
            f"parameter 'telegrams.{name}.port' = {port}: {why}; nothing was started. Give another port, or end the "
            f"other sender"
        )

    def tick(self, row) -> None:
        """Send what is due at a tick output; the caller leaves it unchanged."""
        before, self._before = self._before, row
        now = int(row["time"])
        last = now - self._tick
        if before is not None and int(row["tick"]) > int(before["tick"]):
            skipped = (int(row["tick"]) - int(before["tick"])) * self._tick
            if now - int(before["time"]) == skipped:  # ticks that were not published
                last = now - skipped
        for link in self.links:
            link.reader.notice(row)
            if slots := due(now, last, link.period):
                link.send(row, before, slots)

    def statuses(self) -> list[Status]:
        """The task of /diagnostics; none where no telegram is on."""
        if not self.links:
            return []
        values: dict[str, str] = {}
        troubles, words = [], []
        for link in self.links:
            values |= {f"{link.name}_{name}": str(count) for name, count in link.counts().items()}
            values[f"{link.name}_port"], values[f"{link.name}_rate_hz"] = str(link.port), f"{link.rate:g}"
            values[f"{link.name}_source"] = link.reader.said
            values[f"{link.name}_newest"] = link.newest.decode("ascii").strip("\r\n\x01") or "-"
            if time.monotonic() - link.when < RECENT:
                troubles.append(f"{link.name} {link.why}")
            silent = "" if link.heard else f", nobody listens on {self._address} port {link.port}"
            words.append(f"{link.name}: {link.sent} sent{silent}")
        if troubles:
            return [Status("telegrams", WARN, "; ".join(troubles), values)]
        return [Status("telegrams", OK, "; ".join(words), values)]

    def metrics(self) -> dict[str, dict[str, dict[str, int]]]:
        """Counts of each, as `telegrams`; nothing where none is on."""
        return {"telegrams": {link.name: link.counts() for link in self.links}} if self.links else {}

    def close(self) -> None:
        """Give the sockets up."""
        for link in self.links:
            link.socket.close()


def other_senders(ours: socket.socket) -> int:
    """How many other sockets of this host are connected to where ours is, as far as the kernel lists them."""
    own = ours.getsockname()[1]
    host, port = ours.getpeername()[:2]
    packed = address_of(host)
    assert packed is not None, host
    words = [packed.packed[k : k + 4][::-1].hex().upper() for k in range(0, len(packed.packed), 4)]
    wanted = f"{''.join(words)}:{port:04X}"
    try:
        lines = Path("/proc/net/udp6" if ":" in host else "/proc/net/udp").read_text("ascii").splitlines()[1:]
    except OSError:
        return 0
    rows = [line.split() for line in lines]
    return sum(row[2] == wanted and int(row[1].rpartition(":")[2], 16) != own for row in rows)
