"""Attitude of an IMU that tells none: from its rates and accelerations by VQF (Laidig and Seel 2023).

Its heading is relative: it starts anywhere and drifts. Roll and pitch are those of the filter with its own defaults.
"""

from __future__ import annotations

from importlib import import_module

import numpy as np

from ...io.logs.log import SECOND, LogError
from ...io.logs.signals import Signal
from ...sim.tables.attitude import angles_of

RATES = ("roll_rate", "pitch_rate", "yaw_rate")
FORCES = ("acceleration_x", "acceleration_y", "acceleration_z")
SLOWEST = 5.0  # Hz, below it rates do not tell of the angles between them


def can(signals: dict[str, Signal]) -> bool:
    """Are there rates and accelerations?"""
    return all(name in signals for name in (*RATES, *FORCES))


def attitude(signals: dict[str, Signal]) -> tuple[dict[str, Signal], list[str]]:
    """roll, pitch and a relative yaw, and what is assumed of them. LogError where it cannot be."""
    try:
        filtered = import_module("vqf").offlineVQF
    except ImportError:
        raise LogError(
            "the log has rates and accelerations without an orientation, and attitude is made of them with "
            "vqf, which is "
            "not installed; nothing was imported. pip install 'cable_sim_ros[import]', or map a second source"
        ) from None
    time = signals[RATES[0]].time
    origin = int(time[0])
    t = (time - origin) / SECOND
    step = float(np.median(np.diff(t))) if len(t) > 1 else np.inf
    if 1.0 / step < SLOWEST:
        raise LogError(
            f"{signals[RATES[0]].source}: rates come at {1.0 / step:.3g} Hz, below {SLOWEST:g} Hz no "
            f"attitude is made of "
            f"them; nothing was imported. Map a source of roll and pitch"
        )
    at = np.arange(0.0, t[-1] + 1e-9, step)

    def column(name: str) -> np.ndarray:
        one = signals[name]
        return np.interp(at, (one.time - origin) / SECOND, one.value)

    rate = np.ascontiguousarray(np.stack([column(name) for name in RATES], axis=1))
    force = np.ascontiguousarray(np.stack([column(name) for name in FORCES], axis=1))
    up = float(force[:, 2].mean())
    if up < 0.0:
        raise LogError(
            f"{signals[FORCES[2]].source}: the specific force along z of base_link is {up:.3g} m/s^2 in the "
            f"mean, it is "
            f"+9.8 in a ship at rest: the axes are turned; nothing was imported. Give `frame`, or `sign: "
            f"-1` for y and z"
        )
    rotors = filtered(rate, force, None, step)["quat6D"]  # w x y z
    angles = np.unwrap(np.array([angles_of(*row) for row in rotors[:, [1, 2, 3, 0]]]), axis=0)
    stamps = origin + np.round(at * SECOND).astype(np.int64)
    found = {
        name: Signal(name, stamps, angles[:, k], f"{signals[RATES[0]].source}: VQF")
        for k, name in enumerate(("roll", "pitch", "yaw"))
    }
    return found, [
        "attitude: roll and pitch from rates and accelerations by the filter VQF, without a magnetometer; "
        "accelerations "
        f"of the ship bias them (rms of the horizontal specific force: "
        f"{float(np.hypot(force[:, 0], force[:, 1]).std()):.2g} m/s^2)"
    ]
