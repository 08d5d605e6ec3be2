"""The string of a span: tension, mass, diameter and flow along it, travel time of its waves.

Between two places of a table tension and mass are linear. With the root of the tension as variable the travel time
is 2 ds / (sqrt T_a + sqrt T_b) times a mean of sqrt m: exact for constant mass, without a limit to take at w = 0.
"""

from __future__ import annotations

from functools import cached_property
from math import pi

import numpy as np
from scipy.integrate import trapezoid

from .span import Span

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
NODES, WEIGHTS = 0.5 * (NODES + 1.0), 0.5 * WEIGHTS


class Line:
    """A span as functions of arc s [m]; arrays in, arrays of the same shape out."""

    def __init__(self, span: Span):
        cable, table = span.cable, span.profile
        self.length = cable.length
        self.added = span.water.density * cable.added_mass_coefficient * 0.25 * pi  # kg/m^3, of D^2
        self.density = span.water.density
        self.stiffness = cable.bending_stiffness
        self.knots = np.array(table.arc or (0.0, cable.length))
        ends = np.full(len(self.knots), 1.0)
        start = span.tension.start or 0.0
        self._tension = np.array(table.tension or start + span.tension.gradient * self.knots)
        self._mass = np.array(table.mass_per_length or cable.mass_per_length * ends)
        self._diameter = np.array(table.diameter or cable.diameter * ends)
        self._flow = np.array(span.flow.arc), np.array(span.flow.speed)
        self.strouhal = span.flow.strouhal

    def tension(self, s):
        """T(s) [N]."""
        return np.interp(s, self.knots, self._tension)

    def diameter(self, s):
        """D(s) [m]."""
        return np.interp(s, self.knots, self._diameter)

    def mass(self, s):
        """Mass per length with added mass m_t(s) [kg/m]."""
        return np.interp(s, self.knots, self._mass) + self.added * self.diameter(s) ** 2

    def flow(self, s):
        """Speed normal to the cable V(s) [m/s]."""
        return np.interp(s, *self._flow)

    def shedding(self, s):
        """Shedding frequency f_s(s) = St V / D [Hz]."""
        return self.strouhal * self.flow(s) / self.diameter(s)

    def impedance(self, s):
        """sqrt(m_t T) [kg/s]: the amplitude of a wave goes as its inverse root."""
        return np.sqrt(self.mass(s) * self.tension(s))

    def travel_time(self, s):
        """tau(s) [s]: time of a wave from s = 0 to s, (3.15)."""
        s = np.asarray(s, float)
        at = np.unique(np.concatenate((self.knots, s.ravel(), (0.0, self.length))))
        root, step = np.sqrt(self.tension(at)), np.diff(at)
        both = root[1:] + root[:-1]
        fraction = NODES * (2.0 * root[:-1, None] + NODES * np.diff(root)[:, None]) / both[:, None]
        mean = np.sqrt(self.mass(at[:-1, None] + step[:, None] * fraction)) @ WEIGHTS
        tau = np.concatenate(((0.0,), np.cumsum(2.0 * step / both * mean)))
        return np.interp(s, at, tau)

    def time_left(self, s):
        """tau(L) - tau(s) [s]; nothing at the end, without a rounding error."""
        return np.where(np.asarray(s) == self.length, 0.0, self.crossing - self.travel_time(s))

    @cached_property
    def crossing(self) -> float:
        """tau(L) [s]."""
        return float(self.travel_time(self.length))

    @cached_property
    def mean_tension(self) -> float:
        """Mean of T along the cable [N]."""
        return float(trapezoid(self._tension, self.knots) / self.length)

    @cached_property
    def bend(self) -> float:
        """kappa [s^2] of omega^2 = omega_string^2 (1 + kappa omega_string^2): (5.21) with the mean tension."""
        return self.stiffness * self.crossing**2 / (self.mean_tension * self.length**2)

    @cached_property
    def shedding_range(self) -> tuple[float, float]:
        """Least and largest shedding frequency along the cable [Hz]."""
        at = np.linspace(0.0, self.length, 2001)
        f = self.shedding(np.unique(np.concatenate((at, self.knots, self._flow[0]))))
        return float(f.min()), float(f.max())
