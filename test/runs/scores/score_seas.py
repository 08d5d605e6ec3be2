"""Seas of known statistics for the tests of scores: irregular, regular, with noise; as signals on clocks."""

import numpy as np

from cable_sim_ros.tools.logs.own_signals import Signal

EPOCH = 1_400_000_000_000_000_000


def sea(seed, seconds=600.0, rate=10.0, peak=9.0, lag=0.0, drift=0.0):
    """Times [s] and a sea of unit variance, Pierson-Moskowitz with a peak period [s]; it comes a lag later."""
    rng = np.random.default_rng(seed)
    f = np.linspace(0.05, 0.3, 200) + rng.uniform(-0.0005, 0.0005, 200)
    power = f**-5 * np.exp(-1.25 * (1.0 / peak / f) ** 4)
    phase = rng.uniform(0.0, 2.0 * np.pi, 200)
    time = np.arange(int(seconds * rate)) / rate
    at = time - lag - drift * (time - time.mean())
    return time, (np.sqrt(2.0 * power / power.sum()) * np.cos(2.0 * np.pi * np.outer(at, f) + phase)).sum(axis=1)


def signal(time, value, quantity="tension", source="test"):
    return Signal(quantity, EPOCH + np.round(np.asarray(time) * 1e9).astype(np.int64), np.asarray(value, float), source)
