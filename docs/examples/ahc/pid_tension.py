"""PID on the length, and a slower PI on the tension: for the truth alone, it hears the load.

After the method of the constant-tension control of a traction winch (feed-forward by a prediction and PID) in
Measurement and Control (2022), doi 10.1177/00202940221094850; its neural network and gains are not reproduced. A
gain on the tension stays below half of 1 / sqrt(EA m), docs/winch.md.
"""

from math import sqrt

from ship import Ship

P, I, D = 0.02, 2e-5, 0.2  # of the length: per period, per period squared, 1
SHARE, SLOW = 0.1, 1000  # of the largest gain on the tension; periods of its mean


def make(at, period):
    ship = Ship(at, period)
    cable = at.cable
    gain = SHARE / sqrt(cable.axial_stiffness * cable.mass_per_length)  # m/s per newton
    sums, before, mean = 0.0, 0.0, None

    def controller(row):
        nonlocal sums, before, mean
        ship.read(row)
        mean = row.tension if mean is None else mean + (row.tension - mean) / SLOW
        behind = ship.length - ship.paid
        slope, before = (behind - before) / period, behind
        rate = P / period * behind + I / period**2 * sums * period + D * slope
        command = ship.command(ship.speed + rate + gain * (row.tension - mean))
        if abs(command.rate) < ship.limit:
            sums += behind
        return command

    return controller
