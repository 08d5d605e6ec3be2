"""Limits of a set-point that change nothing far below them."""

from math import exp

from ..compiler.jit import inline

KNEE = 0.8  # share of a limit up to which nothing is changed


@inline
def within(x, maximum):
    """x within +-most, and the derivative: x itself up to KNEE of it, from there on an exponential approach."""
    size, knee = abs(x), KNEE * maximum
    if size <= knee:
        return x, 1.0
    if maximum <= 0.0:
        return 0.0, 0.0
    slope = exp((knee - size) / (maximum - knee))
    y = maximum - (maximum - knee) * slope
    return (y if x > 0.0 else -y), slope
