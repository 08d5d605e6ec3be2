"""A ship that heaves and rolls at 2.06 m/s, under the names of the FMU."""

from math import cos, pi, sin

from cable_sim_ros import ShipMotion

NAMES = [f"ship.{n}.{a}" for n in ("position", "velocity") for a in "xyz"]
NAMES += [f"ship.attitude.{n}" for n in ("roll", "pitch", "yaw")] + [f"ship.rate.{a}" for a in "xyz"]


def numbers(t):
    """Position, velocity, attitude, rate at t [s], in the order of NAMES."""
    w = 2.0 * pi / 8.0
    heave, surge = (0.5 * sin(w * t), 0.5 * w * cos(w * t)), 2.06
    return [surge * t, 0.0, heave[0], surge, 0.0, heave[1], 0.05 * sin(w * t), 0, 0, 0.05 * w * cos(w * t), 0, 0]


def pushed(t):
    """The same as what a Simulator takes."""
    had = numbers(t)
    return ShipMotion(time_ns=round(t * 1e9), position=had[:3], velocity=had[3:6], attitude=had[6:9], rate=had[9:])
