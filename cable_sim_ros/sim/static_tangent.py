"""Tangent of a static tow: its balance at nodes of one's choice, and how its nodes answer to a change of the balance.

At rest the residual r(u, p) of the nodes u vanishes. A change of a number p of the scene moves them by du/dp = -K^-1
dr/dp, K = dr/du. K is the tangent of Newton's method, r what the static start brings to zero: the same compiled calls.
"""

from __future__ import annotations

from math import radians
from typing import NamedTuple

import numpy as np

from ..compiler.jit import YES, driver
from ..physics.block_tridiagonal import RHS, solve, solve_again
from ..physics.contact import LOADED
from ..physics.integrate import face
from ..physics.line import residual
from ..physics.state import AT_REST, FLOW, NOW
from ..physics.water_kinematics import STILL
from ..physics.wind import wash
from .mesh.mesh_kinds import FeedMesh
from .scene import Scene
from .simulator import Simulator

FLANKS = slice(4, 6)  # columns of the contact table: line loads


@driver
def factorise(line, state):
    """Factorise the tangent of the balance at rest in the work space, with Newton's correction of the present nodes in
    work.step. Returns False where it is singular."""
    wash(line, state, STILL)
    residual(line, state, AT_REST, YES)
    return solve(state.work.band, state.work.lower, state.work.factor, state.work.step)


class Balance(NamedTuple):
    """A tow at rest with given nodes: residual [nodes, 6] (N, N m per slope; 0 where held), tick output, and which of
    the contact points on the sheave are loaded."""

    residual: np.ndarray
    frame: np.record
    loaded: tuple[bool, ...]


class Tangent(NamedTuple):
    """The factorised tangent K of a balance, of the block-tridiagonal form of physics/block_tridiagonal.py."""

    band: np.ndarray
    lower: np.ndarray
    factor: np.ndarray

    def solve(self, load: np.ndarray) -> np.ndarray:
        """Nodes' answer K^-1 load [nodes, 6] to a change of the residual [nodes, 6]."""
        x = np.zeros_like(load)
        self.band[:, :, RHS] = load
        solve_again(self.band, self.lower, self.factor, x)
        return x


class SetOut:
    """A scene set out for a static start on a mesh of one's choice; its nodes do not come to rest by themselves.

    mesh: None: that of the sections; flow [nodes, 6]: past the bodies at the start of another tow, which counts where
    there is too little of it to turn them.
    """

    def __init__(self, scene: Scene, mesh: FeedMesh | None, flow: np.ndarray):
        self.sim = Simulator(scene, mesh)
        self.sim.set_out(0, (0.0, 0.0), radians(scene.ship.heading_deg))
        self.flow = flow

    def at(self, q: np.ndarray) -> Balance:
        """The balance with the nodes at ``q`` [nodes, 6]; those that are held stay where they are held. Bodies face the
        flow where they are, strumming is that of this shape."""
        sim, state = self.sim, self.sim.state
        state.q[:], state.nodes[NOW, FLOW] = q, self.flow
        sim.bring_to_rest(0)
        face(sim.model.line, state)
        sim.bring_to_rest(0)
        loaded = sim.contact[:, FLANKS].sum(axis=1) > LOADED
        return Balance(-state.work.band[:, :, RHS], sim.frame.copy(), tuple(loaded.tolist()))

    def tangent(self) -> Tangent | None:
        """K of the last balance; None where it is singular."""
        sim, work = self.sim, self.sim.state.work
        if not factorise(sim.model.line, sim.state):
            return None
        return Tangent(work.band.copy(), work.lower.copy(), work.factor.copy())
