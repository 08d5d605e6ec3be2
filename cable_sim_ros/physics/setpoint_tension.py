"""Set-point law of constant tension: pays out above a set tension and hauls in below it.

e: measured less set tension, low-passed. L' = k e + w - (L - L_0) / t_r with w' = k e / t_i - w / t_r, within a rate
and an excursion.
What a limit holds back is taken from w within t_i, and L stands at its limits: nothing winds up, it turns back as soon
as e does. L also stays within a second of the largest rate of what was paid out, so that a drive that cannot follow
winds nothing up either.
That is how a tow answers at once. In the end most pull harder the more cable is out (dT/dL > 0: drag, weight), and what
holds for waves would run away. The return t_r therefore leaves k t_r (1 + t_r / t_i) dT/dL, the loop's gain of a mean
error, well below 1, and draws L to the length whose tension at rest is the set one; see sim/compensation_setup.py.

The drum meets a passive cable: what k e alone takes from it is power, so k damps the swinging of cable and body. What
turns its phase is w, low-pass, drive and dead time; k and t_i go with them, see sim/compensation_setup.py.
"""

import numpy as np

from ..compiler.jit import driver, inline
from .setpoint_limits import within

TENSION = np.dtype(
    [
        ("wanted", "f8"),  # N; 0: that of the static start
        ("at_start", "f8"),  # N
        ("goal", "f8"),  # N, set tension in force; 0: not begun
        ("gain", "f8"),  # m/(N s), k
        ("time", "f8"),  # s, of the low-pass
        ("integral_time", "f8"),  # s, t_i
        ("max_rate", "f8"),  # m/s
        ("back", "f8"),  # 1/s, of the return; 0: none
        ("slope", "f8"),  # N/m, dT/dL at rest; 0: not known
        ("home", "f8"),  # m, L_0
        ("error", "f8"),  # N, low-passed, and before that
        ("newest", "f8"),
        ("sum", "f8"),  # m/s, w
        ("length", "f8"),  # m, and its rate
        ("rate", "f8"),
        ("held", "i8"),  # 1: by a limit
    ],
    align=True,
)
SEEN = 1e-3  # m/s; so much less than was asked for counts as limited
CHANGE = 1.0  # s, time constant with which another set tension is taken up
HOME = 600.0  # s, with which L_0 follows: slowly, as cable that is paid out slackens until the tow has sunk
AT_LIMIT = 1.0  # s, time constant of the approach to the largest excursion, and how far it may be ahead of the drum


@inline
def goal_of(law):
    """Set tension [N] that is asked for."""
    return law.wanted if law.wanted > 0.0 else law.at_start


@driver
def begin_tension(law, length, rate, tension):
    """Take over at a set-point [m] and its rate with a measured tension [N]."""
    law.length, law.rate = length, rate
    law.goal = goal_of(law)
    law.error = law.newest = tension - law.goal
    law.sum = rate + law.back * (length - law.home) - law.gain * law.error


@driver
def hold_tension(law, tension, paid, most, h):
    """Set-point [m] and its rate after a step of h [s].

    law: TENSION; tension: measured, N; paid: m that the set-point of the compensation has moved the drum; most: m,
    largest excursion either way.
    """
    law.goal += (goal_of(law) - law.goal) * (h / (h + CHANGE) if law.goal > 0.0 else 1.0)
    newest, before, k = tension - law.goal, law.error, 0.5 * h / law.time
    law.error += k / (1.0 + k) * (newest + law.newest - 2.0 * before)
    law.newest = newest
    more = 0.5 * h * (law.gain / law.integral_time * (before + law.error) - 2.0 * law.back * law.sum)
    if law.slope != 0.0:
        law.home += (min(max((law.goal - law.at_start) / law.slope, -most), most) - law.home) * (h / (h + HOME))
    wanted = law.gain * law.error + law.sum + more - law.back * (law.length - law.home)
    asked, _ = within(wanted, law.max_rate)
    reach = law.max_rate * AT_LIMIT
    high, low = min(most, paid + reach), max(-most, paid - reach)
    rate = min(asked, max(high - law.length, 0.0) / AT_LIMIT)
    rate = max(rate, min(low - law.length, 0.0) / AT_LIMIT)
    law.held = 1 if abs(wanted - rate) > SEEN else 0
    law.sum += more + (rate - wanted) * h / (h + law.integral_time)
    law.length += 0.5 * h * (law.rate + rate)
    law.rate = rate
    return law.length, law.rate
