"""PID on the length, and a slower PI on the tension: for the truth alone, it hears the load.

After the method of the constant-tension control of a traction winch (feed-forward by a prediction and PID) in
Measurement and Control (2022), doi 10.1177/00202940221094850; its neural network and gains are not reproduced. A
gain on the tension stays below half of 1 / sqrt(EA m), docs/winch.md.
"""

from math import sqrt

from ship import Ship

P, I, D = 0.01, 1e-5, 0.1  # of the length: per period, per period squared, 1
SHARE, SLOW, MEAN = 0.1, 100, 1000  # of the largest gain on the tension; periods of its low-pass and of its mean


def make(at, period):
    ship = Ship(at, period)
    cable = at.cable
    gain = SHARE / sqrt(cable.axial_stiffness * cable.mass_per_length)  # m/s per newton
    sums, before, tension, mean = 0.0, 0.0, None, None

    def controller(row):
        nonlocal sums, before, tension, mean
        ship.read(row)
        tension, mean = (row.tension, row.tension) if mean is None else (tension, mean)
        tension += (row.tension - tension) / SLOW
        mean += (row.tension - mean) / MEAN
        behind = ship.length - ship.paid
        slope, before = (behind - before) / period, behind
        rate = P / period * behind + I / period * sums + D * slope
        command = ship.command(ship.speed + rate + gain * (tension - mean))
        if abs(command.rate) < ship.limit:
            sums += behind
        return command

    return controller
