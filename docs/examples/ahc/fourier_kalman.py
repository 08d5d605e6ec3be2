"""Prediction by Fourier modes with a Kalman filter.

After the method of Kuechler, Mahl, Neupert, Schneider and Sawodny (2011), "Active control for an offshore crane using
prediction of the vessel's motion", IEEE/ASME Transactions on Mechatronics; by their patent US 8 235 231 B2 (2012): a
Fourier transform finds the modes of the motion, an observer their amplitudes and phases, and each mode is turned on by
the dead time. No equation was copied; noises, window and number of modes are choices.
"""

import numpy as np
from ship import Ship

MODES, WINDOW, FIRST, AGAIN = 5, 1024, 200, 100  # modes; samples at most, at the first time, until the next
SETTLE = 300  # samples that a new filter hears first
Q, R = 1e-3, 1e-2  # noise of a mode in a sample over that of a reading, as parts of the variance of the speed
GAIN = 0.01  # per period, of the length


class Modes:
    """A sum of sines: state (a cos, a sin) of each; their turn in a sample; and its covariance."""

    def __init__(self, w, speeds):
        """w: radians a sample; speeds: newest last, which the filter hears to begin with."""
        self.w, self.state, self.sees = w, np.zeros(2 * len(w)), np.tile((1.0, 0.0), len(w))
        self.turn, self.noise = self.turned(1.0), max(float(np.var(speeds)), 1e-12)
        self.cov = self.noise * np.eye(2 * len(w))
        for speed in speeds[-SETTLE:]:
            self.hear(speed)

    def turned(self, samples):
        c, s = np.cos(self.w * samples), np.sin(self.w * samples)
        matrix = np.zeros((2 * len(c), 2 * len(c)))
        for k in range(len(c)):
            matrix[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = (c[k], -s[k]), (s[k], c[k])
        return matrix

    def hear(self, speed):
        self.state = self.turn @ self.state
        self.cov = self.turn @ self.cov @ self.turn.T + Q * self.noise * np.eye(len(self.state))
        gain = self.cov @ self.sees / (self.sees @ self.cov @ self.sees + R * self.noise)
        self.state = self.state + gain * (speed - self.sees @ self.state)
        self.cov -= np.outer(gain, self.sees @ self.cov)


def peaks(speeds):
    """Radians a sample of the largest peaks of the spectrum."""
    size = np.abs(np.fft.rfft((speeds - speeds.mean()) * np.hanning(len(speeds)), 4 * len(speeds)))
    high = np.flatnonzero((size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:])) + 1
    chosen = sorted(high, key=lambda k: -size[k])[:MODES]
    return 2.0 * np.pi * np.array(sorted(chosen)) / (4 * len(speeds))


def make(at, period):
    ship, heard = Ship(at, period), []
    modes = ahead = None

    def controller(row):
        nonlocal modes, ahead
        ship.read(row)
        heard.append(ship.speed)
        if len(heard) >= FIRST and len(heard) % AGAIN == 0:
            window = np.array(heard[-WINDOW:])
            modes = Modes(peaks(window), window)
            ahead = modes.sees @ modes.turned(ship.lead / period)
        elif modes is not None:
            modes.hear(ship.speed)
        speed = ship.speed if modes is None else ahead @ modes.state
        behind = ship.length + ship.lead * 0.5 * (ship.speed + speed) - (ship.paid + ship.coming)
        return ship.command(speed + GAIN / period * behind)

    return controller
