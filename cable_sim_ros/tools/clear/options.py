"""What is asked of an answer, by options of the command."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from ...sim.scene import Scene
    from .towed import Copy, Tow

LEAST = 0.25  # of the scope, to which is hauled where nobody says how far


class Wanted(NamedTuple):
    """scope, least_scope [m], speed, max_speed, rate [m/s]: None: of the scene, the state or the node; margin, hole and
    corridor [m], acceleration of the ship [m/s^2]; age [s] of a profile that is fresh."""

    scope: float | None
    speed: float | None
    margin: float
    rate: float | None
    least_scope: float | None
    max_speed: float | None
    acceleration: float
    hole: float
    corridor: float
    age: float

    def tow(self, scene: Scene, scope: float, speed: float) -> Tow:
        """The tow that is judged, of a scene with this scope [m] and speed [m/s] unless others are wanted."""
        from .towed import Tow

        rate = scene.winch.max_rate if self.rate is None else self.rate
        speed = speed if self.speed is None else self.speed
        return Tow(scene, self.scope or scope, speed, rate, self.acceleration)

    def least(self, scope: float) -> float:
        """How far is hauled in at most: cable that stays out [m]."""
        return LEAST * scope if self.least_scope is None else self.least_scope

    def deeper(self, copies: dict[str, Copy], depth: float | None) -> float:
        """How far a towbody at ``depth`` [m] is below that of its steady tow; one above it sinks."""
        if depth is None or self.scope is not None or self.speed is not None:
            return 0.0
        return max(depth - copies["itself"].depth, 0.0)
