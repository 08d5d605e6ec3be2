"""Telegrams as a part of the node: `telegrams.*`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ...ros.parts import NodePart, Status
from ...sim.scene import Scene
from .blocks import Telegrams, asked, telegram_problem

if TYPE_CHECKING:
    from ...ros.node import CableSimNode


class TelegramPart(NodePart):
    """Sends the telegrams that have a port. Raises TelegramError where one cannot be used."""

    block, doc = Telegrams, "telegrams of the instruments over UDP"

    def __init__(self, node: CableSimNode, block: Telegrams) -> None:
        from .sender import Sender

        self.sender = Sender(block, node.settings.scene, node.log)
        self.tick = self.sender.tick

    @staticmethod
    def asked(block: Telegrams) -> bool:
        """Has one of them a port?"""
        return bool(asked(block))

    @staticmethod
    def problem(block: Telegrams, scene: Scene) -> str:
        """As telegram_problem."""
        return telegram_problem(block, scene.solver.tick)

    def statuses(self) -> list[Status]:
        """The task telegrams."""
        return self.sender.statuses()

    def metrics(self) -> dict[str, Any]:
        """Counts of each, as `telegrams`."""
        return self.sender.metrics()

    def close(self) -> None:
        """Give the sockets up."""
        self.sender.close()
