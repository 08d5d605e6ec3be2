"""Set-point law of constant tension: pays out above a set tension and hauls in below it.

e: measured less set tension, low-passed; L' = k e - L / t_r, within a rate and within an excursion. L is the only
integral and stands at its limits, so nothing winds up: it turns back as soon as e changes its sign. It also stays within
a second of the largest rate of what was paid out: a drive that cannot follow does not wind it up either. The return
t_r draws L to the start: a tow pulls harder the more cable is out, so that without it a mean error runs away.
"""

from __future__ import annotations

import numpy as np

from .jit import driver
from .setpoint_limits import within

TENSION = np.dtype(
    [
        ("wanted", "f8"),  # N; 0: that of the static start
        ("at_start", "f8"),  # N
        ("gain", "f8"),  # m/(N s)
        ("time", "f8"),  # s, of the low-pass
        ("max_rate", "f8"),  # m/s
        ("back", "f8"),  # 1/s, of the return; 0: none
        ("error", "f8"),  # N, low-passed, and before that
        ("newest", "f8"),
        ("length", "f8"),  # m, and its rate
        ("rate", "f8"),
        ("held", "i8"),  # 1: by a limit
    ],
    align=True,
)
AT_LIMIT = 1.0  # s, time constant of the approach to the largest excursion, and how far it may be ahead of the drum


@driver
def begin_tension(law, length, rate):
    """Take over at a set-point [m] and its rate."""
    law.length, law.rate = length, rate
    law.error = (rate + law.back * length) / law.gain
    law.newest = law.error


@driver
def hold_tension(law, tension, paid, most, h):
    """Set-point [m] and its rate after a step of h [s].

    law: TENSION; tension: measured, N; paid: m that the set-point of the compensation has moved the drum; most: m,
    largest excursion either way.
    """
    newest = tension - (law.wanted if law.wanted > 0.0 else law.at_start)
    k = 0.5 * h / law.time
    law.error += k / (1.0 + k) * (newest + law.newest - 2.0 * law.error)
    law.newest = newest
    asked, _ = within(law.gain * law.error - law.back * law.length, law.max_rate)
    reach = law.max_rate * AT_LIMIT
    high, low = min(most, paid + reach), max(-most, paid - reach)
    rate = min(asked, max(high - law.length, 0.0) / AT_LIMIT)
    rate = max(rate, min(low - law.length, 0.0) / AT_LIMIT)
    law.held = 1 if rate != asked or abs(law.gain * law.error) > law.max_rate else 0
    law.length += 0.5 * h * (law.rate + rate)
    law.rate = rate
    return law.length, law.rate
