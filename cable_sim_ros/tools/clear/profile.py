"""The ground ahead: depths over the distance along the track, from the ship's reference point, positive ahead."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...io.sources.csv_table import MotionError, head_of, numbers_of

COLUMNS = ("distance_m", "depth_m")
EXAMPLE = ",".join(COLUMNS)
FARTHEST = 1e6  # m
DRIFTS = 0.05  # of the distance: courses made good of 20 s scatter by 1 to 2 deg in a sea
MOST = 2000  # points that are looked at: of more, the shallowest of each stretch


class ProfileError(MotionError):
    """No profile that can be judged; the text says why."""


class Profile(NamedTuple):
    """distance [n] m, rising; depth [n] m below the mean water surface, positive down; gaps [k, 2] m: between points
    further apart than may be; notes: what was left out, a line each."""

    distance: np.ndarray
    depth: np.ndarray
    gaps: np.ndarray
    notes: list[str]

    def ground(self, place: np.ndarray) -> np.ndarray:
        """Depth [m] at places [m]; infinite where it is not known."""
        depth = np.interp(place, self.distance, self.depth, np.inf, np.inf)
        k = np.searchsorted(self.gaps[:, 0], place) - 1 if len(self.gaps) else np.full(place.shape, -1)
        inside = (k >= 0) & (place < self.gaps[k, 1]) if len(self.gaps) else np.zeros(place.shape, bool)
        return np.where(inside, np.inf, depth)


def profile_of(distance: np.ndarray, depth: np.ndarray, hole: float, where: str) -> Profile:
    """From points in the order they came; hole: distance between points [m] from which nothing is known between them.

    Points that run back are put in their place, of two at one distance the shallower counts. Raises ProfileError.
    """
    notes = []
    good = np.isfinite(distance) & np.isfinite(depth) & (np.abs(distance) <= FARTHEST) & (np.abs(depth) <= FARTHEST)
    if not good.all():
        notes.append(
            f"{where}: {int((~good).sum())} of {len(good)} points have no number that can be, and are left out"
        )
    distance, depth = distance[good], depth[good]
    if len(distance) < 2:
        raise ProfileError(f"{where}: {len(distance)} points are no profile; nothing was judged. Give two or more")
    if (depth > 0.0).sum() * 2 < len(depth):
        raise ProfileError(
            f"{where}: most depths are not positive; nothing was judged. Give depths below the mean water surface, "
            f"positive down"
        )
    back = np.flatnonzero(np.diff(distance) <= 0.0)
    if len(back):
        notes.append(
            f"{where}: runs back at {len(back)} points, first from {distance[back[0]]:.5g} to "
            f"{distance[back[0] + 1]:.5g} m: points are put in order, of two at one place the shallower counts"
        )
    order = np.lexsort((depth, distance))
    distance, depth = distance[order], depth[order]
    first = np.concatenate([[True], np.diff(distance) > 0.0])
    distance, depth = distance[first], depth[first]
    if len(distance) > MOST:
        part = np.linspace(0, len(distance), MOST + 1).astype(int)
        pick = np.unique([a + int(np.argmin(depth[a:b])) for a, b in zip(part, part[1:]) if b > a])
        notes.append(f"{where}: of {len(distance)} points the shallowest of {len(pick)} stretches are looked at")
        distance, depth = distance[pick], depth[pick]
    wide = np.flatnonzero(np.diff(distance) > hole)
    gaps = np.column_stack([distance[wide], distance[wide + 1]])
    if len(gaps):
        told = ", ".join(f"{a:.5g} to {b:.5g} m" for a, b in gaps[:3]) + (", ..." if len(gaps) > 3 else "")
        notes.append(f"{where}: holes wider than {hole:g} m are not judged: {told}")
    return Profile(distance, depth, gaps, notes)


def read_profile(path: Path, hole: float) -> Profile:
    """The profile of a CSV file with the columns COLUMNS. Raises ProfileError, MotionError."""
    names, below = head_of(path, EXAMPLE)
    missing = [name for name in COLUMNS if name not in names]
    if missing:
        raise ProfileError(f"{path}: has no column {missing[0]}; nothing was judged. The first line is {EXAMPLE}")
    kept = [(i, cells) for i, cells in below if all(cell.strip() for cell in cells)]
    rows = numbers_of(path, names, kept)[1]
    distance, depth = (rows[:, names.index(name)] for name in COLUMNS)
    one = profile_of(distance, depth, hole, str(path))
    if lost := len(below) - len(kept):
        one.notes.insert(0, f"{path}: {lost} rows with an empty cell are left out")
    return one


def ahead_of(points: np.ndarray, ship: np.ndarray, heading: float, corridor: float, hole: float, where: str) -> Profile:
    """The profile of points [n, 3] in odom, z up, within ``corridor`` [m] + DRIFTS of the distance of the track of a
    ship at x, y [m] that goes on at this heading [rad]. Raises ProfileError."""
    along = np.array([np.cos(heading), np.sin(heading)])
    away = points[:, :2] - ship
    near = np.abs(away @ np.array([-along[1], along[0]])) <= corridor + DRIFTS * np.abs(away @ along)
    order = np.argsort(away[near] @ along, kind="stable")
    one = profile_of((away[near] @ along)[order], -points[near, 2][order], hole, where)
    if not near.all():
        one.notes.append(
            f"{where}: {int((~near).sum())} of {len(near)} points are beside the track by {corridor:g} m and "
            f"{100.0 * DRIFTS:g} % of their distance"
        )
    return one._replace(notes=[note for note in one.notes if "runs back" not in note])


def values_of(message: Any) -> np.ndarray:
    """x, y, z [n, 3] of a sensor_msgs/PointCloud2. Raises ProfileError."""
    kinds = {7: "f4", 8: "f8"}  # FLOAT32, FLOAT64 of sensor_msgs/PointField
    fields = {field.name: field for field in message.fields}
    order = ">" if message.is_bigendian else "<"
    count = message.width * message.height
    if any(name not in fields or fields[name].datatype not in kinds for name in "xyz"):
        raise ProfileError("clear/profile: has no x, y, z of 4 or 8 byte floats; nothing was judged. Send these fields")
    names, formats, offsets = zip(*((n, order + kinds[fields[n].datatype], fields[n].offset) for n in "xyz"))
    layout = np.dtype(
        {"names": names, "formats": formats, "offsets": offsets, "itemsize": max(int(message.point_step), 1)}
    )
    data = bytes(message.data)
    if len(data) < count * layout.itemsize:
        raise ProfileError(
            f"clear/profile: {len(data)} bytes are not {count} points; nothing was judged. Send it whole"
        )
    rows = np.frombuffer(data, layout, count)
    return np.stack([rows[name].astype(float) for name in "xyz"], axis=1)
