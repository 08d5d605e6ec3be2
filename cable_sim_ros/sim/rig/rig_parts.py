"""What a line of one's own is put together from: its cable from plain numbers, its loads, the rules of its steps."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ...physics.ancf import ADDED_MASS, BUOYANCY, DISPLACED, HALF_RHO_D, RE_FACTOR
from ...physics.cable_assembly import Cable, Section
from ...physics.drag_laws import DragLaw
from ...physics.integrate import Solver
from ...physics.state import LOAD
from ...physics.substeps import MAX_TURN, NO_LIMIT
from ..build import Rules

FOLDING = 1e-7  # cable.compression_share of a cable that goes slack
SHIPPED = Solver()  # the defaults of the product: step, rho_inf, tolerance
WHOLE = Rules(0, NO_LIMIT, NO_LIMIT)  # steps as asked for, or not at all
HALVED = Rules(SHIPPED.max_halvings, NO_LIMIT, NO_LIMIT)  # halved where Newton does not solve them
WHIPPING = Rules(10, MAX_TURN, NO_LIMIT)  # and where they turn the cable far: for one that goes slack


def cable_of(sections: list[dict], **numbers: Any) -> Cable:
    """A Cable of the product from plain numbers; a section without a drag law has none.

    Slack elements push, as in scenes by default; a case whose cable goes slack lets them fold (FOLDING).
    """
    named = {f"s{i}": Section(**({"drag_law": DragLaw.OFF} | s)) for i, s in enumerate(sections)}
    return Cable(sections=named, **({"diameter": 0.01} | numbers))


def load_of(node: int, force: npt.ArrayLike = (0.0, 0.0, 0.0), moment: npt.ArrayLike = (0.0, 0.0, 0.0)) -> np.ndarray:
    """A LOAD record: dead force [N] on a node, moment [N m] on its tangent."""
    row = np.zeros((), LOAD)
    row["node"], row["force"], row["moment"] = node, force, moment
    return row


def rows_in_air(elements: np.ndarray) -> np.ndarray:
    """The element table without water: no drag, added mass and buoyancy at any height."""
    elements = elements.copy()
    elements[:, [HALF_RHO_D, RE_FACTOR, ADDED_MASS, BUOYANCY, DISPLACED]] = 0.0
    return elements
