"""What the controllers beside this file share: the speed that a winch has to pay out with, from the truth or from an
MRU, what it has paid out, and the rates that are still on their way to it."""

from collections import deque
from math import cos, pi, sin

import numpy as np

from cable_sim_ros import WinchCommand

RAMP, LEAK = 100, 2000  # periods: to the full gain; in which an old length is forgotten


def forecast(count, leads, order):
    """Weights [leads, count] of the last samples, newest last: their polynomial at these periods after the newest."""
    past = np.vander(np.arange(count) - (count - 1.0), order + 1)
    return np.vander(np.atleast_1d(leads), order + 1) @ np.linalg.pinv(past)


class Ship:
    """at: the scene, or on the track for prediction the rig; period: of the control, s."""

    def __init__(self, at, period):
        self.at, self.period, self.heard = at, period, hasattr(at, "latency")
        dead = at.dead_time if self.heard else at.drive.dead_time
        self.limit = at.max_rate if self.heard else at.winch.max_rate
        self.lag = dead + 0.5 * period  # s from a command to the middle of what it does
        self.lead = self.lag + (at.latency if self.heard else 0.0)  # s from what was read to that
        self.flight = deque([0.0] * max(0, round(dead / period)))  # rates that have not come to the winch
        self.calls = self.length = self.paid = self.speed = 0.0
        self.datum, self.angle = None, at.angle if self.heard else 0.0
        self.speeds = deque([0.0] * 200, maxlen=200)

    def read(self, row):
        """Take a row: speed [m/s] and length [m] of the sheave along the cable, and what is paid out [m]."""
        if not self.heard:
            self.datum, self.angle = (
                (row.payout, row.departure_angle) if self.datum is None else (self.datum, self.angle)
            )
            ahead, up, self.paid = row.sheave_ahead_rate, row.sheave_up_rate, row.payout - self.datum
        else:
            (x, y, z), at = self.at.sheave, self.at
            undone = 4.0 * pi * at.heave_damping / at.heave_period if at.heave_period else 0.0  # of its high-pass
            ahead = row.surge_rate + undone * row.surge + z * row.pitch_rate
            up = row.heave_rate + undone * row.heave - x * row.pitch_rate + y * row.roll_rate
        self.calls += 1
        self.speed = min(1.0, self.calls / RAMP) * float(ahead * sin(self.angle) + up * cos(self.angle))
        self.speeds.append(self.speed)
        self.length += self.period * self.speed - self.length / LEAK

    @property
    def coming(self):
        """Length [m] that the rates on their way will pay out."""
        return self.period * sum(self.flight)

    def last(self, count):
        """The last speeds, newest last."""
        return np.array(self.speeds)[-count:]

    def command(self, rate):
        """The command of a rate within the limit."""
        rate = max(-self.limit, min(self.limit, float(rate)))
        self.flight.append(rate)
        came = self.flight.popleft()
        if self.heard:  # nobody says what the winch did
            self.paid += self.period * came
        return WinchCommand(rate=rate)
