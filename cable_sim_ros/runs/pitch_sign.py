"""Is the pitch of the motion bow down where it is positive, as the axes here have it? The surge says so.

A ship on a long wave slides down its slope: bow up is pulled astern, bow down ahead, with a share of g times the
angle. Between the acceleration ahead and the pitch (positive bow down, x forward, z up) recorded ships have
correlations of +0.90 (NBP1406) and +0.60 (LMG1903, calm); a pitch that is positive bow up, as most sensors
count it, has their negatives.
"""

from __future__ import annotations

import numpy as np

from ..sim.checks.deviation_checks import PITCHED_OVER, pitch_against
from ..sim.verdict import Reason


def look(frames: np.recarray) -> list[Reason]:
    """A reason to doubt the run whose pitch goes against its surge; none where one of them is missing or too small."""
    time = (frames["time"] - frames["time"][0]) * 1e-9 if len(frames) else np.zeros(0)
    if len(time) < 10 or time[-1] < PITCHED_OVER:
        return []
    x, y, z, w = np.asarray(frames["ship_quaternion"], float).T
    pitch = np.degrees(np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0)))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    velocity = np.asarray(frames["ship_velocity"], float)
    surge = np.gradient(velocity[:, 0] * np.cos(yaw) + velocity[:, 1] * np.sin(yaw), time)
    with np.errstate(invalid="ignore", divide="ignore"):
        agree = float(np.corrcoef(surge, pitch)[0, 1])
    return list(pitch_against(float(pitch.std()), float(surge.std()), agree))
