"""A place along a track: how far behind its end, measured on it, and how far to the side."""

from __future__ import annotations

import numpy as np

BEHIND = 3.0  # times the distance of a place from the end: so much of the track is looked at
LONGEST = 2000  # samples of it, at most


def along_track(track: np.ndarray, places: np.ndarray, course: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of each place [n, 2] the way [n] m behind the ship on its own track so far, and the distance [n] m from it, to
    starboard positive. track [n, 2]; course [n] rad: before its beginning the track goes straight on backwards.
    """
    steps = np.hypot(*np.diff(track, axis=0, prepend=track[:1]).T)
    chainage = np.cumsum(steps)
    reach = float(np.nanmax(np.hypot(*(places - track).T), initial=1.0)) * BEHIND
    first = track[0] - reach * np.array([np.cos(course[0]), np.sin(course[0])])
    way, marks = np.vstack([first, track]), np.concatenate([[-reach], chainage])
    behind, aside = np.full(len(track), np.nan), np.full(len(track), np.nan)
    for k, place in enumerate(places):
        if not np.isfinite(place).all():
            continue
        begin = max(0, int(np.searchsorted(marks, chainage[k] - reach)) - 1, k - LONGEST)
        a, b = way[begin : k + 1], way[begin + 1 : k + 2]
        leg = b - a
        square = np.maximum((leg * leg).sum(1), 1e-12)
        share = np.clip(((place - a) * leg).sum(1) / square, 0.0, 1.0)
        off = place - (a + share[:, None] * leg)
        near = int(np.argmin((off * off).sum(1)))
        size = float(np.hypot(*leg[near])) or 1.0
        port = (leg[near, 0] * off[near, 1] - leg[near, 1] * off[near, 0]) / size
        side = 1.0 if port <= 0.0 else -1.0
        aside[k] = side * float(np.hypot(*off[near]))
        behind[k] = chainage[k] - (marks[begin + near] + share[near] * (marks[begin + near + 1] - marks[begin + near]))
    return behind, aside
