"""`towbody/fix` as a part of the node: `fix.*`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...io.geodesy import FARTHEST
from ...physics.parameter import Block, choice, quantity
from ...ros.parts import NodePart, Status
from ...sim.scene import Scene
from ..ensemble.limits import Ranges

if TYPE_CHECKING:
    from ...ros.node import CableSimNode

TOPIC = "towbody/fix"


class Fix(Block):
    """Where `odom` begins, and what is not known of the tow."""

    latitude: float | None = quantity(
        None, "deg", -FARTHEST, FARTHEST, "of the origin of odom, WGS 84; none: no towbody/fix"
    )
    longitude: float | None = quantity(None, "deg", -180.0, 180.0, "of the origin of odom, WGS 84")
    surface: float | None = quantity(
        None, "m", -120.0, 120.0, "height of the mean water surface above the ellipsoid; none: the fix has no altitude"
    )
    rate: float = quantity(1.0, "Hz", 0.1, 20.0, "rate of towbody/fix, in wall time")
    ranges: Ranges = choice(Ranges(), "half-widths of 95 % that its covariance comes from")


class TowbodyFix(NodePart):
    """Publishes the fixes where it is said where odom begins."""

    block, doc = Fix, "latitude and longitude of the towbody"

    def __init__(self, node: CableSimNode, block: Fix) -> None:
        from .fixes import Fixes

        self.fixes = Fixes(node, block, TOPIC)

    @staticmethod
    def asked(block: Fix) -> bool:
        """Is it said where odom begins?"""
        return block.latitude is not None

    @staticmethod
    def problem(block: Fix, scene: Scene) -> str:
        """ "" or why these parameters cannot be used."""
        given = {"latitude": block.latitude, "longitude": block.longitude}
        if sum(value is not None for value in given.values()) == 1:
            name, other = ("latitude", "longitude") if block.longitude is None else ("longitude", "latitude")
            return (
                f"parameter 'fix.{name}' = {given[name]:g} deg has no fix.{other} beside it: where odom begins is not "
                f"known; nothing was started. Give both, or neither for no {TOPIC}"
            )
        return ""

    def statuses(self) -> list[Status]:
        """The task fix."""
        return self.fixes.statuses()
