"""Mesh of a tow whose winch feeds cable: how many elements, how long, and where.

Made from an accuracy (sim/mesh_maker.py); numbers that the scene writes under ``mesh`` stand. docs/mesh.md.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from .mesh_kinds import FeedMesh, MeshError, MeshPlan, places_outboard
from .mesh_maker import Maker
from .route import Route
from .scene import Scene


def feed_mesh(scene: Scene) -> FeedMesh | None:
    """The scene's mesh; None where it is fixed to the material. Raises MeshError."""
    found = mesh_plan(scene)
    return None if found is None else found.mesh


def mesh_plan(scene: Scene) -> MeshPlan | None:
    """The scene's mesh with its reasons; None where it is fixed to the material. Raises MeshError."""
    return _plan(scene.model_dump_json()) if Route(scene).feeds else None


def arc_lengths_at_start(scene: Scene) -> np.ndarray:
    """Arc lengths [nodes] of a fed mesh at the start, m from the cable's inner end. Raises MeshError."""
    plan, route = mesh_plan(scene), Route(scene)
    if plan is None:
        raise ValueError("the mesh of winch.drum = contact is cable.sections.*.elements")
    out = places_outboard(plan.mesh, route.total, route.wound)
    return np.concatenate((route.wound + plan.mesh.aboard, out[1:]))


@lru_cache(32)
def _plan(text: str) -> MeshPlan:
    return Maker(Scene.model_validate_json(text)).plan()


__all__ = ["FeedMesh", "MeshError", "MeshPlan", "arc_lengths_at_start", "feed_mesh", "mesh_plan"]
