"""Set-point laws of the waterline, Westin (2018) (1): the length below the water stays that of the start."""

from math import cos, sin

from ..compiler.jit import inline
from .setpoint_limits import within


@inline
def height_gain(theta, maximum):
    """Pay-out per height of the sheave, 1/cos theta up to ``maximum``, and its derivative; theta: rad, less than
    pi/2."""
    c = cos(theta)
    gain, slope = within(1.0 / c, maximum)
    return gain, slope * sin(theta) / (c * c)


@inline
def below_water(state, sheave, theta, turn):
    """Pay-out [m] that keeps the length below the water, and its rate; theta: rad, turn: its rate."""
    p, v = sheave.position, sheave.velocity
    gain, slope = height_gain(theta, state.max_gain)
    still, _ = height_gain(state.angle, state.max_gain)
    return p[2] * gain - state.height * still, v[2] * gain + p[2] * slope * turn
