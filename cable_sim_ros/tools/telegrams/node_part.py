"""Telegrams as a part of the node: `telegrams.*`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...sim.scene import Scene
from .blocks import Telegrams, asked, telegram_problem
from .sender import Sender

if TYPE_CHECKING:
    from ...ros.node import CableSimNode


class TelegramPart(Sender):
    """Sends the telegrams that have a port. Raises TelegramError where one cannot be used."""

    block, doc = Telegrams, "telegrams of the instruments over UDP"

    def __init__(self, node: CableSimNode, block: Telegrams) -> None:
        super().__init__(block, node.settings.scene, node.log)

    @staticmethod
    def asked(block: Telegrams) -> bool:
        """Has one of them a port?"""
        return bool(asked(block))

    @staticmethod
    def problem(block: Telegrams, scene: Scene) -> str:
        """As telegram_problem."""
        return telegram_problem(block, scene.solver.tick)
