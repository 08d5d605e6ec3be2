"""An element that is long for a drum or sheave and lies on it, or in it.

Five points of an element of four metres pass a sheave of half a metre without noticing; slack cable brings such
elements onto it. Samples, denser towards its ends, tell: flag COARSE_AT_SURFACE. A load on the part inside, at sixteen
points, was tried: the element cannot bend round the sheave, and Newton fails where it is drawn over it.
"""

from __future__ import annotations

from math import sqrt

from ..compiler.jit import driver, inline
from .contact_surface import GROOVE
from .hermite import shape
from .vec import dot, sub

LONG = 1.5  # radii; longer elements are looked at here
SAMPLES = 24


@inline
def height(s, n, a, b, c, d):
    """Height [m] over the seated radius of a Solid of a point of a cubic; 1 beside the groove.

    a to d: vectors of its Hermite data; n: N_i there.
    """
    rel = (
        n[0] * a[0] + n[1] * b[0] + n[2] * c[0] + n[3] * d[0],
        n[0] * a[1] + n[1] * b[1] + n[2] * c[1] + n[3] * d[1],
        n[0] * a[2] + n[1] * b[2] + n[2] * c[2] + n[3] * d[2],
    )
    rel = sub(rel, s.centre)
    across = dot(rel, s.axis)
    out = sqrt(dot(rel, rel) - across * across) - s.radius
    return 1.0 if s.kind == GROOVE and abs(across) > s.crest else out


@driver
def lies_in(s, limit, a, b, c, d):
    """Is a part of a long element deeper than ``limit`` [m] in a Solid that is round? a to d: its Hermite data."""
    for k in range(SAMPLES + 1):
        t = k / SAMPLES
        if height(s, shape(t * t * (3.0 - 2.0 * t)), a, b, c, d) < -limit:
            return True
    return False
