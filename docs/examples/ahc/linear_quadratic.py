"""Linear-quadratic control with an integral, the dead time among the states; feed-forward without a forecast.

After the method of linear-quadratic regulation with integral action as textbooks have it (python-control's
`lqr(..., integral_action=...)` documents the same), compared for heave compensation by Zinage (2021), see
predictive.py. For  e' = s - u,  i' = e  the delayed rates are states of their own; weights are a choice.
"""

import numpy as np
from scipy.linalg import solve_discrete_are
from ship import Ship

INTEGRAL, LENGTH, RATE = 0.01, 0.1, 1.0  # weights, of periods x length, length and period x rate


def gains(delay):
    """K [2 + delay] of u = -K (i, e, rates on their way, oldest first); in periods."""
    n = 2 + delay
    a, b = np.zeros((n, n)), np.zeros((n, 1))
    a[0, :2], a[1, 1] = 1.0, 1.0
    if delay:
        a[1, 2], b[-1, 0] = -1.0, 1.0
        a[2:, 2:] = np.eye(delay, k=1)
    else:
        b[1, 0] = -1.0
    q = np.diag([INTEGRAL**2, LENGTH**2] + [0.0] * delay)
    p = solve_discrete_are(a, b, q, np.array([[RATE**2]]))
    return np.linalg.solve(RATE**2 + b.T @ p @ b, b.T @ p @ a)[0]


def make(at, period):
    ship = Ship(at, period)
    gain, sums = gains(len(ship.flight)), 0.0
    added = np.zeros(len(ship.flight))  # rates beyond the feed-forward, on their way

    def controller(row):
        nonlocal sums, added
        ship.read(row)
        behind = ship.length - ship.paid
        more = -gain @ np.concatenate(((sums, behind), period * added)) / period
        command = ship.command(ship.speed + more)
        if abs(command.rate) < ship.limit:  # no wind-up
            sums += behind
        added = np.append(added, more)[1:] if len(added) else added
        return command

    return controller
