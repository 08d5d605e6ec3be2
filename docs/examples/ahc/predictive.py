"""Model predictive control: the rates of a horizon that keep the length best, of which the first is sent.

After the method of Zinage (2021), "Comparative analysis of different control strategies for active heave compensation",
B.Tech. thesis, IIT Madras, and as Woodacre, Bauer and Irani (2015), "A review of vertical motion heave compensation
systems", Ocean Engineering 104, 140-154, recommend. Model, weights and forecast (a parabola through the last speeds)
are of this file; without limits in the horizon the optimum is one row of a pseudo-inverse.
"""

import numpy as np
from ship import Ship, forecast

COUNT, HORIZON = 40, 10  # speeds in the parabola; periods
LENGTH, CHANGE = 0.2, 1.0  # cost of a length (in period x rate), and of a change of the rate, beside 1 of the rate


def make(at, period):
    ship = Ship(at, period)
    leads = ship.lead / period + np.arange(HORIZON)
    weights = forecast(COUNT, leads, 2)
    sums, steps = np.tril(np.ones((HORIZON, HORIZON))), np.eye(HORIZON) - np.eye(HORIZON, k=-1)
    best = np.linalg.pinv(np.vstack((LENGTH * sums, CHANGE * steps, np.eye(HORIZON))))[0]
    sent = 0.0

    def controller(row):
        nonlocal sent
        ship.read(row)
        speeds = weights @ ship.last(COUNT)
        behind = ship.length + ship.lead * 0.5 * (ship.speed + speeds[0]) - (ship.paid + ship.coming)
        wanted = LENGTH * (behind / period + sums @ speeds)
        smooth = steps @ speeds  # a change that the motion itself makes costs nothing
        smooth[0] = sent + (speeds[1] - speeds[0])
        command = ship.command(best @ np.concatenate((wanted, CHANGE * smooth, speeds)))
        sent = command.rate
        return command

    return controller
