"""A tow in closed form for statistics of a fit, and logs of it with known errors."""

import numpy as np

from cable_sim_ros.tools.calibrate.free import Free
from cable_sim_ros.tools.calibrate.observed import Observed
from cable_sim_ros.tools.calibrate.tow_model import Curve

NUMBERS = [Free("drag", "", 1.8, 1.0, 3.0), Free("weight", "N", 357.0, 250.0, 450.0)]
TRUE = (2.0, 380.0)
PERIOD = 8.0
LASTS = 240.0


def tow(values):
    """Tension and depth as a side-scan tow has them: drag and weight bend both, and each heave shows in the tension."""
    drag, weight = values
    mean = 0.9 * weight + 160.0 * drag
    depth = 54.0 * (weight / 357.0) ** 0.8 * (1.8 / drag) ** 0.6
    size, w = 12.0 * drag**0.5 * (weight / 357.0) ** 0.3, 2.0 * np.pi / PERIOD
    return {
        "tension": Curve(lambda t: mean + size * np.cos(w * t), lambda t: -size * w * np.sin(w * t)),
        "body_depth": Curve(lambda t: depth + 0.3 * np.sin(w * t), lambda t: 0.3 * w * np.cos(w * t)),
    }


def noise(rng, n, correlated):
    """Standard normal noise of the first order; correlated: samples that it is correlated over."""
    a = np.exp(-1.0 / correlated) if correlated else 0.0
    out = rng.standard_normal(n)
    for k in range(1, n):
        out[k] = a * out[k - 1] + (1.0 - a * a) ** 0.5 * out[k]
    return out


def log(seed, correlated=0.0, bias=0.0, lag=0.0, simulate=tow, true=TRUE, lasts=LASTS, begin=0.0):
    """Tension at 5 Hz with 5 N of noise, a bias and a latency; depth at 1 Hz with 0.2 m; the first 2/3 is fitted."""
    rng = np.random.default_rng(seed)
    curves, out = simulate(true), []
    for name, unit, step, size, late, off in (
        ("tension", "N", 0.2, 5.0, lag, bias),
        ("body_depth", "m", 1.0, 0.2, 0.0, 0.0),
    ):
        t = np.arange(begin + 5.0, begin + lasts - 5.0, step)
        value = curves[name].value(t - late) + off + size * noise(rng, len(t), correlated)
        out.append(Observed(name, unit, t, value, None, t < begin + lasts * 2.0 / 3.0))
    return out
