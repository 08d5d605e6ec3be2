"""`towbody/fix` as a part of the node: `fix.*`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...ros.parts import NodePart
from ...sim.scene import Scene
from .blocks import Fix, fix_problem

if TYPE_CHECKING:
    from ...ros.node import CableSimNode


class TowbodyFix(NodePart):
    """Publishes the fixes where it is said where odom begins."""

    block, doc = Fix, "latitude and longitude of the towbody"

    def __init__(self, node: CableSimNode, block: Fix) -> None:
        from .fixes import Fixes

        self.statuses = Fixes(node, block).statuses  # type: ignore[method-assign]

    @staticmethod
    def asked(block: Fix) -> bool:
        """Is it said where odom begins?"""
        return block.latitude is not None

    @staticmethod
    def problem(block: Fix, scene: Scene) -> str:
        """As fix_problem."""
        return fix_problem(block)
