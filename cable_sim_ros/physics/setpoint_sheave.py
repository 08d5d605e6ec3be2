"""Set-point laws of the sheave, Westin (2018) (2): what the sheave moves along the cable is paid out."""

from math import cos, sin

from ..compiler.jit import inline


@inline
def along_cable(state, sheave, theta, turn):
    """Motion [m] of the sheave from its mean track along a cable that leaves at ``theta`` [rad], and its rate.

    state: SETPOINT; turn: rate of theta [rad/s].
    """
    p, v = sheave.position, sheave.velocity
    c, s = cos(state.track[2]), sin(state.track[2])
    x, y = p[0] - state.track[0], p[1] - state.track[1]
    dx, dy, dz = c * x + s * y, c * y - s * x, p[2] - state.height
    vx = c * (v[0] - state.track_speed[0]) + s * (v[1] - state.track_speed[1]) + dy * state.track_speed[2]
    length = dx * sin(theta) + dz * cos(theta)
    rate = vx * sin(theta) + v[2] * cos(theta) + (dx * cos(theta) - dz * sin(theta)) * turn
    return length, rate
