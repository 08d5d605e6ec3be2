"""Prediction of a set-point over a dead time tau: weighted least squares on a chain of filters, as it goes.

Regressors are the rate of the set-point and FILTERS - 1 Laguerre filters of it (one low-pass and all-passes of pole
POLE: eight seconds of the past). What a set-point did in the tau after an earlier moment, its way and its rate at the
end, is regressed on the regressors of that moment:

    R <- l R + x x^T + (1 - l) r I,  B <- l B + x z^T + (1 - l) r C0,  R C = B,  l = exp(-interval / MEMORY)

C0 goes on at the rate of now and r is small, so the answer begins there, R stays positive definite and all is bounded.
The answer is kept within MARGIN of the fastest that was seen in the last MEMORY, and its way follows its rate.
Moments are SAMPLES to a dead time and wait for what they see: nothing is taken from the future.
"""

from math import exp, sqrt

import numpy as np

from ..compiler.jit import driver, inline
from .setpoint_limits import within

FILTERS = 8
SAMPLES = 8
POLE = 4.0  # rad/s
FILLED = 3.0 * FILTERS / POLE  # s, after which the filters have forgotten where they began: the first moment
MEMORY = 60.0  # s
QUIET = 1e-3  # m/s, rms of a motion that teaches nothing
SOONEST = 0.05  # s from one moment to the next at least
SMOOTH = 0.5  # s, time constant with which new coefficients are taken up, and the way follows what is predicted
MARGIN = 1.5
IDLE = -1.0  # of a moment's waiting time: none is kept there

PREDICTION = np.dtype(
    [
        ("on", "i8"),  # 1: wanted; may be changed between ticks
        ("share", "f8"),  # 0 to 1, how far it is taken up
        ("horizon", "f8"),  # s
        ("filtered", "f8", FILTERS),  # m/s
        ("products", "f8", (FILTERS, FILTERS)),  # R and its Cholesky factor, m^2/s^2
        ("factor", "f8", (FILTERS, FILTERS)),
        ("way_products", "f8", FILTERS),  # columns of B, of C and of what is in use of C: way and rate
        ("rate_products", "f8", FILTERS),
        ("way_found", "f8", FILTERS),
        ("rate_found", "f8", FILTERS),
        ("way", "f8", FILTERS),
        ("rate", "f8", FILTERS),
        ("kept", "f8", (SAMPLES, FILTERS)),  # moments: regressors, set-point [m], s that each still waits
        ("kept_length", "f8", SAMPLES),
        ("waits", "f8", SAMPLES),
        ("next", "i8"),  # the one to write, and s until then
        ("until", "f8"),
        ("length", "f8"),  # m, m/s: set-point at the last step
        ("before", "f8"),
        ("fastest", "f8"),  # m/s
        ("lead", "f8"),  # m, what is added to the set-point, and its rate
        ("lead_rate", "f8"),
    ],
    align=True,
)


@inline
def interval(law):
    """Seconds from one moment to the next."""
    return max(law.horizon / SAMPLES, SOONEST)


@driver
def begin_prediction(law, length, rate):
    """Begin with nothing learnt at a set-point [m] that goes with ``rate`` [m/s]."""
    rest = QUIET * QUIET * MEMORY / interval(law)
    for i in range(FILTERS):
        law.filtered[i] = 0.0
        for j in range(FILTERS):
            law.products[i, j] = rest if i == j else 0.0
        law.way_found[i] = law.way[i] = law.horizon if i == 0 else 0.0
        law.rate_found[i] = law.rate[i] = 1.0 if i == 0 else 0.0
        law.way_products[i], law.rate_products[i] = rest * law.way[i], rest * law.rate[i]
    for i in range(SAMPLES):
        law.waits[i] = IDLE
    law.next, law.until, law.length, law.before, law.fastest = 0, FILLED, length, rate, abs(rate)
    law.lead, law.lead_rate = law.horizon * rate, 0.0


@driver
def filter_rate(law, rate, h):
    """Take the chain of filters over a step of h [s] to a rate [m/s]."""
    x, k = law.filtered, 0.5 * POLE * h
    old, new = x[0], rate
    x[0] = rate
    for i in range(1, FILTERS):
        before = x[i]
        if i == 1:
            x[i] = ((1.0 - k) * before + k * (old + new)) / (1.0 + k)
        else:
            x[i] = ((1.0 - k) * before + (k - 1.0) * new + (1.0 + k) * old) / (1.0 + k)
        old, new = before, x[i]


@driver
def learn(law, x, way, rate):
    """Take in what a set-point did after a moment of these regressors: its way [m] and rate [m/s]."""
    kept = exp(-interval(law) / MEMORY)
    rest = (1.0 - kept) * QUIET * QUIET * MEMORY / interval(law)
    r, g = law.products, law.factor
    for i in range(FILTERS):
        for j in range(FILTERS):
            r[i, j] = kept * r[i, j] + x[i] * x[j]
        r[i, i] += rest
        law.way_products[i] = kept * law.way_products[i] + x[i] * way + (rest * law.horizon if i == 0 else 0.0)
        law.rate_products[i] = kept * law.rate_products[i] + x[i] * rate + (rest if i == 0 else 0.0)
    for i in range(FILTERS):
        for j in range(i + 1):
            s = r[i, j]
            for n in range(j):
                s -= g[i, n] * g[j, n]
            g[i, j] = s / g[j, j] if j < i else sqrt(max(s, 0.1 * rest))
    substitute(g, law.way_products, law.way_found)
    substitute(g, law.rate_products, law.rate_found)


@driver
def substitute(g, b, c):
    """Solve G G^T c = b for a lower triangle G."""
    for i in range(FILTERS):
        s = b[i]
        for n in range(i):
            s -= g[i, n] * c[n]
        c[i] = s / g[i, i]
    for m in range(FILTERS):
        i = FILTERS - 1 - m
        s = c[i]
        for n in range(i + 1, FILTERS):
            s -= g[n, i] * c[n]
        c[i] = s / g[i, i]


@driver
def predict(law, length, rate, h):
    """What to add to a set-point (length [m], rate [m/s]) at the end of a step of h [s] so that it is that of a horizon
    later, and its rate; law: PREDICTION."""
    filter_rate(law, rate, h)
    for n in range(SAMPLES):
        if law.waits[n] < 0.0:
            continue
        if law.waits[n] > h:
            law.waits[n] -= h
            continue
        s = law.waits[n] / h
        then = law.before + s * (rate - law.before)
        way = law.length + s * (length - law.length) - 0.5 * h * s * (1.0 - s) * (rate - law.before)
        law.waits[n] = IDLE
        learn(law, law.kept[n], way - law.kept_length[n], then)
    law.until -= h
    if law.until <= 0.0:
        n = law.next
        for i in range(FILTERS):
            law.kept[n, i] = law.filtered[i]
        law.kept_length[n], law.waits[n] = length, law.horizon
        law.next, law.until = (n + 1) % SAMPLES, interval(law)
    law.length, law.before = length, rate
    law.fastest = max(abs(rate), law.fastest * exp(-h / MEMORY))
    share = h / (SMOOTH + h)
    way, ahead = 0.0, 0.0
    for i in range(FILTERS):
        law.way[i] += share * (law.way_found[i] - law.way[i])
        law.rate[i] += share * (law.rate_found[i] - law.rate[i])
        way += law.way[i] * law.filtered[i]
        ahead += law.rate[i] * law.filtered[i]
    most = MARGIN * law.fastest
    way, _ = within(way, most * law.horizon)
    ahead, _ = within(ahead, most)
    change = ahead - rate
    change += (way - law.lead - 0.5 * h * (law.lead_rate + change)) / (SMOOTH + 0.5 * h)
    law.lead += 0.5 * h * (law.lead_rate + change)
    law.lead_rate = change
    return law.lead, law.lead_rate
