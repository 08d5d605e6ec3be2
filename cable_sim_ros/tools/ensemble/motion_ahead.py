"""The ship's motion of the seconds ahead: its mean way goes on, and what swung about it in the last minutes repeats.

An assumption, no forecast of the sea: the piece of the past is taken that fits best to what the ship does now.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...sim.inputs import ShipMotion

SECOND = 1_000_000_000
MEAN_OVER = 60.0  # s of the past that say speed and heading
LEAST_STEP, ROWS = 0.1, 800  # s from one sample to the next; samples at most
BLEND = 2.0  # s over which the step from the present to the piece of the past dies out
MATCH = 5.0  # s of the past that are compared with the newest


def motion_ahead(past: Sequence[ShipMotion], end: int) -> list[ShipMotion]:
    """Samples after the newest of ``past`` (evenly apart) to ``end`` [ns], a step past it.

    The swing is that of past samples about a line fitted to each coordinate of the last MEAN_OVER seconds.
    """
    times = np.array([one.time_ns for one in past], np.int64)
    now = int(times[-1])
    t = (times - now) * 1e-9
    angles = np.unwrap(np.array([one.angles for one in past]), axis=0)
    pose = np.hstack((np.array([one.position for one in past]), angles))
    near = t >= -MEAN_OVER
    line = np.polyfit(t[near], pose[near], 1) if near.sum() > 2 else np.vstack((np.zeros(6), pose[-1]))
    line[0, 2:] = 0.0  # the ship neither sinks nor turns on the mean
    line[1, 2:] = pose[near][:, 2:].mean(axis=0)
    swing = pose - (line[1] + np.outer(t, line[0]))
    swing[:, :2] -= swing[near][:, :2].mean(axis=0)
    step = max(LEAST_STEP, (end - now) * 1e-9 / ROWS)
    ahead = np.arange(1, int(np.ceil((end - now) * 1e-9 / step)) + 2) * step
    back = _repeat(t, swing, (end - now) * 1e-9)
    where = (ahead % back) - back
    columns = [np.interp(where, t, swing[:, k]) for k in range(6)]
    offset = swing[-1] - np.array([np.interp(-back, t, swing[:, k]) for k in range(6)])
    poses = line[1] + np.outer(ahead, line[0]) + np.array(columns).T + np.outer(np.exp(-ahead / BLEND), offset)
    all_times, all_poses = np.concatenate(([0.0], ahead)), np.vstack((pose[-1], poses))
    rates = np.gradient(all_poses, all_times, axis=0)[1:]
    return [_sample(now + round(s * SECOND), p, r) for s, p, r in zip(ahead.tolist(), poses, rates, strict=True)]


def _repeat(t: np.ndarray, swing: np.ndarray, seconds: float) -> float:
    """How far back [s] the piece begins: where heave and pitch were most like the last MATCH seconds, as long as what
    is needed where the past is."""
    longest = -float(t[0])
    if longest <= 2.0 * MATCH:
        return longest or 1.0
    dt = longest / (len(t) - 1)
    width = max(2, round(MATCH / dt))
    shape = swing[:, [2, 4]] / np.maximum(swing[:, [2, 4]].std(axis=0), 1e-9)
    newest = shape[-width:]
    least = min(seconds, 0.5 * longest)
    ends = range(width, len(t) - max(round(least / dt), 1), max(1, round(0.1 / dt)))
    best = min(ends, key=lambda k: float(((shape[k - width : k] - newest) ** 2).sum()), default=1)
    return -float(t[best - 1])


def _sample(time: int, pose: np.ndarray, rates: np.ndarray) -> ShipMotion:
    from ...sim.tables.attitude import body_rates

    x = [float(value) for value in pose]
    turn = body_rates(x[3], x[4], rates[3:])
    return ShipMotion(
        time_ns=time,
        position=(x[0], x[1], x[2]),
        velocity=(float(rates[0]), float(rates[1]), float(rates[2])),
        rate=(float(turn[0]), float(turn[1]), float(turn[2])),
        attitude=(x[3], x[4], x[5]),
    )
