"""Added mass of a body with an attitude given as a matrix: is it one, and that of a body in water?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...physics.towbody import Towbody
from ..problem import Problem
from ..scene import Scene
from ..tables.rigid_tables import added_of, added_point, extent, inertia_of, moved

ROUND_OFF = 1e-9  # of the trace
UNLIKE = 0.05  # of what is given: a matrix further from symmetric is none of added mass
SAID = 1e-6  # of it, below which a difference is that of printed digits
NEGATIVE = 0.01  # of the mean eigenvalue: the error of a panel method, in roll above all


def semidefinite(matrix: np.ndarray) -> bool:
    """Has a symmetric matrix no negative eigenvalue, but for round-off? By elimination, in the same order anywhere."""
    m, least = matrix.astype(float), -ROUND_OFF * float(np.trace(matrix))
    for i in range(len(m)):
        if m[i, i] < least:
            return False
        if m[i, i] <= -least:
            if np.any(np.abs(m[i, i + 1 :]) > -2.0 * least):
                return False
            continue
        m[i + 1 :] -= m[i + 1 :, i : i + 1] * m[i] / m[i, i]
    return True


def unlike(body: Towbody) -> tuple[float, int, int]:
    """How far a given matrix is from symmetric, over the largest numbers of its blocks, and where: row and column."""
    matrix = np.array(body.added_matrix, float).reshape(6, 6)
    of_block = np.repeat([np.abs(matrix[:3, :3]).max(), np.abs(matrix[3:, 3:]).max()], 3)
    size = np.maximum(np.sqrt(np.outer(of_block, of_block)), 1e-300)
    off = np.abs(matrix - matrix.T) / size
    i, k = np.unravel_index(int(np.argmax(off)), off.shape)
    return float(off[i, k]), int(i), int(k)


def added_mass_problems(scene: Scene, key: str, body: Towbody) -> Iterator[Problem]:
    """What makes the matrix of a body none of added mass: its size, its symmetry, energy that is negative."""
    key = f"{key}.added_matrix"
    if body.added_matrix is None:
        if body.added_matrix_point is not None:
            yield Problem(f"{key}_point", "is given and added_matrix is not: it would do nothing", "Give both")
        return
    if any(body.added_mass) or body.added_inertia is not None:
        yield Problem(
            key,
            "stands beside added_mass or added_inertia: both would be the whole added mass",
            "Leave one of them out",
        )
    if len(body.added_matrix) != 36:
        yield Problem(
            key,
            f"has {len(body.added_matrix)} numbers, and added mass is six rows of six: x, y, z, then about x, y, z",
            "Give each row in full, those of coupling too",
        )
        return
    size, i, k = unlike(body)
    if size > UNLIKE:
        yield Problem(
            key,
            f"is not symmetric: {body.added_matrix[6 * i + k]:.4g} in row {i + 1}, column {k + 1}, and "
            f"{body.added_matrix[6 * k + i]:.4g} in row {k + 1}, column {i + 1}, apart by {size:.2g} of the largest of "
            f"their blocks (limit {UNLIKE:g})",
            "Check rows, axes (z up) and units: kg, kg m in the two coupling blocks, kg m^2",
        )
        return
    length = extent(body, scene.gravity, scene.water.density)[0]
    per = np.array([1.0, 1.0, 1.0, *[1.0 / length] * 3])  # turns as the velocity of what is a length away
    added = np.outer(per, per) * added_of(body, scene.gravity, scene.water.density)
    mean = max(float(np.trace(added)) / 6.0, 0.0)
    if not semidefinite(added + NEGATIVE * mean * np.eye(6)):
        yield Problem(
            key,
            f"has the eigenvalue {np.linalg.eigvalsh(added)[0]:.4g} kg (turns times the length, {length:.3g} m), less "
            f"than -{NEGATIVE:g} of their mean, {mean:.4g} kg: water would lose energy where the body moves it",
            "Check signs and units; near the surface take that of infinite frequency, which is never negative",
        )
        return
    assert body.centre_of_gravity is not None
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = body.mass * np.eye(3), inertia_of(body)
    both = moved(mass, body.centre_of_gravity) + moved(added / np.outer(per, per), added_point(body))
    both = np.outer(per, per) * both
    if not semidefinite(both):
        yield Problem(
            key,
            f"with mass and inertia of the body has the eigenvalue {np.linalg.eigvalsh(both)[0]:.4g} kg (turns times "
            f"the length, {length:.3g} m): a force would move it the other way",
            "Check added_matrix_point and inertia, or leave small negative numbers out",
        )


def added_mass_warnings(key: str, body: Towbody) -> Iterator[Problem]:
    """A matrix that is made symmetric."""
    if body.added_matrix is None:
        return
    size, i, k = unlike(body)
    if size > SAID:
        yield Problem(
            f"{key}.added_matrix",
            f"is taken as the mean of itself and its transpose: they differ by up to {size:.2g} of the largest of a "
            f"block, {body.added_matrix[6 * i + k]:.6g} in row {i + 1}, column {k + 1} and "
            f"{body.added_matrix[6 * k + i]:.6g} across",
            "More panels make it symmetric",
        )
