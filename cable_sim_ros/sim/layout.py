"""Layout: a scene laid out once, for its checks, its numbers and its start.

Route over drum and sheave, mesh with its reasons, static shapes, and what lies where at the start. Each part is made
when it is first asked for: a scene whose drum stands in its sheave has no route, one that fixes its mesh no plan.
Lengths are of unstretched cable, m from its inner end.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from math import cos, hypot, radians, sin
from typing import NamedTuple, TypeVar

import numpy as np

from ..physics.towbody import BodyModel
from ..physics.winch import DrumModel
from .mesh.mesh_kinds import FeedMesh, MeshPlan, places_outboard
from .mesh.mesh_maker import Maker
from .scene import Scene
from .statics.route import Route, first_angle
from .statics.static_shape import TowShape, tow_shape
from .statics.vehicle_shape import vehicle_shape
from .tables.current import flow_of
from .tables.material import arc_lengths

KEPT = 32  # layouts
KEPT_SHAPES = 128
# what no shape of a tow depends on: scenes that differ in it alone share their shapes
NOT_OF_SHAPES = (
    *("name", "air", "drive", "setpoint", "instruments", "faults", "contact", "vehicle", "rules", "accuracy", "mesh"),
)
# longest element on the sheave over its radius: with compensation on, ripple of the tension above 1 Hz was measured as
# 0.03 % at 0.25, 0.05 % at 0.4, 0.15 % at 0.6, 0.36 % at 1.2 (full scale, docs/accuracy.md)
FINE_ELEMENT = 0.4


class Element(NamedTuple):
    """An element at the start: its ends [m] and its section."""

    first: float
    last: float
    section: str


class Layout:
    """A scene laid out; made by `layout_of`."""

    def __init__(self, scene: Scene):
        self.scene = scene

    @cached_property
    def route(self) -> Route:
        """From the drum to the sheave and outboard. Drum and sheave must be apart, see checks.problems()."""
        return Route(self.scene)

    @property
    def tangent(self) -> float:
        """Where the cable meets the sheave."""
        return self.route.wound + self.route.span

    @cached_property
    def leaves(self) -> float:
        """Where the cable leaves the sheave, by the angle of a straight free cable."""
        return self.tangent + self.route.on_sheave(first_angle(self.scene, self.water_speed))

    @cached_property
    def water_speed(self) -> float:
        """Speed [m/s] of the ship through the water at its surface."""
        ship, heading = self.scene.ship, radians(self.scene.ship.heading_deg)
        east, north = flow_of(self.scene.water, heading)(0.0)
        return hypot(ship.tow_speed * cos(heading) - east, ship.tow_speed * sin(heading) - north)

    @cached_property
    def plan(self) -> MeshPlan | None:
        """The mesh with its reasons; None where it is fixed to the material. Raises MeshError.

        Made from an accuracy (mesh/mesh_maker.py); numbers that the scene writes under ``mesh`` stand. docs/mesh.md.
        """
        return Maker(self.scene, self.route, self.shape).plan() if self.route.feeds else None

    @property
    def mesh(self) -> FeedMesh | None:
        """The mesh of a winch that feeds cable: how many elements, how long, and where. Raises MeshError."""
        return None if self.plan is None else self.plan.mesh

    @cached_property
    def arc(self) -> np.ndarray:
        """Places [nodes] of the nodes at the start. Raises MeshError."""
        if self.mesh is not None:
            out = places_outboard(self.mesh, self.route.total, self.route.wound)
            return _locked(np.concatenate((self.route.wound + self.mesh.aboard, out[1:])))
        return _locked(arc_lengths(self.scene.cable))

    @cached_property
    def elements(self) -> list[Element]:
        """Every element from the drum end, as the start has it. Raises MeshError."""
        sections, start, out = self.scene.cable.sections, 0.0, []
        if self.scene.winch.drum == DrumModel.FEED:
            arc, names = self.arc, list(sections)
            ends = np.cumsum([section.length for section in sections.values()])
            held = np.minimum(np.searchsorted(ends, 0.5 * (arc[1:] + arc[:-1])), len(names) - 1)
            return [Element(float(a), float(b), names[i]) for a, b, i in zip(arc[:-1], arc[1:], held, strict=True)]
        for name, section in sections.items():
            size = section.length / section.meshed
            out += [Element(start + k * size, start + (k + 1) * size, name) for k in range(section.meshed)]
            start += section.length
        return out

    @cached_property
    def fine_zone(self) -> tuple[float, float]:
        """Lengths [m] of the zone with elements fine enough for the sheave, on its inboard and its outboard side.

        It is what the winch may pay out, and haul in, before a coarser element comes onto the sheave (trap T6): what
        lies on the sheave belongs to neither. (0, 0) when the element at the tangent point is itself too long.
        """
        limit, table = FINE_ELEMENT * self.scene.sheave.radius * (1 + 1e-9), self.elements
        here = next((i for i, element in enumerate(table) if element.first <= self.tangent < element.last), None)
        if here is None or table[here].last - table[here].first > limit:
            return 0.0, 0.0
        low = high = here
        while low > 0 and table[low - 1].last - table[low - 1].first <= limit:
            low -= 1
        while high + 1 < len(table) and table[high + 1].last - table[high + 1].first <= limit:
            high += 1
        return self.tangent - table[low].first, max(0.0, table[high].last - self.leaves)

    def shape(self, scope: float | None = None, heading: float | None = None) -> TowShape:
        """Static shape with ``scope`` [m] out, None: that of the start; heading: yaw of the ship [rad], None: the
        scene's. The sheave stands at its mean place."""
        scope = self.route.scope if scope is None else scope
        key = (self._of_shapes, scope, heading)
        return _kept(_shapes, key, KEPT_SHAPES, lambda: self._static_shape(scope, heading))

    @cached_property
    def _of_shapes(self) -> str:
        """What a shape is made of."""
        driven = self.scene.towbody.model is BodyModel.VEHICLE
        return self.scene.model_dump_json(exclude=set() if driven else {*NOT_OF_SHAPES})

    def _static_shape(self, scope: float, heading: float | None) -> TowShape:
        if self.scene.towbody.model is BodyModel.VEHICLE:
            shape = vehicle_shape(self.scene, self.route, scope, heading)
        else:  # whoever makes a shape of what its key leaves out, fails
            seen = self.scene.model_copy(update=dict.fromkeys(NOT_OF_SHAPES))
            shape = tow_shape(seen, self.route, scope, heading)
        for part in shape:
            if isinstance(part, np.ndarray):
                _locked(part)
        return shape


def _locked(array: np.ndarray) -> np.ndarray:
    """Read-only: what equal scenes share is written by none of them."""
    array.setflags(write=False)
    return array


K = TypeVar("K")
V = TypeVar("V")
_made: dict[str, Layout] = {}
_shapes: dict[tuple[str, float, float | None], TowShape] = {}


def _kept(made: dict[K, V], key: K, most: int, make: Callable[[], V]) -> V:
    """What was made for the key, or is now."""
    found = made.get(key)
    if found is None:
        found = make()
        while len(made) >= most:
            made.pop(next(iter(made)), None)
        made[key] = found
    return found


def layout_of(scene: Scene) -> Layout:
    """The Layout of a scene, made once: equal scenes share it."""
    return _kept(_made, scene.model_dump_json(), KEPT, lambda: Layout(scene))


__all__ = ["FINE_ELEMENT", "Element", "Layout", "layout_of"]
