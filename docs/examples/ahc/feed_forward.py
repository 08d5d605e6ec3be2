"""Feed-forward of the sheave's speed, forecast over the dead time, and a Smith predictor for the length.

After the method of Seong, Choi, Jeong and Lee (2016), "A heave compensation system for offshore crane" (in Korean),
koreascience JAKO201621650894308: proportional-derivative control with an estimate over a time delay of 0.1 s. The
estimate here is a straight line through the last speeds; their estimator was not reproduced.
"""

from ship import Ship, forecast

COUNT, GAIN = 12, 0.01  # speeds in the line; per period, of the length


def make(at, period):
    ship = Ship(at, period)
    weights = forecast(COUNT, ship.lead / period, 1)[0]

    def controller(row):
        ship.read(row)
        speed = weights @ ship.last(COUNT)
        behind = ship.length + ship.lead * 0.5 * (ship.speed + speed) - (ship.paid + ship.coming)
        return ship.command(speed + GAIN / period * behind)

    return controller
