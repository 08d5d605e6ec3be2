"""Feed-forward of the drive: what is to be added to a set-point y so that the drum, not its set-point, follows y.

Without limits and dead time a drive that is exactly on y takes, see winch.servo and winch_drive.follow_rate,

    servo:        y'' = k1 (u - y) + k2 (u' - y')                    e' = y'' / k2 - (k1 / k2) e
    first order:  y'' = w (u' + g (u - y) - y')                      e' = y'' / w - g e
    second:       y''' = w^2 (u' + g (u - y) - y') - 2 zeta w y''    e' = (2 zeta / w) y'' + y''' / w^2 - g e

with u = y + e. A motor answers as the second, but for the cable's pull. e is a stable filter of y: nothing winds up.
y and y' are taken from the ship's motion. y'' and y''' come from y' through s / (1 + s/w_f)^2 and s of that; the lag
2 / w_f of y'' is taken back by its own rate, so that it is late by nothing to first order and has a bounded gain.
"""

import numpy as np

from ..compiler.jit import driver

FEED_FORWARD = np.dtype(
    [
        ("on", "i8"),  # 1: wanted; may be changed between ticks
        ("share", "f8"),  # 0 to 1, how far it is taken up
        ("second", "f8"),  # s, s^2, 1/s: factors of y'', y''' and -e in e'
        ("third", "f8"),
        ("back", "f8"),
        ("bandwidth", "f8"),  # rad/s, w_f
        ("input", "f8"),  # m/s, y' before; low-passed, m/s; its rate, m/s^2
        ("smooth", "f8"),
        ("slope", "f8"),
        ("driven", "f8"),  # m/s, what drives e
        ("lead", "f8"),  # m, e
    ],
    align=True,
)


@driver
def begin_lead(law, rate):
    """Begin at a set-point that goes with ``rate`` [m/s] as if it always had."""
    law.input, law.smooth, law.slope, law.driven, law.lead = rate, rate, 0.0, 0.0, 0.0


@driver
def lead_drive(law, rate, h):
    """What to add to a set-point of this rate [m/s] after a step of h [s], m, and its rate; law: FEED_FORWARD."""
    w, k = law.bandwidth, 0.5 * h
    before, slope = law.input, law.slope
    pull = w * w * (before + rate - 2.0 * law.smooth - k * slope) - 2.0 * w * slope
    law.slope = (slope + k * pull) / (1.0 + 2.0 * w * k + w * w * k * k)
    law.smooth += k * (slope + law.slope)
    law.input = rate
    third = w * w * (rate - law.smooth) - 2.0 * w * law.slope
    driven = law.second * (law.slope + 2.0 / w * third) + law.third * third
    law.lead = (law.lead + k * (law.driven + driven - law.back * law.lead)) / (1.0 + k * law.back)
    law.driven = driven
    return law.lead, driven - law.back * law.lead
