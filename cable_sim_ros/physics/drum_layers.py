"""Layers of cable on the drum: radius, lay and turns by the length that is wound.

Cable is wound in layers of equal width, turn beside turn, to and fro. With N turns a layer, r_0 the radius of the
cable's centreline in the first and e the rise from one to the next, layer i = 0, 1, ... has r_i = r_0 + i e, and the
layers below it hold

    S_i = 2 pi N (i r_0 + e i (i - 1) / 2)                                                                          (1)

The radius goes over from one layer to the next within the turn about the change, and the lay turns round there, both
without a jump of their rates.
"""

from math import floor, pi, sqrt

from ..compiler.jit import inline


@inline
def below(drum, i):
    """Length [m] in the layers under number i, from 0; (1)."""
    return 2.0 * pi * drum.lay_turns * i * (drum.radius + 0.5 * drum.lay_rise * (i - 1.0))


@inline
def layer_of(drum, wound):
    """Number, from 0, of the layer in which the length ``wound`` [m] on the drum ends; (1) solved for i."""
    e, b = 0.5 * drum.lay_rise, drum.radius - 0.5 * drum.lay_rise
    x = max(wound, 0.0) / (2.0 * pi * drum.lay_turns)
    if e <= 0.0:
        return floor(x / b)
    i = floor(2.0 * x / (b + sqrt(b * b + 4.0 * e * x)))
    if below(drum, i + 1.0) <= wound:  # round-off at a change
        i += 1.0
    elif below(drum, i) > wound:
        i -= 1.0
    return i


@inline
def radius_of(drum, wound):
    """Radius [m] of the cable's centreline where it runs onto the drum, with the length ``wound`` [m] on it."""
    return radius_and_slope(drum, wound)[0]


@inline
def radius_and_slope(drum, wound):
    """`radius_of` and its change per length wound."""
    if drum.lay_turns <= 0.0:
        return drum.radius, 0.0
    i = layer_of(drum, wound)
    r = drum.radius + i * drum.lay_rise
    begin, end = below(drum, i), below(drum, i + 1.0)
    half = pi * drum.radius  # half a turn of the first layer: the same on both sides of a change
    s, slope = 0.0, 0.0
    if i > 0.0 and wound - begin < half:
        u = 0.5 + 0.5 * (wound - begin) / half
        s, slope = u * u * (3.0 - 2.0 * u) - 1.0, 3.0 * u * (1.0 - u) / half
    elif end - wound < half:
        u = 0.5 - 0.5 * (end - wound) / half
        s, slope = u * u * (3.0 - 2.0 * u), 3.0 * u * (1.0 - u) / half
    return r + s * drum.lay_rise, slope * drum.lay_rise


@inline
def second_moment(drum, wound):
    """Integral of r^2 over the length wound [m^3]: inertia of the cable on the drum about its axis over its mass per
    length, turn for turn: sum of 2 pi N r_i^3 over full layers."""
    i, r, e = layer_of(drum, wound), drum.radius, drum.lay_rise
    one, two = 0.5 * i * (i - 1.0), i * (i - 1.0) * (2.0 * i - 1.0) / 6.0  # sums of the numbers below i, their squares
    full = i * r**3 + 3.0 * r * r * e * one + 3.0 * r * e * e * two + e**3 * one * one
    return 2.0 * pi * drum.lay_turns * full + (r + i * e) ** 2 * (wound - below(drum, i))


@inline
def lay_of(drum, wound):
    """Place [m] across the drum at which the cable leaves it, from its middle to port, and its change per length wound.

    The first layer is wound from starboard to port.
    """
    if drum.lay_turns <= 0.0:
        return 0.0, 0.0
    i = layer_of(drum, wound)
    r = drum.radius + i * drum.lay_rise
    turn, width = 2.0 * pi * r, drum.lay_turns * drum.lay_pitch
    u = (wound - below(drum, i)) / turn  # turns of the layer
    way = 1.0 if i % 2.0 == 0.0 else -1.0
    y, slope, left = u * drum.lay_pitch - 0.5 * width, 1.0, drum.lay_turns - u
    if u < 0.5 and i > 0.0:
        y, slope = y + drum.lay_pitch * (0.5 - u) ** 2, 2.0 * u
    elif left < 0.5:
        y, slope = y - drum.lay_pitch * (0.5 - left) ** 2, 2.0 * left
    return way * y, way * slope * drum.lay_pitch / turn


@inline
def turns_of(drum, wound):
    """Turns on the drum of the length ``wound`` [m]."""
    if drum.lay_turns <= 0.0:
        return wound / (2.0 * pi * drum.radius)
    i = layer_of(drum, wound)
    return i * drum.lay_turns + (wound - below(drum, i)) / (2.0 * pi * (drum.radius + i * drum.lay_rise))
