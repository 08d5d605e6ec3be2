"""Sliding mode: the surface  e + L sum(e) = 0  of the length is reached at a rate that does not lessen near it, but for
a boundary layer against chatter.

After the method of the sliding mode controller of a marine winch in Measurement and Control (2022),
doi 10.1177/00202940221101666; surface, reaching law and layer are of this file. No forecast: dead time shows.
"""

from ship import Ship

SLOPE, REACH, LAYER = 0.004, 0.05, 0.02  # per period; parts of the speed's own size: rate, and length over 1 s of it


def make(at, period):
    ship = Ship(at, period)
    sums, size = 0.0, 1e-6

    def controller(row):
        nonlocal sums, size
        ship.read(row)
        size += (abs(ship.speed) - size) / 500.0 if ship.calls > 500 else (abs(ship.speed) - size) / ship.calls
        behind = ship.length - ship.paid - ship.lag * ship.speed  # what the dead time leaves is no error to chase
        surface = behind + SLOPE * sums
        switch = max(-1.0, min(1.0, surface / max(LAYER * 100.0 * period * size, 1e-9)))
        command = ship.command(ship.speed + SLOPE / period * behind + REACH * size * switch)
        if abs(command.rate) < ship.limit:
            sums += behind
        return command

    return controller
